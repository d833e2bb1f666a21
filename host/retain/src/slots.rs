//! The two files: which one is newer, which one is written next.

use crate::Retained;
use crate::slot::{Damage, LONGEST, decode, encode};
use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Names of the two files.
pub const FILES: [&str; 2] = ["retained-0", "retained-1"];

/// What two files hold.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The newest sound states.
    pub retained: Retained,
    /// Their generation; 0 without any.
    pub generation: u64,
    /// The file that holds them.
    pub slot: Option<usize>,
    /// Why the others are not taken, by file; a file that was never written is no damage.
    pub damage: Vec<(usize, Damage)>,
    /// Where damaged files went, if none was sound.
    pub set_aside: Vec<PathBuf>,
    /// Those that could not be put aside, each with the reason: they are written over.
    pub not_aside: Vec<String>,
}

impl Found {
    /// States from elsewhere than files.
    pub fn of(retained: Retained) -> Self {
        Self { retained, ..Self::default() }
    }

    /// Something was kept, and none of it can be read.
    pub fn lost(&self) -> bool {
        self.slot.is_none() && !self.damage.is_empty()
    }
}

/// Reads both files of a folder; those that are not there were never written.
pub fn read(folder: &Path) -> Found {
    let of = |slot: usize| match File::open(folder.join(FILES[slot])) {
        Ok(mut file) => content(&mut file),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    };
    choose([of(0), of(1)])
}

fn content(file: &mut File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One more than is allowed, so that a longer one is noticed.
    Read::take(file, LONGEST as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The newest of two files.
fn choose(files: [io::Result<Vec<u8>>; 2]) -> Found {
    let mut found = Found::default();
    for (slot, bytes) in files.into_iter().enumerate() {
        let read = bytes.map_err(|e| Damage::Unreadable { why: e.to_string() }).and_then(|bytes| decode(&bytes));
        match read {
            Ok((generation, retained)) => {
                if found.slot.is_none() || generation > found.generation {
                    found = Found { retained, generation, slot: Some(slot), ..found };
                }
            }
            Err(Damage::Empty) => {}
            Err(damage) => found.damage.push((slot, damage)),
        }
    }
    found
}

/// The files, open for writing.
pub(crate) struct Slots {
    folder: PathBuf,
    files: [File; 2],
    generation: u64,
    /// The file that holds it.
    newest: Option<usize>,
}

impl Slots {
    /// Opens both, makes what is not there, and reads them.
    pub(crate) fn open(folder: &Path) -> io::Result<(Self, Found)> {
        let open = |name: &str| {
            let path = folder.join(name);
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
        };
        let mut files = [open(FILES[0])?, open(FILES[1])?];
        // Two plants that write the same files would each take the other's state for its own.
        files[0].try_lock().map_err(io::Error::from)?;
        // That the files are there must be as durable as what is in them.
        File::open(folder)?.sync_all()?;
        let [first, second] = &mut files;
        let found = choose([content(first), content(second)]);
        let slots = Self { folder: folder.into(), files, generation: found.generation, newest: found.slot };
        Ok((slots, found))
    }

    /// Puts damaged files aside as far as that can be done, for whoever wants to know what was in them: a plant starts without.
    pub(crate) fn set_aside(&self, found: &mut Found) {
        for (slot, _) in &found.damage {
            match self.copy_aside(*slot) {
                Ok(to) => found.set_aside.push(to),
                Err(error) => found.not_aside.push(format!("{}: {error}", FILES[*slot])),
            }
        }
    }

    fn copy_aside(&self, slot: usize) -> io::Result<PathBuf> {
        let to = self.folder.join(format!("{}.damaged", FILES[slot]));
        // A copy, as the file itself is locked and will be written.
        let mut bytes = Vec::new();
        Read::take(&File::open(self.folder.join(FILES[slot]))?, LONGEST as u64).read_to_end(&mut bytes)?;
        std::fs::write(&to, bytes)?;
        Ok(to)
    }

    /// Writes the older file and returns its bytes once they are durable. After an error the same file is written again:
    /// the other one still holds what was written last.
    pub(crate) fn write(&mut self, retained: &Retained) -> io::Result<u64> {
        let generation = self.generation.saturating_add(1);
        let slot = self.newest.map_or(0, |newest| 1 - newest);
        let bytes = encode(generation, retained).map_err(io::Error::other)?;
        self.files[slot].write_all_at(&bytes, 0)?;
        self.files[slot].sync_data()?;
        (self.generation, self.newest) = (generation, Some(slot));
        Ok(bytes.len() as u64)
    }
}
