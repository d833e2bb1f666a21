//! One request of the kernel: some lines that are taken, read and written together.

use super::chip::errno;
use super::settings::{Settings, Use};
use gpiocdev::line::{Offset, Value, Values};
use gpiocdev::request::{Config, Request};
use gpiocdev::{Error, Result};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use std::os::fd::{AsFd, BorrowedFd};
use std::path::Path;

/// Words of one edge, and edges of one batch.
const WORDS: usize = 6;
const BATCH: usize = 64;

/// Where the edges of a batch are read to. One per lane: they are handed on at once.
pub(super) type Batch = [u64; BATCH * WORDS];

/// An empty batch.
pub(super) const EMPTY: Batch = [0; BATCH * WORDS];

/// One line of a request that is to be made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted<'a> {
    /// Its place among the points of the port.
    pub(super) point: usize,
    pub(super) offset: Offset,
    pub(super) settings: &'a Settings,
    /// What an output shows in the end.
    pub(super) safe: bool,
}

/// A line of an open request.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub(super) point: usize,
    pub(super) offset: Offset,
    /// What an output shows.
    shown: bool,
    safe: bool,
}

/// An open request.
#[derive(Debug)]
pub(super) struct Group {
    request: Request,
    pub(super) usage: Use,
    pub(super) members: Vec<Member>,
    /// Inputs: the levels as last read. Outputs: empty, room for what is to be written.
    levels: Values,
}

impl Group {
    /// Takes lines from the kernel, all or none. Inputs are read once, so that a line that cannot be read is found here.
    pub(super) fn request(chip: &Path, consumer: &str, usage: Use, wanted: &[Wanted<'_>]) -> Result<Self> {
        let mut config = Config::default();
        let mut members = Vec::with_capacity(wanted.len());
        for line in wanted {
            let level = line.settings.initial.unwrap_or(line.safe);
            config.with_line(line.offset).from_line_config(&line.settings.config(usage, level));
            members.push(Member { point: line.point, offset: line.offset, shown: level, safe: line.safe });
        }
        let mut builder = Request::from_config(config);
        builder.on_chip(chip).with_consumer(consumer);
        if usage == Use::Edges {
            builder.with_kernel_event_buffer_size(wanted.iter().map(|w| w.settings.buffer).max().unwrap_or_default());
        }
        let request = builder.request()?;
        let offsets: Vec<Offset> = members.iter().map(|m| m.offset).collect();
        let mut levels = Values::from_offsets(&offsets);
        if usage == Use::Output {
            // Emptied, not made anew: its room is kept, so writing never allocates.
            offsets.iter().for_each(|o| levels.unset(*o));
        } else {
            request.values(&mut levels)?;
        }
        if usage == Use::Edges {
            // Reading must never block the lane. The library's `read_edge_event` is not used: it loses edges.
            fcntl_setfl(request.as_fd(), OFlags::NONBLOCK).map_err(std::io::Error::from)?;
        }
        Ok(Self { request, usage, members, levels })
    }

    /// What becomes readable when edges wait.
    pub(super) fn descriptor(&self) -> BorrowedFd<'_> {
        self.request.as_fd()
    }

    /// Reads the edges that wait, oldest first, and hands on time stamp, level and the line's own count of each; true
    /// when the batch was full.
    pub(super) fn edges(&self, batch: &mut Batch, mut take: impl FnMut(u64, bool, u32)) -> Result<bool> {
        let words = match self.request.read_edge_events_into_slice(batch) {
            Ok(words) => words,
            Err(error) => {
                return match errno(&error) {
                    Some(Errno::AGAIN) => Ok(false),
                    Some(Errno::INTR) => Ok(true),
                    _ => Err(error),
                };
            }
        };
        for event in batch[..words.min(batch.len())].chunks_exact(WORDS) {
            let event = self.request.edge_event_from_slice(event)?;
            take(event.timestamp_ns, event.kind == gpiocdev::line::EdgeKind::Rising, event.line_seqno);
        }
        Ok(words >= batch.len())
    }

    /// The present level of one line.
    pub(super) fn level(&self, offset: Offset) -> Result<bool> {
        self.request.value(offset).map(bool::from)
    }

    /// Reads all levels in one step and hands them on by point.
    pub(super) fn levels(&mut self, mut take: impl FnMut(usize, bool)) -> Result<()> {
        self.request.values(&mut self.levels)?;
        for member in &self.members {
            take(member.point, self.levels.get(member.offset) == Some(Value::Active));
        }
        Ok(())
    }

    /// Writes in one step the lines whose level is to change, and touches no other.
    pub(super) fn write(&mut self, wanted: impl Fn(usize) -> bool) -> Result<()> {
        for member in &self.members {
            let level = wanted(member.point);
            if level != member.shown {
                self.levels.set(member.offset, Value::from(level));
            }
        }
        self.flush()
    }

    /// Writes the safe levels in one step, also of lines that should show them already.
    pub(super) fn make_safe(&mut self) -> Result<()> {
        for member in &self.members {
            self.levels.set(member.offset, Value::from(member.safe));
        }
        self.flush()
    }

    /// Writes what is in `levels`, and empties it.
    fn flush(&mut self) -> Result<()> {
        // To the library, no lines would mean all lines.
        if self.levels.is_empty() {
            return Ok(());
        }
        let result = self.request.set_values(&self.levels);
        for member in &mut self.members {
            if let (Ok(()), Some(level)) = (&result, self.levels.get(member.offset)) {
                member.shown = level.into();
            }
            self.levels.unset(member.offset);
        }
        result
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        if self.usage == Use::Output {
            // A chip that is gone cannot be told, and nobody is left to be told.
            let _ = self.make_safe();
        }
    }
}

/// Errors of these numbers say that the chip itself is gone.
pub(super) fn is_gone(error: &Error) -> bool {
    errno(error) == Some(Errno::NODEV)
}
