//! The figures by name, each beside what the standard recommends.

use super::{BUSY_HOUR, DAY, FLOOD_BEGINS, HOUR, Rank, Report, SECOND, TEN_MINUTES};
use crate::State;

/// What a figure is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Things.
    Count,
    /// Of a hundred.
    Percent,
    /// Seconds.
    Seconds,
}

/// What the standard recommends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most so much; up to the second one an operator can still manage.
    AtMost(f64, f64),
    /// At least so much.
    AtLeast(f64),
}

/// How a figure stands beside its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As recommended.
    Met,
    /// More than recommended, but manageable.
    Manageable,
    /// Neither.
    Missed,
}

impl Limit {
    /// How a value stands beside it.
    pub fn judge(self, value: f64) -> Verdict {
        match self {
            Self::AtMost(good, _) if value <= good => Verdict::Met,
            Self::AtMost(_, most) if value <= most => Verdict::Manageable,
            Self::AtLeast(good) if value >= good => Verdict::Met,
            _ => Verdict::Missed,
        }
    }
}

impl Verdict {
    /// The word in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Manageable => "manageable",
            Self::Missed => "missed",
        }
    }
}

/// One figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Its name for programs.
    pub id: &'static str,
    /// Its name for people.
    pub name: &'static str,
    /// Its value; none where there is nothing to count, as a rate over a period without length.
    pub value: Option<f64>,
    /// What it is counted in.
    pub unit: Unit,
    /// What the standard recommends, if it does.
    pub limit: Option<Limit>,
}

impl Figure {
    /// How it stands, where there is a value and a limit.
    pub fn verdict(&self) -> Option<Verdict> {
        Some(self.limit?.judge(self.value?))
    }

    /// What is recommended, for a person.
    pub fn recommended(&self) -> Option<String> {
        let unit = if self.unit == Unit::Percent { " %" } else { "" };
        Some(match self.limit? {
            Limit::AtMost(0.0, _) => "none".into(),
            Limit::AtMost(good, most) if good == most => format!("at most {good}{unit}"),
            Limit::AtMost(good, most) => format!("at most {good}{unit}, manageable up to {most}{unit}"),
            Limit::AtLeast(good) => format!("at least {good}{unit}"),
        })
    }
}

impl Report {
    /// All figures, in the order of the standard.
    pub fn figures(&self) -> Vec<Figure> {
        let most = |good, most| Some(Limit::AtMost(good, most));
        let [low, medium, high, urgent] = self.by_rank().map(|n| percent(n as f64, self.raised as f64));
        let peak = self.peak().map_or(0, |b| b.total());
        let (over, busy) = (self.periods_in_flood(), self.busy_hours());
        let flooded: u64 = self.floods.iter().map(|f| f.end - f.start).sum();
        let frequent: u64 = self.frequent.iter().map(|f| f.raised).sum();
        let stale = self.stale.iter().filter(|s| s.standing).count();
        let count = |id, name, value: usize, limit| figure(id, name, Unit::Count, Some(value as f64), limit);
        let share = |id, name, value, limit| figure(id, name, Unit::Percent, value, limit);
        let state = |id, name, state| count(id, name, self.standing(state), None);
        let rank = |rank: Rank| most(rank.recommended(), rank.recommended());
        let mut figures = vec![
            figure("raised", "alarms raised", Unit::Count, Some(self.raised as f64), None),
            count("different", "different alarms raised", self.different, None),
            figure("per-10-minutes", "average per 10 minutes", Unit::Count, self.rate(TEN_MINUTES), most(1.0, 2.0)),
            figure("per-hour", "average per hour", Unit::Count, self.rate(HOUR), most(6.0, 12.0)),
            figure("per-day", "average per day", Unit::Count, self.rate(DAY), most(150.0, 300.0)),
            figure("peak", "most in 10 minutes", Unit::Count, Some(peak as f64), most(10.0, 10.0)),
            share(
                "busy-hours",
                "hours with more than 30",
                percent(busy as f64, self.touched(HOUR) as f64),
                most(1.0, 1.0),
            ),
            share(
                "periods-in-flood",
                "10-minute periods with more than 10",
                percent(over as f64, self.periods() as f64),
                most(1.0, 1.0),
            ),
            count("floods", "floods", self.floods.len(), None),
            share("time-in-flood", "time in flood", percent(flooded as f64, self.length() as f64), most(1.0, 1.0)),
            share("low", "of low priority (0 to 99)", low, Some(Limit::AtLeast(Rank::Low.recommended()))),
            share("medium", "of medium priority (100 to 159)", medium, rank(Rank::Medium)),
            share("high", "of high priority (160 to 223)", high, rank(Rank::High)),
            share("urgent", "of urgent priority (224 to 255)", urgent, rank(Rank::Urgent)),
            share(
                "most-frequent",
                "the 10 most frequent of all",
                percent(frequent as f64, self.raised as f64),
                most(1.0, 5.0),
            ),
            count("chattering", "chattering alarms", self.chattering.len(), most(0.0, 0.0)),
            count("fleeting", "fleeting alarms", self.fleeting.len(), most(0.0, 0.0)),
            count("stale", "stale alarms at the end", stale, most(4.0, 4.0)),
            state("unacknowledged", "active, unacknowledged at the end", State::Unacknowledged),
            state("active", "active, nothing to acknowledge at the end", State::Active),
            state("returned", "returned, unacknowledged at the end", State::Returned),
            state("awaiting-reset", "returned, not reset at the end", State::AwaitingReset),
            state("shelved", "shelved at the end", State::Shelved),
            state("suppressed", "suppressed by design at the end", State::Suppressed),
            state("out-of-service", "out of service at the end", State::OutOfService),
        ];
        let acknowledged = self.acknowledged.as_ref();
        figures.push(count("acknowledged", "acknowledgements", acknowledged.map_or(0, |a| a.count as usize), None));
        let seconds = |ns: u64| ns as f64 / SECOND as f64;
        for (id, name, of) in [
            ("acknowledge-mean", "time to acknowledge, mean", acknowledged.map(|a| a.mean)),
            ("acknowledge-p50", "time to acknowledge, half of them within", acknowledged.map(|a| a.p50)),
            ("acknowledge-p95", "time to acknowledge, 95 % of them within", acknowledged.map(|a| a.p95)),
            ("acknowledge-longest", "time to acknowledge, longest", acknowledged.map(|a| a.longest)),
        ] {
            figures.push(figure(id, name, Unit::Seconds, of.map(seconds), None));
        }
        figures
    }

    /// Alarms per so many ns on average.
    fn rate(&self, per: u64) -> Option<f64> {
        (self.length() > 0).then(|| self.raised as f64 * per as f64 / self.length() as f64)
    }

    fn periods_in_flood(&self) -> usize {
        self.bins.iter().filter(|b| b.total() > FLOOD_BEGINS as u64).count()
    }

    fn busy_hours(&self) -> usize {
        let same_hour = |a: &super::Bin, b: &super::Bin| a.start / HOUR == b.start / HOUR;
        let sum = |bins: &[super::Bin]| bins.iter().map(super::Bin::total).sum::<u64>();
        self.bins.chunk_by(same_hour).filter(|hour| sum(hour) > BUSY_HOUR).count()
    }
}

fn figure(id: &'static str, name: &'static str, unit: Unit, value: Option<f64>, limit: Option<Limit>) -> Figure {
    Figure { id, name, value, unit, limit }
}

fn percent(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| 100.0 * part / whole)
}
