//! Searches that no component can be made for.

use super::*;
use latchwork_block::{Engine, EngineOptions, Ticker};
use std::cell::Cell;
use std::time::Duration;

fn shipped(engine: &Engine, name: &str) -> Subject {
    let exe = std::env::current_exe().expect("a test has a file");
    // TARGET/release/deps/NAME
    let target = exe.ancestors().nth(3).expect("the target folder");
    let path = target.join("components").join(name).with_extension("wasm");
    let component = engine.load_file(&path);
    let component = component.unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", path.display()));
    let class = component.class(None).expect("its class");
    let template = component.template(&class).expect("it compiles");
    Subject { component, class, template }
}

/// No block without imports can be made to differ from itself: two blocks of the same ports stand in for one.
#[test]
fn instances_that_differ_by_themselves_are_not_deterministic() {
    let engine = Engine::new(EngineOptions::default()).expect("an engine");
    let options = Options { sequences: Some(50), ..Options::default() };
    let _ticker = Ticker::start(&engine, Duration::from_nanos(options.tick));
    let (on, off) = (shipped(&engine, "ton"), shipped(&engine, "tof"));
    let report = Search::new([&on, &off], &options, &|| 0).run(&mut |_| ControlFlow::Continue(()));
    let kinds: Vec<_> = report.findings.iter().map(|f| f.kind).collect();
    assert_eq!(kinds, [Kind::NotDeterministic], "{:#?}", report.findings);
    let finding = &report.findings[0];
    assert_eq!(finding.executions, 1, "one execution is enough: {finding:#?}");
    assert!(finding.message.ends_with(" not the same in two instances that were told the same"), "{}", finding.message);
    assert!(finding.case.as_deref().is_some_and(|c| c.contains("# By chance it may pass.")));
    // Each is the same as itself.
    assert_eq!(Search::new([&off, &off], &options, &|| 0).run(&mut |_| ControlFlow::Continue(())).findings, []);
}

/// A search for so long on a clock that goes on by `step` ns at each look, and what the clock shows at its end.
fn at_counted_time(time: u64, step: u64) -> (Report, u64) {
    let engine = Engine::new(EngineOptions::default()).expect("an engine");
    // No execution is late.
    let options = Options { seed: 3, time: Some(time), budget: u64::MAX, ..Options::default() };
    let (on, off) = (shipped(&engine, "ton"), shipped(&engine, "tof"));
    let now = Cell::new(0);
    let clock = || now.replace(now.get() + step);
    let report = Search::new([&on, &off], &options, &clock).run(&mut |_| ControlFlow::Continue(()));
    (report, now.get())
}

#[test]
fn shrinking_ends_with_its_share_of_the_time_and_the_search_goes_on() {
    let (whole, _) = at_counted_time(100_000, 1);
    assert!(whole.findings[0].smallest, "{whole:#?}");
    // A few looks at the clock for all of the shrinking.
    let (cut, end) = at_counted_time(40, 1);
    let finding = &cut.findings[0];
    assert!(!finding.smallest && finding.executions >= whole.findings[0].executions, "{finding:#?}");
    let text = finding.case.as_deref().expect("the best so far is written");
    assert!(text.contains("# There may be a smaller one: the time to look for it was over.\n"), "{text}");
    assert!(cut.sequences > 1, "the search ended with the first thing that it found");
    assert!(end >= 40, "the time was not used: {end}");
}

#[test]
fn a_search_whose_time_is_over_at_once_does_the_least() {
    let hour = 3_600_000_000_000;
    let (report, _) = at_counted_time(1_000_000_000, hour);
    assert!(report.executions >= 256 || report.sequences >= 16, "{report:#?}");
    assert_eq!(report.findings[0].kind, Kind::NotDeterministic);
    assert!(!report.findings[0].smallest);
}
