//! Pauses between tries to open what is closed: 1 s, 2 s, 4 s, … while they fail in the same way.
//!
//! A try costs system calls in the thread of a lane, and what was away for a minute is seldom back in the next second.

/// Longest pause, s.
const LONGEST: u32 = 30;

/// The pauses of one part of a driver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Backoff {
    pause: u32,
    /// Seconds of it that are left.
    left: u32,
}

impl Backoff {
    /// The next try is due at once.
    pub(crate) fn new() -> Self {
        Self { pause: 1, left: 0 }
    }

    /// True when a try is due; so many seconds have passed since the last call.
    pub(crate) fn due(&mut self, seconds: u32) -> bool {
        self.left = self.left.saturating_sub(seconds);
        self.left == 0
    }

    /// A try has failed; with `news` in another way than the one before.
    pub(crate) fn failed(&mut self, news: bool) {
        self.pause = if news { 1 } else { (2 * self.pause).min(LONGEST) };
        self.left = self.pause;
    }
}

#[cfg(test)]
mod tests {
    use super::Backoff;

    /// Seconds at which tries are made.
    fn tries(news: &[u32]) -> Vec<u32> {
        let mut backoff = Backoff::new();
        let mut made = Vec::new();
        for second in 0..130 {
            if backoff.due(1) {
                made.push(second);
                backoff.failed(news.contains(&second));
            }
        }
        made
    }

    #[test]
    fn pauses_grow_until_something_else_is_wrong() {
        assert_eq!(tries(&[0]), [0, 1, 3, 7, 15, 31, 61, 91, 121]);
        assert_eq!(tries(&[0, 15]), [0, 1, 3, 7, 15, 16, 18, 22, 30, 46, 76, 106]);
    }

    #[test]
    fn a_slow_cycle_waits_no_longer() {
        let mut backoff = Backoff::new();
        for _ in 0..10 {
            assert!(backoff.due(60));
            backoff.failed(false);
        }
    }
}
