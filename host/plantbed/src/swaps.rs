//! Swaps that a step orders.

use crate::operations::map;
use crate::read::Common;
use crate::tags::{Tags, unknown};
use latchwork_plant::swap::{Part, SwapOrder};
use latchwork_schema::{Checker, Finding, Kind, Value, Values};
use toml::de::DeTable;

/// Executions of a probation of which nothing is said.
const PROBATION: u64 = 1000;

/// The order of a step, and the tags that there are when it is done.
pub(crate) fn order(
    checker: &mut Checker,
    common: &mut Common<'_>,
    tags: &Tags,
    table: &DeTable<'_>,
    values: &Values,
) -> Option<(SwapOrder, Tags)> {
    if !table.contains_key("swap") {
        for key in ["allow-lossy", "probation"] {
            if values.has(key) {
                let finding = Finding::error(&values.span_of(key), format!("`{key}` stands without a `swap`"));
                checker.add(finding.help("it says how a block is swapped"));
            }
        }
        return None;
    }
    let (mut parts, mut after) = (Vec::new(), tags.clone());
    for (block, key, value, span) in map(checker, table, "swap", &Kind::Text) {
        let Value::Text(name) = value else { continue };
        let Some((_, class)) = tags.blocks.iter().find(|(name, _)| *name == block) else {
            let names: Vec<_> = tags.blocks.iter().map(|(name, _)| name.clone()).collect();
            let (message, help) = unknown("block", &names, &block);
            checker.add(Finding::error(&key, message).help(help));
            continue;
        };
        let Some(subject) = common.finder.version(checker, &name, Some(class), &span) else { continue };
        after = after.with(&block, &subject.class);
        parts.push(Part {
            block,
            file: format!("{}.wasm", subject.component.name()),
            bytes: subject.component.bytes().into(),
            settings: Vec::new(),
            expects: None,
        });
    }
    let order = SwapOrder {
        parts,
        shadow: 0,
        tolerances: Vec::new(),
        probation: values.integer("probation").and_then(|n| u64::try_from(n).ok()).unwrap_or(PROBATION),
        allow_lossy: values.bool("allow-lossy").unwrap_or(false),
        dry_run: false,
        save: false,
    };
    (!order.parts.is_empty()).then_some((order, after))
}
