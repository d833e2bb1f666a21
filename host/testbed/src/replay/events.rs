//! What happened to a block, one event after another, in few bytes: an execution that is like the one before costs two, and
//! any number of them in a row no more than four.

use super::Damaged;
use super::bytes::{Bytes, put_cells, put_difference, put_number};
use latchwork_block::{Class, FaultKind, Scan};

/// Something that happened to a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// An execution.
    Execution {
        /// Its time.
        scan: Scan,
        /// Argument cells.
        arguments: &'a [u64],
        /// Output cells, or how the block faulted.
        outputs: Result<&'a [u64], FaultKind>,
    },
    /// New settings.
    Settings {
        /// One cell per setting.
        cells: &'a [u64],
        /// It took them or refused them, or how it faulted over them.
        taken: Result<bool, FaultKind>,
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
/// The kind of the fault follows, a byte, right behind this one.
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

const MORE: Damaged = Damaged("it has more executions than it says");

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
                match taken {
                    Ok(true) => self.bytes.push(SETTINGS),
                    Ok(false) => self.bytes.push(SETTINGS | REFUSED),
                    Err(kind) => self.bytes.extend([SETTINGS | FAULTED, kind.code()]),
                }
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

    fn execution(&mut self, scan: Scan, arguments: &[u64], outputs: Result<&[u64], FaultKind>) {
        let known = &mut self.known;
        let period = scan.now.wrapping_sub(known.now);
        let mut flags = 0;
        for (flag, set) in [
            (FIRST, scan.first),
            (FAULTED, outputs.is_err()),
            (ARGUMENTS, *known.arguments != *arguments),
            (OUTPUTS, outputs.is_ok_and(|o| *known.outputs != *o)),
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
        bytes.extend(outputs.err().map(FaultKind::code));
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
        if let Ok(outputs) = outputs
            && flags & OUTPUTS != 0
        {
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

/// Reads events. It ends after as many executions as it is told that there are, whatever the bytes say.
pub struct Decoder<'a> {
    known: Known,
    bytes: Bytes<'a>,
    repeated: u64,
    /// Executions that may still come.
    left: u64,
}

impl<'a> Decoder<'a> {
    /// What an encoder for the same class has written, with so many executions in it.
    pub fn new(shape: Shape, executions: u64, bytes: &'a [u8]) -> Self {
        Self { known: Known::new(shape), bytes: Bytes(bytes), repeated: 0, left: executions }
    }

    /// The next event; `None` at the end.
    pub fn next_event(&mut self) -> Result<Option<Event<'_>>, Damaged> {
        if self.repeated > 0 {
            self.repeated -= 1;
            return self.like_before(0, None).map(Some);
        }
        if self.bytes.is_empty() {
            return if self.left == 0 { Ok(None) } else { Err(Damaged("it has fewer executions than it says")) };
        }
        let tag = self.bytes.byte()?;
        Ok(Some(match tag & 3 {
            EXECUTION => {
                let fault = self.fault(tag)?;
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
                let Event::Execution { scan, arguments, outputs } = self.like_before(tag, fault)? else {
                    return Err(Damaged("an execution that is none"));
                };
                let scan = Scan { elapsed: elapsed.unwrap_or(scan.elapsed), ..scan };
                Event::Execution { scan, arguments, outputs }
            }
            SETTINGS => {
                let fault = self.fault(tag)?;
                self.bytes.cells(&mut self.known.settings)?;
                Event::Settings { cells: &self.known.settings, taken: fault.map_or(Ok(tag & REFUSED == 0), Err) }
            }
            RESTARTED => Event::Restarted,
            _ if tag & MISSED != 0 => Event::Missed(self.bytes.number()?),
            _ => {
                self.repeated = self.bytes.number()?.checked_sub(1).ok_or(Damaged("nothing is repeated"))?;
                if self.repeated >= self.left {
                    return Err(MORE);
                }
                self.like_before(0, None)?
            }
        }))
    }

    /// The kind of a fault, if this byte begins one.
    fn fault(&mut self, tag: u8) -> Result<Option<FaultKind>, Damaged> {
        if tag & FAULTED == 0 {
            return Ok(None);
        }
        FaultKind::from_code(self.bytes.byte()?).map(Some).ok_or(Damaged("a fault of a kind that there is not"))
    }

    fn like_before(&mut self, flags: u8, fault: Option<FaultKind>) -> Result<Event<'_>, Damaged> {
        self.left = self.left.checked_sub(1).ok_or(MORE)?;
        let known = &mut self.known;
        // Backwards is what a recorder never sees.
        known.now = known.now.checked_add(known.period).ok_or(Damaged("its time goes back"))?;
        Ok(Event::Execution {
            scan: Scan { now: known.now, elapsed: known.period, first: flags & FIRST != 0 },
            arguments: &known.arguments,
            outputs: fault.map_or(Ok(&*known.outputs), Err),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SHAPE: Shape = Shape { arguments: 2, outputs: 2, settings: 1 };

    /// What a decoder tells of these bytes, and how it ends; it is asked no more than `most` times.
    fn read(executions: u64, bytes: &[u8], most: u64) -> (u64, Result<(), Damaged>) {
        let mut decoder = Decoder::new(SHAPE, executions, bytes);
        for n in 0..most {
            match decoder.next_event() {
                Ok(Some(_)) => {}
                Ok(None) => return (n, Ok(())),
                Err(damaged) => return (n, Err(damaged)),
            }
        }
        panic!("it goes on after {most} events")
    }

    #[test]
    fn every_event_reads_back() {
        let scan = |now, elapsed, first| Scan { now, elapsed, first };
        let mut events = vec![
            Event::Execution { scan: scan(5, 0, true), arguments: &[1, 2], outputs: Ok(&[3, 4]) },
            Event::Settings { cells: &[9], taken: Ok(true) },
            Event::Settings { cells: &[8], taken: Ok(false) },
            Event::Missed(7),
            Event::Restarted,
        ];
        for kind in FaultKind::ALL {
            events.push(Event::Settings { cells: &[7], taken: Err(kind) });
            events.push(Event::Execution { scan: scan(6, 1, false), arguments: &[1, 2], outputs: Err(kind) });
        }
        events.extend((7..99).map(|now| Event::Execution {
            scan: scan(now, 1, false),
            arguments: &[1, 2],
            outputs: Ok(&[3, 4]),
        }));
        let executions = events.iter().filter(|e| matches!(e, Event::Execution { .. })).count() as u64;
        let mut encoder = Encoder::new(SHAPE);
        events.iter().for_each(|event| encoder.add(*event));
        let bytes = encoder.take();
        let mut decoder = Decoder::new(SHAPE, executions, &bytes);
        for event in events {
            assert_eq!(decoder.next_event(), Ok(Some(event)));
        }
        assert_eq!(decoder.next_event(), Ok(None));
    }

    #[test]
    fn executions_that_the_head_does_not_know_end_it_at_once() {
        let mut endless = vec![OTHER | REPEATED];
        put_number(&mut endless, u64::MAX);
        assert_eq!(read(100, &endless, 2), (0, Err(MORE)));
        assert_eq!(
            read(u64::MAX, &[EXECUTION, EXECUTION], 9),
            (2, Err(Damaged("it has fewer executions than it says")))
        );
        let mut back = vec![EXECUTION | PERIOD];
        put_difference(&mut back, 0, 50);
        back.push(EXECUTION | PERIOD);
        put_difference(&mut back, 50, 10u64.wrapping_neg());
        assert_eq!(read(2, &back, 9), (1, Err(Damaged("its time goes back"))));
        assert_eq!(read(1, &[EXECUTION | FAULTED, 7], 9).1, Err(Damaged("a fault of a kind that there is not")));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic_or_go_on_for_ever(executions in 0u64..5000, bytes: Vec<u8>) {
            // Each byte is one event besides executions, at most.
            let (events, _) = read(executions, &bytes, executions + bytes.len() as u64 + 1);
            prop_assert!(events <= executions + bytes.len() as u64);
        }
    }
}
