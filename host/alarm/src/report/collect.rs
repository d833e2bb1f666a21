//! Events in, report out.

use super::flood::Floods;
use super::life::{Life, Meaning};
use super::{
    Acknowledged, Bin, Chattering, FREQUENT, Fleeting, Frequent, JUMP_AHEAD, JUMP_BACK, Rank, Report, Stale, Standing,
    TEN_MINUTES,
};
use crate::State;
use hdrhistogram::Histogram;
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};

/// One transition of an alarm, as a journal tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event<'a> {
    /// When, ns since 1970.
    pub time: u64,
    /// Name of the alarm.
    pub alarm: &'a str,
    /// What happened, in one word.
    pub transition: &'a str,
    /// State after it; none in journals that know only raised and returned.
    pub state: Option<State>,
    /// Priority, 0 to 255.
    pub priority: u8,
}

/// Milliseconds: fine enough for people, and small enough for the histogram.
const MS: u64 = 1_000_000;

/// Takes events one after another.
#[derive(Debug)]
pub struct Collector {
    from: Option<u64>,
    /// The first and the last moment that was heard of since the last jump of the clock, ns.
    heard: Option<(u64, u64)>,
    /// The moment that was heard of last, ns.
    before: Option<u64>,
    numbers: HashMap<Box<str>, usize>,
    lives: Vec<Life>,
    floods: Floods,
    /// Ten-minute periods by their number, and the one that is being counted.
    bins: BTreeMap<u64, [u32; 4]>,
    current: (u64, [u32; 4]),
    by_priority: Box<[u64; 256]>,
    /// Times to acknowledge, ms, with their sum and the longest, ns.
    waits: Histogram<u64>,
    waited: (u128, u64),
    unknown: u64,
    set_back: u64,
    jumps: u64,
    lost: u64,
}

impl Collector {
    /// A collector for what happens from a time on, ns since 1970; without one, from the first event after the last jump of
    /// the clock, if it jumped.
    ///
    /// Earlier events are welcome: they tell how the alarms stand when the period begins.
    pub fn new(from: Option<u64>) -> Self {
        // A constant that the crate takes.
        let waits = Histogram::new(3).expect("three digits are between 0 and 5");
        Self {
            from,
            heard: None,
            before: None,
            numbers: HashMap::new(),
            lives: Vec::new(),
            floods: Floods::default(),
            bins: BTreeMap::new(),
            current: (0, [0; 4]),
            by_priority: Box::new([0; 256]),
            waits,
            waited: (0, 0),
            unknown: 0,
            set_back: 0,
            jumps: 0,
            lost: 0,
        }
    }

    /// Something else happened in the plant: it was there, so the period reaches from the first to the last of these, ns.
    pub fn moment(&mut self, time: u64) {
        let before = self.before.replace(time).unwrap_or(time);
        let (back, ahead) = (before.saturating_sub(time), time.saturating_sub(before));
        let within = self.within(time) || self.within(before);
        self.set_back += u64::from(within && back > TEN_MINUTES);
        if back > JUMP_BACK || ahead > JUMP_AHEAD {
            self.jumps += u64::from(within);
            self.jump(time);
        }
        let (first, last) = self.heard.unwrap_or((time, time));
        self.heard = Some((first.min(time), last.max(time)));
    }

    /// So many records are missing from the journal, as one that has this time says, ns.
    pub fn missing(&mut self, time: u64, count: u64) {
        self.moment(time);
        if self.within(time) {
            self.lost = self.lost.saturating_add(count);
        }
    }

    fn within(&self, time: u64) -> bool {
        self.from.is_none_or(|from| time >= from)
    }

    /// The clock jumped: times before and after it cannot be compared. A period that was not asked for begins after it.
    fn jump(&mut self, time: u64) {
        self.heard = None;
        let anew = self.from.is_none();
        self.lives.iter_mut().for_each(|life| life.jump(time, anew));
        if anew {
            self.floods = Floods::default();
            self.bins.clear();
            self.current = (0, [0; 4]);
            self.by_priority.fill(0);
            self.waits.reset();
            self.waited = (0, 0);
            (self.unknown, self.set_back, self.lost) = (0, 0, 0);
        }
    }

    /// An event, in the order of the journal.
    pub fn take(&mut self, event: &Event<'_>) {
        self.moment(event.time);
        let within = self.within(event.time);
        let number = match self.numbers.get(event.alarm) {
            Some(number) => *number,
            None => {
                self.numbers.insert(event.alarm.into(), self.lives.len());
                self.lives.push(Life::default());
                self.lives.len() - 1
            }
        };
        match self.lives[number].take(event, within) {
            Meaning::Raised if within => self.raised(event),
            Meaning::Acknowledged(Some(wait)) if within => {
                // It grows with what it gets; nothing that a u64 holds is too much for it.
                let _ = self.waits.record(wait / MS);
                self.waited = (self.waited.0 + u128::from(wait), self.waited.1.max(wait));
            }
            Meaning::Unknown if within => self.unknown += 1,
            _ => {}
        }
    }

    fn raised(&mut self, event: &Event<'_>) {
        let number = event.time / TEN_MINUTES;
        if number != self.current.0 {
            self.count_bin();
            self.current.0 = number;
        }
        self.current.1[Rank::of(event.priority) as usize] += 1;
        self.by_priority[usize::from(event.priority)] += 1;
        self.floods.raise(event.time);
    }

    /// The current period joins the others; it may have been counted before, since lanes are a little out of order.
    fn count_bin(&mut self) {
        let (number, raised) = (self.current.0, std::mem::take(&mut self.current.1));
        if raised != [0; 4] {
            let bin = self.bins.entry(number).or_default();
            bin.iter_mut().zip(raised).for_each(|(sum, n)| *sum += n);
        }
    }

    /// The report, until a time, ns since 1970; without one, until the last event.
    pub fn finish(mut self, to: Option<u64>) -> Report {
        self.count_bin();
        let (first, last) = self.heard.unwrap_or((0, 0));
        let from = self.from.unwrap_or(first);
        let to = to.unwrap_or(last).max(from);
        self.floods.finish(to);
        // A wrong time far ahead shall not make the period longer.
        let bins = self.bins.range(..=to / TEN_MINUTES);
        let bins = bins.map(|(n, raised)| Bin { start: n * TEN_MINUTES, raised: *raised }).collect();
        let acknowledged = (!self.waits.is_empty()).then(|| self.acknowledged());
        let mut report = Report {
            from,
            to,
            raised: self.by_priority.iter().sum(),
            different: self.lives.iter().filter(|l| l.raised > 0).count(),
            by_priority: self.by_priority,
            bins,
            floods: self.floods.found,
            frequent: Vec::new(),
            chattering: Vec::new(),
            fleeting: Vec::new(),
            stale: Vec::new(),
            now: Vec::new(),
            acknowledged,
            unknown: self.unknown,
            set_back: self.set_back,
            jumps: self.jumps,
            lost: self.lost,
        };
        let mut lives: Vec<_> =
            self.numbers.into_iter().map(|(name, n)| (name, std::mem::take(&mut self.lives[n]))).collect();
        lives.sort_unstable_by(|a, b| a.0.cmp(&b.0));
        for (name, life) in lives {
            tell(&mut report, name, life);
        }
        // By name already: a stable sort leaves equals so.
        report.frequent.sort_by_key(|f| Reverse(f.raised));
        report.frequent.truncate(FREQUENT);
        report.chattering.sort_by_key(|c| Reverse(c.raised));
        report.fleeting.sort_by_key(|f| Reverse(f.count));
        report.stale.sort_by_key(|s| Reverse(s.lasted));
        report.now.sort_by_key(|s| (Reverse(s.priority), s.since));
        report
    }

    fn acknowledged(&self) -> Acknowledged {
        let count = self.waits.len();
        let longest = self.waited.1;
        // The histogram tells the upper end of a bucket.
        let quantile = |q| (self.waits.value_at_quantile(q) * MS).min(longest);
        let mean = u64::try_from(self.waited.0 / u128::from(count)).unwrap_or(u64::MAX);
        Acknowledged { count, mean, p50: quantile(0.5), p95: quantile(0.95), longest }
    }
}

/// What one alarm adds to the lists.
fn tell(report: &mut Report, name: Box<str>, mut life: Life) {
    let standing = life.finish(report.to);
    if let Some((since, lasted)) = life.stale {
        // The longest time may be an earlier one than that which stands.
        report.stale.push(Stale { alarm: name.clone(), since, lasted, standing });
    }
    if let Some(fastest) = life.chatter.fastest {
        let (raised, runs) = (life.chatter.raised, life.chatter.runs);
        report.chattering.push(Chattering { alarm: name.clone(), raised, runs, fastest });
    }
    if let Some((count, shortest)) = life.fleeting {
        report.fleeting.push(Fleeting { alarm: name.clone(), count, shortest });
    }
    if life.state != State::Normal {
        let (state, since, priority) = (life.state, life.since(), life.priority);
        report.now.push(Standing { alarm: name.clone(), state, since, priority });
    }
    if life.raised > 0 {
        report.frequent.push(Frequent { alarm: name, raised: life.raised });
    }
}
