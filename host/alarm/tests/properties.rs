//! What no sequence of conditions, operators and time may do.

use latchwork_alarm::{Alarm, Alarms, CodeKind, Input, Rules, State, Transition};
use proptest::prelude::*;

fn kinds() -> impl Strategy<Value = CodeKind> {
    prop::sample::select(CodeKind::ALL.into_iter().filter(|k| k.is_alarm()).collect::<Vec<_>>())
}

fn inputs() -> impl Strategy<Value = Vec<(u64, Input)>> {
    let input = prop_oneof![
        4 => any::<bool>().prop_map(Input::Condition),
        2 => Just(Input::Acknowledge),
        2 => Just(Input::Reset),
        1 => (0..200u64).prop_map(Input::Shelve),
        1 => Just(Input::Unshelve),
        1 => any::<bool>().prop_map(Input::Suppress),
        1 => any::<bool>().prop_map(Input::OutOfService),
        2 => Just(Input::Tick),
    ];
    prop::collection::vec((0..6u64, input), 0..80)
}

proptest! {
    #[test]
    fn transitions_are_a_chain_in_order_of_time(
        kind in kinds(), on_delay in 0..8u64, off_delay in 0..8u64, inputs in inputs()
    ) {
        let rules = Rules { kind, on_delay, off_delay };
        let (mut alarm, mut now, mut told) = (Alarm::default(), 0, Vec::<Transition>::new());
        for (step, input) in inputs {
            now += step;
            let before = (alarm, told.len());
            let input = if let Input::Shelve(t) = input { Input::Shelve(now + t % 20) } else { input };
            let done = alarm.step(&rules, input, now, |t| told.push(t));
            // A refusal changes nothing but what time has done.
            if done.is_err() {
                let mut timed = before.0;
                timed.step(&rules, Input::Tick, now, |_| {}).unwrap();
                prop_assert_eq!(timed, alarm);
            }
            // What is shown is what was told last, and nothing else ever changed it.
            prop_assert_eq!(told.last().map_or(State::Normal, |t| t.to), alarm.state());
            prop_assert!(!alarm.unacknowledged || rules.kind.must_be_acknowledged());
            prop_assert!(alarm.active || !alarm.latched || alarm.state() != State::Normal);
            // No acknowledgement or reset makes an active alarm disappear.
            if alarm.active && alarm.shelved.is_none() && !alarm.suppressed && !alarm.out_of_service {
                prop_assert!(matches!(alarm.state(), State::Active | State::Unacknowledged));
            }
        }
        prop_assert!(told.windows(2).all(|w| w[0].time <= w[1].time && w[0].to == w[1].from));
        prop_assert!(told.iter().all(|t| !t.word.is_empty()));
    }

    #[test]
    fn every_new_occurrence_must_be_acknowledged_anew(on_delay in 0..4u64, inputs in inputs()) {
        let rules = Rules { kind: CodeKind::AlarmAcknowledge, on_delay, off_delay: 0 };
        let (mut alarm, mut now) = (Alarm::default(), 0);
        for (step, input) in inputs {
            now += step;
            let input = if let Input::Shelve(t) = input { Input::Shelve(now + t % 20) } else { input };
            let mut raised = false;
            let mut acknowledged_after = false;
            let _ = alarm.step(&rules, input, now, |t| {
                raised |= t.word == "raised";
                acknowledged_after = raised && t.word == "acknowledged";
            });
            prop_assert!(!raised || alarm.unacknowledged || acknowledged_after || !alarm.active);
        }
    }

    #[test]
    fn the_steps_of_time_do_not_matter(kind in kinds(), on_delay in 0..8u64, inputs in inputs()) {
        let rules = Rules { kind, on_delay, off_delay: 2 };
        let run = |fine: bool| {
            let (mut alarm, mut now, mut told) = (Alarm::default(), 0, Vec::new());
            for (step, input) in &inputs {
                if fine {
                    for time in now..now + step {
                        alarm.step(&rules, Input::Tick, time, |t| told.push(t)).unwrap();
                    }
                }
                now += step;
                let input = if let Input::Shelve(t) = input { Input::Shelve(now + t % 20) } else { *input };
                let _ = alarm.step(&rules, input, now, |t| told.push(t));
            }
            told
        };
        prop_assert_eq!(run(true), run(false));
    }

    #[test]
    fn one_of_a_group_came_first(events in prop::collection::vec((0..4usize, any::<bool>()), 1..60)) {
        let mut alarms = Alarms::default();
        let rules = Rules { kind: CodeKind::Alarm, on_delay: 0, off_delay: 0 };
        for n in 0..4 {
            alarms.add(&format!("a{n}"), rules, Some("pumps")).unwrap();
        }
        let mut first: Option<usize> = None;
        for (time, (alarm, condition)) in events.into_iter().enumerate() {
            alarms.step(alarm, Input::Condition(condition), time as u64, |_| {}).unwrap();
            let active: Vec<_> = alarms.listed().map(|l| l.0).collect();
            if active.is_empty() {
                first = None;
            } else if first.is_none() {
                first = Some(alarm);
            }
            let shown: Vec<_> = (0..4).filter(|n| alarms.is_first_out(*n)).collect();
            prop_assert_eq!(shown, first.into_iter().collect::<Vec<_>>());
        }
    }
}
