//! What is to be written: only what has changed, and everything once per refresh period.

use super::health::{Refusal, Reporter};
use super::link::{Failure, Link};
use super::plan::{Range, group};
use super::point::{Place, Table};
use crate::driver::{Demand, Outputs as Demands};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::Instant;

/// An output point.
#[derive(Clone, Debug)]
pub(super) struct Output {
    name: String,
    place: Place,
    safe: u64,
    /// What it is to show now.
    wanted: u64,
    /// What the device has confirmed on this link.
    confirmed: Option<u64>,
    /// What the device was last asked to take.
    tried: Option<u64>,
    refusal: Refusal,
    /// A request for several points was refused: this one is written by itself, so that it suffers from no other.
    alone: bool,
}

impl Output {
    pub(super) fn new(name: String, place: Place, safe: u64) -> Self {
        Self {
            name,
            place,
            safe,
            wanted: safe,
            confirmed: None,
            tried: None,
            refusal: Refusal::default(),
            alone: false,
        }
    }
}

/// The output points.
pub(super) struct Outputs {
    points: Vec<Output>,
    demands: Demands,
    refresh: Duration,
    due: Instant,
}

impl Outputs {
    pub(super) fn new(points: Vec<Output>, demands: Demands, refresh: Duration) -> Self {
        Self { points, demands, refresh, due: Instant::now() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    pub(super) fn names(&self) -> Vec<&str> {
        self.points.iter().map(|p| p.name.as_str()).collect()
    }

    /// A new link: the device behind it may have restarted, so nothing it was told before counts.
    pub(super) fn forget(&mut self) {
        for point in &mut self.points {
            (point.confirmed, point.tried, point.alone) = (None, None, false);
        }
    }

    /// Writes what has changed, or everything when the refresh is due. Ends early at a stop.
    pub(super) async fn cycle(
        &mut self,
        link: &mut Link,
        reporter: &mut Reporter,
        stop: &watch::Receiver<bool>,
    ) -> Result<(), String> {
        if self.points.is_empty() {
            return Ok(());
        }
        self.demands.refresh();
        let now = Instant::now();
        let all = now >= self.due;
        if all {
            self.due = now + self.refresh;
        }
        let mut chosen = Vec::new();
        for (n, point) in self.points.iter_mut().enumerate() {
            point.wanted = match self.demands.demand(n) {
                Demand::Live(cell) => cell,
                Demand::First | Demand::Safe => point.safe,
            };
            // What was refused is offered again at the refresh, not in every cycle.
            let settled = if point.refusal.is_refused() { point.tried } else { point.confirmed };
            if all || settled != Some(point.wanted) {
                chosen.push(n);
            }
        }
        self.put(&chosen, link, reporter, Some(stop)).await
    }

    /// Writes the safe values of all points; tells which the device has not confirmed.
    pub(super) async fn make_safe(&mut self, link: &mut Link, reporter: &mut Reporter) -> Result<(), String> {
        for point in &mut self.points {
            (point.wanted, point.confirmed) = (point.safe, None);
        }
        let all: Vec<usize> = (0..self.points.len()).collect();
        self.put(&all, link, reporter, None).await
    }

    /// Points whose safe value the device has not confirmed.
    pub(super) fn not_safe(&self) -> Vec<&str> {
        self.points.iter().filter(|p| p.confirmed != Some(p.safe)).map(|p| p.name.as_str()).collect()
    }

    /// Writes the wanted values of the chosen points, grouped as far as the device takes them so.
    async fn put(
        &mut self,
        chosen: &[usize],
        link: &mut Link,
        reporter: &mut Reporter,
        stop: Option<&watch::Receiver<bool>>,
    ) -> Result<(), String> {
        let (alone, together): (Vec<usize>, Vec<usize>) = chosen.iter().partition(|n| self.points[**n].alone);
        let mut ranges = group(together.iter().map(|n| (*n, self.points[*n].place)), Table::most_written);
        ranges.extend(alone.iter().map(|n| self.single(*n)));
        let mut next = 0;
        while let Some(range) = ranges.get(next).cloned() {
            next += 1;
            if stop.is_some_and(|s| *s.borrow()) {
                return Ok(());
            }
            let result = link.write(range.table, range.start, &self.words(&range)).await;
            if let (Err(Failure::Refused(_)), true) = (&result, range.points.len() > 1) {
                // One of them may be to blame: each gets a request of its own.
                for n in &range.points {
                    self.points[*n].alone = true;
                    ranges.push(self.single(*n));
                }
                continue;
            }
            for n in &range.points {
                let point = &mut self.points[*n];
                point.tried = Some(point.wanted);
                let what =
                    || format!("writing {}", point.place.table.range(point.place.address, point.place.coding.words()));
                match &result {
                    Ok(()) => {
                        point.confirmed = Some(point.wanted);
                        if point.refusal.is_refused() {
                            point.refusal.accepted(reporter, &what(), &[&point.name]);
                        }
                    }
                    Err(Failure::Refused(code)) => {
                        point.confirmed = None;
                        point.refusal.refused(reporter, &what(), &[&point.name], *code);
                    }
                    Err(Failure::Lost(cause)) => return Err(cause.clone()),
                }
            }
        }
        Ok(())
    }

    /// The request for one point.
    fn single(&self, n: usize) -> Range {
        let place = self.points[n].place;
        Range { table: place.table, start: place.address, count: place.coding.words(), points: vec![n] }
    }

    fn words(&self, range: &Range) -> Vec<u16> {
        let mut words = vec![0; usize::from(range.count)];
        for n in &range.points {
            let point = &self.points[*n];
            let from = usize::from(point.place.address - range.start);
            if let Some(words) = words.get_mut(from..from + usize::from(point.place.coding.words())) {
                point.place.encode(point.wanted, words);
            }
        }
        words
    }
}
