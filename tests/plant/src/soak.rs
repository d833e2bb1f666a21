//! A plant that is swapped without end, by the machine's clock: what tests and the bench of swaps share.
//!
//! Counters in a lane of 1 ms. Most of them are swapped for good versions only and must never step back or skip; the last
//! ones get versions that fail, and are rolled back by hand.

use crate::Rig;
use crate::forge::component;
use latchwork_block::{Engine, EngineOptions};
use latchwork_image::TagId;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::model::TagRef;
use latchwork_plant::operate::{Answer, Console, Operation, Operator, Refused};
use latchwork_plant::run::{Control, MachineClock, Observer, Outcome, RunOptions, run_real};
use latchwork_plant::swap::{Part, Stage, SwapOrder, SwapStatus, WayBack};
use latchwork_record::{Kept, Kind, Record};
use latchwork_retain::{Figures, Memory, Vault};
use std::collections::HashMap;
use std::fmt::Write;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Blocks at the end of the plant that get versions that fail.
const FAILING: usize = 10;
/// Counters that are looked at in every scan, and that are swapped: every fifth. All of them would be too many rows for a
/// machine that is busy compiling.
const TRACED: &str = "c*[05].outputs.count";
const STEP: usize = 5;
/// Longest wait for an answer or the end of a swap.
const PATIENCE: Duration = Duration::from_secs(60);

/// What is to be done.
#[derive(Clone, Copy, Debug)]
pub struct Soak {
    /// Counters.
    pub blocks: usize,
    /// Time before the first swap.
    pub quiet: Duration,
    /// Time of swapping.
    pub swapping: Duration,
    /// Period of the lane, ns.
    pub every: u64,
    /// Time between two rounds of saving retained state, ms.
    pub retain_ms: u64,
}

/// A swap that was done.
#[derive(Clone, Debug)]
pub struct Done {
    /// How it ended.
    pub status: SwapStatus,
    /// The new version was made to fail.
    pub bad: bool,
    /// It was a rollback by hand.
    pub back: bool,
    /// From the order to its end, ns.
    pub took: u64,
}

/// What came of it.
pub struct Told {
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Swaps and rollbacks.
    pub swaps: Vec<Done>,
    /// Orders that were refused at once.
    pub refused: Vec<String>,
    /// Records.
    pub records: Vec<Record>,
    /// Values of counters that were looked at.
    pub steps: u64,
    /// What the checked counters have come to, by block.
    pub counts: Vec<(usize, u64)>,
    /// Where a counter stepped back or skipped.
    pub broken: Vec<String>,
    /// How late each scan began, ns, before the first swap.
    pub late_quiet: Vec<u64>,
    /// The same while blocks were swapped.
    pub late_swapping: Vec<u64>,
    /// Resident memory after so many swaps, bytes.
    pub memory: Vec<(u64, u64)>,
    /// What was saved of retained state.
    pub retained: Figures,
}

/// A counter with `fields` further retained fields and code that no other `salt` has; it traps in execution `trap`, if that is
/// not 0.
///
/// # Panics
/// If the text it is made from is wrong.
pub fn counter(fields: usize, salt: u64, trap: u64) -> Vec<u8> {
    let names: String = (0..fields).map(|n| format!(", v{n}: u64")).collect();
    let wit = format!(
        "package bench:soak@0.1.0;\ninterface counter {{\nuse latchwork:block/types@0.1.0.{{scan}};\n\
         record inputs {{ hold: bool }}\nrecord outputs {{ count: u64 }}\nrecord retained {{ count: u64, first: u64{names} }}\n\
         execute: func(scan: scan, inputs: inputs) -> outputs;\nsave: func() -> retained;\n\
         restore: func(state: retained);\n}}\nworld w {{ export counter; }}\n"
    );
    let all = fields + 2;
    let cell = |n: usize| 1024 + 8 * n;
    let mut restore = String::new();
    for n in 0..all {
        // Writing to a String never fails.
        let _ = match all > 16 {
            true => writeln!(restore, "(i64.store (i32.const {}) (i64.load offset={} (local.get 0)))", cell(n), 8 * n),
            false => writeln!(restore, "(i64.store (i32.const {}) (local.get {n}))", cell(n)),
        };
    }
    let params = if all > 16 { "i32".to_owned() } else { "i64 ".repeat(all) };
    // What a compiler has to do for a block of some size: never called, but exported.
    let mut bulk = String::new();
    for n in 0..40u64 {
        let body: String = (0..20u64)
            .map(|k| {
                let constant = (salt ^ (n * 31 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15)).cast_signed();
                format!(
                    "(local.set 0 (i64.rotl (i64.xor (local.get 0) (i64.const {constant})) (i64.const {})))\n",
                    k + 1
                )
            })
            .collect();
        let _ = writeln!(bulk, "(func $bulk{n} (param i64) (result i64) {body} (local.get 0))");
    }
    let calls: String = (0..40).map(|n| format!("(drop (call $bulk{n} (i64.const {n})))")).collect();
    let wat = format!(
        r#"(module
(memory (export "memory") 2)
(global $n (mut i64) (i64.const 0))
{bulk}
(func $all (param i32) (if (local.get 0) (then {calls})))
(func (export "cabi_realloc") (param i32 i32 i32 i32) (result i32) (i32.const 32768))
(func (export "bench:soak/counter@0.1.0#execute") (param i64 i64 i32 i32) (result i64)
  (global.set $n (i64.add (global.get $n) (i64.const 1)))
  (if (i64.eq (global.get $n) (i64.const {trap})) (then unreachable))
  (call $all (i32.eq (local.get 3) (i32.const 7)))
  (i64.store (i32.const 1024) (i64.add (i64.load (i32.const 1024)) (i64.extend_i32_u (i32.eqz (local.get 3)))))
  (i64.load (i32.const 1024)))
(func (export "bench:soak/counter@0.1.0#save") (result i32) (i32.const 1024))
(func (export "bench:soak/counter@0.1.0#restore") (param {params})
{restore}))"#
    );
    component(&wit, &wat)
}

/// What the thread that swaps and the run share.
#[derive(Default)]
struct Shared {
    stop: Arc<AtomicBool>,
    /// Plant time, ns.
    now: AtomicU64,
    swaps: Mutex<Vec<Done>>,
    refused: Mutex<Vec<String>>,
    memory: Mutex<Vec<(u64, u64)>>,
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Soak {
    /// Runs it.
    ///
    /// # Panics
    /// If the plant cannot be made, or gives no answer for a minute.
    pub fn run(&self) -> Told {
        let mut text =
            format!("[retain]\nevery = \"{}ms\"\n[lane.main]\nevery = \"{}ns\"\n", self.retain_ms, self.every);
        // What the lane may take on a machine that does other work, too.
        text += "watchdog = \"20s\"\n";
        for n in 0..self.blocks {
            let _ = writeln!(
                text,
                "[block.c{n}]\ncomponent = \"first.wasm\"\nlane = \"main\"\nbudget = \"1s\"\nretain = true"
            );
        }
        // No cache: every version is compiled.
        let engine = Engine::new(EngineOptions { cache: None, ..EngineOptions::default() }).expect("an engine");
        let traced = TRACED;
        let rig = Rig::new(&text).with("first", &counter(0, 1, 0)).trace(Some(traced));
        let mut plant = crate::assemble_file(&rig.path(), &engine, false, Time::Real, Some(traced));
        let vault = Memory::default();
        plant.retain(&latchwork_retain::Found::default(), Box::new(vault.clone()));
        let mut watch = Watch::new(&plant, self);
        let shared = Arc::clone(&watch.shared);
        let console = plant.console();
        let (soak, at) = (*self, Arc::clone(&shared));
        let swapper = std::thread::spawn(move || soak.swap(&console, &at));
        let total = self.quiet + self.swapping;
        let options = RunOptions { duration: Some(nanos(total)), ..RunOptions::default() };
        let outcome = run_real(plant, &options, Arc::new(MachineClock::start()), &shared.stop, &mut watch);
        shared.stop.store(true, Ordering::Relaxed);
        swapper.join().expect("the thread that swaps");
        let (swaps, refused, memory) = (&shared.swaps, &shared.refused, &shared.memory);
        let (swaps, refused, memory) = (lock(swaps).clone(), lock(refused).clone(), lock(memory).clone());
        watch.settle();
        let Watch { counters, checked, records, steps, broken, late_quiet, late_swapping, .. } = watch;
        let mut counts: Vec<_> = counters.into_values().filter(|(block, _)| *block < checked).collect();
        counts.sort_unstable();
        let retained = vault.figures();
        Told { outcome, swaps, refused, records, steps, counts, broken, late_quiet, late_swapping, memory, retained }
    }

    fn swap(&self, console: &Console, shared: &Shared) {
        while shared.now.load(Ordering::Relaxed) < nanos(self.quiet) && !shared.stop.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let (mut salt, mut count) = (1000u64, 0);
        lock(&shared.memory).push((0, resident()));
        let good = self.blocks - FAILING;
        // The last swaps must have ended before the plant does.
        let end = nanos(self.quiet + self.swapping).saturating_sub(2_000_000_000);
        while shared.now.load(Ordering::Relaxed) < end && !shared.stop.load(Ordering::Relaxed) {
            salt += 1;
            let at = salt as usize;
            let failing = format!("c{}", good + at % FAILING);
            match count % 10 {
                8 => self.one(console, shared, vec![(failing, counter(0, salt, 3))], true),
                9 => {
                    self.one(console, shared, vec![(failing.clone(), counter(0, salt, 0))], false);
                    self.back(console, shared, failing);
                }
                _ => {
                    // One, two or three at once, of another one of the good blocks each.
                    let parts = (0..1 + at % 3)
                        .map(|k| (format!("c{}", (at * 7 + k * 13) % (good / STEP) * STEP), counter(0, salt, 0)));
                    let mut parts: Vec<_> = parts.collect();
                    parts.dedup_by(|a, b| a.0 == b.0);
                    self.one(console, shared, parts, false);
                }
            }
            count += 1;
            if count % 50 == 0 {
                let swaps = lock(&shared.swaps).len() as u64;
                lock(&shared.memory).push((swaps, resident()));
            }
        }
    }

    /// One swap to its end.
    fn one(&self, console: &Console, shared: &Shared, parts: Vec<(String, Vec<u8>)>, bad: bool) {
        let part = |(block, bytes): (String, Vec<u8>)| Part {
            block,
            file: "next.wasm".into(),
            bytes: bytes.into(),
            settings: Vec::new(),
            expects: None,
        };
        let order = SwapOrder {
            parts: parts.into_iter().map(part).collect(),
            shadow: 0,
            tolerances: Vec::new(),
            probation: 20,
            allow_lossy: false,
            dry_run: false,
            save: false,
        };
        self.follow(console, shared, Operation::Swap(Box::new(order)), bad, false);
    }

    fn back(&self, console: &Console, shared: &Shared, block: String) {
        self.follow(console, shared, Operation::Rollback { block, to: WayBack::Steps(1) }, false, true);
    }

    /// Orders something and waits for its end.
    fn follow(&self, console: &Console, shared: &Shared, operation: Operation, bad: bool, back: bool) {
        let begun = Instant::now();
        let number = match ask(console, operation) {
            Ok(Answer::Swap(status)) => status.number,
            Ok(other) => return lock(&shared.refused).push(format!("{other:?}")),
            Err(refused) => return lock(&shared.refused).push(refused.to_string()),
        };
        loop {
            match ask(console, Operation::Swaps { number: Some(number) }) {
                Ok(Answer::Swaps(rows)) if rows.iter().any(|r| r.stage.ended()) => {
                    let took = nanos(begun.elapsed());
                    let ended = rows.into_iter().find(|r| r.stage.ended());
                    return lock(&shared.swaps).extend(ended.map(|status| Done { status, bad, back, took }));
                }
                Ok(_) if begun.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(2)),
                other => return lock(&shared.refused).push(format!("swap {number}: {other:?}")),
            }
        }
    }
}

fn ask(console: &Console, operation: Operation) -> Result<Answer, Refused> {
    let operator = Operator { user: "soak".into(), origin: "script".into(), reason: String::new() };
    console.ask(operator, operation, None, PATIENCE)
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Resident memory of this process, bytes.
pub fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: u64 = text.split(' ').nth(1).and_then(|p| p.parse().ok()).unwrap_or(0);
    pages * 4096
}

/// Sees every value of every counter.
struct Watch {
    shared: Arc<Shared>,
    /// Numbers of the blocks by their tags, and their last counts.
    counters: HashMap<TagId, (usize, u64)>,
    /// Counters that must never step back or skip.
    checked: usize,
    every: u64,
    quiet: u64,
    /// Earliest start of a scan within its period, ns.
    starts: Vec<u64>,
    records: Vec<Record>,
    steps: u64,
    broken: Vec<String>,
    late_quiet: Vec<u64>,
    late_swapping: Vec<u64>,
}

impl Watch {
    fn new(plant: &Plant, soak: &Soak) -> Self {
        let blocks = (0..soak.blocks).step_by(STEP);
        let tag = |block: usize| (plant.layout.ids[&TagRef::Output { block, port: 0 }], (block, 0));
        Self {
            shared: Arc::default(),
            counters: blocks.map(tag).collect(),
            checked: soak.blocks - FAILING,
            every: soak.every,
            quiet: nanos(soak.quiet),
            starts: Vec::new(),
            records: Vec::new(),
            steps: 0,
            broken: Vec::new(),
            late_quiet: Vec::new(),
            late_swapping: Vec::new(),
        }
    }

    /// How late the scans were: against the earliest of their thousand neighbours, as the grid is not known here.
    fn settle(&mut self) {
        let first = self.starts.iter().map(|t| t % self.every).min().unwrap_or(0);
        for start in self.starts.drain(..) {
            let late = (start % self.every).wrapping_sub(first) % self.every;
            if start < self.quiet { self.late_quiet.push(late) } else { self.late_swapping.push(late) }
        }
    }
}

impl Observer for Watch {
    fn record(&mut self, record: &Record, _: &[Kept]) {
        self.records.push(record.clone());
    }

    fn change(&mut self, change: &Change) {
        let Some((block, last)) = self.counters.get_mut(&change.tag) else { return };
        let before = std::mem::replace(last, change.cell);
        if *block < self.checked {
            self.steps += 1;
            // The first row is the value before the first scan.
            if change.cell != before + 1 && change.cell != 0 {
                self.broken.push(format!("c{block} went from {before} to {} at {} ns", change.cell, change.time));
            }
        }
        if *block == 0 {
            self.starts.push(change.time);
            if self.starts.len() == 1000 {
                self.settle();
            }
        }
    }

    fn tick(&mut self, now: u64) -> Control {
        self.shared.now.store(now, Ordering::Relaxed);
        Control::Continue
    }
}

impl Told {
    /// Rules that were broken, one sentence each; the clock is not asked.
    pub fn wrong(&self) -> Vec<String> {
        let mut wrong = self.broken.clone();
        wrong.extend(self.refused.iter().map(|r| format!("refused: {r}")));
        for (at, record) in self.records.iter().enumerate() {
            if record.seq != at as u64 + 1 {
                wrong.push(format!("record {} stands at place {}", record.seq, at + 1));
                break;
            }
        }
        let lost = self.records.iter().filter(|r| r.kind == Kind::Lost);
        wrong.extend(lost.map(|r| format!("lost: {} {}", r.source, r.text)));
        if self.outcome.trace_lost > 0 {
            wrong.push(format!("{} rows of the trace found no room: nothing can be said", self.outcome.trace_lost));
        }
        let scans = self.outcome.lanes[0].statistics.scans;
        let short = self.counts.iter().filter(|(_, count)| *count != scans);
        wrong.extend(short.map(|(block, count)| format!("c{block} counts {count} in {scans} scans")));
        for Done { status, bad, .. } in &self.swaps {
            let expected = if *bad { Stage::RolledBack } else { Stage::Done };
            if status.stage != expected {
                wrong.push(format!("swap {} ended {:?}: {}", status.number, status.stage, status.message));
            }
            let told = |r: &&Record| r.kind == Kind::Swap && r.source == status.blocks[0].block;
            if !status.blocks.is_empty()
                && !self
                    .records
                    .iter()
                    .filter(told)
                    .any(|r| r.transition == "exchanged" || r.transition == "rolled-back")
            {
                wrong.push(format!("swap {} has left no record", status.number));
            }
        }
        wrong
    }
}
