//! Veracity check of a binary signal: bounce and short disappearances are ignored.

use crate::{Rs, Ton};

/// Two on-delay timers and a reset-dominant flip-flop, as in the paper's figure 5: the output is the input delayed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalVeracity {
    rise: Ton,
    fall: Ton,
    out: Rs,
}

/// What survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalState {
    /// The output.
    pub dout: bool,
    /// The input of the last execution.
    pub din: bool,
    /// How long the input has stood, ns; no more than the time it had to.
    pub held: u64,
}

impl DigitalVeracity {
    /// One execution, `elapsed` ns after the previous one; returns the output, which follows `din` when that has stood for
    /// `time` ns without a break. With `time` 0 it follows at once.
    pub fn execute(&mut self, elapsed: u64, din: bool, time: u64) -> bool {
        let set = self.rise.execute(elapsed, din, time);
        let reset = self.fall.execute(elapsed, !din, time);
        self.out.execute(set, reset)
    }

    /// Forgets everything: the output is false and the next execution starts the time.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The state to carry over. One of the timers is always at rest, so one time says it all.
    #[must_use]
    pub fn save(&self) -> DigitalState {
        let din = self.rise.input;
        let held = if din { self.rise.et } else { self.fall.et };
        DigitalState { dout: self.out.q1, din, held }
    }

    /// Goes on from a saved state.
    pub fn restore(&mut self, state: DigitalState) {
        let running = Ton { input: true, q: false, et: state.held };
        let (rise, fall) = if state.din { (running, Ton::default()) } else { (Ton::default(), running) };
        *self = Self { rise, fall, out: Rs { q1: state.dout } };
    }
}
