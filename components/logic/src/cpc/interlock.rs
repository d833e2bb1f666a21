//! Interlocks of an actuator or a unit: what keeps it in its fail-safe position whoever orders what.

/// What it takes to start again after a full stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RestartRule {
    /// The acknowledgement (CPC: PEnRstart false).
    #[default]
    Acknowledge,
    /// The acknowledgement, and after the full stop has gone the command to allow the restart (PEnRstart).
    Command,
    /// The acknowledgement, then the command, also while the full stop still stands (PEnRstart and PRstartFS).
    CommandEarly,
}

/// The interlocks as they come in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InterlockInputs {
    /// Prevents a start, stops nothing (StartI).
    pub start: bool,
    /// Stops while true; what was ordered goes on by itself afterwards (TStopI).
    pub temporary: bool,
    /// Stops until it is gone and the restart rule is fulfilled (FuStopI).
    pub full: bool,
}

/// What an operator may do about them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InterlockCommands {
    /// The operator has seen it.
    pub acknowledge: bool,
    /// The operator allows the restart after a full stop.
    pub allow_restart: bool,
}

/// The interlocks. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Interlocks {
    /// The interlocks of the last execution.
    pub last: InterlockInputs,
    /// A full stop came and has not been acknowledged.
    pub latched: bool,
    /// A full stop came and the restart has not been allowed.
    pub restart_needed: bool,
    /// Something came and has not been acknowledged.
    pub unacknowledged: bool,
}

impl Interlocks {
    /// Takes the interlocks in; returns whether one of them came. An acknowledgement is for what was there before. With
    /// `stopped` a full stop stands from now on, as if it had come and gone.
    pub(super) fn execute(
        &mut self,
        rule: RestartRule,
        stopped: bool,
        now: InterlockInputs,
        commands: InterlockCommands,
    ) -> bool {
        let came = |now: bool, before: bool| now && !before;
        let full_came = stopped || came(now.full, self.last.full);
        if full_came {
            (self.latched, self.restart_needed) = (true, true);
        } else {
            self.latched &= !commands.acknowledge;
            let may = !self.latched && (!now.full || rule == RestartRule::CommandEarly);
            self.restart_needed &= !(commands.allow_restart && may);
        }
        self.restart_needed &= rule != RestartRule::Acknowledge;
        let came = full_came || came(now.start, self.last.start) || came(now.temporary, self.last.temporary);
        self.last = now;
        came
    }

    /// A full stop stands, or what follows from it does.
    pub(super) fn full_stop(&self) -> bool {
        self.last.full || self.latched || self.restart_needed
    }

    /// The fail-safe position is to be taken; `started` says whether it has been left.
    pub(super) fn forbid(&self, started: bool) -> bool {
        self.full_stop() || self.last.temporary || (self.last.start && !started)
    }

    /// Takes in what came and what was acknowledged.
    pub(super) fn acknowledge(&mut self, came: bool, acknowledge: bool) {
        self.unacknowledged = came || (self.unacknowledged && !acknowledge);
    }
}
