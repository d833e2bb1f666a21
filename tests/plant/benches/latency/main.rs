//! Signal to output: the interrupt lane's reaction beside a main lane with 1 to 1000 ms of real work per scan, next to
//! cyclictest on the same CPU, and the cyclic path for comparison.
//!
//! `cargo xtask bench latency` runs it as root or with the right to SCHED_FIFO. `--events N` (100000), `--cpu N` (the last),
//! `--plot FILE` and `--table FILE` say how much and where to.

mod cyclictest;
mod figures;
mod plants;
mod plot;
mod share;
mod timer;

use figures::Figures;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use timer::{Line, monotonic};

/// Time between two edges, µs: as between two wakes of cyclictest.
const INTERVAL_US: u64 = 500;
/// Work of the main lane per scan, ms.
const SCANS_MS: [u64; 4] = [1, 10, 100, 1000];

/// Times that lane and cyclictest are measured in turn.
const ROUNDS: usize = 5;

/// What was measured with one length of the main scan.
pub(crate) struct Measured {
    scan_ms: u64,
    /// Every edge.
    interrupt: Figures,
    /// Edges that woke the lane. cyclictest counts so: what passes while it is held up, it leaves out.
    woken: Figures,
    cyclic: Figures,
    cyclictest: Option<Figures>,
}

struct Args {
    events: usize,
    cpu: usize,
    plot: Option<PathBuf>,
    table: Option<PathBuf>,
}

impl Args {
    fn parse() -> Self {
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        let mut args = Self { events: 100_000, cpu: cpus - 1, plot: None, table: None };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number =
                || words.next().and_then(|w| w.parse().ok()).unwrap_or_else(|| panic!("{word} takes a number"));
            match word.as_str() {
                "--events" => args.events = number(),
                "--cpu" => args.cpu = number(),
                "--plot" => args.plot = words.next().map(PathBuf::from),
                "--table" => args.table = words.next().map(PathBuf::from),
                // cargo's own.
                "--bench" => {}
                other => panic!("{other} is not known; there are --events, --cpu, --plot and --table"),
            }
        }
        args
    }
}

fn main() {
    let args = Args::parse();
    let _share = share::Share::take(args.cpu);
    let per_ms = plants::iterations_per_ms();
    let mut all = Vec::new();
    for scan_ms in SCANS_MS {
        eprintln!("main scan of {scan_ms} ms: {} edges, cyclictest, cyclic path …", args.events);
        let burn = per_ms * scan_ms;
        let (mut every, mut woken, mut theirs, mut longest) = (Vec::new(), Vec::new(), Vec::new(), 0);
        // In turn: what the machine does meanwhile meets both.
        for _ in 0..ROUNDS {
            for (time, woke) in interrupt(&args, scan_ms, burn) {
                every.push(time);
                woken.extend(woke.then_some(time));
            }
            if let Some((samples, max)) = beside(&args, scan_ms, burn) {
                theirs.extend(samples);
                longest = max.max(longest);
            }
        }
        let cyclictest = (!theirs.is_empty()).then(|| {
            let figures = Figures::new(theirs);
            // Beyond the histogram only the longest is known.
            Figures { max: figures.max.max(longest), ..figures }
        });
        let cyclic = cyclic(&args, scan_ms, burn);
        let (interrupt, woken) = (Figures::new(every), Figures::new(woken));
        all.push(Measured { scan_ms, interrupt, woken, cyclic, cyclictest });
    }
    let mut page = table(&args, &all);
    page += &sustained(&args);
    println!("{page}");
    if let Some(path) = &args.table {
        std::fs::write(path, &page).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    if let Some(path) = &args.plot {
        plot::draw(path, &all).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}

/// Edges from a timer, outputs by the lane.
fn interrupt(args: &Args, scan_ms: u64, burn: u64) -> Vec<(u64, bool)> {
    let events = args.events / ROUNDS;
    let line = Line::new(events);
    let plant = plants::interlock(args.cpu, scan_ms, burn, &line);
    line.arm(monotonic() + 300_000_000, INTERVAL_US * 1000);
    let duration = Duration::from_micros(events as u64 * INTERVAL_US) + Duration::from_millis(700);
    let told = plants::run(plant, Some(duration), None);
    report(&told);
    line.samples().collect()
}

fn report(told: &plants::Told) {
    for line in told.lost.iter().chain(&told.trouble) {
        eprintln!("  {line}");
    }
}

/// cyclictest beside the same main lane.
fn beside(args: &Args, scan_ms: u64, burn: u64) -> Option<(Vec<u64>, u64)> {
    let until = Arc::new(AtomicBool::new(false));
    let plant = plants::load(args.cpu, scan_ms, burn);
    let over = Arc::clone(&until);
    let lane = std::thread::spawn(move || plants::run(plant, None, Some(over)));
    std::thread::sleep(Duration::from_millis(300));
    let figures = cyclictest::run(args.cpu, plants::PRIORITY, INTERVAL_US, args.events / ROUNDS / 2);
    until.store(true, Ordering::Relaxed);
    report(&lane.join().expect("the load"));
    figures
}

/// The same edge through a block of the main lane.
fn cyclic(args: &Args, scan_ms: u64, burn: u64) -> Figures {
    let edges = (4000 / scan_ms).clamp(12, 200);
    let line = Line::new(edges as usize);
    let plant = plants::interlock(args.cpu, scan_ms, burn, &line);
    let mut output = plants::slow_output(&plant);
    let until = Arc::new(AtomicBool::new(false));
    let over = Arc::clone(&until);
    let lane = std::thread::spawn(move || plants::run(plant, None, Some(over)));
    let mut samples = Vec::new();
    std::thread::sleep(Duration::from_millis(300 + 2 * scan_ms));
    for n in 0..edges {
        output.refresh();
        let before = output.cell(0);
        // Spread over the cycle, in no step with it.
        let at = monotonic() + 1_000_000 + (n * 618_034 % 1_000_000) * plants::period_ms(scan_ms);
        line.arm(at, 0);
        let limit = at + (scan_ms * 10 + 1000) * 1_000_000;
        loop {
            output.refresh();
            let now = monotonic();
            if output.cell(0) != before {
                samples.push(now.saturating_sub(at));
                break;
            }
            assert!(now < limit, "the main lane has not answered");
            std::thread::sleep(Duration::from_micros(50));
        }
    }
    until.store(true, Ordering::Relaxed);
    report(&lane.join().expect("the lanes"));
    Figures::new(samples)
}

/// 20 000 edges a second for ten seconds.
fn sustained(args: &Args) -> String {
    let line = Line::new(200_000);
    let plant = plants::interlock(args.cpu, 1, 1000, &line);
    line.arm(monotonic() + 300_000_000, 50_000);
    let told = plants::run(plant, Some(Duration::from_millis(10_500)), None);
    let figures = Figures::new(line.samples().map(|s| s.0).collect());
    let lost = if told.lost.is_empty() { "none lost".to_owned() } else { told.lost.join(", ") };
    format!(
        "\nSustained: {} edges at 20 000 a second, {} outputs, {lost}; p50 {:.1} µs, p99 {:.1} µs.\n",
        line.edges.load(Ordering::Relaxed),
        figures.count,
        figures.p50 as f64 / 1000.0,
        figures.p99 as f64 / 1000.0
    )
}

fn table(args: &Args, all: &[Measured]) -> String {
    let mut page = format!(
        "{} edges, one every {INTERVAL_US} µs, on one CPU with the main lane, whose period is twice its scan; µs (the cyclic path \
         in ms).\n\n\
         | main scan | interrupt lane, every edge: p50 | p99 | p99.9 | max | edges that woke it: p50 | p99 | p99.9 | max | \
         cyclictest: p50 | p99 | p99.9 | max | cyclic path p50, ms | max, ms |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        args.events
    );
    for m in all {
        let cyclictest = m.cyclictest.map_or("– | – | – | –".into(), |f| f.row());
        let ms = |ns: u64| ns as f64 / 1e6;
        let _ = writeln!(
            page,
            "| {} ms | {} | {} | {cyclictest} | {:.1} | {:.1} |",
            m.scan_ms,
            m.interrupt.row(),
            m.woken.row(),
            ms(m.cyclic.p50),
            ms(m.cyclic.max)
        );
    }
    let targets = all.iter().filter_map(|m| {
        let c = m.cyclictest?;
        let ratio = |own: u64, theirs: u64| own as f64 / (theirs as f64 * 1.5 + 10_000.0);
        Some((m.scan_ms, ratio(m.woken.p50, c.p50), ratio(m.woken.p99, c.p99)))
    });
    let _ = writeln!(
        page,
        "\nA machine that stands still for 10 ms delays twenty edges, and each of them counts in the first four columns; \
         cyclictest counts one wake and leaves out the periods it has missed, as the second four do.\n\n\
         Edges that woke the lane against 1.5 × cyclictest + 10 µs (below 1 is within it):"
    );
    for (scan_ms, p50, p99) in targets {
        let _ = writeln!(page, "- main scan {scan_ms} ms: p50 {p50:.2}, p99 {p99:.2}");
    }
    if let (Some(first), Some(last)) = (all.first(), all.last()) {
        let ratio = last.woken.p99 as f64 / first.woken.p99.max(1) as f64;
        let _ =
            writeln!(page, "\np99 at {} ms over p99 at {} ms: {ratio:.2} (target 1.1).", last.scan_ms, first.scan_ms);
    }
    page
}
