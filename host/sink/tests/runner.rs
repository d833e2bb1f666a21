//! What a sink gets, whatever it does: in order, at least once, never beyond what it said it kept.

mod support;

use latchwork_record::{Kind, Record};
use latchwork_schema::Section;
use latchwork_sink::{Config, Sink, SinkKind, State, What};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};
use support::{Bench, config, record, wait_for};
use tempfile::TempDir;

/// What a sink of these tests does with a batch.
type Behaviour = Box<dyn FnMut(&[Record]) -> Result<u64, String> + Send>;

fn behaviours() -> &'static Mutex<HashMap<String, Arc<Mutex<Behaviour>>>> {
    static ALL: OnceLock<Mutex<HashMap<String, Arc<Mutex<Behaviour>>>>> = OnceLock::new();
    ALL.get_or_init(Default::default)
}

struct Fake(Arc<Mutex<Behaviour>>);

impl Sink for Fake {
    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        (self.0.lock().unwrap_or_else(|e| e.into_inner()))(batch)
    }
}

static NO_KEYS: Section = Section { name: "fake", doc: "", keys: &[] };

/// A sink whose behaviour is found by its name.
static FAKE: SinkKind = SinkKind {
    name: "fake",
    keys: &NO_KEYS,
    check: |_| Vec::new(),
    claim: |_| None,
    open: |config| Ok(Box::new(Fake(Arc::clone(&behaviours().lock().unwrap()[&config.name])))),
};

/// A sink of a name, with its keys and what it does.
fn fake(
    name: &str,
    keys: &str,
    behaviour: impl FnMut(&[Record]) -> Result<u64, String> + Send + 'static,
) -> (&'static SinkKind, Config) {
    behaviours().lock().unwrap().insert(name.into(), Arc::new(Mutex::new(Box::new(behaviour))));
    let config = config(&FAKE, std::path::Path::new(""), keys);
    (&FAKE, Config { name: name.into(), ..config })
}

/// Batches as a sink saw them.
#[derive(Clone, Default)]
struct Seen(Arc<Mutex<Vec<Vec<u64>>>>);

impl Seen {
    fn add(&self, batch: &[Record]) -> u64 {
        self.0.lock().unwrap().push(batch.iter().map(|r| r.seq).collect());
        batch.last().map_or(0, |r| r.seq)
    }

    fn batches(&self) -> Vec<Vec<u64>> {
        self.0.lock().unwrap().clone()
    }

    fn numbers(&self) -> Vec<u64> {
        self.batches().concat()
    }
}

const PATIENCE: Duration = Duration::from_secs(30);

#[test]
fn a_sink_gets_everything_once_and_in_order_over_runs() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    for run in 1..=3 {
        let to = seen.clone();
        let sink = fake("over-runs", "", move |batch| Ok(to.add(batch)));
        let mut bench = Bench::start(folder.path(), vec![sink]);
        bench.store(5000);
        assert_eq!(bench.stop(), [""; 0]);
        assert_eq!(seen.numbers(), (1..=run * 5000).collect::<Vec<_>>(), "what was durable at the end of run {run}");
    }
    let largest = seen.batches().iter().map(Vec::len).max();
    assert!(largest <= Some(950), "a batch leaves 50 places of 1000 free: {largest:?}");
}

#[test]
fn batches_are_sent_when_enough_wait_or_the_first_has_waited_long_enough() {
    let folder = TempDir::new().unwrap();
    let to = Seen::default();
    let to_sink = to.clone();
    let sink = fake("batches", "batch = 10\nwait = \"400ms\"\nlist = 20\nspare = 5", move |b| Ok(to_sink.add(b)));
    let mut bench = Bench::start(folder.path(), vec![sink]);
    let start = Instant::now();
    bench.store(3);
    wait_for(PATIENCE, "three records", || to.numbers().len() == 3);
    assert!(start.elapsed() >= Duration::from_millis(400), "they were sent before their time");
    let start = Instant::now();
    bench.store(10);
    wait_for(PATIENCE, "ten more", || to.numbers().len() == 13);
    assert!(start.elapsed() < Duration::from_millis(400), "ten are enough");
    bench.store(1000);
    bench.deliver(PATIENCE);
    assert!(to.batches().iter().all(|b| b.len() <= 15), "{:?}", to.batches());
    bench.stop();
}

#[test]
fn filters_by_kind_source_and_priority() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    let to = seen.clone();
    let keys = "kinds = [\"alarm\", \"fault\"]\nsources = [\"pump*.alarms.*\", \"lane.?\"]\npriority = 100";
    let sink = fake("filters", keys, move |b| Ok(to.add(b)));
    let mut bench = Bench::start(folder.path(), vec![sink]);
    for (seq, kind, source, priority) in [
        (1, Kind::Alarm, "pump1.alarms.dry", 100),
        (2, Kind::Alarm, "pump1.alarms.dry", 99),
        (3, Kind::Event, "pump1.alarms.dry", 200),
        (4, Kind::Fault, "lane.a", 255),
        (5, Kind::Fault, "lane.ab", 255),
        (6, Kind::Alarm, "tank.alarms.dry", 100),
        (7, Kind::Alarm, "pump-2.alarms.hot", 101),
        (8, Kind::Event, "x", 0),
    ] {
        bench.journal.push(&Record { kind, source: source.into(), priority, ..record(seq) });
    }
    assert!(bench.journal.settle(PATIENCE));
    bench.deliver(PATIENCE);
    assert_eq!(seen.numbers(), [1, 4, 7]);
    // What the filters leave out is passed over for good: the cursor stands after it.
    bench.stop();
    let bench = Bench::start(folder.path(), vec![]);
    assert_eq!(bench.opening.cursors["filters"], 8);
}

#[test]
fn a_sink_added_later_begins_at_the_start_or_now() {
    let folder = TempDir::new().unwrap();
    let mut bench = Bench::start(folder.path(), vec![]);
    bench.store(2500);
    bench.stop();
    let (all, new) = (Seen::default(), Seen::default());
    let (to_all, to_new) = (all.clone(), new.clone());
    let start = fake("later", "", move |b| Ok(to_all.add(b)));
    let now = fake("later-now", "from = \"now\"", move |b| Ok(to_new.add(b)));
    let mut bench = Bench::start(folder.path(), vec![start, now]);
    bench.store(10);
    bench.stop();
    assert_eq!(all.numbers(), (1..=2510).collect::<Vec<_>>());
    assert_eq!(new.numbers(), (2501..=2510).collect::<Vec<_>>());
}

#[test]
fn a_sink_that_is_down_is_told_of_once_and_gets_everything_when_it_is_up() {
    let folder = TempDir::new().unwrap();
    let (seen, up) = (Seen::default(), Arc::new(Mutex::new(false)));
    let (to, is_up) = (seen.clone(), Arc::clone(&up));
    let sink =
        fake(
            "down",
            "wait = \"0ms\"",
            move |b| {
                if *is_up.lock().unwrap() { Ok(to.add(b)) } else { Err("it is away".into()) }
            },
        );
    let mut bench = Bench::start(folder.path(), vec![sink]);
    let statuses = bench.runner.as_ref().unwrap().statuses();
    for _ in 0..10 {
        bench.store(1000);
    }
    wait_for(PATIENCE, "it is failing", || statuses.list()[0].state == State::Failing);
    let status = statuses.list()[0].clone();
    assert_eq!((status.kind.as_str(), status.cursor, status.error.as_str()), ("fake", 0, "it is away"));
    // Some tries later it was still told of once.
    std::thread::sleep(Duration::from_millis(800));
    let first = bench.reports.recv_timeout(PATIENCE).expect("a report");
    assert_eq!((first.name.as_str(), first.what), ("down", What::Refused("it is away".into())));
    assert!(bench.reports.try_recv().is_err());
    *up.lock().unwrap() = true;
    bench.deliver(PATIENCE);
    let second = bench.reports.recv_timeout(PATIENCE).expect("a report").what;
    assert!(matches!(second, What::Accepted { waiting } if waiting > 9000 && waiting < 10_000), "{second:?}");
    assert_eq!(seen.numbers(), (1..=10_000).collect::<Vec<_>>());
    assert_eq!(statuses.list()[0].state, State::Fine);
    bench.stop();
}

/// A sink that opens at the third try, and gets nothing that its filters let pass.
static LATE: SinkKind = SinkKind {
    name: "late",
    keys: &NO_KEYS,
    check: |_| Vec::new(),
    claim: |_| None,
    open: |config| {
        static TRIES: Mutex<u32> = Mutex::new(0);
        let mut tries = TRIES.lock().unwrap();
        *tries += 1;
        if *tries < 3 { Err("not yet".into()) } else { (FAKE.open)(config) }
    },
};

#[test]
fn a_sink_that_works_again_says_so_also_when_there_is_nothing_for_it() {
    let folder = TempDir::new().unwrap();
    let (_, config) = fake("late", "kinds = [\"alarm\"]", |_| Err("nothing was to come".into()));
    let mut bench = Bench::start(folder.path(), vec![(&LATE, config)]);
    bench.store(10);
    let what = |bench: &Bench| bench.reports.recv_timeout(PATIENCE).expect("a report").what;
    assert_eq!(what(&bench), What::Refused("not yet".into()));
    assert!(matches!(what(&bench), What::Accepted { .. }));
    let statuses = bench.runner.as_ref().unwrap().statuses();
    wait_for(PATIENCE, "it is fine", || statuses.list()[0].state == State::Fine);
    bench.deliver(PATIENCE);
    bench.stop();
}

#[test]
fn what_a_sink_did_not_keep_of_a_batch_is_offered_again() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    let to = seen.clone();
    // It keeps three of each batch.
    let sink = fake("three", "wait = \"0ms\"", move |b| Ok(to.add(&b[..b.len().min(3)])));
    let mut bench = Bench::start(folder.path(), vec![sink]);
    bench.store(1000);
    bench.deliver(PATIENCE);
    assert_eq!(seen.numbers(), (1..=1000).collect::<Vec<_>>());
    assert!(bench.reports.try_recv().is_err(), "that is no failure");
    bench.stop();
}

#[test]
fn a_sink_that_claims_too_much_or_nothing_is_refused_and_its_cursor_stays() {
    for (name, claim, says) in [
        ("liar", 1_000_000, "claims to have kept record 1000000, but was offered none after 10"),
        ("eater", 0, "kept none of the 10 records"),
    ] {
        let folder = TempDir::new().unwrap();
        let sink = fake(name, "batch = 10", move |_| Ok(claim));
        let mut bench = Bench::start(folder.path(), vec![sink]);
        bench.store(10);
        let report = bench.reports.recv_timeout(PATIENCE).expect("a report");
        assert!(matches!(&report.what, What::Refused(why) if why.contains(says)), "{report:?}");
        bench.stop();
        assert_eq!(Bench::start(folder.path(), vec![]).opening.cursors[name], 0, "{name}");
    }
}

#[test]
fn a_sink_that_panics_ends_alone() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    let to = seen.clone();
    let bad = fake("panics", "wait = \"0ms\"", |b| if b[0].seq > 50 { panic!("out of luck") } else { Ok(b[0].seq) });
    let good = fake("goes-on", "wait = \"0ms\"", move |b| Ok(to.add(b)));
    let mut bench = Bench::start(folder.path(), vec![bad, good]);
    bench.store(100);
    let report = bench.reports.recv_timeout(PATIENCE).expect("a report");
    assert_eq!((report.sink, report.what), (0, What::Ended("out of luck".into())));
    bench.store(100);
    let statuses = bench.runner.as_ref().unwrap().statuses();
    wait_for(PATIENCE, "the other has everything", || statuses.list()[1].cursor == 200);
    assert_eq!((statuses.list()[0].state, statuses.list()[0].cursor), (State::Ended, 50));
    assert_eq!(bench.stop(), [""; 0]);
    assert_eq!(seen.numbers(), (1..=200).collect::<Vec<_>>());
}

#[test]
fn a_sink_that_hangs_delays_neither_the_others_nor_the_end() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    let to = seen.clone();
    let (release, held) = std::sync::mpsc::channel::<()>();
    let hangs = fake("hangs", "wait = \"0ms\"", move |b| {
        let _ = held.recv();
        Ok(b[0].seq)
    });
    let good = fake("does-not", "wait = \"0ms\"", move |b| Ok(to.add(b)));
    let mut bench = Bench::start(folder.path(), vec![hangs, good]);
    bench.store(3000);
    let statuses = bench.runner.as_ref().unwrap().statuses();
    wait_for(PATIENCE, "the other has everything", || statuses.list()[1].cursor == 3000);
    assert_eq!(statuses.list()[0].behind, 3000);
    let start = Instant::now();
    assert_eq!(bench.stop(), ["hangs"]);
    assert!(start.elapsed() < Duration::from_secs(5));
    drop(release);
}

#[test]
fn a_slow_sink_gets_everything_while_the_journal_goes_on() {
    let folder = TempDir::new().unwrap();
    let seen = Seen::default();
    let to = seen.clone();
    let sink = fake("slow", "", move |b| {
        std::thread::sleep(Duration::from_millis(5));
        Ok(to.add(b))
    });
    let mut bench = Bench::start(folder.path(), vec![sink]);
    let start = Instant::now();
    bench.store(50_000);
    assert!(start.elapsed() < Duration::from_secs(20), "the journal waits for a sink");
    bench.deliver(PATIENCE);
    assert_eq!(seen.numbers(), (1..=50_000).collect::<Vec<_>>());
    bench.stop();
}
