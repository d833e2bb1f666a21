//! The steps of a case, in their order: each is checked against the tags that there are by then.

use crate::keys;
use crate::model::{Expect, Step};
use crate::operations::{Listed, alarms, commands, forces, inputs, listed, names, texts};
use crate::read::Common;
use crate::swaps;
use crate::tags::Tags;
use latchwork_image::{Type, format_duration};
use latchwork_plant::operate::Operation;
use latchwork_schema::{Checker, Entry, Finding, Span, Value, Values};
use latchwork_testbed::case::kit::{Expected, get, group, table};
use toml::de::{DeTable, DeValue};

/// Most scans of one case.
const SCANS: u64 = 100_000_000;

/// Gathers the steps of a case.
pub(crate) struct Steps {
    pub(crate) list: Vec<Step>,
    pub(crate) tolerance: f64,
    /// What can be named after the last step; `None` when there is no plant.
    pub(crate) tags: Option<Tags>,
    /// Of the plant file: what there is after a restart.
    of_file: Option<Tags>,
    pub(crate) watched: Vec<(String, Type)>,
    every: u64,
    /// Scans of all lanes in a second.
    scans: u64,
}

impl Steps {
    pub(crate) fn new(common: &Common<'_>, tolerance: f64) -> Self {
        let tags = common.subject.as_ref().map(|s| s.tags.clone());
        let of_file = tags.clone();
        let (every, scans) = (common.every, common.scans);
        Self { list: Vec::new(), tolerance, tags, of_file, watched: Vec::new(), every, scans }
    }

    /// Index of a tag among those that are watched.
    pub(crate) fn watch(&mut self, tag: &str) -> usize {
        if let Some(at) = self.watched.iter().position(|(name, _)| name == tag) {
            return at;
        }
        let port = self.tags.as_ref().and_then(|tags| tags.all.iter().find(|p| p.path == tag));
        if let Some(port) = port {
            self.watched.push((port.path.clone(), port.ty.clone()));
        }
        self.watched.len().saturating_sub(1)
    }

    /// What is expected of a tag, with the cell among those that are watched.
    pub(crate) fn watch_expected(&mut self, mut expected: Expected) -> Expected {
        expected.cell = 2 * self.watch(&expected.name);
        expected
    }

    /// Adds a `[[case.step]]`.
    pub(crate) fn step(&mut self, checker: &mut Checker, common: &mut Common<'_>, item: &DeTable<'_>, span: &Span) {
        let own = ["inputs", "settings", "force", "swap", "commands", "shelve", "expect"];
        let values = table(checker, &keys::STEP, item, span, &own);
        let number = self.list.len() + 1;
        let mut step = Step { line: common.place.line(span), ..Step::default() };
        step.label = match values.text("name") {
            Some(name) => format!("step {number}, {name}"),
            None => format!("step {number}"),
        };
        step.restart = values.bool("restart").unwrap_or(false);
        if step.restart {
            self.tags.clone_from(&self.of_file);
        }
        if let Some(tags) = self.tags.take() {
            self.tags = Some(self.changes(checker, common, item, &values, tags, &mut step));
        }
        if let Some(entry) = get(item, "expect") {
            match entry.value {
                DeValue::Table(given) => step.expect = self.expect(checker, given, &entry.span),
                _ => wrong_expect(checker, &entry),
            }
        }
        if step.expect.refused.is_some() && step.changes.wishes.is_empty() {
            let finding = Finding::error(span, "the step expects a refusal and wants nothing that could be refused");
            checker.add(finding.help("give it `settings`, `commands`, a `swap` or something about an alarm"));
        }
        self.push(checker, step, values.duration("at"), &values.span_of("at"));
    }

    /// What a step changes; the tags that there are then.
    fn changes(
        &mut self,
        checker: &mut Checker,
        common: &mut Common<'_>,
        item: &DeTable<'_>,
        values: &Values,
        tags: Tags,
        step: &mut Step,
    ) -> Tags {
        step.changes.inputs = inputs(checker, &tags, item);
        let order = swaps::order(checker, common, &tags, item, values);
        // A swap that is refused leaves the version that was, and its ports; but its settings are of the new one.
        let refused =
            matches!(get(item, "expect"), Some(Entry { value: DeValue::Table(t), .. }) if t.contains_key("refused"));
        let (order, after) = order.map_or((None, None), |(order, after)| (Some(order), Some(after)));
        let mut settings = texts(checker, after.as_ref().unwrap_or(&tags), item, "settings", Tags::set);
        let wishes = &mut step.changes.wishes;
        if let Some(mut order) = order {
            for part in &mut order.parts {
                let of_block = format!("{}.settings.", part.block);
                let (own, others) = settings.into_iter().partition(|(tag, _)| tag.starts_with(&of_block));
                settings = others;
                let own: Vec<(String, String)> = own;
                let names = own.into_iter().map(|(tag, value)| (tag[of_block.len()..].to_owned(), value));
                part.settings = names.collect();
            }
            wishes.push(Operation::Swap(Box::new(order)));
        }
        if !settings.is_empty() {
            wishes.push(Operation::Set { values: settings, write: true });
        }
        let tags = after.filter(|_| !refused).unwrap_or(tags);
        wishes.extend(forces(checker, &tags, item, values));
        wishes.extend(commands(checker, &tags, item));
        wishes.extend(alarms(checker, &tags, item, values));
        self.tags = Some(tags);
        self.watch_changes(step);
        self.tags.take().unwrap_or_default()
    }

    /// What a step changes is shown when it fails.
    pub(crate) fn watch_changes(&mut self, step: &Step) {
        for input in &step.changes.inputs {
            self.watch(&input.tag);
        }
        for wish in &step.changes.wishes {
            if let Operation::Force { tag, .. } = wish {
                self.watch(tag);
            }
        }
    }

    /// Adds a step at its time, that of the next scan when none is given.
    pub(crate) fn push(&mut self, checker: &mut Checker, mut step: Step, at: Option<u64>, span: &Span) {
        let last = self.list.last().map(|s| s.at);
        step.at = at.unwrap_or_else(|| last.map_or(0, |last| last.saturating_add(self.every)));
        if let Some(last) = last.filter(|last| step.at < *last) {
            let (at, last) = (format_duration(step.at), format_duration(last));
            let finding = Finding::error(span, format!("the step is at {at}; the one before it is at {last}"));
            checker.add(finding.help("steps stand in the order of their times"));
        }
        let scans = |at: u64| u128::from(at) * u128::from(self.scans) / 1_000_000_000;
        if scans(step.at) > SCANS.into() && scans(last.unwrap_or(0)) <= SCANS.into() {
            let message =
                format!("up to here the plant scans {} times; at most {SCANS} scans are done", scans(step.at));
            checker.add(Finding::error(span, message).help("make the times shorter"));
        }
        self.list.push(step);
    }

    fn expect(&mut self, checker: &mut Checker, given: &DeTable<'_>, span: &Span) -> Expect {
        let values = table(checker, &keys::EXPECT, given, span, &["outputs", "alarms"]);
        let mut expect = Expect { refused: values.text("refused").map(str::to_owned), ..Expect::default() };
        let Some(tags) = self.tags.clone() else { return expect };
        if let Some(given) = group(checker, given, "outputs") {
            for said in tags.group().said(checker, given) {
                let expected = tags.group().expected(checker, &said, self.tolerance);
                expect.outputs.extend(expected.map(|e| self.watch_expected(e)));
            }
        }
        match listed(checker, given, "alarms", &keys::STATE) {
            Listed::Names(names) if given.contains_key("alarms") => {
                expect.alarms = Some(self.listed(checker, &tags, &names));
            }
            Listed::Names(_) => {}
            Listed::Map(map) => {
                for (name, key, value, _) in map {
                    if let Value::Text(state) = value
                        && tags.alarm(checker, &name, &key)
                    {
                        self.watch(&name);
                        expect.states.push((name, state));
                    }
                }
            }
        }
        for (text, span) in names(values.get("records")) {
            expect.records.extend(record(checker, text, span));
        }
        for (name, span) in names(values.get("faults")) {
            expect.faults.extend(faulty(checker, &tags, lanes(&tags), name, span));
        }
        expect
    }

    /// Alarms by name, sorted.
    fn listed(&mut self, checker: &mut Checker, tags: &Tags, list: &[(String, Span)]) -> Vec<String> {
        let known = list.iter().filter(|(name, span)| tags.alarm(checker, name, span));
        let mut names: Vec<_> = known.map(|(name, _)| name.clone()).collect();
        for name in &names {
            self.watch(name);
        }
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// Lanes by the tags of their figures.
fn lanes(tags: &Tags) -> Vec<String> {
    let lane = |path: &str| path.strip_prefix("lane.")?.strip_suffix(".scans").map(|name| format!("lane.{name}"));
    tags.all.iter().filter_map(|p| lane(&p.path)).collect()
}

/// A block or a lane that may fault.
fn faulty(checker: &mut Checker, tags: &Tags, lanes: Vec<String>, name: &str, span: &Span) -> Option<String> {
    let names: Vec<_> = tags.blocks.iter().map(|(name, _)| name.clone()).chain(lanes).collect();
    if names.iter().any(|n| n == name) {
        return Some(name.into());
    }
    let (message, help) = crate::tags::unknown("block or lane", &names, name);
    checker.add(Finding::error(span, message).help(help));
    None
}

/// `SOURCE TRANSITION`
fn record(checker: &mut Checker, text: &str, span: &Span) -> Option<String> {
    let words: Vec<_> = text.split_whitespace().collect();
    if let [source, transition] = words[..] {
        return Some(format!("{source} {transition}"));
    }
    let finding = Finding::error(span, format!("\"{text}\" is no record; expected its source and its transition"));
    checker.add(finding.help("as in \"unit.alarms.high raised\"; `latchwork run --records FILE` shows all there are"));
    None
}

fn wrong_expect(checker: &mut Checker, entry: &Entry<'_>) {
    let message = format!("`expect` is {}; expected a table", latchwork_schema::check::found(entry.value));
    checker.add(
        Finding::error(&entry.span, message)
            .help("as in `expect = { outputs = { \"DRIVER.POINT\" = … }, alarms = [] }`"),
    );
}
