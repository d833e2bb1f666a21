//! Forces: a tag held at a value, whatever its writer says.

use super::tags::shown;
use super::{ForceRow, Operator, Refused};
use crate::assemble::Plant;
use crate::model::TagRef;
use latchwork_image::{Forced, Location, Quality, Resolved, TagId};
use latchwork_record::Kind;

impl Plant {
    /// Where a tag can be forced: the tag that has the cell, its place, inverted or not.
    fn forceable(&self, name: &str) -> Result<(TagId, Location, bool), Refused> {
        let (id, what) = self.tag(name)?;
        match what {
            TagRef::Lane { .. } => {
                return Err(Refused::new("state", format!("`{name}` is a figure of a lane; it cannot be forced")));
            }
            TagRef::Setting { .. } => {
                return Err(Refused::new("state", format!("`{name}` is a setting; it is set, not forced")));
            }
            TagRef::Command { .. } => {
                return Err(Refused::new("state", format!("`{name}` is a command; it is given, not forced")));
            }
            _ => {}
        }
        match self.layout.tags.resolve(id) {
            Ok(Resolved::Cell { location, not }) if location.region != self.layout.operators_region() => {
                Ok((self.origin(location).unwrap_or(id), location, not))
            }
            _ => Err(Refused::new("state", format!("`{name}` never changes; there is nothing to force"))),
        }
    }

    /// A lane that has stopped or faulted takes no force any more.
    fn runs(&self, location: Location) -> Result<(), Refused> {
        let lane = location.region as usize;
        if lane < self.model.lanes.len() { self.lane_runs(lane) } else { Ok(()) }
    }

    /// When a change of a force is seen, if that is not at once.
    fn when(&self, location: Location) -> String {
        let waits = |l: &&crate::model::Lane| l.interrupt.as_ref().is_some_and(|i| !i.poll && i.also_with.is_none());
        match self.model.lanes.get(location.region as usize).filter(waits) {
            Some(lane) => format!(", from the next edge of lane `{}` on", lane.name),
            None => String::new(),
        }
    }

    /// The tag whose own cell stands at a place.
    fn origin(&self, location: Location) -> Option<TagId> {
        let own = |id: &TagId| self.layout.tags.get(*id).source == latchwork_image::Source::Cell(location);
        self.layout.tags.iter().map(|(id, _)| id).find(own)
    }

    pub(super) fn is_forced(&self, id: TagId) -> bool {
        let Ok(Resolved::Cell { location, .. }) = self.layout.tags.resolve(id) else { return false };
        self.forces.list().next().is_some()
            && self.forces.list().filter(|(forced, _)| !is_quality(*forced)).any(|(forced, _)| {
                matches!(self.layout.tags.resolve(forced), Ok(Resolved::Cell { location: l, .. }) if l == location)
            })
    }

    pub(super) fn force(
        &mut self,
        name: &str,
        value: &str,
        operator: &Operator,
        now: u64,
    ) -> Result<Vec<String>, Refused> {
        let (id, location, not) = self.forceable(name)?;
        let ty = self.layout.tags.get(id).ty.clone();
        let cell = ty.parse(value).map_err(|e| Refused::new("value", format!("`{name}`: {e}")))?;
        // What reads it inverted was named: its source gets the other value.
        let cell = if not { cell ^ 1 } else { cell };
        let before = self.cell(id);
        let Location { region, slot, bit, quality } = location;
        let forced = |cell| Forced { cell, user: operator.user.clone(), since: now };
        let busy = |e: latchwork_image::ForceError| Refused::new("busy", e.to_string());
        self.runs(location)?;
        // An input whose device is gone has a value now.
        let of_driver = region as usize >= self.model.lanes.len();
        if let (Some(quality), true) = (quality, of_driver) {
            let good = Quality::Good.cell();
            self.forces.force(quality_id(id), region as usize, quality, None, forced(good)).map_err(busy)?;
        }
        if let Err(error) = self.forces.force(id, region as usize, slot, bit, forced(cell)) {
            if let Some(quality) = quality {
                let _ = self.forces.unforce(quality_id(id), quality, None);
            }
            return Err(busy(error));
        }
        let tag = self.layout.tags.get(id).name.clone();
        let mut draft = Self::did(now, Kind::Audit, &tag, "forced", operator);
        (draft.previous, draft.current) = (ty.value(before), ty.value(cell));
        draft.priority = 96;
        self.tell(draft, Vec::new());
        let held = format!("{tag} is held at {}{}", ty.format(cell), self.when(location));
        Ok(vec![if tag == name { held } else { format!("{held}: `{name}` shows it") }])
    }

    pub(super) fn unforce(&mut self, name: &str, operator: &Operator, now: u64) -> Result<Vec<String>, Refused> {
        let tags = if super::tags::is_glob(name) {
            let glob = super::tags::glob(name)?;
            let forced = self.forces.list().map(|(id, _)| id).filter(|id| !is_quality(*id));
            let forced: Vec<_> = forced.filter(|id| glob.is_match(&self.layout.tags.get(*id).name)).collect();
            if forced.is_empty() {
                return Err(Refused::new("state", format!("no tag that is forced matches `{name}`")));
            }
            forced
        } else {
            vec![self.forceable(name)?.0]
        };
        let mut done = Vec::new();
        for id in tags {
            let tag = self.layout.tags.get(id).clone();
            let Ok(Resolved::Cell { location, .. }) = self.layout.tags.resolve(id) else { continue };
            let refused = |e: latchwork_image::ForceError| Refused::new("state", format!("`{}`: {e}", tag.name));
            let forced = self.forces.unforce(id, location.slot, location.bit).map_err(refused)?;
            if let Some(quality) = location.quality {
                // Only that of a driver's point was forced along.
                let _ = self.forces.unforce(quality_id(id), quality, None);
            }
            let mut draft = Self::did(now, Kind::Audit, &tag.name, "unforced", operator);
            draft.previous = tag.ty.value(forced.cell);
            draft.priority = 96;
            self.tell(draft, Vec::new());
            done.push(format!("{} is no longer held{}", tag.name, self.when(location)));
        }
        Ok(done)
    }

    pub(super) fn forced(&self) -> Vec<ForceRow> {
        let forces = self.forces.list().filter(|(id, _)| !is_quality(*id));
        let row = |(id, forced): (TagId, &Forced)| {
            let tag = self.layout.tags.get(id);
            ForceRow {
                tag: tag.name.clone(),
                value: shown(&tag.ty, forced.cell),
                user: forced.user.clone(),
                since: self.router.epoch().saturating_add(forced.since),
            }
        };
        forces.map(row).collect()
    }
}

/// The board knows the quality of a tag by a number of its own, beyond those of all tags.
const QUALITY: u32 = 1 << 31;

fn quality_id(id: TagId) -> TagId {
    TagId(id.0 | QUALITY)
}

fn is_quality(id: TagId) -> bool {
    id.0 & QUALITY != 0
}
