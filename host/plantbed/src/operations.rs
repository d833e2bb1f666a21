//! What a step wants of the plant, as an operator would want it.

use crate::keys::SHELF;
use crate::model::Input;
use crate::tags::Tags;
use latchwork_image::Quality;
use latchwork_plant::operate::Operation;
use latchwork_schema::check::entries;
use latchwork_schema::{Checker, Entry, Kind, Span, Value, Values};
use latchwork_testbed::case::kit::{Said, get, group};
use toml::de::{DeTable, DeValue};

/// `inputs`: points with their values and qualities.
pub(crate) fn inputs(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>) -> Vec<Input> {
    let Some(given) = group(checker, table, "inputs") else { return Vec::new() };
    let mut list = Vec::new();
    for said in tags.group().said(checker, given) {
        list.extend(input(checker, tags, &said));
    }
    list
}

/// One input point: a value, which is good, or `{ value, quality }`.
pub(crate) fn input(checker: &mut Checker, tags: &Tags, said: &Said<'_>) -> Option<Input> {
    let (tag, group) = (&tags.all[said.port].path, tags.group());
    let cells = tags.driven(checker, tag, &said.span).then(|| group.input(checker, said))?;
    let at = group.cell(said.port);
    let cell = |cell| cells.iter().find(|c| c.cell == cell).map(|c| c.value);
    Some(Input { tag: tag.clone(), cell: cell(at), quality: Quality::from_cell(cell(at + 1)?) })
}

/// `settings` of a case: in the place of those of the plant file.
pub(crate) fn settings(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>) -> Vec<(String, u64)> {
    cells(checker, tags, table, "settings", Tags::set)
}

type May = fn(&Tags, &mut Checker, &str, &Span) -> bool;

/// Tags of a table with their values, those for which `may` finds nothing wrong.
fn cells(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>, name: &str, may: May) -> Vec<(String, u64)> {
    let Some(given) = group(checker, table, name) else { return Vec::new() };
    let mut list = Vec::new();
    for said in tags.group().said(checker, given) {
        let tag = &tags.all[said.port].path;
        if may(tags, checker, tag, &said.span)
            && let Some(cell) = tags.group().constant(checker, &said)
        {
            list.push((tag.clone(), cell));
        }
    }
    list
}

/// The same with the values as text.
pub(crate) fn texts(
    checker: &mut Checker,
    tags: &Tags,
    table: &DeTable<'_>,
    name: &str,
    may: May,
) -> Vec<(String, String)> {
    let text = |(tag, cell): (String, u64)| {
        let ty = tags.all.iter().find(|p| p.path == tag).map(|p| &p.ty)?;
        let text = ty.format(cell);
        Some((tag, text))
    };
    cells(checker, tags, table, name, may).into_iter().filter_map(text).collect()
}

/// `force` and `unforce`.
pub(crate) fn forces(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>, values: &Values) -> Vec<Operation> {
    let forced = texts(checker, tags, table, "force", |_, _, _, _| true);
    let force = forced.into_iter().map(|(tag, value)| Operation::Force { tag, value });
    let mut list: Vec<_> = force.collect();
    for (tag, span) in names(values.get("unforce")) {
        if tag.contains(['*', '?', '[', '{']) || tags.group().port(checker, tag, span).is_some() {
            list.push(Operation::Unforce { tag: tag.into() });
        }
    }
    list
}

/// `commands`: a list, or a table with on and off.
pub(crate) fn commands(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>) -> Vec<Operation> {
    let given = match listed(checker, table, "commands", &Kind::Bool) {
        Listed::Names(names) => names.into_iter().map(|(tag, span)| (tag, span, true)).collect(),
        Listed::Map(map) => {
            let on = |(tag, key, value, _)| if let Value::Bool(on) = value { Some((tag, key, on)) } else { None };
            map.into_iter().filter_map(on).collect::<Vec<_>>()
        }
    };
    let known = given.into_iter().filter(|(tag, span, _)| tags.command(checker, tag, span));
    known.map(|(tag, _, on)| Operation::Command { tag, on: Some(on) }).collect()
}

/// `ack`, `reset`, `shelve`, `unshelve`.
pub(crate) fn alarms(checker: &mut Checker, tags: &Tags, table: &DeTable<'_>, values: &Values) -> Vec<Operation> {
    type Of = fn(String) -> Operation;
    let mut list = Vec::new();
    let wishes: [(&str, Of); 3] = [
        ("ack", |alarm| Operation::Acknowledge { alarm, seen: None }),
        ("reset", |alarm| Operation::Reset { alarm }),
        ("unshelve", |alarm| Operation::Unshelve { alarm }),
    ];
    for (key, wish) in wishes {
        for (name, span) in names(values.get(key)) {
            if tags.alarms(checker, name, span) {
                list.push(wish(name.into()));
            }
        }
    }
    for (alarm, key, value, _) in map(checker, table, "shelve", &SHELF) {
        if let Value::Duration(duration) = value
            && tags.alarms(checker, &alarm, &key)
        {
            list.push(Operation::Shelve { alarm, duration });
        }
    }
    list
}

/// One entry of a table of names: name, where it stands, value, where that stands.
pub(crate) type Named = (String, Span, Value, Span);

/// What is either a list of names or a table of them.
pub(crate) enum Listed {
    /// A list.
    Names(Vec<(String, Span)>),
    /// A table.
    Map(Vec<Named>),
}

/// A list of names, or a table whose values are of a kind.
pub(crate) fn listed(checker: &mut Checker, table: &DeTable<'_>, key: &str, of: &'static Kind) -> Listed {
    match get(table, key) {
        Some(Entry { value: value @ DeValue::Array(_), span, .. }) => {
            let list = checker.value(&Kind::List(&Kind::Text), key, value, &span);
            Listed::Names(names(list.as_ref()).map(|(name, span)| (name.to_owned(), span.clone())).collect())
        }
        Some(Entry { value: DeValue::Table(_), .. }) => Listed::Map(map(checker, table, key, of)),
        Some(Entry { value, span, .. }) => {
            checker.value(&Kind::List(&Kind::Text), key, value, &span);
            Listed::Names(Vec::new())
        }
        None => Listed::Names(Vec::new()),
    }
}

/// A table by names, whose dots may be those of TOML: `{ unit.alarms.high = … }`.
pub(crate) fn map(checker: &mut Checker, table: &DeTable<'_>, key: &str, of: &'static Kind) -> Vec<Named> {
    let mut list = Vec::new();
    if let Some(given) = group(checker, table, key) {
        leaves(checker, given, "", of, &mut list);
    }
    list
}

fn leaves(checker: &mut Checker, table: &DeTable<'_>, prefix: &str, of: &Kind, list: &mut Vec<Named>) {
    for entry in entries(table) {
        let name = format!("{prefix}{}", entry.name);
        if let DeValue::Table(below) = entry.value {
            leaves(checker, below, &format!("{name}."), of, list);
        } else if let Some(value) = checker.value(of, &name, entry.value, &entry.span) {
            list.push((name, entry.key_span, value, entry.span));
        }
    }
}

/// The texts of a list.
pub(crate) fn names(list: Option<&Value>) -> impl Iterator<Item = (&str, &Span)> {
    let list = if let Some(Value::List(list)) = list { list.as_slice() } else { &[] };
    list.iter().filter_map(|(v, span)| if let Value::Text(t) = v { Some((t.as_str(), span)) } else { None })
}
