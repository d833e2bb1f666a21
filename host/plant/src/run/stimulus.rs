//! From rows of a stimulus file to actions on this plant.

use crate::assemble::Plant;
use crate::model::TagRef;
use crate::operate::Operation;
use crate::sim::{Action, Stimulus};
use crate::swap::{PROBATION, Part, SwapOrder, WayBack};
use latchwork_image::{Type, nearest};
use latchwork_io::stimulus::Stimulus as Row;
use std::path::Path;

/// A row that does not fit the plant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct StimulusError {
    /// Line of the file, from 1.
    pub line: u64,
    /// What was found, what was expected, the way out.
    pub message: String,
}

/// Resolves rows to input points of `sim` drivers and commands of blocks; every row that fits nothing is reported.
pub fn resolve(plant: &Plant, rows: &[Row]) -> Result<Vec<Stimulus>, Vec<StimulusError>> {
    let (mut actions, mut errors) = (Vec::new(), Vec::new());
    for row in rows {
        match action(plant, row) {
            Ok(action) => actions.push(Stimulus { time: row.time, action }),
            Err(message) => errors.push(StimulusError { line: row.line, message }),
        }
    }
    if errors.is_empty() { Ok(actions) } else { Err(errors) }
}

fn action(plant: &Plant, row: &Row) -> Result<Action, String> {
    let value = |ty: &Type| ty.parse(&row.value).map_err(|e| format!("`{}`: {e}", row.tag));
    if let Some(operation) = swap(plant, row)?.map_or_else(|| operation(plant, row), |o| Ok(Some(o)))? {
        return Ok(Action::Operate(operation));
    }
    if plant.sim.is_fed(&row.tag) {
        return Err(format!("`{}` is fed by [sim.feed]; take the feed away to drive it by a stimulus", row.tag));
    }
    if let Some((place, ty)) = plant.sim.find(&row.tag) {
        return Ok(Action::Point { place, cell: value(ty)? });
    }
    let id = plant.layout.tags.find(&row.tag);
    let what = id.and_then(|id| plant.layout.ids.iter().find(|(_, i)| **i == id).map(|(what, _)| *what));
    match what {
        Some(TagRef::Command { block, bit }) => Ok(Action::Command { block, bit, set: value(&Type::Bool)? == 1 }),
        Some(TagRef::Setting { .. }) => {
            let id = id.ok_or("no tag")?;
            value(&plant.layout.tags.get(id).ty)?;
            Ok(Action::Operate(Operation::Set { values: vec![(row.tag.clone(), row.value.clone())], write: true }))
        }
        Some(TagRef::Alarm { .. }) => {
            Err(format!("`{}` is an alarm; expected {ALARM_WORDS}, found \"{}\"", row.tag, row.value))
        }
        Some(_) => Err(format!(
            "`{}` cannot be driven by a stimulus; only input points of `sim` drivers (or of any driver with --sim), \
             commands and settings of blocks, and alarms can",
            row.tag
        )),
        None => {
            let known = plant.sim.names().chain(plant.layout.tags.iter().map(|(_, t)| t.name.as_str()));
            let hint = nearest(&row.tag, known).map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            Err(format!("there is no tag `{}`{hint}", row.tag))
        }
    }
}

/// `swap.BLOCK` with a component and words behind it, `rollback.BLOCK` with a number of steps or `to=HASH`.
fn swap(plant: &Plant, row: &Row) -> Result<Option<Operation>, String> {
    let known = |name: &&str| plant.model.blocks.iter().any(|b| b.name == **name);
    let number = |word: &str, of: &str| {
        word.parse::<u64>().map_err(|_| format!("`{}`: \"{word}\" is no whole number{of}", row.tag))
    };
    if let Some(block) = row.tag.strip_prefix("rollback.").filter(known) {
        let to = match row.value.trim().strip_prefix("to=") {
            Some(hash) => WayBack::To(hash.into()),
            None => WayBack::Steps(number(row.value.trim(), " of versions to go back")?),
        };
        return Ok(Some(Operation::Rollback { block: block.into(), to }));
    }
    let Some(block) = row.tag.strip_prefix("swap.").filter(known) else { return Ok(None) };
    let mut order = SwapOrder {
        parts: Vec::new(),
        shadow: 0,
        tolerances: Vec::new(),
        probation: PROBATION,
        allow_lossy: false,
        dry_run: false,
        save: false,
    };
    let (mut next, mut settings) = (Some(block), Vec::new());
    for word in row.value.split_whitespace() {
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        if let Some(block) = next.take() {
            order.parts.push(part(plant, row, block, word)?);
            continue;
        }
        match (key, value) {
            ("shadow", value) => order.shadow = number(value, " of executions")?,
            ("probation", value) => order.probation = number(value, " of executions")?,
            ("allow-lossy", "") => order.allow_lossy = true,
            ("dry-run", "") => order.dry_run = true,
            (name, "") if known(&name) => next = Some(name),
            (name, value) if name.starts_with("settings.") => {
                let setting = (name["settings.".len()..].to_owned(), value.to_owned());
                settings.push((order.parts.len() - 1, setting));
            }
            _ => {
                return Err(format!(
                    "`{}`: \"{word}\" means nothing; expected a component, then shadow=N, probation=N, allow-lossy, \
                     dry-run, settings.NAME=VALUE or a further block and its component",
                    row.tag
                ));
            }
        }
    }
    if let Some(block) = next {
        return Err(format!("`{}`: there is no component for `{block}`", row.tag));
    }
    settings.into_iter().for_each(|(part, setting)| order.parts[part].settings.push(setting));
    Ok(Some(Operation::Swap(Box::new(order))))
}

/// A block and its component, whose file is found from the folder of the plant file.
fn part(plant: &Plant, row: &Row, block: &str, file: &str) -> Result<Part, String> {
    let path = plant.model.file.parent().unwrap_or(Path::new("")).join(file);
    let bytes = std::fs::read(&path).map_err(|e| format!("`{}`: {}: {e}", row.tag, path.display()))?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Part { block: block.into(), file, bytes: bytes.into(), settings: Vec::new(), expects: None })
}

/// What may be done to an alarm.
const ALARM_WORDS: &str = "ack, reset, shelve 10m, unshelve, out-of-service or in-service";

/// What a row wants of an alarm; `None` when it is no alarm, or its value means something else.
fn operation(plant: &Plant, row: &Row) -> Result<Option<Operation>, String> {
    if !plant.model.variables.iter().any(|v| v.name == row.tag && !v.is_command()) {
        return Ok(None);
    }
    let alarm = row.tag.clone();
    let (word, rest) = row.value.trim().split_once(' ').unwrap_or((row.value.trim(), ""));
    Ok(Some(match (word, rest) {
        ("ack", "") => Operation::Acknowledge { alarm, seen: None },
        ("reset", "") => Operation::Reset { alarm },
        ("shelve", time) => {
            let duration = latchwork_image::parse_duration(time.trim()).map_err(|e| format!("`{}`: {e}", row.tag))?;
            Operation::Shelve { alarm, duration }
        }
        ("unshelve", "") => Operation::Unshelve { alarm },
        ("out-of-service", "") => Operation::OutOfService { alarm, out: true },
        ("in-service", "") => Operation::OutOfService { alarm, out: false },
        _ => return Ok(None),
    }))
}
