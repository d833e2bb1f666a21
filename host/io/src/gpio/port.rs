//! The lines of one part of the plant: an interrupt lane, or the I/O thread.
//!
//! Whatever fails is closed and reported, and [`Port::open`] tries again what is closed. Nothing but opening, failing and
//! closing allocates: an interrupt lane works with this directly.

use super::chip::{Class, Trouble, words};
use super::group::{Group, is_gone};
use super::health::{Health, LineTrouble};
use super::settings::{Settings, Use};
use crate::backoff::Backoff;
use crate::direct::{Edge, Report};
use crate::driver::DriverConfig;
use crate::edges::{Account, Batch, EMPTY};
use gpiocdev::Error;
use gpiocdev::line::{EdgeDetection, Offset};
use std::os::fd::BorrowedFd;

/// One point and its line.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) name: String,
    pub(super) settings: Settings,
    pub(super) usage: Use,
    pub(super) safe: bool,
    /// Its place among the outputs, or among all others.
    place: usize,
    /// Its number, once the chip is there.
    pub(super) offset: Option<Offset>,
    /// The request it belongs to while it is open.
    pub(super) group: Option<usize>,
    pub(super) trouble: Option<LineTrouble>,
    /// The account of its edges.
    account: Account,
    /// The lane behind an output has executed: `initial` has had its time.
    pub(super) begun: bool,
}

impl Line {
    /// What an output shows when it is taken.
    pub(super) fn first(&self) -> bool {
        self.settings.initial.filter(|_| !self.begun).unwrap_or(self.safe)
    }
}

/// Some points of a driver and the way to their lines.
#[derive(Debug)]
pub(super) struct Port {
    /// The chip as the plant file names it.
    pub(super) key: String,
    pub(super) health: Health,
    /// In the order of the configuration.
    pub(super) lines: Vec<Line>,
    /// The points that are outputs.
    pub(super) outputs: Vec<usize>,
    pub(super) groups: Vec<Option<Group>>,
    pub(super) backoff: Backoff,
    batch: Box<Batch>,
}

impl Port {
    /// A port for checked points; nothing is opened.
    pub(super) fn new(config: &DriverConfig, usage: impl Fn(usize) -> Use) -> Result<Self, String> {
        let key = config.values.text("chip").ok_or("the chip is missing")?.to_owned();
        let (mut lines, mut outputs) = (Vec::with_capacity(config.points.len()), Vec::new());
        for (n, point) in config.points.iter().enumerate() {
            let settings =
                Settings::of(&point.values).ok_or_else(|| format!("point `{}` names no line", point.name))?;
            let usage = usage(n);
            let account = Account::new(settings.edge == EdgeDetection::BothEdges);
            lines.push(Line {
                name: point.name.clone(),
                settings,
                usage,
                safe: point.safe.is_some_and(|cell| cell != 0),
                place: if usage == Use::Output { outputs.len() } else { n - outputs.len() },
                offset: None,
                group: None,
                trouble: None,
                account,
                begun: false,
            });
            if usage == Use::Output {
                outputs.push(n);
            }
        }
        let health = Health::new(config.name.clone());
        let batch = Box::new(EMPTY);
        Ok(Self { key, health, lines, outputs, groups: Vec::new(), backoff: Backoff::new(), batch })
    }

    /// True when all lines are open.
    pub(super) fn is_open(&self) -> bool {
        self.lines.iter().all(|l| l.group.is_some())
    }

    /// True when the line of a point is open.
    pub(super) fn is_good(&self, point: usize) -> bool {
        self.lines.get(point).is_some_and(|l| l.group.is_some())
    }

    /// The open request of a point, with its place.
    fn group(&self, point: usize) -> Option<(usize, &Group)> {
        let place = self.lines.get(point)?.group?;
        Some((place, self.groups.get(place)?.as_ref()?))
    }

    /// What becomes readable when edges of a point wait.
    pub(super) fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>> {
        let (_, group) = self.group(point)?;
        (group.usage == Use::Edges).then(|| group.descriptor())
    }

    /// Takes a batch of edges; true when there may be more.
    pub(super) fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge), report: Report<'_>) -> bool {
        let Some(line) = self.lines.get_mut(point) else { return false };
        let Some((place, group)) = line.group.and_then(|p| Some((p, self.groups.get(p)?.as_ref()?))) else {
            return false;
        };
        if group.usage != Use::Edges {
            return false;
        }
        let result = group.edges(&mut self.batch, &mut line.account, |at, level, missed| {
            take(Edge { point, at, level, missed });
        });
        match result {
            Ok(more) => more,
            Err(error) => {
                self.fail(place, "taking its edges", &error, report);
                false
            }
        }
    }

    /// The present level of a point; `None` while it is closed.
    pub(super) fn level(&mut self, point: usize, report: Report<'_>) -> Option<bool> {
        let (place, group) = self.group(point)?;
        let offset = self.lines[point].offset?;
        match group.level(offset) {
            Ok(level) => Some(level),
            Err(error) => {
                self.fail(place, "reading it", &error, report);
                None
            }
        }
    }

    /// Reads all level points, one step per request, and hands on those that are open, by their place.
    pub(super) fn levels(&mut self, take: &mut dyn FnMut(usize, bool), report: Report<'_>) {
        for place in 0..self.groups.len() {
            // Losing the chip closes all requests, also those still to come.
            let group = self.groups.get_mut(place).and_then(Option::as_mut);
            let Some(group) = group.filter(|g| g.usage == Use::Level) else { continue };
            let lines = &self.lines;
            if let Err(error) = group.levels(|point, level| take(lines[point].place, level)) {
                self.fail(place, "reading it", &error, report);
            }
        }
    }

    /// Writes what differs from what the outputs show, one step per request; one cell per output.
    pub(super) fn write(&mut self, outputs: &[u64], report: Report<'_>) {
        for place in 0..self.groups.len() {
            let group = self.groups.get_mut(place).and_then(Option::as_mut);
            let Some(group) = group.filter(|g| g.usage == Use::Output) else { continue };
            let lines = &self.lines;
            let wanted = |point: usize| match outputs.get(lines[point].place) {
                Some(cell) => *cell != 0,
                None => lines[point].safe,
            };
            if let Err(error) = group.write(wanted) {
                self.fail(place, "writing it", &error, report);
            }
        }
    }

    /// Looks whether the chip is still there: nobody else would, while nothing is read and nothing changes.
    pub(super) fn check(&mut self, report: Report<'_>) {
        if !self.groups.iter().flatten().all(Group::is_there) {
            self.lose(report);
        }
    }

    /// Writes the safe values of all outputs and reports those that did not get them.
    pub(super) fn make_safe(&mut self, report: Report<'_>) {
        let (mut open, mut cause) = (Vec::new(), String::from("their lines are not open"));
        for group in self.groups.iter_mut().flatten().filter(|g| g.usage == Use::Output) {
            match group.make_safe() {
                Ok(()) => {}
                Err(error) => {
                    open.extend(group.members.iter().map(|m| m.point));
                    cause = words(&error);
                }
            }
        }
        let closed = |n: &usize| self.lines[*n].usage == Use::Output && self.lines[*n].group.is_none();
        open.extend((0..self.lines.len()).filter(closed));
        if !open.is_empty() {
            let names: Vec<&str> = open.iter().map(|n| self.lines[*n].name.as_str()).collect();
            self.health.not_safe(report, &names, &cause);
        }
    }

    /// Closes a request that failed, or everything when the chip is gone.
    fn fail(&mut self, place: usize, doing: &str, error: &Error, report: Report<'_>) {
        if is_gone(error) {
            return self.lose(report);
        }
        let Some(group) = self.groups[place].take() else { return };
        self.backoff = Backoff::new();
        for member in &group.members {
            let line = &mut self.lines[member.point];
            line.group = None;
            let text = format!("line {} ({}): {doing} failed: {}", member.offset, self.key, words(error));
            self.health.line_lost(report, &line.name, &mut line.trouble, text);
        }
    }

    /// The chip is gone: everything is closed.
    pub(super) fn lose(&mut self, report: Report<'_>) {
        self.groups.clear();
        self.backoff = Backoff::new();
        for line in &mut self.lines {
            (line.group, line.offset) = (None, None);
        }
        let text = format!("the chip {} is gone: it was unplugged, or its kernel driver was removed", self.key);
        self.health.chip_lost(report, &Trouble::new(Class::Absent, text));
    }

    /// Takes a request over.
    pub(super) fn install(&mut self, group: Group) {
        let place = self.groups.iter().position(Option::is_none).unwrap_or_else(|| {
            self.groups.push(None);
            self.groups.len() - 1
        });
        for member in &group.members {
            let line = &mut self.lines[member.point];
            line.group = Some(place);
            line.account = Account::new(line.settings.edge == EdgeDetection::BothEdges);
        }
        self.groups[place] = Some(group);
    }
}
