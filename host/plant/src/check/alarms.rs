//! `[[alarm]]`: which variable takes which rule.

use super::tags::Tags;
use crate::file::{AlarmEntry, PlantFile};
use crate::model::{AlarmRule, TagRef, Variable, Wire};
use latchwork_alarm::{Code, CodeKind};
use latchwork_image::Type;
use latchwork_schema::{Checker, Finding, Value};
use regex::Regex;

/// A rule while it is checked.
struct Draft<'a> {
    entry: &'a AlarmEntry,
    rule: AlarmRule,
    regex: Regex,
}

/// The rules, and the variables with those they took.
pub(super) fn rules(checker: &mut Checker, file: &PlantFile, tags: &Tags) -> (Vec<AlarmRule>, Vec<Variable>) {
    let mut drafts: Vec<_> = file.alarms.iter().filter_map(|entry| rule(checker, entry, tags)).collect();
    let mut variables = Vec::new();
    for (name, tag) in tags.bools() {
        let taken = drafts.iter().position(|d| d.takes(name, tag));
        if taken.is_none() && !matches!(tag, TagRef::Alarm { .. } | TagRef::Command { .. }) {
            continue;
        }
        variables.push(match taken {
            Some(index) => {
                drafts[index].rule.matched += 1;
                drafts[index].variable(name, tag, index)
            }
            None => Variable { tag, name: name.into(), rule: None, text: String::new(), group: None },
        });
    }
    for draft in drafts.iter().filter(|d| d.rule.matched == 0) {
        let what = if draft.rule.code.is_alarm() { "alarm" } else { "command" };
        let message = format!("the rule \"{}\" takes no {what}", draft.rule.pattern);
        let span = draft.entry.values.span_of("match");
        checker.add(Finding::note(&span, message).help(
            "it must match the whole name, as in \".*\\\\.alarms\\\\.high\", and a rule before it may have taken it; \
             `latchwork alarms codes PLANT` shows which variable has which rule",
        ));
    }
    (drafts.into_iter().map(|d| d.rule).collect(), variables)
}

impl Draft<'_> {
    fn takes(&self, name: &str, tag: TagRef) -> bool {
        match tag {
            TagRef::Command { .. } => !self.rule.code.is_alarm() && self.regex.is_match(name),
            TagRef::Alarm { .. } => self.rule.code.is_alarm() && self.regex.is_match(name),
            // A pattern such as `.*` is not meant to make alarms of all that is true or false.
            _ => self.rule.code.is_alarm() && self.rule.pattern.replace('\\', "") == name,
        }
    }

    fn variable(&self, name: &str, tag: TagRef, rule: usize) -> Variable {
        let caught = self.regex.captures(name);
        let expand = |key: &str| {
            let template = self.entry.values.text(key).unwrap_or_default();
            let mut text = String::new();
            match &caught {
                Some(caught) => caught.expand(template, &mut text),
                None => text.push_str(template),
            }
            text
        };
        let group = Some(expand("group")).filter(|g| !g.is_empty());
        Variable { tag, name: name.into(), rule: Some(rule), text: expand("text"), group }
    }
}

fn rule<'a>(checker: &mut Checker, entry: &'a AlarmEntry, tags: &Tags) -> Option<Draft<'a>> {
    let values = &entry.values;
    let regex = values.text("match").and_then(|pattern| match Regex::new(&format!("^(?:{pattern})$")) {
        Ok(regex) => Some(regex),
        Err(error) => {
            let why = error.to_string();
            let why = why.lines().last().unwrap_or_default().trim_start_matches("error: ");
            let message = format!("\"{pattern}\" is no regular expression: {why}");
            let help = "a dot of a name is written `\\\\.` in \"…\" and `\\.` in '…'; any text is `.*`";
            checker.add(Finding::error(&values.span_of("match"), message).help(help));
            None
        }
    });
    let code = values.integer("code").and_then(|bits| {
        let bits = u16::try_from(bits).unwrap_or_default();
        match Code::new(bits, values.text("match").unwrap_or("?")) {
            Ok(code) => Some(code.kind()),
            Err(error) => {
                checker.add(Finding::error(&values.span_of("code"), error.to_string()));
                None
            }
        }
    });
    let suppress = suppression(checker, entry, tags);
    let (regex, code) = (regex?, code?);
    for key in ["on-delay", "off-delay", "group", "suppress-when"] {
        if !code.is_alarm() && values.has(key) {
            let message = format!("`{key}` is for alarms; the code {:#06X} is a command's", code.bits());
            checker.add(Finding::error(&values.span_of(key), message).help("take it out"));
        }
    }
    let rule = AlarmRule {
        pattern: values.text("match").unwrap_or_default().into(),
        line: entry.line,
        code,
        priority: priority(values.get("priority"), code),
        on_delay: values.duration("on-delay").unwrap_or(0),
        off_delay: values.duration("off-delay").unwrap_or(0),
        suppress,
        matched: 0,
    };
    Some(Draft { entry, rule, regex })
}

fn priority(value: Option<&Value>, code: CodeKind) -> u8 {
    match value {
        Some(Value::Integer(n)) => u8::try_from(*n).unwrap_or(u8::MAX),
        Some(Value::Text(word)) => match word.as_str() {
            "low" => 64,
            "high" => 192,
            "urgent" => 240,
            _ => 128,
        },
        _ => default_priority(code),
    }
}

/// Priority of records where no rule gives one.
fn default_priority(code: CodeKind) -> u8 {
    match code {
        CodeKind::Warning => 96,
        CodeKind::Message => 32,
        _ => 128,
    }
}

fn suppression(checker: &mut Checker, entry: &AlarmEntry, tags: &Tags) -> Option<Wire> {
    let span = entry.values.span_of("suppress-when");
    let (name, not) = match entry.values.get("suppress-when")? {
        Value::Table(wire) => (wire.text("tag")?.to_owned(), wire.bool("not").unwrap_or(false)),
        Value::Text(name) => (name.clone(), false),
        _ => return None,
    };
    let tag = tags.find(checker, &name, &span)?;
    if tag.ty != Type::Bool {
        let message = format!("`suppress-when` takes a bool; `{name}` is {}", tag.ty);
        checker
            .add(Finding::error(&span, message).help("a block of component \"bounds-check\" makes bools of numbers"));
        return None;
    }
    Some(Wire { tag: tag.tag, not })
}
