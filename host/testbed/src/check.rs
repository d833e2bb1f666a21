//! Whether a plant would take a block, and what it would get: what a person wants to know before a component goes near a plant.

use crate::case::Subject;
use crate::fuzz::{Kind, Options, Report, TOO_FEW, fuzz};
use latchwork_block::{CallPath, Class, FaultKind};
use latchwork_image::format_duration;
use latchwork_schema::format_size;
use serde::Serialize;
use std::ops::ControlFlow;

/// How a line of the check went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// As it should be.
    Fine,
    /// Worth to know; a plant takes it all the same.
    Note,
    /// A plant takes it, but what rests on this is not to be trusted.
    Doubt,
    /// A plant does not take it, or parks it sooner or later.
    Bad,
}

/// What becomes of a block in a plant. Later ones are worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A plant takes it.
    Accepted,
    /// A plant takes it, but some of what a plant does with blocks is not to be trusted.
    AcceptedWithReservations,
    /// A plant does not take it, or parks it sooner or later.
    Refused,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Line {
    /// What.
    pub name: &'static str,
    /// How it is.
    pub status: Status,
    /// What was found.
    pub found: String,
}

/// The check of one class of a component.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct BlockCheck {
    /// A plant would take it, if with reservations.
    pub ok: bool,
    /// What becomes of it.
    pub verdict: Verdict,
    /// What is not to be trusted, in a sentence each.
    pub reservations: Vec<&'static str>,
    /// In the order of a report.
    pub lines: Vec<Line>,
    /// What fuzzing found.
    pub fuzz: Report,
}

/// Looks at a class of a component and fuzzes it. `clock` and the engine's ticks are as for [`fuzz`].
pub fn check(subject: &Subject, options: &Options, clock: &dyn Fn() -> u64) -> BlockCheck {
    let report = fuzz(subject, options, clock, &mut |_| ControlFlow::Continue(()));
    let class = &*subject.class;
    let mut lines = vec![
        line("class", Status::Fine, class.name.clone()),
        line("ports", Status::Fine, ports(class)),
        imports(subject),
        line("size", Status::Fine, format!("{} bytes", subject.component.size())),
        call_path(subject),
        settings(class, &report),
        faults(&report),
        time(&report, options),
        memory(&report, options),
    ];
    if report.executions > 0 {
        lines.extend([sameness(&report), restarts(class, &report), numbers(&report)]);
    }
    let lines: Vec<_> = lines.into_iter().filter(|l| !l.found.is_empty()).collect();
    let reservations: Vec<_> = report.findings.iter().filter_map(|f| reservation(f.kind)).collect();
    let ok = lines.iter().all(|l| l.status != Status::Bad);
    let verdict = match (ok, reservations.is_empty()) {
        (false, _) => Verdict::Refused,
        (true, false) => Verdict::AcceptedWithReservations,
        (true, true) => Verdict::Accepted,
    };
    BlockCheck { ok, verdict, reservations, lines, fuzz: report }
}

/// What a plant cannot rely on with a block that it takes all the same. A class may mean to begin anew after a restart: that
/// is a note.
fn reservation(kind: Kind) -> Option<&'static str> {
    match kind {
        Kind::SaveDisturbs => Some("retaining its state changes what it does: leave out `retain`, and do not swap it"),
        Kind::RefusalDisturbs => Some("settings that it refused are in force: write none that it may refuse"),
        Kind::NotDeterministic => {
            Some("it does not do the same twice: no replay, shadow or test of it is to be trusted")
        }
        _ => None,
    }
}

fn line(name: &'static str, status: Status, found: impl Into<String>) -> Line {
    Line { name, status, found: found.into() }
}

fn ports(class: &Class) -> String {
    let groups = [
        (class.inputs.len(), "input", "inputs"),
        (class.outputs.len(), "output", "outputs"),
        (class.settings.len(), "setting", "settings"),
        (class.commands.len(), "command", "commands"),
        (class.alarms.len(), "alarm", "alarms"),
        (class.retained.len(), "retained field", "retained fields"),
    ];
    let groups = groups.into_iter().filter(|(n, ..)| *n > 0);
    groups.map(|(n, one, many)| format!("{n} {}", if n == 1 { one } else { many })).collect::<Vec<_>>().join(", ")
}

fn imports(subject: &Subject) -> Line {
    let imports = subject.component.imports();
    // A component with any other import is not loaded.
    let found = if imports.is_empty() { "none".into() } else { format!("{}, which is allowed", imports.join(", ")) };
    line("imports", Status::Fine, found)
}

fn call_path(subject: &Subject) -> Line {
    match (subject.template.path(), subject.template.why_not_plain()) {
        (CallPath::Component, Some(why)) => {
            line("call path", Status::Note, format!("component, some times slower than plain: {why}"))
        }
        (CallPath::Component, None) => line("call path", Status::Note, "component, some times slower than plain"),
        (CallPath::Plain, _) => line("call path", Status::Fine, "plain"),
    }
}

fn settings(class: &Class, report: &Report) -> Line {
    let refused = report.notes.iter().find(|n| n.starts_with("it refuse"));
    match refused {
        Some(note) if report.executions == 0 => line("settings", Status::Bad, note),
        Some(note) => line("settings", Status::Note, note),
        None if class.settings.is_empty() => line("settings", Status::Fine, ""),
        None => {
            let (taken, refused) = (report.settings_taken, report.settings_refused);
            line("settings", Status::Fine, format!("took its own and {taken} random ones, refused {refused}"))
        }
    }
}

fn messages(report: &Report, kinds: impl Fn(Kind) -> bool) -> Option<String> {
    let list: Vec<_> = report.findings.iter().filter(|f| kinds(f.kind)).map(|f| f.message.as_str()).collect();
    (!list.is_empty()).then(|| list.join("; "))
}

fn faults(report: &Report) -> Line {
    match messages(report, |k| matches!(k, Kind::Fault(kind) if kind != FaultKind::Memory)) {
        Some(faults) => line("faults", Status::Bad, faults),
        None if report.executions == 0 => line("faults", Status::Bad, "it could not be executed"),
        None => line("faults", Status::Fine, format!("none in {} executions", report.executions)),
    }
}

fn time(report: &Report, options: &Options) -> Line {
    if report.executions == 0 {
        return line("time", Status::Fine, "");
    }
    let figures = format!(
        "{} typical, {} at worst, of {}",
        shown(report.median_ns),
        shown(report.worst_ns),
        format_duration(options.budget)
    );
    match messages(report, |k| k == Kind::Budget) {
        Some(late) => line("time", Status::Bad, format!("{late}; {figures}")),
        None => line("time", Status::Fine, figures),
    }
}

fn memory(report: &Report, options: &Options) -> Line {
    let figures = format!("{} of {}", format_size(report.memory), format_size(options.memory));
    match messages(report, |k| matches!(k, Kind::Growth | Kind::Fault(FaultKind::Memory))) {
        Some(grows) => line("memory", Status::Bad, format!("{grows}; {figures}")),
        None if report.notes.iter().any(|n| n == TOO_FEW) => {
            line("memory", Status::Note, format!("{figures}; {TOO_FEW}, --runs 1000 are enough"))
        }
        None => line("memory", Status::Fine, figures),
    }
}

/// Whether it is the same in every run, and disturbed by nothing.
fn sameness(report: &Report) -> Line {
    match messages(report, |k| matches!(k, Kind::NotDeterministic | Kind::SaveDisturbs | Kind::RefusalDisturbs)) {
        Some(different) => line("determinism", Status::Doubt, different),
        None => line("determinism", Status::Fine, "two instances did the same in every execution"),
    }
}

fn restarts(class: &Class, report: &Report) -> Line {
    match messages(report, |k| k == Kind::NotRestored) {
        Some(different) => line("restart", Status::Note, different),
        None if class.retained.is_empty() => {
            line("restart", Status::Note, "its class retains nothing: it begins anew after a restart or a swap")
        }
        None => {
            let found = format!("went on from its saved state as if nothing had been, {} times", report.restarts);
            line("restart", Status::Fine, found)
        }
    }
}

fn numbers(report: &Report) -> Line {
    let nan: Vec<_> = report.notes.iter().filter(|n| n.contains(" was NaN ")).map(String::as_str).collect();
    line("NaN", Status::Note, nan.join("; "))
}

/// A time with its unit.
pub(crate) fn shown(ns: u64) -> String {
    match ns {
        0..10_000 => format!("{ns} ns"),
        10_000..10_000_000 => format!("{} us", ns / 1_000),
        _ => format!("{} ms", ns / 1_000_000),
    }
}
