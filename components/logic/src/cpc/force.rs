//! An operator's hold on a position: forced, it follows the operator and nothing else until it is let go.

/// Hold on a binary position. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Force {
    /// The position is forced.
    pub active: bool,
    /// What it is forced to.
    pub value: bool,
}

/// What an operator may do with the hold on a binary position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ForceCommands {
    /// Force the position to true.
    pub force_true: bool,
    /// Force the position to false; wins over `force_true`.
    pub force_false: bool,
    /// Let it go; wins over both.
    pub unforce: bool,
}

impl Force {
    /// One execution; returns the position while it is forced.
    pub(crate) fn execute(&mut self, commands: ForceCommands) -> Option<bool> {
        let ForceCommands { force_true, force_false, unforce } = commands;
        if unforce {
            self.active = false;
        } else if force_true || force_false {
            *self = Self { active: true, value: !force_false };
        }
        self.active.then_some(self.value)
    }
}

/// Hold on an analogue position, whose value is a setting. The field is the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogForce {
    /// The position is forced.
    pub active: bool,
}

/// What an operator may do with the hold on an analogue position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogForceCommands {
    /// Force the position to the setting `forced-value`.
    pub force: bool,
    /// Let it go; wins over `force`.
    pub unforce: bool,
}

impl AnalogForce {
    /// One execution; returns whether the position is forced.
    pub(crate) fn execute(&mut self, commands: AnalogForceCommands) -> bool {
        self.active = !commands.unforce && (self.active || commands.force);
        self.active
    }
}
