//! The interface between the journal and a sink.

use latchwork_record::Record;
use latchwork_schema::{Section, Values};
use std::path::{Component, Path, PathBuf};

/// A kind of sink: `jsonl`, `mqtt`, … One static of this type per kind, listed in [`crate::kinds`].
pub struct SinkKind {
    /// Name in the plant file.
    pub name: &'static str,
    /// Keys of `[sink.NAME]` besides those every sink has.
    pub keys: &'static Section,
    /// What is wrong with the keys taken together.
    pub check: fn(&Config) -> Vec<Problem>,
    /// What of the world no other sink may have, too.
    pub claim: fn(&Config) -> Option<Claim>,
    /// Makes the sink. What may be missing for a time (a broker) is not opened here.
    pub open: fn(&Config) -> Result<Box<dyn Sink>, String>,
}

/// What is wrong, and at which key (empty: at the table itself).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Key, or empty.
    pub key: String,
    /// What was found and what was expected.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

/// What a sink must have for itself: two that write one file, or log in under one name, undo each other's work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Key that says what.
    pub key: &'static str,
    /// What. Two claims of a key with the same text are the same thing.
    pub what: String,
}

impl Claim {
    /// A file or a folder, whatever its name is written like.
    pub fn path(key: &'static str, path: &Path) -> Self {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.into());
        // What is there may be named through links; what is not there yet begins below something that is.
        let there = absolute.ancestors().find_map(|a| Some((a.canonicalize().ok()?, absolute.strip_prefix(a).ok()?)));
        let (mut plain, rest) = there.unwrap_or((PathBuf::new(), &absolute));
        for part in rest.components() {
            match part {
                Component::ParentDir => drop(plain.pop()),
                part => plain.push(part),
            }
        }
        Self { key, what: plain.display().to_string() }
    }
}

/// A sink as the plant file has it.
#[derive(Clone, Debug)]
pub struct Config {
    /// Name of the sink.
    pub name: String,
    /// Name of the plant.
    pub plant: String,
    /// Folder of the plant file, which relative paths begin at.
    pub folder: PathBuf,
    /// The plant's folders of components, in the order they are searched.
    pub components: Vec<PathBuf>,
    /// Folder for compiled components; `None` compiles them anew at every start.
    pub cache: Option<PathBuf>,
    /// Identity of the journal that it reads: numbers of another one say nothing about this. Empty before there is one.
    pub journal: String,
    /// Its keys.
    pub values: Values,
}

/// Where records go. It works on a thread of its own and may take its time.
pub trait Sink: Send {
    /// Number of the last record that it is known to have, where it can tell by itself (from its own file): what stands in
    /// the stored cursor is older than that after a kill.
    fn kept(&mut self) -> Option<u64> {
        None
    }

    /// Does what takes long and touches nothing outside, such as compiling; without it the first write does.
    ///
    /// # Errors
    /// A sentence for a person: it cannot be used.
    fn prepare(&mut self) -> Result<(), String> {
        Ok(())
    }

    /// Opens now what the first write would open.
    ///
    /// # Errors
    /// A sentence for a person; nothing stays open.
    fn start(&mut self) -> Result<(), String> {
        Ok(())
    }

    /// Lets go of all that is open, since another sink gets the records. A later write opens it again.
    fn close(&mut self) {}

    /// Takes records in the order of their numbers; the highest number that is safely kept now. Those after it are offered
    /// again.
    ///
    /// # Errors
    /// A sentence for a person; the whole batch is offered again after a pause.
    fn write(&mut self, batch: &[Record]) -> Result<u64, String>;

    /// Now and then while there is nothing to write.
    fn idle(&mut self) {}
}
