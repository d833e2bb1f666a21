//! A driver as the plant runs it, with its points in reach.

use latchwork_image::{Location, Quality, RegionReader, RegionWriter, Resolved, Type, View, region};
use latchwork_io::IoThread;
use latchwork_io::driver::{DriverConfig, DriverContext, IoEvent, Outputs, PointConfig};
use latchwork_io::kinds;
use latchwork_schema::{Value, Values};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest time a test waits for anything before it fails.
pub(crate) const DEADLINE: Duration = Duration::from_secs(60);

fn values(keys: impl IntoIterator<Item = (&'static str, Value)>) -> Values {
    Values { span: 0..0, entries: keys.into_iter().map(|(k, v)| (k.to_owned(), (v, 0..0))).collect() }
}

/// A point: table, address, type (empty: the default), order of words. `safe` is its text; it makes the point an output.
pub(crate) fn point(table: &'static str, address: i64, ty: &str, order: &str, safe: Option<&str>) -> PointConfig {
    let text = |key, t: &str| (!t.is_empty()).then(|| (key, Value::Text(t.to_owned())));
    let keys = [(table, Value::Integer(address))].into_iter().chain(text("type", ty)).chain(text("words", order));
    let values = values(keys);
    let kind = kinds::find("modbus-tcp").unwrap();
    let ty = (kind.point)(&values).unwrap().ty;
    let safe = safe.map(|s| ty.parse(s).unwrap());
    PointConfig { name: format!("{table}-{address}"), values, ty, safe }
}

/// A running driver.
pub(crate) struct Bench {
    inputs: RegionReader,
    input_types: Vec<Type>,
    demands: RegionWriter,
    demanded: Vec<u64>,
    output_types: Vec<Type>,
    pub(crate) events: Receiver<IoEvent>,
    io: IoThread,
}

impl Bench {
    /// Starts a driver of a kind with quick timing.
    pub(crate) fn start(kind: &str, keys: Vec<(&'static str, Value)>, points: Vec<PointConfig>) -> Self {
        let kind = kinds::find(kind).unwrap();
        let ms = |n: u64| Value::Duration(n * 1_000_000);
        let timing = [
            ("every", ms(20)),
            ("timeout", ms(1000)),
            ("refresh", ms(200)),
            ("reconnect-min", ms(20)),
            ("reconnect-max", ms(100)),
            ("unit", Value::Integer(7)),
        ];
        let mut all = values(timing);
        all.entries.extend(values(keys).entries);
        let types = |outputs| points.iter().filter(move |p| p.safe.is_some() == outputs).map(|p| p.ty.clone());
        let (input_types, output_types): (Vec<_>, Vec<_>) = (types(false).collect(), types(true).collect());
        let count = output_types.len();
        let (writer, inputs) = region(&[0, Quality::Bad.cell()].repeat(input_types.len()));
        let demanded = [vec![0; count], vec![Outputs::RUNNING]].concat();
        let (demands, reader) = region(&demanded);
        let at = |slot| Resolved::Cell {
            location: Location { region: 0, slot: slot as u32, bit: None, quality: None },
            not: false,
        };
        let tags: Vec<Resolved> = (0..count).flat_map(|n| [at(n), at(count)]).collect();
        let outputs = Outputs::new(View::new(&[reader], &tags));
        let config = DriverConfig { name: "field".into(), values: all, points };
        assert_eq!((kind.check)(&config), []);
        let driver = (kind.build)(config).unwrap();
        let (report, events) = channel();
        let begin = Instant::now();
        let io = IoThread::start(vec![move |stop| {
            let clock = Arc::new(move || begin.elapsed().as_nanos() as u64);
            let report = Box::new(move |e| drop(report.send(e)));
            (driver, DriverContext { inputs: writer, outputs, clock, report, stop })
        }]);
        Self { inputs, input_types, demands, demanded, output_types, events, io }
    }

    /// Value of input `n` as text, and its quality.
    pub(crate) fn input(&self, n: usize) -> (String, Quality) {
        let mut cells = vec![0; 2 * self.input_types.len()];
        self.inputs.copy_to(&mut cells);
        (self.input_types[n].format(cells[2 * n]), Quality::from_cell(cells[2 * n + 1]))
    }

    /// What output `n` is to show, as text.
    pub(crate) fn demand(&mut self, n: usize, value: &str) {
        self.demanded[n] = self.output_types[n].parse(value).unwrap();
        self.demands.publish(&self.demanded, 0);
    }

    /// Waits for the next event and expects it to be of this kind.
    pub(crate) fn expect(&self, transition: &str) -> IoEvent {
        let event = self.events.recv_timeout(DEADLINE).unwrap_or_else(|_| panic!("no `{transition}` was told"));
        assert_eq!(event.transition, transition, "{}", event.text);
        event
    }

    /// Stops the driver in order and returns what it still had to tell.
    pub(crate) fn stop(self) -> Vec<IoEvent> {
        assert!(self.io.stop(DEADLINE), "the driver stops in time");
        self.events.try_iter().collect()
    }
}

/// Waits until something is so.
pub(crate) fn until(what: &str, mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < DEADLINE, "waited too long until {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
