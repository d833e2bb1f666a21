//! What happens in the field: a tank that fills and empties, a door, and two faults of the wiring.
//!
//! One round takes 20 s and begins again, so whoever looks on for 20 s has seen everything:
//!
//! | s | what | what the alarm unit should make of it |
//! |---|---|---|
//! | 0–2 | level 30 of 60 | nothing |
//! | 2–5.1 | rises to 55 | high limit crossed at 4.5 s |
//! | 6.6–12.9 | falls to 5 | low limit crossed at 12.2 s |
//! | 9–10 | the door opens, its contact bounces | one event |
//! | 13.5–13.6 | a spike to full scale | analog veracity: held, hardware fault, no high alarm |
//! | 14.4–17.5 | rises to 30 | nothing |
//! | 16.5–16.53 | the door's contact flickers | digital veracity: nothing |
//! | 18–18.8 | the level's line is broken | hardware fault, no low alarm |
//!
//! The first seconds are quiet on purpose: a check that begins in the middle of a fault would believe the fault.

use std::time::Duration;

/// Length of a round, s.
const ROUND: f64 = 20.0;
/// Level and time of the corners of its course: s, units of 0 to 60.
const COURSE: [(f64, f64); 8] =
    [(0.0, 30.0), (2.0, 30.0), (5.125, 55.0), (6.625, 55.0), (12.875, 5.0), (14.375, 5.0), (17.5, 30.0), (ROUND, 30.0)];
/// The device's analog input: 15 bits for 0 to 60.
const FULL_SCALE: f64 = 32767.0;
const SPAN: f64 = 60.0;

fn within(at: f64, from: f64, to: f64) -> bool {
    (from..to).contains(&at)
}

fn round(time: Duration) -> f64 {
    time.as_secs_f64() % ROUND
}

/// The level's word, 0 to 32767, as the device's input register shows it.
pub(crate) fn level(time: Duration) -> u16 {
    let at = round(time);
    if within(at, 13.5, 13.6) {
        return FULL_SCALE as u16;
    }
    if within(at, 18.0, 18.8) {
        return 0;
    }
    let leg = COURSE.windows(2).find(|leg| at < leg[1].0).unwrap_or(&COURSE[COURSE.len() - 2..]);
    let ((t0, l0), (t1, l1)) = (leg[0], leg[1]);
    // A ripple of the surface, so that the value lives.
    let ripple = 0.08 * (time.as_secs_f64() * 7.0).sin();
    let level = l0 + (l1 - l0) * (at - t0) / (t1 - t0) + ripple;
    (level / SPAN * FULL_SCALE).round().clamp(0.0, FULL_SCALE) as u16
}

/// The door's contact: true while open.
pub(crate) fn door(time: Duration) -> bool {
    let at = round(time);
    // Closed again and again for 5 of every 20 ms while the contact settles.
    let bounce = |from: f64| within(at, from, from + 0.08) && (at - from) % 0.02 < 0.005;
    (within(at, 9.0, 10.0) && !bounce(9.0)) || bounce(10.0) || within(at, 16.5, 16.53)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    fn units(s: f64) -> f64 {
        f64::from(level(at(s))) * SPAN / FULL_SCALE
    }

    #[test]
    fn every_limit_is_crossed_within_a_round() {
        let levels: Vec<f64> =
            (0..2000).map(|n| f64::from(n) * 0.01).filter(|t| !within(*t, 18.0, 18.8)).map(units).collect();
        assert!(levels.iter().any(|l| *l > 52.0) && levels.iter().any(|l| *l < 8.0));
    }

    #[test]
    fn only_the_faults_are_steps_a_veracity_check_refuses() {
        let faulty = |t: f64| within(t, 13.44, 13.66) || within(t, 17.94, 18.86);
        for n in 0..40_000 {
            let t = f64::from(n) * 0.001;
            let step = (units(t + 0.05) - units(t)).abs();
            assert!(step < 1.0 || faulty(t % ROUND), "{step} at {t}");
        }
        // After each fault the level is where it was before: the check lets it pass again.
        assert!((units(13.49) - units(13.61)).abs() < 1.0 && (units(17.99) - units(18.81)).abs() < 1.0);
    }

    #[test]
    fn the_door_opens_once_and_flickers_once() {
        let open = (0..20_000).filter(|n| door(at(f64::from(*n) * 0.001))).count();
        assert!((900..1100).contains(&open), "{open} ms");
        assert!(door(at(9.5)) && !door(at(8.9)) && !door(at(10.5)) && door(at(16.51)) && !door(at(16.54)));
    }
}
