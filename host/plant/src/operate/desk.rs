//! What operators have under way, and where their own values stand.

use super::{Answer, Operator, Pending, Refused, Wishes};
use crate::alarms::AlarmWish;
use crate::layout::Layout;
use crate::model::{Model, TagRef};
use latchwork_image::{RegionReader, RegionWriter, TagId};
use latchwork_record::{Draft, Kept};
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What waits in the router between the entries of the lanes.
pub enum Wish {
    /// A record, with what outlives the run together with it.
    Record(Box<Draft>, Vec<Kept>),
    /// Something that is to be done to alarms, when all that came before is known.
    Alarms(Box<(Pending, AlarmWish)>),
}

/// Settings on their way to a block.
pub(super) struct Configuring {
    pub(super) number: u64,
    pub(super) block: usize,
    /// What changes, by port.
    pub(super) ports: BTreeMap<usize, u64>,
    pub(super) operator: Operator,
    /// The wish it is a part of.
    pub(super) ticket: Arc<Mutex<Ticket>>,
    /// Plant time of the wish, ns.
    pub(super) asked: u64,
}

impl Configuring {
    pub(super) fn ticket(&self) -> MutexGuard<'_, Ticket> {
        // It is whole between any two statements that could panic.
        self.ticket.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A wish that several blocks have to answer.
pub(super) struct Ticket {
    /// Who waits; `None` once they have been answered.
    pub(super) pending: Option<Pending>,
    /// Blocks that have not answered.
    pub(super) left: usize,
    pub(super) done: Vec<String>,
    pub(super) refused: Option<Refused>,
}

impl Ticket {
    pub(super) fn taken(&mut self, sentences: Vec<String>) {
        self.done.extend(sentences);
        self.answered();
    }

    pub(super) fn refused(&mut self, why: Refused) {
        self.refused.get_or_insert(why);
        self.answered();
    }

    fn answered(&mut self) {
        self.left -= 1;
        if self.left == 0 {
            self.answer();
        }
    }

    /// Answers now; what comes later is on record alone.
    pub(super) fn give_up_waiting(&mut self, sentence: String) {
        if self.pending.is_some() {
            self.done.push(sentence);
            self.answer();
        }
    }

    fn answer(&mut self) {
        let Some(pending) = self.pending.take() else { return };
        let done = std::mem::take(&mut self.done);
        pending.answer(match self.refused.take() {
            Some(mut why) if !done.is_empty() => {
                why.message += &format!("; but {}", done.join(", and "));
                Err(why)
            }
            Some(why) => Err(why),
            None => Ok(Answer::Done { done }),
        });
    }
}

/// What somebody else knows of the plant.
type Tell = Box<dyn Fn() -> serde_json::Value + Send>;

/// The operators' side of a plant.
pub struct Desk {
    pub(super) wishes: Option<Wishes>,
    /// Tags by their numbers.
    pub(crate) refs: HashMap<TagId, TagRef>,
    /// Place of each block in its lane.
    pub(crate) places: Vec<u32>,
    /// The operators' region and its cells: all settings.
    pub(super) region: Option<RegionWriter>,
    pub(crate) cells: Vec<u64>,
    /// Settings as the plant file has them.
    pub(crate) of_file: Vec<u64>,
    /// Per block: staged settings by port.
    pub(crate) staged: BTreeMap<usize, BTreeMap<usize, u64>>,
    pub(super) configuring: Vec<Configuring>,
    pub(super) number: u64,
    /// Commands that stand until they are taken back: block and bit.
    pub(crate) standing: BTreeMap<(usize, u8), bool>,
    /// What else belongs to the status, by name.
    pub(super) also: Vec<(&'static str, Tell)>,
}

impl Desk {
    /// An empty desk over the operators' region.
    pub(crate) fn new(model: &Model, layout: &Layout, region: Option<RegionWriter>, regions: &[RegionReader]) -> Self {
        let mut places = vec![0; model.blocks.len()];
        for lane in &layout.lanes {
            for (place, block) in lane.blocks.iter().enumerate() {
                places[block.block] = place as u32;
            }
        }
        let mut cells = vec![0; layout.operators.len()];
        if let Some(reader) = regions.get(layout.operators_region() as usize) {
            reader.copy_to(&mut cells);
        }
        Self {
            wishes: None,
            refs: layout.ids.iter().map(|(what, id)| (*id, *what)).collect(),
            places,
            region,
            of_file: cells.clone(),
            cells,
            staged: BTreeMap::new(),
            configuring: Vec::new(),
            number: 0,
            standing: BTreeMap::new(),
            also: Vec::new(),
        }
    }

    /// Settings are on their way to a block.
    pub(crate) fn is_configuring(&self, block: usize) -> bool {
        self.configuring.iter().any(|c| c.block == block)
    }

    /// Shows the settings in effect, at plant time `now`, ns.
    pub(crate) fn publish(&mut self, now: u64) {
        if let Some(region) = &mut self.region {
            region.publish(&self.cells, now);
        }
    }

    /// Adds to the status what somebody else knows: the journal, the sinks.
    pub fn also(&mut self, name: &'static str, tell: impl Fn() -> serde_json::Value + Send + 'static) {
        self.also.push((name, Box::new(tell)));
    }
}
