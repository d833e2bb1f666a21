//! The state machine of one alarm.
//!
//! A condition makes an occurrence once it has lasted for the on-delay, and ends it once it has been away for the off-delay.
//! What an operator must still do about occurrences, acknowledge or reset, keeps the alarm listed. A mask (shelf,
//! suppression, out of service) hides it and lets nothing new come through; what stood before is there again when the last
//! mask falls. Source: ISA-18.2 (IEC 62682), and the portable vacuum pumping station for acknowledgement and reset.

use crate::CodeKind;

/// What decides over an alarm's life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rules {
    /// Its kind.
    pub kind: CodeKind,
    /// How long the condition must stand, ns.
    pub on_delay: u64,
    /// How long the condition must be away, ns.
    pub off_delay: u64,
}

/// What is shown of an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum State {
    /// Nothing to see.
    #[default]
    Normal,
    /// Active, nobody has acknowledged it.
    Unacknowledged,
    /// Active, acknowledged or in no need of it.
    Active,
    /// Gone before anybody has acknowledged it.
    Returned,
    /// Gone, and waits for its reset.
    AwaitingReset,
    /// Hidden by an operator for some time.
    Shelved,
    /// Hidden by design: a condition of the plant says that it means nothing now.
    Suppressed,
    /// Hidden by an operator until it is put back in service.
    OutOfService,
}

impl State {
    /// The word in records and displays.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unacknowledged => "unacknowledged",
            Self::Active => "active",
            Self::Returned => "returned",
            Self::AwaitingReset => "awaiting-reset",
            Self::Shelved => "shelved",
            Self::Suppressed => "suppressed",
            Self::OutOfService => "out-of-service",
        }
    }

    /// It stands in the list of alarms.
    pub fn is_listed(self) -> bool {
        matches!(self, Self::Unacknowledged | Self::Active | Self::Returned | Self::AwaitingReset)
    }
}

/// What happens to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The condition is there, or not.
    Condition(bool),
    /// The operator has seen it.
    Acknowledge,
    /// The operator resets it.
    Reset,
    /// The operator hides it until a time, ns.
    Shelve(u64),
    /// The operator shows it again.
    Unshelve,
    /// Its suppression by design begins or ends.
    Suppress(bool),
    /// It is taken out of service, or put back.
    OutOfService(bool),
    /// Time has passed.
    Tick,
}

/// One transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// When, ns: for a delay or a shelf the moment at which it was over.
    pub time: u64,
    /// What happened, in one word.
    pub word: &'static str,
    /// State before.
    pub from: State,
    /// State after.
    pub to: State,
    /// The alarm after it.
    pub after: Alarm,
}

/// Why an operator's wish does not come true.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// There is nothing to acknowledge.
    #[error("there is nothing to acknowledge")]
    NothingToAcknowledge,
    /// The condition is still there.
    #[error("the condition is still there; reset it when it has gone")]
    StillActive,
    /// It must be acknowledged first.
    #[error("acknowledge it first")]
    NotAcknowledged,
    /// There is nothing to reset.
    #[error("there is nothing to reset")]
    NothingToReset,
    /// A shelf that would end in the past.
    #[error("the time until which it is to be shelved has passed")]
    ShelfOver,
    /// It is not shelved.
    #[error("it is not shelved")]
    NotShelved,
    /// It is in that state already.
    #[error("it is so already")]
    Already,
    /// It is hidden.
    #[error("it is hidden: shelved, suppressed or out of service")]
    Hidden,
}

/// An alarm. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Alarm {
    /// The condition as it was last told.
    pub condition: bool,
    /// Since when the condition differs from `active`, ns; none while it does not, or while that counts for nothing.
    pub since: Option<u64>,
    /// An occurrence stands.
    pub active: bool,
    /// An occurrence has not been acknowledged.
    pub unacknowledged: bool,
    /// An occurrence has not been reset.
    pub latched: bool,
    /// Until when it is shelved, ns.
    pub shelved: Option<u64>,
    /// Suppressed by design.
    pub suppressed: bool,
    /// Out of service.
    pub out_of_service: bool,
}

impl Alarm {
    /// What is shown of it.
    pub fn state(&self) -> State {
        if self.out_of_service {
            return State::OutOfService;
        }
        if self.suppressed {
            return State::Suppressed;
        }
        if self.shelved.is_some() {
            return State::Shelved;
        }
        match (self.active, self.unacknowledged, self.latched) {
            (true, true, _) => State::Unacknowledged,
            (true, false, _) => State::Active,
            (false, true, _) => State::Returned,
            (false, false, true) => State::AwaitingReset,
            (false, false, false) => State::Normal,
        }
    }

    /// The code with its bits of run time: 0 active, 1 to acknowledge, 4 memory, 5 acknowledged.
    pub fn code(&self, rules: &Rules) -> u16 {
        let waits = self.unacknowledged || self.latched;
        let acknowledged = rules.kind.must_be_acknowledged() && (self.active || waits) && !self.unacknowledged;
        rules.kind.bits()
            | u16::from(self.active)
            | u16::from(self.unacknowledged) << 1
            | u16::from(self.active || waits) << 4
            | u16::from(acknowledged) << 5
    }

    /// When [`Input::Tick`] has something to do, ns, if nothing else happens.
    pub fn deadline(&self, rules: &Rules) -> Option<u64> {
        let delay = if self.active { rules.off_delay } else { rules.on_delay };
        let delayed = self.since.map(|since| since.saturating_add(delay));
        self.shelved.into_iter().chain(delayed).min()
    }

    fn hidden(&self) -> bool {
        self.out_of_service || self.suppressed || self.shelved.is_some()
    }

    /// Something happens at `now`, ns. `told` gets each transition, in the order of their times.
    ///
    /// # Errors
    /// What an operator asked for and cannot have; nothing has changed then but what time itself has done.
    pub fn step(
        &mut self,
        rules: &Rules,
        input: Input,
        now: u64,
        mut told: impl FnMut(Transition),
    ) -> Result<(), Refusal> {
        // First what was due before.
        while let Some(due) = self.deadline(rules).filter(|due| *due <= now) {
            let shelf_over = self.shelved == Some(due);
            self.change(due, if shelf_over { "shelf-over" } else { "" }, &mut told, |alarm| {
                if shelf_over {
                    alarm.shelved = None;
                    alarm.shown(due);
                } else {
                    alarm.turn(rules);
                }
            });
        }
        self.permit(input, now)?;
        let word = match input {
            Input::Acknowledge => "acknowledged",
            Input::Reset => "reset",
            Input::Shelve(_) => "shelved",
            Input::Unshelve => "unshelved",
            Input::Suppress(true) => "suppressed",
            Input::Suppress(false) => "unsuppressed",
            Input::OutOfService(true) => "out-of-service",
            Input::OutOfService(false) => "in-service",
            Input::Condition(_) | Input::Tick => "",
        };
        self.change(now, word, &mut told, |alarm| match input {
            Input::Condition(condition) => alarm.condition(condition, now),
            Input::Acknowledge => alarm.unacknowledged = false,
            Input::Reset => alarm.latched = false,
            Input::Shelve(until) => {
                alarm.shelved = Some(until);
                alarm.hide();
            }
            Input::Unshelve => {
                alarm.shelved = None;
                alarm.shown(now);
            }
            Input::Suppress(on) => {
                alarm.suppressed = on;
                if on { alarm.hide() } else { alarm.shown(now) }
            }
            Input::OutOfService(on) => {
                alarm.out_of_service = on;
                if on { alarm.hide() } else { alarm.shown(now) }
            }
            Input::Tick => {}
        });
        // A delay of 0 is over at once.
        while self.since.is_some() && self.deadline(rules).is_some_and(|due| due <= now) {
            self.change(now, "", &mut told, |alarm| alarm.turn(rules));
        }
        Ok(())
    }

    /// Does something, and tells the transition if that is one. Without a word of its own the states say what it was.
    fn change(
        &mut self,
        time: u64,
        word: &'static str,
        told: &mut impl FnMut(Transition),
        act: impl FnOnce(&mut Self),
    ) {
        let (from, before) = (self.state(), *self);
        act(self);
        let to = self.state();
        let word = match word {
            "" if self.active && !before.active => "raised",
            "" if before.active && !self.active => "returned",
            word => word,
        };
        // An acknowledgement of an alarm that goes on being shown as active is one, too.
        if from != to || (*self != before && !word.is_empty()) {
            told(Transition { time, word, from, to, after: *self });
        }
    }

    fn condition(&mut self, condition: bool, now: u64) {
        self.condition = condition;
        if self.hidden() {
            // Behind a mask an occurrence ends without delay, and none begins.
            self.active &= condition;
            return;
        }
        match (condition != self.active, self.since) {
            (true, None) => self.since = Some(now),
            (true, Some(_)) => {}
            (false, _) => self.since = None,
        }
    }

    /// The delay is over: an occurrence begins or ends.
    fn turn(&mut self, rules: &Rules) {
        self.since = None;
        self.active = self.condition;
        if self.active {
            self.unacknowledged = rules.kind.must_be_acknowledged();
            self.latched = rules.kind.must_be_reset();
        }
    }

    /// A mask comes: a delay that runs is forgotten, so that a hidden alarm does not come through.
    fn hide(&mut self) {
        self.since = None;
        self.active &= self.condition;
    }

    /// A mask has gone: if it was the last, a condition that stands begins its delay anew.
    fn shown(&mut self, now: u64) {
        if !self.hidden() {
            self.condition(self.condition, now);
        }
    }

    fn permit(&self, input: Input, now: u64) -> Result<(), Refusal> {
        let refused = |when: bool, why| if when { Err(why) } else { Ok(()) };
        match input {
            Input::Acknowledge => {
                refused(self.hidden(), Refusal::Hidden)?;
                refused(!self.unacknowledged, Refusal::NothingToAcknowledge)
            }
            Input::Reset => {
                refused(self.hidden(), Refusal::Hidden)?;
                refused(self.active, Refusal::StillActive)?;
                refused(self.unacknowledged, Refusal::NotAcknowledged)?;
                refused(!self.latched, Refusal::NothingToReset)
            }
            Input::Shelve(until) => {
                refused(self.shelved.is_some(), Refusal::Already)?;
                refused(until <= now, Refusal::ShelfOver)
            }
            Input::Unshelve => refused(self.shelved.is_none(), Refusal::NotShelved),
            Input::OutOfService(on) => refused(on == self.out_of_service, Refusal::Already),
            Input::Condition(_) | Input::Suppress(_) | Input::Tick => Ok(()),
        }
    }
}
