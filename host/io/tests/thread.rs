//! The I/O thread: drivers that end, panic, hang.

use latchwork_image::{Quality, RegionReader, View, region};
use latchwork_io::IoThread;
use latchwork_io::driver::{Driver, DriverContext, IoEvent, Outputs};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// Longest time anything here may take before the test fails.
const DEADLINE: Duration = Duration::from_secs(20);

#[derive(Clone, Copy)]
enum Way {
    Obeys,
    Panics,
    Leaves,
    Hangs,
    /// Its system call does not come back for this long.
    Blocks(Duration),
}

struct Odd {
    way: Way,
    done: Sender<&'static str>,
}

impl Driver for Odd {
    fn blocks(&self) -> bool {
        matches!(self.way, Way::Blocks(_))
    }

    fn run(self: Box<Self>, mut context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            context.inputs.publish(&[42, Quality::Good.cell()], 0);
            match self.way {
                Way::Obeys => {
                    let _ = context.stop.wait_for(|s| *s).await;
                    let _ = self.done.send("stopped");
                }
                Way::Panics => panic!("the {} of all is lost", "sense"),
                Way::Leaves => {}
                Way::Hangs => std::future::pending().await,
                Way::Blocks(time) => std::thread::sleep(time),
            }
        })
    }
}

type Maker = Box<dyn FnOnce(watch::Receiver<bool>) -> (Box<dyn Driver>, DriverContext) + Send>;

fn maker(way: Way, done: &Sender<&'static str>, events: &Sender<IoEvent>) -> (Maker, RegionReader) {
    let (inputs, reader) = region(&[0, Quality::Bad.cell()]);
    let (done, events) = (done.clone(), events.clone());
    let make = move |stop| {
        let context = DriverContext {
            inputs,
            outputs: Outputs::new(View::new(&[], &[])),
            clock: Arc::new(|| 0),
            report: Box::new(move |e| drop(events.send(e))),
            stop,
        };
        (Box::new(Odd { way, done }) as Box<dyn Driver>, context)
    };
    (Box::new(make), reader)
}

fn start(ways: &[Way]) -> (IoThread, Receiver<&'static str>, Receiver<IoEvent>) {
    let ((done, stopped), (report, events)) = (channel(), channel());
    let makers = ways.iter().map(|w| maker(*w, &done, &report).0).collect();
    (IoThread::start(makers), stopped, events)
}

#[test]
fn a_driver_that_panics_or_leaves_ends_alone_and_is_told() {
    let (thread, stopped, events) = start(&[Way::Panics, Way::Obeys, Way::Leaves]);
    let mut texts: Vec<String> = (0..2)
        .map(|_| events.recv_timeout(DEADLINE).unwrap())
        .map(|e| format!("{} ({}): {}", e.transition, e.priority, e.text))
        .collect();
    texts.sort();
    insta::assert_snapshot!(texts.join("\n"));
    assert!(thread.stop(DEADLINE), "the others stop in order");
    assert_eq!(stopped.recv_timeout(DEADLINE), Ok("stopped"));
    assert!(events.try_recv().is_err());
}

#[test]
fn a_stop_is_bounded_even_when_a_driver_hangs() {
    let (thread, stopped, _events) = start(&[Way::Hangs, Way::Obeys]);
    let begin = Instant::now();
    assert!(!thread.stop(Duration::from_millis(100)));
    assert!(begin.elapsed() < DEADLINE);
    assert_eq!(stopped.try_recv(), Ok("stopped"));
}

#[test]
fn dropping_the_thread_stops_the_drivers() {
    let (thread, stopped, _events) = start(&[Way::Obeys]);
    drop(thread);
    assert_eq!(stopped.try_recv(), Ok("stopped"));
}

#[test]
fn without_drivers_there_is_nothing_to_stop() {
    assert!(IoThread::start(Vec::<Maker>::new()).stop(Duration::ZERO));
}

#[test]
fn a_driver_that_blocks_its_thread_holds_up_no_other() {
    const BLOCKED: Duration = Duration::from_secs(5);
    let begin = Instant::now();
    // Two that block, and one that is served beside them.
    let (thread, stopped, _events) = start(&[Way::Blocks(BLOCKED), Way::Obeys, Way::Blocks(BLOCKED)]);
    assert!(!thread.stop(Duration::from_millis(500)), "two do not end in time");
    assert_eq!(stopped.try_recv(), Ok("stopped"));
    assert!(begin.elapsed() < BLOCKED, "the stop has waited for them");
}
