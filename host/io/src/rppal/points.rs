//! All points of an interrupt lane, or of the driver on the I/O thread: open, read, write, safe at the end.
//!
//! Every trouble is told once when it begins, again when its reason changes, and once when it is over.

use super::board::{Board, Model};
use super::keys::pwm_chip;
use super::pin::{Input, Output};
use super::place::{PinPlace, Place, PwmPlace};
use super::pwm::{Closed, Pwm, ROOT};
use crate::backoff::Backoff;
use crate::direct::{Direct, Edge, Report, Role};
use crate::driver::{DriverConfig, IoEvent};
use rppal::gpio::Gpio;
use std::os::fd::BorrowedFd;
use std::path::Path;

const NOTE: u8 = 0;
const REFUSED: u8 = 150;
const LOST: u8 = 180;
const UNSAFE: u8 = 220;

/// The points. Dropped, its outputs show their safe values.
pub(super) struct Points {
    driver: String,
    pwm_chip: Option<u8>,
    points: Vec<Point>,
    /// Points that are outputs, in their order, and all others.
    outputs: Vec<usize>,
    pub(super) inputs: Vec<usize>,
    backoff: Backoff,
    /// The registers, once they are mapped.
    mapped: Option<Gpio>,
    /// Why the board as a whole cannot be used, as it was told.
    told: Option<String>,
}

struct Point {
    name: String,
    wish: Wish,
    state: State,
    /// Why it is closed, as it was told.
    told: Option<String>,
}

/// What a point is to be.
#[derive(Clone, Copy)]
enum Wish {
    Input { place: PinPlace, edges: bool },
    Output { place: PinPlace, safe: bool },
    Pwm { place: PwmPlace, safe: f64 },
}

/// What it is.
enum State {
    Closed,
    Input(Input),
    Output(Output),
    Pwm(Pwm),
}

impl Points {
    /// Nothing is opened yet.
    pub(super) fn new(config: &DriverConfig, roles: &[Role]) -> Result<Self, String> {
        let mut points = Vec::new();
        for (point, role) in config.points.iter().zip(roles) {
            let place = Place::of(&point.values).map_err(|problems| {
                let messages: Vec<String> = problems.into_iter().map(|p| p.message).collect();
                format!("point `{}`: {}", point.name, messages.join("; "))
            })?;
            let safe = point.safe.unwrap_or_default();
            let wish = match (place, role) {
                (Place::Pin(place), Role::Edge) => Wish::Input { place, edges: true },
                (Place::Pin(place), Role::Level) => Wish::Input { place, edges: false },
                (Place::Pin(place), Role::Output) => Wish::Output { place, safe: safe != 0 },
                (Place::Pwm(place), Role::Output) => {
                    let safe = f64::from_bits(safe);
                    Wish::Pwm { place, safe: if safe.is_nan() { 0.0 } else { safe } }
                }
                (Place::Pwm(_), _) => return Err(format!("point `{}` is a PWM channel: it has no input", point.name)),
            };
            points.push(Point { name: point.name.clone(), wish, state: State::Closed, told: None });
        }
        let (outputs, inputs) = (0..points.len()).partition(|n| roles[*n] == Role::Output);
        let (driver, pwm_chip) = (config.name.clone(), pwm_chip(&config.values));
        Ok(Self { driver, pwm_chip, points, outputs, inputs, backoff: Backoff::new(), mapped: None, told: None })
    }

    /// The board, and its pins if any of them is to be opened.
    fn board(&mut self) -> Result<(Model, Option<Board>), String> {
        let model = Model::find()?;
        let pins = self.points.iter().any(|p| p.is_closed() && !matches!(p.wish, Wish::Pwm { .. }));
        Ok((model, if pins { Some(Board::open(model, &mut self.mapped)?) } else { None }))
    }

    /// The board as a whole cannot be used.
    fn refuse(&mut self, why: String, report: Report<'_>) {
        if self.told.as_ref() == Some(&why) {
            return;
        }
        let closed: Vec<&str> = self.points.iter().filter(|p| p.is_closed()).map(|p| p.name.as_str()).collect();
        let text = format!("{why}. Inputs are bad and outputs are not driven: {}", list(&closed));
        report(IoEvent { source: self.driver.clone(), transition: "refused", priority: REFUSED, text });
        self.told = Some(why);
    }
}

impl Points {
    /// Tries to open what is closed, if it is time for that: so many seconds have passed since the last call.
    pub(super) fn try_open(&mut self, seconds: u32, report: Report<'_>) {
        if self.healthy() || !self.backoff.due(seconds) {
            return;
        }
        let mut news = false;
        let wait = self.attempt(&mut |event| {
            news = true;
            report(event);
        });
        self.backoff.failed(news || wait);
    }

    /// Opens what is closed; true when a point needs only a moment.
    fn attempt(&mut self, report: Report<'_>) -> bool {
        let (model, board) = match self.board() {
            Ok(found) => found,
            Err(why) => {
                self.refuse(why, report);
                return false;
            }
        };
        if self.told.take().is_some() {
            let text = "the board's pins can be used now".to_owned();
            report(IoEvent { source: self.driver.clone(), transition: "accepted", priority: NOTE, text });
        }
        let mut wait = false;
        for point in self.points.iter_mut().filter(|p| p.is_closed()) {
            wait |= point.open(model, board.as_ref(), self.pwm_chip, &self.driver, report);
        }
        wait
    }
}

impl Direct for Points {
    fn open(&mut self, report: Report<'_>) {
        self.try_open(1, report);
    }

    fn healthy(&self) -> bool {
        self.points.iter().all(|p| !p.is_closed())
    }

    fn good(&self, point: usize) -> bool {
        self.points.get(point).is_some_and(|p| !p.is_closed())
    }

    fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>> {
        match &self.points.get(point)?.state {
            State::Input(input) => input.descriptor(),
            _ => None,
        }
    }

    fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge), report: Report<'_>) -> bool {
        let Some(p) = self.points.get_mut(point) else { return false };
        let State::Input(input) = &mut p.state else { return false };
        match input.edges(point, take) {
            Ok(more) => more,
            Err(why) => {
                p.lose(&self.driver, "reading its edges", why, report);
                self.backoff = Backoff::new();
                false
            }
        }
    }

    fn level(&mut self, point: usize, report: Report<'_>) -> Option<bool> {
        let p = self.points.get_mut(point)?;
        let State::Input(input) = &p.state else { return None };
        match input.level() {
            Ok(level) => Some(level),
            Err(why) => {
                p.lose(&self.driver, "reading its level", why, report);
                self.backoff = Backoff::new();
                None
            }
        }
    }

    fn write(&mut self, outputs: &[u64], report: Report<'_>) {
        for (point, cell) in self.outputs.iter().zip(outputs) {
            let p = &mut self.points[*point];
            match (&mut p.state, p.wish) {
                (State::Output(output), _) => output.show(*cell != 0),
                (State::Pwm(pwm), Wish::Pwm { safe, .. }) => {
                    let wanted = f64::from_bits(*cell);
                    if let Err(why) = pwm.show(if wanted.is_nan() { safe } else { wanted }) {
                        p.lose(&self.driver, "writing its duty cycle", why, report);
                        self.backoff = Backoff::new();
                    }
                }
                _ => {}
            }
        }
    }
}

impl Points {
    /// Writes all safe values; tells which did not arrive. `Drop` does the same and tells nobody.
    pub(super) fn make_safe(&mut self, report: Report<'_>) {
        for point in &mut self.points {
            if let Err(why) = point.make_safe() {
                let text = format!("the safe value was not taken: {why}; the channel may go on as it was");
                report(event(&self.driver, &point.name, "unsafe", UNSAFE, text));
            }
        }
    }

    /// The safe value of output `n` (counted over the outputs alone) as a cell.
    pub(super) fn safe(&self, n: usize) -> u64 {
        match self.outputs.get(n).map(|point| self.points[*point].wish) {
            Some(Wish::Output { safe, .. }) => safe.into(),
            Some(Wish::Pwm { safe, .. }) => safe.to_bits(),
            _ => 0,
        }
    }
}

impl Drop for Points {
    fn drop(&mut self) {
        self.make_safe(&mut |_| {});
    }
}

impl Point {
    fn is_closed(&self) -> bool {
        matches!(self.state, State::Closed)
    }

    /// Opens it; true when it needs only a moment.
    fn open(
        &mut self,
        model: Model,
        board: Option<&Board>,
        chip: Option<u8>,
        driver: &str,
        report: Report<'_>,
    ) -> bool {
        let result = match (self.wish, board) {
            (Wish::Pwm { place, safe }, _) => match Pwm::open(Path::new(ROOT), chip, model.pwm(), &place, safe) {
                Ok(pwm) => Ok(State::Pwm(pwm)),
                Err(Closed::Wait) => return true,
                Err(Closed::Refused(why)) => Err(why),
            },
            (_, None) => return false,
            (Wish::Input { place, edges }, Some(board)) => Input::open(board, &place, edges).map(State::Input),
            (Wish::Output { place, safe }, Some(board)) => Output::open(board, &place, safe).map(State::Output),
        };
        match result {
            Ok(state) => {
                self.state = state;
                if self.told.take().is_some() {
                    report(event(driver, &self.name, "accepted", NOTE, "the point works now".into()));
                }
            }
            Err(why) if self.told.as_ref() == Some(&why) => {}
            Err(why) => {
                let effect = match self.wish {
                    Wish::Input { .. } => "the input is bad",
                    _ => "the output is not driven",
                };
                report(event(driver, &self.name, "refused", REFUSED, format!("{why}. Until then {effect}")));
                self.told = Some(why);
            }
        }
        false
    }

    /// It worked, and no longer does.
    fn lose(&mut self, driver: &str, what: &str, why: String, report: Report<'_>) {
        self.state = State::Closed;
        report(event(driver, &self.name, "lost", LOST, format!("{what} failed: {why}; tries to open it again go on")));
        self.told = Some(why);
    }

    fn make_safe(&mut self) -> Result<(), String> {
        match (&mut self.state, self.wish) {
            (State::Output(output), Wish::Output { safe, .. }) => output.force(safe),
            (State::Pwm(pwm), Wish::Pwm { safe, .. }) => pwm.force(safe)?,
            _ => {}
        }
        Ok(())
    }
}

fn event(driver: &str, point: &str, transition: &'static str, priority: u8, text: String) -> IoEvent {
    IoEvent { source: format!("{driver}.{point}"), transition, priority, text }
}

/// Names of points for a sentence: the first few.
fn list(points: &[&str]) -> String {
    const SHOWN: usize = 5;
    let names: Vec<String> = points.iter().take(SHOWN).map(|p| format!("`{p}`")).collect();
    let more = points.len().saturating_sub(SHOWN);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}
