//! No shipped block and no example has anything that fuzzing finds. `LATCHWORK_FUZZ_SEED` takes another seed, `LATCHWORK_FUZZ_RUNS` another
//! number of sequences: a search for an afternoon. Needs `cargo xtask guests`.

use latchwork_block::{Engine, EngineOptions, FaultKind, LoadError, Ticker};
use latchwork_testbed::case::Subject;
use latchwork_testbed::fuzz::{Kind, Options, fuzz};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The same in every run, so that a build breaks because of a change and not because of the day.
const SEED: u64 = 20_261_127;
/// Sequences of a block.
const RUNS: u64 = 500;

/// What is meant to be so.
fn meant(block: &str) -> Vec<Kind> {
    match block {
        // The class says what a restart begins anew: "Running pulses and the phase of the lamp start anew." "The average
        // starts anew, and the first execution checks." What the operator sees and the references of the checks go over.
        "alarm-unit" | "analog-veracity" => vec![Kind::NotRestored],
        // The example of a version that is taken back: it traps in its 200th execution.
        "pump-hours-3" => vec![Kind::Fault(FaultKind::Trap)],
        _ => Vec::new(),
    }
}

fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|e| panic!("{name} is \"{text}\": {e}; expected a whole number")))
}

fn components() -> Vec<PathBuf> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    let mut list = Vec::new();
    for folder in ["components", "example-components"].map(|f| target.join(f)) {
        let entries = std::fs::read_dir(&folder);
        let entries = entries.unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", folder.display()));
        list.extend(entries.map(|e| e.expect("a readable folder").path()));
    }
    // `stress` is made to have every fault.
    list.retain(|p| p.extension().is_some_and(|e| e == "wasm") && p.file_stem().is_some_and(|n| n != "stress"));
    list.sort();
    list
}

#[test]
fn no_shipped_block_has_anything_that_fuzzing_finds() {
    let seed = number("LATCHWORK_FUZZ_SEED").unwrap_or(SEED);
    let options = Options {
        seed,
        sequences: Some(number("LATCHWORK_FUZZ_RUNS").unwrap_or(RUNS)),
        // What a busy machine does not miss three times in the same place.
        budget: 20_000_000,
        ..Options::default()
    };
    // Past the capture of a test's output: the seed is to be seen in any log.
    let _ = writeln!(std::io::stderr(), "LATCHWORK_FUZZ_SEED={seed}");
    let engine = Engine::new(EngineOptions::default()).expect("an engine");
    let _ticker = Ticker::start(&engine, Duration::from_nanos(options.tick));
    let begun = Instant::now();
    let (mut faults, mut blocks) = (Vec::new(), 0);
    for path in components() {
        let component = match engine.load_file(&path) {
            Ok(component) => component,
            // Loggers.
            Err(LoadError::NoClass { .. } | LoadError::Import { .. }) => continue,
            Err(error) => panic!("{}: {error}", path.display()),
        };
        for class in component.classes() {
            let class = component.class(Some(&class.name)).expect("its own class");
            let template = component.template(&class).expect("it compiles");
            let subject = Subject { component: component.clone(), class, template };
            let options = Options { ignored: meant(component.name()), ..options.clone() };
            let report = fuzz(&subject, &options, &|| begun.elapsed().as_nanos() as u64, &mut |_| {
                std::ops::ControlFlow::Continue(())
            });
            let (name, notes) = (component.name(), report.notes.join("; "));
            println!("{name}: {} executions, {} restarts; {notes}", report.executions, report.restarts);
            assert!(report.executions > options.sequences.unwrap_or(0), "{name} was hardly executed");
            blocks += 1;
            let name = format!("{name}.wasm");
            faults.extend(report.findings.iter().map(|f| format!("{name}: {}: {}", f.kind.name(), f.message)));
            faults.extend(report.test_file(&name));
        }
    }
    assert!(blocks > 0);
    println!("{blocks} blocks in {:?}", begun.elapsed());
    assert!(faults.is_empty(), "LATCHWORK_FUZZ_SEED={seed} finds:\n{}", faults.join("\n"));
}
