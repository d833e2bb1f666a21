//! The plant file as it stands: its tables read and their keys checked, names not yet resolved.

mod alarms;
mod assignments;
mod blocks;
mod drivers;
mod policy;
pub(crate) mod sections;
mod sinks;

use crate::operate::Policy;
use assignments::feeds;
use blocks::blocks;
use drivers::drivers;
use latchwork_io::driver::DriverKind;
use latchwork_schema::check::{entries, found};
use latchwork_schema::{Checker, Constant, Entry, Finding, Span, Value, Values};
use sinks::sinks;
use toml::de::{DeTable, DeValue};

/// What an input names.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    /// A constant, or the name of a tag: the port's type decides.
    Constant(Constant),
    /// A tag.
    Tag {
        /// Name.
        tag: String,
        /// Inverted.
        not: bool,
    },
}

/// A path below `inputs`, `settings` or `safe` with its value.
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    /// `a.b` for nested fields.
    pub(crate) path: String,
    /// Bytes of the key.
    pub(crate) key: Span,
    /// Value.
    pub(crate) source: Source,
    /// Bytes of the value.
    pub(crate) span: Span,
}

/// `[lane.NAME]`
pub(crate) struct LaneEntry {
    pub(crate) name: String,
    pub(crate) key: Span,
    pub(crate) values: Values,
    /// It has keys of an interrupt lane.
    pub(crate) interrupt: bool,
}

/// `LANE = "3ms"` or `LANE = ["1ms", "7ms"]` in `[sim.scan-time]`.
pub(crate) struct ScanTimeEntry {
    pub(crate) lane: String,
    pub(crate) key: Span,
    /// Virtual time of the scans in turn, ns.
    pub(crate) times: Vec<u64>,
}

/// A point of a driver.
pub(crate) struct PointEntry {
    pub(crate) name: String,
    pub(crate) key: Span,
    pub(crate) values: Values,
    /// Its keys had no findings.
    pub(crate) sound: bool,
}

/// `[driver.NAME]`
pub(crate) struct DriverEntry {
    pub(crate) name: String,
    pub(crate) key: Span,
    pub(crate) kind: Option<&'static DriverKind>,
    pub(crate) values: Values,
    pub(crate) points: Vec<PointEntry>,
    /// All its points could be read. Otherwise a wire may mean one that is not in `points`.
    pub(crate) points_known: bool,
    /// Its keys had no findings.
    pub(crate) sound: bool,
}

/// `[block.NAME]` or `[sim.block.NAME]`
pub(crate) struct BlockEntry {
    pub(crate) name: String,
    pub(crate) key: Span,
    pub(crate) values: Values,
    pub(crate) inputs: Vec<Assignment>,
    pub(crate) settings: Vec<Assignment>,
    pub(crate) safe: Vec<Assignment>,
    pub(crate) sim: bool,
}

/// `[[alarm]]`
pub(crate) struct AlarmEntry {
    pub(crate) values: Values,
    /// Line of the file, from 1.
    pub(crate) line: usize,
}

/// `[table.NAME]`
pub(crate) struct TableEntry {
    pub(crate) name: String,
    pub(crate) values: Values,
}

/// The whole file.
#[derive(Default)]
pub(crate) struct PlantFile {
    pub(crate) plant: Values,
    /// [plant] has a key `components`, right or wrong.
    pub(crate) components_given: bool,
    pub(crate) lanes: Vec<LaneEntry>,
    pub(crate) drivers: Vec<DriverEntry>,
    pub(crate) blocks: Vec<BlockEntry>,
    pub(crate) feeds: Vec<Assignment>,
    pub(crate) scan_times: Vec<ScanTimeEntry>,
    pub(crate) policy: Policy,
    pub(crate) alarms: Vec<AlarmEntry>,
    pub(crate) tables: Vec<TableEntry>,
    pub(crate) heartbeat: Option<Values>,
    pub(crate) recorder: Option<Values>,
    pub(crate) sinks: Vec<sinks::SinkEntry>,
    pub(crate) journal: Values,
    /// Lanes that are there but were refused: a block that names one is no further error.
    pub(crate) refused_lanes: Vec<String>,
    /// Tables of the file that could not be read, by the name they were meant to have: what would stand in them is
    /// not missing as well.
    pub(crate) unread: Vec<&'static str>,
}

/// Parts of a tag's name that a block's own name must not have.
const RESERVED: &[&str] = &["inputs", "outputs", "alarms", "commands", "settings", "lane"];

/// Reads the tables of a file.
pub(crate) fn read(checker: &mut Checker, root: &DeTable<'_>, text: &str) -> PlantFile {
    let mut file = PlantFile::default();
    let start = 0..text.find('\n').unwrap_or(text.len());
    let mut seen_plant = false;
    for entry in entries(root) {
        match (entry.name, entry.value) {
            ("plant", DeValue::Table(t)) => {
                seen_plant = true;
                checker.whose.clear();
                file.components_given = t.contains_key("components");
                file.plant = checker.table(&[&sections::PLANT], t, entry.key_span);
            }
            ("lane", DeValue::Table(t)) => lanes(checker, t, &mut file),
            ("driver", DeValue::Table(t)) => drivers(checker, t, &mut file),
            ("block", DeValue::Table(t)) => blocks(checker, t, "", false, &mut file),
            ("sim", DeValue::Table(t)) => sim(checker, t, &mut file),
            ("policy", DeValue::Table(t)) => file.policy = policy::policy(checker, t, entry.key_span),
            ("table", DeValue::Table(t)) => tables(checker, t, &mut file),
            ("heartbeat", DeValue::Table(t)) => {
                checker.whose.clear();
                file.heartbeat = Some(checker.table(&[&sections::HEARTBEAT], t, entry.key_span));
            }
            ("recorder", DeValue::Table(t)) => {
                checker.whose.clear();
                file.recorder = Some(checker.table(&[&sections::RECORDER], t, entry.key_span));
            }
            ("alarm", DeValue::Array(list)) => alarms::alarms(checker, list, text, &mut file),
            ("alarm", value) => {
                let message = format!("`alarm` is {}; expected tables [[alarm]]", found(value));
                checker.add(Finding::error(&entry.span, message).help("double brackets: there may be several"));
            }
            ("sink", DeValue::Table(t)) => sinks(checker, t, &mut file),
            ("journal", DeValue::Table(t)) => {
                checker.whose.clear();
                file.journal = checker.table(&[&sections::JOURNAL], t, entry.key_span);
            }
            (name, value) if sections::TABLES.contains(&name) => {
                file.unread.extend(sections::TABLES.iter().find(|t| **t == name));
                let message = format!("`{name}` is {}; expected tables such as [{name}.NAME]", found(value));
                checker.add(Finding::error(&entry.span, message));
            }
            _ => file.unread.extend(unknown(checker, &entry, "the plant file", sections::TABLES)),
        }
    }
    if !seen_plant && !file.unread.contains(&"plant") {
        file.unread.push("plant");
        let finding = Finding::error(&start, "the file has no [plant] table");
        checker.add(finding.help("begin with `[plant]` and `name = \"…\"`"));
    }
    file
}

/// The finding about an unknown table; the one that was probably meant.
fn unknown<'k>(checker: &mut Checker, entry: &Entry<'_>, whose: &str, known: &[&'k str]) -> Option<&'k str> {
    let near = latchwork_image::nearest(entry.name, known.iter().copied());
    let finding = Finding::error(&entry.key_span, format!("{whose} has no table `{}`", entry.name));
    checker.add(match near {
        Some(near) => finding.help(format!("did you mean `{near}`?")),
        None => finding.help(format!("it takes {}", known.join(", "))),
    });
    near
}

/// The table of an entry, or a finding.
fn table<'a>(checker: &mut Checker, entry: &Entry<'a>, what: &str) -> Option<&'a DeTable<'a>> {
    if let DeValue::Table(t) = entry.value {
        return Some(t);
    }
    checker.add(Finding::error(&entry.span, format!("{what} is {}; expected a table", found(entry.value))));
    None
}

/// Checks a name, or the part of one that stands at `span`.
fn name_is_sound(checker: &mut Checker, name: &str, span: &Span, dots: bool) {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let parts: Vec<_> = if dots { name.split('.').collect() } else { vec![name] };
    if parts.iter().any(|p| p.is_empty() || !p.chars().all(allowed)) {
        let also = if dots { "; dots between them" } else { "" };
        let message = format!("`{name}` is no name; expected letters, digits, `-` and `_`{also}");
        checker.add(Finding::error(span, message));
    } else if let Some(part) = parts.iter().find(|p| RESERVED.contains(p)) {
        checker.add(
            Finding::error(span, format!("`{part}` cannot be a name or part of one: in tags it means something"))
                .help("choose another name"),
        );
    }
}

fn lanes(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("lane `{}`", entry.name)) else {
            file.refused_lanes.push(entry.name.into());
            continue;
        };
        name_is_sound(checker, entry.name, &entry.key_span, false);
        checker.whose = format!("[lane.{}]", entry.name);
        let interrupt = sections::INTERRUPT_KEYS.iter().any(|k| t.contains_key(*k));
        if interrupt && let Some(every) = entries(t).into_iter().find(|e| e.name == "every") {
            let message = format!("lane `{}` has both `every` and keys of an interrupt lane", entry.name);
            let help = "a cyclic lane has `every`; an interrupt lane has `on`, and `poll` if it is to read its inputs \
                        periodically";
            checker.add(Finding::error(&every.key_span, message).help(help));
        }
        let section = if interrupt { &sections::INTERRUPT_LANE } else { &sections::LANE };
        let skip: &[&str] = if interrupt { &["every"] } else { &[] };
        let values = checker.table_but(&[section], t, entry.key_span.clone(), skip);
        file.lanes.push(LaneEntry { name: entry.name.into(), key: entry.key_span, values, interrupt });
    }
}

fn tables(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("table `{}`", entry.name)) else { continue };
        name_is_sound(checker, entry.name, &entry.key_span, false);
        checker.whose = format!("[table.{}]", entry.name);
        let values = checker.table(&[&sections::TABLE], t, entry.key_span);
        file.tables.push(TableEntry { name: entry.name.into(), values });
    }
}

fn sim(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        match (entry.name, entry.value) {
            ("block", DeValue::Table(t)) => blocks(checker, t, "", true, file),
            ("feed", DeValue::Table(t)) => file.feeds = feeds(checker, t),
            ("scan-time", DeValue::Table(t)) => scan_times(checker, t, file),
            ("block" | "feed" | "scan-time", value) => {
                let message = format!("`{}` is {}; expected a table", entry.name, found(value));
                checker.add(Finding::error(&entry.span, message));
            }
            _ => drop(unknown(checker, &entry, "[sim]", sections::SIM_KEYS)),
        }
    }
}

fn scan_times(checker: &mut Checker, table: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(table) {
        let times = match checker.value(&sections::SCAN_TIME, entry.name, entry.value, &entry.span) {
            Some(Value::Duration(ns)) => vec![ns],
            Some(Value::List(list)) => {
                list.iter().filter_map(|(v, _)| if let Value::Duration(ns) = v { Some(*ns) } else { None }).collect()
            }
            _ => continue,
        };
        file.scan_times.push(ScanTimeEntry { lane: entry.name.into(), key: entry.key_span, times });
    }
}
