//! The `modbus-tcp` driver as the plant uses it, over the machine's own network, with a peer that comes, dies and
//! returns. What needs exact times stands in the crate's own tests at virtual time.

use latchwork_image::{Location, Quality, Resolved, Type, View, region};
use latchwork_io::IoThread;
use latchwork_io::driver::{DriverConfig, DriverContext, Outputs, PointConfig};
use latchwork_io::kinds;
use latchwork_schema::{Value, Values};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Longest time anything here may take before the test fails.
const DEADLINE: Duration = Duration::from_secs(30);

fn values(keys: &[(&str, Value)]) -> Values {
    Values { span: 0..0, entries: keys.iter().map(|(k, v)| ((*k).to_owned(), (v.clone(), 0..0))).collect() }
}

/// Serves input register 0 = 77 and takes coil 0, until `alive` turns false.
fn serve(listener: TcpListener, alive: Arc<AtomicBool>, coil: Arc<AtomicU8>) {
    let one = |mut stream: TcpStream| -> std::io::Result<()> {
        stream.set_read_timeout(Some(Duration::from_millis(20)))?;
        let mut request = Vec::new();
        while alive.load(Ordering::Relaxed) {
            let mut bytes = [0; 64];
            match stream.read(&mut bytes) {
                Ok(0) => return Ok(()),
                Ok(n) => request.extend_from_slice(&bytes[..n]),
                Err(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
                Err(e) => return Err(e),
            }
            // Both requests this driver makes are 12 bytes long.
            while request.len() >= 12 {
                let frame: Vec<u8> = request.drain(..12).collect();
                let mut answer = frame.clone();
                if frame[7] == 4 {
                    answer.truncate(8);
                    answer[5] = 5;
                    answer.extend([2, 0, 77]);
                } else {
                    coil.store(frame[10], Ordering::Relaxed);
                }
                stream.write_all(&answer)?;
            }
        }
        Ok(())
    };
    listener.set_nonblocking(true).unwrap();
    while alive.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false).unwrap();
                let _ = one(stream);
            }
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

struct Peer {
    alive: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<()>,
}

impl Peer {
    fn start(address: SocketAddr, coil: &Arc<AtomicU8>) -> Self {
        let begin = Instant::now();
        let listener = loop {
            match TcpListener::bind(address) {
                Ok(listener) => break listener,
                Err(e) => assert!(begin.elapsed() < DEADLINE, "{address}: {e}"),
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        let alive = Arc::new(AtomicBool::new(true));
        let (flag, coil) = (Arc::clone(&alive), Arc::clone(coil));
        Self { alive, thread: std::thread::spawn(move || serve(listener, flag, coil)) }
    }

    fn die(self) {
        self.alive.store(false, Ordering::Relaxed);
        self.thread.join().unwrap();
    }
}

fn until(what: &str, mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < DEADLINE, "waited too long until {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_peer_that_is_absent_comes_dies_and_returns() {
    // The port is free again at once and stays this test's own in practice: the system hands out others first.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let kind = kinds::find("modbus-tcp").unwrap();
    let point = |name: &str, key, ty, safe| PointConfig {
        name: name.into(),
        values: values(&[(key, Value::Integer(0))]),
        ty,
        safe,
    };
    let ms = |n: u64| Value::Duration(n * 1_000_000);
    let config = DriverConfig {
        name: "field".into(),
        values: values(&[
            ("address", Value::Text(address.to_string())),
            ("every", ms(5)),
            ("reconnect-min", ms(10)),
            ("reconnect-max", ms(50)),
        ]),
        points: vec![point("level", "input-register", Type::U16, None), point("lamp", "coil", Type::Bool, Some(0))],
    };
    assert_eq!((kind.check)(&config), []);
    let driver = (kind.build)(config).unwrap();
    let (writer, inputs) = region(&[0, Quality::Bad.cell()]);
    let (_demands, reader) = region(&[1, Outputs::RUNNING]);
    let at = |slot| Resolved::Cell { location: Location { region: 0, slot, bit: None, quality: None }, not: false };
    let outputs = Outputs::new(View::new(&[reader], &[at(0), at(1)]));
    let (report, events) = mpsc::channel();
    let begin = Instant::now();
    let io = IoThread::start(vec![move |stop| {
        let clock = Arc::new(move || begin.elapsed().as_nanos() as u64);
        (
            driver,
            DriverContext { inputs: writer, outputs, clock, report: Box::new(move |e| drop(report.send(e))), stop },
        )
    }]);
    let next = || events.recv_timeout(DEADLINE).unwrap().transition;
    let coil = Arc::new(AtomicU8::new(0));
    let quality = || Quality::from_cell(inputs.cell(1));
    assert_eq!(next(), "lost");
    for round in 0..3 {
        let peer = Peer::start(address, &coil);
        assert_eq!(next(), "connected", "round {round}");
        assert_eq!((inputs.cell(0), quality()), (77, Quality::Good));
        until("the coil is written", || coil.load(Ordering::Relaxed) == 0xff);
        peer.die();
        coil.store(0, Ordering::Relaxed);
        assert_eq!(next(), "lost", "round {round}");
        assert_eq!((inputs.cell(0), quality()), (77, Quality::Bad));
    }
    let peer = Peer::start(address, &coil);
    assert_eq!(next(), "connected");
    until("the coil is written", || coil.load(Ordering::Relaxed) == 0xff);
    assert!(io.stop(DEADLINE));
    assert_eq!(coil.load(Ordering::Relaxed), 0, "the safe value");
    assert_eq!(quality(), Quality::Bad);
    assert!(events.try_recv().is_err());
    peer.die();
}
