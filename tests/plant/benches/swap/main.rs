//! Swaps without end in a plant of 200 blocks and 1 ms, and what it costs to save and restore a state.
//!
//! `cargo xtask bench swap` runs it for five minutes; best on a machine that does nothing else, as root or with the right to
//! SCHED_FIFO. `--seconds N` and `--table FILE` say how long and where to.

use latchwork_block::{CallPath, Engine, EngineOptions, Limits};
use latchwork_tests_plant::soak::{Soak, Told, counter};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

struct Args {
    seconds: u64,
    table: Option<PathBuf>,
}

impl Args {
    fn parse() -> Self {
        let mut args = Self { seconds: 300, table: None };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            match word.as_str() {
                "--seconds" => {
                    let number = words.next().and_then(|w| w.parse().ok());
                    args.seconds = number.unwrap_or_else(|| panic!("--seconds takes a number"));
                }
                "--table" => args.table = words.next().map(PathBuf::from),
                // cargo's own.
                "--bench" => {}
                other => panic!("{other} is not known; there are --seconds and --table"),
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

    fn row(&self, unit: f64) -> String {
        let of = |ns: u64| format!("{:.1}", ns as f64 / unit);
        format!("{} | {} | {} | {}", self.count, of(self.p50), of(self.p99), of(self.max))
    }
}

const US: f64 = 1e3;
const MS: f64 = 1e6;

fn main() {
    let args = Args::parse();
    let swapping = Duration::from_secs(args.seconds);
    let soak = Soak { blocks: 200, quiet: swapping / 5, swapping, every: 1_000_000, retain_ms: 10_000 };
    eprintln!("{} s without a swap, then {} s of swaps …", soak.quiet.as_secs(), swapping.as_secs());
    let told = soak.run();
    let mut page = swaps(&soak, &told);
    page += &states();
    println!("{page}");
    if let Some(path) = &args.table {
        std::fs::write(path, &page).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    let wrong = told.wrong();
    assert!(wrong.is_empty(), "{} rules were broken: {:#?}", wrong.len(), &wrong[..wrong.len().min(20)]);
}

fn swaps(soak: &Soak, told: &Told) -> String {
    let lane = &told.outcome.lanes[0].statistics;
    let expected = told.outcome.time / soak.every;
    let of = |bad: bool, back: bool| told.swaps.iter().filter(move |d| (d.bad, d.back) == (bad, back));
    let all = || told.swaps.iter().filter(|d| !d.back);
    let mut page = format!(
        "{} blocks in a lane of {} ms, {} s without and {} s with swaps of one to three blocks, one after the other, each to a \
         version that had to be compiled:\n\n\
         | | |\n|---|---|\n\
         | scans; periods that passed | {}; {expected} |\n\
         | scans that ended late; longest scan, µs | {}; {:.1} |\n\
         | swaps kept; rolled back by a fault; rolled back by hand | {}; {}; {} |\n\
         | values of counters that were compared; steps back or skipped | {}; {} |\n\
         | records; lost | {}; {} |\n\n",
        soak.blocks,
        soak.every / 1_000_000,
        soak.quiet.as_secs(),
        soak.swapping.as_secs(),
        lane.scans,
        lane.overruns,
        lane.scan_time_max as f64 / US,
        of(false, false).count(),
        of(true, false).count(),
        of(false, true).count(),
        told.steps,
        told.broken.len(),
        told.records.len(),
        told.records.iter().filter(|r| r.kind == latchwork_record::Kind::Lost).count(),
    );
    page += "| | count | p50 | p99 | max |\n|---|---|---|---|---|\n";
    let exchange = Spread::new(all().map(|d| d.status.exchange_ns));
    let prepare = Spread::new(all().map(|d| d.status.prepare_ns));
    let back = Spread::new(of(false, true).map(|d| d.status.exchange_ns));
    let quiet = Spread::new(told.late_quiet.iter().copied());
    let swapping = Spread::new(told.late_swapping.iter().copied());
    // Writing to a String never fails.
    let _ = writeln!(page, "| exchange in the lane, µs | {} |", exchange.row(US));
    let _ = writeln!(page, "| load, check, compile and instantiate beside it, ms | {} |", prepare.row(MS));
    let _ = writeln!(page, "| rollback by hand: exchange in the lane, µs | {} |", back.row(US));
    let _ = writeln!(page, "| rollback by hand: from the order to its end, ms | {} |", Spread::new(of(false, true).map(|d| d.took)).row(MS));
    let _ = writeln!(page, "| start of a scan after the earliest of its thousand, without swaps, µs | {} |", quiet.row(US));
    let _ = writeln!(page, "| the same with swaps, µs | {} |", swapping.row(US));
    let ratio = swapping.p99 as f64 / quiet.p99.max(1) as f64;
    let _ = writeln!(page, "\np99 with swaps over p99 without: {ratio:.2} (target 1.2).\n");
    let memory = |swaps: u64| told.memory.iter().find(|(n, _)| *n >= swaps);
    let rows: Vec<_> = [0, 100, 1000, u64::MAX]
        .into_iter()
        .filter_map(|n| if n == u64::MAX { told.memory.last() } else { memory(n) })
        .map(|(n, bytes)| format!("{:.1} MB after {n}", *bytes as f64 / 1e6))
        .collect();
    let _ = writeln!(page, "Resident memory, with all records and values that the bench itself keeps: {} swaps.\n", rows.join(", "));
    page
}

/// Cost of saving and restoring, over the size of the state.
fn states() -> String {
    let mut page = String::from("| fields of the state | save: p50, µs | p99 | restore: p50 | p99 |\n|---|---|---|---|---|\n");
    let engine = Engine::new(EngineOptions { cache: None, ..EngineOptions::default() }).expect("an engine");
    for fields in [10usize, 100, 1000] {
        let component = engine.load_bytes("state", &counter(fields - 2, 7, 0)).expect("a component");
        let template = component.template(&component.class(None).expect("a class")).expect("a template");
        let mut instance = template.instantiate(&Limits { budget_ticks: 1_000_000, ..Limits::default() }).expect("an instance");
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
