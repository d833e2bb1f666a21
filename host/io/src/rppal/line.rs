//! A line of the kernel's character device: edges with their stamps, debounced levels.

use super::board::{Board, cause, denied};
use super::place::{Edges, PinPlace};
use crate::direct::Edge;
use crate::edges::{self, Account, Batch, EMPTY};
use gpiocdev::Request;
use gpiocdev::line::{Bias, EdgeDetection, Value};
use std::os::fd::{AsFd, BorrowedFd};

/// Edges the kernel keeps for one line until they are read; without it 16.
const KERNEL_BUFFER: u32 = 1024;
/// Name under which the kernel shows who has the line.
const CONSUMER: &str = "latchwork";

/// A line that is requested. One request per line, so that no line's edges push out another's.
pub(super) struct Line {
    request: Request,
    account: Account,
    batch: Box<Batch>,
}

impl Line {
    /// Requests a line, with edges or for its level alone.
    pub(super) fn open(board: &Board, place: &PinPlace, edges: bool) -> Result<Self, String> {
        let mut builder = Request::builder();
        builder
            .on_chip(board.path())
            .with_consumer(CONSUMER)
            .with_kernel_event_buffer_size(KERNEL_BUFFER)
            .with_line(place.pin.into())
            .as_input();
        if place.active_low {
            builder.as_active_low();
        }
        if let Some(bias) = place.bias {
            builder.with_bias(match bias {
                rppal::gpio::Bias::Off => Bias::Disabled,
                rppal::gpio::Bias::PullDown => Bias::PullDown,
                rppal::gpio::Bias::PullUp => Bias::PullUp,
            });
        }
        if edges {
            builder.with_edge_detection(match place.edges {
                Edges::Both => EdgeDetection::BothEdges,
                Edges::Rising => EdgeDetection::RisingEdge,
                Edges::Falling => EdgeDetection::FallingEdge,
            });
        }
        if let Some(time) = place.debounce {
            builder.with_debounce_period(time);
        }
        let request = builder.request().map_err(|e| match cause(&e) {
            text if text.contains("(os error 13)") => denied(&board.path().display().to_string()),
            text => format!("the kernel refuses GPIO{}: {text}", place.pin),
        })?;
        edges::never_block(&request).map_err(|e| format!("GPIO{}: {e}", place.pin))?;
        let account = Account::new(place.edges == Edges::Both);
        Ok(Self { request, account, batch: Box::new(EMPTY) })
    }

    pub(super) fn descriptor(&self) -> BorrowedFd<'_> {
        self.request.as_fd()
    }

    /// The logical level, debounced where that was asked for.
    pub(super) fn level(&self) -> Result<bool, String> {
        self.request.lone_value().map(|v| v == Value::Active).map_err(|e| cause(&e))
    }

    /// Takes a batch of edges of point `point`; true when there may be more.
    pub(super) fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge)) -> Result<bool, String> {
        let Self { request, account, batch } = self;
        edges::take(request, batch, account, |at, level, missed| take(Edge { point, at, level, missed }))
            .map_err(|e| cause(&e))
    }
}
