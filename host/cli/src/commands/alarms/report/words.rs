//! The report for people: the lists that terminal and page share, and the terminal's form.

use super::Found;
use comfy_table::{Table, presets};
use latchwork_alarm::report::{DAY, Figure, Rank, Report, SECOND, Unit};
use latchwork_image::format_duration;
use std::cmp::Reverse;
use std::fmt::Write;

/// Rows of a list on a terminal; the whole lists are in the JSON form.
const ROWS: usize = 10;

/// A list under its title.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) header: &'static [&'static str],
    pub(super) rows: Vec<Vec<String>>,
}

/// A point in time, to the second.
pub(super) fn moment(ns: u64) -> String {
    match jiff::Timestamp::from_nanosecond(ns.into()) {
        Ok(time) => time.strftime("%F %T").to_string(),
        Err(_) => format!("{ns}ns"),
    }
}

/// A span of time, as exact as a person wants it.
pub(super) fn span(ns: u64) -> String {
    let unit = match ns {
        0..1_000_000 => 1,
        1_000_000..SECOND => 1_000_000,
        SECOND..60_000_000_000 => SECOND / 10,
        _ => SECOND,
    };
    let (days, rest) = (ns / DAY, ns % DAY / unit * unit);
    match (days, rest) {
        (0, rest) => format_duration(rest),
        (days, 0) => format!("{days}d"),
        (days, rest) => format!("{days}d {}", format_duration(rest / (60 * SECOND) * 60 * SECOND)),
    }
}

/// The value of a figure.
pub(super) fn value(figure: &Figure) -> String {
    match (figure.value, figure.unit) {
        (None, _) => "-".into(),
        (Some(value), Unit::Count) if value.fract() == 0.0 => format!("{value}"),
        (Some(value), Unit::Count) => format!("{value:.2}"),
        (Some(value), Unit::Percent) => format!("{value:.1} %"),
        (Some(value), Unit::Seconds) => span((value * SECOND as f64) as u64),
    }
}

/// The period in words.
pub(super) fn period(report: &Report) -> String {
    format!("{} to {} UTC ({})", moment(report.from), moment(report.to), span(report.length()))
}

/// What a reader must know before believing the figures.
pub(super) fn notes(found: &Found) -> Vec<String> {
    let report = &found.report;
    let mut notes = Vec::new();
    if report.length() < 30 * DAY {
        notes.push(format!("the limits are meant for 30 days and more; this is about {}", span(report.length())));
    }
    if report.jumps > 0 {
        let times = if report.jumps == 1 { "once".into() } else { format!("{} times", report.jumps) };
        let then = if found.from_asked {
            "alarms with a wrong time count where that puts them, or not at all"
        } else {
            "the period begins after the last time; --from takes in what was before"
        };
        notes.push(format!("the clock jumped {times}, by more than a day back or 90 days ahead; {then}"));
    }
    if report.lost > 0 {
        notes.push(format!("{} records are missing from the journal; alarms may have been among them", report.lost));
    }
    if report.set_back > 0 {
        notes.push(format!("the clock was set back {} times; no flood is followed across that", report.set_back));
    }
    if report.unknown > 0 {
        notes.push(format!("{} records have a transition that this program does not know", report.unknown));
    }
    notes
}

/// All lists that are not empty.
pub(super) fn sections(report: &Report) -> Vec<Section> {
    let of_all = |n: u64| format!("{:.1} %", 100.0 * n as f64 / report.raised.max(1) as f64);
    let mut floods = report.floods.clone();
    floods.sort_by_key(|f| Reverse(f.count));
    let priorities = (0..=u8::MAX).zip(report.by_priority.iter()).rev().filter(|(_, n)| **n > 0);
    let figures = report.figures();
    let sections = [
        Section {
            title: "Figures",
            header: &["figure", "value", "recommended", ""],
            rows: figures
                .iter()
                .map(|f| {
                    let verdict = f.verdict().map_or("", |v| v.name());
                    vec![f.name.into(), value(f), f.recommended().unwrap_or_default(), verdict.into()]
                })
                .collect(),
        },
        Section {
            title: "Most frequent",
            header: &["alarm", "raised", "of all"],
            rows: report
                .frequent
                .iter()
                .map(|f| vec![f.alarm.to_string(), f.raised.to_string(), of_all(f.raised)])
                .collect(),
        },
        Section {
            title: "Priorities",
            header: &["priority", "rank", "raised", "of all"],
            rows: priorities
                .map(|(p, n)| vec![p.to_string(), Rank::of(p).name().into(), n.to_string(), of_all(*n)])
                .collect(),
        },
        Section {
            title: "Floods, the largest first",
            header: &["start", "lasted", "alarms", ""],
            rows: floods
                .iter()
                .map(|f| {
                    let open = if f.open { "goes on" } else { "" };
                    vec![moment(f.start), span(f.end - f.start), f.count.to_string(), open.into()]
                })
                .collect(),
        },
        Section {
            title: "Chattering: three times within a minute",
            header: &["alarm", "raised so", "runs", "three within"],
            rows: report
                .chattering
                .iter()
                .map(|c| vec![c.alarm.to_string(), c.raised.to_string(), c.runs.to_string(), span(c.fastest)])
                .collect(),
        },
        Section {
            title: "Fleeting: gone within a second",
            header: &["alarm", "times", "shortest"],
            rows: report
                .fleeting
                .iter()
                .map(|f| vec![f.alarm.to_string(), f.count.to_string(), span(f.shortest)])
                .collect(),
        },
        Section {
            title: "Stale: active for more than a day",
            header: &["alarm", "since", "for", ""],
            rows: report
                .stale
                .iter()
                .map(|s| {
                    let now = if s.standing { "active still" } else { "" };
                    vec![s.alarm.to_string(), moment(s.since), span(s.lasted), now.into()]
                })
                .collect(),
        },
        Section {
            title: "Not normal at the end",
            header: &["alarm", "state", "since", "priority"],
            rows: report
                .now
                .iter()
                .map(|s| vec![s.alarm.to_string(), s.state.name().into(), moment(s.since), s.priority.to_string()])
                .collect(),
        },
    ];
    sections.into_iter().filter(|s| !s.rows.is_empty()).collect()
}

/// The form for a terminal.
pub(super) fn table(found: &Found) -> String {
    let mut out = format!("Alarms of {}\n{}\n", found.journal, period(&found.report));
    for note in notes(found) {
        // Writing to a String never fails.
        let _ = writeln!(out, "note: {note}");
    }
    for (number, section) in sections(&found.report).iter().enumerate() {
        let rows = if number == 0 { section.rows.len() } else { ROWS };
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(section.header);
        for row in section.rows.iter().take(rows) {
            table.add_row(row);
        }
        let _ = writeln!(out, "\n{}\n{table}", section.title);
        if section.rows.len() > rows {
            let _ = writeln!(out, "… {} more; --format json has all", section.rows.len() - rows);
        }
    }
    out
}
