//! Who orders: the modes of an actuator or a unit, and the orders that stand.

/// The mode, which an operator chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// The plant's logic orders.
    #[default]
    Auto,
    /// The operator orders; the logic may take over by its request.
    Manual,
    /// The operator orders; the logic cannot take over.
    Forced,
}

/// What the plant's logic has to say about modes and orders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModeInputs {
    /// Ordered on by the logic (AuOnR).
    pub auto_on: bool,
    /// Ordered off by the logic; wins over `auto_on` (AuOffR).
    pub auto_off: bool,
    /// A rising edge takes the object from manual to auto (AuAuMoR).
    pub auto_mode_request: bool,
    /// There is no manual mode (AuIhMMo).
    pub inhibit_manual: bool,
    /// There is no forced mode (AuIhFoMo).
    pub inhibit_forced: bool,
}

/// What an operator may order. Of several modes at once the first here is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OrderCommands {
    /// To auto mode.
    pub auto_mode: bool,
    /// To manual mode.
    pub manual_mode: bool,
    /// To forced mode.
    pub forced_mode: bool,
    /// On, in manual and forced mode.
    pub on_order: bool,
    /// Off, in manual and forced mode; wins over `on_order`.
    pub off_order: bool,
}

/// Mode and orders. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// The mode; local stands above it and does not change it.
    pub mode: Mode,
    /// The logic's request for auto mode in the last execution.
    pub auto_mode_request: bool,
    /// The order of the logic.
    pub auto: bool,
    /// The order of the operator. In auto mode it follows the logic's, so that taking over moves nothing.
    pub manual: bool,
}

impl Orders {
    /// Before the first order the object is in its fail-safe position.
    pub(super) fn begin(&mut self, fail_safe: bool) {
        (self.auto, self.manual) = (fail_safe, fail_safe);
    }

    /// Changes the mode. In local nothing does.
    pub(super) fn choose(&mut self, local: bool, inputs: &ModeInputs, commands: &OrderCommands) {
        let requested = inputs.auto_mode_request && !self.auto_mode_request;
        self.auto_mode_request = inputs.auto_mode_request;
        if local {
            return;
        }
        if requested && self.mode == Mode::Manual {
            self.mode = Mode::Auto;
        }
        self.mode = match commands {
            OrderCommands { auto_mode: true, .. } => Mode::Auto,
            OrderCommands { manual_mode: true, .. } => Mode::Manual,
            OrderCommands { forced_mode: true, .. } => Mode::Forced,
            _ => self.mode,
        };
        let inhibited = match self.mode {
            Mode::Auto => false,
            Mode::Manual => inputs.inhibit_manual,
            Mode::Forced => inputs.inhibit_forced,
        };
        if inhibited {
            self.mode = Mode::Auto;
        }
    }

    /// Takes the orders in, and returns the one that counts. `local` are the orders on and off of the local panel while it
    /// has control.
    pub(super) fn order(
        &mut self,
        local: Option<(bool, bool)>,
        inputs: &ModeInputs,
        commands: &OrderCommands,
        stop: Stop,
    ) -> bool {
        let remembered = |order: bool| if stop.before || stop.now { stop.fail_safe } else { order };
        let level = |on: bool, off: bool, order: bool| match (on, off) {
            (_, true) => false,
            (true, false) => true,
            (false, false) => remembered(order),
        };
        self.auto = level(inputs.auto_on, inputs.auto_off, self.auto);
        self.manual = match (local, self.mode) {
            (Some((on, off)), _) => level(on, off, self.manual),
            (None, Mode::Auto) => self.auto,
            (None, Mode::Manual | Mode::Forced) => {
                let heard = !stop.now;
                level(commands.on_order && heard, commands.off_order && heard, self.manual)
            }
        };
        self.manual
    }
}

/// A full stop turns orders that are only remembered into the fail-safe position: nothing starts from an order given
/// before or during the stop.
#[derive(Clone, Copy)]
pub(super) struct Stop {
    /// It stood in the last execution.
    pub(super) before: bool,
    /// It stands.
    pub(super) now: bool,
    /// The fail-safe position.
    pub(super) fail_safe: bool,
}
