//! Ways to a peer: a TCP connection, a serial line.

use super::transport::Guarded;
use std::future::Future;
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt};
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout};
use tokio_modbus::Slave;
use tokio_modbus::client::{Context, rtu, tcp};
use tokio_serial::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, SerialPortBuilderExt, StopBits};

/// Bits of one character on a serial line, start, parity and stop bits included.
const CHARACTER_BITS: u32 = 11;
/// Most pauses of `limit` a line may go on babbling before it counts as unusable.
const BABBLE: u32 = 4;

/// How a session gets a link.
pub(super) trait Connect: Send + 'static {
    /// Opens a fresh way on which no old answer can come; gives up after a few times `limit`.
    fn connect(&mut self, limit: Duration) -> impl Future<Output = io::Result<Context>> + Send;
    /// The peer as a person knows it.
    fn name(&self) -> String;
    /// Silence that must follow each answer.
    fn gap(&self) -> Duration {
        Duration::ZERO
    }
}

/// A device on the network.
pub(super) struct TcpPeer {
    /// Host and port.
    pub(super) address: String,
    pub(super) unit: u8,
}

impl Connect for TcpPeer {
    async fn connect(&mut self, limit: Duration) -> io::Result<Context> {
        let stream = timeout(limit, TcpStream::connect(&self.address)).await.map_err(|_| {
            io::Error::new(io::ErrorKind::TimedOut, format!("the connection was not accepted within {limit:?}"))
        })??;
        stream.set_nodelay(true)?;
        Ok(tcp::attach_slave(Guarded::new(stream), Slave(self.unit)))
    }

    fn name(&self) -> String {
        format!("{} (unit {})", self.address, self.unit)
    }
}

/// A device on a serial line.
pub(super) struct SerialPeer {
    pub(super) device: String,
    pub(super) baud: u32,
    pub(super) parity: Parity,
    pub(super) stop_bits: StopBits,
    pub(super) unit: u8,
}

impl Connect for SerialPeer {
    async fn connect(&mut self, limit: Duration) -> io::Result<Context> {
        let mut port = tokio_serial::new(&self.device, self.baud)
            .data_bits(DataBits::Eight)
            .parity(self.parity)
            .stop_bits(self.stop_bits)
            .flow_control(FlowControl::None)
            .open_native_async()?;
        port.clear(ClearBuffer::All)?;
        silence(&mut port, limit).await?;
        Ok(rtu::attach_slave(Guarded::new(port), Slave(self.unit)))
    }

    fn name(&self) -> String {
        format!("{} (unit {})", self.device, self.unit)
    }

    fn gap(&self) -> Duration {
        gap(self.baud)
    }
}

/// Silence between two frames: 3.5 characters, above 19200 bit/s fixed at 1.75 ms (Modbus over serial line V1.02, 2.5.1.1).
pub(super) fn gap(baud: u32) -> Duration {
    characters(7, baud).div_f64(2.0).max(Duration::from_micros(1750))
}

/// Time that a number of characters takes on the line.
pub(super) fn characters(count: u32, baud: u32) -> Duration {
    Duration::from_secs_f64(f64::from(count) * f64::from(CHARACTER_BITS) / f64::from(baud.max(1)))
}

/// Throws away what comes until nothing has come for `quiet`: answers to requests that were given up.
pub(super) async fn silence(port: &mut (impl AsyncRead + Unpin + Send), quiet: Duration) -> io::Result<()> {
    let end = Instant::now() + quiet * BABBLE;
    let mut rest = [0; 256];
    loop {
        match timeout(quiet, port.read(&mut rest)).await {
            Err(_) => return Ok(()),
            Ok(Ok(0)) => return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the line was closed")),
            Ok(Ok(_)) if Instant::now() < end => {}
            Ok(Ok(_)) => {
                return Err(io::Error::other(
                    "the line is never silent: is there another master on it, or a device with other line settings?",
                ));
            }
            Ok(Err(error)) => return Err(error),
        }
    }
}
