//! Every shipped block, given random inputs, is replayed equal: from its cold start, and from a state on the way.

use latchwork_block::{Class, Component, Instance, Limits, Scan, Ticker};
use latchwork_image::Type;
use latchwork_testbed::replay::{
    Event, Head, Options, Recording, Start, Writer, component_chunk, hash_of, header, replay, segment_chunk,
};
use latchwork_tests_plant::{component_folders, engine};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

/// A generator that needs no crate and is the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// A value of a type; now and then an extreme one.
    fn cell(&mut self, ty: &Type) -> u64 {
        let wild = self.below(16) == 0;
        let small = i128::from(self.below(200)) - 50;
        match ty {
            Type::Bool => self.below(2),
            Type::Enum(names) => self.below(names.len() as u64),
            Type::Flags(names) => self.next() & ((1 << names.len()) - 1),
            Type::Duration => self.below(300_000_000),
            Type::F32 | Type::F64 => {
                let wild = wild.then(|| [f64::NAN, f64::INFINITY, -0.0, 1e300][self.below(4) as usize]);
                ty.cell_from_real(wild.unwrap_or(self.below(100_000) as f64 / 997.0)).expect("a real")
            }
            ty => ty.cell_from_integer(small).or_else(|| ty.cell_from_integer(small.abs())).expect("a number"),
        }
    }

    /// Arguments: mostly those before, some of them others.
    fn arguments(&mut self, class: &Class, cells: &mut [u64]) {
        let mut at = 0;
        for port in &class.inputs {
            if self.below(5) == 0 {
                cells[at] = self.cell(&port.ty);
            }
            at += 1;
            if port.signal {
                cells[at] = if self.below(20) == 0 { self.below(3) } else { 0 };
                at += 1;
            }
        }
        if !class.commands.is_empty() {
            cells[at] = if self.below(10) == 0 { self.next() & ((1 << class.commands.len()) - 1) } else { 0 };
        }
    }
}

/// Settings a class takes: the component's own.
fn start(component: &Component, class: &Class) -> (Instance, Vec<u64>) {
    let template = component.template(class).expect("it compiles");
    let mut instance = template.instantiate(&Limits { budget_ticks: 100, ..Limits::default() }).expect("it starts");
    let settings = instance.defaults().expect("it lives").unwrap_or_else(|| vec![0; class.settings.len()]);
    instance.configure(&settings).expect("it lives").expect("it takes its own settings");
    (instance, settings)
}

/// Records 2 × `n` executions in two segments, the second one with a state where the class has one.
fn record(component: &Component, class: &Class, seed: u64, n: u64) -> Vec<u8> {
    let (mut instance, settings) = start(component, class);
    let (arguments, outputs) = (class.argument_cells(), class.output_cells());
    let mut cells = vec![0; arguments + outputs];
    let ins: Vec<u32> = (0..arguments as u32).collect();
    let mut writer = Writer::new(Head {
        run: 1,
        epoch: 0,
        block: "b".into(),
        lane: "main".into(),
        every: 10_000_000,
        component: component.name().into(),
        hash: component.hash().into(),
        version: 0,
        class: class.name.clone(),
        memory: 4 << 20,
        number: 0,
        start: Start::Cold,
        settings,
        cells: [arguments, outputs],
        from: 0,
        to: 0,
        executions: 0,
        missed: 0,
    });
    assert_eq!(hash_of(component.bytes()), component.hash());
    let mut file = header();
    file.extend(component_chunk(component.bytes()));
    let mut random = Random(seed);
    let (mut now, mut last) = (0, None);
    for i in 0..2 * n {
        if i == n {
            let state = instance.save().expect("it lives").unwrap_or_default();
            file.extend(segment_chunk(&writer.cut(Start::State(state)).expect("something happened")));
        }
        random.arguments(class, &mut cells[..arguments]);
        let scan = Scan { now, elapsed: last.map_or(0, |last| now - last), first: i == 0 };
        let given = cells[..arguments].to_vec();
        let done = instance.execute(scan, &ins, arguments as u32, &mut cells);
        instance.drain_log(|_, _| ());
        done.unwrap_or_else(|fault| panic!("{}: {fault}", component.name()));
        writer.add(Event::Execution { scan, arguments: &given, outputs: Ok(&cells[arguments..]) });
        last = Some(now);
        // A lane by the machine's clock is never quite on time.
        now += 9_000_000 + random.below(2_000_000);
    }
    file.extend(segment_chunk(&writer.cut(Start::Continued).expect("something happened")));
    file
}

fn open(folder: &Path, bytes: &[u8]) -> Recording {
    let file = folder.join("x.latchrec");
    std::fs::write(&file, bytes).expect("written");
    Recording::open(&file).expect("a recording")
}

#[test]
fn every_shipped_block_is_replayed_equal_from_its_cold_start_and_from_its_state() {
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    let folder = TempDir::new().expect("a folder");
    let (mut blocks, mut stateful) = (0, 0);
    let mut incomplete: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut files: Vec<_> =
        std::fs::read_dir(&component_folders()[0]).expect("a folder").map(|e| e.expect("one").path()).collect();
    files.sort();
    for file in files {
        // Loggers are no blocks; the stress component faults on purpose.
        let Ok(component) = engine.load_file(&file) else { continue };
        if component.name() == "stress" {
            continue;
        }
        for class in component.classes() {
            for seed in [1, 2, 3] {
                let recording = open(folder.path(), &record(&component, class, seed, 1500));
                let whole = replay(&recording, &engine, 1, "b", &Options::default()).expect("a replay");
                assert!(whole.equal(), "{}: {whole:#?}", component.name());
                assert_eq!(whole.executions, 3000);
                if class.retained.is_empty() {
                    continue;
                }
                // The state alone must do, but for what a class is documented to begin anew.
                let second = recording.blocks(1).next().expect("a block").1[1].clone();
                let mut late = header();
                late.extend(component_chunk(component.bytes()));
                late.extend(segment_chunk(&second));
                let recording = open(folder.path(), &late);
                let half = replay(&recording, &engine, 1, "b", &Options::default()).expect("a replay");
                assert_eq!(half.executions, 1500);
                assert!(half.notes[0].contains("with the state that was saved there"), "{half:#?}");
                stateful += 1;
                if !half.equal() {
                    let ports = half.deviations.iter().map(|d| d.port.clone()).collect::<BTreeSet<_>>();
                    incomplete.entry(component.name().to_string()).or_default().extend(ports);
                }
            }
            blocks += 1;
        }
    }
    insta::assert_json_snapshot!("begun_anew", incomplete);
    assert!(blocks >= 25 && stateful >= 3 * 15, "{blocks} blocks, {stateful} replays from a state");
}
