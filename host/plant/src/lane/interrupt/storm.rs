//! Storms: one line that makes more edges than its limit for longer than a tenth of a second.

/// For how long a line may exceed its limit, ns.
const BURST: u64 = 100_000_000;

/// The measure of one line: a leaky bucket of edges, as time. Every edge adds the time it may take at the limit, time
/// that passes takes it away.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bucket {
    /// Time one edge may take, ns.
    cost: u64,
    level: u64,
    at: u64,
}

impl Bucket {
    /// For so many edges a second.
    pub(super) fn new(limit: u64) -> Self {
        Self { cost: 1_000_000_000 / limit.max(1), level: 0, at: 0 }
    }

    fn settle(&mut self, time: u64) {
        if time > self.at {
            self.level = self.level.saturating_sub(time - self.at);
            self.at = time;
        }
    }

    /// Counts so many edges, the last of them at `time`; false when the line is beyond its limit.
    #[inline]
    pub(super) fn take(&mut self, time: u64, edges: u64) -> bool {
        self.settle(time);
        self.level = self.level.saturating_add(self.cost.saturating_mul(edges));
        if self.level <= BURST {
            return true;
        }
        self.level = BURST;
        false
    }

    /// When the line has calmed down, unless more edges come: at half of what begins a storm.
    pub(super) fn calm_at(&self) -> u64 {
        self.at.saturating_add(self.level.saturating_sub(BURST / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// Edges that are let through of `n` at a steady rate.
    fn passed(limit: u64, rate: u64, n: u64) -> u64 {
        let mut bucket = Bucket::new(limit);
        (0..n).filter(|i| bucket.take(SECOND + i * SECOND / rate, 1)).count() as u64
    }

    #[test]
    fn a_line_within_its_limit_is_never_a_storm() {
        assert_eq!(passed(1000, 999, 10_000), 10_000);
        assert_eq!(passed(1000, 1000, 10_000), 10_000);
    }

    #[test]
    fn a_burst_of_a_tenth_of_a_second_passes() {
        // Contacts bounce: 100 edges at once, with 1000 a second allowed.
        assert_eq!(passed(1000, 1_000_000, 100), 100);
        assert_eq!(passed(1000, 1_000_000, 150), 100);
    }

    #[test]
    fn edges_that_were_lost_before_they_could_be_read_count() {
        let mut bucket = Bucket::new(1000);
        assert!(bucket.take(SECOND, 60));
        assert!(!bucket.take(SECOND, 60));
        assert!(!Bucket::new(1000).take(SECOND, u64::MAX));
    }

    #[test]
    fn a_line_is_calm_at_half_of_what_begins_a_storm() {
        let mut bucket = Bucket::new(1000);
        while bucket.take(SECOND, 1) {}
        assert_eq!(bucket.calm_at(), SECOND + 50_000_000);
        // Edges at half of the limit still let it calm down, those at the limit do not.
        let calms = |rate: u64| {
            let mut b = bucket;
            (1..=rate).any(|i| {
                let now = SECOND + i * SECOND / rate;
                let calm = b.calm_at() <= now;
                b.take(now, 1);
                calm
            })
        };
        assert!(calms(500));
        assert!(!calms(1000));
        assert!(!calms(5000));
    }
}
