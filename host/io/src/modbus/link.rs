//! One request and its answer: checked against each other and bounded in time.
//!
//! After a failure of the kind [`Failure::Lost`] the link must be dropped, whatever the cause: what comes over it
//! later could be an answer to a request that was given up.

use super::point::Table;
use std::borrow::Cow;
use std::time::Duration;
use tokio_modbus::client::{Client, Context};
use tokio_modbus::{Error, ExceptionCode, ProtocolError, Request, Response};

/// Why there is no answer to use.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Failure {
    /// The peer is away or does not speak the protocol; the cause for a person.
    Lost(String),
    /// The peer is there and says no.
    Refused(ExceptionCode),
}

/// A connection to a peer.
pub(super) struct Link {
    context: Context,
    timeout: Duration,
    /// Silence after each answer.
    gap: Duration,
}

impl Link {
    pub(super) fn new(context: Context, timeout: Duration, gap: Duration) -> Self {
        Self { context, timeout, gap }
    }

    /// Reads entries of a table; bits come as words 0 and 1.
    pub(super) async fn read(&mut self, table: Table, start: u16, count: u16) -> Result<Vec<u16>, Failure> {
        let request = match table {
            Table::DiscreteInput => Request::ReadDiscreteInputs(start, count),
            Table::Coil => Request::ReadCoils(start, count),
            Table::InputRegister => Request::ReadInputRegisters(start, count),
            Table::HoldingRegister => Request::ReadHoldingRegisters(start, count),
        };
        let expected = usize::from(count);
        match self.call(request).await? {
            // Bits come in whole bytes; the last ones are padding.
            Response::ReadDiscreteInputs(bits) | Response::ReadCoils(bits)
                if bits.len() == expected.div_ceil(8) * 8 =>
            {
                Ok(bits.into_iter().take(expected).map(u16::from).collect())
            }
            Response::ReadInputRegisters(words) | Response::ReadHoldingRegisters(words) if words.len() == expected => {
                Ok(words)
            }
            other => {
                Err(Failure::Lost(format!("asked for {}, the answer {}", table.range(start, count), shape(&other))))
            }
        }
    }

    /// Writes entries of a table; bits as words 0 and 1.
    pub(super) async fn write(&mut self, table: Table, start: u16, words: &[u16]) -> Result<(), Failure> {
        let count = words.len() as u16;
        let bits: Vec<bool> = words.iter().map(|w| *w != 0).collect();
        let request = match (table.is_bits(), words) {
            (true, [one]) => Request::WriteSingleCoil(start, *one != 0),
            (true, _) => Request::WriteMultipleCoils(start, Cow::Borrowed(&bits)),
            (false, [one]) => Request::WriteSingleRegister(start, *one),
            (false, _) => Request::WriteMultipleRegisters(start, Cow::Borrowed(words)),
        };
        let echoed = match self.call(request).await? {
            Response::WriteSingleCoil(at, bit) => at == start && bits == [bit],
            Response::WriteSingleRegister(at, word) => at == start && words == [word],
            Response::WriteMultipleCoils(at, n) | Response::WriteMultipleRegisters(at, n) => at == start && n == count,
            _ => false,
        };
        let range = || format!("wrote {}, the answer confirms something else", table.range(start, count));
        if echoed { Ok(()) } else { Err(Failure::Lost(range())) }
    }

    async fn call(&mut self, request: Request<'_>) -> Result<Response, Failure> {
        let result = match tokio::time::timeout(self.timeout, self.context.call(request)).await {
            Err(_) => return Err(Failure::Lost(format!("no valid answer within {:?}", self.timeout))),
            Ok(Err(error)) => return Err(Failure::Lost(explain(error))),
            Ok(Ok(result)) => result.map_err(Failure::Refused),
        };
        if !self.gap.is_zero() {
            tokio::time::sleep(self.gap).await;
        }
        result
    }
}

fn shape(response: &Response) -> String {
    match response {
        Response::ReadDiscreteInputs(bits) | Response::ReadCoils(bits) => {
            format!("holds {} bytes of bits", bits.len() / 8)
        }
        Response::ReadInputRegisters(words) | Response::ReadHoldingRegisters(words) => {
            format!("holds {} registers", words.len())
        }
        _ => "is of another kind".into(),
    }
}

fn explain(error: Error) -> String {
    match error {
        Error::Protocol(ProtocolError::HeaderMismatch { .. }) => {
            "the answer came from another unit or belongs to another request".into()
        }
        Error::Protocol(ProtocolError::FunctionCodeMismatch { request, result }) => {
            let found = match result {
                Ok(response) => response.function_code().value(),
                Err(exception) => exception.function.value(),
            };
            format!("asked with function {}, the answer is of function {found}", request.value())
        }
        Error::Transport(error) if error.kind() == std::io::ErrorKind::InvalidData => {
            // The library's own words name bytes, not causes.
            "what came is not Modbus".into()
        }
        Error::Transport(error) => explain_io(&error),
    }
}

/// What an error of the operating system means for a device.
pub(super) fn explain_io(error: &std::io::Error) -> String {
    use std::io::ErrorKind::*;
    match error.kind() {
        ConnectionRefused => "the connection was refused: the host is there, but nothing listens on that port".into(),
        ConnectionReset | ConnectionAborted | BrokenPipe => "the peer broke the connection off".into(),
        HostUnreachable | NetworkUnreachable => {
            "there is no way to that host: check the network and the address".into()
        }
        NotFound => "there is no such device: is it plugged in and is the name right?".into(),
        PermissionDenied => {
            "permission denied: the user needs access to the device (on most systems the group `dialout`)".into()
        }
        _ => error.to_string(),
    }
}

/// An exception as the standard names it, with its number and what it usually means.
pub(super) fn exception(code: ExceptionCode) -> String {
    let meaning = match code {
        ExceptionCode::IllegalFunction => "illegal function: the device does not know this kind of request",
        ExceptionCode::IllegalDataAddress => {
            "illegal data address: the device has not all of these addresses (manuals often count from 1, the wire from 0)"
        }
        ExceptionCode::IllegalDataValue => {
            "illegal data value: the device does not take this value or number of entries"
        }
        ExceptionCode::ServerDeviceFailure => "server device failure: the device has a fault",
        ExceptionCode::Acknowledge => "acknowledge: the device needs more time",
        ExceptionCode::ServerDeviceBusy => "server device busy",
        ExceptionCode::MemoryParityError => "memory parity error: the device has a fault",
        ExceptionCode::GatewayPathUnavailable => {
            "gateway path unavailable: the gateway is set up wrongly or overloaded"
        }
        ExceptionCode::GatewayTargetDevice => "gateway target device failed to respond: the device behind it is away",
        ExceptionCode::Custom(_) => "an exception of the maker",
    };
    format!("exception {}, {meaning}", u8::from(code))
}
