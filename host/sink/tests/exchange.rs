//! Another logger in the place of one: between two batches, nothing lost, nothing twice, and the old one back if it fails.
#![allow(clippy::unwrap_used, reason = "a test")]

mod loggers;
mod support;

use latchwork_record::Record;
use latchwork_schema::Section;
use latchwork_sink::{COMPONENT, Config, Exchange, Phase, Sink, SinkKind};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use support::{Bench, wait_for};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(60);

/// What all sinks of a test have got: which sink, which record.
type Got = Arc<Mutex<Vec<(&'static str, u64)>>>;

/// A sink with a name that may fail at a batch.
struct Named {
    name: &'static str,
    got: Got,
    fails_at: u64,
    batches: u64,
}

impl Named {
    fn new(name: &'static str, got: &Got) -> Self {
        Self { name, got: Arc::clone(got), fails_at: u64::MAX, batches: 0 }
    }
}

impl Sink for Named {
    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        self.batches += 1;
        if self.batches == self.fails_at {
            return Err("it is broken".into());
        }
        self.got.lock().unwrap().extend(batch.iter().map(|r| (self.name, r.seq)));
        Ok(batch.last().map_or(0, |r| r.seq))
    }
}

/// A sink that panics at its first batch.
struct Panics;

impl Sink for Panics {
    fn write(&mut self, _: &[Record]) -> Result<u64, String> {
        panic!("out of luck")
    }
}

/// A sink that opens but once.
struct Once {
    opened: bool,
    sink: Named,
}

impl Sink for Once {
    fn start(&mut self) -> Result<(), String> {
        if std::mem::replace(&mut self.opened, true) { Err("it opens but once".into()) } else { Ok(()) }
    }

    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        self.sink.write(batch)
    }
}

/// A sink that does not open, and that sees how far its exchange is meanwhile.
struct Shut {
    exchange: Arc<Mutex<Option<Exchange>>>,
    seen: Arc<Mutex<Option<Phase>>>,
}

impl Sink for Shut {
    fn start(&mut self) -> Result<(), String> {
        wait_for(PATIENCE, "the exchange is known", || self.exchange.lock().unwrap().is_some());
        *self.seen.lock().unwrap() = self.exchange.lock().unwrap().as_ref().map(Exchange::phase);
        Err("it does not open".into())
    }

    fn write(&mut self, _: &[Record]) -> Result<u64, String> {
        unreachable!("it is not open")
    }
}

static NO_KEYS: Section = Section { name: "first", doc: "", keys: &[] };
static GOT: Mutex<Option<Got>> = Mutex::new(None);
static FIRST: SinkKind = SinkKind {
    name: "first",
    keys: &NO_KEYS,
    check: |_| Vec::new(),
    claim: |_| None,
    open: |_| Ok(Box::new(Named::new("old", GOT.lock().unwrap().as_ref().unwrap()))),
};

/// One test at a time: they share what the old sink writes to.
fn bench(folder: &Path) -> (Bench, Got, std::sync::MutexGuard<'static, ()>) {
    static TURN: Mutex<()> = Mutex::new(());
    let turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    let got = Got::default();
    *GOT.lock().unwrap_or_else(|e| e.into_inner()) = Some(Arc::clone(&got));
    let config = support::config(&FIRST, folder, "batch = 1\nwait = '1ms'");
    (Bench::start(folder, vec![(&FIRST, config)]), got, turn)
}

fn ended(exchange: &Exchange) -> Phase {
    wait_for(PATIENCE, "the exchange ends", || exchange.phase().ended());
    exchange.phase()
}

/// Each record once and in order; how many each sink has got.
#[track_caller]
fn whole(got: &Got, last: u64) -> (usize, usize) {
    let got = got.lock().unwrap();
    assert_eq!(got.iter().map(|(_, seq)| *seq).collect::<Vec<_>>(), (1..=last).collect::<Vec<_>>());
    let of = |name: &str| got.iter().filter(|(n, _)| *n == name).count();
    (of("old"), of("new"))
}

#[test]
fn sinks_are_exchanged_in_a_stream_of_records_and_each_record_comes_once() {
    let folder = TempDir::new().unwrap();
    let (mut bench, got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(500);
    bench.deliver(PATIENCE);
    bench.push(5_000);
    let exchange = swapper.exchange("s", Box::new(Named::new("new", &got)), 3).unwrap();
    assert_eq!(ended(&exchange), Phase::Done);
    bench.store(500);
    bench.deliver(PATIENCE);
    let (old, new) = whole(&got, 6_000);
    assert!(old >= 500 && new >= 500, "{old} and {new}");
    // And back, by hand.
    assert_eq!(ended(&swapper.rollback("s", 1).unwrap()), Phase::Done);
    bench.store(10);
    bench.deliver(PATIENCE);
    assert_eq!(whole(&got, 6_010), (old + 10, new));
    assert!(swapper.rollback("s", 9).is_err_and(|why| why.contains("not 9")));
    bench.stop();
}

#[test]
fn one_that_fails_on_probation_gives_way_to_the_old_one_which_gets_the_same_batch() {
    let folder = TempDir::new().unwrap();
    let (mut bench, got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(5);
    bench.deliver(PATIENCE);
    let broken = Named { fails_at: 3, ..Named::new("new", &got) };
    let exchange = swapper.exchange("s", Box::new(broken), 10).unwrap();
    // One at a time, so that each is a batch.
    for _ in 0..6 {
        bench.store(1);
        bench.deliver(PATIENCE);
    }
    assert_eq!(ended(&exchange), Phase::RolledBack("it is broken".into()));
    assert_eq!(whole(&got, 11), (9, 2));
    assert!(bench.reports.try_recv().is_err(), "for whoever waits for records nothing has happened");
    // What has failed is nothing to go back to.
    assert!(swapper.rollback("s", 1).is_err_and(|why| why.contains("no earlier version")));
    bench.stop();
}

#[test]
fn one_that_does_not_open_changes_nothing() {
    let folder = TempDir::new().unwrap();
    let (mut bench, got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(5);
    bench.deliver(PATIENCE);
    let (seen, now) = (Arc::new(Mutex::new(None)), Arc::new(Mutex::new(None)));
    let shut = Shut { exchange: Arc::clone(&now), seen: Arc::clone(&seen) };
    let exchange = swapper.exchange("s", Box::new(shut), 10).unwrap();
    *now.lock().unwrap() = Some(exchange.clone());
    assert_eq!(ended(&exchange), Phase::Refused("it does not open".into()));
    assert_eq!(*seen.lock().unwrap(), Some(Phase::Opening), "nobody takes it for one that is in");
    bench.store(5);
    bench.deliver(PATIENCE);
    assert_eq!(whole(&got, 10), (10, 0));
    bench.stop();
}

#[test]
fn a_sink_that_panics_on_probation_ends_its_exchange() {
    let folder = TempDir::new().unwrap();
    let (mut bench, _got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    let exchange = swapper.exchange("s", Box::new(Panics), 10).unwrap();
    bench.store(1);
    assert!(matches!(ended(&exchange), Phase::Refused(why) if why.contains("out of luck")));
    bench.stop();
}

#[test]
fn on_probation_nothing_else_is_exchanged_and_the_old_one_comes_back_when_it_is_wanted() {
    let folder = TempDir::new().unwrap();
    let (mut bench, got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(1);
    bench.deliver(PATIENCE);
    let exchange = swapper.exchange("s", Box::new(Named::new("new", &got)), 100).unwrap();
    bench.store(1);
    wait_for(PATIENCE, "it is on probation", || exchange.phase() == Phase::Probation { left: 99 });
    assert!(!exchange.cancel(), "it is in already");
    let second = swapper.exchange("s", Box::new(Named::new("new", &got)), 1);
    assert!(second.is_err_and(|why| why.contains("is being swapped already")));
    swapper.rollback("s", 1).unwrap();
    assert!(matches!(ended(&exchange), Phase::RolledBack(why) if why.contains("operator")));
    bench.store(1);
    bench.deliver(PATIENCE);
    assert_eq!(whole(&got, 3), (2, 1));
    assert!(swapper.exchange("t", Box::new(Named::new("new", &got)), 1).is_err_and(|why| why.contains("no sink `t`")));
    bench.stop();
}

/// A journal with the logger of the documentation, which asks for nothing and writes `logs/records.txt`.
fn logger(folder: &Path, keys: &str) -> Bench {
    let component = loggers::target().join("test-components/first-logger.wasm");
    let keys = format!("component = {component:?}\ndirectory = 'logs'\nbatch = 1\nwait = '1ms'\nbudget = '1s'\n{keys}");
    let config = support::config(&COMPONENT, folder, &keys);
    let config = Config { cache: Some(loggers::target().join("test-cache")), ..config };
    Bench::start(folder, vec![(&COMPONENT, config)])
}

fn shipped(name: &str, folder: &str) -> Arc<[u8]> {
    std::fs::read(loggers::target().join(folder).join(format!("{name}.wasm"))).unwrap().into()
}

#[test]
fn a_component_is_exchanged_for_another_and_back_when_it_traps_or_hangs() {
    let folder = TempDir::new().unwrap();
    for does in ["panic", "hang", "refuse", "lie"] {
        let folder = folder.path().join(does);
        std::fs::create_dir(&folder).unwrap();
        let mut bench = logger(&folder, &format!("config = {{ at = 12, does = '{does}' }}"));
        let swapper = bench.runner.as_ref().unwrap().swapper();
        assert_eq!(swapper.version("s").unwrap().component, "first-logger");
        bench.store(10);
        bench.deliver(PATIENCE);
        let bytes = shipped("stray-logger", "test-components");
        let (exchange, preparation) = swapper.swap("s", "stray.wasm", &bytes, 50, false).unwrap();
        assert_eq!((exchange.phase(), exchange.version()), (Phase::Preparing, None), "nothing is done by whoever asks");
        preparation.run();
        let version = exchange.version().unwrap();
        assert_eq!((version.component.as_str(), version.size), ("stray", bytes.len() as u64));
        wait_for(PATIENCE, "it is on probation", || matches!(exchange.phase(), Phase::Probation { .. }));
        assert_eq!(swapper.version("s"), Some(version));
        for _ in 0..4 {
            bench.store(1);
            bench.deliver(PATIENCE);
        }
        assert!(matches!(ended(&exchange), Phase::RolledBack(_)), "{does}");
        assert_eq!(swapper.version("s").unwrap().component, "first-logger", "{does}");
        bench.stop();
        // The stray one took number 11 and forgot it; all others are in the file, once.
        let text = std::fs::read_to_string(folder.join("logs/records.txt")).unwrap();
        let numbers: Vec<u64> = text.lines().filter_map(|l| l.split(' ').next()?.parse().ok()).collect();
        let expected: Vec<u64> = (1..=14).filter(|n| *n != 11).collect();
        assert_eq!(numbers, expected, "{does}: {text}");
    }
}

#[test]
fn what_is_no_logger_or_does_not_open_is_refused_and_a_dry_run_opens_nothing() {
    let folder = TempDir::new().unwrap();
    let mut bench = logger(folder.path(), "config = { does = 'refuse', at = 0 }");
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(3);
    bench.deliver(PATIENCE);
    let swap = |file: &str, bytes: &Arc<[u8]>, dry_run| {
        let (exchange, preparation) = swapper.swap("s", file, bytes, 1, dry_run).unwrap();
        preparation.run();
        ended(&exchange)
    };
    let refused = swap("ton.wasm", &shipped("ton", "components"), false);
    assert!(
        matches!(&refused, Phase::Refused(why) if why.contains("expected \"latchwork:journal/sink@0.1.0\"")),
        "{refused:?}"
    );
    assert!(matches!(swap("x.wasm", &b"text".as_slice().into(), false), Phase::Refused(_)));
    let bytes = shipped("stray-logger", "test-components");
    assert_eq!(swap("stray.wasm", &bytes, true), Phase::Planned);
    assert!(
        matches!(swap("stray.wasm", &bytes, false), Phase::Refused(why) if why.contains("does not open: I do not like"))
    );
    bench.store(3);
    bench.deliver(PATIENCE);
    assert_eq!(swapper.version("s").unwrap().component, "first-logger");
    bench.stop();
}

#[test]
fn what_was_called_off_before_it_was_prepared_goes_no_further_and_frees_the_sink() {
    let folder = TempDir::new().unwrap();
    let bench = logger(folder.path(), "");
    let swapper = bench.runner.as_ref().unwrap().swapper();
    let bytes = shipped("stray-logger", "test-components");
    let (first, late) = swapper.swap("s", "stray.wasm", &bytes, 1, false).unwrap();
    assert!(swapper.swap("s", "stray.wasm", &bytes, 1, false).is_err_and(|why| why.contains("is being swapped")));
    assert!(first.cancel());
    let (second, preparation) = swapper.swap("s", "second.wasm", &bytes, 0, false).unwrap();
    preparation.run();
    assert_eq!(ended(&second), Phase::Done);
    // The first one is prepared only now: nobody wants it.
    late.run();
    assert_eq!(first.phase(), Phase::Cancelled);
    assert_eq!(swapper.version("s").unwrap().component, "second");
    // One that nobody prepares at all.
    let (third, preparation) = swapper.swap("s", "stray.wasm", &bytes, 1, false).unwrap();
    drop(preparation);
    assert!(matches!(third.phase(), Phase::Refused(_)));
    bench.stop();
}

#[test]
fn a_way_back_that_does_not_open_leaves_the_versions_in_their_order() {
    let folder = TempDir::new().unwrap();
    let (mut bench, got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    bench.store(1);
    bench.deliver(PATIENCE);
    // Each opens once: as what comes, not as what comes back.
    for name in ["second", "third", "fourth"] {
        let sink = Once { opened: false, sink: Named::new(name, &got) };
        assert_eq!(ended(&swapper.exchange("s", Box::new(sink), 0).unwrap()), Phase::Done);
        bench.store(1);
        bench.deliver(PATIENCE);
    }
    let back = |steps| ended(&swapper.rollback("s", steps).unwrap());
    for steps in [2, 1, 2] {
        assert_eq!(back(steps), Phase::Refused("it opens but once".into()), "{steps}");
    }
    // The first one opens always: it is still the third from the end.
    assert_eq!(back(3), Phase::Done);
    bench.store(1);
    bench.deliver(PATIENCE);
    assert_eq!(back(3), Phase::Refused("it opens but once".into()), "the second one");
    let names: Vec<_> = got.lock().unwrap().iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["old", "second", "third", "fourth", "old"]);
    assert!(swapper.rollback("s", 4).is_err_and(|why| why.contains("1 to 3")));
    bench.stop();
}

#[test]
fn a_sink_that_panics_leaves_no_exchange_open_whatever_it_waits_for() {
    let folder = TempDir::new().unwrap();
    let (mut bench, _got, _turn) = bench(folder.path());
    let swapper = bench.runner.as_ref().unwrap().swapper();
    assert_eq!(ended(&swapper.exchange("s", Box::new(Panics), 0).unwrap()), Phase::Done);
    // Those who call while it dies: each hears of an end, or is told that nobody is there.
    bench.push(1);
    let mut open = Vec::new();
    wait_for(PATIENCE, "the sink ends", || match swapper.exchange("s", Box::new(Panics), 1_000) {
        Ok(exchange) => {
            open.push(exchange);
            false
        }
        Err(why) => why.contains("has failed by itself"),
    });
    for exchange in open {
        assert!(ended(&exchange).ended());
    }
    assert!(swapper.rollback("s", 1).is_err_and(|why| why.contains("has failed by itself")));
    bench.stop();
}
