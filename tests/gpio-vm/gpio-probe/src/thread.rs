//! The part of the driver on the I/O thread.

use crate::bench::{config, kind, number, point, text};
use crate::chip::Chip;
use crate::taken::{Taken, requests};
use crate::{Outcome, ensure};
use latchwork_image::{Location, Quality, RegionReader, RegionWriter, Resolved, View, region};
use latchwork_io::IoThread;
use latchwork_io::driver::{DriverContext, IoEvent, Outputs, PointConfig};
use latchwork_schema::Value::{Bool, Duration as Span};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// State of a lane that has stopped.
const STOPPED: u64 = 2;

/// A driver that runs.
struct Running {
    io: Option<IoThread>,
    inputs: RegionReader,
    demands: RegionWriter,
    /// Demand of each output, and last whether their lane runs.
    cells: Vec<u64>,
    events: Arc<Mutex<Vec<IoEvent>>>,
}

impl Running {
    /// Starts it; all outputs are to be true, and their lane runs.
    fn start(chip: &str, points: Vec<PointConfig>) -> Result<Self, String> {
        Self::start_with(chip, points, Outputs::RUNNING)
    }

    fn start_with(chip: &str, points: Vec<PointConfig>, state: u64) -> Result<Self, String> {
        let outputs = points.iter().filter(|p| p.safe.is_some()).count();
        let (writer, inputs) = region(&[0, Quality::Bad.cell()].repeat(points.len() - outputs));
        let cells = [vec![1; outputs], vec![state]].concat();
        let (demands, reader) = region(&cells);
        let at = |slot: usize| Resolved::Cell {
            location: Location { region: 0, slot: slot as u32, bit: None, quality: None },
            not: false,
        };
        let tags: Vec<Resolved> = (0..outputs).flat_map(|n| [at(n), at(outputs)]).collect();
        let events = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&events);
        let driver = (kind().build)(config(chip, points))?;
        let make = |stop| {
            let context = DriverContext {
                inputs: writer,
                outputs: Outputs::new(View::new(&[reader], &tags)),
                clock: Arc::new(|| 0),
                report: Box::new(move |e| kept.lock().unwrap_or_else(PoisonError::into_inner).push(e)),
                stop,
            };
            (driver, context)
        };
        let io = Some(IoThread::start(vec![make]));
        Ok(Self { io, inputs, demands, cells, events })
    }

    fn input(&self, n: u32) -> (bool, Quality) {
        (self.inputs.cell(2 * n) != 0, Quality::from_cell(self.inputs.cell(2 * n + 1)))
    }

    fn good(&self, n: u32, level: bool) -> bool {
        self.input(n) == (level, Quality::Good)
    }

    fn demand(&mut self, n: usize, cell: u64) {
        self.cells[n] = cell;
        self.demands.publish(&self.cells, 0);
    }

    fn told(&self) -> Vec<String> {
        let mut events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        events.drain(..).map(|e| format!("{} {}", e.source, e.transition)).collect()
    }
}

/// Waits for something that takes a few milliseconds, at most three seconds.
fn soon(mut holds: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + Duration::from_secs(3);
    while Instant::now() < end {
        if holds() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

fn input(name: &str, line: usize) -> PointConfig {
    point(name, &[("line", number(line))], None)
}

pub(crate) fn reads_and_writes() -> Outcome {
    let chip = Chip::new("reads", 8, &[(2, "KEY")])?;
    chip.pull(1, true);
    let points = vec![
        input("a", 0),
        point("b", &[("line", number(1)), ("active-low", Bool(true))], None),
        point("lamp", &[("line", number(4))], Some(false)),
        point("key", &[("line", text("KEY")), ("bias", text("pull-up"))], None),
        point("horn", &[("line", number(5)), ("active-low", Bool(true))], Some(true)),
        point("calm", &[("line", number(3)), ("debounce", Span(50_000_000))], None),
    ];
    let mut driver = Running::start("reads", points)?;
    let first =
        soon(|| driver.good(0, false) && driver.good(1, false) && driver.good(2, true) && driver.good(3, false));
    ensure!(first, "first reading: {:?}", (0..4).map(|n| driver.input(n)).collect::<Vec<_>>());
    let told = driver.told();
    ensure!(told == ["gpio connected"], "events: {told:?}");
    ensure!(soon(|| chip.value(4) && !chip.value(5)), "the outputs do not show what is demanded");
    let before = driver.inputs.publications();
    std::thread::sleep(Duration::from_millis(100));
    ensure!(driver.inputs.publications() == before, "published although nothing has changed");
    chip.pull(0, true);
    chip.pull(1, false);
    chip.pull(2, false);
    chip.pull(3, true);
    let changed =
        soon(|| driver.good(0, true) && driver.good(1, true) && driver.good(2, false) && driver.good(3, true));
    ensure!(changed, "after the change: {:?}", (0..4).map(|n| driver.input(n)).collect::<Vec<_>>());
    driver.demand(0, 0);
    driver.demand(1, 0);
    ensure!(soon(|| !chip.value(4) && chip.value(5)), "the outputs do not follow");
    // The lane behind the outputs stops: they become safe.
    driver.demand(0, 1);
    ensure!(soon(|| chip.value(4)), "the output does not follow");
    driver.demand(2, STOPPED);
    ensure!(soon(|| !chip.value(4) && !chip.value(5)), "the outputs are not safe when their lane stops");
    Ok(())
}

pub(crate) fn stop_is_safe() -> Outcome {
    let chip = Chip::new("stop", 4, &[])?;
    for orderly in [true, false] {
        let before = requests();
        let outputs = [(0, false), (1, true)];
        let points = outputs.map(|(n, safe)| point(["x", "y"][n], &[("line", number(n))], Some(safe))).into_iter();
        let mut driver = Running::start(&chip.path(), points.chain([input("a", 2)]).collect())?;
        driver.demand(1, 0);
        ensure!(soon(|| driver.good(0, false) && chip.value(0) && !chip.value(1)), "it does not run");
        // Inputs and outputs are a request each; the outputs' one came first.
        let inputs_closed = requests().difference(&before).nth(1).copied();
        let rest = before.iter().copied().chain(inputs_closed).collect();
        let taken = Taken::since(&rest)?;
        ensure!(taken.levels(2) == 0b01, "the lines show {:02b}", taken.levels(2));
        if orderly {
            let stopped = driver.io.take().is_some_and(|io| io.stop(Duration::from_secs(1)));
            ensure!(stopped, "it did not end in time");
            let told = driver.told();
            ensure!(told == ["gpio connected"], "events: {told:?}");
        } else {
            drop(driver.io.take());
        }
        ensure!(taken.levels(2) == 0b10, "after the stop the lines show {:02b}", taken.levels(2));
        ensure!(driver.input(0).1 == Quality::Bad, "its inputs are not bad");
    }
    Ok(())
}

pub(crate) fn unplugged() -> Outcome {
    let mut chip = Chip::new("thread", 4, &[])?;
    let lamp = point("lamp", &[("line", number(1))], Some(false));
    let driver = Running::start("thread", vec![input("a", 0), lamp])?;
    chip.pull(0, true);
    ensure!(soon(|| driver.good(0, true) && chip.value(1)), "it does not run");
    driver.told();
    chip.unplug();
    ensure!(soon(|| driver.input(0) == (true, Quality::Bad)), "the input is {:?}", driver.input(0));
    std::thread::sleep(Duration::from_millis(2500));
    let told = driver.told();
    ensure!(told == ["gpio lost"], "events: {told:?}");
    chip.plug().map_err(|e| e.to_string())?;
    ensure!(soon(|| driver.good(0, false) && chip.value(1)), "it does not run again");
    let told = driver.told();
    ensure!(told == ["gpio connected"], "events: {told:?}");
    Ok(())
}

/// A part without inputs, whose outputs do not change.
pub(crate) fn outputs_alone() -> Outcome {
    let mut chip = Chip::new("mute", 4, &[])?;
    let driver = Running::start("mute", vec![point("lamp", &[("line", number(1))], Some(false))])?;
    ensure!(soon(|| chip.value(1)), "it does not run");
    driver.told();
    chip.unplug();
    std::thread::sleep(Duration::from_millis(1500));
    let told = driver.told();
    ensure!(told == ["gpio lost"], "events: {told:?}");
    chip.plug().map_err(|e| e.to_string())?;
    ensure!(soon(|| chip.value(1)), "the output is not driven again");
    let told = driver.told();
    ensure!(told == ["gpio connected"], "events: {told:?}");
    Ok(())
}

/// `initial` holds until the lane behind an output has executed, and never again.
pub(crate) fn initial() -> Outcome {
    let mut chip = Chip::new("initial", 2, &[])?;
    let points = vec![point("lamp", &[("line", number(1)), ("initial", Bool(true))], Some(false)), input("a", 0)];
    let mut driver = Running::start_with("initial", points, Outputs::STARTING)?;
    driver.demand(0, 0);
    ensure!(soon(|| driver.good(0, false)), "it does not run");
    std::thread::sleep(Duration::from_millis(100));
    ensure!(chip.value(1), "the lane has not begun, and the output does not show `initial`");
    driver.demand(1, Outputs::RUNNING);
    ensure!(soon(|| !chip.value(1)), "the output does not follow");
    driver.demand(0, 1);
    ensure!(soon(|| chip.value(1)), "the output does not follow");
    driver.demand(1, STOPPED);
    ensure!(soon(|| !chip.value(1)), "the output is not safe");
    chip.unplug();
    ensure!(soon(|| !driver.good(0, false)), "the loss is not seen");
    chip.plug().map_err(|e| e.to_string())?;
    chip.pull(1, true);
    ensure!(soon(|| driver.good(0, false)), "it does not run again");
    ensure!(!chip.value(1), "the line began anew with `initial`");
    Ok(())
}
