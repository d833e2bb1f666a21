//! Makes new instances for blocks that faulted, off the lanes.

use crate::lane::{Configured, Reply, Report, Request, RestartRequest};
use latchwork_block::{Fault, FaultKind, Instance, Limits, Scan, Template};
use latchwork_record::Text;

/// How to make one block.
#[derive(Clone)]
pub struct Recipe {
    /// Compiled component and class.
    pub template: Template,
    /// Limits.
    pub limits: Limits,
    /// Settings cells.
    pub settings: Vec<u64>,
    /// Number of the version; 0 is the plant file's.
    pub version: u64,
}

/// How often calls beside the lanes are tried that have run out of their budget.
const TRIES: usize = 3;

/// Beside the lanes a thread has no priority, perhaps the lowest: what ran out of its budget of time there may only have been
/// interrupted. It is tried again with another instance; a block that takes too long does so each time. Making an instance has
/// seconds, so that is not tried again.
///
/// # Errors
/// Those of the making, or of the last attempt.
pub(crate) fn persist<T>(
    mut make: impl FnMut() -> Result<Instance, Fault>,
    mut attempt: impl FnMut(Instance) -> Result<T, Fault>,
) -> Result<T, Fault> {
    for _ in 1..TRIES {
        match attempt(make()?) {
            Err(fault) if fault.kind == FaultKind::Budget => {}
            other => return other,
        }
    }
    attempt(make()?)
}

impl Recipe {
    /// A fresh instance with its settings; `Err` also when the block refuses them.
    pub fn make(&self) -> Result<Instance, Fault> {
        persist(|| self.template.instantiate(&self.limits), |instance| self.configured(instance))
    }

    /// Whether the state of such a block can be saved, as far as a spare instance tells: asked before and after an execution,
    /// so that the one at work is not the first to fail at it.
    ///
    /// # Errors
    /// How the spare one failed.
    pub(crate) fn rehearse_save(&self) -> Result<(), Fault> {
        persist(|| self.make(), Self::save_twice)
    }

    fn save_twice(mut spare: Instance) -> Result<(), Fault> {
        if spare.save()?.is_none() {
            return Ok(());
        }
        let arguments = spare.class().argument_cells();
        let mut cells = vec![0; arguments + spare.class().output_cells()];
        let ins: Vec<u32> = (0..arguments as u32).collect();
        let scan = Scan { now: 0, elapsed: 0, first: true };
        // A block that fails without inputs may do well with those that it gets.
        if spare.execute(scan, &ins, arguments as u32, &mut cells).is_ok() {
            spare.save()?;
        }
        Ok(())
    }

    /// An instance with the settings.
    pub(crate) fn configured(&self, mut instance: Instance) -> Result<Instance, Fault> {
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
    /// Requests for a version that the lane has and the recipes have not yet: the last one of each block, with its lane.
    pub(crate) held: Vec<(usize, RestartRequest)>,
}

impl Supervisor {
    /// Serves every request that waits. Compiling never happens here: the templates are ready.
    pub fn pump(&mut self) {
        for (lane, request) in std::mem::take(&mut self.held) {
            self.restart(lane, request);
        }
        for lane in 0..self.lanes.len() {
            while self.lanes[lane].requests.slots() > 0
                && let Ok(mut request) = self.lanes[lane].restarts.pop()
            {
                drop(request.dead.take());
                if request.block != u32::MAX {
                    self.restart(lane, request);
                }
            }
        }
    }

    fn restart(&mut self, lane: usize, request: RestartRequest) {
        let (recipe, link) = (&self.recipes[request.model], &mut self.lanes[lane]);
        self.held.retain(|(l, held)| (*l, held.block) != (lane, request.block));
        if recipe.version != request.version || link.requests.slots() == 0 {
            // The lane's report of the exchange, or of the way back, has not been read yet.
            return self.held.push((lane, request));
        }
        let instance = match recipe.make() {
            Ok(instance) => Ok(Box::new(instance)),
            Err(fault) => Err(Box::new((fault.kind, Text::new(&fault.message)))),
        };
        // There is a free slot, and this is the only producer.
        let _ =
            link.requests.push(Request::Restarted(Reply { block: request.block, version: request.version, instance }));
    }

    /// Sends a request to a lane; gives it back when the lane has too many waiting.
    pub fn send(&mut self, lane: usize, request: Request) -> Result<(), Request> {
        self.lanes[lane].requests.push(request).map_err(|rtrb::PushError::Full(r)| r)
    }
}
