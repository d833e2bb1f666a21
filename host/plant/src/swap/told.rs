//! What is on record and in the status about swaps.

use super::broken::Uses;
use super::{Phase, Swap};
use crate::assemble::Plant;
use crate::model::TagRef;
use latchwork_record::Kind;
use serde_json::{Map, Value, json};

/// Priority of the record of a version that has failed.
const FAILED: u8 = 128;

impl Plant {
    /// A step of a swap, one record per block.
    pub(super) fn tell_swap(&mut self, swap: &Swap, transition: &'static str, what: &str, at: u64) {
        for (n, block) in swap.blocks.iter().enumerate() {
            let name = self.model.blocks[*block].name.clone();
            let versions = match swap.status.blocks.get(n) {
                Some(plan) => format!("{} → {}: ", plan.old.short(), plan.new.short()),
                None => String::new(),
            };
            self.tell_of_block(swap, &name, transition, format!("swap {}: {versions}{what}", swap.status.number), at);
        }
    }

    /// An order.
    pub(super) fn tell_asked(&mut self, swap: &Swap, files: &[String], at: u64) {
        for (block, file) in swap.blocks.iter().zip(files) {
            let name = self.model.blocks[*block].name.clone();
            let text = format!("swap {}: {} → {file}", swap.status.number, self.short(*block));
            self.tell_of_block(swap, &name, "asked", text, at);
        }
    }

    /// A wish for an earlier version.
    pub(super) fn tell_back(&mut self, swap: &Swap, steps: u64, at: u64) {
        let versions = if steps == 1 { "the version before".to_owned() } else { format!("{steps} versions before") };
        for block in &swap.blocks {
            let name = self.model.blocks[*block].name.clone();
            let text = format!("swap {}: {} → {versions}", swap.status.number, self.short(*block));
            self.tell_of_block(swap, &name, "asked", text, at);
        }
    }

    fn short(&self, block: usize) -> String {
        super::Version::new(&self.release(block).component, &self.supervisor.recipes[block]).short()
    }

    fn tell_of_block(&mut self, swap: &Swap, block: &str, transition: &'static str, text: String, at: u64) {
        let mut draft = Self::did(at, Kind::Swap, block, transition, &swap.operator);
        let remark = std::mem::replace(&mut draft.text, text);
        if !remark.is_empty() {
            draft.text += &format!("; {remark}");
        }
        if transition == "rolled-back" && !swap.back {
            draft.priority = FAILED;
        }
        self.tell(draft, Vec::new());
    }

    /// What of the plant's tags operators have under way.
    pub(super) fn uses(&self) -> Uses {
        let forced = self.forces.list().filter_map(|(id, _)| self.desk.refs.get(&id).copied()).collect();
        let staged = self
            .desk
            .staged
            .iter()
            .flat_map(|(block, ports)| ports.keys().map(|port| TagRef::Setting { block: *block, port: *port }));
        let standing = self.desk.standing.iter().filter(|(_, on)| **on);
        let standing = standing.map(|((block, bit), _)| TagRef::Command { block: *block, bit: *bit }).collect();
        Uses { forced, staged: staged.collect(), standing }
    }

    /// What the status tells of a block's version.
    pub(crate) fn version_row(&self, block: usize, row: &mut Map<String, Value>) {
        let release = self.release(block);
        row.insert("component".into(), json!(release.component.name()));
        row.insert("hash".into(), json!(release.component.hash()));
        row.insert("since".into(), json!(release.since));
        row.insert("by".into(), json!(release.by));
        let of_file = &self.model.blocks[block].component;
        row.insert("differs".into(), json!(release.component.hash() != of_file.hash()));
        let earlier = self.swaps.histories.get(&block).map_or(0, |h| h.earlier.len());
        row.insert("versions".into(), json!(earlier));
        let swap = self.swaps.under_way.iter().find(|s| s.blocks.contains(&block));
        let state = match swap.map(|s| &s.phase) {
            Some(Phase::Probation) => "probation",
            Some(Phase::Exchanging(_) | Phase::TakingBack(_)) => "exchanging",
            Some(Phase::Shadow(..)) => "shadow",
            Some(_) => "preparing",
            None => return,
        };
        row.insert("swap".into(), json!(state));
    }
}
