//! A field device in a process of its own, for demos and first steps: it speaks real Modbus TCP.
//!
//! Input register 0 is a level, discrete input 0 a door, coil 0 a lamp and coil 1 a horn; what happens when stands in
//! [`story`]. It knows nothing of Latchwork: any Modbus client can read it.

mod story;

use clap::Parser;
use std::future::{Ready, ready};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::time::Instant;
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::{Server, accept_tcp_connection};
use tokio_modbus::{ExceptionCode, Request, Response};

/// A simulated field device that speaks Modbus TCP: a level (input register 0), a door (discrete input 0), a lamp and a
/// horn (coils 0 and 1).
#[derive(Parser)]
#[command(version)]
struct Args {
    /// Address to listen on; port 0 lets the system choose one. The address is printed as one line of JSON.
    #[arg(long, default_value = "127.0.0.1:5020", value_name = "ADDRESS")]
    listen: String,
    /// It ends by itself after this time, so that it never outlives a demo.
    #[arg(long = "for", default_value = "10m", value_name = "DURATION", value_parser = duration)]
    lifetime: Duration,
    /// Print every change of a coil to standard error.
    #[arg(long)]
    verbose: bool,
}

fn duration(text: &str) -> Result<Duration, String> {
    let parsed = text.parse::<jiff::SignedDuration>().ok().and_then(|d| Duration::try_from(d).ok());
    parsed.ok_or_else(|| "expected a duration such as 20s or 10m".into())
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> ExitCode {
    let args = Args::parse();
    match run(&args).await {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("field-device: {error}");
            ExitCode::FAILURE
        }
    }
}

async fn run(args: &Args) -> Result<(), String> {
    let listener = TcpListener::bind(&args.listen).await.map_err(|e| {
        format!("cannot listen on {}: {e}; is it running already? --listen chooses another address", args.listen)
    })?;
    let address = listener.local_addr().map_err(|e| e.to_string())?;
    println!("{}", serde_json::json!({ "listening": address.to_string() }));
    let device = Device { begin: Instant::now(), coils: Mutex::new([false; 2]), verbose: args.verbose };
    let device: &'static Device = Box::leak(Box::new(device));
    let server = Server::new(listener);
    let connected = |stream, peer| async move {
        accept_tcp_connection(stream, peer, |peer| {
            device.say(format_args!("{peer} has connected"));
            Ok(Some(device))
        })
    };
    let broken = |error| device.say(format_args!("a connection broke: {error}"));
    match tokio::time::timeout(args.lifetime, server.serve(&connected, broken)).await {
        Ok(Err(error)) => Err(format!("the server stopped: {error}")),
        Ok(Ok(())) | Err(_) => Ok(()),
    }
}

/// The device: its clock and its coils.
struct Device {
    begin: Instant,
    coils: Mutex<[bool; 2]>,
    verbose: bool,
}

const COILS: [&str; 2] = ["lamp", "horn"];

impl Device {
    fn say(&self, what: std::fmt::Arguments<'_>) {
        if self.verbose {
            eprintln!("{:8.3} s  {what}", self.begin.elapsed().as_secs_f64());
        }
    }

    fn answer(&self, request: &Request<'_>) -> Result<Response, ExceptionCode> {
        let time = self.begin.elapsed();
        let mut coils = self.coils.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match request {
            Request::ReadInputRegisters(0, 1) => Ok(Response::ReadInputRegisters(vec![story::level(time)])),
            Request::ReadDiscreteInputs(0, 1) => Ok(Response::ReadDiscreteInputs(vec![story::door(time)])),
            Request::ReadCoils(start, count) => {
                Ok(Response::ReadCoils(coils[span(*start, usize::from(*count))?].to_vec()))
            }
            Request::WriteSingleCoil(at, value) => {
                self.set(&mut coils, *at, &[*value])?;
                Ok(Response::WriteSingleCoil(*at, *value))
            }
            Request::WriteMultipleCoils(start, values) => {
                self.set(&mut coils, *start, values)?;
                Ok(Response::WriteMultipleCoils(*start, values.len() as u16))
            }
            Request::ReadInputRegisters(..) | Request::ReadDiscreteInputs(..) => Err(ExceptionCode::IllegalDataAddress),
            _ => Err(ExceptionCode::IllegalFunction),
        }
    }

    fn set(&self, coils: &mut [bool; 2], start: u16, values: &[bool]) -> Result<(), ExceptionCode> {
        let span = span(start, values.len())?;
        for ((coil, name), value) in coils[span.clone()].iter_mut().zip(&COILS[span]).zip(values) {
            if std::mem::replace(coil, *value) != *value {
                self.say(format_args!("{name} {}", if *value { "on" } else { "off" }));
            }
        }
        Ok(())
    }
}

fn span(start: u16, count: usize) -> Result<std::ops::Range<usize>, ExceptionCode> {
    let (start, end) = (usize::from(start), usize::from(start) + count);
    if end <= COILS.len() { Ok(start..end) } else { Err(ExceptionCode::IllegalDataAddress) }
}

impl Service for Device {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        ready(self.answer(&request))
    }
}
