//! Wires: from a source to a port of the same type.

use super::drivers::DriverDraft;
use super::tags::Tags;
use crate::file::{PlantFile, Source};
use crate::model::{TagRef, Wire};
use latchwork_image::Type;
use latchwork_schema::{Checker, Finding, Span};

/// Where a wire ends.
pub(super) struct End<'a> {
    /// Name of the port or point.
    pub(super) name: &'a str,
    /// Its type.
    pub(super) ty: &'a Type,
}

/// A wire from a tag of a name, or a finding.
pub(super) fn wire(
    checker: &mut Checker,
    tags: &Tags,
    name: &str,
    not: bool,
    end: &End<'_>,
    span: &Span,
) -> Option<Wire> {
    let source = tags.find(checker, name, span)?;
    if not && source.ty != Type::Bool {
        let message = format!("`not` inverts a bool; `{name}` is {}", source.ty);
        checker.add(Finding::error(span, message).help("take `not` out"));
        return None;
    }
    if source.ty != *end.ty {
        let message = format!("`{}` takes {}; `{name}` is {}", end.name, end.ty, source.ty);
        checker.add(Finding::error(span, message).maybe_help(conversion(&source.ty, end.ty)));
        return None;
    }
    Some(Wire { tag: source.tag, not })
}

/// A way out for two types that differ.
fn conversion(from: &Type, to: &Type) -> Option<String> {
    match (from, to) {
        (Type::U16, Type::F64) => {
            Some("a wire converts nothing; a block of component \"scale\" makes a real number of a word".into())
        }
        _ => Some("a wire converts nothing; put a block between, or change the type of the point".into()),
    }
}

/// `from` of output points.
pub(super) fn outputs(checker: &mut Checker, drivers: &mut [DriverDraft<'_>], tags: &Tags) {
    for draft in drivers {
        let Some(driver) = &mut draft.driver else { continue };
        for (point, source) in driver.config.points.iter().zip(&mut driver.sources) {
            let Some(from) = point.values.text("from") else { continue };
            let name = format!("{}.{}", driver.config.name, point.name);
            // Without --sim an output may still name a block of [sim] by mistake; the finding says so.
            *source =
                wire(checker, tags, from, false, &End { name: &name, ty: &point.ty }, &point.values.span_of("from"));
        }
    }
}

/// `[sim.feed]`: tags that drive input points.
pub(super) fn feeds(checker: &mut Checker, file: &PlantFile, drivers: &mut [DriverDraft<'_>], tags: &Tags) {
    for feed in &file.feeds {
        let Source::Tag { tag, not } = &feed.source else { continue };
        let Some(target) = tags.find(checker, &feed.path, &feed.key) else { continue };
        let TagRef::Point { driver, point } = target.tag else {
            let message = format!("`{}` is no point of a driver; a feed drives an input point", feed.path);
            checker.add(Finding::error(&feed.key, message));
            continue;
        };
        let Some(draft) = drivers.iter_mut().filter_map(|d| d.driver.as_mut()).nth(driver) else { continue };
        if draft.config.points[point].safe.is_some() {
            let message =
                format!("`{}` is an output point, driven by its `from`; a feed drives an input point", feed.path);
            checker.add(Finding::error(&feed.key, message));
            continue;
        }
        let ty = draft.config.points[point].ty.clone();
        draft.sources[point] = wire(checker, tags, tag, *not, &End { name: &feed.path, ty: &ty }, &feed.span);
    }
}
