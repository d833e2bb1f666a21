//! Alarms: who tells of which condition.

use super::Sources;
use crate::alarms::Annunciator;
use crate::lane::{Condition, Lane};
use crate::layout::{Layout, Probe};
use crate::model::{Model, TagRef, Wire};
use latchwork_image::{Resolved, TagError};
use latchwork_record::SourceId;
use std::collections::HashMap;

/// A bool tag that a lane will watch.
pub(super) struct Watched {
    lane: usize,
    probe: Probe,
    /// The alarms it is about, by their place among the model's variables.
    variables: Vec<usize>,
    suppresses: bool,
    name: String,
}

/// Makes the tags that alarms hang on visible in the lanes that will watch them.
pub(super) fn watched(model: &Model, layout: &mut Layout) -> Result<Vec<Watched>, TagError> {
    let mut all = Vec::new();
    for (index, variable) in model.variables.iter().enumerate() {
        // A block's own alarms are told by its lane anyway.
        if !matches!(variable.tag, TagRef::Alarm { .. } | TagRef::Command { .. }) {
            let wire = Wire { tag: variable.tag, not: false };
            all.extend(watch(model, layout, wire, vec![index], false)?);
        }
    }
    for (number, rule) in model.alarm_rules.iter().enumerate() {
        let Some(wire) = rule.suppress else { continue };
        let of_rule = model.variables.iter().enumerate().filter(|(_, v)| v.rule == Some(number) && !v.is_command());
        let variables: Vec<_> = of_rule.map(|(index, _)| index).collect();
        if !variables.is_empty() {
            all.extend(watch(model, layout, wire, variables, true)?);
        }
    }
    Ok(all)
}

fn watch(
    model: &Model,
    layout: &mut Layout,
    wire: Wire,
    variables: Vec<usize>,
    suppresses: bool,
) -> Result<Option<Watched>, TagError> {
    let tag = layout.ids[&wire.tag];
    let name = layout.tags.get(tag).name.clone();
    let lane = match layout.tags.resolve(tag)? {
        Resolved::Cell { location, .. } if (location.region as usize) < model.lanes.len() => location.region as usize,
        _ => model.lanes.iter().position(|l| l.interrupt.is_none()).unwrap_or(0),
    };
    // A constant never comes or goes.
    let Some(probe) = layout.probe(lane, tag)? else { return Ok(None) };
    let probe = Probe { not: probe.not ^ wire.not, ..probe };
    Ok(Some(Watched { lane, probe, variables, suppresses, name }))
}

/// The conditions that each lane watches, with the annunciator that hears of them.
pub(super) fn connect(
    model: &Model,
    watched: Vec<Watched>,
    sources: &mut Sources,
    annunciator: &mut Annunciator,
) -> Vec<Vec<Condition>> {
    let mut conditions: Vec<Vec<Condition>> = model.lanes.iter().map(|_| Vec::new()).collect();
    for Watched { lane, probe, variables, suppresses, name } in watched {
        let source = sources.add(name);
        let alarms: Vec<_> = variables.iter().filter_map(|v| annunciator.find(&model.variables[*v])).collect();
        if suppresses {
            annunciator.suppress(source, alarms);
        } else if let Some(alarm) = alarms.first() {
            annunciator.listen(source, *alarm);
        }
        conditions[lane].push(Condition { probe, previous: (!suppresses).then_some(false), source, suppresses });
    }
    conditions
}

/// Lets the annunciator hear of the blocks' own alarms.
pub(super) fn listen(model: &Model, lanes: &mut [Lane], annunciator: &mut Annunciator) {
    let sources: HashMap<(usize, u8), SourceId> = lanes
        .iter_mut()
        .flat_map(Lane::blocks_mut)
        .flat_map(|b| b.rest.alarm_sources.iter().enumerate().map(|(bit, source)| ((b.rest.model, bit as u8), *source)))
        .collect();
    for variable in &model.variables {
        if let TagRef::Alarm { block, bit } = variable.tag
            && let (Some(source), Some(alarm)) = (sources.get(&(block, bit)), annunciator.find(variable))
        {
            annunciator.listen(*source, alarm);
        }
    }
}
