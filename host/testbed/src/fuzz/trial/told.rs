//! What a block is told between executions: to save and to go on from there, and settings.

use super::{Run, Trial};
use crate::fuzz::failure::{Failure, different, fault, same_cells};
use crate::fuzz::report::Kind;
use latchwork_block::Fault;

impl Trial<'_> {
    /// The restored one goes on from the state of the first.
    pub(super) fn restart(&mut self, run: &mut Run, number: usize) -> Result<(), Failure> {
        let at = Some((number, 0));
        let told = |f: Fault| fault(&f, at, "");
        let Some(state) = run.first.instance.save().map_err(told)? else { return Ok(()) };
        if run.told.saves {
            let other = run.twin.instance.save().map_err(told)?;
            if other.is_none_or(|o| !same_cells(&self.class().retained, &o, &state)) {
                return Err(different(Kind::NotDeterministic, "two instances save different states", at));
            }
        }
        let Some(mut restored) = self.side(self.template, &run.settings).map_err(|f| Failure { place: at, ..f })?
        else {
            let text = "after a restart it refuses the settings that it had";
            return Err(different(Kind::NotRestored, text, at));
        };
        restored.instance.restore(&state).map_err(told)?;
        self.sums.restarts += 1;
        self.saved.push((number, state));
        run.restored = Some(restored);
        Ok(())
    }

    pub(super) fn configure(&mut self, run: &mut Run, settings: &[u64], number: usize) -> Result<(), Failure> {
        let at = Some((number, 0));
        let told = |f: Fault| fault(&f, at, "");
        match run.first.instance.configure(settings).map_err(told)? {
            Ok(()) => {
                self.sums.taken += 1;
                let others = [Some(&mut run.twin), run.restored.as_mut()];
                for (side, kind) in others.into_iter().zip([Kind::NotDeterministic, Kind::NotRestored]) {
                    let Some(side) = side else { continue };
                    if side.instance.configure(settings).map_err(told)?.is_err() {
                        let who = if kind == Kind::NotRestored { "after a restart it" } else { "another instance" };
                        return Err(different(kind, &format!("{who} refuses settings that are else taken"), at));
                    }
                }
                run.finite &= self.finite(settings, |c| &c.settings);
                run.settings = settings.to_vec();
            }
            Err(sentence) => {
                self.sums.refused += 1;
                self.refusals.push((number, sentence));
                if run.told.refusals {
                    let _ = run.twin.instance.configure(settings).map_err(told)?;
                }
                if let Some(restored) = &mut run.restored {
                    let _ = restored.instance.configure(settings).map_err(told)?;
                }
            }
        }
        Ok(())
    }
}
