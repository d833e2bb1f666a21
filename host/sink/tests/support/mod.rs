//! A journal to read, sinks as a plant file has them, and sinks that misbehave.
#![allow(dead_code, reason = "each test program uses a part of it")]

use latchwork_image::Value;
use latchwork_record::journal::{Journal, Opening, Options};
use latchwork_record::{Kind, Record};
use latchwork_schema::Checker;
use latchwork_sink::{Config, KEYS, Report, Runner, SinkKind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A record of number `seq`, a millisecond after the one before.
pub(crate) fn record(seq: u64) -> Record {
    Record {
        seq,
        time: 1_800_000_000_000_000_000 + seq * 1_000_000,
        kind: Kind::Event,
        source: "unit.outputs.status".into(),
        transition: "changed".into(),
        previous: Value::Integer(seq.into()),
        current: Value::Integer((seq + 1).into()),
        priority: 7,
        user: String::new(),
        text: format!("record {seq}"),
    }
}

/// A sink as the plant file would have it: `keys` are the lines of its table.
pub(crate) fn config(kind: &SinkKind, folder: &Path, keys: &str) -> Config {
    let text = format!("kind = \"{}\"\n{keys}", kind.name);
    let (root, syntax) = latchwork_schema::check::parse(&text);
    let mut checker = Checker { findings: syntax, ..Checker::default() };
    let values = checker.table(&[&KEYS, kind.keys], root.get_ref(), 0..text.len());
    assert_eq!(checker.findings, [], "{text}");
    let config = Config {
        name: "s".into(),
        plant: "pumps".into(),
        folder: folder.into(),
        components: Vec::new(),
        cache: None,
        journal: String::new(),
        values,
    };
    let problems: Vec<_> = latchwork_sink::check(&config).into_iter().chain((kind.check)(&config)).collect();
    assert_eq!(problems, [], "{text}");
    config
}

/// A journal with sinks.
pub(crate) struct Bench {
    pub(crate) folder: PathBuf,
    pub(crate) journal: Journal,
    pub(crate) opening: Opening,
    pub(crate) runner: Option<Runner>,
    pub(crate) reports: Receiver<Report>,
    next: u64,
}

impl Bench {
    /// Opens the journal in a folder and starts these sinks.
    pub(crate) fn start(folder: &Path, sinks: Vec<(&'static SinkKind, Config)>) -> Self {
        let options = Options {
            within: Duration::from_millis(2),
            queue: 1_000_000,
            sinks: sinks.iter().map(|(_, c)| c.name.clone()).collect(),
            ..Options::default()
        };
        let (journal, opening) = Journal::open(folder, options).expect("a journal");
        let (tell, reports) = channel();
        let tell = move |report| drop(tell.send(report));
        let runner = Runner::start(folder, sinks, &opening.cursors, &journal.watch(), tell).expect("threads");
        let next = opening.last + 1;
        Self { folder: folder.into(), journal, opening, runner: Some(runner), reports, next }
    }

    /// Hands so many records to the journal.
    pub(crate) fn push(&mut self, count: u64) {
        for _ in 0..count {
            self.journal.push(&record(self.next));
            self.next += 1;
        }
    }

    /// The same, each on the disk when this returns.
    pub(crate) fn store(&mut self, count: u64) {
        self.push(count);
        assert!(self.journal.settle(Duration::from_secs(60)), "the journal takes too long");
    }

    /// Waits until the first sink has everything.
    pub(crate) fn deliver(&self, patience: Duration) {
        let statuses = self.runner.as_ref().expect("it runs").statuses();
        wait_for(patience, "the sink has everything", || {
            let status = &statuses.list()[0];
            status.behind == 0 && status.cursor == self.journal.durable()
        });
    }

    /// Ends in order; names of the sinks that did not.
    pub(crate) fn stop(mut self) -> Vec<String> {
        let left = self.runner.take().map(Runner::stop).unwrap_or_default();
        assert_eq!(self.journal.close(), 0);
        left
    }
}

/// Waits until something is so; fails when it takes too long.
pub(crate) fn wait_for(patience: Duration, what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + patience;
    while !is_so() {
        assert!(Instant::now() < end, "not within {patience:?}: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Passes a test over that this machine lacks something for; where everything must be there it fails.
pub(crate) fn skip(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    eprintln!("SKIPPED: {why}");
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).open(list);
        let written = file.and_then(|mut f| std::io::Write::write_all(&mut f, format!("{why}\n").as_bytes()));
        written.expect("the list of what was passed over");
    }
}
