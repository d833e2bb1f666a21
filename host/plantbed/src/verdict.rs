//! What was expected against what the plant has done and answered.

use crate::model::Step;
use crate::run::Run;
use crate::world::{Told, World};
use latchwork_alarm::State;
use latchwork_plant::operate::{Answer, Refused};
use latchwork_plant::swap::Stage;
use latchwork_record::{Kind, Record};
use latchwork_testbed::case::Mismatch;
use latchwork_testbed::case::kit::compare;
use std::sync::mpsc::TryRecvError;

/// Priority from which on a record of a fault is one, and not its aftermath.
const FAULT: u8 = 200;
/// Records that a message lists.
const LISTED: usize = 8;

/// Outputs, alarms, records and faults at the end of a step.
pub(crate) fn judge(run: &mut Run<'_>, world: &mut World, step: &Step) -> Vec<Mismatch> {
    let expect = &step.expect;
    let mut mismatches = Vec::new();
    for expected in &expect.outputs {
        if world.has(expected.cell / 2) {
            compare(expected, &run.cells, &mut mismatches);
        } else {
            let wanted = expected.value.map_or("a quality".into(), |v| expected.ty.format(v));
            let got = "no such tag: the version that brings it does not run".into();
            mismatches.push(Mismatch { what: expected.name.clone(), expected: wanted, got });
        }
    }
    if expect.alarms.is_some() || !expect.states.is_empty() {
        alarms(world, step, &mut mismatches);
    }
    records(&expect.records, &run.records, &mut mismatches);
    faults(&expect.faults, &run.records, &mut mismatches);
    mismatches
}

fn alarms(world: &mut World, step: &Step, mismatches: &mut Vec<Mismatch>) {
    let Some(rows) = world.alarms() else {
        let got = "the plant gives no answer".into();
        return mismatches.push(Mismatch { what: "alarms".into(), expected: "a list".into(), got });
    };
    if let Some(expected) = &step.expect.alarms {
        let listed = |state: &str| State::from_name(state).is_some_and(State::is_listed);
        let mut got: Vec<_> = rows.iter().filter(|r| listed(r.state)).map(|r| r.alarm.clone()).collect();
        got.sort_unstable();
        if got != *expected {
            let list = |names: &[String]| if names.is_empty() { "-".into() } else { names.join(" | ") };
            mismatches.push(Mismatch { what: "alarms".into(), expected: list(expected), got: list(&got) });
        }
    }
    for (name, state) in &step.expect.states {
        let got = rows.iter().find(|r| r.alarm == *name).map_or("no such alarm", |r| r.state);
        if got != state {
            mismatches.push(Mismatch { what: name.clone(), expected: state.clone(), got: got.into() });
        }
    }
}

/// Those expected are there, in their order.
fn records(expected: &[String], records: &[Record], mismatches: &mut Vec<Mismatch>) {
    let told: Vec<_> = records.iter().map(|r| format!("{} {}", r.source, r.transition)).collect();
    let mut rest = told.iter();
    let Some(missing) = expected.iter().find(|e| !rest.any(|told| told == *e)) else { return };
    let shown: Vec<_> = told.iter().take(LISTED).map(String::as_str).collect();
    let more = told.len().saturating_sub(LISTED);
    let got = match (shown.is_empty(), more) {
        (true, _) => "none".into(),
        (_, 0) => shown.join(", "),
        (_, more) => format!("{} and {more} more", shown.join(", ")),
    };
    let before = expected.iter().position(|e| e == missing).filter(|n| *n > 0).map(|n| &expected[n - 1]);
    let after = before.map(|before| format!(" after \"{before}\"")).unwrap_or_default();
    mismatches.push(Mismatch { what: "records".into(), expected: format!("\"{missing}\"{after}"), got });
}

/// Whoever faults is expected to.
fn faults(expected: &[String], records: &[Record], mismatches: &mut Vec<Mismatch>) {
    let of_lane = |r: &Record| r.kind == Kind::Lane && r.transition == "faulted";
    let is_fault = |r: &&Record| (r.kind == Kind::Fault && r.priority >= FAULT) || of_lane(r);
    let faults: Vec<_> = records.iter().filter(is_fault).collect();
    for record in &faults {
        if !expected.contains(&record.source) {
            let got = format!("{} ({}: {})", record.source, record.transition, record.text);
            let expected = if expected.is_empty() { "none".into() } else { expected.join(", ") };
            mismatches.push(Mismatch { what: "faults".into(), expected, got });
            // One leads to the next.
            break;
        }
    }
    for name in expected.iter().filter(|e| !faults.iter().any(|r| r.source == **e)) {
        mismatches.push(Mismatch { what: "faults".into(), expected: name.clone(), got: "none".into() });
    }
}

/// Everything that was wished and is not over.
#[derive(Default)]
pub(crate) struct Wishes {
    open: Vec<Wish>,
    /// Refusals that are expected: by step, the part of a sentence, whether it was met.
    refusals: Vec<Refusal>,
}

struct Wish {
    step: usize,
    /// `command`, `swap`, …
    what: &'static str,
    state: Waits,
}

/// What a wish waits for.
enum Waits {
    Answer(Told),
    /// A swap that is under way.
    Swap(u64),
}

struct Refusal {
    step: usize,
    part: String,
    met: bool,
}

/// What became of a wish.
enum Became {
    Waits(Waits),
    Done,
    Refused(String),
    Unanswered,
}

impl Wishes {
    /// The wishes of a step begin.
    pub(crate) fn open(&mut self, step: usize, refused: Option<&str>) {
        if let Some(part) = refused {
            self.refusals.push(Refusal { step, part: part.into(), met: false });
        }
    }

    /// A wish was brought.
    pub(crate) fn add(&mut self, step: usize, what: &'static str, told: Result<Told, Refused>) {
        let told = told.unwrap_or_else(|refused| {
            let (to, told) = std::sync::mpsc::channel();
            // The receiver is there.
            let _ = to.send(Err(refused));
            told
        });
        self.open.push(Wish { step, what, state: Waits::Answer(told) });
    }

    /// Hears what was answered; what is not as expected, by step. With `last`, nothing is waited for any longer.
    pub(crate) fn heard(&mut self, world: &mut World, last: bool) -> Vec<(usize, Mismatch)> {
        let mut wrong = Vec::new();
        for mut wish in std::mem::take(&mut self.open) {
            match became(wish.state, world, last) {
                Became::Waits(state) => {
                    wish.state = state;
                    self.open.push(wish);
                }
                Became::Done => {}
                Became::Refused(sentence) => wrong.extend(self.refused(wish.step, wish.what, &sentence)),
                Became::Unanswered => {
                    let got = "none: no scan of its lane came after it".into();
                    let mismatch = Mismatch { what: wish.what.into(), expected: "an answer".into(), got };
                    wrong.push((wish.step, mismatch));
                }
            }
        }
        let open = &self.open;
        let over = |r: &Refusal| last || !open.iter().any(|w| w.step == r.step);
        for refusal in self.refusals.extract_if(.., |r| over(r)).filter(|r| !r.met) {
            let expected = format!("a refusal with \"{}\"", refusal.part);
            let mismatch = Mismatch { what: "refused".into(), expected, got: "none".into() };
            wrong.push((refusal.step, mismatch));
        }
        wrong
    }

    /// A refusal, unless it was expected.
    fn refused(&mut self, step: usize, what: &str, sentence: &str) -> Option<(usize, Mismatch)> {
        let refusal = self.refusals.iter_mut().find(|r| r.step == step);
        let expected = match refusal {
            Some(refusal) if sentence.contains(&refusal.part) => {
                refusal.met = true;
                return None;
            }
            Some(refusal) => {
                // It was refused, if for another reason: that is told once.
                refusal.met = true;
                format!("a refusal with \"{}\"", refusal.part)
            }
            None => "no refusal".into(),
        };
        Some((step, Mismatch { what: what.into(), expected, got: format!("\"{sentence}\"") }))
    }
}

fn became(state: Waits, world: &mut World, last: bool) -> Became {
    let number = match state {
        Waits::Answer(told) => match told.try_recv() {
            Ok(Ok(Answer::Swap(status))) => status.number,
            Ok(Ok(_)) => return Became::Done,
            Ok(Err(refused)) => return Became::Refused(refused.message),
            Err(TryRecvError::Empty) if !last => return Became::Waits(Waits::Answer(told)),
            Err(_) => return Became::Unanswered,
        },
        Waits::Swap(number) => number,
    };
    let Some(status) = world.swap(number) else { return Became::Done };
    match status.stage {
        Stage::Done | Stage::Planned => Became::Done,
        Stage::Refused | Stage::RolledBack | Stage::Cancelled => Became::Refused(status.message),
        // A probation that goes on has found nothing so far.
        Stage::Probation if last => Became::Done,
        _ if last => Became::Unanswered,
        _ => Became::Waits(Waits::Swap(number)),
    }
}
