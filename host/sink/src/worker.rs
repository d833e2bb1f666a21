//! The thread of one sink: fill the list, send it, go on; back off while it is refused.

use crate::component::Version;
use crate::exchange::{Before, Call, Exchange, Exchanges, Phase, Wish};
use crate::feed::Feed;
use crate::runner::{Report, What};
use crate::{Config, Sink, SinkKind, State, Statuses};
use latchwork_record::journal::Watch;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The pause after a first refusal, and the longest one.
const PAUSE: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(30));
/// How often a sink with nothing to write gets its turn.
const IDLE: Duration = Duration::from_millis(250);
/// How long what is durable is still delivered when the run ends.
pub(crate) const LAST: Duration = Duration::from_secs(2);

/// Hears what there is to tell; called from the sinks' threads.
pub(crate) type Tell = Arc<dyn Fn(Report) + Send + Sync>;

/// One sink at work.
pub(crate) struct Worker {
    pub(crate) kind: &'static SinkKind,
    pub(crate) config: Config,
    pub(crate) feed: Feed,
    pub(crate) watch: Watch,
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) tell: Tell,
    pub(crate) statuses: Statuses,
    /// Its place among them.
    pub(crate) index: usize,
    pub(crate) sink: Option<Box<dyn Sink>>,
    /// How it is called.
    pub(crate) call: Arc<Call>,
    pub(crate) exchanges: Exchanges,
    /// The pause after the last refusal.
    pub(crate) pause: Option<Duration>,
}

impl Worker {
    /// Works until the run ends.
    pub(crate) fn run(&mut self) {
        while !self.stopping() {
            if let Some((wish, probation, exchange)) = self.call.answer() {
                self.exchange(wish, probation, exchange);
            }
            if self.stopping() {
                break;
            }
            match self.turn(false) {
                Ok(Some(wait)) => {
                    let seen = self.watch.durable();
                    self.show();
                    if !wait.is_zero() {
                        self.rest(seen, wait);
                    }
                }
                Ok(None) => {}
                Err(why) => self.failed(&why),
            }
        }
        let end = Instant::now() + LAST;
        // One that is down now is not waited for: the rest comes in the next run.
        while self.pause.is_none() && Instant::now() < end {
            match self.turn(true) {
                Ok(Some(_)) => break,
                Ok(None) => {}
                Err(why) => self.failed(&why),
            }
        }
        self.sink = None;
        self.exchanges = Exchanges::default();
        self.show();
        self.statuses.change(self.index, |s| s.state = State::Stopped);
    }

    fn stopping(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    /// Does what is to be done; how long there is nothing more to do, or `None` if there is.
    fn turn(&mut self, at_once: bool) -> Result<Option<Duration>, String> {
        if self.sink.is_none() {
            self.open()?;
        }
        let before = self.feed.cursor();
        let more = self.feed.fill(&self.watch).map_err(|why| format!("the journal cannot be read: {why}"))?;
        self.moved(before);
        if self.feed.patience().is_none() {
            self.recovered();
        }
        match self.feed.patience() {
            Some(patience) if patience.is_zero() || at_once && !more => {
                self.send()?;
                Ok(None)
            }
            _ if more => Ok(None),
            patience => Ok(Some(patience.unwrap_or(IDLE))),
        }
    }

    fn open(&mut self) -> Result<(), String> {
        let mut sink = (self.kind.open)(&self.config)?;
        // What stands beyond the end of the journal is of another one.
        if let Some(seq) = sink.kept().filter(|seq| *seq <= self.watch.durable()) {
            let before = self.feed.cursor();
            self.feed.skip_to(seq);
            self.moved(before);
        }
        self.sink = Some(sink);
        self.recovered();
        Ok(())
    }

    fn send(&mut self) -> Result<(), String> {
        let Some(sink) = &mut self.sink else { return Ok(()) };
        let before = self.feed.cursor();
        let sent = sink.write(self.feed.batch()).and_then(|seq| self.feed.kept(seq));
        if let (Err(why), true) = (&sent, self.exchanges.probation.is_some()) {
            self.take_back(why.clone());
            return Ok(());
        }
        sent?;
        self.proven();
        self.moved(before);
        self.recovered();
        self.show();
        Ok(())
    }

    /// Between two batches: another sink, or one that it had before.
    fn exchange(&mut self, wish: Wish, probation: u64, exchange: Exchange) {
        let (new, version, steps) = match wish {
            Wish::Another(new, version) => (Some(new), version, 0),
            Wish::Earlier(_) if self.exchanges.probation.is_some() => {
                return self.take_back("an operator wants the version before".into());
            }
            // Its probation has ended meanwhile.
            Wish::Earlier(_) if exchange.phase().ended() => return,
            Wish::Earlier(steps) => {
                let at = self.exchanges.earlier.len().checked_sub(steps);
                let Some(earlier) = at.and_then(|at| self.exchanges.earlier.remove(at)) else {
                    return exchange.set(Phase::Refused("there is no such version".into()));
                };
                (earlier.sink, earlier.version, steps)
            }
        };
        // From here on it cannot be called off.
        if !exchange.step(|phase| (*phase == Phase::Waiting).then_some(Phase::Probation { left: probation })) {
            return;
        }
        let mut new = new;
        if let Some(Err(why)) = new.as_mut().map(|new| new.start()) {
            if steps > 0 {
                self.exchanges.keep(Before { sink: new, version });
            }
            return exchange.set(Phase::Refused(why));
        }
        let mut before = Before { sink: std::mem::replace(&mut self.sink, new), version: self.version(version) };
        if let Some(old) = &mut before.sink {
            old.close();
        }
        self.exchanges.probation = Some((before, exchange, probation));
        if probation == 0 {
            self.keep();
        }
    }

    /// A batch has gone well.
    fn proven(&mut self) {
        let Some((_, exchange, left)) = &mut self.exchanges.probation else { return };
        *left = left.saturating_sub(1);
        exchange.set(Phase::Probation { left: *left });
        if *left == 0 {
            self.keep();
        }
    }

    /// The probation is over.
    fn keep(&mut self) {
        let Some((before, exchange, _)) = self.exchanges.probation.take() else { return };
        self.exchanges.keep(before);
        self.call.tell_earlier(self.exchanges.earlier.len());
        exchange.set(Phase::Done);
    }

    /// The one before gets the records again, from where the cursor stands.
    fn take_back(&mut self, why: String) {
        let Some((before, exchange, _)) = self.exchanges.probation.take() else { return };
        self.sink = before.sink;
        self.version(before.version);
        exchange.set(Phase::RolledBack(why));
    }

    /// Shows which version works now; the one that did.
    fn version(&self, new: Option<Version>) -> Option<Version> {
        let mut old = None;
        self.statuses.change(self.index, |s| old = std::mem::replace(&mut s.version, new));
        old
    }

    /// It works: tells so if it did not before.
    fn recovered(&mut self) {
        if self.pause.take().is_some() {
            let waiting = self.feed.waiting(&self.watch);
            self.say(What::Accepted { waiting });
            self.statuses.change(self.index, |s| (s.state, s.error) = (State::Fine, String::new()));
        }
    }

    /// Nothing to write: other duties of the sink, then sleep until there is something.
    fn rest(&mut self, seen: u64, wait: Duration) {
        if let Some(sink) = &mut self.sink {
            sink.idle();
        }
        self.watch.wait(seen, wait.min(IDLE), &self.call.flag);
    }

    fn failed(&mut self, why: &str) {
        if self.pause.is_none() {
            self.say(What::Refused(why.to_owned()));
        }
        self.statuses.change(self.index, |s| (s.state, s.error) = (State::Failing, why.to_owned()));
        self.show();
        let pause = self.pause.map_or(PAUSE.0, |p| (2 * p).min(PAUSE.1));
        self.pause = Some(pause);
        self.watch.wait(u64::MAX, pause, &self.call.flag);
    }

    fn say(&self, what: What) {
        (self.tell)(Report { sink: self.index, name: self.config.name.clone(), what });
    }

    /// Hands the cursor over if it is another one.
    fn moved(&self, before: u64) {
        if self.feed.cursor() != before {
            self.watch.moved(&self.config.name, self.feed.cursor());
        }
    }

    fn show(&self) {
        let cursor = self.feed.cursor();
        self.statuses.change(self.index, |s| s.cursor = cursor);
    }
}
