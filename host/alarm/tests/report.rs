//! The figures of ISA-18.2 over histories made by hand: each row names a figure, its history and what it must come to.

use latchwork_alarm::State;
use latchwork_alarm::report::{Collector, DAY, Event, HOUR, Report, SECOND, TEN_MINUTES, Unit, Verdict};

const S: u64 = SECOND;
const M: u64 = 60 * SECOND;

/// An alarm, its transition, the state after it, when.
type Row<'a> = (&'a str, &'a str, &'a str, u64);

fn report(history: &[Row<'_>], from: Option<u64>, to: Option<u64>) -> Report {
    let mut collector = Collector::new(from);
    for (alarm, transition, after, time) in history {
        // The first letter tells the priority: u(rgent), c(ritical) is high, w(arning) medium, anything else low.
        let priority = match alarm.as_bytes()[0] {
            b'u' => 240,
            b'c' => 192,
            b'w' => 150,
            _ => 40,
        };
        collector.take(&Event { time: *time, alarm, transition, state: State::from_name(after), priority });
    }
    collector.finish(to)
}

/// An alarm that is raised at each of these times, and returns after two seconds.
fn raises(alarm: &str, times: impl IntoIterator<Item = u64>) -> Vec<Row<'_>> {
    times.into_iter().flat_map(|t| [(alarm, "raised", "active", t), (alarm, "returned", "normal", t + 2 * S)]).collect()
}

fn sorted<'a>(parts: impl IntoIterator<Item = Vec<Row<'a>>>) -> Vec<Row<'a>> {
    let mut all: Vec<_> = parts.into_iter().flatten().collect();
    all.sort_by_key(|r| r.3);
    all
}

/// A history, the end of its period that begins at 0, the figure, its value and how that stands beside the limit.
type Case<'a> = (&'a str, Vec<Row<'a>>, u64, &'a str, Option<f64>, Option<Verdict>);

#[test]
fn the_figures_of_the_standard() {
    use Verdict::{Manageable, Met, Missed};
    let every = |minutes: u64, n: u64| raises("a", (0..n).map(|i| i * minutes * M));
    let burst = |start: u64, n: u64| (0..n).map(move |i| start + i * S);
    let waits = [("a", 10 * S), ("b", 20 * S), ("c", 90 * S)];
    let acknowledged =
        || {
            sorted(waits.map(|(name, wait)| {
                vec![(name, "raised", "unacknowledged", 0), (name, "acknowledged", "active", wait)]
            }))
        };
    let kept = |transition: &'static str, after: &'static str| {
        vec![("a", "raised", "active", 0), ("a", transition, after, M), ("b", "raised", "active", M)]
    };
    #[rustfmt::skip]
    let cases: Vec<Case<'_>> = vec![
        ("an alarm every 10 minutes is what an operator can deal with", every(10, 144), DAY, "per-10-minutes", Some(1.0), Some(Met)),
        ("6 an hour", every(10, 144), DAY, "per-hour", Some(6.0), Some(Met)),
        ("144 a day", every(10, 144), DAY, "per-day", Some(144.0), Some(Met)),
        ("one every 5 minutes is at the edge", every(5, 288), DAY, "per-10-minutes", Some(2.0), Some(Manageable)),
        ("288 a day are manageable", every(5, 288), DAY, "per-day", Some(288.0), Some(Manageable)),
        ("one every 4 minutes is too many", every(4, 360), DAY, "per-hour", Some(15.0), Some(Missed)),
        ("ten in ten minutes are a peak just right", raises("a", burst(0, 10)), HOUR, "peak", Some(10.0), Some(Met)),
        ("eleven are too many", raises("a", burst(0, 11)), HOUR, "peak", Some(11.0), Some(Missed)),
        ("one of six periods has more than ten", raises("a", burst(M, 11)), HOUR, "periods-in-flood", Some(100.0 / 6.0), Some(Missed)),
        ("30 in an hour are not too many", raises("a", burst(0, 30)), 10 * HOUR, "busy-hours", Some(0.0), Some(Met)),
        ("31 are", raises("a", burst(0, 31)), 10 * HOUR, "busy-hours", Some(10.0), Some(Missed)),
        ("eleven in ten minutes across the clock's periods are a flood", raises("a", burst(TEN_MINUTES - 5 * S, 11)), HOUR, "floods", Some(1.0), None),
        ("ten are none", raises("a", burst(TEN_MINUTES - 5 * S, 10)), HOUR, "floods", Some(0.0), None),
        // The fifth of the eleven from the end comes after 6 s: ten minutes later there are only four.
        ("it lasts until fewer than five are in ten minutes", raises("a", burst(0, 11)), HOUR, "time-in-flood", Some(100.0 * 606.0 / 3600.0), Some(Missed)),
        ("80 of 100 are low", sorted([raises("a", burst(0, 80)), raises("w", burst(0, 15)), raises("c", burst(0, 5))]), DAY, "low", Some(80.0), Some(Met)),
        ("15 medium", sorted([raises("a", burst(0, 80)), raises("w", burst(0, 15)), raises("c", burst(0, 5))]), DAY, "medium", Some(15.0), Some(Met)),
        ("5 high", sorted([raises("a", burst(0, 80)), raises("w", burst(0, 15)), raises("c", burst(0, 5))]), DAY, "high", Some(5.0), Some(Met)),
        ("6 high are too many", sorted([raises("a", burst(0, 94)), raises("c", burst(0, 6))]), DAY, "high", Some(6.0), Some(Missed)),
        ("1 urgent", sorted([raises("a", burst(0, 99)), raises("u", burst(0, 1))]), DAY, "urgent", Some(1.0), Some(Met)),
        ("2 are too many", sorted([raises("a", burst(0, 98)), raises("u", burst(0, 2))]), DAY, "urgent", Some(2.0), Some(Missed)),
        ("one alarm is all of the most frequent", raises("a", burst(0, 3)), DAY, "most-frequent", Some(100.0), Some(Missed)),
        ("three times within a minute is chattering", raises("a", [0, 30 * S, 60 * S]), HOUR, "chattering", Some(1.0), Some(Missed)),
        ("a nanosecond later it is not", raises("a", [0, 30 * S, 60 * S + 1]), HOUR, "chattering", Some(0.0), Some(Met)),
        ("three alarms once each do not chatter", sorted([raises("a", [0]), raises("b", [1]), raises("d", [2])]), HOUR, "chattering", Some(0.0), Some(Met)),
        ("gone within a second is fleeting", vec![("a", "raised", "active", 0), ("a", "returned", "normal", S)], HOUR, "fleeting", Some(1.0), Some(Missed)),
        ("gone later is not", vec![("a", "raised", "active", 0), ("a", "returned", "normal", S + 1)], HOUR, "fleeting", Some(0.0), Some(Met)),
        ("longer than a day is stale", vec![("a", "raised", "active", 0)], DAY + 1, "stale", Some(1.0), Some(Met)),
        ("a day is not", vec![("a", "raised", "active", 0)], DAY, "stale", Some(0.0), Some(Met)),
        ("shelved is not stale", vec![("a", "raised", "active", 0), ("a", "shelved", "shelved", S)], 2 * DAY, "stale", Some(0.0), Some(Met)),
        ("five stale ones are too many", sorted(["a", "b", "d", "e", "f"].map(|a| vec![(a, "raised", "active", 0)])), 2 * DAY, "stale", Some(5.0), Some(Missed)),
        ("standing", kept("acknowledged", "active"), HOUR, "active", Some(2.0), None),
        ("waiting for the operator", vec![("a", "raised", "unacknowledged", 0)], HOUR, "unacknowledged", Some(1.0), None),
        ("gone before anybody looked", vec![("a", "raised", "unacknowledged", 0), ("a", "returned", "returned", M)], HOUR, "returned", Some(1.0), None),
        ("gone and not reset", vec![("a", "raised", "active", 0), ("a", "returned", "awaiting-reset", M)], HOUR, "awaiting-reset", Some(1.0), None),
        ("shelved now", kept("shelved", "shelved"), HOUR, "shelved", Some(1.0), None),
        ("suppressed now", kept("suppressed", "suppressed"), HOUR, "suppressed", Some(1.0), None),
        ("out of service now", kept("out-of-service", "out-of-service"), HOUR, "out-of-service", Some(1.0), None),
        ("a shelf that is over is none", [kept("shelved", "shelved"), vec![("a", "shelf-over", "normal", 2 * M)]].concat(), HOUR, "shelved", Some(0.0), None),
        ("three were acknowledged", acknowledged(), HOUR, "acknowledged", Some(3.0), None),
        ("after 40 s on average", acknowledged(), HOUR, "acknowledge-mean", Some(40.0), None),
        ("half of them within 20 s", acknowledged(), HOUR, "acknowledge-p50", Some(20.0), None),
        ("the longest took 90 s", acknowledged(), HOUR, "acknowledge-longest", Some(90.0), None),
        ("nobody acknowledged anything", raises("a", [0]), HOUR, "acknowledge-mean", None, None),
        ("no alarms have no shares", vec![], HOUR, "low", None, None),
        ("no alarms are fine", vec![], HOUR, "per-day", Some(0.0), Some(Met)),
        ("a period without length has no rate", vec![], 0, "per-day", None, None),
    ];
    for (what, history, to, id, value, verdict) in cases {
        let report = report(&history, Some(0), Some(to));
        let figures = report.figures();
        let figure = figures.iter().find(|f| f.id == id).unwrap_or_else(|| panic!("{what}: there is no figure {id}"));
        // Times to acknowledge are right to a thousandth.
        let near = |a: f64, b: f64| (a - b).abs() <= if figure.unit == Unit::Seconds { b / 1000.0 } else { 1e-9 };
        let same = match (figure.value, value) {
            (Some(a), Some(b)) => near(a, b),
            (a, b) => a == b,
        };
        assert!(same, "{what}: {id} is {:?}, expected {value:?}", figure.value);
        assert_eq!(figure.verdict(), verdict, "{what}: {id}");
    }
}

#[test]
fn floods_with_their_times_and_alarms() {
    // Eleven, a pause in which the rate falls, eleven again; and a flood that is not over.
    let history = sorted([
        raises("a", (0..12).map(|i| i * 10 * S)),
        raises("b", (0..11).map(|i| HOUR + i * S)),
        raises("d", (0..20).map(|i| 2 * HOUR + i * S)),
    ]);
    let floods = report(&history, Some(0), Some(2 * HOUR + 5 * M)).floods;
    let found: Vec<_> = floods.iter().map(|f| (f.start, f.end, f.count, f.open)).collect();
    assert_eq!(
        found,
        [
            (0, 70 * S + TEN_MINUTES, 12, false),
            (HOUR, HOUR + 6 * S + TEN_MINUTES, 11, false),
            (2 * HOUR, 2 * HOUR + 5 * M, 20, true)
        ]
    );
}

#[test]
fn chattering_and_fleeting_and_stale_alarms_by_name() {
    let history = sorted([
        raises("a", [0, 20 * S, 40 * S, 50 * S, HOUR, HOUR + 10 * S, HOUR + 15 * S]),
        raises("b", [0, M, 2 * M]),
        vec![("f", "raised", "active", M), ("f", "returned", "normal", M + S / 4)],
        vec![("s", "raised", "active", 0), ("s", "returned", "normal", 30 * HOUR)],
        vec![("t", "raised", "active", HOUR)],
    ]);
    let report = report(&history, Some(0), Some(40 * HOUR));
    let [chattering] = report.chattering.as_slice() else { panic!("{:?}", report.chattering) };
    assert_eq!((&*chattering.alarm, chattering.raised, chattering.runs, chattering.fastest), ("a", 7, 2, 15 * S));
    let [fleeting] = report.fleeting.as_slice() else { panic!("{:?}", report.fleeting) };
    assert_eq!((&*fleeting.alarm, fleeting.count, fleeting.shortest), ("f", 1, S / 4));
    let stale: Vec<_> = report.stale.iter().map(|s| (&*s.alarm, s.since, s.lasted, s.standing)).collect();
    assert_eq!(stale, [("t", HOUR, 39 * HOUR, true), ("s", 0, 30 * HOUR, false)]);
    let now: Vec<_> = report.now.iter().map(|s| (&*s.alarm, s.state, s.since)).collect();
    assert_eq!(now, [("t", State::Active, HOUR)]);
}

#[test]
fn what_was_before_the_period_is_known_but_not_counted() {
    let history = [
        ("a", "raised", "unacknowledged", 0),
        ("a", "acknowledged", "active", DAY + HOUR),
        ("b", "raised", "active", 0),
        ("b", "returned", "normal", S / 2),
    ];
    let report = report(&history, Some(DAY), Some(2 * DAY));
    assert_eq!((report.raised, report.different, report.bins.len(), report.fleeting.len()), (0, 0, 0, 0));
    assert_eq!(report.acknowledged.map(|a| a.longest), Some(DAY + HOUR));
    assert_eq!((report.stale.len(), report.now.len()), (1, 1), "a stands since long before");
}

#[test]
fn a_journal_that_knows_only_raised_and_returned() {
    let history = [("a", "raised", "", 0), ("b", "raised", "", S), ("a", "returned", "", 5 * S)];
    let report = report(&history, None, None);
    assert_eq!((report.from, report.to, report.raised), (0, 5 * S, 2));
    assert_eq!(report.now.iter().map(|s| (&*s.alarm, s.state)).collect::<Vec<_>>(), [("b", State::Active)]);
}

#[test]
fn an_occurrence_that_ended_behind_a_mask_is_over() {
    let history = [
        ("a", "raised", "active", 0),
        ("a", "shelved", "shelved", S),
        ("a", "returned", "shelved", 2 * S),
        ("a", "shelf-over", "normal", 3 * S),
        // Shelved while its off-delay ran: nothing says that it returned but the state after the shelf.
        ("b", "raised", "active", 0),
        ("b", "shelved", "shelved", S),
        ("b", "unshelved", "normal", 2 * S),
    ];
    let report = report(&history, Some(0), Some(3 * DAY));
    assert!(report.now.is_empty() && report.stale.is_empty(), "{report:?}");
}

#[test]
fn a_clock_that_is_set_back_makes_no_flood_and_is_told() {
    let history = sorted([raises("a", (0..8).map(|i| DAY + i * S))]);
    let again: Vec<_> = raises("a", (0..8).map(|i| DAY - HOUR + i * S));
    let report = report(&[history, again].concat(), None, None);
    assert_eq!((report.floods.len(), report.set_back, report.raised), (0, 1, 16));
}

#[test]
fn a_wrong_time_does_not_make_the_period_longer() {
    let days = |n: u64| 20_000 * DAY + n * DAY;
    let busy = |from: u64| raises("a", (0..100).map(move |i| from + i * 2 * M));
    let wrong = |time: u64| vec![("w", "raised", "unacknowledged", time)];
    let right = busy(days(1));
    let alone = report(&right, None, None);
    for (what, history, raised) in [
        ("a start without a time", [wrong(5), busy(days(1))].concat(), 100),
        ("a start without a time in between", [busy(days(0)), wrong(5), busy(days(1))].concat(), 100),
        ("a clock far ahead", [wrong(days(9_000)), busy(days(1))].concat(), 100),
        ("two days ahead", [wrong(days(3)), busy(days(1))].concat(), 100),
        ("silent for a month", [busy(days(0)), busy(days(30))].concat(), 200),
    ] {
        let found = report(&history, None, None);
        assert_eq!(found.raised, raised, "{what}");
        if raised == 100 {
            assert_eq!((found.from, found.to, found.bins), (alone.from, alone.to, alone.bins.clone()), "{what}");
            assert!(found.jumps > 0, "{what}");
            // What stands since a wrong time stands since the clock was right, as far as anybody knows.
            assert_eq!(found.now.iter().map(|s| (&*s.alarm, s.since)).collect::<Vec<_>>(), [("w", days(1))], "{what}");
            assert!(found.stale.is_empty(), "{what}");
        } else {
            assert_eq!(found.jumps, 0, "{what}");
        }
    }
    // With a beginning that was asked for, the period ends where the clock is right as well.
    let history = [busy(days(0)), wrong(days(9_000)), vec![("w", "acknowledged", "active", days(1))], right].concat();
    let found = report(&history, Some(days(0)), None);
    assert_eq!((found.to, found.jumps, found.raised), (alone.to, 2, 201));
    assert!(found.periods() < 200, "{}", found.periods());
    assert_eq!(found.acknowledged.map(|a| a.longest), Some(0));
}

#[test]
fn a_clock_that_is_set_back_is_told_even_between_alarms() {
    let mut collector = Collector::new(None);
    [DAY, DAY - HOUR, DAY].into_iter().for_each(|time| collector.moment(time));
    let report = collector.finish(None);
    assert_eq!((report.set_back, report.jumps), (1, 0));
}

#[test]
fn an_unknown_transition_is_counted_and_changes_nothing() {
    let report = report(&[("a", "raised", "active", 0), ("a", "exploded", "normal", S)], None, None);
    assert_eq!((report.unknown, report.now.len()), (1, 1));
}
