//! Blocks: each instantiated and configured once before anything moves.

use super::{AssembleError, Time};
use crate::model::{Block, Model};
use crate::supervisor::{Recipe, persist};
use latchwork_block::{Class, Instance, Limits, Template};
use std::collections::HashMap;

/// Period of the epoch ticker for a shortest budget, ns.
pub(super) fn tick_ns(shortest_budget: u64, time: Time) -> u64 {
    match time {
        Time::Real => (shortest_budget / 2).clamp(500_000, 10_000_000),
        Time::Virtual => 10_000_000,
    }
}

pub(super) fn instantiate(model: &Model, time: Time, tick: u64) -> Result<(Vec<Recipe>, Vec<Instance>), AssembleError> {
    let mut templates: HashMap<(String, String), Template> = HashMap::new();
    let (mut recipes, mut instances) = (Vec::new(), Vec::new());
    for b in &model.blocks {
        let key = (b.component.hash().to_string(), b.class.name.clone());
        let template = match templates.get(&key) {
            Some(t) => t.clone(),
            None => {
                let load = |error| AssembleError::Load { block: b.name.clone(), error };
                let t = b.component.template(&b.class).map_err(load)?;
                templates.insert(key, t.clone());
                t
            }
        };
        let limits = limits(b, time, tick);
        let wrong = |message: String| AssembleError::Block { block: b.name.clone(), message };
        let attempt = |mut probe: Instance| {
            let defaults = probe.defaults()?;
            let settings = complete(&b.class, &b.settings, defaults.as_deref());
            let answer = probe.configure(&settings)?;
            Ok((probe, settings, answer))
        };
        let made = persist(|| template.instantiate(&limits), attempt);
        let (probe, settings, answer) = made.map_err(|f| wrong(f.to_string()))?;
        if let Err(sentence) = answer {
            return Err(wrong(format!("it refuses its settings: {sentence}")));
        }
        recipes.push(Recipe { template, limits, settings, version: 0 });
        instances.push(probe);
    }
    Ok((recipes, instances))
}

/// Longest start of an instance, ns: it happens beside the lanes, perhaps at the lowest priority of a busy machine, and an
/// interpreter or a runtime has much to do.
const START: u64 = 10_000_000_000;

/// Limits of a block's instances.
fn limits(block: &Block, time: Time, tick: u64) -> Limits {
    // At virtual time the wall clock decides nothing but what never ends.
    let budget = if time == Time::Virtual { block.budget.max(1_000_000_000) } else { block.budget };
    let (budget_ticks, start_ticks) = (budget.div_ceil(tick) + 1, START.div_ceil(tick));
    Limits { memory: block.memory, budget_ticks, start_ticks, ..Limits::default() }
}

/// The file's settings, completed by the component's defaults, or 0.
pub(crate) fn complete(class: &Class, given: &[Option<u64>], defaults: Option<&[u64]>) -> Vec<u64> {
    (0..class.settings.len())
        .map(|i| given.get(i).copied().flatten().or_else(|| defaults.and_then(|d| d.get(i).copied())).unwrap_or(0))
        .collect()
}
