//! What writes the files, and what it makes of a disk that takes nothing.

use super::spill::{Order, Trouble};
use latchwork_testbed::replay::{ENDING, components_of, header};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{Error, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// Files at most.
const FILES: u64 = 16;
/// A disk that has refused is tried again after so long, each time after twice as long, but no longer than that.
const BACK_OFF: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(60)];
/// Digits of a component's hash.
const DIGITS: usize = 64;

/// Writes what is ordered.
pub(super) struct Writer {
    folder: PathBuf,
    room: u64,
    run: u64,
    number: u64,
    file: Option<(File, u64, PathBuf)>,
    /// Components that are not on the disk yet.
    components: BTreeMap<String, Vec<u8>>,
    /// Hashes of those whose segments may still come.
    in_use: BTreeSet<String>,
    /// The same of those that each file needs, as far as that is known.
    needed: BTreeMap<PathBuf, BTreeSet<String>>,
    refuses: Option<Refuses>,
    told: Sender<Trouble>,
}

/// The disk refuses.
struct Refuses {
    /// Segments left out.
    lost: u64,
    /// When it is tried next.
    next: Instant,
    wait: Duration,
}

impl Writer {
    /// Into a folder that is there.
    pub(super) fn new(folder: &Path, room: u64, told: Sender<Trouble>) -> std::io::Result<Self> {
        let run = segments(folder)?.iter().filter_map(|f| f.run).max().unwrap_or(0) + 1;
        Ok(Self {
            folder: folder.into(),
            room,
            run,
            number: 0,
            file: None,
            components: BTreeMap::new(),
            in_use: BTreeSet::new(),
            needed: BTreeMap::new(),
            refuses: None,
            told,
        })
    }

    /// Number of this run among those in the folder.
    pub(super) fn run(&self) -> u64 {
        self.run
    }

    /// Does what is ordered, now.
    pub(super) fn take(&mut self, order: Order, now: Instant) {
        let segment = matches!(order, Order::Segment(..));
        if let Order::Component(hash, _) = &order {
            self.in_use.insert(hash.clone());
        }
        let order = match order {
            Order::InUse(hashes) => {
                self.in_use = hashes;
                return;
            }
            // It is kept until it is there: the segments are worth nothing without it.
            Order::Component(hash, bytes) => {
                self.components.insert(hash, bytes);
                None
            }
            order => Some(order),
        };
        if let Some(refuses) = self.refuses.as_mut().filter(|r| now < r.next) {
            refuses.lost += u64::from(segment);
            return;
        }
        let done = self.components().and_then(|()| match &order {
            Some(Order::Segment(hash, chunk)) => self.segment(hash, chunk),
            Some(Order::Sync) => self.sync(),
            _ => Ok(()),
        });
        match done {
            // To bring nothing to the disk proves nothing.
            Ok(()) if matches!(order, Some(Order::Sync)) => {}
            Ok(()) => {
                if let Some(refuses) = self.refuses.take() {
                    let _ = self.told.send(Trouble::Accepted(refuses.lost));
                }
            }
            Err(error) => self.refused(&error, segment, now),
        }
    }

    /// The end of the run.
    pub(super) fn end(mut self) {
        let done = self.components().and_then(|()| self.sync());
        // Nobody listens any more.
        drop(done);
    }

    fn refused(&mut self, error: &Error, segment: bool, now: Instant) {
        // A new file begins whole; the end of this one may be torn.
        self.file = None;
        let refuses = self.refuses.get_or_insert_with(|| {
            // Whoever does not listen any more has stopped.
            let _ = self.told.send(Trouble::Refused(format!("{}: {error}", self.folder.display())));
            Refuses { lost: 0, next: now, wait: BACK_OFF[0] }
        });
        refuses.lost += u64::from(segment);
        refuses.next = now + refuses.wait;
        refuses.wait = (refuses.wait * 2).min(BACK_OFF[1]);
    }

    fn segment(&mut self, hash: &str, chunk: &[u8]) -> Result<(), Error> {
        let part = self.room / FILES;
        if self.file.as_ref().is_some_and(|(_, length, _)| *length > 0 && length + chunk.len() as u64 > part) {
            self.sync()?;
            self.file = None;
        }
        if self.file.is_none() {
            make_room(&self.folder, self.room.saturating_sub(part.max(chunk.len() as u64)))?;
            self.sweep(hash)?;
            self.file = Some(next_file(&self.folder, self.run, &mut self.number)?);
        }
        let Some((file, length, path)) = &mut self.file else { return Ok(()) };
        // It may be there even if what follows fails.
        self.needed.entry(path.clone()).or_default().insert(hash.into());
        file.write_all(chunk)?;
        *length += chunk.len() as u64;
        Ok(())
    }

    /// Writes components, each whole or not at all.
    fn components(&mut self) -> Result<(), Error> {
        while let Some((hash, bytes)) = self.components.first_key_value() {
            let path = self.folder.join(format!("{hash}.wasm"));
            if !path.exists() {
                let new = path.with_extension("new");
                let mut file = File::create(&new)?;
                file.write_all(bytes)?;
                file.sync_all()?;
                std::fs::rename(new, path)?;
            }
            self.components.pop_first();
        }
        Ok(())
    }

    fn sync(&self) -> Result<(), Error> {
        self.file.as_ref().map_or(Ok(()), |(file, ..)| file.sync_data())
    }

    /// Deletes the components that no file needs any more, neither what is in use nor this one among them.
    fn sweep(&mut self, coming: &str) -> Result<(), Error> {
        let files = segments(&self.folder)?;
        self.needed.retain(|path, _| files.iter().any(|f| f.path == *path));
        for file in files {
            if let Entry::Vacant(unknown) = self.needed.entry(file.path) {
                // What cannot be read may need anything.
                let Ok(hashes) = components_of(unknown.key()) else { return Ok(()) };
                unknown.insert(hashes);
            }
        }
        let wanted = |hash: &str| {
            hash == coming || self.in_use.contains(hash) || self.needed.values().any(|hashes| hashes.contains(hash))
        };
        for entry in std::fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let (Some(hash), Some(ending)) = (path.file_stem(), path.extension()) else { continue };
            let hash = hash.to_string_lossy();
            let ours = hash.len() == DIGITS && hash.bytes().all(|b| b.is_ascii_hexdigit());
            if ours && (ending == "new" || ending == "wasm" && !wanted(&hash)) {
                std::fs::remove_file(path)?;
            }
        }
        Ok(())
    }
}

/// A file of segments.
struct Listed {
    path: PathBuf,
    run: Option<u64>,
    length: u64,
}

/// Files of segments, the oldest first.
fn segments(folder: &Path) -> std::io::Result<Vec<Listed>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        if path.extension().is_some_and(|e| e == ENDING) {
            let run = path.file_stem().and_then(|s| s.to_str()?.split('-').next()?.parse().ok());
            files.push(Listed { run, length: entry.metadata()?.len(), path });
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

/// A new file with its beginning, and its length; none stays behind that has no room for it. Run and number in six digits
/// each: their names are in the order of time.
fn next_file(folder: &Path, run: u64, number: &mut u64) -> Result<(File, u64, PathBuf), Error> {
    let path = folder.join(format!("{run:06}-{:06}.{ENDING}", *number + 1));
    let mut file = OpenOptions::new().write(true).create_new(true).open(&path)?;
    let beginning = header();
    if let Err(error) = file.write_all(&beginning) {
        // The number is free again: a full disk is not filled with names.
        let _ = std::fs::remove_file(&path);
        return Err(error);
    }
    *number += 1;
    Ok((file, beginning.len() as u64, path))
}

/// Deletes files that hold nothing, and the oldest ones until the rest is no longer than this. The newest stays.
fn make_room(folder: &Path, length: u64) -> Result<(), Error> {
    let mut files = segments(folder)?;
    files.retain(|f| f.length > header().len() as u64 || std::fs::remove_file(&f.path).is_err());
    let mut sum: u64 = files.iter().map(|f| f.length).sum();
    for file in files.iter().take(files.len().saturating_sub(1)) {
        if sum <= length {
            break;
        }
        std::fs::remove_file(&file.path)?;
        sum -= file.length;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_testbed::replay::{Event, Head, Start, hash_of, segment_chunk};
    use std::sync::mpsc::{Receiver, channel};

    #[test]
    fn files_that_hold_nothing_go_when_room_is_made() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = |n: u32| folder.path().join(format!("000001-{n:06}.{ENDING}"));
        std::fs::write(name(1), b"").expect("written");
        std::fs::write(name(2), header()).expect("written");
        std::fs::write(name(3), [&header()[..], b"a segment"].concat()).expect("written");
        make_room(folder.path(), 1 << 20).expect("made");
        let left: Vec<_> = segments(folder.path()).expect("listed").into_iter().map(|f| f.path).collect();
        assert_eq!(left, [name(3)]);
    }

    /// A segment of a component, as long as a file.
    fn segment(component: &[u8]) -> Order {
        let mut writer = latchwork_testbed::replay::Writer::new(Head {
            run: 1,
            epoch: 0,
            block: "b".into(),
            lane: "main".into(),
            every: 0,
            component: "c".into(),
            hash: hash_of(component),
            version: 0,
            class: "c".into(),
            memory: 0,
            number: 0,
            start: Start::Cold,
            settings: vec![0; 1000],
            cells: [0, 0],
            from: 0,
            to: 0,
            executions: 0,
            missed: 0,
        });
        writer.add(Event::Restarted);
        let segment = writer.cut(Start::Continued).expect("something happened");
        Order::Segment(segment.head.hash.clone(), segment_chunk(&segment))
    }

    fn writer(folder: &Path) -> (Writer, Receiver<Trouble>) {
        let (told, trouble) = channel();
        (Writer::new(folder, 16 << 10, told).expect("a folder"), trouble)
    }

    fn components(folder: &Path) -> usize {
        let names = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
        names.filter(|p| p.extension().is_some_and(|e| e == "wasm")).count()
    }

    #[test]
    fn a_component_goes_with_the_last_file_that_needs_it() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("mine.wasm"), b"somebody else's").expect("written");
        let now = Instant::now();
        for run in 0..3u8 {
            let (mut writer, _trouble) = writer(folder.path());
            for version in 0..40 {
                let component = [run, version];
                writer.take(Order::Component(hash_of(&component), component.to_vec()), now);
                writer.take(Order::InUse([hash_of(&component)].into()), now);
                writer.take(segment(&component), now);
                writer.take(segment(&component), now);
                let files = segments(folder.path()).expect("listed");
                let needed: BTreeSet<_> = files.iter().flat_map(|f| components_of(&f.path).expect("whole")).collect();
                assert!(needed.iter().all(|hash| folder.path().join(format!("{hash}.wasm")).exists()), "{needed:?}");
                // At most as many as there are files, the one in use, and what somebody else has put there.
                assert!(components(folder.path()) <= needed.len() + 2, "{version} of run {run}");
            }
            writer.end();
        }
    }

    #[test]
    fn a_component_in_use_stays_although_no_file_needs_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut writer, _trouble) = writer(folder.path());
        let (rests, works) = (b"rests".to_vec(), b"works".to_vec());
        let now = Instant::now();
        for component in [&rests, &works] {
            writer.take(Order::Component(hash_of(component), component.clone()), now);
        }
        writer.take(Order::InUse([hash_of(&rests), hash_of(&works)].into()), now);
        (0..20).for_each(|_| writer.take(segment(&works), now));
        assert_eq!(components(folder.path()), 2);
        writer.take(Order::InUse([hash_of(&works)].into()), now);
        (0..20).for_each(|_| writer.take(segment(&works), now));
        assert_eq!(components(folder.path()), 1);
    }

    #[test]
    fn a_disk_that_refuses_is_tried_less_and_less_often_and_told_once_each_way() {
        let folder = tempfile::tempdir().expect("a folder");
        let gone = folder.path().join("recorder");
        std::fs::create_dir(&gone).expect("made");
        let (mut writer, trouble) = writer(&gone);
        std::fs::remove_dir(&gone).expect("removed");
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let component = b"component".to_vec();
        writer.take(Order::Component(hash_of(&component), component.clone()), at(0));
        // Tried after 1, 3, 7, 15, 31, 63 s, and then once a minute; nothing is between.
        let mut tries = Vec::new();
        for second in 0..300 {
            let before = writer.refuses.as_ref().map(|r| r.next);
            writer.take(segment(&component), at(second * 1000 + 1));
            let next = writer.refuses.as_ref().map(|r| r.next);
            if next != before {
                tries.push(second);
            }
        }
        assert_eq!(tries, [1, 3, 7, 15, 31, 63, 123, 183, 243]);
        std::fs::create_dir(&gone).expect("made");
        writer.take(Order::Sync, at(303_500));
        assert!(writer.refuses.is_some(), "a sync of nothing proves nothing");
        writer.take(segment(&component), at(304_000));
        writer.take(segment(&component), at(304_001));
        let told: Vec<_> = trouble.try_iter().collect();
        assert!(matches!(&told[..], [Trouble::Refused(why), Trouble::Accepted(300)] if why.contains("recorder")));
        assert_eq!(components(&gone), 1, "the component was not forgotten");
    }
}
