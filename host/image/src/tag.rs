//! The table of tags: every named value of the plant, its type and where it stands.

use crate::Type;
use std::collections::HashMap;

/// Number of a tag in its table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TagId(pub u32);

/// Where the value of a tag stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Location {
    /// Number of the region, that is of the writer.
    pub region: u32,
    /// Cell of the value.
    pub slot: u32,
    /// The tag is this bit of the cell (a flag of `alarms` or `commands`).
    pub bit: Option<u8>,
    /// Cell of the quality in the same region; without one the tag is always good.
    pub quality: Option<u32>,
}

/// Where a tag gets its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A writer writes it.
    Cell(Location),
    /// It is another tag, inverted if `not`: an input port, an output point.
    Alias {
        /// The tag that is read.
        tag: TagId,
        /// Bool inverted.
        not: bool,
    },
    /// It never changes.
    Constant(u64),
}

/// One tag.
#[derive(Clone, Debug)]
pub struct Tag {
    /// Full name, `zone-b.turbo.outputs.running`.
    pub name: String,
    /// Type of the value.
    pub ty: Type,
    /// Where the value comes from.
    pub source: Source,
}

/// Where a tag's value finally comes from, aliases followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resolved {
    /// A cell, inverted if `not`.
    Cell {
        /// The place.
        location: Location,
        /// Bool inverted.
        not: bool,
    },
    /// A constant.
    Constant(u64),
}

/// A table that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TagError {
    /// Two tags of one name.
    #[error("the tag `{0}` is there twice")]
    Twice(String),
    /// Aliases that lead back to themselves.
    #[error("the tag `{0}` reads itself through its own sources")]
    Circle(String),
}

/// All tags of a plant, in the order they were added.
#[derive(Clone, Debug, Default)]
pub struct TagTable {
    tags: Vec<Tag>,
    names: HashMap<String, TagId>,
}

impl TagTable {
    /// Adds a tag.
    pub fn add(&mut self, name: impl Into<String>, ty: Type, source: Source) -> Result<TagId, TagError> {
        let name = name.into();
        let id = TagId(u32::try_from(self.tags.len()).expect("fewer than 2^32 tags"));
        if self.names.contains_key(&name) {
            return Err(TagError::Twice(name));
        }
        self.names.insert(name.clone(), id);
        self.tags.push(Tag { name, ty, source });
        Ok(id)
    }

    /// Sets the source of a tag that was added before its source was known.
    pub fn set_source(&mut self, id: TagId, source: Source) {
        self.tags[id.0 as usize].source = source;
    }

    /// The tag of a name.
    pub fn find(&self, name: &str) -> Option<TagId> {
        self.names.get(name).copied()
    }

    /// The tag of a number.
    ///
    /// # Panics
    /// If the number is of another table.
    pub fn get(&self, id: TagId) -> &Tag {
        &self.tags[id.0 as usize]
    }

    /// All tags.
    pub fn iter(&self) -> impl Iterator<Item = (TagId, &Tag)> {
        self.tags.iter().enumerate().map(|(i, t)| (TagId(i as u32), t))
    }

    /// Number of tags.
    pub fn len(&self) -> usize {
        self.tags.len()
    }

    /// True for an empty table.
    pub fn is_empty(&self) -> bool {
        self.tags.is_empty()
    }

    /// Follows aliases to the cell or constant a tag finally reads.
    pub fn resolve(&self, id: TagId) -> Result<Resolved, TagError> {
        let (mut at, mut inverted) = (id, false);
        for _ in 0..=self.tags.len() {
            match self.get(at).source {
                Source::Cell(location) => return Ok(Resolved::Cell { location, not: inverted }),
                Source::Constant(cell) => {
                    return Ok(Resolved::Constant(if inverted { cell ^ 1 } else { cell }));
                }
                Source::Alias { tag, not } => (at, inverted) = (tag, inverted ^ not),
            }
        }
        Err(TagError::Circle(self.get(id).name.clone()))
    }
}

/// The known name nearest to a misspelt one, if any is near enough to be meant.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(name, k), k))
        .filter(|(distance, k)| *distance <= (name.len().max(k.len()) / 3).max(1))
        .min()
        .map(|(_, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(slot: u32) -> Source {
        Source::Cell(Location { region: 0, slot, bit: None, quality: None })
    }

    #[test]
    fn aliases_are_followed_and_inversions_counted() {
        let mut table = TagTable::default();
        let a = table.add("a", Type::Bool, cell(4)).unwrap();
        let b = table.add("b", Type::Bool, Source::Alias { tag: a, not: true }).unwrap();
        let c = table.add("c", Type::Bool, Source::Alias { tag: b, not: true }).unwrap();
        let location = Location { region: 0, slot: 4, bit: None, quality: None };
        assert_eq!(table.resolve(b), Ok(Resolved::Cell { location, not: true }));
        assert_eq!(table.resolve(c), Ok(Resolved::Cell { location, not: false }));
        assert_eq!(table.add("a", Type::Bool, cell(1)), Err(TagError::Twice("a".into())));
    }

    #[test]
    fn a_circle_is_an_error_not_a_hang() {
        let mut table = TagTable::default();
        let a = table.add("a", Type::Bool, Source::Constant(1)).unwrap();
        let b = table.add("b", Type::Bool, Source::Alias { tag: a, not: true }).unwrap();
        assert_eq!(table.resolve(b), Ok(Resolved::Constant(0)));
        table.set_source(a, Source::Alias { tag: b, not: false });
        assert_eq!(table.resolve(a), Err(TagError::Circle("a".into())));
    }

    #[test]
    fn the_nearest_name_is_near() {
        assert_eq!(nearest("watchdgo", ["every", "watchdog", "priority"]), Some("watchdog"));
        assert_eq!(nearest("zzz", ["every", "watchdog"]), None);
    }
}
