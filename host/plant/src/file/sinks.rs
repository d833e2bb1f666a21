//! Sinks as the file has them: the kind decides which keys they have.

use super::{PlantFile, RESERVED, name_is_sound, table};
use latchwork_schema::check::{entries, found};
use latchwork_schema::{Checker, Finding, Span, Values};
use latchwork_sink::{KEYS, SinkKind, kinds};
use toml::de::{DeTable, DeValue};

/// `[sink.NAME]`
pub(crate) struct SinkEntry {
    pub(crate) name: String,
    pub(crate) key: Span,
    pub(crate) kind: Option<&'static SinkKind>,
    pub(crate) values: Values,
    /// Its keys had no findings.
    pub(crate) sound: bool,
}

/// `[sink.NAME]`, all of them.
pub(super) fn sinks(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("sink `{}`", entry.name)) else { continue };
        // A sink has no tags: it may be called `alarms`.
        if !RESERVED.contains(&entry.name) {
            name_is_sound(checker, entry.name, &entry.key_span, false);
        }
        let before = checker.findings.len();
        let kind = kind(checker, entry.name, t, &entry.key_span);
        checker.whose = format!("[sink.{}]", entry.name);
        let values = match kind {
            Some(kind) => checker.table(&[&KEYS, kind.keys], t, entry.key_span.clone()),
            None => Values { span: entry.key_span.clone(), ..Values::default() },
        };
        let sound = checker.findings.len() == before;
        file.sinks.push(SinkEntry { name: entry.name.into(), key: entry.key_span, kind, values, sound });
    }
}

fn kind(checker: &mut Checker, name_of: &str, table: &DeTable<'_>, span: &Span) -> Option<&'static SinkKind> {
    let known: Vec<_> = kinds::KINDS.iter().map(|k| k.name).collect();
    let one_of = format!("one of {}", known.join(", "));
    let Some(entry) = entries(table).into_iter().find(|e| e.name == "kind") else {
        checker.add(Finding::error(span, format!("[sink.{name_of}] has no `kind`")).help(one_of));
        return None;
    };
    let DeValue::String(name) = entry.value else {
        let message = format!("`kind` is {}; expected a string", found(entry.value));
        checker.add(Finding::error(&entry.span, message).help(one_of));
        return None;
    };
    let kind = kinds::find(name);
    if kind.is_none() {
        let finding = Finding::error(&entry.span, format!("there is no kind of sink \"{name}\""));
        let near = latchwork_image::nearest(name, known.iter().copied());
        checker.add(finding.help(near.map_or(one_of, |near| format!("did you mean \"{near}\"?"))));
    }
    kind
}
