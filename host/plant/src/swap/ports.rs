//! Ports of a version that the plant was not laid out with.

use crate::assemble::Plant;
use crate::lane::Adapter;
use latchwork_block::Class;
use latchwork_block::upgrade::Mapping;

impl Plant {
    /// What a version of a block needs in order to execute in its lane; nothing when the lane was laid out for one like it.
    pub(crate) fn adapter(&self, block: usize, executed: &Class) -> Option<Box<Adapter>> {
        let laid_out = &self.model.blocks[block].class;
        let place = &self.layout.lanes[self.model.blocks[block].lane].blocks[self.desk.places[block] as usize];
        if Mapping::new(laid_out, executed).is_identity() {
            return None;
        }
        let outs: Vec<_> = place.out.clone().collect();
        Some(Box::new(Adapter::new(laid_out, &place.ins, &outs, executed)))
    }
}
