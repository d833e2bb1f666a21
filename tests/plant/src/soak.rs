//! A plant that is swapped without end, by the machine's clock: what tests and the bench of swaps share.
//!
//! Counters in a lane of 1 ms. Most of them are swapped for good versions only and must never step back or skip; the last
//! ones get versions that fail, and are rolled back by hand.

use crate::Rig;
use crate::forge::component;
use hdrhistogram::Histogram;
use latchwork_block::{Engine, EngineOptions};
use latchwork_image::TagId;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::model::TagRef;
use latchwork_plant::operate::{Answer, Console, Operation, Operator, Refused};
use latchwork_plant::run::{Control, MachineClock, Observer, Outcome, RunOptions, run_real};
use latchwork_plant::swap::{Part, Stage, SwapOrder, SwapStatus, WayBack};
use latchwork_record::{Kept, Kind, Record};
use latchwork_retain::{Figures, Store};
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

/// A swap that was done: little, as memory is measured.
#[derive(Clone, Debug)]
pub struct Done {
    /// Number.
    pub number: u64,
    /// How it ended.
    pub stage: Stage,
    /// Blocks that were exchanged together.
    pub blocks: usize,
    /// Time of preparing, and of the exchange in the lane, ns.
    pub prepare_ns: u64,
    /// See above.
    pub exchange_ns: u64,
    /// The new version was made to fail.
    pub bad: bool,
    /// It was a rollback by hand.
    pub back: bool,
    /// From the order to its end, ns.
    pub took: u64,
}

/// How scans began.
#[derive(Clone, Debug)]
pub struct Starts {
    /// After their deadlines, ns.
    pub late: Histogram<u64>,
    /// Deadlines that passed without a scan.
    pub missed: u64,
}

impl Starts {
    fn new(every: u64) -> Self {
        Self { late: Histogram::new_with_bounds(1, every.max(2), 3).expect("bounds in order"), missed: 0 }
    }
}

/// What was told by records.
#[derive(Clone, Debug, Default)]
pub struct Records {
    /// All of them.
    pub count: u64,
    /// Exchanges, by block.
    pub exchanged: usize,
    /// Blocks that went back by themselves.
    pub back: usize,
    /// Those of records that were lost.
    pub lost: Vec<String>,
    /// The first one that does not stand where its number says.
    pub first_wrong: Option<String>,
}

/// What came of it.
pub struct Told {
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Swaps and rollbacks.
    pub swaps: Vec<Done>,
    /// Orders that were refused at once.
    pub refused: Vec<String>,
    /// Blocks that went back because the machine stood still while their new versions executed.
    pub stood_still: Vec<String>,
    /// Records.
    pub records: Records,
    /// Values of counters that were looked at.
    pub steps: u64,
    /// What the checked counters have come to, by block.
    pub counts: Vec<(usize, u64)>,
    /// Counters that stepped back or skipped, and where.
    pub broken: Vec<(usize, String)>,
    /// Scans before the first swap.
    pub quiet: Starts,
    /// Scans while blocks were swapped.
    pub swapping: Starts,
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
    stood_still: Mutex<Vec<String>>,
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
        // The real one: a vault in memory keeps all that it is given.
        let folder = tempfile::tempdir().expect("a folder");
        let (store, found) = Store::open(folder.path()).expect("a store");
        plant.retain(&found, store.vault());
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
        let stood_still = lock(&shared.stood_still).clone();
        let Watch { counters, checked, records, steps, broken, quietly: quiet, swapping, .. } = watch;
        let mut counts: Vec<_> = counters.into_values().filter(|(block, _)| *block < checked).collect();
        counts.sort_unstable();
        let retained = store.close(PATIENCE).expect("the states are on the disk");
        Told { outcome, swaps, refused, stood_still, records, steps, counts, broken, quiet, swapping, memory, retained }
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
                    return lock(&shared.swaps).extend(ended.map(|status| {
                        let expected = if bad { Stage::RolledBack } else { Stage::Done };
                        if overrun(&status) {
                            lock(&shared.stood_still).extend(status.blocks.iter().map(|b| b.block.clone()));
                        } else if status.stage != expected {
                            let why = format!("swap {number} ended {:?}: {}", status.stage, status.message);
                            lock(&shared.refused).push(why);
                        }
                        let SwapStatus { stage, prepare_ns, exchange_ns, blocks, .. } = status;
                        Done { number, stage, blocks: blocks.len(), prepare_ns, exchange_ns, bad, back, took }
                    }));
                }
                Ok(_) if begun.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(2)),
                other => return lock(&shared.refused).push(format!("swap {number}: {other:?}")),
            }
        }
    }
}

/// The versions here take less than a microsecond: where the scan has taken more than its period because of one, the machine stood
/// still while it executed. A lane knows that where the machine tells how long its thread has worked; elsewhere it is right to take the
/// old one, which goes on from the state that it had.
fn overrun(status: &SwapStatus) -> bool {
    status.stage == Stage::RolledBack && status.message.starts_with("the scan took")
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
    /// Starts of the first scan and of the last one, ns.
    first: Option<u64>,
    last: Option<u64>,
    records: Records,
    steps: u64,
    broken: Vec<(usize, String)>,
    quietly: Starts,
    swapping: Starts,
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
            first: None,
            last: None,
            records: Records::default(),
            steps: 0,
            broken: Vec::new(),
            quietly: Starts::new(soak.every),
            swapping: Starts::new(soak.every),
        }
    }

    /// A scan began: how late after its deadline, and how many deadlines passed without one. The lane's first scan begins
    /// at its first deadline, and the others are multiples of the period after it.
    fn began(&mut self, start: u64) {
        let first = *self.first.get_or_insert(start);
        let periods = |t: u64| (t - first) / self.every;
        let missed = self.last.map_or(0, |last| periods(start).saturating_sub(periods(last) + 1));
        self.last = Some(start);
        let part = if start < self.quiet { &mut self.quietly } else { &mut self.swapping };
        part.late.saturating_record((start - first) % self.every);
        part.missed += missed;
    }
}

impl Observer for Watch {
    fn record(&mut self, record: &Record, _: &[Kept]) {
        let told = &mut self.records;
        told.count += 1;
        if record.seq != told.count && told.first_wrong.is_none() {
            told.first_wrong = Some(format!("record {} stands at place {}", record.seq, told.count));
        }
        match (record.kind, &*record.transition) {
            (Kind::Swap, "exchanged") => told.exchanged += 1,
            (Kind::Swap, "rolled-back") => told.back += 1,
            (Kind::Lost, _) => told.lost.push(format!("{} {}", record.source, record.text)),
            _ => {}
        }
    }

    fn change(&mut self, change: &Change) {
        let Some((block, last)) = self.counters.get_mut(&change.tag) else { return };
        let before = std::mem::replace(last, change.cell);
        if *block < self.checked {
            self.steps += 1;
            // The first row is the value before the first scan.
            if change.cell != before + 1 && change.cell != 0 {
                let at = format!("c{block} went from {before} to {} at {} ns", change.cell, change.time);
                self.broken.push((*block, at));
            }
        }
        // The first row is the value before the first scan.
        if *block == 0 && change.cell != 0 {
            self.began(change.time);
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
        let steady = |block: &usize| !self.stood_still.contains(&format!("c{block}"));
        let broken = self.broken.iter().filter(|(block, _)| steady(block));
        let mut wrong: Vec<_> = broken.map(|(_, at)| at.clone()).collect();
        wrong.extend(self.refused.iter().map(|r| format!("refused: {r}")));
        let Records { first_wrong, lost, exchanged, back, .. } = &self.records;
        wrong.extend(first_wrong.clone());
        wrong.extend(lost.iter().map(|r| format!("lost: {r}")));
        // Each swap tells every block that it exchanges, and every one that goes back.
        let blocks = |some: &dyn Fn(&Done) -> bool| self.swaps.iter().filter(|d| some(d)).map(|d| d.blocks).sum();
        let (to, from): (usize, usize) = (blocks(&|d| !d.back), blocks(&|d| d.back || d.stage == Stage::RolledBack));
        if (*exchanged, *back) != (to, from) {
            wrong.push(format!("{exchanged} exchanged and {back} rolled back are on record of {to} and {from}"));
        }
        if self.outcome.trace_lost > 0 {
            wrong.push(format!("{} rows of the trace found no room: nothing can be said", self.outcome.trace_lost));
        }
        let scans = self.outcome.lanes[0].statistics.scans;
        let short = self.counts.iter().filter(|(block, count)| *count != scans && steady(block));
        wrong.extend(short.map(|(block, count)| format!("c{block} counts {count} in {scans} scans")));
        wrong
    }
}
