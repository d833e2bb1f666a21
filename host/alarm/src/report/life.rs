//! Where one alarm stands, as its records tell.

use super::chatter::Chatter;
use super::{Event, FLEETING, STALE};
use crate::State;

/// One alarm.
#[derive(Debug, Default)]
pub(super) struct Life {
    pub(super) state: State,
    /// When it came into that state, ns.
    pub(super) entered: u64,
    /// Priority it was last told with.
    pub(super) priority: u8,
    /// Since when it is active, ns.
    pub(super) active: Option<u64>,
    /// Since when it waits to be acknowledged, ns.
    waiting: Option<u64>,
    /// How often it was raised in the period.
    pub(super) raised: u64,
    pub(super) chatter: Chatter,
    /// How often it was fleeting, and the shortest time.
    pub(super) fleeting: Option<(u64, u64)>,
    /// Since when and how long it was active when that was longest, among the times that were longer than a day.
    pub(super) stale: Option<(u64, u64)>,
}

/// What an event meant beyond the alarm itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// It was raised.
    Raised,
    /// It was acknowledged after so long, ns; none when nobody knows since when it waited.
    Acknowledged(Option<u64>),
    /// Something else that is known.
    Other,
    /// No transition of an alarm.
    Unknown,
}

impl Life {
    /// Something happens to it. Only what happens `within` the period counts; what was before is the state to begin with.
    pub(super) fn take(&mut self, event: &Event<'_>, within: bool) -> Meaning {
        let (time, mut meaning) = (event.time, Meaning::Other);
        let told = match event.transition {
            "raised" => {
                meaning = Meaning::Raised;
                self.active = Some(time);
                if within {
                    self.raised += 1;
                    self.chatter.raise(time);
                }
                State::Active
            }
            "returned" => {
                self.gone(time, within);
                State::Normal
            }
            "acknowledged" => {
                meaning = Meaning::Acknowledged(self.waiting.take().map(|since| time.saturating_sub(since)));
                if self.active.is_some() { State::Active } else { State::Normal }
            }
            "reset" => State::Normal,
            "shelved" => State::Shelved,
            "suppressed" => State::Suppressed,
            "out-of-service" => State::OutOfService,
            "unshelved" | "shelf-over" | "unsuppressed" | "in-service" => {
                if self.active.is_some() {
                    State::Active
                } else {
                    State::Normal
                }
            }
            _ => return Meaning::Unknown,
        };
        self.priority = event.priority;
        self.stand(event.state.unwrap_or(told), time, within);
        meaning
    }

    /// The state that a record tells is the truth, whatever was missed before: a journal may begin in the middle of a life.
    fn stand(&mut self, state: State, time: u64, within: bool) {
        if state != self.state {
            (self.state, self.entered) = (state, time);
        }
        let active = match state {
            State::Unacknowledged | State::Active => true,
            State::Returned | State::AwaitingReset | State::Normal => false,
            // A mask hides an occurrence; it does not end it.
            State::Shelved | State::Suppressed | State::OutOfService => return,
        };
        if active {
            self.active.get_or_insert(time);
        } else {
            self.gone(time, within);
        }
        if matches!(state, State::Unacknowledged | State::Returned) {
            self.waiting.get_or_insert(time);
        } else {
            self.waiting = None;
        }
    }

    /// The clock jumps to a time: what is known of earlier ones is worth nothing. The state stands as before, since this moment;
    /// what was counted goes if counting begins `anew`.
    pub(super) fn jump(&mut self, time: u64, anew: bool) {
        self.entered = time;
        self.active = self.active.map(|_| time);
        self.waiting = self.waiting.map(|_| time);
        if anew {
            (self.raised, self.chatter, self.fleeting, self.stale) = (0, Chatter::default(), None, None);
        }
    }

    fn gone(&mut self, time: u64, within: bool) {
        let Some(since) = self.active.take() else { return };
        let lasted = time.saturating_sub(since);
        if !within {
            return;
        }
        if lasted <= FLEETING {
            let (count, shortest) = self.fleeting.unwrap_or((0, lasted));
            self.fleeting = Some((count + 1, shortest.min(lasted)));
        }
        self.long(since, lasted);
    }

    fn long(&mut self, since: u64, lasted: u64) {
        if lasted > STALE && self.stale.is_none_or(|(_, longest)| lasted > longest) {
            self.stale = Some((since, lasted));
        }
    }

    /// The report ends: whether the alarm is stale now.
    pub(super) fn finish(&mut self, to: u64) -> bool {
        let shown = matches!(self.state, State::Unacknowledged | State::Active);
        let Some(since) = self.active.filter(|_| shown) else { return false };
        let lasted = to.saturating_sub(since);
        self.long(since, lasted);
        lasted > STALE
    }

    /// Since when it stands as it does: for an active one since it was raised.
    pub(super) fn since(&self) -> u64 {
        match self.state {
            State::Unacknowledged | State::Active => self.active.unwrap_or(self.entered),
            _ => self.entered,
        }
    }
}
