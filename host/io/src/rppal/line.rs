//! A line of the kernel's character device: edges with their stamps, debounced levels.

use super::board::{Board, cause, denied};
use super::place::{Edges, PinPlace};
use crate::direct::Edge;
use gpiocdev::Request;
use gpiocdev::line::{Bias, EdgeDetection, EdgeKind, Value};
use std::os::fd::{AsFd, BorrowedFd};

/// Edges the kernel keeps for one line until they are read; without it 16.
const KERNEL_BUFFER: u32 = 1024;
/// Edges that are read at once.
const BATCH: usize = 32;
/// Name under which the kernel shows who has the line.
const CONSUMER: &str = "latchwork";

/// A line that is requested. One request per line, so that no line's edges push out another's.
pub(super) struct Line {
    request: Request,
    /// Number of the last edge, as the kernel counts from 1.
    last: u32,
    batch: Vec<u64>,
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
        let batch = vec![0; BATCH * request.edge_event_u64_size()];
        Ok(Self { request, last: 0, batch })
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
        // The descriptor blocks: it must not be read when nothing waits.
        if !self.request.has_edge_event().map_err(|e| cause(&e))? {
            return Ok(false);
        }
        let read = self.request.read_edge_events_into_slice(&mut self.batch).map_err(|e| cause(&e))?;
        for words in self.batch[..read].chunks_exact(self.request.edge_event_u64_size()) {
            let event = self.request.edge_event_from_slice(words).map_err(|e| cause(&e))?;
            let missed = missed(self.last, event.line_seqno);
            self.last = event.line_seqno;
            take(Edge { point, at: event.timestamp_ns, level: event.kind == EdgeKind::Rising, missed });
        }
        Ok(read == self.batch.len())
    }
}

/// Edges lost between two numbers of the kernel's count.
fn missed(last: u32, now: u32) -> u64 {
    now.wrapping_sub(last).wrapping_sub(1).into()
}

#[cfg(test)]
mod tests {
    use super::missed;

    #[test]
    fn a_gap_in_the_count_is_what_was_lost() {
        for (last, now, lost) in [(0, 1, 0), (7, 8, 0), (0, 3, 2), (7, 12, 4), (u32::MAX, 0, 0), (u32::MAX, 2, 2)] {
            assert_eq!(missed(last, now), lost, "{last} → {now}");
        }
    }
}
