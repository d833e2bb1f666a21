//! The thread of one sink: fill the list, send it, go on; back off while it is refused.

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
    /// The pause after the last refusal.
    pub(crate) pause: Option<Duration>,
}

impl Worker {
    /// Works until the run ends.
    pub(crate) fn run(&mut self) {
        while !self.stopping() {
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
        let seq = sink.write(self.feed.batch())?;
        let before = self.feed.cursor();
        self.feed.kept(seq)?;
        self.moved(before);
        self.recovered();
        self.show();
        Ok(())
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
        self.watch.wait(seen, wait.min(IDLE), &self.stop);
    }

    fn failed(&mut self, why: &str) {
        if self.pause.is_none() {
            self.say(What::Refused(why.to_owned()));
        }
        self.statuses.change(self.index, |s| (s.state, s.error) = (State::Failing, why.to_owned()));
        self.show();
        let pause = self.pause.map_or(PAUSE.0, |p| (2 * p).min(PAUSE.1));
        self.pause = Some(pause);
        self.watch.wait(u64::MAX, pause, &self.stop);
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
