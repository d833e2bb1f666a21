//! One line a second, for logs, pipes and CI.

use super::{History, Picture, Show};
use latchwork_image::{Quality, format_duration};
use latchwork_plant::assemble::Plant;
use std::io::Write;

const PERIOD: u64 = 1_000_000_000;
/// Values a line shows at most.
const VALUES: usize = 8;
/// Alarms that a line names; a flood makes no longer lines.
const ALARMS: usize = 10;

/// A line per second of plant time.
pub(crate) struct Lines {
    picture: Picture,
    next: u64,
    last_seq: u64,
}

impl Lines {
    pub(crate) fn new(plant: &Plant) -> Self {
        Self { picture: Picture::new(plant), next: PERIOD, last_seq: 0 }
    }

    fn line(&mut self, now: u64, history: &History) -> String {
        self.picture.refresh();
        let mut parts = vec![format!("{:>6.1} s", now as f64 / 1e9)];
        for lane in self.picture.lanes() {
            let [scans, overruns, _, max, ..] = lane.figures[..] else { continue };
            let max = format_duration(max / 1000 * 1000);
            parts.push(format!("{} {} {scans} scans, {overruns} overruns, max {max}", lane.name, lane.state.name()));
        }
        let values: Vec<_> = self
            .picture
            .values()
            .take(VALUES)
            .map(|v| format!("{}={}{}", v.tag, v.value, if v.quality == Quality::Bad { " (bad)" } else { "" }))
            .collect();
        parts.push(values.join(" "));
        parts.push(alarms(self.picture.alarms()));
        let new: Vec<_> = history.recent.iter().filter(|r| r.seq > self.last_seq).collect();
        self.last_seq = history.recent.back().map_or(self.last_seq, |r| r.seq);
        let told: Vec<_> = new.iter().rev().take(3).rev().map(|r| format!("{} {}", r.source, r.transition)).collect();
        if !told.is_empty() {
            let more = if new.len() > told.len() { format!(" (+{})", new.len() - told.len()) } else { String::new() };
            parts.push(format!("records: {}{more}", told.join(", ")));
        }
        parts.join(" | ")
    }
}

/// What is on: the first by name, the rest by number.
fn alarms<'a>(mut on: impl Iterator<Item = &'a str>) -> String {
    let named: Vec<_> = on.by_ref().take(ALARMS).collect();
    match (named.is_empty(), on.count()) {
        (true, _) => "no alarms".into(),
        (_, 0) => format!("ALARMS {}", named.join(" ")),
        (_, more) => format!("ALARMS {} … and {more} more", named.join(" ")),
    }
}

impl Show for Lines {
    fn tick(&mut self, now: u64, history: &History) {
        if now < self.next {
            return;
        }
        self.next = (now / PERIOD + 1) * PERIOD;
        let line = self.line(now, history);
        // A closed pipe must not stop a plant.
        let _ = writeln!(std::io::stdout(), "{line}");
    }

    fn end(&mut self, _: u64, _: &History) {}
}

#[cfg(test)]
mod tests {
    use super::alarms;

    #[test]
    fn a_flood_of_alarms_makes_no_longer_line() {
        let names: Vec<String> = (0..5000).map(|n| format!("a{n}")).collect();
        let line = |count: usize| alarms(names[..count].iter().map(String::as_str));
        assert_eq!(line(0), "no alarms");
        assert_eq!(line(10), "ALARMS a0 a1 a2 a3 a4 a5 a6 a7 a8 a9");
        assert_eq!(line(5000), "ALARMS a0 a1 a2 a3 a4 a5 a6 a7 a8 a9 … and 4990 more");
    }
}
