//! The keys that every sink has: which records, and how many at once.

use crate::{Config, Problem};
use globset::{Glob, GlobSet, GlobSetBuilder};
use latchwork_record::Kind as RecordKind;
use latchwork_record::journal::KindSet;
use latchwork_schema::{Key, Kind, Section, Value};
use std::time::Duration;

const MS: u64 = 1_000_000;

/// Words of `kinds`.
static KIND: Kind = Kind::OneOf(&[
    "alarm",
    "command",
    "setting",
    "event",
    "message",
    "io",
    "lane",
    "fault",
    "swap",
    "audit",
    "heartbeat",
    "lost",
]);

/// Keys of `[sink.NAME]` that every kind of sink has.
pub static KEYS: Section = Section {
    name: "[sink.NAME]",
    doc: "A logger that records go to, from the journal: with `run --data` alone. Its kind decides which further keys it has. It \
          gets each record at least once and in order, however long it was away.",
    keys: &[
        Key::required("kind", Kind::Text, "Kind of sink."),
        Key::optional("kinds", Kind::List(&KIND), "all", "Records of these kinds only."),
        Key::optional(
            "sources",
            Kind::List(&Kind::Text),
            "all",
            "Records of sources that one of these patterns fits: `*` is any text, `?` a character, `{a,b}` one of several.",
        ),
        Key::optional("priority", Kind::Integer { min: 0, max: 255 }, "0", "Records of at least this priority."),
        Key::optional(
            "from",
            Kind::OneOf(&["start", "now"]),
            "\"start\"",
            "Where a sink that is new begins: with the oldest record of the journal, or with those to come.",
        ),
        Key::optional(
            "list",
            Kind::Integer { min: 1, max: 100_000 },
            "1000",
            "Records held in memory for it at once; the others wait in the journal.",
        ),
        Key::optional("batch", Kind::Integer { min: 1, max: 100_000 }, "100", "Records are sent when so many wait, …"),
        Key::optional(
            "wait",
            Kind::Duration { min: 0, max: 3_600_000 * MS },
            "\"1s\"",
            "… or when the first of them has waited so long.",
        ),
        Key::optional(
            "spare",
            Kind::Integer { min: 0, max: 100_000 },
            "50",
            "Places of the list that a batch leaves free.",
        ),
    ],
};

/// What a sink gets, and how.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) kinds: KindSet,
    /// Every source without it.
    pub(crate) sources: Option<GlobSet>,
    pub(crate) priority: u8,
    /// A new sink begins with the records to come.
    pub(crate) now: bool,
    pub(crate) list: usize,
    pub(crate) batch: usize,
    pub(crate) wait: Duration,
    /// Records of one batch at most.
    pub(crate) most: usize,
}

impl Settings {
    pub(crate) fn new(config: &Config) -> Self {
        let values = &config.values;
        let integer = |key: &str, default: i64| values.integer(key).unwrap_or(default);
        let count = |key: &str, default| usize::try_from(integer(key, default)).unwrap_or(usize::MAX).max(1);
        let list = count("list", 1000);
        let spare = usize::try_from(integer("spare", 50)).unwrap_or(0);
        let kinds = values.has("kinds").then(|| {
            let words = texts(values.get("kinds"));
            RecordKind::ALL.into_iter().filter(|k| words.contains(&k.name())).collect()
        });
        Self {
            kinds: kinds.unwrap_or(KindSet::ALL),
            sources: values.has("sources").then(|| globs(config).0),
            priority: u8::try_from(integer("priority", 0)).unwrap_or(u8::MAX),
            now: values.text("from") == Some("now"),
            list,
            batch: count("batch", 100),
            wait: Duration::from_nanos(values.duration("wait").unwrap_or(1000 * MS)),
            most: list.saturating_sub(spare).max(1),
        }
    }
}

/// What is wrong with the keys that every sink has.
pub fn check(config: &Config) -> Vec<Problem> {
    let mut problems = globs(config).1;
    let values = &config.values;
    let (list, batch, spare) = (
        values.integer("list").unwrap_or(1000),
        values.integer("batch").unwrap_or(100),
        values.integer("spare").unwrap_or(50),
    );
    if batch > list - spare {
        let key = ["batch", "spare", "list"].into_iter().find(|k| values.has(k)).unwrap_or_default();
        problems.push(Problem {
            key: key.into(),
            message: format!("a batch of {batch} never fits: the list has {list} places, of which {spare} stay free"),
            help: Some("`batch` and `spare` together are at most `list`".into()),
        });
    }
    problems
}

fn texts(value: Option<&Value>) -> Vec<&str> {
    let Some(Value::List(list)) = value else { return Vec::new() };
    list.iter().filter_map(|(v, _)| if let Value::Text(t) = v { Some(t.as_str()) } else { None }).collect()
}

/// The patterns of `sources`, and what is wrong with some.
fn globs(config: &Config) -> (GlobSet, Vec<Problem>) {
    let (mut set, mut problems) = (GlobSetBuilder::new(), Vec::new());
    for pattern in texts(config.values.get("sources")) {
        match Glob::new(pattern) {
            Ok(glob) => drop(set.add(glob)),
            Err(error) => problems.push(Problem {
                key: "sources".into(),
                message: format!("the pattern \"{pattern}\" is none: {}", error.kind()),
                help: Some("as in \"pump.alarms.*\"".into()),
            }),
        }
    }
    (set.build().unwrap_or_default(), problems)
}
