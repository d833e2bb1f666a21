//! The life of a driver: find the peer, repeat the cycle, lose it and find it again, stop safely.

use super::connect::Connect;
use super::health::{Health, Refusal, Reporter};
use super::inputs::{Input, Inputs};
use super::keys::Timing;
use super::link::{Failure, Link, explain_io};
use super::outputs::{Output, Outputs};
use super::plan::{Range, group};
use super::point::{Place, Table};
use crate::driver::{Driver, DriverConfig, DriverContext};
use std::future::Future;
use std::pin::Pin;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, sleep, timeout};

/// A Modbus driver that has not begun.
pub(super) struct Session<C> {
    name: String,
    timing: Timing,
    peer: C,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
}

impl<C: Connect> Session<C> {
    /// A session for a checked configuration.
    pub(super) fn new(config: &DriverConfig, timing: Timing, peer: C) -> Result<Self, String> {
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for point in &config.points {
            let place = Place::of(&point.values).map_err(|problems| {
                let messages: Vec<String> = problems.into_iter().map(|p| p.message).collect();
                format!("point `{}`: {}", point.name, messages.join("; "))
            })?;
            match point.safe {
                Some(safe) => outputs.push(Output::new(point.name.clone(), place, safe)),
                None => inputs.push(Input { name: point.name.clone(), place }),
            }
        }
        Ok(Self { name: config.name.clone(), timing, peer, inputs, outputs })
    }
}

impl<C: Connect> Driver for Session<C> {
    fn run(self: Box<Self>, context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let DriverContext { inputs, outputs, clock, report, stop } = context;
            let mut timer = interval(self.timing.every);
            // The grid of the schedule stays; what was missed is left out, not made up for.
            timer.set_missed_tick_behavior(MissedTickBehavior::Skip);
            let ranges = group(self.inputs.iter().map(|i| i.place).enumerate(), Table::most_read);
            let running = Running {
                health: Health::new(self.peer.name()),
                timing: self.timing,
                peer: self.peer,
                refusals: vec![Refusal::default(); ranges.len()],
                ranges,
                inputs: Inputs::new(self.inputs, inputs, clock.clone()),
                outputs: Outputs::new(self.outputs, outputs, self.timing.refresh),
                reporter: Reporter { driver: self.name, report, clock },
                stop,
            };
            running.live(timer).await;
        })
    }
}

struct Running<C> {
    timing: Timing,
    peer: C,
    ranges: Vec<Range>,
    /// One per range.
    refusals: Vec<Refusal>,
    inputs: Inputs,
    outputs: Outputs,
    health: Health,
    reporter: Reporter,
    stop: watch::Receiver<bool>,
}

impl<C: Connect> Running<C> {
    async fn live(mut self, mut timer: Interval) {
        let mut pause = self.timing.reconnect_min;
        let mut link = None;
        loop {
            let mut stop = self.stop.clone();
            let (cause, held) = tokio::select! {
                biased;
                () = stopped(&mut stop) => break,
                result = self.peer.connect(self.timing.timeout) => match result {
                    Err(error) => (explain_io(&error), Duration::ZERO),
                    Ok(context) => {
                        let begin = Instant::now();
                        let mut fresh = Link::new(context, self.timing.timeout, self.peer.gap());
                        match self.serve(&mut fresh, &mut timer).await {
                            Ok(()) => {
                                link = Some(fresh);
                                break;
                            }
                            Err(cause) => (cause, begin.elapsed()),
                        }
                    }
                },
            };
            self.inputs.lose();
            self.health.lost(&mut self.reporter, &cause);
            // A peer that comes and goes is asked less and less often, until it stays.
            if held >= self.timing.reconnect_max {
                pause = self.timing.reconnect_min;
            }
            tokio::select! {
                biased;
                () = stopped(&mut stop) => break,
                () = sleep(pause) => pause = (pause * 2).min(self.timing.reconnect_max),
            }
        }
        self.leave(link).await;
    }

    /// Repeats the cycle until a stop (`Ok`) or until the peer is lost (the cause).
    async fn serve(&mut self, link: &mut Link, timer: &mut Interval) -> Result<(), String> {
        self.outputs.forget();
        let mut stop = self.stop.clone();
        loop {
            tokio::select! {
                biased;
                () = stopped(&mut stop) => return Ok(()),
                _ = timer.tick() => {}
            }
            self.cycle(link).await?;
            if !*stop.borrow() {
                self.health.fine(&mut self.reporter);
            }
        }
    }

    /// Reads everything, publishes it at once, writes what has changed. A request is never cut short by a stop: its
    /// late answer would meet the safe values' requests.
    async fn cycle(&mut self, link: &mut Link) -> Result<(), String> {
        for (range, refusal) in self.ranges.iter().zip(&mut self.refusals) {
            if *self.stop.borrow() {
                return Ok(());
            }
            let result = link.read(range.table, range.start, range.count).await;
            let names = || range.points.iter().map(|n| self.inputs.points[*n].name.as_str()).collect::<Vec<_>>();
            let what = || format!("reading {}", range.name());
            match result {
                Ok(words) => {
                    if refusal.is_refused() {
                        refusal.accepted(&mut self.reporter, &what(), &names());
                    }
                    self.inputs.take(range, &words);
                }
                Err(Failure::Refused(code)) => {
                    refusal.refused(&mut self.reporter, &what(), &names(), code);
                    self.inputs.distrust(range);
                }
                Err(Failure::Lost(cause)) => return Err(cause),
            }
        }
        self.inputs.publish();
        self.outputs.cycle(link, &mut self.reporter, &self.stop).await
    }

    /// Writes the safe values, over the link or, when it is lost, over a last try to get one.
    async fn leave(mut self, link: Option<Link>) {
        if self.outputs.is_empty() {
            return;
        }
        let limit = self.timing.timeout;
        let link = match link {
            Some(link) => Ok(link),
            None => match self.peer.connect(limit).await {
                Ok(context) => Ok(Link::new(context, limit, self.peer.gap())),
                Err(error) => Err(explain_io(&error)),
            },
        };
        let result = match link {
            Ok(mut link) => match timeout(limit, self.outputs.make_safe(&mut link, &mut self.reporter)).await {
                Ok(result) => result,
                Err(_) => Err(format!("not all was written within {limit:?}")),
            },
            Err(cause) => {
                self.reporter.not_safe(&self.outputs.names(), &cause);
                return;
            }
        };
        let open = self.outputs.not_safe();
        if !open.is_empty() {
            let cause = result.err().unwrap_or_else(|| "the device refused them".into());
            self.reporter.not_safe(&open, &cause);
        }
    }
}

/// Ends when the plant stops, or is gone.
async fn stopped(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|s| *s).await;
}
