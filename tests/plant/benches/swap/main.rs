//! Swaps without end in a plant of 200 blocks and 1 ms, and what it costs to save and restore a state.
//!
//! `cargo xtask bench swap` runs it for five minutes; best on a machine that does nothing else, as root or with the right to
//! SCHED_FIFO. `--seconds N`, `--blocks N` and `--table FILE` say how long, of how many and where to.

use hdrhistogram::Histogram;
use latchwork_block::{CallPath, Engine, EngineOptions, Limits};
use latchwork_plant::swap::Stage;
use latchwork_tests_plant::soak::{Soak, Told, counter};
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// What a lane has when nothing is said.
const PRIORITY: u8 = 40;

struct Args {
    seconds: u64,
    blocks: usize,
    table: Option<PathBuf>,
}

impl Args {
    fn parse() -> Self {
        let mut args = Self { seconds: 300, blocks: 200, table: None };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number =
                || words.next().and_then(|w| w.parse().ok()).unwrap_or_else(|| panic!("{word} takes a number"));
            match word.as_str() {
                "--seconds" => args.seconds = number(),
                "--blocks" => args.blocks = number() as usize,
                "--table" => args.table = words.next().map(PathBuf::from),
                // cargo's own.
                "--bench" => {}
                other => panic!("{other} is not known; there are --seconds, --blocks and --table"),
            }
        }
        args
    }
}

/// Percentiles of samples, ns.
struct Spread {
    count: usize,
    p50: u64,
    p99: u64,
    max: u64,
}

impl Spread {
    fn new(samples: impl IntoIterator<Item = u64>) -> Self {
        let mut samples: Vec<_> = samples.into_iter().collect();
        samples.sort_unstable();
        let at = |part: f64| {
            let index = (samples.len() as f64 * part).ceil() as usize;
            samples.get(index.clamp(1, samples.len().max(1)) - 1).copied().unwrap_or(0)
        };
        Self { count: samples.len(), p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }

    fn of(all: &Histogram<u64>) -> Self {
        let at = |part| all.value_at_quantile(part);
        Self { count: all.len() as usize, p50: at(0.5), p99: at(0.99), max: all.max() }
    }

    fn row(&self, unit: f64) -> String {
        let of = |ns: u64| format!("{:.1}", ns as f64 / unit);
        format!("{} | {} | {} | {}", self.count, of(self.p50), of(self.p99), of(self.max))
    }
}

/// Deadlines that passed while a thread could not run, and the part of the processors' time that a hypervisor took meanwhile, %.
#[derive(Default)]
struct Missed {
    quiet: u64,
    swapping: u64,
    stolen: (f64, f64),
}

/// Time that was stolen from this machine's processors so far, and all of it; nothing where that is not told.
fn stolen() -> (f64, f64) {
    let text = std::fs::read_to_string("/proc/stat").unwrap_or_default();
    let times: Vec<f64> =
        text.lines().next().unwrap_or_default().split_whitespace().filter_map(|w| w.parse().ok()).collect();
    // user, nice, system, idle, iowait, irq, softirq, steal; what follows is part of the first two.
    (times.get(7).copied().unwrap_or(0.0), times.iter().take(8).sum())
}

fn percent(before: (f64, f64), after: (f64, f64)) -> f64 {
    100.0 * (after.0 - before.0) / (after.1 - before.1).max(1.0)
}

/// What this machine gives a thread of a lane's priority that does nothing: where it stands still, no runtime keeps a period.
fn bare(stop: &AtomicBool, every: Duration, quiet: Duration) -> Missed {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = PRIORITY.try_into().map(ThreadPriority::Crossplatform).expect("a priority");
    if let Err(why) = set_thread_priority_and_policy(thread_native_id(), priority, policy) {
        eprintln!("the thread beside the plant has no real-time priority ({why:?}), nor has the lane");
    }
    let (begun, mut due, mut missed) = (Instant::now(), Instant::now(), Missed::default());
    let (at_first, mut between) = (stolen(), None);
    while !stop.load(Ordering::Relaxed) {
        due += every;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let passed = due.elapsed().as_nanos() / every.as_nanos();
        let part = if begun.elapsed() < quiet { &mut missed.quiet } else { &mut missed.swapping };
        *part += passed as u64;
        due += every * passed as u32;
        if between.is_none() && begun.elapsed() >= quiet {
            between = Some(stolen());
        }
    }
    let between = between.unwrap_or(at_first);
    missed.stolen = (percent(at_first, between), percent(between, stolen()));
    missed
}

const US: f64 = 1e3;
const MS: f64 = 1e6;

fn main() {
    let args = Args::parse();
    let swapping = Duration::from_secs(args.seconds);
    let soak = Soak { blocks: args.blocks, quiet: swapping / 5, swapping, every: 1_000_000, retain_ms: 10_000 };
    eprintln!("{} s without a swap, then {} s of swaps …", soak.quiet.as_secs(), swapping.as_secs());
    let stop = Arc::new(AtomicBool::new(false));
    let beside = std::thread::spawn({
        let (stop, every, quiet) = (Arc::clone(&stop), Duration::from_nanos(soak.every), soak.quiet);
        move || bare(&stop, every, quiet)
    });
    let told = soak.run();
    stop.store(true, Ordering::Relaxed);
    let bare = beside.join().expect("the thread beside it");
    let mut page = swaps(&soak, &told, &bare);
    page += &states();
    println!("{page}");
    if let Some(path) = &args.table {
        std::fs::write(path, &page).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    let wrong = told.wrong();
    assert!(wrong.is_empty(), "{} rules were broken: {:#?}", wrong.len(), &wrong[..wrong.len().min(20)]);
}

fn swaps(soak: &Soak, told: &Told, bare: &Missed) -> String {
    let lane = &told.outcome.lanes[0].statistics;
    let of = |bad: bool, back: bool| told.swaps.iter().filter(move |d| (d.bad, d.back) == (bad, back));
    let mut page = format!(
        "{} blocks in a lane of {} ms, {} s without and {} s with swaps of one to three blocks, one after the other, each to a \
         version that had to be compiled:\n\n\
         | | |\n|---|---|\n\
         | scans | {} |\n\
         | swaps kept; rolled back by a fault; rolled back by hand | {}; {}; {} |\n\
         | rolled back because the machine stood still while the new version executed | {} |\n\
         | values of counters that were compared; steps back or skipped | {}; {} |\n\
         | records; lost | {}; {} |\n\n",
        soak.blocks,
        soak.every / 1_000_000,
        soak.quiet.as_secs(),
        soak.swapping.as_secs(),
        lane.scans,
        of(false, false).filter(|d| d.stage == Stage::Done).count(),
        of(true, false).count(),
        of(false, true).count(),
        of(false, false).filter(|d| d.stage != Stage::Done).count(),
        told.steps,
        told.broken.len(),
        told.records.count,
        told.records.lost.len(),
    );
    // Writing to a String never fails.
    page += "| deadlines passed without a scan, in a minute | without swaps | with swaps |\n|---|---|---|\n";
    let minutes = |d: Duration| d.as_secs_f64() / 60.0;
    let (quiet, swapping) = (minutes(soak.quiet), minutes(soak.swapping));
    let per = |n: u64, minutes: f64| n as f64 / minutes.max(1e-9);
    let (before, during) = (per(told.quiet.missed, quiet), per(told.swapping.missed, swapping));
    let _ = writeln!(page, "| the lane | {before:.1} | {during:.1} |");
    let (before, during) = (per(bare.quiet, quiet), per(bare.swapping, swapping));
    let _ = writeln!(
        page,
        "| a bare thread that only wakes, of the same priority, on whichever CPU | {before:.1} | {during:.1} |"
    );
    let (before, during) = bare.stolen;
    let _ = writeln!(page, "| processor time that the hypervisor took meanwhile, % | {before:.1} | {during:.1} |\n");
    page += "| | count | p50 | p99 | max |\n|---|---|---|---|---|\n";
    for (blocks, what) in [(1, "one block"), (2, "two blocks"), (3, "three blocks")] {
        let some = told.swaps.iter().filter(|d| !d.back && d.blocks == blocks);
        let spread = Spread::new(some.map(|d| d.exchange_ns));
        let _ = writeln!(page, "| exchange of {what} in the lane, µs | {} |", spread.row(US));
    }
    let prepare = Spread::new(told.swaps.iter().filter(|d| !d.back).map(|d| d.prepare_ns));
    let back = Spread::new(of(false, true).map(|d| d.exchange_ns));
    let quiet = Spread::of(&told.quiet.late);
    let swapping = Spread::of(&told.swapping.late);
    let _ = writeln!(page, "| load, check, compile and instantiate beside it, ms | {} |", prepare.row(MS));
    let _ = writeln!(page, "| rollback by hand: exchange in the lane, µs | {} |", back.row(US));
    let _ = writeln!(
        page,
        "| rollback by hand: from the order to its end, ms | {} |",
        Spread::new(of(false, true).map(|d| d.took)).row(MS)
    );
    let _ = writeln!(page, "| start of a scan after its deadline, without swaps, µs | {} |", quiet.row(US));
    let _ = writeln!(page, "| the same with swaps, µs | {} |", swapping.row(US));
    let ratio = swapping.p99 as f64 / quiet.p99.max(1) as f64;
    let _ = writeln!(page, "\np99 with swaps over p99 without: {ratio:.2} (target 1.2).\n");
    let memory = |swaps: u64| told.memory.iter().find(|(n, _)| *n >= swaps);
    let rows: Vec<_> = [0, 100, 200, 400, 800, 1000, 2000, 3000, 4000, 5000]
        .into_iter()
        .filter_map(memory)
        .map(|(n, bytes)| format!("{:.1} MB after {n}", *bytes as f64 / 1e6))
        .collect();
    let _ = writeln!(
        page,
        "Resident memory of the process, which keeps eight earlier versions of each block: {} swaps.\n",
        rows.join(", ")
    );
    page
}

/// Cost of saving and restoring, over the size of the state.
fn states() -> String {
    let mut page =
        String::from("| fields of the state | save: p50, µs | p99 | restore: p50 | p99 |\n|---|---|---|---|---|\n");
    let engine = Engine::new(EngineOptions { cache: None, ..EngineOptions::default() }).expect("an engine");
    for fields in [10usize, 100, 1000] {
        let component = engine.load_bytes("state", &counter(fields - 2, 7, 0)).expect("a component");
        let template = component.template(&component.class(None).expect("a class")).expect("a template");
        let mut instance =
            template.instantiate(&Limits { budget_ticks: 1_000_000, ..Limits::default() }).expect("an instance");
        assert_eq!(instance.path(), CallPath::Plain);
        let mut cells = vec![0; fields];
        let mut time = |call: &mut dyn FnMut(&mut latchwork_block::Instance, &mut [u64])| {
            Spread::new((0..2000).map(|_| {
                let begun = Instant::now();
                call(&mut instance, &mut cells);
                begun.elapsed().as_nanos() as u64
            }))
        };
        let save = time(&mut |i, cells| assert_eq!(i.save_into(cells), Ok(true)));
        let restore = time(&mut |i, cells| assert_eq!(i.restore(cells), Ok(())));
        let us = |ns: u64| ns as f64 / US;
        let _ = writeln!(
            page,
            "| {fields} | {:.2} | {:.2} | {:.2} | {:.2} |",
            us(save.p50),
            us(save.p99),
            us(restore.p50),
            us(restore.p99)
        );
    }
    page
}
