//! `latchwork alarms codes PLANT`: which variable has which code by which rule.

mod import;
mod list;
mod xml;

use super::deliver;
use crate::Exit;
use crate::args::{Codes, CodesFormat};
use crate::commands::load;
use anyhow::{Context, Result};
use latchwork_block::Engine;
use latchwork_plant::model::{AlarmRule, Model, TagRef, Variable};

pub(super) fn execute(engine: &Engine, args: &Codes) -> Result<Exit> {
    let Some(model) = load(engine, &args.plant, args.sim) else { return Ok(Exit::Wanting) };
    let text = match (&args.import, args.format) {
        (Some(file), _) => {
            let list = std::fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))?;
            match import::rules(&model, &list, &file.display().to_string()) {
                Ok(rules) => rules,
                Err(errors) => {
                    errors.iter().for_each(|error| eprintln!("error: {error}"));
                    return Ok(Exit::Wanting);
                }
            }
        }
        (None, CodesFormat::Table) => list::table(&model),
        (None, CodesFormat::Csv) => list::csv(&model)?,
        (None, CodesFormat::Json) => list::json(&model)?,
        (None, CodesFormat::Xml) => xml::document(&model)?,
    };
    deliver(&text, args.output.as_deref())?;
    Ok(Exit::Fine)
}

/// The rule of a variable.
fn rule<'a>(model: &'a Model, variable: &Variable) -> Option<&'a AlarmRule> {
    model.alarm_rules.get(variable.rule?)
}

/// Where the variable stands, by the letters of IEC 61131-3: input point, output point, memory.
fn memory(model: &Model, tag: TagRef) -> &'static str {
    match tag {
        TagRef::Point { driver, point } if model.drivers[driver].config.points[point].safe.is_some() => "Q",
        TagRef::Point { .. } => "I",
        _ => "M",
    }
}
