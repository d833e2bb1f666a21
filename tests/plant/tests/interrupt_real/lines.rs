//! Lines that a test moves, in the hands of a lane's real thread: point 0 is an input with edges or a level, point 1 an
//! output.

use super::*;
use latchwork_io::direct::{Direct, Edge, Report};
use latchwork_io::driver::IoEvent;
use latchwork_plant::run::Clock;
use rustix::event::{EventfdFlags, eventfd};
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicU64, Ordering};

/// What the output showed last; all ones before the lane has written it.
const NEVER: u64 = u64::MAX;

/// The field's side of the lines.
struct Field {
    readable: OwnedFd,
    waiting: Mutex<VecDeque<Edge>>,
    level: AtomicBool,
    gone: AtomicBool,
    shown: AtomicU64,
}

impl Field {
    fn new() -> Arc<Self> {
        Arc::new(Self {
            readable: eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK).expect("an eventfd"),
            waiting: Mutex::default(),
            level: AtomicBool::new(false),
            gone: AtomicBool::new(false),
            shown: AtomicU64::new(NEVER),
        })
    }

    /// So many edges of the input, one right after the other.
    fn toggle(&self, times: usize) {
        for _ in 0..times {
            let level = !self.level.fetch_xor(true, Ordering::SeqCst);
            let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
            let at = now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64;
            self.waiting.lock().unwrap().push_back(Edge { point: 0, at, level, missed: 0 });
            rustix::io::write(&self.readable, &1u64.to_ne_bytes()).expect("room for one more");
        }
    }

    /// Waits until the output shows something.
    fn until(&self, shown: u64) {
        for _ in 0..20_000 {
            if self.shown.load(Ordering::SeqCst) == shown {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        panic!("the output shows {:?}, not {shown}", self.shown.load(Ordering::SeqCst));
    }
}

/// The lane's side.
struct Lines(Arc<Field>);

impl Direct for Lines {
    fn open(&mut self, _: Report<'_>) {}

    fn check(&mut self, report: Report<'_>) {
        if self.0.gone.load(Ordering::SeqCst) {
            report(IoEvent { source: "gpio".into(), transition: "lost", priority: 200, text: "gone".into() });
        }
    }

    fn healthy(&self) -> bool {
        !self.0.gone.load(Ordering::SeqCst)
    }

    fn good(&self, _: usize) -> bool {
        self.healthy()
    }

    fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>> {
        (point == 0).then(|| self.0.readable.as_fd())
    }

    fn edges(&mut self, _: usize, take: &mut dyn FnMut(Edge), _: Report<'_>) -> bool {
        // Nothing to take is as good.
        let _ = rustix::io::read(&self.0.readable, &mut [0; 8]);
        let mut waiting = self.0.waiting.lock().unwrap();
        let batch = waiting.len().min(32);
        waiting.drain(..batch).for_each(take);
        !waiting.is_empty()
    }

    fn level(&mut self, _: usize, _: Report<'_>) -> Option<bool> {
        Some(self.0.level.load(Ordering::SeqCst))
    }

    fn write(&mut self, outputs: &[u64], _: Report<'_>) {
        self.0.shown.store(outputs[0], Ordering::SeqCst);
    }
}

/// A plant with these lines; the output shows `shows` of the block in the lane, and is true when safe.
fn plant(trip: &str, shows: &str, field: &Arc<Field>) -> latchwork_plant::assemble::Plant {
    let text = format!(
        "[lane.main]\nevery = \"5ms\"\nwatchdog = \"20s\"\n\
         [lane.trip]\non = [\"gpio.door\"]\nwatchdog = \"20s\"\n{trip}\n\
         [driver.gpio]\nkind = \"gpio\"\nchip = \"/dev/gpiochip0\"\n\
         points.door = {{ line = 1 }}\npoints.dump = {{ line = 2, from = \"fast.outputs.{shows}\", safe = true }}\n\
         [block.fast]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\nbudget = \"5s\"\n\
         inputs = {{ b = \"gpio.door\", q = \"gpio.door\" }}\n\
         [block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\n"
    );
    let mut plant = Rig::new(&text).trace(None).plant(Time::Real);
    for lane in &mut plant.lanes {
        lane.replace_points(|_| Box::new(Lines(Arc::clone(field))));
    }
    plant
}

/// Runs it while `field` is moved.
fn moved(plant: latchwork_plant::assemble::Plant, with: impl FnOnce()) -> Vec<Record> {
    let _alone = alone();
    let stop = Arc::new(AtomicBool::new(false));
    let mut log = Log::default();
    std::thread::scope(|scope| {
        let (stop, log) = (&stop, &mut log);
        let run = scope.spawn(move || {
            run_real(plant, &RunOptions::default(), Arc::new(MachineClock::start()), stop, log);
        });
        with();
        stop.store(true, Ordering::SeqCst);
        run.join().expect("the plant");
    });
    log.0
}

fn number(record: &Record) -> usize {
    record.current.to_string().parse().unwrap_or(0)
}

#[test]
fn a_storm_is_handled_or_counted_to_the_last_edge_and_the_output_shows_the_end() {
    let field = Field::new();
    let records = moved(plant("storm-limit = 1000", "b", &field), || {
        field.until(0);
        for _ in 0..20 {
            field.toggle(99);
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        field.toggle(1);
        // 1981 edges: the last one is rising.
        field.until(1);
    });
    let handled = edges(&records, "gpio.door").len();
    let lost: Vec<_> = records.iter().filter(|r| r.kind == Kind::Lost).collect();
    let counted: usize = lost.iter().map(|r| number(r)).sum();
    assert_eq!(handled + counted, 1981, "{lost:?}");
    assert_eq!(lost[0].transition, "storm");
    assert!(handled >= 100);
}

#[test]
fn a_lane_that_polls_executes_when_an_input_becomes_bad() {
    let field = Field::new();
    let records = moved(plant("poll = \"1ms\"", "good", &field), || {
        field.until(1);
        field.gone.store(true, Ordering::SeqCst);
        field.until(0);
    });
    assert_eq!(edges(&records, "gpio.door").len(), 0, "a value that stays is no change");
}

#[test]
fn lines_of_which_nothing_is_heard_are_looked_after() {
    let field = Field::new();
    let records = moved(plant("", "good", &field), || {
        field.until(1);
        field.gone.store(true, Ordering::SeqCst);
        field.until(0);
    });
    assert!(records.iter().any(|r| r.kind == Kind::Io && r.transition == "lost"));
}

/// Hangs, or panics, once the lane has shown what is not safe.
struct Stuck<'a> {
    field: &'a Field,
    stop: &'a AtomicBool,
    panics: bool,
}

impl Observer for Stuck<'_> {
    fn record(&mut self, _: &Record, _: &[latchwork_record::Kept]) {}
    fn change(&mut self, _: &Change) {}
    fn tick(&mut self, _: u64) -> Control {
        if self.field.shown.load(Ordering::SeqCst) != 0 {
            return Control::Continue;
        }
        if self.panics {
            panic!("an observer's own fault");
        }
        // A signal comes while this thread hangs in a write to a terminal.
        self.stop.store(true, Ordering::SeqCst);
        self.field.until(1);
        Control::Continue
    }
}

#[test]
fn a_stop_makes_outputs_safe_while_the_observer_hangs() {
    let (field, stop) = (Field::new(), Arc::new(AtomicBool::new(false)));
    let _alone = alone();
    let clock: Arc<dyn Clock> = Arc::new(MachineClock::start());
    let mut stuck = Stuck { field: &field, stop: &stop, panics: false };
    run_real(plant("", "b", &field), &RunOptions::default(), clock, &stop, &mut stuck);
    assert_eq!(field.shown.load(Ordering::SeqCst), 1);
}

#[test]
fn a_panic_of_the_observer_makes_outputs_safe() {
    let (field, stop) = (Field::new(), Arc::new(AtomicBool::new(false)));
    let _alone = alone();
    let clock: Arc<dyn Clock> = Arc::new(MachineClock::start());
    let mut stuck = Stuck { field: &field, stop: &stop, panics: true };
    let run = std::panic::AssertUnwindSafe(|| {
        run_real(plant("", "b", &field), &RunOptions::default(), clock, &stop, &mut stuck)
    });
    assert!(std::panic::catch_unwind(run).is_err());
    assert_eq!(field.shown.load(Ordering::SeqCst), 1);
}
