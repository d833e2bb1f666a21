//! Between preparing and the exchange: the candidates in the shadow of the running blocks.

use super::prepare::Ready;
use super::turn::Step;
use super::{Candidate, Phase, Shadow, Stage, Swap, Tolerance, Verdict};
use crate::assemble::{Plant, Time};
use crate::operate::Refused;
use latchwork_testbed::replay::Tolerances;
use std::sync::Arc;

/// Refuses tolerances that mean nothing.
pub(super) fn check(tolerances: &[Tolerance]) -> Result<(), Refused> {
    let checked = Tolerances::new(tolerances.iter().map(|t| (&*t.tag, t.within)));
    checked.map(drop).map_err(|why| Refused::new("value", why.to_string()))
}

impl Plant {
    /// Starts the shadows.
    pub(super) fn start_shadows(&mut self, mut swap: Swap, mut ready: Vec<Ready>, now: u64) -> Step {
        let mut shadows = Vec::new();
        for part in &mut ready {
            let Some(instance) = part.candidate.take() else { continue };
            let candidate = Candidate {
                block: self.model.blocks[part.block].name.clone(),
                index: self.desk.places[part.block],
                running: Arc::clone(self.supervisor.recipes[part.block].template.class()),
                instance,
                settings: part.recipe.settings.clone(),
                own_settings: part.given.keys().copied().collect(),
                lossy: swap.lossy,
                executions: swap.shadow,
                tolerances: &swap.tolerances,
                real_time: self.time == Time::Real,
            };
            let started = Shadow::start(candidate).map_err(|why| why.to_string());
            let sent = started.and_then(|(shadow, request)| {
                shadows.push(shadow);
                let sent = self.supervisor.send(swap.lane, request);
                sent.map_err(|_| "its lane has not taken earlier requests; does it run?".to_owned())
            });
            if let Err(why) = sent {
                self.end_shadows(swap.lane, &shadows);
                return Step::End(swap, Stage::Refused, why);
            }
        }
        swap.status.stage = Stage::Shadow;
        self.tell_swap(&swap, "shadow", &format!("in the shadow for {} executions", swap.shadow), now);
        swap.phase = Phase::Shadow(ready, shadows);
        Step::On(swap)
    }

    /// What the shadows say.
    pub(super) fn shadow_step(
        &mut self,
        mut swap: Swap,
        mut ready: Vec<Ready>,
        mut shadows: Vec<Shadow>,
        now: u64,
    ) -> Step {
        let verdicts: Vec<_> = shadows.iter_mut().map(Shadow::poll).collect();
        let failed = verdicts.iter().any(|v| matches!(v, Some(Verdict::Failed(_))));
        // A difference is no reason to stop: the report is worth the rest of the time.
        if !failed && verdicts.iter().any(Option::is_none) {
            swap.phase = Phase::Shadow(ready, shadows);
            return Step::On(swap);
        }
        swap.status.shadow = shadows.iter().map(Shadow::report).collect();
        self.end_shadows(swap.lane, &shadows);
        let objections: Vec<_> = verdicts.iter().flatten().filter_map(Verdict::objection).collect();
        if !objections.is_empty() {
            return Step::End(swap, Stage::Refused, objections.join("; "));
        }
        for (part, report) in ready.iter_mut().zip(&swap.status.shadow) {
            part.baseline = report.running_max_ns;
        }
        self.go_on(swap, ready, now)
    }

    /// Ends their taps.
    pub(super) fn end_shadows(&mut self, lane: usize, shadows: &[Shadow]) {
        for shadow in shadows {
            // A lane that has no room for it ends the tap at the exchange, or has ended itself.
            let _ = self.supervisor.send(lane, shadow.stop());
        }
    }
}
