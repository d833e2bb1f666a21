//! The files of the days, and what is in them already.

use crate::table::{END, Row, lines};
use crate::whose::Whose;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes read at once from the end of a file.
const TAIL: u64 = 16 << 10;

/// A directory of day files.
pub(crate) struct Days {
    folder: PathBuf,
    /// The highest number of this journal that is in any file.
    last: u64,
    /// The file that was written last, with its day.
    open: Option<(String, File)>,
}

impl Days {
    /// Looks what is there. Records are written in the order of their numbers, so the highest one that any file ends with is
    /// the last that was written; what a kill left after the end of a last whole record is cut off. Numbers of another journal
    /// count for nothing.
    pub(crate) fn open(folder: PathBuf, journal: &str) -> Result<Self, String> {
        let no = |e: std::io::Error| {
            format!("{} cannot be read: {e}; csv-days needs a `directory` in the plant file", folder.display())
        };
        let mut found = BTreeMap::new();
        for entry in std::fs::read_dir(&folder).map_err(no)? {
            let path = entry.map_err(no)?.path();
            if is_day_file(&path) {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                found.insert(name, mend(&path)?);
            }
        }
        let mut whose = Whose::read(&folder)?;
        if !journal.is_empty() && whose.journal != journal {
            let earlier = found.iter().map(|(name, (_, length))| (name.clone(), *length)).collect();
            whose = Whose { journal: journal.to_owned(), earlier };
            whose.replace(&folder)?;
        }
        let new = found.iter().filter(|(name, (_, length))| whose.earlier.get(*name).is_none_or(|old| length > old));
        let last = new.map(|(_, (seq, _))| *seq).max().unwrap_or(0);
        Ok(Self { folder, last, open: None })
    }

    /// Writes what is new of a batch, run by run of a day, each on disk before the next: a later number is never there
    /// without an earlier one. The highest number that is kept.
    pub(crate) fn write(&mut self, rows: &[Row]) -> Result<u64, String> {
        let new = &rows[rows.partition_point(|row| row.seq <= self.last)..];
        let days: Vec<(String, &Row)> = new.iter().map(|row| (row.day(), row)).collect();
        let mut from = 0;
        for run in days.chunk_by(|(a, _), (b, _)| a == b) {
            let to = from + run.len();
            self.append(&run[0].0, &new[from..to])?;
            from = to;
        }
        // No more than was offered: after a kill there may be more here than the plant knows of.
        Ok(rows.last().map_or(0, |row| row.seq))
    }

    fn append(&mut self, day: &str, rows: &[Row]) -> Result<(), String> {
        let path = self.folder.join(format!("{day}.csv"));
        let (_, mut file) = match self.open.take() {
            Some(open) if open.0 == day => open,
            _ => {
                let file = OpenOptions::new().create(true).append(true).open(&path);
                (day.to_owned(), file.map_err(|e| format!("{} cannot be opened: {e}", path.display()))?)
            }
        };
        let no = |e: std::io::Error| format!("{} cannot be written: {e}", path.display());
        let begins = file.metadata().map_err(no)?.len() == 0;
        // After an error the file stays closed, and what was written of it is found when an instance opens it again.
        file.write_all(&lines(rows, begins)?).map_err(no)?;
        file.sync_data().map_err(no)?;
        self.last = rows.last().map_or(self.last, |row| row.seq);
        self.open = Some((day.to_owned(), file));
        Ok(())
    }
}

/// `2026-11-27.csv`
fn is_day_file(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let digit_or_dash = |(n, c): (usize, char)| if n == 4 || n == 7 { c == '-' } else { c.is_ascii_digit() };
    name.len() == 14 && name.ends_with(".csv") && name.chars().take(10).enumerate().all(digit_or_dash)
}

/// Cuts a file after its last whole record; the number of that, or 0, and the length that is left.
fn mend(path: &Path) -> Result<(u64, u64), String> {
    let no = |e: std::io::Error| format!("{} cannot be read: {e}", path.display());
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(no)?;
    let size = file.metadata().map_err(no)?.len();
    let (mut want, mut tail) = (TAIL, Vec::new());
    loop {
        let from = size.saturating_sub(want);
        tail.clear();
        file.seek(SeekFrom::Start(from)).map_err(no)?;
        (&file).take(size - from).read_to_end(&mut tail).map_err(no)?;
        let ends: Vec<usize> = (0..tail.len().saturating_sub(1)).filter(|i| tail[*i..].starts_with(END)).collect();
        // The whole last record is in sight when the end of the one before it is, or the beginning of the file.
        if from > 0 && ends.len() < 2 {
            want *= 4;
            continue;
        }
        let whole = ends.last().map_or(0, |end| end + END.len());
        if whole < tail.len() {
            file.set_len(from + whole as u64).map_err(no)?;
            file.sync_data().map_err(no)?;
        }
        let begin = ends.len().checked_sub(2).map_or(0, |before| ends[before] + END.len());
        let length = from + whole as u64;
        return number(&tail[begin..whole]).map(|seq| (seq, length)).map_err(|found| {
            format!(
                "{} ends with a line that begins with `{found}`, not with a record's number; move the file away",
                path.display()
            )
        });
    }
}

/// The number that a record begins with; 0 for the header alone, and for nothing.
fn number(record: &[u8]) -> Result<u64, String> {
    let field = record.split(|b| *b == b',').next().unwrap_or_default();
    match std::str::from_utf8(field) {
        Ok("" | "seq") => Ok(0),
        Ok(text) => text.parse().map_err(|_| text.chars().take(40).collect()),
        Err(_) => Err(String::from_utf8_lossy(field).chars().take(40).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: u64 = 86_400_000_000_000;

    fn row(seq: u64, day: u64) -> Row {
        let text = format!("record {seq}\nwith a second line, and \"{}\"", "x".repeat((seq % 50) as usize));
        Row { seq, time: day * DAY + seq, kind: "event", text, ..Row::default() }
    }

    fn numbers(folder: &Path) -> Vec<(String, u64)> {
        let mut all = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let mut reader = csv::Reader::from_path(&path).unwrap();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            all.extend(reader.records().map(|r| (name.clone(), r.unwrap()[0].parse().unwrap())));
        }
        all.sort_by_key(|(_, seq)| *seq);
        all
    }

    fn open(folder: &Path) -> Days {
        Days::open(folder.to_owned(), "").unwrap()
    }

    #[test]
    fn a_batch_over_midnight_goes_into_two_files_and_a_clock_that_goes_back_does_no_harm() {
        let folder = tempfile::tempdir().unwrap();
        let rows = [row(1, 0), row(2, 0), row(3, 1), row(4, 0), row(9, 1)];
        assert_eq!(open(folder.path()).write(&rows), Ok(9));
        let expected = [(1, 1), (2, 1), (3, 2), (4, 1), (9, 2)].map(|(seq, day)| (format!("1970-01-0{day}"), seq));
        assert_eq!(numbers(folder.path()), expected);
        // All is offered again to the next instance, or a part of it.
        assert_eq!(open(folder.path()).write(&rows[..2]), Ok(2));
        assert_eq!(open(folder.path()).write(&rows), Ok(9));
        assert_eq!(numbers(folder.path()), expected);
    }

    #[test]
    fn cut_off_at_any_byte_every_record_is_there_once() {
        let whole = tempfile::tempdir().unwrap();
        let rows: Vec<Row> = (1..=4).map(|seq| row(seq, 0)).collect();
        open(whole.path()).write(&rows).unwrap();
        let bytes = std::fs::read(whole.path().join("1970-01-01.csv")).unwrap();
        for length in 0..=bytes.len() {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("1970-01-01.csv"), &bytes[..length]).unwrap();
            assert_eq!(open(folder.path()).write(&rows), Ok(4));
            let again = std::fs::read(folder.path().join("1970-01-01.csv")).unwrap();
            assert!(again == bytes, "cut at {length}: {}", String::from_utf8_lossy(&again));
        }
    }

    #[test]
    fn a_last_record_longer_than_what_is_read_at_once_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let long = Row { text: "y\n".repeat(100_000), ..row(1, 0) };
        assert_eq!(open(folder.path()).write(&[row(1, 0), Row { seq: 2, ..long }]), Ok(2));
        assert_eq!(open(folder.path()).last, 2);
    }

    #[test]
    fn numbers_of_another_journal_hide_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let open = |journal: &str| Days::open(folder.path().to_owned(), journal).unwrap();
        assert_eq!(open("one").write(&[row(7, 0), row(8, 1)]), Ok(8));
        assert_eq!(open("one").last, 8);
        // Nothing was written since: the numbers that are there are still the other journal's.
        assert_eq!((open("two").last, open("two").last), (0, 0));
        assert_eq!(open("two").write(&[row(1, 1)]), Ok(1));
        assert_eq!(open("two").last, 1);
        assert_eq!(open("two").write(&[row(1, 1), row(2, 2)]), Ok(2));
        std::fs::remove_file(folder.path().join("journal.json")).unwrap();
        assert_eq!(numbers(folder.path()).into_iter().map(|(_, seq)| seq).collect::<Vec<_>>(), [1, 2, 7, 8]);
    }

    #[test]
    fn a_file_of_somebody_elses_is_told_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("1970-01-01.csv"), "date,turnover\r\nmonday,7\r\n").unwrap();
        let error = Days::open(folder.path().to_owned(), "").err().unwrap();
        assert!(error.contains("begins with `monday`, not with a record's number"), "{error}");
        std::fs::rename(folder.path().join("1970-01-01.csv"), folder.path().join("turnover.csv")).unwrap();
        assert_eq!(open(folder.path()).last, 0);
    }
}
