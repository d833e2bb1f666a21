//! Drivers as the file has them: the kind decides which keys they and their points have.

use super::{DriverEntry, PlantFile, PointEntry, name_is_sound, sections, table};
use latchwork_io::driver::DriverKind;
use latchwork_schema::check::{entries, found};
use latchwork_schema::{Checker, Entry, Finding, Span, Values};
use toml::de::{DeTable, DeValue};

/// `[driver.NAME]` with its points.
pub(super) fn drivers(checker: &mut Checker, tables: &DeTable<'_>, file: &mut PlantFile) {
    for entry in entries(tables) {
        let Some(t) = table(checker, &entry, &format!("driver `{}`", entry.name)) else {
            file.drivers.push(unread(&entry));
            continue;
        };
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
        // A key that is not known may be a misspelt `points`.
        let mut points_known = sound || t.contains_key("points");
        for e in entries(t).into_iter().filter(|e| e.name == "points") {
            let Some(list) = table(checker, &e, "`points`") else {
                points_known = false;
                continue;
            };
            for point in entries(list) {
                let Some(t) = table(checker, &point, &format!("point `{}`", point.name)) else {
                    let values = Values { span: point.key_span.clone(), ..Values::default() };
                    points.push(PointEntry { name: point.name.into(), key: point.key_span, values, sound: false });
                    continue;
                };
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
        let (name, key) = (entry.name.into(), entry.key_span);
        file.drivers.push(DriverEntry { name, key, kind, values, points, points_known, sound });
    }
}

/// A driver of which only the name is known.
fn unread(entry: &Entry<'_>) -> DriverEntry {
    DriverEntry {
        name: entry.name.into(),
        key: entry.key_span.clone(),
        kind: None,
        values: Values { span: entry.key_span.clone(), ..Values::default() },
        points: Vec::new(),
        points_known: false,
        sound: false,
    }
}

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
    if kind.is_none() {
        let finding = Finding::error(&entry.span, format!("there is no kind of driver \"{name}\""));
        checker.add(match latchwork_image::nearest(name, known.iter().copied()) {
            Some(near) => finding.help(format!("did you mean \"{near}\"?")),
            None => finding.help(format!("one of {}", known.join(", "))),
        });
    }
    kind
}
