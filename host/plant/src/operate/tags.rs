//! Tags by name or glob, with their values.

use super::{AlarmRow, Refused, TagRow};
use crate::assemble::Plant;
use crate::model::TagRef;
use globset::{Glob, GlobMatcher};
use latchwork_image::{TagId, Type, nearest};
use serde_json::Value;

/// A glob of tags.
pub(super) fn glob(text: &str) -> Result<GlobMatcher, Refused> {
    let glob = Glob::new(text).map_err(|e| {
        Refused::new(
            "value",
            format!("`{text}` is no glob of tags: {}; use * and ?, as in \"unit.outputs.*\"", e.kind()),
        )
    })?;
    Ok(glob.compile_matcher())
}

pub(super) fn is_glob(text: &str) -> bool {
    text.contains(['*', '?', '[', '{'])
}

/// A cell as JSON.
pub(super) fn shown(ty: &Type, cell: u64) -> Value {
    serde_json::to_value(ty.value(cell)).unwrap_or(Value::Null)
}

impl Plant {
    /// The tag of a name, and what it is.
    pub(super) fn tag(&self, name: &str) -> Result<(TagId, TagRef), Refused> {
        let found = self.layout.tags.find(name).and_then(|id| Some((id, *self.desk.refs.get(&id)?)));
        found.ok_or_else(|| {
            let near = nearest(name, self.layout.tags.iter().map(|(_, t)| t.name.as_str()));
            let hint = near.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            Refused::new("unknown", format!("there is no tag `{name}`{hint}"))
        })
    }

    /// The tags that names and globs mean, in the order of the plant.
    pub(super) fn tags(&self, names: &[String]) -> Result<Vec<TagId>, Refused> {
        let mut chosen = Vec::new();
        for name in names {
            if is_glob(name) {
                let glob = glob(name)?;
                chosen.extend(self.layout.tags.iter().filter(|(_, t)| glob.is_match(&t.name)).map(|(id, _)| id));
            } else {
                chosen.push(self.tag(name)?.0);
            }
        }
        chosen.sort_unstable();
        chosen.dedup();
        Ok(chosen)
    }

    /// Tags with their values now.
    pub(super) fn read_tags(&self, names: &[String]) -> Result<Vec<TagRow>, Refused> {
        let all = [String::from("*")];
        let chosen = self.tags(if names.is_empty() { &all } else { names })?;
        let view = self.view(&chosen);
        let row = |(at, id): (usize, &TagId)| {
            let tag = self.layout.tags.get(*id);
            TagRow {
                tag: tag.name.clone(),
                ty: tag.ty.to_string(),
                value: shown(&tag.ty, view.cell(at)),
                quality: view.quality(at).name(),
                forced: self.is_forced(*id),
            }
        };
        Ok(chosen.iter().enumerate().map(row).collect())
    }

    /// Alarms, with the quality of what they hang on.
    pub(super) fn alarm_rows(&self, all: bool) -> Vec<AlarmRow> {
        let mut rows = self.annunciator.rows(all);
        let ids: Vec<_> = rows.iter().map(|row| self.layout.tags.find(&row.alarm).unwrap_or(TagId(0))).collect();
        let view = self.view(&ids);
        rows.iter_mut().enumerate().for_each(|(at, row)| row.quality = view.quality(at).name());
        rows
    }

    /// The cell of a tag now.
    pub(super) fn cell(&self, id: TagId) -> u64 {
        self.view(&[id]).cell(0)
    }
}
