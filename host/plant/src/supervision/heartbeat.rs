//! Signs of life, to the supervision and from it.

use crate::model::Heartbeat;
use latchwork_image::{Value, format_duration};
use latchwork_record::{Draft, Kind};

/// Priority of a record that the supervision is gone.
const LOST: u8 = 200;

/// What was sent and heard.
#[derive(Default)]
pub(crate) struct Beats {
    sent: u64,
    /// Plant time of the next one, ns.
    next: u64,
    /// Plant time of the last one heard, or of the start, ns.
    heard: u64,
    lost: bool,
}

impl Beats {
    /// What is due at plant time `now`, ns.
    pub(crate) fn look(&mut self, keys: &Heartbeat, now: u64, drafts: &mut Vec<Draft>) {
        if let Some(send) = keys.send.filter(|_| now >= self.next) {
            self.sent += 1;
            // The grid stays; what was missed while the machine stood still is not made up for.
            self.next = self.next.saturating_add(send.saturating_mul(((now - self.next) / send).saturating_add(1)));
            let mut draft = Draft::new(now, Kind::Heartbeat, "plant", "beat");
            draft.current = Value::Integer(self.sent.into());
            drafts.push(draft);
        }
        if let Some(expect) = keys.expect
            && !self.lost
            && now.saturating_sub(self.heard) > expect
        {
            self.lost = true;
            let mut draft = Draft::new(now, Kind::Heartbeat, "supervision", "lost");
            draft.priority = LOST;
            draft.text = format!("no sign of life of the supervision for more than {}", format_duration(expect));
            drafts.push(draft);
        }
    }

    /// One of the supervision has come.
    pub(crate) fn hear(&mut self, keys: &Heartbeat, now: u64, drafts: &mut Vec<Draft>) {
        if std::mem::take(&mut self.lost) && keys.expect.is_some() {
            let away = now.saturating_sub(self.heard) / 1_000_000 * 1_000_000;
            let mut draft = Draft::new(now, Kind::Heartbeat, "supervision", "back");
            draft.text = format!("after {}", format_duration(away));
            drafts.push(draft);
        }
        self.heard = now;
    }
}
