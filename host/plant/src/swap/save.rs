//! `--save`: what runs becomes what the plant file names.
//!
//! With a component go the settings that run and that the plant file would not give it: what the next start makes is what runs.
//! First the components are written, under names that stand for nothing else, then the plant file, once for all blocks of a swap.
//! Each is written beside its place, brought to the disk and renamed: whatever ends the process or the power leaves the old plant
//! file, or the new one with all it names.

mod settings;

use crate::check::{CheckOptions, check_text, folders, read};
use crate::file::{self, PlantFile};
use crate::model::Model;
use latchwork_block::{Component, Engine};
use latchwork_schema::{Checker, Severity, Span};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Error, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Beginning of the names of sinks.
const SINK: &str = "sink.";
/// Digits of its hash that tell a component from another one of the same name.
const DIGITS: usize = 8;

/// A block or sink and what it runs now.
#[derive(Clone)]
pub struct Keep {
    /// Block, or `sink.NAME`.
    pub block: String,
    /// Name of the component's file; no path.
    pub file: String,
    /// The component.
    pub bytes: Arc<[u8]>,
    /// Settings of a block as they run: name and cell. Those that the next start would have otherwise are written, too.
    pub settings: Vec<(String, u64)>,
}

/// Why nothing was saved. The plant file is as it was.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// A file or folder.
    #[error("{path} cannot be {what}: {error}")]
    File {
        /// Which.
        path: PathBuf,
        /// `read`, `written`.
        what: &'static str,
        /// Why.
        error: Error,
    },
    /// It is no plant file any more.
    #[error("{path}: {message}")]
    Text {
        /// Plant file.
        path: PathBuf,
        /// What was found.
        message: String,
    },
    /// Somebody has changed it since the plant was started, in a way that is not known here.
    #[error("the plant file was edited since the plant was started: {0}; edit it by hand")]
    Edited(String),
    /// With the new component it would not be right.
    #[error("the plant file would have errors with it: {0}")]
    Check(String),
    /// The component would be refused at the next start.
    #[error("the next start would fail: with what the plant file says, `{0}` refuses its settings: {1}")]
    Settings(String, String),
    /// There is no place for a line with a setting.
    #[error(
        "`{0}` runs with a setting that the plant file would not give it; write `{1}` into its table, and swap again"
    )]
    ByHand(String, String),
    /// No name is left for a component.
    #[error(
        "`{0}` is no name for a component in the plant's folder, or stands for other ones already; rename the file and swap again"
    )]
    Name(String),
}

/// Writes what runs into the plant file. Clones are the same one: two swaps never write at once.
#[derive(Clone)]
pub struct Saver {
    shared: Arc<Mutex<Known>>,
}

struct Known {
    path: PathBuf,
    sim: bool,
    /// What the plant file names, by block or sink: at the plant's start, or since it was saved.
    named: BTreeMap<String, String>,
    sync: ToDisk,
}

/// Brings the names in a folder to the disk.
pub type ToDisk = fn(&Path) -> std::io::Result<()>;

impl Saver {
    /// For the plant file of a model.
    pub fn new(model: &Model) -> Self {
        Self::with_sync(model, |folder| File::open(folder)?.sync_all())
    }

    /// The same with another way to bring names to the disk: for tests of disks that fail.
    #[doc(hidden)]
    pub fn with_sync(model: &Model, sync: ToDisk) -> Self {
        let blocks = model.blocks.iter().map(|b| (b.name.clone(), b.named.clone()));
        let sinks = model
            .sinks
            .iter()
            .filter_map(|s| Some((format!("{SINK}{}", s.config.name), s.config.values.text("component")?.to_owned())));
        let named = blocks.chain(sinks).collect();
        Self { shared: Arc::new(Mutex::new(Known { path: model.file.clone(), sim: model.sim, named, sync })) }
    }

    /// What the plant file names as the component of a block or sink, as far as is known.
    pub fn named(&self, block: &str) -> Option<String> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner).named.get(block).cloned()
    }

    /// Saves all or none; a sentence for each, and one more if it is not known whether a power cut would leave it. It reads and writes files: not for the plant's own thread.
    ///
    /// # Errors
    /// A plant file that was edited in a way that is not known here, or would be wrong; files that cannot be written.
    pub fn save(&self, engine: &Engine, keep: &[Keep]) -> Result<Vec<String>, SaveError> {
        let mut known = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        let mut made = Vec::new();
        let saved = known.save(engine, keep, &mut made);
        if saved.is_err() {
            // Nothing names them: an error is from before the plant file was put in its place.
            made.iter().for_each(|path| drop(std::fs::remove_file(path)));
        }
        saved
    }

    /// Says beforehand what would keep it from being saved; nothing is written. What the end of the probation brings is not
    /// seen: settings that run then, somebody who edits the file meanwhile, a disk that is full by then.
    ///
    /// # Errors
    /// As of [`Self::save`].
    pub fn try_save(&self, engine: &Engine, keep: &[Keep]) -> Result<(), SaveError> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner).try_save(engine, keep)
    }
}

impl Known {
    fn try_save(&self, engine: &Engine, keep: &[Keep]) -> Result<(), SaveError> {
        let path = self.path.canonicalize().map_err(|e| failed(&self.path, "read", e))?;
        if !path.is_file() {
            // Such as a pipe.
            let message = "it is no file that could be written anew".into();
            return Err(SaveError::Text { path: self.path.clone(), message });
        }
        let text = self.text()?;
        let file = self.parse(&text)?;
        let folders: Vec<_> = folders(&file, folder_of(&self.path)).into_iter().map(|(folder, _)| folder).collect();
        for keep in keep {
            self.place(&file, &keep.block)?;
            if let (_, Some(file)) = component(&folders, folder_of(&self.path), keep)? {
                may_write(folder_of(&file))?;
            }
        }
        self.right(engine, &text)?;
        may_write(folder_of(&path))
    }

    fn save(&mut self, engine: &Engine, keep: &[Keep], made: &mut Vec<PathBuf>) -> Result<Vec<String>, SaveError> {
        // A link stays one.
        let path = self.path.canonicalize().map_err(|e| failed(&self.path, "read", e))?;
        let text = self.text()?;
        let file = self.parse(&text)?;
        // As the check has it: relative to the name by which the plant was started.
        let folders: Vec<_> = folders(&file, folder_of(&self.path)).into_iter().map(|(folder, _)| folder).collect();
        let (mut edits, mut names, mut unsure) = (Vec::new(), Vec::new(), None);
        for keep in keep {
            let (span, now) = self.place(&file, &keep.block)?;
            let (name, file) = component(&folders, folder_of(&self.path), keep)?;
            if let Some(file) = file {
                let folder = folder_of(&file);
                std::fs::create_dir_all(folder).map_err(|e| failed(folder, "made", e))?;
                made.push(file.clone());
                let written = replace(&file, &keep.bytes).and_then(|()| (self.sync)(folder));
                written.map_err(|e| failed(&file, "written", e))?;
            }
            if now != name {
                edits.push((span, toml::Value::String(name.clone()).to_string()));
            }
            names.push(name);
        }
        let new = self.settle(engine, edited(&text, edits), keep)?;
        if new != text {
            if self.text()? != text {
                return Err(SaveError::Edited("somebody is writing it".into()));
            }
            replace(&path, new.as_bytes()).map_err(|e| failed(&path, "written", e))?;
            // From here on it names them, whatever the disk says.
            unsure = (self.sync)(folder_of(&path)).err();
        }
        let shown = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let sentence = |(keep, name): (&Keep, &String)| format!("{}: component = \"{name}\" in {shown}", keep.block);
        let mut sentences: Vec<_> = keep.iter().zip(&names).map(sentence).collect();
        sentences.extend(unsure.map(|e| format!("{shown} is saved, but not known to be on the disk: {e}")));
        self.named.extend(keep.iter().map(|k| k.block.clone()).zip(names));
        Ok(sentences)
    }

    fn text(&self) -> Result<String, SaveError> {
        read(&self.path).map_err(|message| SaveError::Text { path: self.path.clone(), message })
    }

    fn parse(&self, text: &str) -> Result<PlantFile, SaveError> {
        let (root, syntax) = latchwork_schema::check::parse(text);
        if let Some(first) = syntax.first() {
            return Err(SaveError::Edited(first.message.clone()));
        }
        Ok(file::read(&mut Checker::default(), root.get_ref(), text))
    }

    /// Where the name of a block's component stands in the text, and the name.
    fn place(&self, file: &PlantFile, block: &str) -> Result<(Span, String), SaveError> {
        let values = match block.strip_prefix(SINK) {
            Some(sink) => file.sinks.iter().find(|s| s.name == sink).map(|s| &s.values),
            None => file.blocks.iter().find(|b| b.name == block && (self.sim || !b.sim)).map(|b| &b.values),
        };
        let now = values.and_then(|v| v.text("component").map(|now| (v.span_of("component"), now.to_owned())));
        let Some((span, now)) = now else {
            return Err(SaveError::Edited(format!("it has no component of `{block}` any more")));
        };
        match self.named.get(block) {
            Some(named) if *named == now => Ok((span, now)),
            named => {
                let named = named.map_or("", String::as_str);
                Err(SaveError::Edited(format!("`{block}` has component \"{now}\" in it, not \"{named}\"")))
            }
        }
    }

    /// Nothing goes into the plant file that the next start would refuse.
    fn right(&self, engine: &Engine, text: &str) -> Result<Model, SaveError> {
        let checked = check_text(&self.path, text.to_owned(), engine, CheckOptions { sim: self.sim });
        let first = checked.findings.iter().find(|f| f.severity == Severity::Error);
        let said = first.map(|f| f.message.clone()).unwrap_or_default();
        checked.model.ok_or(SaveError::Check(said))
    }
}

/// The text with other pieces.
fn edited(text: &str, mut edits: Vec<(Span, String)>) -> String {
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut new = text.to_owned();
    edits.into_iter().for_each(|(span, piece)| new.replace_range(span, &piece));
    new
}

/// The name by which a component is found from now on, and the file that has to be written for it, if it is not there yet.
fn component(folders: &[PathBuf], beside: &Path, keep: &Keep) -> Result<(String, Option<PathBuf>), SaveError> {
    let stem = keep.file.trim_end_matches(".wasm");
    if stem.is_empty() || stem.starts_with('.') || stem.contains(|c: char| c == '/' || c.is_control()) {
        return Err(SaveError::Name(keep.file.escape_debug().to_string()));
    }
    let hash = Component::hash_of(&keep.bytes);
    for name in [stem.to_owned(), format!("{stem}-{}", &hash[..DIGITS])] {
        let file = format!("{name}.wasm");
        // A name in a later folder stands for something, too: a file before it would take its place.
        let there = match folders {
            [] => Some(beside.join(&file)).filter(|p| p.exists()),
            folders => folders.iter().map(|f| f.join(&file)).find(|p| p.exists()),
        };
        let named = if folders.is_empty() { file.clone() } else { name };
        match there {
            None => return Ok((named, Some(folders.first().map_or(beside, |f| f).join(&file)))),
            Some(path) if std::fs::read(&path).map_err(|e| failed(&path, "read", e))? == *keep.bytes => {
                return Ok((named, None));
            }
            Some(_) => {}
        }
    }
    Err(SaveError::Name(keep.file.clone()))
}

/// Whether files can be made in a folder, which may have to be made itself. Nothing is written.
fn may_write(folder: &Path) -> Result<(), SaveError> {
    use rustix::fs::{Access, AtFlags, CWD, accessat};
    let there = folder.ancestors().map(|f| if f == Path::new("") { Path::new(".") } else { f }).find(|f| f.exists());
    let there = there.unwrap_or(folder);
    let allowed = match there.is_dir() {
        true => accessat(CWD, there, Access::WRITE_OK | Access::EXEC_OK, AtFlags::EACCESS),
        false => Err(rustix::io::Errno::NOTDIR),
    };
    allowed.map_err(|e| failed(there, "written", e.into()))
}

/// Puts a whole file in its place: what is there is the old one or the new one, also after a power cut. Which of them is known
/// when the folder, too, is on the disk.
fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let folder = folder_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Always the same name: what a crash leaves is written over by the next save.
    let beside = folder.join(format!(".{name}.saving"));
    let written = write(&beside, path, bytes).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}

fn write(beside: &Path, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    match std::fs::remove_file(beside) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(e),
        _ => {}
    }
    let mut file = File::options().write(true).create_new(true).open(beside)?;
    file.write_all(bytes)?;
    if let Ok(old) = std::fs::metadata(path) {
        use std::os::unix::fs::MetadataExt;
        // Whose it was it stays; a plant that may not give files away leaves it its own.
        let _ = std::os::unix::fs::fchown(&file, Some(old.uid()), Some(old.gid()));
        file.set_permissions(old.permissions())?;
    }
    file.sync_all()
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn failed(path: &Path, what: &'static str, error: Error) -> SaveError {
    SaveError::File { path: path.into(), what, error }
}
