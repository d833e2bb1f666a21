//! Blocks as the file has them. Their names may have dots, so tables may be blocks or the beginnings of names.

use super::assignments::assignments;
use super::{BlockEntry, PlantFile, name_is_sound, sections, table, unlike_a_sink};
use latchwork_schema::check::entries;
use latchwork_schema::{Checker, Entry};
use toml::de::{DeTable, DeValue};

/// Keys of a block that are tables.
const GROUPS: [&str; 3] = ["inputs", "settings", "safe"];

/// `[block.NAME]` or `[sim.block.NAME]`; `prefix` is the beginning of the name with its last dot.
pub(super) fn blocks(checker: &mut Checker, tables: &DeTable<'_>, prefix: &str, sim: bool, file: &mut PlantFile) {
    for entry in entries(tables) {
        let name = format!("{prefix}{}", entry.name);
        let Some(t) = table(checker, &entry, &format!("block `{name}`")) else { continue };
        name_is_sound(checker, entry.name, &entry.key_span, true);
        if is_block(t) {
            unlike_a_sink(checker, &name, &entry.key_span);
            block(checker, &entry, t, name, sim, file);
        } else {
            blocks(checker, t, &format!("{name}."), sim, file);
        }
    }
}

/// True for a table that is a block: it holds a value, or the table of its inputs, settings or safe values. Otherwise
/// its tables are blocks whose names begin with its own, whatever they are called: `[block.zone.memory]` is a name.
fn is_block(table: &DeTable<'_>) -> bool {
    table.is_empty() || table.iter().any(|(k, v)| !v.get_ref().is_table() || is_group(k.get_ref(), v.get_ref()))
}

/// The inputs, settings or safe values of a block, and no block of that name: `[block.zone.safe]` is a name, and
/// `[block.zone.inputs.delay]` one that is not allowed.
fn is_group(name: &str, value: &DeValue<'_>) -> bool {
    let holds_block = |t: &DeTable<'_>| t.iter().any(|(_, v)| is_whole_block(v.get_ref()));
    GROUPS.contains(&name) && !is_whole_block(value) && !matches!(value, DeValue::Table(t) if holds_block(t))
}

/// A block with all it must have.
fn is_whole_block(value: &DeValue<'_>) -> bool {
    let text = |t: &DeTable<'_>, key: &str| t.get(key).is_some_and(|v| v.get_ref().is_str());
    matches!(value, DeValue::Table(t) if text(t, "component") && text(t, "lane"))
}

/// A table inside a block that is a block itself, or holds one: `[block.a]` and `[block.a.b]`.
fn is_inner(entry: &Entry<'_>) -> bool {
    fn holds_block(t: &DeTable<'_>) -> bool {
        t.iter().any(|(k, v)| match v.get_ref() {
            DeValue::Table(t) => holds_block(t),
            _ => ["component", "lane"].contains(&k.get_ref().as_ref()),
        })
    }
    !is_group(entry.name, entry.value) && matches!(entry.value, DeValue::Table(t) if holds_block(t))
}

fn block(checker: &mut Checker, entry: &Entry<'_>, t: &DeTable<'_>, name: String, sim: bool, file: &mut PlantFile) {
    let inner: Vec<_> = entries(t).into_iter().filter(is_inner).collect();
    let skip: Vec<&str> = inner.iter().map(|e| e.name).chain(GROUPS).collect();
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
    for e in entries(t).into_iter().filter(|e| is_group(e.name, e.value)) {
        let Some(fields) = table(checker, &e, &format!("`{}`", e.name)) else { continue };
        let list = assignments(checker, fields, e.name == "inputs");
        match e.name {
            "inputs" => block.inputs = list,
            "settings" => block.settings = list,
            _ => block.safe = list,
        }
    }
    file.blocks.push(block);
    for e in inner {
        let DeValue::Table(t) = e.value else { continue };
        let name = format!("{name}.{}", e.name);
        name_is_sound(checker, e.name, &e.key_span, true);
        if is_block(t) {
            unlike_a_sink(checker, &name, &e.key_span);
            self::block(checker, &e, t, name, sim, file);
        } else {
            blocks(checker, t, &format!("{name}."), sim, file);
        }
    }
}
