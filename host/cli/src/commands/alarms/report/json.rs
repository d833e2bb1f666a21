//! The report for programs.

use super::{Found, words};
use latchwork_alarm::report::{Rank, SECOND, Unit};
use latchwork_record::rfc3339;
use serde::{Serialize, Serializer};

/// The whole report. Lists are written as they are read: a year has 50,000 periods of ten minutes.
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Document<'a> {
    journal: &'a str,
    from: Time,
    to: Time,
    seconds: f64,
    notes: Vec<String>,
    lost: u64,
    figures: Vec<Figure>,
    most_frequent: Vec<Frequent<'a>>,
    priorities: Vec<Priority>,
    floods: Vec<Flood>,
    chattering: Vec<Chattering<'a>>,
    fleeting: Vec<Fleeting<'a>>,
    stale: Vec<Stale<'a>>,
    not_normal: Vec<Standing<'a>>,
    ten_minutes: Vec<Period>,
}

/// A point in time, ns since 1970; RFC 3339 in the document.
struct Time(u64);

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&rfc3339(self.0))
    }
}

#[derive(Serialize)]
struct Figure {
    id: &'static str,
    name: &'static str,
    value: Option<f64>,
    unit: &'static str,
    recommended: Option<String>,
    verdict: Option<&'static str>,
}

#[derive(Serialize)]
struct Frequent<'a> {
    alarm: &'a str,
    raised: u64,
}

#[derive(Serialize)]
struct Priority {
    priority: u8,
    rank: &'static str,
    raised: u64,
}

#[derive(Serialize)]
struct Flood {
    start: Time,
    end: Time,
    alarms: u64,
    open: bool,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Chattering<'a> {
    alarm: &'a str,
    raised: u64,
    runs: u64,
    three_within: f64,
}

#[derive(Serialize)]
struct Fleeting<'a> {
    alarm: &'a str,
    count: u64,
    shortest: f64,
}

#[derive(Serialize)]
struct Stale<'a> {
    alarm: &'a str,
    since: Time,
    seconds: f64,
    active: bool,
}

#[derive(Serialize)]
struct Standing<'a> {
    alarm: &'a str,
    state: &'static str,
    since: Time,
    priority: u8,
}

#[derive(Serialize)]
struct Period {
    start: Time,
    low: u32,
    medium: u32,
    high: u32,
    urgent: u32,
}

fn seconds(ns: u64) -> f64 {
    ns as f64 / SECOND as f64
}

fn figure(f: &latchwork_alarm::report::Figure) -> Figure {
    let unit = match f.unit {
        Unit::Count => "count",
        Unit::Percent => "percent",
        Unit::Seconds => "seconds",
    };
    let (recommended, verdict) = (f.recommended(), f.verdict().map(|v| v.name()));
    Figure { id: f.id, name: f.name, value: f.value, unit, recommended, verdict }
}

/// Times are RFC 3339, spans are seconds.
///
/// # Errors
/// None that a report can cause.
pub(super) fn document(found: &Found) -> serde_json::Result<String> {
    let report = &found.report;
    let priorities = (0..=u8::MAX).zip(report.by_priority.iter()).filter(|(_, raised)| **raised > 0);
    let document = Document {
        journal: &found.journal,
        from: Time(report.from),
        to: Time(report.to),
        seconds: seconds(report.length()),
        notes: words::notes(found),
        lost: report.lost,
        figures: report.figures().iter().map(figure).collect(),
        most_frequent: report.frequent.iter().map(|f| Frequent { alarm: &f.alarm, raised: f.raised }).collect(),
        priorities: priorities
            .map(|(priority, raised)| Priority { priority, rank: Rank::of(priority).name(), raised: *raised })
            .collect(),
        floods: report
            .floods
            .iter()
            .map(|f| Flood { start: Time(f.start), end: Time(f.end), alarms: f.count, open: f.open })
            .collect(),
        chattering: report
            .chattering
            .iter()
            .map(|c| Chattering { alarm: &c.alarm, raised: c.raised, runs: c.runs, three_within: seconds(c.fastest) })
            .collect(),
        fleeting: report
            .fleeting
            .iter()
            .map(|f| Fleeting { alarm: &f.alarm, count: f.count, shortest: seconds(f.shortest) })
            .collect(),
        stale: report
            .stale
            .iter()
            .map(|s| Stale { alarm: &s.alarm, since: Time(s.since), seconds: seconds(s.lasted), active: s.standing })
            .collect(),
        not_normal: report
            .now
            .iter()
            .map(|s| Standing { alarm: &s.alarm, state: s.state.name(), since: Time(s.since), priority: s.priority })
            .collect(),
        ten_minutes: report
            .bins
            .iter()
            .map(|b| {
                let [low, medium, high, urgent] = b.raised;
                Period { start: Time(b.start), low, medium, high, urgent }
            })
            .collect(),
    };
    serde_json::to_string_pretty(&document)
}
