//! What of the alarms outlives a run.

use super::{After, Annunciator, Role};
use latchwork_alarm::Alarm;
use latchwork_record::{Kept, SourceId};
use serde::{Deserialize, Serialize};

/// Beginning of the names that alarms are kept under.
const PREFIX: &str = "alarm/";

/// A kept state that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("the kept state of `{name}` cannot be read: {error}")]
pub struct StateError {
    /// Alarm.
    pub name: String,
    /// Why.
    pub error: serde_json::Error,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
struct State {
    active: bool,
    unacknowledged: bool,
    latched: bool,
    shelved: Option<u64>,
    suppressed: bool,
    out_of_service: bool,
    first_out: bool,
    raised: u64,
    raised_seq: u64,
    seq: u64,
}

/// What was taken over: what the lanes must believe was told last, so that a plant that says otherwise now is heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Restored {
    /// The alarm.
    pub alarm: usize,
    /// Its condition.
    pub condition: bool,
    /// It was suppressed.
    pub suppressed: bool,
}

impl Annunciator {
    /// The state of an alarm, to be kept with its record.
    pub(super) fn keep(&self, alarm: usize, after: &After) -> Kept {
        let (state, member) = (&after.alarm, &self.members[alarm]);
        let state = State {
            active: state.active,
            unacknowledged: state.unacknowledged,
            latched: state.latched,
            shelved: state.shelved,
            suppressed: state.suppressed,
            out_of_service: state.out_of_service,
            first_out: after.first_out,
            raised: member.raised,
            raised_seq: member.raised_seq,
            seq: member.seq,
        };
        Kept { name: format!("{PREFIX}{}", self.alarms.name(alarm)), value: serde_json::to_string(&state).ok() }
    }

    /// The watched tags that a restored alarm hangs on, with what was told of them last; `None`: they must tell anew.
    pub(crate) fn expected(&self, restored: Restored) -> Vec<(SourceId, Option<bool>)> {
        let of_role = |role: &Role| match role {
            Role::Condition(alarm) => (*alarm == restored.alarm).then_some(Some(restored.condition)),
            // It speaks with the first scan in any case.
            Role::Suppresses(_) => None,
        };
        self.by_source.iter().filter_map(|(source, role)| Some((*source, of_role(role)?))).collect()
    }

    /// Takes over what was kept under a name; `None` for what is no alarm of this plant.
    ///
    /// # Errors
    /// What cannot be read; the alarm begins anew.
    pub(crate) fn restore(&mut self, name: &str, value: &str) -> Result<Option<Restored>, StateError> {
        let Some(alarm) = name.strip_prefix(PREFIX).and_then(|name| self.alarms.find(name)) else { return Ok(None) };
        let state: State = serde_json::from_str(value).map_err(|error| StateError { name: name.to_owned(), error })?;
        let rules = *self.alarms.rules(alarm);
        let member = &mut self.members[alarm];
        // What the rules no longer ask for is not waited for.
        let suppressed = state.suppressed && member.unheard;
        let restored = Alarm {
            condition: state.active,
            since: None,
            active: state.active,
            unacknowledged: state.unacknowledged && rules.kind.must_be_acknowledged(),
            latched: state.latched && rules.kind.must_be_reset(),
            shelved: state.shelved,
            suppressed,
            out_of_service: state.out_of_service,
        };
        (member.raised, member.raised_seq, member.seq) = (state.raised, state.raised_seq, state.seq);
        self.alarms.restore(alarm, restored, state.first_out);
        self.settle_due();
        Ok(Some(Restored { alarm, condition: state.active, suppressed }))
    }
}
