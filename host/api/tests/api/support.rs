//! A plant that answers wishes and remembers them, and requests as bytes.

use latchwork_api::client::{Client, ClientError};
use latchwork_api::{Config, Limits, Server};
use latchwork_block::upgrade::{self, Change, Fate, Field, PortChange};
use latchwork_plant::operate::{
    AlarmRow, Answer, ForceRow, Operation, Operator, Policy, Refused, TagRow, Wishes, console,
};
use latchwork_plant::swap::{BlockPlan, Deviation, FailedRun, ShadowReport, Stage, SwapStatus, Version};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use tempfile::TempDir;

/// Longer than anything here takes on a busy machine; a wait that long is a failure.
pub(crate) const LONG: Duration = Duration::from_secs(30);

/// A wish as it came.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wish {
    pub(crate) operator: Operator,
    pub(crate) operation: Operation,
    pub(crate) forbidden: Option<String>,
}

/// What the fake plant shares with the test.
#[derive(Default)]
pub(crate) struct Plant {
    wishes: Mutex<Vec<Wish>>,
    /// The value of `unit.outputs.level`.
    pub(crate) level: AtomicI64,
    /// It does not answer.
    pub(crate) hangs: AtomicBool,
    end: AtomicBool,
}

/// A plant with a control socket.
pub(crate) struct Rig {
    pub(crate) folder: TempDir,
    pub(crate) plant: Arc<Plant>,
    pub(crate) server: Option<Server>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.server = None;
        self.end_plant();
    }
}

pub(crate) fn rig(given: &[(&'static str, &str)], limits: Limits) -> Rig {
    let folder = TempDir::new().expect("a folder");
    let plant = Arc::new(Plant::default());
    let (console, wishes) = console();
    let shared = Arc::clone(&plant);
    let thread = std::thread::spawn(move || run(&wishes, &shared));
    let mut policy = Policy::default();
    for (right, whom) in given {
        policy.give(right, whom.parse().expect("it names somebody"));
    }
    let config = Config {
        socket: folder.path().join("plant.sock"),
        plant: "pumps".into(),
        policy,
        data: Some(folder.path().join("data")),
        limits,
    };
    let server = Server::start(config, console).expect("the socket opens");
    Rig { folder, plant, server: Some(server), thread: Some(thread) }
}

impl Rig {
    pub(crate) fn socket(&self) -> PathBuf {
        self.folder.path().join("plant.sock")
    }

    pub(crate) fn client(&self) -> Client {
        Client::new(&self.socket(), "script").expect("a client")
    }

    pub(crate) fn connect(&self) -> UnixStream {
        let stream = UnixStream::connect(self.socket()).expect("it listens");
        stream.set_read_timeout(Some(LONG)).expect("a timeout");
        stream
    }

    /// Status and body of a request; `head` is what stands above the empty line, without `host`.
    pub(crate) fn raw(&self, head: &str, body: &str) -> (u16, String) {
        let mut stream = self.connect();
        let length = if body.is_empty() { String::new() } else { format!("content-length: {}\r\n", body.len()) };
        write!(stream, "{head}\r\nhost: x\r\nconnection: close\r\n{length}\r\n{body}").expect("it is taken");
        answer(&mut stream)
    }

    /// Wishes since the last call.
    pub(crate) fn wishes(&self) -> Vec<Wish> {
        std::mem::take(&mut self.plant.wishes.lock().expect("no panic"))
    }

    pub(crate) fn end_plant(&mut self) {
        self.plant.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the plant has not panicked");
        }
    }
}

/// Status and body of an answer that ends with the connection.
pub(crate) fn answer(stream: &mut UnixStream) -> (u16, String) {
    let mut bytes = Vec::new();
    // A connection that is cut while the rest of a request is on its way ends with an error, after the answer.
    let _ = stream.read_to_end(&mut bytes);
    let text = String::from_utf8(bytes).expect("text");
    let status = text.get(9..12).and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("no answer: {text:?}"));
    let body = text.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, body.into())
}

/// Status, reason and message of a refusal.
#[track_caller]
pub(crate) fn refused<T: std::fmt::Debug>(result: Result<T, ClientError>) -> (u16, String, String) {
    match result {
        Err(ClientError::Refused { status, reason, message }) => (status, reason, message),
        other => panic!("expected a refusal, found {other:?}"),
    }
}

fn run(wishes: &Wishes, plant: &Plant) {
    while !plant.end.load(Ordering::Relaxed) {
        match wishes.next() {
            Some(_) if plant.hangs.load(Ordering::Relaxed) => {}
            Some(pending) => {
                let answer = match &pending.forbidden {
                    Some(why) => Err(Refused::new("forbidden", why.as_str())),
                    None => execute(plant, &pending.operation),
                };
                plant.wishes.lock().expect("no panic").push(Wish {
                    operator: pending.operator.clone(),
                    operation: pending.operation.clone(),
                    forbidden: pending.forbidden.clone(),
                });
                pending.answer(answer);
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

pub(crate) fn level(value: i64) -> TagRow {
    let value = Value::from(value);
    TagRow { tag: "unit.outputs.level".into(), ty: "s64".into(), value, quality: "good", forced: false }
}

fn lamp() -> TagRow {
    let value = Value::Bool(true);
    TagRow { tag: "field.lamp".into(), ty: "bool".into(), value, quality: "bad", forced: true }
}

/// A swap with something in each of its fields.
pub(crate) fn swap() -> SwapStatus {
    let text = |s: &str| s.to_owned();
    let version = |name: &str| Version {
        component: text(name),
        hash: "5e".repeat(32),
        size: 20_480,
        class: text("acme:tanks/tank@1.0.0"),
        imports: vec![text("latchwork:block/log")],
        path: text("plain"),
    };
    let inputs = vec![(text("level"), text("7"))];
    let fault = FailedRun { kind: text("trap"), message: text("unreachable"), at: 3, inputs: inputs.clone() };
    let deviation = Deviation {
        port: text("outputs.level"),
        count: 1,
        first: 2,
        worst: 0.5,
        worst_at: 2,
        running: text("1"),
        candidate: text("1.5"),
        inputs,
    };
    let shadow = ShadowReport {
        block: text("unit"),
        deviations: vec![deviation],
        fault: Some(fault),
        ..ShadowReport::default()
    };
    let field = |name: &str, fate| Field { name: text(name), ty: text("u64"), fate };
    let plan = BlockPlan {
        block: text("unit"),
        old: version("tank"),
        new: version("tank-2"),
        ports: vec![PortChange {
            part: upgrade::Part::Inputs,
            name: text("gain"),
            change: Change::Added { ty: text("f64") },
        }],
        state: vec![field("starts", Fate::Converted { from: text("u32"), to: text("u64") })],
        settings: vec![field("pulse", Fate::Carried)],
        broken: vec![text("nothing leads to it")],
        notes: vec![text("a note")],
    };
    SwapStatus {
        number: 7,
        stage: Stage::Shadow,
        message: String::new(),
        user: text("alice"),
        asked: 1,
        blocks: vec![plan],
        left: 700,
        shadow: vec![shadow],
        prepare_ns: 2,
        exchange_ns: 3,
        exchanged_at: 4,
        saved: false,
    }
}

fn execute(plant: &Plant, operation: &Operation) -> Result<Answer, Refused> {
    let done = |text: String| Ok(Answer::Done { done: vec![text] });
    match operation {
        Operation::Read { tags } if tags.iter().any(|t| t == "missing") => {
            Err(Refused::new("unknown", "there is no tag missing"))
        }
        // More than the kernel keeps for a client that does not read.
        Operation::Read { tags } if tags == &["many.*"] => {
            let row = |n: usize| TagRow { tag: format!("many.n{n}"), ..level(plant.level.load(Ordering::Relaxed)) };
            Ok(Answer::Tags((0..5_000).map(row).collect()))
        }
        Operation::Read { tags } => {
            let level = level(plant.level.load(Ordering::Relaxed));
            Ok(Answer::Tags(if tags == &["unit.*"] { vec![level] } else { vec![level, lamp()] }))
        }
        Operation::ReadValues { block } => Ok(Answer::Status(json!({ "block": block, "staged": {} }))),
        Operation::Status => Ok(Answer::Status(json!({ "plant": "pumps", "lanes": [] }))),
        Operation::Forces => Ok(Answer::Forces(vec![ForceRow {
            tag: "field.lamp".into(),
            value: Value::Bool(true),
            user: "alice".into(),
            since: 1,
        }])),
        Operation::Alarms { all } => Ok(Answer::Alarms(vec![AlarmRow {
            alarm: "unit.alarms.high".into(),
            text: format!("all: {all}"),
            state: "unacknowledged",
            priority: 200,
            code: 0xC400,
            group: String::new(),
            first_out: true,
            condition: true,
            quality: "good",
            raised: 1,
            shelved_until: 0,
            seq: 17,
        }])),
        Operation::Set { values, .. } if values.iter().any(|(_, v)| v == "7") => {
            Err(Refused::new("value", "7 is no duration"))
        }
        Operation::Reset { .. } => Err(Refused::new("state", "the condition is still there")),
        Operation::Swaps { number: Some(8) } => Ok(Answer::Swaps(Vec::new())),
        Operation::Swaps { .. } => Ok(Answer::Swaps(vec![swap()])),
        Operation::Swap(_) | Operation::Rollback { .. } => Ok(Answer::Swap(Box::new(swap()))),
        other => done(format!("{other:?}")),
    }
}
