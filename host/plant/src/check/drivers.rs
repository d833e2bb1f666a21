//! Drivers and their points.

use super::values::cell;
use crate::file::{DriverEntry, PlantFile, PointEntry};
use crate::model;
use latchwork_io::driver::{DriverConfig, DriverKind, PointConfig, PointShape, Problem};
use latchwork_schema::{Checker, Finding, Span};

/// A driver while it is checked.
pub(super) struct DriverDraft<'a> {
    pub(super) entry: &'a DriverEntry,
    /// The driver of the model, if its kind is known. Its points are those that are sound.
    pub(super) driver: Option<model::Driver>,
    /// Points that are there but broken: a wire to one is no further error.
    pub(super) broken: Vec<&'a str>,
    /// Name of the driver, if it may have points that could not be read: a wire to one is no further error either.
    pub(super) unread: Option<&'a str>,
}

pub(super) fn drivers<'a>(checker: &mut Checker, file: &'a PlantFile) -> Vec<DriverDraft<'a>> {
    file.drivers.iter().map(|entry| driver(checker, entry)).collect()
}

fn driver<'a>(checker: &mut Checker, entry: &'a DriverEntry) -> DriverDraft<'a> {
    let unread = (!entry.points_known).then_some(entry.name.as_str());
    let Some(kind) = entry.kind else {
        let broken = entry.points.iter().map(|p| p.name.as_str()).collect();
        return DriverDraft { entry, driver: None, broken, unread };
    };
    let (mut points, mut shapes, mut broken) = (Vec::new(), Vec::new(), Vec::new());
    for point in &entry.points {
        match shape(checker, kind, point) {
            Some((config, shape)) => {
                points.push(config);
                shapes.push(shape);
            }
            None => broken.push(point.name.as_str()),
        }
    }
    let config = DriverConfig { name: entry.name.clone(), values: entry.values.clone(), points };
    let problems = if entry.sound { (kind.check)(&config) } else { Vec::new() };
    for (point, shape) in config.points.iter().zip(&shapes) {
        if problems.iter().any(|p| p.point.as_ref() == Some(&point.name)) {
            continue;
        }
        let Some(at) = entry.points.iter().find(|p| p.name == point.name) else { continue };
        if point.safe.is_some() && !shape.writable {
            let message = format!("`{}.{}` can only be read; it cannot show a tag", entry.name, point.name);
            checker.add(Finding::error(&at.values.span_of("from"), message).help("take `from` out"));
        } else if point.safe.is_none() && !shape.readable {
            let message = format!("`{}.{}` can only be written; it needs a tag to show", entry.name, point.name);
            checker.add(Finding::error(&at.key, message).help("add `from = \"BLOCK.outputs.PORT\"`"));
        }
    }
    for problem in problems {
        add(checker, entry, problem);
    }
    let sources = vec![None; config.points.len()];
    DriverDraft { entry, driver: Some(model::Driver { kind, config, sources }), broken, unread }
}

/// A point's configuration and what it can be, or findings.
fn shape(checker: &mut Checker, kind: &DriverKind, point: &PointEntry) -> Option<(PointConfig, PointShape)> {
    if !point.sound {
        return None;
    }
    let shape = match (kind.point)(&point.values) {
        Ok(shape) => shape,
        Err(problems) => {
            for p in problems {
                let finding = Finding::error(&place(&point.values, &p.key, &point.key), p.message);
                checker.add(finding.maybe_help(p.help));
            }
            return None;
        }
    };
    let safe = point.values.constant("safe");
    let safe = if point.values.has("from") {
        match safe {
            Some(constant) => Some(cell(checker, &shape.ty, constant, "safe", &point.values.span_of("safe"))?),
            None => Some(0),
        }
    } else {
        if safe.is_some() {
            let finding = Finding::error(&point.values.span_of("safe"), "an input point has no safe value");
            checker.add(finding.help("add `from` to make it an output point, or take `safe` out"));
        }
        None
    };
    let config = PointConfig { name: point.name.clone(), values: point.values.clone(), ty: shape.ty.clone(), safe };
    Some((config, shape))
}

fn add(checker: &mut Checker, entry: &DriverEntry, problem: Problem) {
    let point = problem.point.as_ref().and_then(|name| entry.points.iter().find(|p| &p.name == name));
    let span = match point {
        Some(p) => place(&p.values, &problem.key, &p.key),
        None => place(&entry.values, &problem.key, &entry.key),
    };
    checker.add(Finding::error(&span, problem.message).maybe_help(problem.help));
}

/// Where a key's value stands; `otherwise` when the file does not have it.
fn place(values: &latchwork_schema::Values, key: &str, otherwise: &Span) -> Span {
    if values.has(key) { values.span_of(key) } else { otherwise.clone() }
}
