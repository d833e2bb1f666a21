//! A pin in hand: an input or an output.

use super::board::Board;
use super::line::Line;
use super::place::PinPlace;
use crate::direct::Edge;
use rppal::gpio::{IoPin, Level, Mode, OutputPin, Pin};
use std::os::fd::BorrowedFd;
use std::sync::{Mutex, PoisonError};

/// Held while a pin's function or bias changes. rppal guards these with locks that spin: a lane that preempts their
/// holder on the same CPU would spin for ever. With this one they are never contended.
static CHANGING: Mutex<()> = Mutex::new(());

/// An input.
pub(super) enum Input {
    /// By registers alone.
    Register { pin: IoPin, active_low: bool },
    /// The kernel has it, for edges; its level stands in the register.
    Edges { line: Line, pin: Pin, active_low: bool },
    /// The kernel has it and debounces it: the register would show what has not been settled yet.
    Debounced(Line),
}

impl Input {
    /// Takes a pin as an input.
    pub(super) fn open(board: &Board, place: &PinPlace, edges: bool) -> Result<Self, String> {
        let pin = board.take(place.pin)?;
        let active_low = place.active_low;
        if place.debounce.is_some() {
            return Line::open(board, place, edges).map(Self::Debounced);
        }
        if edges {
            return Ok(Self::Edges { line: Line::open(board, place, true)?, pin, active_low });
        }
        let _alone = CHANGING.lock().unwrap_or_else(PoisonError::into_inner);
        let mut pin = pin.into_io(Mode::Input);
        // An input may stay one: nothing is to be undone.
        pin.set_reset_on_drop(false);
        if let Some(bias) = place.bias {
            pin.set_bias(bias);
        }
        Ok(Self::Register { pin, active_low })
    }

    /// The logical level.
    pub(super) fn level(&self) -> Result<bool, String> {
        match self {
            Self::Register { pin, active_low } => Ok(pin.is_high() != *active_low),
            Self::Edges { pin, active_low, .. } => Ok((pin.read() == Level::High) != *active_low),
            Self::Debounced(line) => line.level(),
        }
    }

    /// What becomes readable when edges wait.
    pub(super) fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        match self {
            Self::Register { .. } => None,
            Self::Edges { line, .. } | Self::Debounced(line) => Some(line.descriptor()),
        }
    }

    /// Takes a batch of edges; true when there may be more.
    pub(super) fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge)) -> Result<bool, String> {
        match self {
            Self::Register { .. } => Ok(false),
            Self::Edges { line, .. } | Self::Debounced(line) => line.edges(point, take),
        }
    }
}

/// An output.
pub(super) struct Output {
    pin: OutputPin,
    active_low: bool,
    shown: bool,
}

impl Output {
    /// Takes a pin as an output that shows `value` from its first moment on.
    pub(super) fn open(board: &Board, place: &PinPlace, value: bool) -> Result<Self, String> {
        let pin = board.take(place.pin)?;
        let _alone = CHANGING.lock().unwrap_or_else(PoisonError::into_inner);
        let mut pin = if value != place.active_low { pin.into_output_high() } else { pin.into_output_low() };
        // At the end it stays an output with its safe value: as an input it would float.
        pin.set_reset_on_drop(false);
        Ok(Self { pin, active_low: place.active_low, shown: value })
    }

    /// Shows a value, if it does not already.
    pub(super) fn show(&mut self, value: bool) {
        if value != self.shown {
            self.force(value);
        }
    }

    /// Shows a value, whatever it is believed to show.
    pub(super) fn force(&mut self, value: bool) {
        self.pin.write(Level::from(value != self.active_low));
        self.shown = value;
    }
}
