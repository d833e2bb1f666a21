//! A serial line between two pseudo-terminals, which can be cut and disturbed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio_serial::{SerialPort, SerialStream};

/// The line; dropping it ends it.
pub(crate) struct Line {
    /// Names of its two ends.
    pub(crate) ends: [String; 2],
    shared: Arc<Shared>,
    carrier: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    cut: AtomicBool,
    over: AtomicBool,
    /// Bytes that come to the first end out of nowhere.
    noise: Mutex<Vec<u8>>,
}

impl Line {
    pub(crate) fn new() -> Self {
        let shared = Arc::new(Shared::default());
        let (told, names) = std::sync::mpsc::channel();
        let inner = Arc::clone(&shared);
        let carrier = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                let pairs = [SerialStream::pair().unwrap(), SerialStream::pair().unwrap()];
                let [(mut a, first), (mut b, second)] = pairs;
                told.send([first.name().unwrap(), second.name().unwrap()]).unwrap();
                // Closed again: the drivers open them by name, and a port must be closed before another may have it.
                drop((first, second));
                let mut open = [false; 2];
                while !inner.over.load(Ordering::Relaxed) {
                    carry(&mut a, &mut b, &mut open, &inner);
                    tokio::time::sleep(Duration::from_millis(1)).await;
                }
            });
        });
        Self { ends: names.recv().unwrap(), shared, carrier: Some(carrier) }
    }

    /// Nothing passes any more, or again.
    pub(crate) fn cut(&self, cut: bool) {
        self.shared.cut.store(cut, Ordering::Relaxed);
    }

    /// Bytes appear at the first end.
    pub(crate) fn disturb(&self, bytes: &[u8]) {
        self.shared.noise.lock().unwrap().extend_from_slice(bytes);
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        self.carrier.take().map(JoinHandle::join);
    }
}

fn carry(a: &mut SerialStream, b: &mut SerialStream, open: &mut [bool; 2], shared: &Shared) {
    let cut = shared.cut.load(Ordering::Relaxed);
    let from_a = take(a, &mut open[0]);
    let from_b = take(b, &mut open[1]);
    let noise = std::mem::take(&mut *shared.noise.lock().unwrap());
    // What goes to an end that nobody has open is lost, as on a real line.
    if open[0] {
        let _ = a.try_write(&noise);
    }
    if open[0] && !cut {
        let _ = a.try_write(&from_b);
    }
    if open[1] && !cut {
        let _ = b.try_write(&from_a);
    }
}

fn take(end: &mut SerialStream, open: &mut bool) -> Vec<u8> {
    let mut bytes = [0; 512];
    match end.try_read(&mut bytes) {
        Ok(n) => {
            *open = n > 0;
            bytes[..n].to_vec()
        }
        Err(error) => {
            // A closed end reads as an I/O error.
            *open = error.kind() == std::io::ErrorKind::WouldBlock;
            Vec::new()
        }
    }
}
