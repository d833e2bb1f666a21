//! What a block did against what was expected of it.

use super::compare::compare;
use super::history::names_of;
use super::model::Step;
use super::report::Mismatch;
use super::run::Run;
use latchwork_block::Fault;

/// Why a block did not do what it was asked.
pub(super) enum Trouble {
    Fault(Fault),
    Refused(String),
}

impl From<Fault> for Trouble {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

/// A fault as it is told.
pub(super) fn told(fault: &Fault) -> String {
    format!("{} ({})", fault.kind.name(), fault.message)
}

impl Run<'_> {
    /// How something went against what was expected of it.
    pub(super) fn judge(
        &self,
        mismatches: &mut Vec<Mismatch>,
        outcome: &Result<(), Trouble>,
        refused: Option<&str>,
        fault: Option<&str>,
    ) {
        let mut wrong = |what: &str, expected: String, got: String| {
            mismatches.push(Mismatch { what: what.into(), expected, got });
        };
        let part = |refused: &str| format!("a refusal with \"{refused}\"");
        match (outcome, refused, fault) {
            (Ok(()), None, None) => {}
            (Err(Trouble::Refused(sentence)), Some(part), None) if sentence.contains(part) => {}
            (Err(Trouble::Fault(f)), None, Some(kind)) if f.kind.name() == kind => {}
            (Err(Trouble::Refused(sentence)), Some(refused), _) => {
                wrong("refused", part(refused), format!("\"{sentence}\""));
            }
            (Err(Trouble::Refused(sentence)), None, _) => {
                wrong("refused", "no refusal".into(), format!("\"{sentence}\""))
            }
            (Err(Trouble::Fault(f)), _, kind) => {
                wrong("fault", kind.unwrap_or("none").to_owned(), told(f));
            }
            (Ok(()), Some(refused), _) => wrong("refused", part(refused), "none".into()),
            (Ok(()), None, Some(kind)) => wrong("fault", kind.to_owned(), "none".into()),
        }
    }

    /// Outputs, alarms and state against what was expected.
    pub(super) fn compare(&mut self, step: &Step, mismatches: &mut Vec<Mismatch>) {
        let results = &self.cells[self.ins.len()..];
        step.expect.outputs.iter().for_each(|e| compare(e, results, mismatches));
        if let Some((spoken, on)) = step.expect.alarms {
            let names = &self.subject.class.alarms;
            let got = if names.is_empty() { 0 } else { results.last().copied().unwrap_or(0) };
            if got & spoken != on {
                let named = |word| if word == 0 { "none".into() } else { names_of(names, word) };
                let (expected, got) = (named(on), named(got & spoken));
                mismatches.push(Mismatch { what: "alarms".into(), expected, got });
            }
        }
        if step.expect.state.is_empty() {
            return;
        }
        let Some(instance) = &mut self.instance else { return };
        match instance.save() {
            Ok(state) => {
                let state = state.unwrap_or_default();
                step.expect.state.iter().for_each(|e| compare(e, &state, mismatches));
            }
            Err(fault) => {
                mismatches.push(Mismatch { what: "fault".into(), expected: "none".into(), got: told(&fault) });
                self.instance = None;
            }
        }
    }
}
