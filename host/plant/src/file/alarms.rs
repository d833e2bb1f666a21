//! `[[alarm]]`: rules in their order.

use super::{AlarmEntry, PlantFile, sections};
use latchwork_schema::check::found;
use latchwork_schema::{Checker, Finding};
use toml::de::{DeArray, DeValue};

pub(super) fn alarms(checker: &mut Checker, list: &DeArray<'_>, text: &str, file: &mut PlantFile) {
    for item in list {
        let DeValue::Table(table) = item.get_ref() else {
            let message = format!("`alarm` holds {}; expected tables [[alarm]]", found(item.get_ref()));
            checker.add(Finding::error(&item.span(), message));
            continue;
        };
        checker.whose.clear();
        let values = checker.table(&[&sections::ALARM], table, item.span());
        let before = text.get(..item.span().start).unwrap_or_default();
        file.alarms.push(AlarmEntry { values, line: before.bytes().filter(|b| *b == b'\n').count() + 1 });
    }
}
