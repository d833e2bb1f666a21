//! The list for people, for spreadsheets and for programs.

use super::{memory, rule};
use anyhow::Result;
use comfy_table::{Table, presets};
use latchwork_plant::model::Model;
use serde::Serialize;
use std::fmt::Write;

/// Columns of the CSV list.
pub(super) const COLUMNS: [&str; 5] = ["id", "tag name", "code", "memory type", "data type"];

/// For a terminal: what has a code, what has none, which rule is of no use.
pub(super) fn table(model: &Model) -> String {
    let mut out = String::new();
    let (with, without): (Vec<_>, Vec<_>) = model.variables.iter().partition(|v| v.rule.is_some());
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["variable", "code", "what", "priority", "line", "by the rule"]);
    for variable in &with {
        let Some(rule) = rule(model, variable) else { continue };
        table.add_row([
            variable.name.clone(),
            format!("{:#06X}", rule.code.bits()),
            rule.code.words().into(),
            rule.priority.to_string(),
            rule.line.to_string(),
            rule.pattern.clone(),
        ]);
    }
    // Writing to a String never fails.
    let _ = match with.len() {
        0 => writeln!(out, "No variable has a code."),
        _ => writeln!(out, "{table}"),
    };
    if !without.is_empty() {
        let _ = writeln!(out, "\nWithout a code, {}:", without.len());
        for variable in without {
            let what = if variable.is_command() { "command" } else { "alarm" };
            let _ = writeln!(out, "  {} ({what})", variable.name);
        }
    }
    let mut idle = model.alarm_rules.iter().filter(|r| r.matched == 0).peekable();
    if idle.peek().is_some() {
        let _ = writeln!(out, "\nRules that match nothing:");
        for rule in idle {
            let _ = writeln!(out, "  line {}: {} ({:#06X})", rule.line, rule.pattern, rule.code.bits());
        }
    }
    out
}

/// For spreadsheets, and for `--import`: variables without a code have an empty one.
pub(super) fn csv(model: &Model) -> Result<String> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(COLUMNS)?;
    for (id, variable) in (1..).zip(&model.variables) {
        let code = rule(model, variable).map_or(String::new(), |r| r.code.bits().to_string());
        csv.write_record([&id.to_string(), &variable.name, &code, memory(model, variable.tag), "BOOL"])?;
    }
    Ok(String::from_utf8(csv.into_inner().map_err(|e| e.into_error())?)?)
}

#[derive(Serialize)]
struct Document<'a> {
    plant: &'a str,
    variables: Vec<Row<'a>>,
    rules: Vec<RuleRow<'a>>,
}

#[derive(Serialize)]
struct Row<'a> {
    id: usize,
    name: &'a str,
    command: bool,
    code: Option<u16>,
    what: Option<&'static str>,
    /// Number of the rule in `rules`, from 0.
    rule: Option<usize>,
    priority: Option<u8>,
    group: Option<&'a str>,
    text: &'a str,
}

#[derive(Serialize)]
struct RuleRow<'a> {
    line: usize,
    r#match: &'a str,
    code: u16,
    matched: usize,
}

/// For programs.
pub(super) fn json(model: &Model) -> Result<String> {
    let variables = (1..).zip(&model.variables).map(|(id, variable)| {
        let rule = rule(model, variable);
        Row {
            id,
            name: &variable.name,
            command: variable.is_command(),
            code: rule.map(|r| r.code.bits()),
            what: rule.map(|r| r.code.words()),
            rule: variable.rule,
            priority: rule.map(|r| r.priority),
            group: variable.group.as_deref(),
            text: &variable.text,
        }
    });
    let rules = model.alarm_rules.iter().map(|r| RuleRow {
        line: r.line,
        r#match: &r.pattern,
        code: r.code.bits(),
        matched: r.matched,
    });
    let document = Document { plant: &model.name, variables: variables.collect(), rules: rules.collect() };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}
