//! The steps of a case, in their order: each is checked against the version that runs by then.

use super::keys;
use super::model::{Expect, Step, Subject, Takeover};
use super::ports::{inputs, outputs, retained, settings};
use super::read::Common;
use super::tables::{get, group, table};
use latchwork_image::{format_duration, nearest};
use latchwork_schema::check::found;
use latchwork_schema::{Checker, Entry, Finding, Span, Value, Values};
use toml::de::{DeTable, DeValue};

/// Most executions of one case.
const EXECUTIONS: u64 = 100_000_000;

/// Gathers the steps of a case.
pub(super) struct Steps {
    pub(super) list: Vec<Step>,
    pub(super) tolerance: f64,
    /// The version that runs after the last step; `None` when it could not be loaded.
    pub(super) subject: Option<Subject>,
    every: u64,
    /// The last step ended in a fault.
    gone: bool,
    executions: u64,
}

impl Steps {
    pub(super) fn new(every: u64, tolerance: f64, subject: Option<Subject>) -> Self {
        Self { list: Vec::new(), tolerance, subject, every, gone: false, executions: 0 }
    }

    /// Adds a `[[case.step]]`.
    pub(super) fn step(&mut self, checker: &mut Checker, common: &mut Common<'_>, item: &DeTable<'_>, span: &Span) {
        let values = table(checker, &keys::STEP, item, span, &["inputs", "settings", "expect"]);
        let number = self.list.len() + 1;
        let mut step = Step { line: common.place.line(span), ..Step::default() };
        step.label = match values.text("name") {
            Some(name) => format!("step {number}, {name}"),
            None => format!("step {number}"),
        };
        let before = self.subject.clone();
        step.takeover = self.takeover(checker, common, &values);
        if let Some(subject) = &self.subject
            && let Some(given) = group(checker, item, "settings")
        {
            let settings = settings(subject);
            for said in settings.said(checker, given) {
                step.settings.extend(settings.constant(checker, &said).map(|cell| (said.port, cell)));
            }
        }
        // A swap that is refused leaves the version that was, and its ports.
        let refused =
            matches!(get(item, "expect"), Some(Entry { value: DeValue::Table(t), .. }) if t.contains_key("refused"));
        if refused && values.has("swap") {
            self.subject = before;
        }
        if let Some(subject) = &self.subject {
            if let Some(given) = group(checker, item, "inputs") {
                let inputs = inputs(subject);
                for said in inputs.said(checker, given) {
                    step.inputs.extend(inputs.input(checker, &said));
                }
            }
            let (name, commands) = (subject.component.name(), &subject.class.commands);
            step.commands = flags(checker, name, "command", commands, values.get("commands")).unwrap_or(0);
        }
        if let Some(entry) = get(item, "expect") {
            match entry.value {
                DeValue::Table(given) => step.expect = self.expect(checker, given, &entry.span),
                value => {
                    let message = format!("`expect` is {}; expected a table", found(value));
                    let finding = Finding::error(&entry.span, message);
                    checker.add(finding.help("as in `expect = { outputs = { PORT = … }, alarms = [] }`"));
                }
            }
        }
        let changes = !step.settings.is_empty() || matches!(step.takeover, Takeover::Swap { .. });
        if step.expect.refused.is_some() && !changes {
            let finding = Finding::error(span, "the step expects a refusal and writes nothing that could be refused");
            checker.add(finding.help("give it `settings`, or a `swap`"));
        }
        self.push(checker, step, values.duration("at"), &values.span_of("at"));
    }

    /// Adds a step at its time, the next execution's when none is given.
    pub(super) fn push(&mut self, checker: &mut Checker, mut step: Step, at: Option<u64>, span: &Span) {
        let last = self.list.last().map(|s| s.at);
        let next = last.map_or(0, |at| at.saturating_add(self.every));
        if at.is_none() && last.is_some() && self.every == 0 {
            let finding = Finding::error(span, "a step has no `at`, and `every` is 0: there is no next execution");
            checker.add(finding.help("give it a time"));
        }
        step.at = at.unwrap_or(next);
        if let Some(last) = last.filter(|last| step.at < *last) {
            let (at, last) = (format_duration(step.at), format_duration(last));
            let finding = Finding::error(span, format!("the step is at {at}; the one before it is at {last}"));
            checker.add(finding.help("steps stand in the order of their times"));
        }
        if self.gone && matches!(step.takeover, Takeover::None) {
            let finding = Finding::error(span, "the step before ended in a fault: there is nothing left to execute");
            checker.add(finding.help("begin the step with `restart = true`, or leave it out"));
        }
        // A swap that is refused brings nothing back.
        let still = self.gone && step.expect.refused.is_some();
        self.gone = still || step.expect.fault.is_some();
        let before = self.executions;
        let gap = step.at.saturating_sub(last.unwrap_or(0));
        self.executions = before.saturating_add(1).saturating_add(gap.checked_div(self.every).unwrap_or(0));
        if before <= EXECUTIONS && self.executions > EXECUTIONS {
            let message =
                format!("up to here the case takes {} executions; at most {EXECUTIONS} are done", self.executions);
            checker.add(Finding::error(span, message).help("make `every` longer, or the times shorter"));
        }
        self.list.push(step);
    }

    fn takeover(&mut self, checker: &mut Checker, common: &mut Common<'_>, values: &Values) -> Takeover {
        let restart = values.bool("restart").unwrap_or(false);
        let lossy = values.bool("allow-lossy").unwrap_or(false);
        let Some(name) = values.text("swap") else {
            if values.has("allow-lossy") {
                let finding = Finding::error(&values.span_of("allow-lossy"), "`allow-lossy` stands without a `swap`");
                checker.add(finding.help("it says that a swap may clamp state that does not fit"));
            }
            return if restart { Takeover::Restart } else { Takeover::None };
        };
        let span = values.span_of("swap");
        if restart {
            let finding = Finding::error(&span, "a step has both `restart` and `swap`");
            checker.add(finding.help("make two steps of them"));
        }
        let old = self.subject.take().map(|s| s.class.name.clone());
        let Some(new) = common.finder.version(checker, name, old.as_deref(), &span) else { return Takeover::None };
        self.subject = Some(new.clone());
        Takeover::Swap { to: Box::new(new), lossy }
    }

    fn expect(&self, checker: &mut Checker, given: &DeTable<'_>, span: &Span) -> Expect {
        let values = table(checker, &keys::EXPECT, given, span, &["outputs", "state"]);
        let word = |key| values.text(key).map(str::to_owned);
        let mut expect = Expect { refused: word("refused"), fault: word("fault"), ..Expect::default() };
        let Some(subject) = &self.subject else { return expect };
        for (name, of) in [("outputs", outputs(subject)), ("state", retained(subject))] {
            let Some(given) = group(checker, given, name) else { continue };
            let list = if name == "outputs" { &mut expect.outputs } else { &mut expect.state };
            for said in of.said(checker, given) {
                list.extend(of.expected(checker, &said, self.tolerance));
            }
        }
        let alarms = &subject.class.alarms;
        let on = flags(checker, subject.component.name(), "alarm", alarms, values.get("alarms"));
        expect.alarms = on.map(|on| (all(alarms), on));
        let after = expect.outputs.len() + expect.state.len() + usize::from(expect.alarms.is_some());
        if expect.fault.is_some() && after > 0 {
            let finding =
                Finding::error(&values.span_of("fault"), "after a fault there are no outputs, alarms or state");
            checker.add(finding.help("expect the fault alone"));
        }
        expect
    }
}

/// The bits of all flags.
pub(super) fn all(names: &[String]) -> u64 {
    (1 << names.len()) - 1
}

/// The bit of a flag, or a finding.
pub(super) fn flag(
    checker: &mut Checker,
    component: &str,
    what: &str,
    names: &[String],
    name: &str,
    span: &Span,
) -> Option<u64> {
    if let Some(bit) = names.iter().position(|n| n == name) {
        return Some(1 << bit);
    }
    let finding = Finding::error(span, format!("`{component}` has no {what} `{name}`"));
    checker.add(match nearest(name, names.iter().map(String::as_str)) {
        Some(near) => finding.help(format!("did you mean \"{near}\"?")),
        None if names.is_empty() => finding.help(format!("its class has no {what}s")),
        None => finding.help(format!("it has {}", names.join(", "))),
    });
    None
}

/// A word of flags from a list of names; `None` when there is no list.
fn flags(checker: &mut Checker, component: &str, what: &str, names: &[String], list: Option<&Value>) -> Option<u64> {
    let Some(Value::List(list)) = list else { return None };
    let mut word = 0;
    for (value, span) in list {
        if let Value::Text(name) = value {
            word |= flag(checker, component, what, names, name, span).unwrap_or(0);
        }
    }
    Some(word)
}
