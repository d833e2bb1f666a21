//! Between preparing and the exchange: the candidates in the shadow of the running blocks.

use super::prepare::Ready;
use super::turn::Step;
use super::{Candidate, Phase, Shadow, Stage, Swap, Tolerance, Verdict};
use crate::assemble::{Plant, Time};
use crate::lane::Request;
use crate::operate::Refused;
use latchwork_image::nearest;
use latchwork_testbed::replay::Tolerances;
use std::sync::Arc;

/// Taps that are to end and whose lanes had no room for that yet.
#[derive(Default)]
pub(super) struct Untaps(Vec<(usize, u32, Request)>);

impl Untaps {
    /// The tap on a block of a lane is to end.
    fn add(&mut self, lane: usize, block: u32, request: Request) {
        self.replaced(lane, block);
        self.0.push((lane, block, request));
    }

    /// Another one has taken its place, which has ended it.
    fn replaced(&mut self, lane: usize, block: u32) {
        self.0.retain(|(l, b, _)| (*l, *b) != (lane, block));
    }

    /// Sends what there is room for, in order.
    fn send(&mut self, mut send: impl FnMut(usize, Request) -> Result<(), Request>) {
        for (lane, block, request) in std::mem::take(&mut self.0) {
            if let Err(request) = send(lane, request) {
                self.0.push((lane, block, request));
            }
        }
    }
}

/// Refuses tolerances that mean nothing.
pub(super) fn check(tolerances: &[Tolerance]) -> Result<(), Refused> {
    let checked = Tolerances::new(tolerances.iter().map(|t| (&*t.tag, t.within)));
    checked.map(drop).map_err(|why| Refused::new("value", why.to_string()))
}

impl Plant {
    /// Refuses tolerances of what these blocks do not give: mistyped, they would be none.
    pub(super) fn tolerances_name_outputs(&self, tolerances: &[Tolerance], blocks: &[usize]) -> Result<(), Refused> {
        let outputs = || {
            let of =
                |block: &usize| (&*self.model.blocks[*block].name, self.supervisor.recipes[*block].template.class());
            blocks.iter().map(of).flat_map(|(name, class)| class.outputs.iter().map(move |port| (name, &*port.path)))
        };
        for Tolerance { tag, within } in tolerances {
            let one = Tolerances::new([(&**tag, *within)]).map_err(|why| Refused::new("value", why.to_string()))?;
            if !outputs().any(|(block, output)| one.of(block, output).is_some()) {
                let tags: Vec<_> = outputs().map(|(block, output)| format!("{block}.outputs.{output}")).collect();
                let near = nearest(tag, tags.iter().map(String::as_str));
                let near = near
                    .map_or_else(|| format!("they have {}", tags.join(", ")), |near| format!("did you mean {near}?"));
                let why =
                    format!("the tolerance of {tag} is one of no output of the blocks that are exchanged; {near}");
                return Err(Refused::new("value", why));
            }
        }
        Ok(())
    }

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
                let sent = self.supervisor.send(swap.lane, request);
                sent.map_err(|_| "its lane has not taken earlier requests; does it run?".to_owned())?;
                self.swaps.untaps.replaced(swap.lane, self.desk.places[part.block]);
                shadows.push(shadow);
                Ok(())
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
            self.swaps.untaps.add(lane, shadow.block(), shadow.stop());
        }
        self.untap();
    }

    /// Ends taps whose lanes had no room for that before.
    pub(super) fn untap(&mut self) {
        self.swaps.untaps.send(|lane, request| self.supervisor.send(lane, request));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::TapSlot;

    fn untap(block: u32) -> Request {
        Request::Untap { block, slot: TapSlot::Shadow }
    }

    /// What is sent when lane 0 has room for so many.
    fn sent(untaps: &mut Untaps, mut room: usize) -> Vec<(usize, u32)> {
        let mut sent = Vec::new();
        untaps.send(|lane, request| match request {
            Request::Untap { block, .. } if lane > 0 || room > 0 => {
                room -= usize::from(lane == 0);
                sent.push((lane, block));
                Ok(())
            }
            request => Err(request),
        });
        sent
    }

    #[test]
    fn a_tap_whose_end_found_no_room_is_ended_later_and_no_other_in_its_place() {
        let mut untaps = Untaps::default();
        for (lane, block) in [(0, 3), (0, 4), (1, 3), (0, 3), (0, 5)] {
            untaps.add(lane, block, untap(block));
        }
        assert_eq!(sent(&mut untaps, 0), [(1, 3)], "one lane does not wait for another");
        assert_eq!(sent(&mut untaps, 1), [(0, 4)]);
        // The shadow of the next swap is not ended by the end of the one before.
        untaps.replaced(0, 3);
        assert_eq!(sent(&mut untaps, 9), [(0, 5)]);
        assert_eq!(sent(&mut untaps, 9), []);
    }
}
