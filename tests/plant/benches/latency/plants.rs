//! The plants that are measured: an interlock in an interrupt lane, beside a cyclic lane with a real load.

use super::timer::{Line, TimerLine, monotonic};
use latchwork_image::View;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::model::TagRef;
use latchwork_plant::run::{Control, MachineClock, Observer, RunOptions, run_real};
use latchwork_record::{Kind, Record};
use latchwork_tests_plant::Rig;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Priority of the interrupt lane and of cyclictest.
pub(crate) const PRIORITY: u8 = 45;

/// What a run told.
#[derive(Default)]
pub(crate) struct Told {
    /// Records of kind `lost`, with their numbers.
    pub(crate) lost: Vec<String>,
    /// Records about lanes that went wrong.
    pub(crate) trouble: Vec<String>,
    until: Option<Arc<AtomicBool>>,
}

impl Observer for Told {
    fn record(&mut self, record: &Record, _: &[latchwork_record::Kept]) {
        match record.kind {
            Kind::Lost => self.lost.push(format!("{} {} {}", record.source, record.transition, record.current)),
            Kind::Lane | Kind::Fault if !["started", "stopped"].contains(&&*record.transition) => {
                self.trouble.push(format!("{} {}: {}", record.source, record.transition, record.text));
            }
            _ => {}
        }
    }

    fn change(&mut self, _: &Change) {}

    fn tick(&mut self, _: u64) -> Control {
        let over = self.until.as_ref().is_some_and(|u| u.load(std::sync::atomic::Ordering::Relaxed));
        if over { Control::Stop } else { Control::Continue }
    }
}

/// Period of the main lane, ms. Half of the CPU is left over: real-time threads that take more than 95 % of it for a second,
/// on a machine that is slower for a moment, are halted by the kernel for the rest of that second (`sched_rt_runtime_us`).
pub(crate) fn period_ms(scan_ms: u64) -> u64 {
    2 * scan_ms
}

fn text(cpu: usize, scan_ms: u64, burn: u64, interrupt: bool) -> String {
    let every = period_ms(scan_ms);
    let mut text = format!(
        "[lane.main]\nevery = \"{every}ms\"\nwatchdog = \"60s\"\ncpu = {cpu}\n\
         [driver.gpio]\nkind = \"gpio\"\nchip = \"/dev/gpiochip0\"\n\
         [driver.gpio.points]\ndoor = {{ line = 1 }}\ntrip = {{ line = 2, from = \"{}.outputs.b\" }}\n\
         [block.load]\ncomponent = \"stress\"\nlane = \"main\"\nbudget = \"30s\"\ninputs.burn = {burn}\n",
        if interrupt { "fast" } else { "slow" }
    );
    if interrupt {
        text += &format!(
            "[lane.trip]\non = [\"gpio.door\"]\npriority = {PRIORITY}\ncpu = {cpu}\nstorm-limit = 1000000\nqueue = 65536\n\
             watchdog = \"10s\"\n\
             [block.fast]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\nbudget = \"1s\"\ninputs.b = \"gpio.door\"\n\
             [block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\ninputs.b = \"gpio.door\"\n"
        );
    } else {
        text += "[block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\n";
    }
    text
}

/// A plant with an interrupt lane whose line is `line`, beside a main lane that works `scan_ms` in each scan.
pub(crate) fn interlock(cpu: usize, scan_ms: u64, burn: u64, line: &Arc<Line>) -> Plant {
    let mut plant = Rig::new(&text(cpu, scan_ms, burn, true)).trace(None).plant(Time::Real);
    for lane in &mut plant.lanes {
        lane.replace_points(|_| Box::new(TimerLine::new(Arc::clone(line))));
    }
    plant
}

/// The same main lane alone.
pub(crate) fn load(cpu: usize, scan_ms: u64, burn: u64) -> Plant {
    let text = text(cpu, scan_ms, burn, false).replace("kind = \"gpio\"\nchip = \"/dev/gpiochip0\"", "kind = \"sim\"");
    let text =
        text.replace("{ line = 1 }", "{ type = \"bool\" }").replace("{ line = 2, from", "{ type = \"bool\", from");
    Rig::new(&text).trace(None).plant(Time::Real)
}

/// What the main lane shows of the door.
pub(crate) fn slow_output(plant: &Plant) -> View {
    let block = plant.model.blocks.iter().position(|b| b.name == "slow").expect("the block");
    let port = plant.model.blocks[block].class.outputs.iter().position(|p| p.path == "b").expect("the port");
    plant.view(&[plant.layout.ids[&TagRef::Output { block, port }]])
}

/// Runs until `until`, or for a time.
pub(crate) fn run(plant: Plant, duration: Option<Duration>, until: Option<Arc<AtomicBool>>) -> Told {
    let mut told = Told { until, ..Told::default() };
    let options = RunOptions { duration: duration.map(|d| d.as_nanos() as u64), ..RunOptions::default() };
    let clock = Arc::new(MachineClock::start());
    run_real(plant, &options, clock, &Arc::default(), &mut told);
    told
}

/// Iterations of the load's loop in a millisecond.
pub(crate) fn iterations_per_ms() -> u64 {
    let mut plant = load(0, 1, 1_000_000);
    let lane = &mut plant.lanes[0];
    let mut best = u64::MAX;
    for n in 0..20 {
        let start = monotonic();
        lane.scan(n, n, || n);
        best = best.min(monotonic() - start);
    }
    1_000_000 * 1_000_000 / best.max(1)
}
