//! Values of a test file against the ports of a class.

use super::keys;
use super::model::{Expected, SetCell};
use latchwork_block::Port;
use latchwork_image::{Quality, Type, nearest};
use latchwork_schema::check::{constant, entries, found};
use latchwork_schema::{Checker, Constant, Finding, Span, Values};
use toml::de::{DeTable, DeValue};

/// Most names that a message lists.
const LISTED: usize = 16;

/// One group of ports of a component, with the words for it; or tags of a plant.
#[derive(Clone, Copy)]
pub struct Group<'a> {
    /// Name of the component.
    pub component: &'a str,
    /// `inputs`; empty where the paths of the ports are their full names.
    pub name: &'static str,
    /// `input`
    pub one: &'static str,
    /// The ports.
    pub ports: &'a [Port],
}

/// A port with what is said of it.
pub struct Said<'t> {
    /// Index of the port.
    pub port: usize,
    /// What is said.
    pub value: &'t DeValue<'t>,
    /// Where.
    pub span: Span,
}

impl Group<'_> {
    /// The port of a path, or a finding.
    pub fn port(&self, checker: &mut Checker, path: &str, span: &Span) -> Option<usize> {
        let found = self.ports.iter().position(|p| p.path == path);
        if found.is_none() {
            let names = || self.ports.iter().map(|p| p.path.as_str());
            let below: Vec<_> = names().filter(|n| n.starts_with(&format!("{path}."))).collect();
            let finding = if below.is_empty() {
                Finding::error(span, format!("`{}` has no {} `{path}`", self.component, self.one))
            } else if self.name.is_empty() {
                Finding::error(
                    span,
                    format!("`{path}` of `{}` is no {}: it is the beginning of some", self.component, self.one),
                )
            } else {
                Finding::error(span, format!("{} `{path}` of `{}` is a record", self.one, self.component))
            };
            checker.add(match nearest(path, names()) {
                _ if !below.is_empty() && self.name.is_empty() => finding.help(format!("as in {}", listed(&below))),
                _ if !below.is_empty() => finding.help(format!("its fields are {}", listed(&below))),
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None if self.ports.is_empty() => finding.help(format!("its class has no {}", self.name)),
                None => finding.help(format!("it has {}", listed(&names().collect::<Vec<_>>()))),
            });
        }
        found
    }

    /// What a table says of ports, in the order of the file; fields of records by dots or as tables.
    pub fn said<'t>(&self, checker: &mut Checker, table: &'t DeTable<'t>) -> Vec<Said<'t>> {
        let mut list = Vec::new();
        self.collect(checker, table, "", &mut list);
        list
    }

    fn collect<'t>(&self, checker: &mut Checker, table: &'t DeTable<'t>, prefix: &str, list: &mut Vec<Said<'t>>) {
        for e in entries(table) {
            let path = format!("{prefix}{}", e.name);
            let below = |p: &Port| p.path.strip_prefix(&path).is_some_and(|rest| rest.starts_with('.'));
            match e.value {
                DeValue::Table(t) if self.ports.iter().any(below) => {
                    self.collect(checker, t, &format!("{path}."), list)
                }
                value => {
                    let Some(port) = self.port(checker, &path, &e.key_span) else { continue };
                    if list.iter().any(|s| s.port == port) {
                        let finding = Finding::error(&e.key_span, format!("`{path}` is given for the second time"));
                        checker.add(finding.help("keep one of them"));
                    } else {
                        list.push(Said { port, value, span: e.span });
                    }
                }
            }
        }
    }

    /// Index of the cell of a port, when each signal has its quality behind its value.
    pub fn cell(&self, port: usize) -> usize {
        self.ports[..port].iter().map(|p| 1 + usize::from(p.signal)).sum()
    }

    /// Full name of a port, as messages and reports have it.
    pub fn full(&self, port: usize) -> String {
        let path = &self.ports[port].path;
        if self.name.is_empty() { path.clone() } else { format!("{}.{path}", self.name) }
    }

    /// A constant for a port without quality: of settings or state.
    pub fn constant(&self, checker: &mut Checker, said: &Said<'_>) -> Option<u64> {
        let name = self.full(said.port);
        if matches!(said.value, DeValue::Table(table) if table.contains_key("quality")) {
            let message = format!("`{name}` is given a quality; only inputs and expected outputs have one");
            checker.add(Finding::error(&said.span, message).help(alone(&self.ports[said.port])));
            return None;
        }
        let constant = plain(checker, &name, said.value, &said.span, "a value")?;
        checker.cell(&self.ports[said.port].ty, &constant, &name, &said.span)
    }

    /// An input: a value, or `{ value, quality }` of a signal.
    pub fn input(&self, checker: &mut Checker, said: &Said<'_>) -> Vec<SetCell> {
        let (port, name, at) = (&self.ports[said.port], self.full(said.port), self.cell(said.port));
        let DeValue::Table(table) = said.value else {
            let or = if port.signal { "a value or { value, quality }" } else { "a value" };
            let constant = plain(checker, &name, said.value, &said.span, or);
            let cell = constant.and_then(|c| checker.cell(&port.ty, &c, &name, &said.span));
            return cell.map(|value| good(at, value, port.signal)).unwrap_or_default();
        };
        if !port.signal {
            no_signal(checker, &name, port, &said.span, &alone(port));
            return Vec::new();
        }
        let values = with_name(checker, &name, |checker| checker.table(&[&keys::SIGNAL], table, said.span.clone()));
        let mut cells = Vec::new();
        if let Some(value) = values.constant("value") {
            let cell = checker.cell(&port.ty, value, &name, &values.span_of("value"));
            cells.extend(cell.map(|value| SetCell { cell: at, value }));
        }
        cells.push(SetCell { cell: at + 1, value: quality(&values).unwrap_or(Quality::Good).cell() });
        cells
    }

    /// An expectation: a value, or `{ value, within, quality }`. `tolerance` is that of reals.
    pub fn expected(&self, checker: &mut Checker, said: &Said<'_>, tolerance: f64) -> Option<Expected> {
        let (port, name) = (&self.ports[said.port], self.full(said.port));
        let mut expected = self.nothing(said.port, tolerance);
        let DeValue::Table(table) = said.value else {
            let constant = plain(checker, &name, said.value, &said.span, "a value or { value, within }")?;
            expected.value = Some(checker.cell(&port.ty, &constant, &name, &said.span)?);
            return Some(expected);
        };
        let values = with_name(checker, &name, |checker| checker.table(&[&keys::EXPECTED], table, said.span.clone()));
        if let Some(value) = values.constant("value") {
            expected.value = Some(checker.cell(&port.ty, value, &name, &values.span_of("value"))?);
        }
        if let Some(within) = values.constant("within") {
            expected.within = self.within(checker, port, within, &values.span_of("within"))?;
        }
        expected.quality = quality(&values);
        if expected.quality.is_some() && !port.signal {
            no_signal(checker, &name, port, &values.span_of("quality"), &alone(port));
            return None;
        }
        if expected.value.is_none() && expected.quality.is_none() {
            let finding = Finding::error(&said.span, format!("`{name}` expects nothing"));
            checker.add(finding.help("give a `value`, or the `quality` of a signal"));
            return None;
        }
        Some(expected)
    }

    /// An expectation of a port that has yet to be filled in.
    pub fn nothing(&self, port: usize, tolerance: f64) -> Expected {
        let ty = &self.ports[port].ty;
        Expected {
            name: self.full(port),
            ty: ty.clone(),
            cell: self.cell(port),
            value: None,
            within: if matches!(ty, Type::F32 | Type::F64) { tolerance } else { 0.0 },
            quality: None,
        }
    }

    fn within(&self, checker: &mut Checker, port: &Port, within: &Constant, span: &Span) -> Option<f64> {
        let name = if self.name.is_empty() {
            format!("within of {}", port.path)
        } else {
            format!("within of {}.{}", self.name, port.path)
        };
        match &port.ty {
            Type::Duration => checker.cell(&port.ty, within, &name, span).map(|ns| ns as f64),
            Type::Bool | Type::Enum(_) | Type::Flags(_) => {
                let message = format!("`within` is for numbers and durations; `{}` is a {}", port.path, port.ty.kind());
                checker.add(Finding::error(span, message).help("expect the one value"));
                None
            }
            _ => tolerance(checker, "within", within, span),
        }
    }
}

/// A tolerance: a number that is finite and not negative.
pub fn tolerance(checker: &mut Checker, name: &str, given: &Constant, span: &Span) -> Option<f64> {
    let number = match given {
        Constant::Integer(i) => *i as f64,
        Constant::Real(r) => *r,
        _ => f64::NAN,
    };
    if number.is_finite() && number >= 0.0 {
        return Some(number);
    }
    let shown = match given {
        Constant::Bool(b) => b.to_string(),
        Constant::Text(t) => format!("the string \"{t}\""),
        Constant::Integer(i) => i.to_string(),
        Constant::Real(r) => format!("{r:?}"),
    };
    checker.add(Finding::error(span, format!("`{name}` is {shown}; expected a number, 0 or more")));
    None
}

/// Cells of an input that is given as a plain value: a signal is good then.
pub(super) fn good(cell: usize, value: u64, signal: bool) -> Vec<SetCell> {
    let quality = SetCell { cell: cell + 1, value: Quality::Good.cell() };
    [SetCell { cell, value }].into_iter().chain(signal.then_some(quality)).collect()
}

/// A quality by its word.
pub(super) fn quality_of(word: &str) -> Option<Quality> {
    [Quality::Good, Quality::Uncertain, Quality::Bad].into_iter().find(|q| q.name() == word)
}

fn quality(values: &Values) -> Option<Quality> {
    values.text("quality").and_then(quality_of)
}

/// A finding for the quality of a port that has none.
pub(super) fn no_signal(checker: &mut Checker, name: &str, port: &Port, span: &Span, help: &str) {
    let message = format!("`{name}` is a plain {}, without quality", port.ty.kind());
    checker.add(Finding::error(span, message).help(help));
}

/// The way out where a quality is given that there is not.
fn alone(port: &Port) -> String {
    format!("write `{} = …` with the value alone", port.path)
}

/// Names in a sentence: the first of them, and how many there are besides.
pub fn listed(names: &[&str]) -> String {
    let mut list = names[..names.len().min(LISTED)].join(", ");
    if names.len() > LISTED {
        list += &format!(" and {} more", names.len() - LISTED);
    }
    list
}

fn plain(checker: &mut Checker, name: &str, value: &DeValue<'_>, span: &Span, expected: &str) -> Option<Constant> {
    let read = constant(value);
    if read.is_none() {
        checker.add(Finding::error(span, format!("`{name}` is {}; expected {expected}", found(value))));
    }
    read
}

/// Reads with findings that speak of one port.
fn with_name<T>(checker: &mut Checker, name: &str, read: impl FnOnce(&mut Checker) -> T) -> T {
    let outer = std::mem::replace(&mut checker.whose, format!("`{name}`"));
    let read = read(checker);
    checker.whose = outer;
    read
}
