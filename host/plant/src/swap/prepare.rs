//! Everything that can be done before the lane hears of a swap: load, check, compile, instantiate, configure.
//!
//! It runs on a thread of its own, or at virtual time where it was asked for; it touches nothing of the plant.

use super::broken::{Uses, broken};
use super::saving::{Objection, Trial};
use super::versions::{Loan, Release};
use super::{BlockPlan, Version};
use crate::lane::Carry;
use crate::model::Model;
use crate::supervisor::{Recipe, persist};
use latchwork_block::upgrade::{Difference, Fate, Transfer};
use latchwork_block::{Class, Component, Engine, Fault, Instance};
use latchwork_image::nearest;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Times that a restore is tried.
const REHEARSALS: usize = 3;

/// What is to be prepared.
pub(super) struct Job {
    pub(super) engine: Engine,
    pub(super) model: Arc<Model>,
    pub(super) uses: Uses,
    pub(super) allow_lossy: bool,
    /// Each block also gets a candidate for the shadow.
    pub(super) shadow: bool,
    /// What is tried is timed: not at virtual time, where a run is the same on every machine.
    pub(super) timed: bool,
    /// With `--save`.
    pub(super) save: Option<Trial>,
    pub(super) parts: Vec<JobPart>,
}

/// One block of it.
pub(super) struct JobPart {
    /// Index in the model.
    pub(super) block: usize,
    /// What comes.
    pub(super) from: From,
    /// Settings that are to be others.
    pub(super) settings: Vec<(String, String)>,
    /// What executes.
    pub(super) component: Component,
    /// How to make that.
    pub(super) recipe: Recipe,
    /// Number of the version that comes.
    pub(super) version: u64,
}

/// Where a version comes from.
pub(super) enum From {
    /// From an operator.
    Bytes { file: String, bytes: Arc<[u8]> },
    /// It executed before.
    Earlier(Box<Back>),
}

/// An earlier version.
pub(super) struct Back {
    pub(super) release: Release,
    pub(super) recipe: Recipe,
    /// The state that it had when it was replaced.
    pub(super) state: Option<Box<[u64]>>,
    /// The instance, if it is still there.
    pub(super) instance: Loan,
}

/// The result.
pub(super) struct Prepared {
    /// What would change, as far as it is known.
    pub(super) plans: Vec<BlockPlan>,
    /// What goes to the lane, or why nothing does.
    pub(super) ready: Result<Vec<Ready>, String>,
}

/// One block, ready for its exchange.
pub(super) struct Ready {
    pub(super) block: usize,
    pub(super) component: Component,
    pub(super) recipe: Recipe,
    pub(super) instance: Loan,
    /// One that is used up in the shadow.
    pub(super) candidate: Option<Instance>,
    /// Longest execution of the one that goes, ns; 0: unknown.
    pub(super) baseline: u64,
    pub(super) carry: Carry,
    /// What the retained fields start with, or the state that comes back.
    pub(super) state: Box<[u64]>,
    /// Number of the earlier version that it is.
    pub(super) was: Option<u64>,
    /// From the settings of the one that executes to its own.
    pub(super) settings: Transfer,
    /// Settings that were given.
    pub(super) given: BTreeMap<usize, u64>,
    /// The other one's settings when it was prepared.
    pub(super) based: Vec<u64>,
}

impl Job {
    /// Does it; `None` when nobody wants it any more, which is asked before each block.
    pub(super) fn run(self, wanted: &dyn Fn() -> bool) -> Option<Prepared> {
        let (mut plans, mut ready, mut why) = (Vec::new(), Vec::new(), Vec::new());
        let several = self.parts.len() > 1;
        let Self { engine, model, uses, allow_lossy, shadow, timed, save, parts } = self;
        let context = Context { engine: &engine, model: &model, uses: &uses, allow_lossy, shadow, timed };
        for part in parts {
            if !wanted() {
                return None;
            }
            let name = model.blocks[part.block].name.clone();
            let mut plan = None;
            match context.part(part, &mut plan) {
                Ok(part) => ready.push(part),
                Err(error) if several => why.push(format!("`{name}`: {error}")),
                Err(error) => why.push(error),
            }
            plans.extend(plan);
        }
        match save.map(|trial| trial.run(&engine)) {
            Some(Err(Objection::Stops(error))) => why.push(error),
            Some(Err(Objection::Note(note))) => plans.iter_mut().for_each(|plan| plan.notes.push(note.clone())),
            Some(Ok(())) | None => {}
        }
        Some(Prepared { plans, ready: if why.is_empty() { Ok(ready) } else { Err(why.join("; ")) } })
    }
}

impl Ready {
    /// Settings of the one that executes, which may have changed, carried over; then it is configured again.
    ///
    /// # Errors
    /// It refuses them, or fails.
    pub(super) fn follow(&mut self, settings: &[u64]) -> Result<(), String> {
        if self.based == settings {
            return Ok(());
        }
        self.settings.apply(settings, &mut self.recipe.settings);
        self.given.iter().for_each(|(port, cell)| self.recipe.settings[*port] = *cell);
        self.based = settings.to_vec();
        for instance in self.candidate.iter_mut().chain(&mut self.instance.instance) {
            instance.configure(&self.recipe.settings).map_err(told)?.map_err(refuses)?;
        }
        Ok(())
    }
}

struct Context<'a> {
    engine: &'a Engine,
    model: &'a Model,
    uses: &'a Uses,
    allow_lossy: bool,
    shadow: bool,
    timed: bool,
}

impl Context<'_> {
    fn part(&self, part: JobPart, plan: &mut Option<BlockPlan>) -> Result<Ready, String> {
        match part.from {
            From::Bytes { ref file, ref bytes } => self.brought(&part, file, bytes, plan),
            From::Earlier(earlier) => {
                let part = JobPart { from: From::Bytes { file: String::new(), bytes: [].into() }, ..part };
                self.earlier(&part, *earlier, plan)
            }
        }
    }

    /// A component that an operator brought.
    fn brought(&self, part: &JobPart, file: &str, bytes: &[u8], plan: &mut Option<BlockPlan>) -> Result<Ready, String> {
        let old = Arc::clone(part.recipe.template.class());
        let name = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        let component = self.engine.load_bytes(&name, bytes).map_err(|e| format!("`{file}`: {e}"))?;
        let class = unversioned(&old.name);
        let class = component.class(Some(class)).map_err(|e| {
            format!("`{file}` would be a change of class, which a swap does not do: the block is a {class}: {e}")
        })?;
        let template = component.template(&class).map_err(|e| format!("`{file}`: {e}"))?;
        let limits = part.recipe.limits.clone();
        let mut recipe = Recipe { template, limits, settings: Vec::new(), version: part.version };
        let settings = Transfer::new(&old.settings, &class.settings, self.allow_lossy);
        let retained = Transfer::new(&old.retained, &class.retained, self.allow_lossy);
        let plan = plan.insert(self.plan(part, &component, &recipe, &settings, &retained));

        let mut problems = plan.broken.clone();
        let given = given(&class, &part.settings, &mut problems);
        for field in settings
            .refused()
            .filter(|f| !class.settings.iter().enumerate().any(|(at, p)| p.path == f.name && given.contains_key(&at)))
        {
            problems.push(format!(
                "{}; give it a value with --set, or allow it with --allow-lossy",
                lossy("setting", field)
            ));
        }
        for field in retained.refused() {
            problems.push(format!("{}; allow it with --allow-lossy", lossy("retained field", field)));
        }
        if !problems.is_empty() {
            return Err(problems.join("; "));
        }

        let attempt = |mut instance: Instance| {
            let mut cells = instance.defaults()?.unwrap_or_else(|| vec![0; class.settings.len()]);
            settings.apply(&part.recipe.settings, &mut cells);
            given.iter().for_each(|(port, cell)| cells[*port] = *cell);
            let answer = instance.configure(&cells)?;
            let state = if answer.is_ok() { instance.save()? } else { None };
            Ok((instance, cells, answer, state.unwrap_or_default().into_boxed_slice()))
        };
        let made = persist(|| recipe.template.instantiate(&recipe.limits), attempt);
        let (instance, cells, answer, state) = made.map_err(told)?;
        recipe.settings = cells;
        answer.map_err(refuses)?;
        let warm = !old.retained.is_empty() && !class.retained.is_empty();
        if !warm {
            let which = if class.retained.is_empty() { "the new version" } else { "what runs" };
            plan.notes.push(format!("{which} retains nothing: the block starts cold"));
        }
        if warm {
            self.rehearse(part.block, &recipe, &state)?;
        }
        let carry = if warm { Carry::Transfer(Box::new(retained)) } else { Carry::Cold };
        let mut candidate = None;
        if self.shadow {
            part.recipe.rehearse_save().map_err(|fault| {
                format!(
                    "no shadow: what runs fails when its state is saved, and would be out of order then: {}; swap it without \
                     --shadow, or try the new version on a recording with `latchwork replay --with`",
                    fault.message
                )
            })?;
            candidate = Some(recipe.make().map_err(told)?);
        }
        Ok(Ready {
            block: part.block,
            component,
            recipe,
            instance: Loan::new(instance),
            candidate,
            baseline: 0,
            carry,
            state,
            was: None,
            settings,
            given,
            based: part.recipe.settings.clone(),
        })
    }

    /// Has a spare instance restore a state, so that the lane is not the first to see that it fails or takes too long.
    fn rehearse(&self, block: usize, recipe: &Recipe, state: &[u64]) -> Result<(), String> {
        let make = || recipe.make().map_err(|f| Fault { kind: f.kind, message: told(f) });
        let took = persist(make, |mut instance| {
            let mut took = u64::MAX;
            // The first touches memory that is new, and any may be interrupted: the quickest counts.
            for _ in 0..REHEARSALS {
                let begun = Instant::now();
                instance.restore(state).map_err(|f| Fault {
                    kind: f.kind,
                    message: format!("the new version could not restore: {}", f.message),
                })?;
                took = took.min(begun.elapsed().as_nanos().try_into().unwrap_or(u64::MAX));
            }
            Ok(took)
        });
        let took = took.map_err(|f| f.message)?;
        let lane = &self.model.lanes[self.model.blocks[block].lane];
        let most = if lane.every > 0 { lane.every.min(lane.watchdog) } else { lane.watchdog };
        if self.timed && took > most {
            let (took, most) = (took / 1000, most / 1000);
            return Err(format!("the new version takes {took} us to restore; its lane has {most} us for a whole scan"));
        }
        Ok(())
    }

    /// A version that executed before.
    fn earlier(&self, part: &JobPart, earlier: Back, plan: &mut Option<BlockPlan>) -> Result<Ready, String> {
        let Back { release, recipe, state, instance: mut kept } = earlier;
        let was = Some(recipe.version);
        let mut recipe = Recipe { version: part.version, ..recipe };
        let class = Arc::clone(recipe.template.class());
        let old = Arc::clone(part.recipe.template.class());
        // What was allowed on the way there is on the way back.
        let settings = Transfer::new(&old.settings, &class.settings, true);
        let retained = Transfer::new(&old.retained, &class.retained, true);
        let plan = plan.insert(self.plan(part, &release.component, &recipe, &settings, &retained));
        plan.state.clear();
        if !plan.broken.is_empty() {
            return Err(plan.broken.join("; "));
        }
        settings.apply(&part.recipe.settings, &mut recipe.settings);
        // The instance that was replaced, if it still takes its settings; or one that gets its state.
        let takes = match &mut kept.instance {
            Some(instance) => match instance.configure(&recipe.settings) {
                Ok(answer) => answer.is_ok(),
                // What has failed is nothing to come back to.
                Err(_) => {
                    kept.instance = None;
                    false
                }
            },
            None => false,
        };
        let (instance, carry) = if takes {
            (kept, Carry::AsIs)
        } else {
            let attempt = |mut instance: Instance| {
                let answer = instance.configure(&recipe.settings)?;
                Ok((instance, answer))
            };
            let made = persist(|| recipe.template.instantiate(&recipe.limits), attempt);
            let (instance, answer) = made.map_err(told)?;
            answer.map_err(refuses)?;
            (Loan::new(instance), if state.is_some() { Carry::State } else { Carry::Cold })
        };
        plan.notes.push(match carry {
            Carry::Cold if class.retained.is_empty() => "it retains nothing: the block starts cold".to_owned(),
            Carry::Cold => {
                "there is no state of it, it was out of order or could not save: the block starts cold".to_owned()
            }
            _ => "it goes on with the state that it had when it was replaced".to_owned(),
        });
        let state = state.unwrap_or_else(|| vec![0; class.retained.len()].into());
        Ok(Ready {
            block: part.block,
            component: release.component,
            recipe,
            instance,
            candidate: None,
            baseline: 0,
            carry,
            state,
            was,
            settings,
            given: BTreeMap::new(),
            based: part.recipe.settings.clone(),
        })
    }

    fn plan(
        &self,
        part: &JobPart,
        component: &Component,
        recipe: &Recipe,
        settings: &Transfer,
        retained: &Transfer,
    ) -> BlockPlan {
        let (old, new) = (part.recipe.template.class(), recipe.template.class());
        let (broken, mut notes) = broken(self.model, self.uses, part.block, new);
        if component.hash() == part.component.hash() {
            notes.push("it is the very component that runs".into());
        }
        BlockPlan {
            block: self.model.blocks[part.block].name.clone(),
            old: Version::new(&part.component, &part.recipe),
            new: Version::new(component, recipe),
            ports: Difference::new(old, new).ports,
            state: retained.fields().to_vec(),
            settings: settings.fields().to_vec(),
            broken,
            notes,
        }
    }
}

/// Settings by name and text.
fn given(class: &Class, settings: &[(String, String)], problems: &mut Vec<String>) -> BTreeMap<usize, u64> {
    let mut given = BTreeMap::new();
    for (name, value) in settings {
        let Some(port) = class.settings.iter().position(|p| p.path == *name) else {
            let near = nearest(name, class.settings.iter().map(|p| p.path.as_str()));
            let hint = near.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            problems.push(format!("the new version has no setting `{name}`{hint}"));
            continue;
        };
        match class.settings[port].ty.parse(value) {
            Ok(cell) => drop(given.insert(port, cell)),
            Err(error) => problems.push(format!("setting `{name}`: {error}")),
        }
    }
    given
}

fn lossy(what: &str, field: &latchwork_block::upgrade::Field) -> String {
    match &field.fate {
        Fate::Lossy { from, to, .. } => format!("{what} `{}` would lose something: from {from} to {to}", field.name),
        _ => format!("{what} `{}`", field.name),
    }
}

fn refuses(why: String) -> String {
    format!("the new version refuses its settings: {why}")
}

fn told(fault: Fault) -> String {
    format!("the new version fails: {}", fault.message)
}

/// `latchwork:device/ton@0.1.0` → `latchwork:device/ton`
fn unversioned(name: &str) -> &str {
    name.split_once('@').map_or(name, |(name, _)| name)
}
