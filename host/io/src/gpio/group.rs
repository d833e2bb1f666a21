//! One request of the kernel: some lines that are taken, read and written together.

use super::chip::errno;
use super::settings::{Settings, Use};
use crate::edges::{self, Account, Batch};
use gpiocdev::line::{Offset, Value, Values};
use gpiocdev::request::{Config, Request};
use gpiocdev::{Error, Result};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use std::os::fd::{AsFd, BorrowedFd};
use std::path::Path;

/// One line of a request that is to be made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted<'a> {
    /// Its place among the points of the port.
    pub(super) point: usize,
    pub(super) offset: Offset,
    pub(super) settings: &'a Settings,
    /// What an output shows first.
    pub(super) first: bool,
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
            config.with_line(line.offset).from_line_config(&line.settings.config(usage, line.first));
            members.push(Member { point: line.point, offset: line.offset, shown: line.first, safe: line.safe });
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
            edges::never_block(&request)?;
        }
        Ok(Self { request, usage, members, levels })
    }

    /// What becomes readable when edges wait.
    pub(super) fn descriptor(&self) -> BorrowedFd<'_> {
        self.request.as_fd()
    }

    /// Takes a batch of edges that wait: see [`edges::take`].
    pub(super) fn edges(
        &self,
        batch: &mut Batch,
        account: &mut Account,
        take: impl FnMut(u64, bool, u64),
    ) -> Result<bool> {
        edges::take(&self.request, batch, account, take)
    }

    /// False once the chip is gone: the kernel hangs up. Neither the chip nor its bus is asked.
    pub(super) fn is_there(&self) -> bool {
        let mut descriptor = [PollFd::new(&self.request, PollFlags::empty())];
        // What cannot be asked for may be there: the next reading or writing tells.
        let asked = poll(&mut descriptor, Some(&Timespec::default())).is_ok();
        !(asked && descriptor[0].revents().intersects(PollFlags::HUP | PollFlags::ERR))
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
        let result = twice(|| self.request.set_values(&self.levels));
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

/// A bus may be disturbed for a moment: a writing that fails is tried once more. A chip that is gone is not asked again.
fn twice(mut write: impl FnMut() -> Result<()>) -> Result<()> {
    match write() {
        Err(error) if !is_gone(&error) => write(),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_passing_trouble_is_written_over_and_a_lasting_one_is_told() {
        for (what, errors, calls, ends_well) in [
            ("no trouble", &[][..], 1, true),
            ("a disturbance", &[Errno::IO], 2, true),
            ("a trouble that stays", &[Errno::IO, Errno::IO], 2, false),
            ("a chip that is gone", &[Errno::NODEV], 1, false),
            ("a disturbance, then gone", &[Errno::IO, Errno::NODEV], 2, false),
        ] {
            let mut made = 0;
            let result = twice(|| {
                made += 1;
                errors.get(made - 1).map_or(Ok(()), |e| Err(std::io::Error::from(*e).into()))
            });
            assert_eq!((made, result.is_ok()), (calls, ends_well), "{what}");
        }
    }
}
