//! A segment: what happened to one block for a while, with everything needed to read it.

use super::Damaged;
use super::events::{Decoder, Encoder, Event, Shape};
use serde::{Deserialize, Serialize};

/// What a segment says of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Head {
    /// Run of the plant, from 1; each start begins another one.
    pub run: u64,
    /// When plant time 0 was, ns since 1970; 0 at virtual time.
    pub epoch: u64,
    /// Block.
    pub block: String,
    /// Its lane.
    pub lane: String,
    /// Period of the lane, ns; 0 for one that only edges start.
    pub every: u64,
    /// Component, its file's name without `.wasm`.
    pub component: String,
    /// SHA-256 of the component, hex.
    pub hash: String,
    /// Number of the version in this run: another one with each swap, also to the same component.
    #[serde(default)]
    pub version: u64,
    /// Full name of the class it is used as.
    pub class: String,
    /// Most linear memory, bytes.
    pub memory: u64,
    /// Number among the segments of this block in this run, from 0: they follow each other without a gap.
    pub number: u64,
    /// How it begins.
    pub start: Start,
    /// Settings at its beginning.
    pub settings: Vec<u64>,
    /// Numbers of cells.
    pub cells: [usize; 2],
    /// Plant time of its first execution, ns.
    pub from: u64,
    /// Plant time of its last one, ns.
    pub to: u64,
    /// Executions.
    pub executions: u64,
    /// Events in it that were missed.
    pub missed: u64,
}

/// How a segment begins.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// With a fresh instance that has its settings.
    Cold,
    /// With what the block retains, one cell per port; empty for a class that retains nothing.
    State(Vec<u64>),
    /// It goes on where the segment before has ended.
    Continued,
}

/// A segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// What it says of itself.
    pub head: Head,
    bytes: Vec<u8>,
}

impl Segment {
    /// What happened, in order.
    pub fn events(&self) -> Decoder<'_> {
        Decoder::new(self.head.shape(), self.head.executions, &self.bytes)
    }

    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let head = serde_json::to_vec(&self.head).unwrap_or_default();
        let length = u32::try_from(head.len()).unwrap_or(u32::MAX);
        [&length.to_le_bytes()[..], &head, &self.bytes].concat()
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, Damaged> {
        let (length, rest) = bytes.split_first_chunk().ok_or(Damaged("it ends in the middle"))?;
        let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX);
        let (head, events) = rest.split_at_checked(length).ok_or(Damaged("it ends in the middle"))?;
        let head: Head = serde_json::from_slice(head).map_err(|_| Damaged("its head cannot be read"))?;
        // A class has no more: whoever believes the number would ask for that memory.
        if head.cells.iter().chain([&head.settings.len()]).any(|n| *n > CELLS) {
            return Err(Damaged("a block with more cells than a class has"));
        }
        if head.executions > EXECUTIONS {
            return Err(Damaged("it says that it has more executions than a segment may have"));
        }
        if head.number == u64::MAX {
            return Err(Damaged("its number is the last that there is"));
        }
        let segment = Self { head, bytes: events.to_vec() };
        segment.check()?;
        Ok(segment)
    }

    /// Whoever reads its events finds no damage any more.
    fn check(&self) -> Result<(), Damaged> {
        let (mut events, mut missed) = (self.events(), 0u64);
        while let Some(event) = events.next_event()? {
            if let Event::Missed(n) = event {
                missed = missed.saturating_add(n);
            }
        }
        if missed == self.head.missed { Ok(()) } else { Err(Damaged("it misses other executions than it says")) }
    }
}

/// Most cells of a part of a class.
const CELLS: usize = 16_384;
/// Executions after which a segment is cut: few bytes may stand for many, and a replay must end.
const EXECUTIONS: u64 = 1 << 16;

impl Head {
    fn shape(&self) -> Shape {
        Shape { arguments: self.cells[0], outputs: self.cells[1], settings: self.settings.len() }
    }
}

/// A segment in the making.
#[derive(Clone, Debug)]
pub struct Writer {
    head: Head,
    encoder: Encoder,
    /// Settings as they are now.
    settings: Vec<u64>,
}

impl Writer {
    /// An empty one.
    pub fn new(head: Head) -> Self {
        Self { encoder: Encoder::new(head.shape()), settings: head.settings.clone(), head }
    }

    /// Appends an event.
    pub fn add(&mut self, event: Event<'_>) {
        match event {
            Event::Execution { scan, .. } => {
                if self.head.executions == 0 {
                    self.head.from = scan.now;
                }
                self.head.to = scan.now;
                self.head.executions += 1;
            }
            Event::Missed(n) => self.head.missed = self.head.missed.saturating_add(n),
            Event::Settings { cells, taken: Ok(true) } => self.settings = cells.to_vec(),
            _ => {}
        }
        self.encoder.add(event);
    }

    /// It is to be cut: it has `bytes`, or as many executions as a segment may have.
    pub fn is_full(&self, bytes: usize) -> bool {
        self.encoder.len() >= bytes || self.head.executions >= EXECUTIONS
    }

    /// Nothing has happened.
    pub fn is_empty(&self) -> bool {
        self.encoder.is_empty()
    }

    /// Ends it; what happens next goes to one that begins so. `None` when nothing had happened: only the beginning is another.
    pub fn cut(&mut self, start: Start) -> Option<Segment> {
        if self.is_empty() {
            // A beginning is worth more than the end of something that is empty.
            if start != Start::Continued {
                self.head.start = start;
            }
            return None;
        }
        let next = Head {
            number: self.head.number + 1,
            start,
            settings: self.settings.clone(),
            executions: 0,
            missed: 0,
            ..self.head.clone()
        };
        let head = std::mem::replace(&mut self.head, next);
        Some(Segment { head, bytes: self.encoder.take() })
    }
}
