//! Opening what is closed: which lines share a request, and what to do when the kernel refuses one of them.
//!
//! Outputs come first, so that they show their safe values before anything can start a lane. All outputs share one
//! request and are therefore written in one step; each line with edges has a request of its own, so that a storm on one
//! cannot push out the edges of another.

use super::chip::{errno, find, words};
use super::group::{Group, Wanted, is_gone};
use super::port::Port;
use super::settings::{Select, Use};
use crate::direct::Report;
use gpiocdev::Error;
use gpiocdev::chip::Chip;
use gpiocdev::line::Offset;
use latchwork_image::nearest;
use rustix::io::Errno;

/// Most lines of one request.
const MOST_LINES: usize = 64;
/// Most sets of flags and debounce times of one request; one of the kernel's ten is for the outputs' values, one set of
/// flags is free.
const MOST_ATTRIBUTES: usize = 10;

impl Port {
    /// Tries to open what is closed, if it is time for that: so many seconds have passed since the last call. Reports what is
    /// news.
    pub(super) fn open(&mut self, seconds: u32, report: Report<'_>) {
        if self.is_open() || !self.backoff.due(seconds) {
            return;
        }
        let mut news = false;
        self.attempt(&mut |event| {
            news = true;
            report(event);
        });
        self.backoff.failed(news);
    }

    fn attempt(&mut self, report: Report<'_>) {
        let chip = match find(&self.key) {
            Ok(chip) => chip,
            Err(trouble) => {
                // With lines that still work it is a passing trouble, or the next reading or writing finds it out.
                if self.groups.iter().all(Option::is_none) {
                    self.health.chip_lost(report, &trouble);
                }
                return;
            }
        };
        let closed: Vec<usize> = (0..self.lines.len()).filter(|n| self.lines[*n].group.is_none()).collect();
        let known = self.resolve(&chip, &closed, report);
        for usage in [Use::Output, Use::Level, Use::Edges] {
            let lines: Vec<usize> = known.iter().copied().filter(|n| self.lines[*n].usage == usage).collect();
            for lines in self.requests(usage, &lines) {
                if !self.take(&chip, usage, &lines, report) {
                    return self.lose(report);
                }
            }
        }
        let opened: Vec<usize> = closed.into_iter().filter(|n| self.lines[*n].group.is_some()).collect();
        let names: Vec<&str> = opened.iter().map(|n| self.lines[*n].name.as_str()).collect();
        let label = chip.info().map(|i| i.label).unwrap_or_default();
        self.health.chip_open(report, &format!("{} (\"{label}\")", chip.path().display()), &names);
        for n in opened {
            let line = &mut self.lines[n];
            self.health.line_open(report, &line.name, &mut line.trouble);
        }
    }

    /// Finds the numbers of lines; returns those that have one.
    fn resolve(&mut self, chip: &Chip, closed: &[usize], report: Report<'_>) -> Vec<usize> {
        // Asking for every line's name takes its time, and a lane waits meanwhile.
        let named = closed.iter().any(|n| matches!(self.lines[*n].settings.select, Select::Name(_)));
        let infos = chip.line_info_iter().ok().filter(|_| named);
        let names: Vec<(Offset, String)> =
            infos.into_iter().flatten().filter_map(Result::ok).map(|i| (i.offset, i.name)).collect();
        let count = chip.info().map_or(0, |i| i.num_lines);
        for n in closed {
            self.lines[*n].offset = None;
        }
        let mut known = Vec::new();
        for n in closed.iter().copied() {
            let found = number(&self.lines[n].settings.select, count, &names).and_then(|offset| {
                match self.lines.iter().find(|l| l.offset == Some(offset)) {
                    Some(other) => Err(format!("line {offset} is the line of `{}` already", other.name)),
                    None => Ok(offset),
                }
            });
            let line = &mut self.lines[n];
            match found {
                Ok(offset) => {
                    line.offset = Some(offset);
                    known.push(n);
                }
                Err(text) => self.health.refused(report, &line.name, &mut line.trouble, text),
            }
        }
        known
    }

    /// Shares lines out among as few requests as possible.
    fn requests(&self, usage: Use, lines: &[usize]) -> Vec<Vec<usize>> {
        if usage == Use::Edges {
            return lines.iter().map(|n| vec![*n]).collect();
        }
        let (mut requests, mut present) = (Vec::new(), Vec::new());
        let (mut flags, mut debounces) = (Vec::new(), Vec::new());
        for n in lines {
            let settings = &self.lines[*n].settings;
            let new_flags = !flags.contains(&settings.flags());
            let new_debounce = settings.debounce.is_some_and(|d| !debounces.contains(&d));
            let attributes = flags.len() + debounces.len() + usize::from(new_flags) + usize::from(new_debounce);
            if present.len() == MOST_LINES || attributes > MOST_ATTRIBUTES {
                requests.push(std::mem::take(&mut present));
                (flags, debounces) = (Vec::new(), Vec::new());
            }
            present.push(*n);
            if !flags.contains(&settings.flags()) {
                flags.push(settings.flags());
            }
            debounces.extend(settings.debounce.filter(|d| !debounces.contains(d)));
        }
        if !present.is_empty() {
            requests.push(present);
        }
        requests
    }

    /// Takes some lines in one request; if that is refused, as many of them together as possible. False when the chip is
    /// gone.
    fn take(&mut self, chip: &Chip, usage: Use, lines: &[usize], report: Report<'_>) -> bool {
        let error = match self.request(chip, usage, lines) {
            Ok(group) => {
                self.install(group);
                return true;
            }
            Err(error) if is_gone(&error) => return false,
            Err(error) => error,
        };
        if let [n] = lines {
            let line = &mut self.lines[*n];
            let text = refusal(chip, line.offset.unwrap_or_default(), usage, &error);
            self.health.refused(report, &line.name, &mut line.trouble, text);
            return true;
        }
        let held = |n: &usize| self.lines[*n].offset.is_some_and(|o| chip.line_info(o).is_ok_and(|i| i.used));
        let (held, free): (Vec<usize>, Vec<usize>) = lines.iter().copied().partition(held);
        if held.is_empty() || free.is_empty() {
            // One of them is to blame for something else: each shows for itself.
            return lines.iter().all(|n| self.take(chip, usage, &[*n], report));
        }
        self.take(chip, usage, &free, report) && held.iter().all(|n| self.take(chip, usage, &[*n], report))
    }

    fn request(&self, chip: &Chip, usage: Use, lines: &[usize]) -> gpiocdev::Result<Group> {
        let wanted = lines.iter().filter_map(|n| {
            let line = &self.lines[*n];
            let (first, safe) = (line.first(), line.safe);
            Some(Wanted { point: *n, offset: line.offset?, settings: &line.settings, first, safe })
        });
        let wanted: Vec<_> = wanted.collect();
        let driver = self.health.driver();
        let consumer = match lines {
            [one] => format!("latchwork {driver}.{}", self.lines[*one].name),
            _ => format!("latchwork {driver}"),
        };
        Group::request(chip.path(), &consumer, usage, &wanted)
    }
}

/// The number of a line on a chip with this many lines and these names.
fn number(select: &Select, count: u32, names: &[(Offset, String)]) -> Result<Offset, String> {
    let name = match select {
        Select::Number(number) if *number < count => return Ok(*number),
        Select::Number(number) => {
            return Err(format!("there is no line {number}: the chip has lines 0 to {}", count.saturating_sub(1)));
        }
        Select::Name(name) => name,
    };
    let found: Vec<Offset> = names.iter().filter(|(_, n)| n == name).map(|(o, _)| *o).collect();
    match found[..] {
        [one] => Ok(one),
        [] => {
            let near = nearest(name, names.iter().map(|(_, n)| n.as_str()).filter(|n| !n.is_empty()));
            let hint = near.map_or(String::new(), |n| format!(" (did you mean \"{n}\"?)"));
            Err(format!("no line of the chip is named \"{name}\"{hint}; `latchwork gpio` lists them"))
        }
        [first, second, ..] => Err(format!(
            "lines {first} and {second} are both named \"{name}\": write the number of the one that is meant"
        )),
    }
}

/// Why the kernel refuses a line, for a person.
fn refusal(chip: &Chip, offset: Offset, usage: Use, error: &Error) -> String {
    let line = format!("line {offset} of {}", chip.path().display());
    match errno(error) {
        Some(Errno::BUSY) => {
            let holder = chip.line_info(offset).map(|i| i.consumer).unwrap_or_default();
            let holder = if holder.is_empty() { "somebody who gave no name".into() } else { format!("\"{holder}\"") };
            format!(
                "{line} is held by {holder}: stop that program or take another line; `latchwork gpio` shows who holds what"
            )
        }
        Some(Errno::NXIO | Errno::NOTSUP | Errno::INVAL) if usage == Use::Edges => {
            format!(
                "{line} cannot be requested with edges ({}): does the chip report interrupts of this line?",
                words(error)
            )
        }
        Some(Errno::ACCESS | Errno::PERM) => format!("{line} may not be used by programs: {}", words(error)),
        _ => format!("{line} cannot be taken: {}", words(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_by_number_and_by_a_name_that_is_there_once() {
        let chip = [(0, "GPIO0".to_owned()), (1, "TWIN".to_owned()), (2, "TWIN".to_owned()), (3, String::new())];
        let by_name = |n: &str| number(&Select::Name(n.into()), 4, &chip);
        assert_eq!(number(&Select::Number(3), 4, &[]), Ok(3));
        assert_eq!(by_name("GPIO0"), Ok(0));
        let errors: Vec<String> =
            [number(&Select::Number(4), 4, &[]), by_name("GPIO1"), by_name("pump"), by_name("TWIN")]
                .into_iter()
                .filter_map(Result::err)
                .collect();
        insta::assert_snapshot!(errors.join("\n"));
    }
}
