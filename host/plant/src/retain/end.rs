//! The last save: when the lanes have stopped.

use crate::assemble::Plant;
use crate::lane::{Lane, LaneState};
use latchwork_record::{Draft, Kind};

/// Priority of the record of a state that is not the last one.
const PRIORITY: u8 = 128;

impl Plant {
    /// Saves all that is retained of lanes that have stopped, at plant time `now`, ns. It ends the keeping. A block that is
    /// out of order, or whose lane is gone, leaves the state that was saved last.
    pub(crate) fn retain_last(&mut self, lanes: &mut [Lane], now: u64) {
        let epoch = self.router.epoch();
        let Some(mut keeping) = self.keeper.keeping.take() else { return };
        let mut drafts = Vec::new();
        for number in 0..keeping.members.len() {
            let member = &keeping.members[number];
            let of = self.model.blocks[member.block].lane;
            let lane = lanes.iter_mut().find(|l| l.index() == of && l.state() != LaneState::Starting);
            let block = lane.and_then(|l| l.blocks_mut().get_mut(member.place as usize));
            let Some(instance) = block.and_then(|b| b.instance.as_mut()) else { continue };
            let mut cells = vec![0; instance.class().retained.len()];
            if cells.is_empty() || cells.len() != member.fields {
                continue;
            }
            match instance.save_into(&mut cells) {
                Ok(true) => keeping.set(number, &cells, now, epoch),
                Ok(false) => {}
                Err(fault) => {
                    let mut draft = Draft::new(now, Kind::Fault, &member.name, fault.kind.name());
                    draft.priority = PRIORITY;
                    draft.text = format!("its last state is not kept, what was saved before counts: {}", fault.message);
                    drafts.push(draft);
                }
            }
        }
        keeping.keep(false);
        for draft in drafts {
            self.tell(draft, Vec::new());
        }
    }
}
