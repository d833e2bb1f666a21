//! Makes new instances for blocks that faulted, off the lanes.

use crate::lane::{Configured, Reply, Report, Request, RestartRequest};
use latchwork_block::{Fault, FaultKind, Instance, Limits, Template};
use latchwork_record::Text;

/// How to make one block.
pub struct Recipe {
    /// Compiled component and class.
    pub template: Template,
    /// Limits.
    pub limits: Limits,
    /// Settings cells.
    pub settings: Vec<u64>,
}

impl Recipe {
    /// A fresh instance with its settings; `Err` also when the block refuses them.
    pub fn make(&self) -> Result<Instance, Fault> {
        let mut instance = self.template.instantiate(&self.limits)?;
        if let Err(sentence) = instance.configure(&self.settings)? {
            return Err(Fault { kind: FaultKind::Settings, message: format!("settings refused: {sentence}") });
        }
        Ok(instance)
    }
}

/// The way to one lane.
pub struct LaneLink {
    /// Requests from the lane.
    pub restarts: rtrb::Consumer<RestartRequest>,
    /// Requests to the lane.
    pub requests: rtrb::Producer<Request>,
    /// What blocks said to new settings.
    pub configured: rtrb::Consumer<Configured>,
    /// What else the lane sends back.
    pub reports: rtrb::Consumer<Report>,
}

/// Answers the lanes' restart requests.
pub struct Supervisor {
    /// Per block of the model.
    pub recipes: Vec<Recipe>,
    /// Per lane.
    pub lanes: Vec<LaneLink>,
}

impl Supervisor {
    /// Serves every request that waits. Compiling never happens here: the templates are ready.
    pub fn pump(&mut self) {
        for lane in &mut self.lanes {
            while lane.requests.slots() > 0
                && let Ok(request) = lane.restarts.pop()
            {
                drop(request.dead);
                if request.block == u32::MAX {
                    continue;
                }
                let instance = match self.recipes[request.model].make() {
                    Ok(instance) => Ok(Box::new(instance)),
                    Err(fault) => Err(Box::new((fault.kind, Text::new(&fault.message)))),
                };
                // There was a free slot, and this is the only producer.
                let _ = lane.requests.push(Request::Restarted(Reply { block: request.block, instance }));
            }
        }
    }

    /// Sends a request to a lane; gives it back when the lane has too many waiting.
    pub fn send(&mut self, lane: usize, request: Request) -> Result<(), Request> {
        self.lanes[lane].requests.push(request).map_err(|rtrb::PushError::Full(r)| r)
    }
}
