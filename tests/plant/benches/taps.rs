//! What a tap costs its lane: blocks that nobody listens to, that the flight recorder listens to, that the recorder and a
//! shadow listen to, and whose listener does not keep up.
//!
//! `cargo xtask bench taps` runs it; best on a machine that does nothing else. `--rounds N` and `--table FILE` say how often
//! and where to.

use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::{Request, TapReader, TapSlot, on_tape, room, tap, tap_words, tape};
use latchwork_tests_plant::Rig;
use std::fmt::Write;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

/// Blocks in the lane: more than the first cache holds, as in a plant.
const BLOCKS: usize = 100;
/// Scans of one kind in a row.
const SCANS: u64 = 500;
/// Periods of the lane, ms.
const PERIODS: [u64; 2] = [10, 1];

struct Args {
    rounds: usize,
    table: Option<PathBuf>,
}

impl Args {
    fn parse() -> Self {
        let mut args = Self { rounds: 60, table: None };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            match word.as_str() {
                "--rounds" => {
                    let number = words.next().and_then(|w| w.parse().ok()).filter(|n| *n > 0);
                    args.rounds = number.unwrap_or_else(|| panic!("--rounds takes a number from 1 on"));
                }
                "--table" => args.table = words.next().map(PathBuf::from),
                // cargo's own.
                "--bench" => {}
                other => panic!("{other} is not known; there are --rounds and --table"),
            }
        }
        args
    }
}

/// Who listens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Nobody,
    Recorder,
    Both,
    /// The recorder, which does not read.
    Full,
}

const KINDS: [Kind; 4] = [Kind::Nobody, Kind::Recorder, Kind::Both, Kind::Full];

/// A plant of one lane, its time, and who listens to it.
struct Bench {
    plant: Plant,
    readers: Vec<TapReader>,
    kind: Kind,
    every: u64,
    now: u64,
}

impl Bench {
    fn new(component: &str, inputs: &str, period: u64, kind: Kind) -> Self {
        let mut text = format!("[lane.main]\nevery = \"{period}ms\"\n");
        for n in 0..BLOCKS {
            // Writing to a String never fails.
            let _ = write!(text, "[block.b{n}]\ncomponent = \"{component}\"\nlane = \"main\"\n{inputs}");
        }
        let plant = Rig::new(&text).trace(None).plant(Time::Real);
        let every = plant.lanes[0].every();
        let mut bench = Self { plant, readers: Vec::new(), kind, every, now: 0 };
        let slots: &[_] = match kind {
            Kind::Nobody => &[],
            Kind::Recorder | Kind::Full => &[TapSlot::Recorder],
            Kind::Both => &[TapSlot::Recorder, TapSlot::Shadow],
        };
        if !slots.is_empty() {
            // As the recorder makes it.
            let words = BLOCKS * room(every) * tap_words(&bench.plant.model.blocks[0].class);
            let (tape, reader) = tape(words.max(1 << 16));
            bench.plant.lanes[0].record_on(tape);
            bench.readers.push(reader);
        }
        for slot in slots {
            for block in 0..BLOCKS {
                let class = &bench.plant.model.blocks[block].class;
                let lane_end = match slot {
                    TapSlot::Recorder => on_tape(class, block as u32).0,
                    TapSlot::Shadow => {
                        let (lane_end, reader) = tap(class, room(every), None);
                        bench.readers.push(reader);
                        lane_end
                    }
                };
                let request = Request::Tap { block: block as u32, slot: *slot, tap: lane_end };
                assert!(bench.plant.supervisor.send(0, request).is_ok(), "the lane has room for it");
                // A lane takes some requests per scan.
                bench.scan();
            }
        }
        bench.round();
        bench
    }

    /// One scan; the time it took, ns. What is done between two scans is not in it.
    fn scan(&mut self) -> u64 {
        self.now += self.every;
        let now = self.now;
        let begun = Instant::now();
        black_box(self.plant.lanes[0].scan(now, now, || now));
        let took = begun.elapsed().as_nanos() as u64;
        self.plant.lanes[0].spare(now + self.every, || now);
        if self.kind != Kind::Full {
            for reader in &mut self.readers {
                while reader.next_frame().is_some() {}
            }
        }
        took
    }

    /// Time per block of the middle one of some scans, ns.
    fn round(&mut self) -> f64 {
        let mut took: Vec<_> = (0..SCANS).map(|_| self.scan()).collect();
        took.sort_unstable();
        took[took.len() / 2] as f64 / BLOCKS as f64
    }
}

fn main() {
    let args = Args::parse();
    let mut page = format!(
        "{BLOCKS} blocks in a lane, nobody listening, then listened to; ns per block and execution, the middle one of {} rounds \
         of {SCANS} scans each, which take turns. Target: below 100 ns more.\n\n\
         | block | cells in, out | period, ms | nobody | recorder | more | recorder and shadow | more | nobody reads | more |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
        args.rounds
    );
    let components =
        [("ton", "inputs.in = true\ninputs.pt = \"10h\"\n"), ("alarm-unit", "inputs.level = 1\n"), ("pco", "")];
    for ((component, inputs), period) in components.into_iter().flat_map(|of| PERIODS.map(|period| (of, period))) {
        let mut benches = KINDS.map(|kind| Bench::new(component, inputs, period, kind));
        let mut rounds = KINDS.map(|_| Vec::with_capacity(args.rounds));
        for _ in 0..args.rounds {
            // In turns: what the machine does besides meets all of them.
            for (bench, rounds) in benches.iter_mut().zip(&mut rounds) {
                rounds.push(bench.round());
            }
        }
        let [nobody, recorder, both, full] = rounds.map(|mut all| {
            all.sort_unstable_by(f64::total_cmp);
            all[all.len() / 2]
        });
        let class = &benches[0].plant.model.blocks[0].class;
        let _ = writeln!(
            page,
            "| {component} | {}, {} | {period} | {nobody:.0} | {recorder:.0} | {:.0} | {both:.0} | {:.0} | {full:.0} | {:.0} |",
            class.argument_cells(),
            class.output_cells(),
            recorder - nobody,
            both - nobody,
            full - nobody
        );
    }
    println!("{page}");
    if let Some(path) = &args.table {
        std::fs::write(path, &page).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}
