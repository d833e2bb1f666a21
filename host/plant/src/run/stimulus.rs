//! From rows of a stimulus file to actions on this plant.

use crate::assemble::Plant;
use crate::model::TagRef;
use crate::operate::Operation;
use crate::sim::{Action, Stimulus};
use latchwork_image::{Type, nearest};
use latchwork_io::stimulus::Stimulus as Row;

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
    if let Some(operation) = operation(plant, row)? {
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
