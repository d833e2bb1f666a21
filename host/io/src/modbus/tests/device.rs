//! A device in memory that misbehaves on request.
//!
//! It speaks the wire format by hand, so that a mistake in the protocol library cannot cancel itself out.

use super::super::connect::{Connect, gap, silence};
use super::super::point::Table;
use super::super::transport::Guarded;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex};
use tokio::time::{Instant, sleep};
use tokio_modbus::Slave;
use tokio_modbus::client::{Context, rtu, tcp};

/// Time a healthy device takes.
pub(super) const LATENCY: Duration = Duration::from_millis(2);
const UNIT: u8 = 7;

/// What the device does with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mood {
    Fine,
    /// No way to it at all.
    Absent,
    /// Connected, never answers.
    Silent,
    /// Answers after this many ms.
    Late(u64),
    /// Closes the connection instead of answering.
    Closes,
    WrongTransaction,
    WrongUnit,
    WrongFunction,
    WrongCount,
    WrongEcho,
    Garbage,
    /// Half of the answer, then nothing.
    Partial,
    /// The answer, and 20 ms later the same again.
    Twice,
    BadChecksum,
}

/// How frames look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wire {
    Tcp,
    Rtu,
}

pub(super) struct State {
    pub(super) mood: Mood,
    pub(super) words: BTreeMap<(Table, u16), u16>,
    /// Addresses that do not exist, and the exception for them.
    pub(super) refused: BTreeSet<(Table, u16)>,
    pub(super) exception: u8,
    /// When and what was asked, for people: `3ms read input registers 0–3`.
    pub(super) log: Vec<String>,
    pub(super) connects: Vec<u64>,
    /// Every read of input register 0 gives the number of that read.
    pub(super) counter: Option<u16>,
    started: Instant,
}

/// The device; clones are the same one.
#[derive(Clone)]
pub(super) struct Device {
    wire: Wire,
    state: Arc<Mutex<State>>,
    /// Where a serial line ends: the port that was opened last, whoever asked and when.
    line: Arc<tokio::sync::Mutex<Option<Answers>>>,
}

type Answers = WriteHalf<DuplexStream>;

impl Device {
    pub(super) fn new(wire: Wire) -> Self {
        let state = State {
            mood: Mood::Fine,
            words: BTreeMap::new(),
            refused: BTreeSet::new(),
            exception: 2,
            log: Vec::new(),
            connects: Vec::new(),
            counter: None,
            started: Instant::now(),
        };
        Self { wire, state: Arc::new(Mutex::new(state)), line: Arc::default() }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    pub(super) fn mood(&self, mood: Mood) {
        self.state().mood = mood;
    }

    pub(super) fn set(&self, table: Table, address: u16, words: &[u16]) {
        let mut state = self.state();
        for (n, word) in words.iter().enumerate() {
            state.words.insert((table, address + n as u16), *word);
        }
    }

    pub(super) fn word(&self, table: Table, address: u16) -> u16 {
        self.state().words.get(&(table, address)).copied().unwrap_or(0)
    }

    pub(super) fn take_log(&self) -> Vec<String> {
        std::mem::take(&mut self.state().log)
    }

    async fn serve(self, stream: DuplexStream) {
        let (mut stream, answers) = tokio::io::split(stream);
        let line = if self.wire == Wire::Tcp { Arc::default() } else { Arc::clone(&self.line) };
        *line.lock().await = Some(answers);
        while let Ok((frame, pdu)) = self.request(&mut stream).await {
            let (mood, reply) = {
                let mut state = self.state();
                let reply = state.answer(&pdu);
                (state.mood, reply)
            };
            sleep(LATENCY).await;
            let answer = |pdu: &[u8]| self.frame(frame, UNIT, pdu);
            let bytes = match mood {
                Mood::Fine => answer(&reply),
                Mood::Absent | Mood::Closes => {
                    *line.lock().await = None;
                    return;
                }
                Mood::Silent => continue,
                Mood::Late(ms) => {
                    sleep(Duration::from_millis(ms)).await;
                    answer(&reply)
                }
                Mood::WrongTransaction => self.frame(frame.wrapping_add(1), UNIT, &reply),
                Mood::WrongUnit => self.frame(frame, UNIT + 1, &reply),
                Mood::WrongFunction => match pdu[0] {
                    3 => answer(&[&[4], &reply[1..]].concat()),
                    _ => answer(&[3, 2, 0, 1]),
                },
                Mood::WrongCount => match reply[0] {
                    function @ 1..=4 => answer(&[function, 8, 0, 1, 0, 1, 0, 1, 0, 1]),
                    _ => answer(&reply),
                },
                Mood::WrongEcho => match reply[0] {
                    function @ (5 | 6 | 15 | 16) => answer(&[function, 0xff, 0, 0, 0]),
                    _ => answer(&reply),
                },
                Mood::Garbage => vec![0x55; 40],
                Mood::Partial => {
                    let mut half = answer(&reply);
                    half.truncate(half.len() / 2);
                    half
                }
                Mood::Twice => {
                    send(&line, &answer(&reply)).await;
                    sleep(Duration::from_millis(20)).await;
                    answer(&reply)
                }
                Mood::BadChecksum => {
                    let mut bytes = answer(&reply);
                    *bytes.last_mut().unwrap() ^= 1;
                    bytes
                }
            };
            send(&line, &bytes).await;
        }
    }

    /// Transaction and PDU of the next request.
    async fn request(&self, stream: &mut ReadHalf<DuplexStream>) -> io::Result<(u16, Vec<u8>)> {
        if self.wire == Wire::Tcp {
            let mut header = [0; 7];
            stream.read_exact(&mut header).await?;
            let mut pdu = vec![0; usize::from(u16::from_be_bytes([header[4], header[5]])) - 1];
            stream.read_exact(&mut pdu).await?;
            return Ok((u16::from_be_bytes([header[0], header[1]]), pdu));
        }
        let mut start = [0; 7];
        stream.read_exact(&mut start).await?;
        let rest = if matches!(start[1], 15 | 16) { usize::from(start[6]) + 2 } else { 1 };
        let mut frame = start.to_vec();
        frame.resize(7 + rest, 0);
        stream.read_exact(&mut frame[7..]).await?;
        let (body, sum) = frame.split_at(frame.len() - 2);
        assert_eq!(crc(body), sum, "the driver's checksum");
        Ok((0, body[1..].to_vec()))
    }

    fn frame(&self, transaction: u16, unit: u8, pdu: &[u8]) -> Vec<u8> {
        if self.wire == Wire::Tcp {
            let length = (pdu.len() as u16 + 1).to_be_bytes();
            return [&transaction.to_be_bytes(), &[0, 0], &length[..], &[unit], pdu].concat();
        }
        let body = [&[unit], pdu].concat();
        let sum = crc(&body);
        [&body[..], &sum].concat()
    }
}

async fn send(line: &tokio::sync::Mutex<Option<Answers>>, bytes: &[u8]) {
    if let Some(answers) = line.lock().await.as_mut() {
        // Nobody may listen any more; a device does not know.
        let _ = answers.write_all(bytes).await;
    }
}

/// CRC of a serial frame, low byte first.
fn crc(bytes: &[u8]) -> [u8; 2] {
    let mut crc = 0xffff_u16;
    for byte in bytes {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xa001 } else { crc >> 1 };
        }
    }
    crc.to_le_bytes()
}

impl State {
    pub(super) fn now(&self) -> u64 {
        self.started.elapsed().as_millis() as u64
    }

    fn answer(&mut self, pdu: &[u8]) -> Vec<u8> {
        let word = |n: usize| u16::from_be_bytes([pdu[n], pdu[n + 1]]);
        let (function, address) = (pdu[0], word(1));
        let table = match function {
            1 | 5 | 15 => Table::Coil,
            2 => Table::DiscreteInput,
            3 | 6 | 16 => Table::HoldingRegister,
            4 => Table::InputRegister,
            other => panic!("function {other}"),
        };
        let count = if matches!(function, 5 | 6) { 1 } else { word(3) };
        let (verb, values) = match function {
            1..=4 => ("read", Vec::new()),
            5 => ("write", vec![u16::from(word(3) == 0xff00)]),
            6 => ("write", vec![word(3)]),
            15 => ("write", (0..count).map(|n| u16::from(pdu[6 + usize::from(n) / 8] >> (n % 8) & 1)).collect()),
            _ => ("write", (0..usize::from(count)).map(|n| word(6 + 2 * n)).collect()),
        };
        let shown = if values.is_empty() { String::new() } else { format!(" {values:?}") };
        let now = self.now();
        self.log.push(format!("{now}ms {verb} {}{shown}", table.range(address, count)));
        if (0..count).any(|n| self.refused.contains(&(table, address + n))) {
            return vec![function | 0x80, self.exception];
        }
        if verb == "write" {
            for (n, value) in values.iter().enumerate() {
                self.words.insert((table, address + n as u16), *value);
            }
            return pdu[..5].to_vec();
        }
        if let Some(counter) = self.counter.as_mut().filter(|_| table == Table::InputRegister && address == 0) {
            *counter += 1;
            self.words.insert((table, 0), *counter);
        }
        let words = (0..count).map(|n| self.words.get(&(table, address + n)).copied().unwrap_or(0));
        let data: Vec<u8> = if table.is_bits() {
            let mut bytes = vec![0; usize::from(count).div_ceil(8)];
            words.enumerate().for_each(|(n, w)| bytes[n / 8] |= u8::from(w != 0) << (n % 8));
            bytes
        } else {
            words.flat_map(u16::to_be_bytes).collect()
        };
        [&[function, data.len() as u8], &data[..]].concat()
    }
}

impl Connect for Device {
    async fn connect(&mut self, limit: Duration) -> io::Result<Context> {
        {
            let mut state = self.state();
            let now = state.now();
            state.connects.push(now);
            if state.mood == Mood::Absent {
                return Err(io::ErrorKind::ConnectionRefused.into());
            }
        }
        let (mut near, far) = duplex(1024);
        tokio::spawn(self.clone().serve(far));
        if self.wire == Wire::Tcp {
            return Ok(tcp::attach_slave(Guarded::new(near), Slave(UNIT)));
        }
        silence(&mut near, limit).await?;
        Ok(rtu::attach_slave(Guarded::new(near), Slave(UNIT)))
    }

    fn name(&self) -> String {
        "the device (unit 7)".into()
    }

    fn gap(&self) -> Duration {
        if self.wire == Wire::Tcp { Duration::ZERO } else { gap(19200) }
    }
}
