//! What is reported, and when it is not.
//!
//! A trouble is one event when it begins or becomes another, and one when it ends: a chip that is away for a night must
//! not fill the records.

use super::chip::{Class, Trouble};
use crate::direct::Report;
use crate::driver::IoEvent;

const NOTE: u8 = 0;
const REFUSED: u8 = 150;
const LOST: u8 = 180;
const UNSAFE: u8 = 220;

/// The state of the way to the chip.
#[derive(Debug)]
pub(super) struct Health {
    driver: String,
    met: bool,
    trouble: Option<Class>,
}

/// What is wrong with one line while the chip is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LineTrouble {
    /// It worked before.
    lost: bool,
    text: String,
}

impl Health {
    pub(super) fn new(driver: String) -> Self {
        Self { driver, met: false, trouble: None }
    }

    /// The name of the driver.
    pub(super) fn driver(&self) -> &str {
        &self.driver
    }

    fn say(&self, report: Report<'_>, point: Option<&str>, transition: &'static str, priority: u8, text: String) {
        let source = point.map_or_else(|| self.driver.clone(), |p| format!("{}.{p}", self.driver));
        report(IoEvent { source, transition, priority, text });
    }

    /// The chip cannot be had, or is gone.
    pub(super) fn chip_lost(&mut self, report: Report<'_>, trouble: &Trouble) {
        if self.trouble == Some(trouble.class) {
            return;
        }
        self.trouble = Some(trouble.class);
        let (transition, priority) = match trouble.class {
            Class::Absent | Class::Other(_) => ("lost", LOST),
            Class::Denied | Class::Wrong => ("refused", REFUSED),
        };
        let text = format!("{}; inputs are bad, outputs are not driven, tries go on", trouble.text());
        self.say(report, None, transition, priority, text);
    }

    /// The chip is there, and these points are open. Tells whether that was news.
    pub(super) fn chip_open(&mut self, report: Report<'_>, chip: &str, points: &[&str]) -> bool {
        if self.met && self.trouble.is_none() {
            return false;
        }
        let again = if self.met { " again" } else { "" };
        (self.met, self.trouble) = (true, None);
        self.say(report, None, "connected", NOTE, format!("{chip} is open{again} for {}", list(points)));
        true
    }

    /// A line cannot be had.
    pub(super) fn refused(&self, report: Report<'_>, point: &str, state: &mut Option<LineTrouble>, text: String) {
        if state.as_ref().is_some_and(|t| t.text == text) {
            return;
        }
        self.say(report, Some(point), "refused", REFUSED, format!("{text}; tries go on"));
        let lost = state.as_ref().is_some_and(|t| t.lost);
        *state = Some(LineTrouble { lost, text });
    }

    /// A line that was open failed while the chip is still there.
    pub(super) fn line_lost(&self, report: Report<'_>, point: &str, state: &mut Option<LineTrouble>, text: String) {
        self.say(report, Some(point), "lost", LOST, format!("{text}; tries to open it again go on"));
        *state = Some(LineTrouble { lost: true, text });
    }

    /// A line is open.
    pub(super) fn line_open(&self, report: Report<'_>, point: &str, state: &mut Option<LineTrouble>) {
        if let Some(trouble) = state.take() {
            let (transition, text) =
                if trouble.lost { ("connected", "the line works again") } else { ("accepted", "the line is free now") };
            self.say(report, Some(point), transition, NOTE, text.to_owned());
        }
    }

    /// The safe values did not arrive.
    pub(super) fn not_safe(&self, report: Report<'_>, points: &[&str], cause: &str) {
        let text = format!(
            "the safe values of {} could not be written: {cause}; the lines may keep what they showed last",
            list(points)
        );
        self.say(report, None, "unsafe", UNSAFE, text);
    }
}

/// Names of points for a sentence: the first few.
fn list(points: &[&str]) -> String {
    const SHOWN: usize = 8;
    if points.is_empty() {
        return "no point yet".into();
    }
    let names: Vec<String> = points.iter().take(SHOWN).map(|p| format!("`{p}`")).collect();
    let more = points.len().saturating_sub(SHOWN);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}
