//! A component on a bench: set inputs, step, look at outputs. For tests of Rust authors inside `cargo test`.

mod error;
mod find;
mod value;

pub use error::BenchError;
pub use value::{Given, Output};

use error::hint;
use find::find;
use latchwork_block::{Class, Component, Engine, EngineOptions, Fault, Instance, Limits, Port, Scan, Ticker};
use latchwork_image::{Quality, nearest, parse_duration};
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use value::cell;

/// Period of the epoch, by which blocks that never end are stopped, and how many of them a call has.
const TICK: Duration = Duration::from_millis(10);
const TICKS: u64 = 100;

/// A block on a bench. Time is virtual: every [`Bench::step`] moves it by the period.
///
/// ```
/// use latchwork_testbed::Bench;
///
/// # fn main() -> Result<(), latchwork_testbed::BenchError> {
/// let mut bench = Bench::component("bounds-check")?.setting("high-limit", 80.0)?.every("10ms")?.start()?;
/// bench.set("signal", 81.5).step();
/// assert_eq!(bench.output("high"), true);
///
/// let mut bench = bench.restarted()?;
/// assert_eq!(bench.set("signal", 79.5).step().output("high"), true, "hysteresis outlives a restart");
/// # Ok(())
/// # }
/// ```
///
/// A name is looked for as NAME.wasm in the build folder of cargo (`components`, `test-components`), above the folder that
/// the test runs in; what ends in `.wasm` is a path.
///
/// Methods that name a port, a command or an alarm panic when there is none of that name, and say which is nearest: in a test
/// that is a failure at the right line.
#[derive(Debug)]
pub struct Bench {
    setup: Setup,
    instance: Instance,
    /// Arguments, then results.
    cells: Vec<u64>,
    ins: Vec<u32>,
    commands: u64,
    now: u64,
    /// No execution yet since the start.
    fresh: bool,
    first: bool,
}

/// A component that waits for its settings.
#[derive(Clone, Debug)]
pub struct Setup {
    component: Component,
    class: Arc<Class>,
    settings: Vec<(usize, u64)>,
    every: u64,
}

impl Bench {
    /// Loads a component that exports one class.
    pub fn component(name: &str) -> Result<Setup, BenchError> {
        Self::class_of(name, None)
    }

    /// Loads a component for one of its classes.
    pub fn class_of(name: &str, class: Option<&str>) -> Result<Setup, BenchError> {
        static ENGINE: LazyLock<(Engine, Ticker)> = LazyLock::new(|| {
            let engine = Engine::new(EngineOptions::default()).expect("the machine has an engine for WebAssembly");
            let ticker = Ticker::start(&engine, TICK);
            (engine, ticker)
        });
        let path = find(name)?;
        let load = |error| BenchError::Load { path: path.display().to_string(), error };
        let component = ENGINE.0.load_file(&path).map_err(load)?;
        let class = component.class(class).map_err(load)?;
        Ok(Setup { component, class, settings: Vec::new(), every: 10_000_000 })
    }

    /// Sets an input, which stays until it is set again. A signal becomes good.
    ///
    /// # Panics
    /// When there is no such input, or the value is none of its type.
    #[track_caller]
    pub fn set(&mut self, input: &str, value: impl Into<Given>) -> &mut Self {
        self.set_signal(input, value, Quality::Good)
    }

    /// Sets an input with its quality.
    ///
    /// # Panics
    /// As [`Bench::set`]; also when a quality other than good is given to a port that has none.
    #[track_caller]
    pub fn set_signal(&mut self, input: &str, value: impl Into<Given>, quality: Quality) -> &mut Self {
        let class = Arc::clone(&self.setup.class);
        let (at, port) = port(&class.inputs, input, "input");
        match cell(&port.ty, &value.into()) {
            Ok(cell) => self.cells[at] = cell,
            Err(error) => panic!("input `{input}`: {error}"),
        }
        if port.signal {
            self.cells[at + 1] = quality.cell();
        } else {
            assert!(quality == Quality::Good, "input `{input}` is a plain {}, without quality", port.ty.kind());
        }
        self
    }

    /// Gives a command, for the next step alone.
    ///
    /// # Panics
    /// When there is no such command.
    #[track_caller]
    pub fn command(&mut self, name: &str) -> &mut Self {
        self.commands |= flag(&self.setup.class.commands, name, "command");
        self
    }

    /// Executes the block once, one period after the last time.
    ///
    /// # Panics
    /// When it faults; [`Bench::try_step`] does not.
    #[track_caller]
    pub fn step(&mut self) -> &mut Self {
        if let Err(fault) = self.try_step() {
            panic!("at {}: {fault}", latchwork_image::format_duration(self.now));
        }
        self
    }

    /// The same for a block that is expected to fault. After a fault there is nothing more to be had from it.
    pub fn try_step(&mut self) -> Result<(), Fault> {
        let elapsed = if self.fresh { 0 } else { self.setup.every };
        self.now = self.now.saturating_add(elapsed);
        let scan = Scan { now: self.now, elapsed, first: self.first };
        if let Some(word) = self.ins.len().checked_sub(1).filter(|_| !self.setup.class.commands.is_empty()) {
            self.cells[word] = std::mem::take(&mut self.commands);
        }
        (self.fresh, self.first) = (false, false);
        self.instance.execute(scan, &self.ins, self.ins.len() as u32, &mut self.cells)
    }

    /// Executes the block once in each period until so much time has passed.
    ///
    /// # Panics
    /// When it faults, or `time` is no duration such as `"2s"`, or no multiple of the period.
    #[track_caller]
    pub fn run(&mut self, time: &str) -> &mut Self {
        let time = parse_duration(time).unwrap_or_else(|e| panic!("{e}"));
        let every = self.setup.every;
        assert!(
            every > 0 && time.is_multiple_of(every),
            "{} is no multiple of the period {}",
            latchwork_image::format_duration(time),
            latchwork_image::format_duration(every)
        );
        for _ in 0..time / every {
            self.step();
        }
        self
    }

    /// An output as the last step left it.
    ///
    /// # Panics
    /// When there is no such output.
    #[track_caller]
    pub fn output(&self, name: &str) -> Output {
        let (at, port) = port(&self.setup.class.outputs, name, "output");
        let cells = &self.cells[self.ins.len() + at..];
        let quality = if port.signal { Quality::from_cell(cells[1]) } else { Quality::Good };
        Output { value: port.ty.value(cells[0]), quality }
    }

    /// Whether an alarm's condition holds.
    ///
    /// # Panics
    /// When there is no such alarm.
    #[track_caller]
    pub fn alarm(&self, name: &str) -> bool {
        let bit = flag(&self.setup.class.alarms, name, "alarm");
        self.cells.last().is_some_and(|word| word & bit != 0)
    }

    /// Writes settings, all others stay; the inner error is the block's refusal.
    ///
    /// # Panics
    /// When there is no such setting or the value does not fit.
    #[track_caller]
    pub fn configure(&mut self, name: &str, value: impl Into<Given>) -> Result<Result<(), String>, Fault> {
        let mut setup = self.setup.clone().setting(name, value).unwrap_or_else(|e| panic!("{e}"));
        let cells = setup.cells(&mut self.instance)?;
        let answer = self.instance.configure(&cells)?;
        if answer.is_ok() {
            std::mem::swap(&mut self.setup, &mut setup);
        }
        Ok(answer)
    }

    /// Saves the state, makes another instance and lets it go on from there, as a plant that stops and starts. Inputs stay.
    pub fn restarted(mut self) -> Result<Self, BenchError> {
        let state = self.instance.save()?;
        let mut next = self.setup.start()?;
        if let Some(state) = state {
            next.instance.restore(&state)?;
            next.first = false;
        }
        let arguments = next.ins.len();
        next.cells[..arguments].copy_from_slice(&self.cells[..arguments]);
        next.now = self.now;
        Ok(next)
    }

    /// Plant time, ns.
    pub fn now(&self) -> u64 {
        self.now
    }
}

impl Setup {
    /// Changes a setting; the others are the component's own, or 0.
    pub fn setting(mut self, name: &str, value: impl Into<Given>) -> Result<Self, BenchError> {
        let has = || self.class.settings.iter().map(|p| p.path.as_str());
        let Some(at) = has().position(|p| p == name) else {
            let nearest = nearest(name, has()).map(str::to_owned);
            return Err(BenchError::NoSetting { name: name.into(), nearest, has: has().map(str::to_owned).collect() });
        };
        let cell = cell(&self.class.settings[at].ty, &value.into());
        let cell = cell.map_err(|error| BenchError::Value { name: name.into(), error })?;
        self.settings.push((at, cell));
        Ok(self)
    }

    /// Time between two steps, such as `"10ms"`, which it is without.
    pub fn every(mut self, time: &str) -> Result<Self, BenchError> {
        self.every = parse_duration(time)?;
        Ok(self)
    }

    /// Makes the block and configures it.
    pub fn start(self) -> Result<Bench, BenchError> {
        let load = |error| BenchError::Load { path: self.component.name().into(), error };
        let template = self.component.template(&self.class).map_err(load)?;
        let limits = Limits { budget_ticks: TICKS, ..Limits::default() };
        let mut instance = template.instantiate(&limits)?;
        let cells = self.cells(&mut instance)?;
        instance.configure(&cells)?.map_err(BenchError::Refused)?;
        let (arguments, results) = (self.class.argument_cells(), self.class.output_cells());
        Ok(Bench {
            setup: self,
            instance,
            cells: vec![0; arguments + results],
            ins: (0..arguments as u32).collect(),
            commands: 0,
            now: 0,
            fresh: true,
            first: true,
        })
    }

    fn cells(&self, instance: &mut Instance) -> Result<Vec<u64>, Fault> {
        let mut cells = instance.defaults()?.unwrap_or_else(|| vec![0; self.class.settings.len()]);
        self.settings.iter().for_each(|(at, cell)| cells[*at] = *cell);
        Ok(cells)
    }
}

/// A port and its first cell.
#[track_caller]
fn port<'c>(ports: &'c [Port], name: &str, what: &str) -> (usize, &'c Port) {
    let mut at = 0;
    for port in ports {
        if port.path == name {
            return (at, port);
        }
        at += 1 + usize::from(port.signal);
    }
    missing(ports.iter().map(|p| p.path.as_str()).collect(), name, what)
}

#[track_caller]
fn flag(names: &[String], name: &str, what: &str) -> u64 {
    match names.iter().position(|n| n == name) {
        Some(bit) => 1 << bit,
        None => missing(names.iter().map(String::as_str).collect(), name, what),
    }
}

#[track_caller]
fn missing(has: Vec<&str>, name: &str, what: &str) -> ! {
    let near = nearest(name, has.iter().copied());
    panic!("there is no {what} `{name}`; {}", hint(near, &has))
}
