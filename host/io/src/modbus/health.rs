//! What is reported, and when it is not.
//!
//! An outage is one event when it begins and one when it ends, with its length and the number of failures: a peer that
//! is away for a night must not fill the records. The same holds for a request that the device refuses.

use super::link::exception;
use crate::driver::IoEvent;
use latchwork_image::format_duration;
use std::sync::Arc;
use tokio_modbus::ExceptionCode;

const NOTE: u8 = 0;
const REFUSED: u8 = 150;
const LOST: u8 = 180;
const UNSAFE: u8 = 220;

/// Where events go.
pub(super) struct Reporter {
    pub(super) driver: String,
    pub(super) report: Box<dyn FnMut(IoEvent) + Send>,
    pub(super) clock: Arc<dyn Fn() -> u64 + Send + Sync>,
}

impl Reporter {
    fn say(&mut self, point: Option<&str>, transition: &'static str, priority: u8, text: String) {
        let source = point.map_or_else(|| self.driver.clone(), |p| format!("{}.{p}", self.driver));
        (self.report)(IoEvent { source, transition, priority, text });
    }

    fn since(&self, time: u64) -> String {
        // To the millisecond: nobody needs more, and it reads better.
        format_duration((self.clock)().saturating_sub(time) / 1_000_000 * 1_000_000)
    }

    /// The safe values did not arrive.
    pub(super) fn not_safe(&mut self, points: &[&str], cause: &str) {
        let text = format!(
            "the safe values of {} were not confirmed at the stop: {cause}; the device may keep what it was told last, \
             unless it has a watchdog of its own",
            list(points)
        );
        self.say(None, "unsafe", UNSAFE, text);
    }
}

/// The state of the way to the peer.
pub(super) struct Health {
    peer: String,
    met: bool,
    outage: Option<Trouble>,
}

/// Something that goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trouble {
    since: u64,
    count: u64,
}

impl Health {
    pub(super) fn new(peer: String) -> Self {
        Self { peer, met: false, outage: None }
    }

    /// A try to reach the peer failed, or the link to it broke.
    pub(super) fn lost(&mut self, reporter: &mut Reporter, cause: &str) {
        if let Some(outage) = &mut self.outage {
            outage.count += 1;
            return;
        }
        self.outage = Some(Trouble { since: (reporter.clock)(), count: 1 });
        let what = if self.met { "is lost" } else { "cannot be reached" };
        let text = format!(
            "{} {what}: {cause}; its inputs are bad and keep their last values, its outputs are not written, tries go on",
            self.peer
        );
        reporter.say(None, "lost", LOST, text);
    }

    /// A whole cycle went well.
    pub(super) fn fine(&mut self, reporter: &mut Reporter) {
        if self.met && self.outage.is_none() {
            return;
        }
        let text = match self.outage.take() {
            None => format!("{} answers", self.peer),
            Some(o) => {
                let times = if o.count == 1 { "1 failure".into() } else { format!("{} failures", o.count) };
                let again = if self.met { " again" } else { "" };
                format!("{} answers{again} after {} and {times}", self.peer, reporter.since(o.since))
            }
        };
        self.met = true;
        reporter.say(None, "connected", NOTE, text);
    }
}

/// A request that the device refuses, or not.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Refusal(Option<Trouble>);

impl Refusal {
    pub(super) fn is_refused(&self) -> bool {
        self.0.is_some()
    }

    /// The device said no to `what` (`reading coil 3`), which is about these points.
    pub(super) fn refused(&mut self, reporter: &mut Reporter, what: &str, points: &[&str], code: ExceptionCode) {
        if let Some(trouble) = &mut self.0 {
            trouble.count += 1;
            return;
        }
        self.0 = Some(Trouble { since: (reporter.clock)(), count: 1 });
        let text = format!("the device refuses {what}: {}; this is about {}", exception(code), list(points));
        reporter.say(only(points), "refused", REFUSED, text);
    }

    /// The device did it.
    pub(super) fn accepted(&mut self, reporter: &mut Reporter, what: &str, points: &[&str]) {
        if let Some(trouble) = self.0.take() {
            let length = reporter.since(trouble.since);
            let text = format!("the device accepts {what} again after {length} and {} refusals", trouble.count);
            reporter.say(only(points), "accepted", NOTE, text);
        }
    }
}

/// The point an event is about, when it is one alone.
fn only<'a>(points: &[&'a str]) -> Option<&'a str> {
    if let [one] = points { Some(*one) } else { None }
}

/// Names of points for a sentence: the first few.
fn list(points: &[&str]) -> String {
    const SHOWN: usize = 5;
    let names: Vec<String> = points.iter().take(SHOWN).map(|p| format!("`{p}`")).collect();
    let more = points.len().saturating_sub(SHOWN);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}
