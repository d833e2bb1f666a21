//! Which lane traces which tag.

use super::AssembleError;
use crate::layout::Layout;
use crate::model::{Model, TagRef};
use globset::{Glob, GlobMatcher};
use latchwork_image::{Resolved, TagId};

/// The traced tags and the lanes that trace them: a block's by its own lane, an input point by every lane that reads it.
pub(super) fn traced_tags(
    model: &Model,
    layout: &Layout,
    glob: Option<&str>,
) -> Result<Vec<(TagId, Vec<usize>)>, AssembleError> {
    let Some(glob) = glob else { return Ok(Vec::new()) };
    let matcher: GlobMatcher = Glob::new(glob)
        .map_err(|e| AssembleError::Glob { glob: glob.into(), error: e.kind().to_string() })?
        .compile_matcher();
    let mut traced: Vec<(TagId, Vec<usize>)> = Vec::new();
    for (what, id) in &layout.ids {
        let lanes = match *what {
            TagRef::Lane { lane, .. } if glob.starts_with("lane.") => vec![lane],
            TagRef::Lane { .. } => continue,
            TagRef::Point { .. } => point_lanes(model, layout, *id),
            TagRef::Input { block, .. }
            | TagRef::Output { block, .. }
            | TagRef::Alarm { block, .. }
            | TagRef::Command { block, .. }
            | TagRef::Setting { block, .. } => vec![model.blocks[block].lane],
        };
        if matcher.is_match(&layout.tags.get(*id).name) {
            traced.push((*id, lanes));
        }
    }
    traced.sort_unstable();
    Ok(traced)
}

/// The lanes that see a point: the one that writes it, or those that read it, or the first.
fn point_lanes(model: &Model, layout: &Layout, id: TagId) -> Vec<usize> {
    let Ok(Resolved::Cell { location, .. }) = layout.tags.resolve(id) else { return vec![0] };
    if (location.region as usize) < model.lanes.len() {
        return vec![location.region as usize];
    }
    let reads = |lane: &crate::layout::LaneLayout| {
        lane.imports.iter().any(|(r, list)| *r == location.region && list.iter().any(|(s, _)| *s == location.slot))
    };
    let lanes: Vec<_> = layout.lanes.iter().enumerate().filter(|(_, l)| reads(l)).map(|(i, _)| i).collect();
    if lanes.is_empty() { vec![0] } else { lanes }
}
