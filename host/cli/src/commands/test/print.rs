//! What a person reads.

use super::{Round, Tested};
use crate::report;
use latchwork_image::plain;
use std::time::Duration;

/// A file: its cases, and what is wrong.
pub(super) fn file(tested: &Tested) {
    let checked = &tested.checked;
    let Some(tests) = &checked.tests else {
        report::say(&format!("{}\n\n", checked.render(report::colours()).trim_end()));
        return;
    };
    if tested.cases.is_empty() {
        return;
    }
    let mut out = format!("{}  {}\n", plain(&checked.path.display().to_string()), plain(tests.name()));
    for case in tested.cases.iter().map(|c| &c.report) {
        let name = plain(&case.name);
        let steps = format!("{} step{}", case.steps, if case.steps == 1 { "" } else { "s" });
        if case.passed {
            out += &format!("  ok      {name}  ({steps})\n");
            continue;
        }
        out += &format!("  FAILED  {name}\n");
        for failure in &case.failures {
            out += &format!("\n{}", failure.render(10));
        }
        if case.more_failures > 0 {
            out += &format!("\n          and {} more steps that are not as expected\n", case.more_failures);
        }
        out.push('\n');
    }
    report::say(&format!("{}\n\n", out.trim_end()));
}

/// The closing line.
pub(super) fn summary(round: &Round) -> String {
    let (all, failed, wrong) = (round.cases().count(), round.failed(), round.wrong());
    let sum = |of: fn(&super::CaseReport) -> u64| round.cases().map(|c| of(&c.report)).sum::<u64>();
    let steps = sum(|r| r.steps as u64);
    let mut out = format!("{} passed, {failed} failed", all - failed);
    if wrong > 0 {
        out += &format!(", {wrong} file{} not tested", if wrong == 1 { "" } else { "s" });
    }
    out += &format!(" in {}: {steps} steps, {} executions", shown(round.took), sum(|r| r.executions));
    // Loading and compiling is no part of it.
    let seconds = round.cases().map(|c| c.took).sum::<Duration>().as_secs_f64();
    if seconds > 0.0 && steps > 0 {
        out += &format!(", {:.0} steps/s", steps as f64 / seconds);
    }
    out + "\n"
}

fn shown(took: Duration) -> String {
    match took.as_millis() {
        0..1_000 => format!("{} ms", took.as_millis()),
        _ => format!("{:.1} s", took.as_secs_f64()),
    }
}
