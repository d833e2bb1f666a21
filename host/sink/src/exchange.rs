//! Another sink in the place of one that works: between two batches, with the cursor where it stands.
//!
//! ```text
//! Swapper ─swap─► Preparation, where its owner runs it: check, compile ─► Call ─► worker, between two batches: open
//!         ─► probation ─► kept | the old one back
//! ```

use crate::component::{self, Version};
use crate::prepare::Preparation;
use crate::{Config, Sink, SinkKind, State, Statuses};
use latchwork_record::journal::Watch;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Earlier versions that are kept of a sink.
const EARLIER: usize = 4;

/// Where an exchange is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Checked and compiled, or it waits for that.
    #[default]
    Preparing,
    /// Compiled; nothing was opened, since only that was wanted.
    Planned,
    /// Waits for the end of a batch.
    Waiting,
    /// It is being opened; the old one is not closed yet.
    Opening,
    /// It gets the records; the old one waits.
    Probation {
        /// Batches that the probation has before it.
        left: u64,
    },
    /// It gets the records for good.
    Done,
    /// The old one goes on: why.
    Refused(String),
    /// It has failed, the old one gets the records again: why.
    RolledBack(String),
    /// It was called off.
    Cancelled,
}

impl Phase {
    /// It goes no further.
    pub fn ended(&self) -> bool {
        !matches!(self, Self::Preparing | Self::Waiting | Self::Opening | Self::Probation { .. })
    }
}

/// An exchange under way. Clones are the same one.
#[derive(Clone, Default)]
pub struct Exchange {
    phase: Arc<Mutex<Phase>>,
    version: Arc<Mutex<Option<Version>>>,
}

impl Exchange {
    /// Where it is.
    pub fn phase(&self) -> Phase {
        lock(&self.phase).clone()
    }

    /// The version that comes, once it is known to be a logger.
    pub fn version(&self) -> Option<Version> {
        lock(&self.version).clone()
    }

    /// Calls it off; false if the new one has been opened already.
    pub fn cancel(&self) -> bool {
        self.step(|phase| match phase {
            Phase::Preparing | Phase::Waiting => Some(Phase::Cancelled),
            _ => None,
        })
    }

    /// What comes is this.
    pub(crate) fn know(&self, version: Version) {
        *lock(&self.version) = Some(version);
    }

    pub(crate) fn set(&self, to: Phase) {
        *lock(&self.phase) = to;
    }

    /// Goes on from where it is, unless it was called off meanwhile.
    pub(crate) fn step(&self, next: impl FnOnce(&Phase) -> Option<Phase>) -> bool {
        let mut phase = lock(&self.phase);
        match next(&phase) {
            Some(next) => {
                *phase = next;
                true
            }
            None => false,
        }
    }
}

/// What a worker is called for.
pub(crate) enum Wish {
    /// Another sink.
    Another(Box<dyn Sink>, Option<Version>),
    /// One that it had before, so many back.
    Earlier(usize),
}

/// How a worker is called.
#[derive(Default)]
pub(crate) struct Call {
    /// Somebody has called: it does not wait any longer.
    pub(crate) flag: AtomicBool,
    wish: Mutex<Option<(Wish, u64, Exchange)>>,
    under_way: Mutex<UnderWay>,
    history: Mutex<Versions>,
}

#[derive(Default)]
struct UnderWay {
    /// The last exchange.
    exchange: Option<Exchange>,
    /// Nobody answers any more: why.
    gone: Option<String>,
}

/// The versions of a sink that can come back.
#[derive(Default)]
struct Versions {
    /// On probation: the one that waits.
    before: Option<Version>,
    /// The newest is the last.
    earlier: Vec<Option<Version>>,
}

impl Call {
    pub(crate) fn leave(&self, wish: Wish, probation: u64, exchange: Exchange, watch: &Watch) {
        *lock(&self.wish) = Some((wish, probation, exchange));
        self.ring(watch);
    }

    pub(crate) fn ring(&self, watch: &Watch) {
        self.flag.store(true, Ordering::Release);
        watch.wake();
    }

    /// What is wished; those who call later ring again.
    pub(crate) fn answer(&self) -> Option<(Wish, u64, Exchange)> {
        self.flag.store(false, Ordering::Release);
        lock(&self.wish).take()
    }

    /// Tells which version waits while another one is on probation.
    pub(crate) fn tell_before(&self, before: Option<Version>) {
        lock(&self.history).before = before;
    }

    /// Tells which earlier versions there are.
    pub(crate) fn tell_earlier(&self, earlier: Vec<Option<Version>>) {
        lock(&self.history).earlier = earlier;
    }

    /// Its worker is gone: what is under way comes to no other end, and nothing more begins.
    pub(crate) fn give_up(&self, why: &str) {
        let why = format!("the sink has failed by itself and has ended, it works again in the next run: {why}");
        let mut under_way = lock(&self.under_way);
        if let Some(exchange) = &under_way.exchange {
            exchange.step(|phase| (!phase.ended()).then(|| Phase::Refused(why.clone())));
        }
        under_way.gone = Some(why);
    }

    /// Begins an exchange, if none is under way.
    fn begin(&self, name: &str) -> Result<Exchange, String> {
        let mut under_way = lock(&self.under_way);
        if let Some(why) = &under_way.gone {
            return Err(format!("sink `{name}`: {why}"));
        }
        if under_way.exchange.as_ref().is_some_and(|e| !e.phase().ended()) {
            return Err(format!("sink `{name}` is being swapped already; wait for the end of that, or roll it back"));
        }
        let exchange = Exchange::default();
        under_way.exchange = Some(exchange.clone());
        Ok(exchange)
    }

    /// The exchange that is on probation.
    fn on_probation(&self) -> Option<Exchange> {
        let exchange = lock(&self.under_way).exchange.clone();
        exchange.filter(|e| matches!(e.phase(), Phase::Probation { .. }))
    }
}

/// One of the sinks.
pub(crate) struct Seat {
    pub(crate) kind: &'static SinkKind,
    pub(crate) config: Config,
    pub(crate) call: Arc<Call>,
}

/// Exchanges sinks while they work. Clones are the same handle.
#[derive(Clone)]
pub struct Swapper {
    pub(crate) seats: Arc<[Seat]>,
    pub(crate) watch: Watch,
    pub(crate) statuses: Statuses,
}

impl Swapper {
    /// Names of the sinks.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.seats.iter().map(|s| s.config.name.as_str())
    }

    /// What a sink runs; `None` for one that is no component, and for a name that none has.
    pub fn version(&self, sink: &str) -> Option<Version> {
        self.statuses.list().into_iter().find(|s| s.name == sink)?.version
    }

    /// Gives a sink of kind `component` another component. Whoever asks runs the preparation on a thread that has time;
    /// `dry_run` leaves it at that. If one of its first `probation` batches fails, the old one comes back.
    ///
    /// # Errors
    /// No such sink; one of another kind; one that is being exchanged.
    pub fn swap(
        &self,
        sink: &str,
        file: &str,
        bytes: &Arc<[u8]>,
        probation: u64,
        dry_run: bool,
    ) -> Result<(Exchange, Preparation), String> {
        let seat = self.seat(sink)?;
        if !std::ptr::eq(seat.kind, &component::COMPONENT) {
            let kind = seat.kind.name;
            return Err(format!("sink `{sink}` is of kind \"{kind}\"; only one of kind \"component\" has a component"));
        }
        let exchange = seat.call.begin(sink)?;
        let preparation = Preparation {
            exchange: exchange.clone(),
            config: seat.config.clone(),
            call: Arc::clone(&seat.call),
            watch: self.watch.clone(),
            file: file.into(),
            bytes: Arc::clone(bytes),
            probation,
            dry_run,
        };
        Ok((exchange, preparation))
    }

    /// Puts another sink in the place of one; it is ready to be opened.
    ///
    /// # Errors
    /// No such sink; one that is being exchanged.
    pub fn exchange(&self, sink: &str, new: Box<dyn Sink>, probation: u64) -> Result<Exchange, String> {
        let seat = self.seat(sink)?;
        let exchange = seat.call.begin(sink)?;
        exchange.set(Phase::Waiting);
        seat.call.leave(Wish::Another(new, None), probation, exchange.clone(), &self.watch);
        Ok(exchange)
    }

    /// Puts an earlier one back: of an exchange that is on probation the one before, else so many versions back, from 1.
    ///
    /// # Errors
    /// No such sink; no such version; one that is being exchanged.
    pub fn rollback(&self, sink: &str, steps: usize) -> Result<Exchange, String> {
        let seat = self.seat(sink)?;
        if let Some(exchange) = seat.call.on_probation() {
            if steps != 1 {
                return Err(format!("sink `{sink}` is on probation: 1 step takes that back, then go on"));
            }
            seat.call.leave(Wish::Earlier(1), 0, exchange.clone(), &self.watch);
            return Ok(exchange);
        }
        let earlier = lock(&seat.call.history).earlier.len();
        if steps == 0 || steps > earlier {
            return Err(match earlier {
                0 => format!("sink `{sink}` has no earlier version: it has not been swapped since the plant's start"),
                n => format!("sink `{sink}` has earlier versions 1 to {n} steps back, not {steps}"),
            });
        }
        let exchange = seat.call.begin(sink)?;
        exchange.set(Phase::Waiting);
        seat.call.leave(Wish::Earlier(steps), 0, exchange.clone(), &self.watch);
        Ok(exchange)
    }

    /// The version that [`Self::rollback`] would bring now; `None` for one that is no component, and where there is none.
    pub fn earlier(&self, sink: &str, steps: usize) -> Option<Version> {
        let call = &self.seats.iter().find(|s| s.config.name == sink)?.call;
        let on_probation = call.on_probation().is_some();
        let history = lock(&call.history);
        if on_probation && steps == 1 {
            return history.before.clone();
        }
        history.earlier.get(history.earlier.len().checked_sub(steps)?)?.clone()
    }

    fn seat(&self, sink: &str) -> Result<&Seat, String> {
        if self.statuses.list().iter().any(|s| s.name == sink && s.state == State::Ended) {
            return Err(format!("sink `{sink}` has failed by itself and has ended; it works again in the next run"));
        }
        let found = self.seats.iter().find(|s| s.config.name == sink);
        found.ok_or_else(|| match latchwork_image::nearest(sink, self.names()) {
            Some(near) => format!("there is no sink `{sink}`; did you mean `{near}`?"),
            None => format!("there is no sink `{sink}`"),
        })
    }
}

/// A sink that was replaced.
pub(crate) struct Before {
    /// `None`: it had not been opened; it is, from its own table.
    pub(crate) sink: Option<Box<dyn Sink>>,
    pub(crate) version: Option<Version>,
}

/// The exchanges of one worker.
#[derive(Default)]
pub(crate) struct Exchanges {
    /// On probation.
    pub(crate) probation: Option<(Before, Exchange, u64)>,
    /// The newest is the last.
    pub(crate) earlier: VecDeque<Before>,
}

impl Exchanges {
    /// Which they are, the newest last.
    pub(crate) fn versions(&self) -> Vec<Option<Version>> {
        self.earlier.iter().map(|b| b.version.clone()).collect()
    }

    /// Keeps a version that may be wanted back.
    pub(crate) fn keep(&mut self, before: Before) {
        if self.earlier.len() == EARLIER {
            self.earlier.pop_front();
        }
        self.earlier.push_back(before);
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    // Whole between any two statements that could panic.
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
