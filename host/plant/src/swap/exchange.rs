//! To the lane and back: what was exchanged, kept, rolled back.

use super::prepare::Ready;
use super::versions::{Earlier, History, Home, Release};
use super::{Coming, Phase, Stage, Swap};
use crate::assemble::{Plant, Time};
use crate::lane::{Carry, End, Exchange, Exchanged, Exchanging, Handed, Request, Standing};

/// Scans for which the running versions are timed before they are exchanged, at most.
const MEASURE: u64 = 8;
/// Time for which they are, at most, ns.
const MEASURE_TIME: u64 = 100_000_000;

impl Plant {
    /// Sends an exchange to its lane.
    pub(super) fn exchange(&mut self, swap: &mut Swap, ready: Vec<Ready>) -> Result<(), String> {
        let every = self.model.lanes[swap.lane].every;
        // Lanes with edges execute when they execute; at virtual time an execution takes none.
        let known = ready.iter().all(|r| r.baseline > 0);
        let edges = self.model.lanes[swap.lane].interrupt.is_some();
        let timed = swap.probation > 0 && !known && every > 0 && !edges && self.time == Time::Real;
        let measure = if timed { (MEASURE_TIME / every).clamp(1, MEASURE) } else { 0 };
        self.has_room(&ready)?;
        self.still_fits(&ready)?;
        if self.supervisor.lanes[swap.lane].requests.slots() == 0 {
            return Err("its lane has not taken earlier requests; does it run?".into());
        }
        let (mut parts, mut saved, mut coming) = (Vec::new(), Vec::new(), Vec::new());
        for mut part in ready {
            let growth = self.grow(part.block, &part.recipe)?;
            let running = self.supervisor.recipes[part.block].template.class();
            saved.push(Handed { cells: vec![0; running.retained.len()].into(), there: false });
            let adapter = self.adapter(part.block, part.recipe.template.class());
            let Some(instance) = part.instance.instance.take() else { return Err("its instance is lost".into()) };
            let standing = Standing::new(instance, part.recipe.version, adapter);
            let mut exchanging = Exchanging::new(self.desk.places[part.block], standing, part.carry, part.state);
            (exchanging.growth, exchanging.baseline) = (growth, part.baseline);
            exchanging.tap = self.record_version(part.block, &part.recipe, &part.component);
            parts.push(exchanging);
            coming.push(Coming { component: part.component, recipe: part.recipe, was: part.was });
        }
        let told = Exchanged { number: swap.status.number, at: 0, took: 0, saved: saved.into() };
        let exchange = Exchange {
            number: swap.status.number,
            parts: parts.into(),
            measure,
            probation: swap.probation,
            left: std::sync::Arc::clone(&swap.left),
            ticket: std::sync::Arc::clone(&swap.ticket),
            told: Some(Box::new(told)),
            end: End::Open,
            ended: 0,
        };
        let sent = self.supervisor.send(swap.lane, Request::Exchange(Box::new(exchange)));
        sent.map_err(|_| "its lane has not taken earlier requests; does it run?".to_owned())?;
        swap.status.stage = Stage::Exchanging;
        swap.phase = Phase::Exchanging(coming);
        Ok(())
    }

    /// What operators have under way may be other things than when the order was given.
    fn still_fits(&self, ready: &[Ready]) -> Result<(), String> {
        let uses = self.uses();
        let broken = |r: &Ready| super::broken::broken(&self.model, &uses, r.block, r.recipe.template.class()).0;
        let broken: Vec<_> = ready.iter().flat_map(broken).collect();
        if broken.is_empty() { Ok(()) } else { Err(broken.join("; ")) }
    }

    /// Other versions execute now.
    pub(crate) fn exchanged(&mut self, told: Exchanged, now: u64) {
        let Some(at) = self.swaps.under_way.iter().position(|s| s.status.number == told.number) else { return };
        let mut swap = self.swaps.under_way.remove(at);
        let Phase::Exchanging(coming) = std::mem::replace(&mut swap.phase, Phase::Probation) else { return };
        swap.status.stage = Stage::Probation;
        (swap.status.exchange_ns, swap.status.exchanged_at) = (told.took, told.at);
        let since = self.router.epoch().saturating_add(told.at);
        for ((block, saved), coming) in swap.blocks.iter().zip(told.saved).zip(coming) {
            if saved.there {
                self.retain_saved(*block, &saved.cells, now);
            }
            let release = Release { component: coming.component, since, by: swap.operator.user.clone() };
            let recipe = std::mem::replace(&mut self.supervisor.recipes[*block], coming.recipe);
            let state = saved.there.then_some(saved.cells);
            let before = self.release(*block);
            let history = self.swaps.histories.entry(*block).or_insert_with(|| History::new(before));
            if let Some(was) = coming.was {
                history.take(was);
            }
            let release = std::mem::replace(&mut history.current, release);
            let now_runs = history.current.component.clone();
            history.push(Earlier { release, recipe, state, instance: Home::default(), until: since });
            self.retain_version(*block, &now_runs);
            self.show_ports(*block);
            self.settings_swapped(*block, &swap.operator, swap.status.number, now);
        }
        let transition = if swap.back { "rolled-back" } else { "exchanged" };
        self.tell_swap(&swap, transition, &format!("exchanged in {} us", told.took.div_ceil(1000)), told.at);
        self.swaps.under_way.push(swap);
    }

    /// An exchange has ended.
    pub(crate) fn swap_ended(&mut self, exchange: Exchange, now: u64) {
        let Some(at) = self.swaps.under_way.iter().position(|s| s.status.number == exchange.number) else {
            // It was called off on its way to the lane, which has not done it.
            let at = self.swaps.not_done.iter().position(|(number, ..)| *number == exchange.number);
            if let Some((_, blocks, coming)) = at.and_then(|at| self.swaps.not_done.remove(at)) {
                self.give_back(&blocks, coming, exchange.parts.into_vec());
            }
            return;
        };
        let mut swap = self.swaps.under_way.remove(at);
        let Exchange { parts, end, ended, probation, .. } = exchange;
        let parts = parts.into_vec();
        match end {
            End::Open => {}
            End::Refused(why) => {
                if let Phase::Exchanging(coming) = std::mem::replace(&mut swap.phase, Phase::Over) {
                    self.give_back(&swap.blocks, coming, parts);
                }
                self.tell_swap(&swap, "refused", why.as_str(), ended);
                self.swaps.end(swap, Stage::Refused, why.as_str().into());
            }
            End::Kept => {
                self.keep_instances(&swap, parts);
                if probation > 0 {
                    self.tell_swap(&swap, "kept", "its probation is over", ended);
                }
                self.stays(swap, String::new(), now);
            }
            End::NoWayBack(why) => {
                self.keep_instances(&swap, parts);
                self.tell_swap(&swap, "kept", &format!("its probation ends early: {}", why.as_str()), ended);
                self.stays(swap, why.as_str().into(), now);
            }
            End::RolledBack(why) => {
                self.go_back(&swap, parts, false, [ended, now]);
                self.tell_swap(&swap, "rolled-back", why.as_str(), ended);
                self.swaps.end(swap, Stage::RolledBack, why.as_str().into());
            }
            End::Returned => {
                self.go_back(&swap, parts, true, [ended, now]);
                self.taken_back(swap, ended);
            }
        }
        self.not_taken_back(exchange.number, now);
    }

    /// What the lane has not taken stays what can be gone back to.
    fn give_back(&mut self, blocks: &[usize], coming: Vec<Coming>, parts: Vec<Exchanging>) {
        for ((block, part), coming) in blocks.iter().zip(parts).zip(coming) {
            let history = self.swaps.histories.get_mut(block);
            let earlier = coming.was.and_then(|was| history?.find(was));
            // What has got a state may have failed at it.
            if let (Some(earlier), Carry::AsIs) = (earlier, &part.carry) {
                earlier.instance.put(part.other.instance);
            }
        }
    }

    /// Instances that need not wait any more are kept with their versions.
    fn keep_instances(&mut self, swap: &Swap, parts: Vec<Exchanging>) {
        for (block, part) in swap.blocks.iter().zip(parts) {
            let history = self.swaps.histories.get_mut(block);
            if let Some(earlier) = history.and_then(|h| h.find(part.other.version)) {
                earlier.instance.put(part.other.instance);
            }
        }
    }

    /// The versions before execute again.
    fn go_back(&mut self, swap: &Swap, parts: Vec<Exchanging>, wanted: bool, [ended, now]: [u64; 2]) {
        let taking = |s: &&Swap| matches!(s.phase, Phase::TakingBack(number) if number == swap.status.number);
        let by = self.swaps.under_way.iter().find(taking).filter(|_| wanted).unwrap_or(swap);
        let (operator, number) = (by.operator.clone(), by.status.number);
        for (block, part) in swap.blocks.iter().zip(parts) {
            let Some(history) = self.swaps.histories.get_mut(block) else { continue };
            let Some(mut before) = history.earlier.pop_back() else { continue };
            let until = self.router.epoch().saturating_add(ended);
            before.release.since = until;
            let release = std::mem::replace(&mut history.current, before.release);
            let recipe = std::mem::replace(&mut self.supervisor.recipes[*block], before.recipe);
            let runs_again = history.current.component.clone();
            // A version that has failed is nothing to go back to.
            if wanted {
                let state = part.state_there.then_some(part.state);
                let instance = Home::new(part.other.instance);
                history.push(Earlier { release, recipe, state, instance, until });
            }
            self.retain_version(*block, &runs_again);
            self.show_ports(*block);
            self.settings_swapped(*block, &operator, number, now);
        }
    }
}
