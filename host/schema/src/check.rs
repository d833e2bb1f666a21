//! Checks TOML tables against sections and gathers every finding.

pub use crate::parse::parse;
use crate::raw::raw;
pub use crate::words::{constant, found};
use crate::words::{example, expected, format_size, integer, number, parse_size};
use crate::{Finding, Key, Kind, Section, Span, Value, Values};
use latchwork_image::{format_duration, nearest, parse_duration};
use toml::de::{DeTable, DeValue};

/// Reads tables and keeps what it finds wrong.
#[derive(Default)]
pub struct Checker {
    /// What was found so far, in the order of reading.
    pub findings: Vec<Finding>,
    /// What the user calls the table being read, such as `[lane.main]`; empty: the section's own name.
    pub whose: String,
}

/// One entry of a TOML table.
pub struct Entry<'a> {
    /// Key.
    pub name: &'a str,
    /// Bytes of the key.
    pub key_span: Span,
    /// Value.
    pub value: &'a DeValue<'a>,
    /// Bytes of the value.
    pub span: Span,
}

/// The entries of a table in the order of the file.
pub fn entries<'a>(table: &'a DeTable<'a>) -> Vec<Entry<'a>> {
    let mut list: Vec<_> = table
        .iter()
        .map(|(k, v)| Entry { name: k.get_ref(), key_span: k.span(), value: v.get_ref(), span: v.span() })
        .collect();
    list.sort_by_key(|e| e.key_span.start);
    list
}

impl Checker {
    /// Adds a finding.
    pub fn add(&mut self, finding: Finding) {
        self.findings.push(finding);
    }

    /// Reads a table whose keys are those of all `sections` together. `span` is where it stands.
    pub fn table(&mut self, sections: &[&Section], table: &DeTable<'_>, span: Span) -> Values {
        self.table_but(sections, table, span, &[])
    }

    /// The same; keys in `skip` belong to somebody else and are passed over.
    pub fn table_but(&mut self, sections: &[&Section], table: &DeTable<'_>, span: Span, skip: &[&str]) -> Values {
        let mut values = Values { span: span.clone(), ..Values::default() };
        let keys: Vec<&Key> = sections.iter().flat_map(|s| s.keys).collect();
        let mut misspelt = Vec::new();
        for entry in entries(table) {
            if skip.contains(&entry.name) {
                continue;
            }
            match keys.iter().find(|k| k.name == entry.name) {
                Some(key) => {
                    if let Some(value) = self.value(&key.kind, entry.name, entry.value, &entry.span) {
                        values.entries.insert(entry.name.to_owned(), (value, entry.span));
                    }
                }
                None => {
                    let known = keys.iter().map(|k| k.name).chain(skip.iter().copied());
                    misspelt.extend(self.unknown_key(&entry, sections, known));
                }
            }
        }
        // A key that is there with a slip of the pen is not missing as well.
        for key in keys.iter().filter(|k| k.required && !misspelt.contains(&k.name)) {
            if !table.keys().any(|k| k.get_ref() == key.name) {
                let finding = Finding::error(&span, format!("{} has no `{}`", self.whose(sections), key.name));
                self.add(finding.help(format!("add `{} = {}`: {}", key.name, example(&key.kind), key.doc)));
            }
        }
        values
    }

    fn whose(&self, sections: &[&Section]) -> String {
        if self.whose.is_empty() { sections.first().map_or("", |s| s.name).to_owned() } else { self.whose.clone() }
    }

    /// The finding about an unknown key; the known key that was probably meant.
    fn unknown_key<'k>(
        &mut self,
        entry: &Entry<'_>,
        sections: &[&Section],
        known: impl Iterator<Item = &'k str>,
    ) -> Option<&'k str> {
        let mut known: Vec<_> = known.collect();
        let mut seen = std::collections::HashSet::new();
        known.retain(|k| seen.insert(*k));
        let finding = Finding::error(&entry.key_span, format!("{} has no key `{}`", self.whose(sections), entry.name));
        let near = nearest(entry.name, known.iter().copied());
        self.add(match near {
            Some(near) => finding.help(format!("did you mean `{near}`?")),
            None if known.is_empty() => finding.help("it takes no keys"),
            None => finding.help(format!("it takes {}", known.join(", "))),
        });
        near
    }

    /// Reads one value; `None` when it does not fit, which is a finding.
    pub fn value(&mut self, kind: &Kind, name: &str, value: &DeValue<'_>, span: &Span) -> Option<Value> {
        match (kind, value) {
            (Kind::Text | Kind::Tag, DeValue::String(s)) => Some(Value::Text(s.to_string())),
            (Kind::Bool, DeValue::Boolean(b)) => Some(Value::Bool(*b)),
            (Kind::Integer { min, max }, DeValue::Integer(_)) => {
                let Some(i) = integer(value) else { return self.wrong(kind, name, value, span) };
                if i < *min || i > *max {
                    self.add(Finding::error(span, format!("`{name}` is {i}; expected {min} to {max}")));
                    return None;
                }
                Some(Value::Integer(i))
            }
            (Kind::Duration { min, max }, DeValue::String(s)) => {
                let ns = match parse_duration(s) {
                    Ok(ns) => ns,
                    Err(error) => {
                        self.add(Finding::error(span, format!("`{name}`: {error}")));
                        return None;
                    }
                };
                if ns < *min || ns > *max {
                    let (found, min, max) = (format_duration(ns), format_duration(*min), format_duration(*max));
                    self.add(Finding::error(span, format!("`{name}` is {found}; expected {min} to {max}")));
                    return None;
                }
                Some(Value::Duration(ns))
            }
            (Kind::Duration { .. }, DeValue::Integer(_) | DeValue::Float(_)) => {
                let found = number(value);
                self.add(
                    Finding::error(
                        span,
                        format!("`{name}` is the bare number {found}; expected a duration with its unit"),
                    )
                    .help(format!("write `{name} = \"{found}ms\"`, or with another unit: h, m, s, ms, us, ns")),
                );
                None
            }
            (Kind::Size { min, max }, DeValue::String(s)) => {
                let Some(bytes) = parse_size(s) else { return self.wrong(kind, name, value, span) };
                if bytes < *min || bytes > *max {
                    let (min, max) = (format_size(*min), format_size(*max));
                    self.add(Finding::error(span, format!("`{name}` is \"{s}\"; expected {min} to {max}")));
                    return None;
                }
                Some(Value::Size(bytes))
            }
            (Kind::OneOf(words), DeValue::String(s)) => {
                if words.contains(&s.as_ref()) {
                    return Some(Value::Text(s.to_string()));
                }
                let list = words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ");
                let finding = Finding::error(span, format!("`{name}` is \"{s}\"; expected one of {list}"));
                let near = nearest(s, words.iter().copied()).map(|n| format!("did you mean \"{n}\"?"));
                self.add(finding.maybe_help(near));
                None
            }
            (Kind::Constant, _) => match constant(value) {
                Some(c) => Some(Value::Constant(c)),
                None => self.wrong(kind, name, value, span),
            },
            (Kind::List(of), DeValue::Array(items)) => Some(Value::List(
                items
                    .iter()
                    .filter_map(|i| self.value(of, name, i.get_ref(), &i.span()).map(|v| (v, i.span())))
                    .collect(),
            )),
            (Kind::Table(section), DeValue::Table(t)) => {
                let outer = std::mem::replace(&mut self.whose, format!("`{name}`"));
                let values = self.table(&[section], t, span.clone());
                self.whose = outer;
                Some(Value::Table(values))
            }
            (Kind::Map(of), DeValue::Table(t)) => {
                let list = entries(t).into_iter().filter_map(|e| {
                    let value = self.value(of, e.name, e.value, &e.span)?;
                    Some((e.name.to_owned(), e.key_span, value, e.span))
                });
                Some(Value::Map(list.collect()))
            }
            (Kind::Either(one, other), _) => {
                let before = self.findings.len();
                if let Some(value) = self.value(one, name, value, span) {
                    return Some(value);
                }
                let of_one = self.findings.split_off(before);
                // What is closest in kind has the better message.
                if fits(one, value) {
                    self.findings.extend(of_one);
                    return None;
                }
                if fits(other, value) {
                    return self.value(other, name, value, span);
                }
                self.wrong(kind, name, value, span)
            }
            (Kind::Any, _) => match raw(value) {
                Some(raw) => Some(Value::Raw(raw)),
                None => self.wrong(kind, name, value, span),
            },
            _ => self.wrong(kind, name, value, span),
        }
    }

    fn wrong(&mut self, kind: &Kind, name: &str, value: &DeValue<'_>, span: &Span) -> Option<Value> {
        let message = format!("`{name}` is {}; expected {}", found(value), expected(kind));
        self.add(Finding::error(span, message).help(format!("as in `{name} = {}`", example(kind))));
        None
    }
}

/// Whether a value is of the TOML type that a kind is written in.
fn fits(kind: &Kind, value: &DeValue<'_>) -> bool {
    match kind {
        Kind::Text | Kind::Tag | Kind::Duration { .. } | Kind::Size { .. } | Kind::OneOf(_) => value.is_str(),
        Kind::Bool => value.is_bool(),
        Kind::Integer { .. } => value.is_integer(),
        Kind::List(_) => value.is_array(),
        Kind::Table(_) | Kind::Map(_) => value.is_table(),
        Kind::Constant => !value.is_array() && !value.is_table(),
        Kind::Either(one, other) => fits(one, value) || fits(other, value),
        Kind::Any => true,
    }
}
