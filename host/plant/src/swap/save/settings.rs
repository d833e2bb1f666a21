//! With the component its settings: the next start has to begin with those that run, and the component has to take them.

use super::{Keep, Known, SINK, SaveError, edited};
use crate::assemble::blocks::complete;
use crate::file::{Assignment, PlantFile, Source};
use crate::model::{Block, Model};
use latchwork_block::{Engine, Fault, Instance, Limits, Port};
use latchwork_image::{Type, Value};
use latchwork_schema::Span;
use std::collections::BTreeMap;

/// Ticks for a call: the thread has what the processor has left.
const PATIENCE: u64 = 1000;

impl Known {
    /// The text with settings where the plant would start with others than run now; a component that does not take what it
    /// would start with is not saved.
    pub(super) fn settle(&self, engine: &Engine, text: String, keep: &[Keep]) -> Result<String, SaveError> {
        let model = self.right(engine, &text)?;
        let file = self.parse(&text)?;
        let (mut edits, mut lines) = (Vec::new(), BTreeMap::new());
        for (keep, block) in blocks(&model, keep) {
            for (port, cell) in others(keep, block)? {
                self.write(&file, &text, &keep.block, port, cell, (&mut edits, &mut lines))?;
            }
        }
        edits.extend(lines.into_iter().map(|(at, lines)| (at..at, lines)));
        if edits.is_empty() {
            return start(&model, keep).map(|()| text);
        }
        let text = edited(&text, edits);
        let model = self.right(engine, &text)?;
        for (keep, block) in blocks(&model, keep) {
            if let Some((port, cell)) = others(keep, block)?.first() {
                return Err(by_hand(&keep.block, port, *cell));
            }
        }
        start(&model, keep).map(|()| text)
    }

    /// Writes one setting: in the place of its value, or in a line of its own.
    fn write(
        &self,
        file: &PlantFile,
        text: &str,
        block: &str,
        port: &Port,
        cell: u64,
        (edits, lines): (&mut Vec<(Span, String)>, &mut BTreeMap<usize, String>),
    ) -> Result<(), SaveError> {
        let entry = file.blocks.iter().find(|b| b.name == block && (self.sim || !b.sim));
        let Some(entry) = entry else { return Err(by_hand(block, port, cell)) };
        let value = literal(&port.ty, cell);
        if let Some(there) = entry.settings.iter().find(|a| a.path == port.path) {
            edits.push((there.span.clone(), value));
            return Ok(());
        }
        let beside = entry.settings.iter().find_map(|a| beside(text, a));
        let below = || below(text, &entry.values.span_of("component"));
        let Some((at, before, feed)) = beside.or_else(below) else { return Err(by_hand(block, port, cell)) };
        *lines.entry(at).or_default() += &line(at, text, &format!("{before}{} = {value}", port.path), feed);
        Ok(())
    }
}

/// Blocks that are saved, as the plant file has them now.
fn blocks<'a>(model: &'a Model, keep: &'a [Keep]) -> impl Iterator<Item = (&'a Keep, &'a Block)> {
    let of = |name: &str| model.blocks.iter().find(|b| b.name == name);
    keep.iter().filter(|k| !k.block.starts_with(SINK)).filter_map(move |k| Some((k, of(&k.block)?)))
}

/// An instance as the next start makes it, and the settings it gets.
fn made(block: &Block) -> Result<(Instance, Vec<u64>), SaveError> {
    let wrong = |fault: Fault| SaveError::Settings(block.name.clone(), fault.message);
    let template = block.component.template(&block.class);
    let template = template.map_err(|e| SaveError::Settings(block.name.clone(), e.to_string()))?;
    let limits = Limits { memory: block.memory, budget_ticks: PATIENCE, ..Limits::default() };
    let mut instance = template.instantiate(&limits).map_err(wrong)?;
    let defaults = instance.defaults().map_err(wrong)?;
    let settings = complete(&block.class, &block.settings, defaults.as_deref());
    Ok((instance, settings))
}

/// Settings that run with other values than the next start would give them.
fn others<'a>(keep: &Keep, block: &'a Block) -> Result<Vec<(&'a Port, u64)>, SaveError> {
    let (_, settings) = made(block)?;
    let runs = |port: &Port| keep.settings.iter().find(|(name, _)| *name == port.path).map(|(_, cell)| *cell);
    let ports = block.class.settings.iter().zip(settings);
    Ok(ports.filter_map(|(port, cell)| runs(port).filter(|runs| *runs != cell).map(|runs| (port, runs))).collect())
}

/// Each one takes what it would start with.
fn start(model: &Model, keep: &[Keep]) -> Result<(), SaveError> {
    for (_, block) in blocks(model, keep) {
        let (mut instance, settings) = made(block)?;
        let refused = match instance.configure(&settings) {
            Ok(Ok(())) => continue,
            Ok(Err(sentence)) => sentence,
            Err(fault) => fault.message,
        };
        return Err(SaveError::Settings(block.name.clone(), refused));
    }
    Ok(())
}

/// The line before a setting that stands on one of its own, what comes before the name there, and whether a line feed is missing.
fn beside(text: &str, setting: &Assignment) -> Option<(usize, String, bool)> {
    let Source::Constant(_) = setting.source else { return None };
    let at = text[..setting.key.start].rfind('\n').map_or(0, |at| at + 1);
    let before = &text[at..setting.key.start];
    let parents = setting.path.rfind('.').map_or("", |dot| &setting.path[..=dot]);
    let before = before.strip_suffix(parents)?;
    let plain = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '\t' | '.' | '-' | '_');
    before.chars().all(plain).then(|| (at, before.to_owned(), false))
}

/// The line below the component's name, if that stands in a table of its own.
fn below(text: &str, name: &Span) -> Option<(usize, String, bool)> {
    let at = text[..name.start].rfind('\n').map_or(0, |at| at + 1);
    let key = text[at..name.start].trim_start_matches([' ', '\t']);
    let indent = &text[at..name.start - key.len()];
    if key.trim_end_matches([' ', '\t']).strip_suffix('=').map(str::trim_end) != Some("component") {
        return None;
    }
    let settings = |at| Some((at, format!("{indent}settings."), at == text.len() && !text.ends_with('\n')));
    text[name.end..].find('\n').map_or(settings(text.len()), |feed| settings(name.end + feed + 1))
}

/// A line to insert: it ends as the others do.
fn line(at: usize, text: &str, what: &str, feed: bool) -> String {
    let end = if text[..at].ends_with("\r\n") { "\r\n" } else { "\n" };
    if feed { format!("{end}{what}") } else { format!("{what}{end}") }
}

/// A value as it stands in a plant file.
fn literal(ty: &Type, cell: u64) -> String {
    match ty.value(cell) {
        Value::Boolean(on) => on.to_string(),
        Value::Real(real) => toml::Value::Float(real).to_string(),
        Value::Integer(whole) => whole.to_string(),
        other => toml::Value::String(other.to_string()).to_string(),
    }
}

fn by_hand(block: &str, port: &Port, cell: u64) -> SaveError {
    SaveError::ByHand(block.into(), format!("settings.{} = {}", port.path, literal(&port.ty, cell)))
}
