//! `jsonl`: files of one JSON object per line, exactly once, rotated by size and by day.
//!
//! ```toml
//! [sink.archive]
//! kind = "jsonl"
//! path = "log/records.jsonl"      # relative to the plant file
//! size = "64MiB"
//! day = true
//! keep = 30
//! ```
//!
//! What the file has is what counts: at the opening a torn last line is cut off, and the number of the last whole one is where
//! the sink goes on. So a kill between the write and the stored cursor makes no line come twice. `PATH.journal` says which journal
//! that number is of: a file of another one is renamed, and its numbers hide nothing.

use super::jsonl_files::{Earlier, First, beside, ours, renamed, sync_folder};
use crate::{Claim, Config, Problem, Sink, SinkKind};
use latchwork_record::{Record, rfc3339};
use latchwork_schema::{Key, Kind, Section};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The kind.
pub static JSONL: SinkKind = SinkKind { name: "jsonl", keys: &KEYS, check, claim, open };

fn claim(config: &Config) -> Option<Claim> {
    Some(Claim::path("path", &path(config)))
}

/// The file of a sink.
fn path(config: &Config) -> PathBuf {
    config.folder.join(config.values.text("path").unwrap_or_default())
}

static KEYS: Section = Section {
    name: "[sink.NAME] (jsonl)",
    doc: "A file of one JSON object per line. Each record stands in it exactly once.",
    keys: &[
        Key::required("path", Kind::Text, "The file that is written, relative to this file; its folder is made."),
        Key::optional(
            "size",
            Kind::Size { min: 4 << 10, max: 1 << 40 },
            "",
            "A file that would become larger than this is renamed to `NAME-DAY-NUMBER.EXTENSION`, with the day and the number of \
             its first record, and a new one begun.",
        ),
        Key::optional("day", Kind::Bool, "false", "The same at midnight UTC, by the records' time."),
        Key::optional(
            "keep",
            Kind::Integer { min: 1, max: 1_000_000 },
            "",
            "So many renamed files stay, the newest; all without it.",
        ),
    ],
};

fn check(config: &Config) -> Vec<Problem> {
    let problem =
        |key: &str, message: String, help: &str| Problem { key: key.into(), message, help: Some(help.into()) };
    let mut problems = Vec::new();
    let path = config.values.text("path").unwrap_or_default();
    if Path::new(path).file_name().is_none() {
        let message = format!("`path` is \"{path}\"; expected the name of a file");
        problems.push(problem("path", message, "as in `path = \"log/records.jsonl\"`"));
    }
    let rotates = config.values.has("size") || config.values.bool("day") == Some(true);
    if config.values.has("keep") && !rotates {
        let message = "`keep` has no effect: the file is never renamed".into();
        problems.push(problem("keep", message, "add `size = \"64MiB\"` or `day = true`, or take `keep` out"));
    }
    problems
}

fn open(config: &Config) -> Result<Box<dyn Sink>, String> {
    let path = path(config);
    let limits = Limits {
        size: config.values.size("size").unwrap_or(u64::MAX),
        day: config.values.bool("day").unwrap_or(false),
        keep: config.values.integer("keep").map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
    };
    Jsonl::open(path, limits, config.journal.clone()).map(|sink| Box::new(sink) as _)
}

#[derive(Clone)]
struct Limits {
    size: u64,
    day: bool,
    keep: Option<usize>,
}

struct Jsonl {
    path: PathBuf,
    limits: Limits,
    /// Identity of the journal that is read; empty where nobody knows.
    journal: String,
    /// Renamed files of journals before this one.
    earlier: Earlier,
    file: File,
    /// Bytes of whole lines that are on the disk.
    length: u64,
    /// `None` in an empty file.
    first: Option<First>,
    /// Last number at the opening.
    kept: Option<u64>,
    /// The file may have more than `length` bytes, of a write that failed.
    torn: bool,
}

impl Jsonl {
    fn open(path: PathBuf, limits: Limits, journal: String) -> Result<Self, String> {
        let failed = |error: std::io::Error| format!("{} cannot be opened: {error}", path.display());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(failed)?;
        let (length, mut kept) = whole_lines(&file).map_err(failed)?;
        if kept.is_none() && (length > 0 || !may_be_torn(&file).map_err(failed)?) {
            return Err(format!(
                "the last line of {} is no record; move the file away, or name another",
                path.display()
            ));
        }
        file.set_len(length).map_err(failed)?;
        // Also the name of a file that is new.
        file.sync_all().and_then(|()| sync_folder(&path)).map_err(failed)?;
        let first = first_line(&file).map_err(failed)?.and_then(|line| number_and_day(&line));
        let earlier = Earlier::read(&path).map_err(failed)?;
        if !journal.is_empty() && earlier.journal != journal {
            // The numbers of the other journal end here: the file goes beside first, and then that is written down.
            if let Some(last) = kept {
                let first = first.unwrap_or(First { seq: last, day: "0000-00-00".into() });
                std::fs::rename(&path, beside(&path, &first)).and_then(|()| sync_folder(&path)).map_err(failed)?;
            }
            earlier.replace(&path, &journal).map_err(failed)?;
            return Self::open(path, limits, journal);
        }
        if kept.is_none() {
            let files = renamed(&path, &earlier).map_err(failed)?;
            kept = match ours(&files).last() {
                Some(last) => File::open(last).and_then(|f| whole_lines(&f)).map_err(failed)?.1,
                None => None,
            };
        }
        Ok(Self { path, limits, journal, earlier, file, length, first, kept, torn: false })
    }

    /// Opens the file anew where somebody has taken it away, or out of its name, or emptied it.
    fn look_after(&mut self) -> Result<(), String> {
        let is_ours = std::fs::metadata(&self.path).and_then(|named| {
            let own = self.file.metadata()?;
            Ok((named.dev(), named.ino()) == (own.dev(), own.ino()) && own.len() >= self.length)
        });
        if !is_ours.unwrap_or(false) {
            *self = Self::open(self.path.clone(), self.limits.clone(), self.journal.clone())?;
        }
        Ok(())
    }

    fn failed(&self, error: &std::io::Error) -> String {
        format!("{} cannot be written: {error}", self.path.display())
    }

    /// Appends lines, to the disk.
    fn append(&mut self, lines: &[u8]) -> std::io::Result<()> {
        if std::mem::replace(&mut self.torn, true) {
            self.file.set_len(self.length)?;
        }
        if let Err(error) = self.file.write_all(lines).and_then(|()| self.file.sync_data()) {
            // At once: whoever reads the file meanwhile finds whole lines.
            self.torn = self.file.set_len(self.length).is_err();
            return Err(error);
        }
        if self.file.metadata()?.nlink() == 0 {
            return Err(std::io::Error::other("somebody has removed it"));
        }
        self.torn = false;
        self.length += lines.len() as u64;
        Ok(())
    }

    /// True when a line of this record begins a new file.
    fn is_full(&self, bytes: u64, day: &str) -> bool {
        let Some(first) = &self.first else { return false };
        self.length + bytes > self.limits.size || self.limits.day && day > first.day.as_str()
    }

    /// Renames the file and begins a new one.
    fn rotate(&mut self) -> std::io::Result<()> {
        let Some(first) = &self.first else { return Ok(()) };
        let full = beside(&self.path, first);
        match std::fs::rename(&self.path, &full) {
            // A try before this one came so far, and no further.
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            renamed => renamed?,
        }
        self.file = OpenOptions::new().read(true).append(true).create(true).open(&self.path)?;
        (self.length, self.first) = (0, None);
        sync_folder(&self.path)?;
        if let Some(keep) = self.limits.keep {
            let files = renamed(&self.path, &self.earlier)?;
            let too_many = files.len().saturating_sub(keep);
            for (_, path) in files[..too_many].iter().filter(|(_, path)| *path != full) {
                std::fs::remove_file(path)?;
            }
        }
        Ok(())
    }

    /// Writes as much as it can; the error that ended it, if one did.
    fn write_some(&mut self, batch: &[Record], kept: &mut Option<u64>) -> std::io::Result<()> {
        let mut lines = Vec::new();
        let mut last = None;
        for record in batch {
            let mut line = record.to_json();
            line.push('\n');
            let day = rfc3339(record.time).chars().take(10).collect::<String>();
            if self.is_full((lines.len() + line.len()) as u64, &day) {
                self.append(&lines)?;
                lines.clear();
                *kept = last.or(*kept);
                self.rotate()?;
            }
            self.first.get_or_insert(First { seq: record.seq, day });
            lines.extend_from_slice(line.as_bytes());
            last = Some(record.seq);
        }
        self.append(&lines)?;
        *kept = last.or(*kept);
        Ok(())
    }
}

impl Sink for Jsonl {
    fn kept(&mut self) -> Option<u64> {
        self.kept
    }

    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        self.look_after()?;
        if self.length == 0 {
            self.first = None;
        }
        let mut kept = None;
        match (self.write_some(batch, &mut kept), kept) {
            (Ok(()), Some(seq)) => Ok(seq),
            // Whole files of this batch are there; what was wrong shows again at the next try.
            (Err(_), Some(seq)) => Ok(seq),
            (Err(error), None) => Err(self.failed(&error)),
            (Ok(()), None) => Ok(0),
        }
    }
}

/// Length of the whole lines at the beginning of a file, and the number of the last one.
fn whole_lines(file: &File) -> std::io::Result<(u64, Option<u64>)> {
    const CHUNK: u64 = 64 << 10;
    let mut end = file.metadata()?.len();
    let mut tail = Vec::new();
    // From the end, until a line with both its ends is there.
    loop {
        let lines: Vec<usize> = tail.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(n, _)| n).collect();
        if let [.., before, last] = lines[..] {
            return Ok((end + last as u64 + 1, seq_of(&tail[before + 1..last])));
        }
        if end == 0 {
            let length = lines.last().map_or(0, |last| *last as u64 + 1);
            return Ok((length, lines.last().and_then(|last| seq_of(&tail[..*last]))));
        }
        let begin = end.saturating_sub(CHUNK);
        let mut chunk = vec![0; (end - begin) as usize];
        let mut reader = file;
        reader.seek(SeekFrom::Start(begin))?;
        reader.read_exact(&mut chunk)?;
        chunk.extend_from_slice(&tail);
        (tail, end) = (chunk, begin);
    }
}

fn seq_of(line: &[u8]) -> Option<u64> {
    serde_json::from_slice::<serde_json::Value>(line).ok()?["seq"].as_u64()
}

/// True when a file without a whole line is empty or has a part of a record.
fn may_be_torn(file: &File) -> std::io::Result<bool> {
    const BEGIN: &[u8] = b"{\"seq\":";
    let mut begin = Vec::new();
    let mut reader = file;
    reader.seek(SeekFrom::Start(0))?;
    reader.take(BEGIN.len() as u64).read_to_end(&mut begin)?;
    // After a power failure zeros may stand where a line was to come.
    Ok(BEGIN.starts_with(&begin) || begin.iter().all(|b| *b == 0))
}

fn first_line(file: &File) -> std::io::Result<Option<String>> {
    let mut reader = BufReader::new(file);
    reader.seek(SeekFrom::Start(0))?;
    let mut line = Vec::new();
    reader.read_until(b'\n', &mut line)?;
    Ok(String::from_utf8(line).ok().filter(|l| !l.is_empty()))
}

fn number_and_day(line: &str) -> Option<First> {
    let value: serde_json::Value = serde_json::from_str(line).ok()?;
    Some(First { seq: value["seq"].as_u64()?, day: value["time"].as_str()?.get(..10)?.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_found_in_files_of_any_shape() {
        let long = format!("{{\"seq\":7,\"text\":\"{}\"}}\n", "x".repeat(200_000));
        for (text, length, seq) in [
            ("", 0, None),
            ("{\"seq\":1", 0, None),
            ("{\"seq\":1}\n", 10, Some(1)),
            ("{\"seq\":1}\n{\"seq\":2}\n{\"se", 20, Some(2)),
            ("no record\n", 10, None),
            (&long, long.len() as u64, Some(7)),
            (&format!("{long}{long}torn{}", "y".repeat(100_000)), 2 * long.len() as u64, Some(7)),
        ] {
            let mut file = tempfile::tempfile().expect("a file");
            file.write_all(text.as_bytes()).expect("room");
            assert_eq!(whole_lines(&file).expect("readable"), (length, seq), "{}", &text[..text.len().min(30)]);
        }
    }
}
