//! What comes before the exchange of a component, on a thread that has time.

use crate::component::{self, Version};
use crate::exchange::{Call, Wish};
use crate::{Config, Exchange, Phase, Sink};
use latchwork_record::journal::Watch;
use std::sync::Arc;

/// A sink that could take the place of another one.
type Candidate = (Box<dyn Sink>, Version);

/// What takes long before a component can take the place of another one: hashing, checking, compiling.
///
/// One that is dropped undone, or fails by itself, refuses its exchange.
pub struct Preparation {
    pub(crate) exchange: Exchange,
    pub(crate) config: Config,
    pub(crate) call: Arc<Call>,
    pub(crate) watch: Watch,
    pub(crate) file: String,
    pub(crate) bytes: Arc<[u8]>,
    pub(crate) probation: u64,
    pub(crate) dry_run: bool,
}

impl Preparation {
    /// Does it; then the sink's own thread is called. What was called off meanwhile is done no further.
    pub fn run(self) {
        match self.candidate() {
            Ok(_) if self.dry_run => self.prepared(Phase::Planned),
            Ok(Some((candidate, version))) => {
                if self.exchange.step(|phase| (*phase == Phase::Preparing).then_some(Phase::Waiting)) {
                    let wish = Wish::Another(candidate, Some(version));
                    self.call.leave(wish, self.probation, self.exchange.clone(), &self.watch);
                }
            }
            Ok(None) => {}
            Err(why) => self.prepared(Phase::Refused(why)),
        }
    }

    /// It is not to be: why.
    pub fn refuse(self, why: String) {
        self.prepared(Phase::Refused(why));
    }

    /// The sink, compiled; `None` when nobody wants it any more.
    fn candidate(&self) -> Result<Option<Candidate>, String> {
        let wanted = || self.exchange.phase() == Phase::Preparing;
        if !wanted() {
            return Ok(None);
        }
        let version = Version::read(&self.file, &self.bytes)?;
        self.exchange.know(version.clone());
        let mut candidate = component::candidate(&self.config, &self.file, &self.bytes)?;
        if !wanted() {
            return Ok(None);
        }
        candidate.prepare()?;
        Ok(Some((candidate, version)))
    }

    fn prepared(&self, next: Phase) {
        self.exchange.step(|phase| (*phase == Phase::Preparing).then_some(next));
    }
}

impl Drop for Preparation {
    fn drop(&mut self) {
        self.prepared(Phase::Refused("it could not be prepared: the compiler has failed".into()));
    }
}
