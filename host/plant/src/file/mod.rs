//! The plant file as it stands: its tables read and their keys checked, names not yet resolved.

pub(crate) mod sections;

use latchwork_io::driver::DriverKind;
use latchwork_schema::check::{constant, entries, found};
use latchwork_schema::{Checker, Constant, Entry, Finding, Span, Values};
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

/// The whole file.
#[derive(Default)]
pub(crate) struct PlantFile {
    pub(crate) plant: Values,
    pub(crate) lanes: Vec<LaneEntry>,
    pub(crate) drivers: Vec<DriverEntry>,
    pub(crate) blocks: Vec<BlockEntry>,
    pub(crate) feeds: Vec<Assignment>,
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
                file.plant = checker.table(&[&sections::PLANT], t, entry.key_span);
            }
            ("lane", DeValue::Table(t)) => lanes(checker, t, &mut file),
            ("driver", DeValue::Table(t)) => drivers(checker, t, &mut file),
            ("block", DeValue::Table(t)) => blocks(checker, t, "", false, &mut file),
            ("sim", DeValue::Table(t)) => sim(checker, t, &mut file),
            (name, value) if sections::TABLES.contains(&name) => {
                let message = format!("`{name}` is {}; expected tables such as [{name}.NAME]", found(value));
                checker.add(Finding::error(&entry.span, message));
            }
            (name, _) if sections::LATER_TABLES.contains(&name) => {
                checker.add(Finding::error(&entry.key_span, format!("[{name}] is not supported by this version")));
            }
            _ => unknown(checker, &entry, "the plant file", sections::TABLES),
        }
    }
    if !seen_plant {
        let finding = Finding::error(&start, "the file has no [plant] table");
        checker.add(finding.help("begin with `[plant]` and `name = \"…\"`"));
    }
    file
}

fn unknown(checker: &mut Checker, entry: &Entry<'_>, whose: &str, known: &[&str]) {
    let finding = Finding::error(&entry.key_span, format!("{whose} has no table `{}`", entry.name));
    checker.add(match latchwork_image::nearest(entry.name, known.iter().copied()) {
        Some(near) => finding.help(format!("did you mean `{near}`?")),
        None => finding.help(format!("it takes {}", known.join(", "))),
    });
}

/// The table of an entry, or a finding.
fn table<'a>(checker: &mut Checker, entry: &Entry<'a>, what: &str) -> Option<&'a DeTable<'a>> {
    if let DeValue::Table(t) = entry.value {
        return Some(t);
    }
    checker.add(Finding::error(&entry.span, format!("{what} is {}; expected a table", found(entry.value))));
    None
}

fn name_is_sound(checker: &mut Checker, name: &str, span: &Span, dots: bool) {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let parts: Vec<_> = if dots { name.split('.').collect() } else { vec![name] };
    if parts.iter().any(|p| p.is_empty() || !p.chars().all(allowed)) {
        let also = if dots { "; dots between them" } else { "" };
        let message = format!("`{name}` is no name; expected letters, digits, `-` and `_`{also}");
        checker.add(Finding::error(span, message));
    } else if let Some(part) = parts.iter().find(|p| RESERVED.contains(p)) {
        checker.add(
            Finding::error(span, format!("the name `{name}` has the part `{part}`, which means something in tags"))
                .help("choose another name"),
        );
    }
}

fn lanes(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("lane `{}`", entry.name)) else { continue };
        name_is_sound(checker, entry.name, &entry.key_span, false);
        let later: Vec<_> = entries(t).into_iter().filter(|e| sections::LATER_LANE_KEYS.contains(&e.name)).collect();
        if !later.is_empty() {
            for e in later {
                let message = format!("`{}` makes an interrupt lane, which is not supported by this version", e.name);
                checker.add(Finding::error(&e.key_span, message).help("give the lane a period: `every = \"10ms\"`"));
            }
            continue;
        }
        checker.whose = format!("[lane.{}]", entry.name);
        let values = checker.table(&[&sections::LANE], t, entry.key_span.clone());
        file.lanes.push(LaneEntry { name: entry.name.into(), key: entry.key_span, values });
    }
}

fn drivers(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("driver `{}`", entry.name)) else { continue };
        name_is_sound(checker, entry.name, &entry.key_span, false);
        let before = checker.findings.len();
        let kind = kind(checker, entry.name, t, &entry.key_span);
        checker.whose = format!("[driver.{}]", entry.name);
        let values = match kind {
            Some(kind) => checker.table_but(&[&sections::DRIVER, kind.keys], t, entry.key_span.clone(), &["points"]),
            None => Values { span: entry.key_span.clone(), ..Values::default() },
        };
        let sound = checker.findings.len() == before;
        let mut points = Vec::new();
        for e in entries(t).into_iter().filter(|e| e.name == "points") {
            let Some(list) = table(checker, &e, "`points`") else { continue };
            for point in entries(list) {
                let Some(t) = table(checker, &point, &format!("point `{}`", point.name)) else { continue };
                name_is_sound(checker, point.name, &point.key_span, false);
                let before = checker.findings.len();
                checker.whose = format!("point `{}.{}`", entry.name, point.name);
                let values = match kind {
                    Some(kind) => checker.table(&[kind.point_keys, &sections::POINT], t, point.key_span.clone()),
                    None => Values { span: point.key_span.clone(), ..Values::default() },
                };
                let sound = kind.is_some() && checker.findings.len() == before;
                points.push(PointEntry { name: point.name.into(), key: point.key_span, values, sound });
            }
        }
        file.drivers.push(DriverEntry { name: entry.name.into(), key: entry.key_span, kind, values, points, sound });
    }
}

/// Kinds the contract has and this version has not.
const LATER_KINDS: &[&str] = &["gpio", "rppal"];

fn kind(checker: &mut Checker, name_of: &str, table: &DeTable<'_>, span: &Span) -> Option<&'static DriverKind> {
    let known: Vec<_> = latchwork_io::kinds::KINDS.iter().map(|k| k.name).collect();
    let Some(entry) = entries(table).into_iter().find(|e| e.name == "kind") else {
        checker.add(
            Finding::error(span, format!("[driver.{name_of}] has no `kind`"))
                .help(format!("one of {}", known.join(", "))),
        );
        return None;
    };
    let DeValue::String(name) = entry.value else {
        let message = format!("`kind` is {}; expected a string", found(entry.value));
        checker.add(Finding::error(&entry.span, message).help(format!("one of {}", known.join(", "))));
        return None;
    };
    let kind = latchwork_io::kinds::find(name);
    if kind.is_none() && LATER_KINDS.contains(&name.as_ref()) {
        let message = format!("the kind \"{name}\" is not supported by this version");
        checker.add(Finding::error(&entry.span, message).help(format!("it has {}", known.join(", "))));
    } else if kind.is_none() {
        let finding = Finding::error(&entry.span, format!("there is no kind of driver \"{name}\""));
        checker.add(match latchwork_image::nearest(name, known.iter().copied()) {
            Some(near) => finding.help(format!("did you mean \"{near}\"?")),
            None => finding.help(format!("one of {}", known.join(", "))),
        });
    }
    kind
}

/// True for a table that is a block: it has a key of one. Otherwise its entries are blocks whose names begin with its own.
fn is_block(table: &DeTable<'_>) -> bool {
    let known = |name: &str| sections::BLOCK.keys.iter().any(|k| k.name == name);
    table.is_empty() || table.iter().any(|(k, v)| known(k.get_ref()) || !v.get_ref().is_table())
}

fn blocks(checker: &mut Checker, tables: &DeTable<'_>, prefix: &str, sim: bool, file: &mut PlantFile) {
    for entry in entries(tables) {
        let name = format!("{prefix}{}", entry.name);
        let Some(t) = table(checker, &entry, &format!("block `{name}`")) else { continue };
        if !is_block(t) {
            blocks(checker, t, &format!("{name}."), sim, file);
            continue;
        }
        name_is_sound(checker, &name, &entry.key_span, true);
        // `[block.a]` and `[block.a.b]`: the second stands in the first one's table.
        let inner: Vec<_> = entries(t)
            .into_iter()
            .filter(|e| matches!(e.value, DeValue::Table(t) if t.contains_key("component")))
            .collect();
        let own = ["inputs", "settings", "safe"];
        let skip: Vec<&str> = inner.iter().map(|e| e.name).chain(own).collect();
        checker.whose = format!("[{}block.{name}]", if sim { "sim." } else { "" });
        let values = checker.table_but(&[&sections::BLOCK], t, entry.key_span.clone(), &skip);
        let mut block = BlockEntry {
            name: name.clone(),
            key: entry.key_span.clone(),
            values,
            inputs: Vec::new(),
            settings: Vec::new(),
            safe: Vec::new(),
            sim,
        };
        for e in entries(t).into_iter().filter(|e| own.contains(&e.name)) {
            let Some(fields) = table(checker, &e, &format!("`{}`", e.name)) else { continue };
            let list = match e.name {
                "inputs" => &mut block.inputs,
                "settings" => &mut block.settings,
                _ => &mut block.safe,
            };
            assignments(checker, fields, "", e.name == "inputs", list);
        }
        file.blocks.push(block);
        for e in inner {
            if let DeValue::Table(_) = e.value {
                let mut one = DeTable::new();
                one.insert(
                    toml::Spanned::new(e.key_span.clone(), e.name.into()),
                    toml::Spanned::new(e.span.clone(), e.value.clone()),
                );
                blocks(checker, &one, &format!("{name}."), sim, file);
            }
        }
    }
}

/// Fields with values; tables are nested records, but `{ tag = … }` is a wire where wires may stand.
fn assignments(checker: &mut Checker, fields: &DeTable<'_>, prefix: &str, wires: bool, list: &mut Vec<Assignment>) {
    for e in entries(fields) {
        let path = format!("{prefix}{}", e.name);
        let source = match e.value {
            DeValue::Table(t) if wires && (t.contains_key("tag") || t.contains_key("not")) => {
                checker.whose = format!("the source of `{path}`");
                let values = checker.table(&[&sections::WIRE], t, e.span.clone());
                let Some(tag) = values.text("tag") else { continue };
                Source::Tag { tag: tag.into(), not: values.bool("not").unwrap_or(false) }
            }
            DeValue::Table(t) => {
                assignments(checker, t, &format!("{path}."), wires, list);
                continue;
            }
            value => match constant(value) {
                Some(c) => Source::Constant(c),
                None => {
                    let or = if wires { "a tag, a constant or { tag = \"…\" }" } else { "a constant" };
                    checker.add(Finding::error(&e.span, format!("`{path}` is {}; expected {or}", found(value))));
                    continue;
                }
            },
        };
        list.push(Assignment { path, key: e.key_span, source, span: e.span });
    }
}

fn sim(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        match (entry.name, entry.value) {
            ("block", DeValue::Table(t)) => blocks(checker, t, "", true, file),
            ("feed", DeValue::Table(t)) => feeds(checker, t, "", file),
            ("block" | "feed", value) => {
                let message = format!("`{}` is {}; expected a table", entry.name, found(value));
                checker.add(Finding::error(&entry.span, message));
            }
            _ => unknown(checker, &entry, "[sim]", sections::SIM_KEYS),
        }
    }
}

/// `"field.level" = "tank.outputs.level"`; without quotes TOML makes nested tables of it, which mean the same.
fn feeds(checker: &mut Checker, tables: &DeTable<'_>, prefix: &str, file: &mut PlantFile) {
    for e in entries(tables) {
        let path = format!("{prefix}{}", e.name);
        match e.value {
            DeValue::Table(t) if t.contains_key("tag") => {
                checker.whose = format!("the feed of `{path}`");
                let values = checker.table(&[&sections::WIRE], t, e.span.clone());
                if let Some(tag) = values.text("tag") {
                    let source = Source::Tag { tag: tag.into(), not: values.bool("not").unwrap_or(false) };
                    file.feeds.push(Assignment { path, key: e.key_span, source, span: e.span });
                }
            }
            DeValue::Table(t) => feeds(checker, t, &format!("{path}."), file),
            DeValue::String(tag) => {
                let source = Source::Tag { tag: tag.to_string(), not: false };
                file.feeds.push(Assignment { path, key: e.key_span, source, span: e.span });
            }
            value => {
                let message = format!("the feed of `{path}` is {}; expected the name of a tag", found(value));
                checker.add(Finding::error(&e.span, message));
            }
        }
    }
}
