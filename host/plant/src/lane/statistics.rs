//! A lane's figures of itself, and overruns as a condition with a beginning and an end.

use crate::layout::STATISTICS;
use latchwork_record::{Datum, Entry, Kind, Recorder, SourceId};

/// Scans in time after which a series of overruns is over.
const CALM: u32 = 100;

/// Figures of a lane.
#[derive(Clone, Debug)]
pub struct Statistics {
    every: u64,
    /// Scans.
    pub scans: u64,
    /// Scans that ended after the next was due.
    pub overruns: u64,
    /// Last scan, ns.
    pub scan_time: u64,
    /// Longest scan, ns.
    pub scan_time_max: u64,
    /// Sum of all scans, ns.
    pub scan_time_sum: u64,
    /// Latest start, ns after it was due.
    pub jitter_max: u64,
    /// Faults of blocks and of the lane.
    pub faults: u64,
    series: u64,
    calm: u32,
    told: bool,
}

impl Statistics {
    /// For a lane of this period, ns.
    pub fn new(every: u64) -> Self {
        Self {
            every,
            scans: 0,
            overruns: 0,
            scan_time: 0,
            scan_time_max: 0,
            scan_time_sum: 0,
            jitter_max: 0,
            faults: 0,
            series: 0,
            calm: 0,
            told: false,
        }
    }

    /// Mean scan, ns.
    pub fn scan_time_mean(&self) -> u64 {
        self.scan_time_sum.checked_div(self.scans).unwrap_or(0)
    }

    #[inline]
    pub(super) fn scan(&mut self, due: u64, now: u64, end: u64) {
        self.scans += 1;
        self.scan_time = end.saturating_sub(now);
        self.scan_time_max = self.scan_time_max.max(self.scan_time);
        self.scan_time_sum = self.scan_time_sum.saturating_add(self.scan_time);
        self.jitter_max = self.jitter_max.max(now.saturating_sub(due));
        if end.saturating_sub(due) > self.every {
            self.overruns += 1;
            self.series += 1;
            self.calm = 0;
        } else if self.series > 0 {
            self.calm += 1;
        }
    }

    /// Tells the beginning and the end of a series of overruns.
    #[inline]
    pub(super) fn report(&mut self, now: u64, recorder: &mut Recorder, source: SourceId) {
        if self.series == 0 {
            return;
        }
        if !self.told {
            self.told = true;
            recorder.push(Entry::new(now, Kind::Lane, source, "overrun").priority(100).text(format_args!(
                "the scan took {} us and ended after the next was due (every {} us)",
                self.scan_time / 1000,
                self.every / 1000
            )));
        } else if self.calm >= CALM {
            self.settle(now, recorder, source);
        }
    }

    /// Ends a series, in order or because the lane stops.
    pub(super) fn settle(&mut self, now: u64, recorder: &mut Recorder, source: SourceId) {
        if self.told {
            let count = self.series;
            recorder.push(
                Entry::new(now, Kind::Lane, source, "overrun-end")
                    .priority(50)
                    .change(Datum::None, Datum::Integer(i64::try_from(count).unwrap_or(i64::MAX)))
                    .text(format_args!("{count} scans overran")),
            );
        }
        self.series = 0;
        self.calm = 0;
        self.told = false;
    }

    /// Writes the figures to the lane's region, in the order of [`crate::model::Statistic::ALL`].
    #[inline]
    pub(super) fn write(&self, cells: &mut [u64]) {
        let figures = [self.scans, self.overruns, self.scan_time, self.scan_time_max, self.jitter_max, self.faults];
        cells[STATISTICS as usize..STATISTICS as usize + figures.len()].copy_from_slice(&figures);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_record::{Router, queue};

    #[test]
    fn a_series_of_overruns_is_two_records() {
        let mut router = Router::new(vec!["lane.main".into()]);
        let (mut recorder, incoming) = queue(16, SourceId(0));
        router.add(incoming);
        let mut s = Statistics::new(10);
        for n in 0..300u64 {
            let (due, long) = (n * 10, (50..60).contains(&n));
            s.scan(due, due, due + if long { 25 } else { 5 });
            s.report(due, &mut recorder, SourceId(0));
        }
        let mut seen = Vec::new();
        router.release(u64::MAX, |r| seen.push(format!("{} {}", r.time, r.transition)));
        assert_eq!(seen, ["500 overrun", "1590 overrun-end"]);
        assert_eq!((s.scans, s.overruns, s.scan_time_max), (300, 10, 25));
    }
}
