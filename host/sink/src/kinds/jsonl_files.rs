//! The files of a `jsonl` sink besides the one that is written: renamed ones and their order, and `PATH.journal`.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What a file begins with.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct First {
    pub(super) seq: u64,
    /// `2026-11-27`
    pub(super) day: String,
}

/// What `PATH.journal` says: whose numbers these are, and which renamed files are of journals before.
#[derive(Default)]
pub(super) struct Earlier {
    /// Identity; empty where there is no such file.
    pub(super) journal: String,
    /// Names of files, the oldest first.
    names: Vec<String>,
}

impl Earlier {
    pub(super) fn read(path: &Path) -> std::io::Result<Self> {
        let text = match std::fs::read_to_string(own(path)) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            text => text?,
        };
        let mut lines = text.lines().map(str::to_owned);
        Ok(Self { journal: lines.next().unwrap_or_default(), names: lines.collect() })
    }

    /// From now on it is this journal, and all files that are renamed already are of others. On the disk.
    pub(super) fn replace(&self, path: &Path, journal: &str) -> std::io::Result<()> {
        let mut text = format!("{journal}\n");
        for (_, file) in renamed(path, self)? {
            text += &format!("{}\n", file.file_name().unwrap_or_default().to_string_lossy());
        }
        let (own, draft) = (own(path), beside_name(path, ".journal.new"));
        let mut file = File::create(&draft)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        std::fs::rename(draft, own)?;
        sync_folder(path)
    }
}

fn own(path: &Path) -> PathBuf {
    beside_name(path, ".journal")
}

fn beside_name(path: &Path, more: &str) -> PathBuf {
    path.with_file_name(format!("{}{more}", path.file_name().unwrap_or_default().to_string_lossy()))
}

/// What the name of the file is made of, and its extension with the dot.
fn parts(path: &Path) -> (String, String) {
    let text = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
    (text(path.file_stem()).unwrap_or_default(), text(path.extension()).map_or(String::new(), |e| format!(".{e}")))
}

/// Where a file goes that is full. A name that is taken, of a journal that is gone, gets a further number.
pub(super) fn beside(path: &Path, first: &First) -> PathBuf {
    let (stem, extension) = parts(path);
    let name = |more: &str| path.with_file_name(format!("{stem}-{}-{}{more}{extension}", first.day, first.seq));
    let mut others = (2..).map(|n| name(&format!("-{n}")));
    Some(name("")).filter(|p| !p.exists()).or_else(|| others.find(|p| !p.exists())).unwrap_or_else(|| name(""))
}

/// Place among the files of earlier journals, or beyond them; number of the first record; further number. Clocks may be set back:
/// the day is no order.
pub(super) type Order = (usize, u64, u64);

/// The renamed files in the order they were written in.
pub(super) fn renamed(path: &Path, earlier: &Earlier) -> std::io::Result<Vec<(Order, PathBuf)>> {
    let (stem, extension) = parts(path);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder(path))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let middle = name.strip_prefix(&format!("{stem}-")).and_then(|n| n.strip_suffix(&extension));
        if let Some((seq, more)) = middle.and_then(order) {
            let place = earlier.names.iter().position(|n| *n == name).unwrap_or(usize::MAX);
            files.push(((place, seq, more), entry.path()));
        }
    }
    files.sort();
    Ok(files)
}

/// Those of this journal.
pub(super) fn ours(files: &[(Order, PathBuf)]) -> impl DoubleEndedIterator<Item = &Path> {
    files.iter().filter(|((place, ..), _)| *place == usize::MAX).map(|(_, path)| path.as_path())
}

/// First number and further one of `2026-11-27-17` or `2026-11-27-17-2`.
fn order(name: &str) -> Option<(u64, u64)> {
    let (day, rest) = name.split_at_checked(10)?;
    let (number, more) = match rest.strip_prefix('-')?.split_once('-') {
        Some((number, more)) => (number, more.parse().ok()?),
        None => (&rest[1..], 1),
    };
    let is_day = day.bytes().all(|b| b.is_ascii_digit() || b == b'-');
    is_day.then_some((number.parse().ok()?, more))
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Names of files are on the disk as well.
pub(super) fn sync_folder(path: &Path) -> std::io::Result<()> {
    File::open(folder(path))?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::order;

    #[test]
    fn renamed_files_have_an_order() {
        assert_eq!(order("2026-11-27-17"), Some((17, 1)));
        assert_eq!(order("2026-11-27-17-3"), Some((17, 3)));
        for other in ["", "2026-11-27", "2026-11-27-", "2026-11-27-x", "2026-11-2x-1", "2026-11-27-1-", "äääää-1"]
        {
            assert_eq!(order(other), None, "{other}");
        }
    }
}
