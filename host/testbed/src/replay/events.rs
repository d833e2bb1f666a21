//! What happened to a block, one event after another, in few bytes: an execution that is like the one before costs two, and
//! any number of them in a row no more than four.

use super::Damaged;
use super::bytes::{Bytes, put_cells, put_difference, put_number};
use latchwork_block::{Class, Scan};

/// Something that happened to a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// An execution.
    Execution {
        /// Its time.
        scan: Scan,
        /// Argument cells.
        arguments: &'a [u64],
        /// Output cells; `None` when the block faulted.
        outputs: Option<&'a [u64]>,
    },
    /// New settings.
    Settings {
        /// One cell per setting.
        cells: &'a [u64],
        /// It took them, refused them, or (`None`) faulted over them.
        taken: Option<bool>,
    },
    /// A fresh instance with the settings that were last taken.
    Restarted,
    /// So many events are not recorded.
    Missed(u64),
}

const EXECUTION: u8 = 0;
const SETTINGS: u8 = 1;
const RESTARTED: u8 = 2;
const OTHER: u8 = 3;
const FIRST: u8 = 1 << 2;
const FAULTED: u8 = 1 << 3;
const ARGUMENTS: u8 = 1 << 4;
const OUTPUTS: u8 = 1 << 5;
/// Not as long after the one before as that one after its own.
const PERIOD: u8 = 1 << 6;
/// `elapsed` is not the time since the one before.
const ELAPSED: u8 = 1 << 7;
const REFUSED: u8 = 1 << 4;
/// With `OTHER`: executions like the one before, or missed events.
const REPEATED: u8 = 0;
const MISSED: u8 = 1 << 4;

/// What both ends know.
#[derive(Clone, Debug)]
struct Known {
    now: u64,
    period: u64,
    arguments: Box<[u64]>,
    outputs: Box<[u64]>,
    settings: Box<[u64]>,
}

impl Known {
    fn new(shape: Shape) -> Self {
        let row = |n| vec![0; n].into_boxed_slice();
        let Shape { arguments, outputs, settings } = shape;
        Self { now: 0, period: 0, arguments: row(arguments), outputs: row(outputs), settings: row(settings) }
    }
}

/// Numbers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Of arguments.
    pub arguments: usize,
    /// Of outputs.
    pub outputs: usize,
    /// Of settings.
    pub settings: usize,
}

impl Shape {
    /// Of a class.
    pub fn of(class: &Class) -> Self {
        let (arguments, outputs) = (class.argument_cells(), class.output_cells());
        Self { arguments, outputs, settings: class.settings.len() }
    }
}

/// Writes events.
#[derive(Clone, Debug)]
pub struct Encoder {
    known: Known,
    bytes: Vec<u8>,
    repeated: u64,
}

impl Encoder {
    /// For a class.
    pub fn new(shape: Shape) -> Self {
        Self { known: Known::new(shape), bytes: Vec::new(), repeated: 0 }
    }

    /// Appends an event.
    pub fn add(&mut self, event: Event<'_>) {
        match event {
            Event::Execution { scan, arguments, outputs } => self.execution(scan, arguments, outputs),
            Event::Settings { cells, taken } => {
                self.flush();
                self.bytes.push(match taken {
                    Some(true) => SETTINGS,
                    Some(false) => SETTINGS | REFUSED,
                    None => SETTINGS | FAULTED,
                });
                put_cells(&mut self.bytes, &mut self.known.settings, cells);
            }
            Event::Restarted => {
                self.flush();
                self.bytes.push(RESTARTED);
            }
            Event::Missed(n) => {
                self.flush();
                self.bytes.push(OTHER | MISSED);
                put_number(&mut self.bytes, n);
            }
        }
    }

    fn execution(&mut self, scan: Scan, arguments: &[u64], outputs: Option<&[u64]>) {
        let known = &mut self.known;
        let period = scan.now.wrapping_sub(known.now);
        let mut flags = 0;
        for (flag, set) in [
            (FIRST, scan.first),
            (FAULTED, outputs.is_none()),
            (ARGUMENTS, *known.arguments != *arguments),
            (OUTPUTS, outputs.is_some_and(|o| *known.outputs != *o)),
            (PERIOD, period != known.period),
            (ELAPSED, scan.elapsed != period),
        ] {
            flags |= if set { flag } else { 0 };
        }
        known.now = scan.now;
        if flags == 0 {
            self.repeated += 1;
            return;
        }
        self.flush();
        let (known, bytes) = (&mut self.known, &mut self.bytes);
        bytes.push(EXECUTION | flags);
        if flags & PERIOD != 0 {
            put_difference(bytes, known.period, period);
            known.period = period;
        }
        if flags & ELAPSED != 0 {
            put_number(bytes, scan.elapsed);
        }
        if flags & ARGUMENTS != 0 {
            put_cells(bytes, &mut known.arguments, arguments);
        }
        if let Some(outputs) = outputs.filter(|_| flags & OUTPUTS != 0) {
            put_cells(bytes, &mut known.outputs, outputs);
        }
    }

    fn flush(&mut self) {
        if self.repeated > 0 {
            self.bytes.push(OTHER | REPEATED);
            put_number(&mut self.bytes, std::mem::take(&mut self.repeated));
        }
    }

    /// Bytes so far.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Nothing was written.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty() && self.repeated == 0
    }

    /// All of it; what comes next begins anew.
    pub fn take(&mut self) -> Vec<u8> {
        self.flush();
        let shape = Shape {
            arguments: self.known.arguments.len(),
            outputs: self.known.outputs.len(),
            settings: self.known.settings.len(),
        };
        self.known = Known::new(shape);
        std::mem::take(&mut self.bytes)
    }
}

/// Reads events.
pub struct Decoder<'a> {
    known: Known,
    bytes: Bytes<'a>,
    repeated: u64,
}

impl<'a> Decoder<'a> {
    /// What an encoder for the same class has written.
    pub fn new(shape: Shape, bytes: &'a [u8]) -> Self {
        Self { known: Known::new(shape), bytes: Bytes(bytes), repeated: 0 }
    }

    /// The next event; `None` at the end.
    pub fn next(&mut self) -> Result<Option<Event<'_>>, Damaged> {
        if self.repeated > 0 {
            self.repeated -= 1;
            return Ok(Some(self.like_before(0)));
        }
        if self.bytes.is_empty() {
            return Ok(None);
        }
        let tag = self.bytes.byte()?;
        Ok(Some(match tag & 3 {
            EXECUTION => {
                let known = &mut self.known;
                if tag & PERIOD != 0 {
                    known.period = self.bytes.difference(known.period)?;
                }
                let elapsed = if tag & ELAPSED != 0 { Some(self.bytes.number()?) } else { None };
                if tag & ARGUMENTS != 0 {
                    self.bytes.cells(&mut known.arguments)?;
                }
                if tag & OUTPUTS != 0 {
                    self.bytes.cells(&mut known.outputs)?;
                }
                let Event::Execution { scan, arguments, outputs } = self.like_before(tag) else {
                    return Err(Damaged("an execution that is none"));
                };
                let scan = Scan { elapsed: elapsed.unwrap_or(scan.elapsed), ..scan };
                Event::Execution { scan, arguments, outputs }
            }
            SETTINGS => {
                self.bytes.cells(&mut self.known.settings)?;
                let taken = if tag & FAULTED != 0 { None } else { Some(tag & REFUSED == 0) };
                Event::Settings { cells: &self.known.settings, taken }
            }
            RESTARTED => Event::Restarted,
            _ if tag & MISSED != 0 => Event::Missed(self.bytes.number()?),
            _ => {
                self.repeated = self.bytes.number()?.checked_sub(1).ok_or(Damaged("nothing is repeated"))?;
                self.like_before(0)
            }
        }))
    }

    fn like_before(&mut self, flags: u8) -> Event<'_> {
        let known = &mut self.known;
        known.now = known.now.wrapping_add(known.period);
        Event::Execution {
            scan: Scan { now: known.now, elapsed: known.period, first: flags & FIRST != 0 },
            arguments: &known.arguments,
            outputs: (flags & FAULTED == 0).then_some(&known.outputs),
        }
    }
}
