//! Messages to the supervision besides records of single things: status tables, and signs of life in both directions.
//! Source: messages of CERN's fast interlocks to the supervision.

mod heartbeat;
mod table;

pub(crate) use heartbeat::Beats;
pub(crate) use table::Table;

use crate::assemble::Plant;

impl Plant {
    /// Tells what is due at plant time `now`, ns.
    pub(crate) fn supervise(&mut self, now: u64) {
        let mut drafts = Vec::new();
        for table in &mut self.tables {
            drafts.extend(table.look(now));
        }
        self.beats.look(&self.model.heartbeat, now, &mut drafts);
        for draft in drafts {
            self.tell(draft, Vec::new());
        }
    }

    /// The supervision has given a sign of life.
    pub(crate) fn hear(&mut self, now: u64) -> Vec<String> {
        let mut drafts = Vec::new();
        self.beats.hear(&self.model.heartbeat, now, &mut drafts);
        for draft in drafts {
            self.tell(draft, Vec::new());
        }
        let expected = self.model.heartbeat.expect.map(latchwork_image::format_duration);
        vec![expected.map_or("heard; the plant expects none".into(), |e| format!("heard; the next within {e}"))]
    }
}
