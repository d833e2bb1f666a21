//! What one execution of a block costs, image to image, with all checks: on the plain path, on the component path and as
//! native Rust; and what it costs to make one.
//!
//! `cargo xtask bench` builds the blocks and runs this. Every figure of a call is per block.

use criterion::{BenchmarkId, Criterion};
use latchwork_block::{CallPath, Engine, EngineOptions, Instance, Limits, Scan, Template};
use std::fmt::Write;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const SECOND: u64 = 1_000_000_000;

/// Anything that executes on cells.
trait Block {
    fn execute(&mut self, scan: Scan, ins: &[u32], out: u32, cells: &mut [u64]);
}

impl Block for Instance {
    fn execute(&mut self, scan: Scan, ins: &[u32], out: u32, cells: &mut [u64]) {
        Instance::execute(self, scan, ins, out, cells).expect("no fault");
    }
}

/// The on-delay timer as native Rust.
#[derive(Default)]
struct NativeTon {
    q: bool,
    et: u64,
}

impl Block for NativeTon {
    fn execute(&mut self, scan: Scan, ins: &[u32], out: u32, cells: &mut [u64]) {
        let (on, pt) = (cells[ins[0] as usize] != 0, cells[ins[1] as usize]);
        if on {
            self.et = self.et.saturating_add(scan.elapsed).min(pt);
            self.q |= self.et >= pt;
        } else {
            *self = Self::default();
        }
        cells[out as usize] = self.q.into();
        cells[out as usize + 1] = self.et;
    }
}

impl Block for Box<dyn Block> {
    fn execute(&mut self, scan: Scan, ins: &[u32], out: u32, cells: &mut [u64]) {
        (**self).execute(scan, ins, out, cells);
    }
}

/// Blocks of one kind in a row, each with the same number of cells: arguments, then results.
struct Row<B> {
    blocks: Vec<B>,
    ins: Vec<u32>,
    cells: Vec<u64>,
    arguments: usize,
    results: usize,
    scan: Scan,
}

impl<B: Block> Row<B> {
    /// Like a chain in a plant: the first argument is the first result of the block before.
    fn new(blocks: Vec<B>, arguments: usize, results: usize, value: u64) -> Self {
        let width = arguments + results;
        let mut cells = vec![0; blocks.len() * width];
        let mut ins = Vec::new();
        for block in 0..blocks.len() {
            for argument in 0..arguments {
                let own = block * width + argument;
                cells[own] = if argument == 0 { u64::from(block == 0) } else { value };
                let chained = argument == 0 && block > 0;
                ins.push(if chained { (own - results) as u32 } else { own as u32 });
            }
        }
        Self { blocks, ins, cells, arguments, results, scan: Scan { now: 0, elapsed: SECOND / 100, first: true } }
    }

    fn scan(&mut self) {
        self.scan.now += self.scan.elapsed;
        self.scan.first = false;
        let width = self.arguments + self.results;
        for (i, block) in self.blocks.iter_mut().enumerate() {
            let ins = &self.ins[i * self.arguments..(i + 1) * self.arguments];
            block.execute(self.scan, ins, (i * width + self.arguments) as u32, &mut self.cells);
        }
    }

    /// Time of `iterations` executions of single blocks, in whole scans.
    fn time(&mut self, iterations: u64) -> Duration {
        let blocks = self.blocks.len() as u64;
        let scans = iterations.div_ceil(blocks);
        let begun = Instant::now();
        for _ in 0..scans {
            self.scan();
        }
        let took = begun.elapsed();
        black_box(&self.cells);
        Duration::from_nanos((took.as_nanos() as u64 * iterations) / (scans * blocks))
    }
}

fn target() -> PathBuf {
    let program = std::env::current_exe().expect("the path of this program");
    program.ancestors().nth(3).expect("it lies in target/release/deps").to_path_buf()
}

fn shipped(name: &str) -> Vec<u8> {
    let path = target().join("components").join(name).with_extension("wasm");
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", path.display()))
}

/// A class with `n` real inputs and outputs each; more than 13 inputs pass through the block's memory.
fn reals(n: usize) -> Vec<u8> {
    let fields: String = (0..n).map(|i| format!("v{i}: f64, ")).collect();
    let wit = format!(
        "package bench:reals; interface reals {{ use latchwork:block/types@0.1.0.{{scan}};
         record inputs {{ {fields} }} record outputs {{ {fields} }} execute: func(scan: scan, inputs: inputs) -> outputs; }}
         world w {{ export reals; }}"
    );
    let spilled = n + 3 > 16;
    let (params, mut body) = if spilled {
        ("i32".into(), String::new())
    } else {
        (format!("i64 i64 i32{}", " f64".repeat(n)), String::new())
    };
    for i in 0..n {
        let _ = match spilled {
            true => write!(
                body,
                "(f64.store offset={} (i32.const 0) (f64.load offset={} (local.get 0)))",
                i * 8,
                24 + i * 8
            ),
            false => write!(body, "(f64.store offset={} (i32.const 0) (local.get {}))", i * 8, i + 3),
        };
    }
    let wat = format!(
        r#"(module (memory (export "memory") 1)
            (func (export "cabi_realloc") (param i32 i32 i32 i32) (result i32) i32.const 4096)
            (func (export "bench:reals/reals#execute") (param {params}) (result i32) {body} i32.const 0))"#
    );
    let mut resolve = wit_parser::Resolve::default();
    let mut push = |texts: &[(&str, &str)]| {
        let mut map = wit_parser::SourceMap::default();
        texts.iter().for_each(|(path, text)| map.push(Path::new(path), *text));
        let group = map.parse().unwrap_or_else(|(_, e)| panic!("{e:?}"));
        resolve.push_group(group).expect("a package")
    };
    push(latchwork_wit::BLOCK.files);
    let package = push(&[("bench.wit", &wit)]);
    let world = resolve.select_world(&[package], None).expect("a world");
    let mut module = wat::parse_str(wat).expect("a module");
    wit_component::embed_component_metadata(&mut module, &resolve, world, wit_component::StringEncoding::UTF8)
        .expect("metadata");
    wit_component::ComponentEncoder::default().module(&module).and_then(|mut e| e.encode()).expect("a component")
}

fn template(path: CallPath, bytes: &[u8]) -> Template {
    let engine = Engine::new(EngineOptions { cache: None, force_path: Some(path) }).expect("an engine");
    let component = engine.load_bytes("bench", bytes).expect("a component");
    component.template(&component.class(None).expect("one class")).expect("a template")
}

fn instances(template: &Template, n: usize) -> Vec<Instance> {
    (0..n).map(|_| template.instantiate(&Limits::default()).expect("an instance")).collect()
}

fn calls(c: &mut Criterion) {
    let mut group = c.benchmark_group("call");
    group.measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_secs(1)).sample_size(50);
    let ton = shipped("ton");
    for n in [1, 100, 1000] {
        let native: Vec<Box<dyn Block>> = (0..n).map(|_| Box::<NativeTon>::default() as Box<dyn Block>).collect();
        let mut row = Row::new(native, 2, 2, 5 * SECOND);
        group.bench_function(BenchmarkId::new("ton, native", n), |b| b.iter_custom(|i| row.time(i)));
        for (name, path) in [("ton, plain", CallPath::Plain), ("ton, component", CallPath::Component)] {
            let mut row = Row::new(instances(&template(path, &ton), n), 2, 2, 5 * SECOND);
            group.bench_function(BenchmarkId::new(name, n), |b| b.iter_custom(|i| row.time(i)));
        }
    }
    for reals_in in [10, 20] {
        let bytes = reals(reals_in);
        for (name, path) in [("plain", CallPath::Plain), ("component", CallPath::Component)] {
            let blocks = instances(&template(path, &bytes), 1);
            let mut row = Row::new(blocks, reals_in, reals_in, 1.5f64.to_bits());
            let id = BenchmarkId::new(format!("{reals_in} reals in and out, {name}"), 1);
            group.bench_function(id, |b| b.iter_custom(|i| row.time(i)));
        }
    }
    group.finish();
}

fn making(c: &mut Criterion) {
    let mut group = c.benchmark_group("make");
    group.measurement_time(Duration::from_secs(3)).sample_size(20);
    let ton = shipped("ton");
    let compiled = template(CallPath::Plain, &ton);
    group.bench_function("instantiate", |b| b.iter(|| compiled.instantiate(&Limits::default())));
    group.bench_function("load and compile", |b| b.iter(|| template(CallPath::Plain, &ton)));
    let cache = tempfile::tempdir().expect("a folder");
    let load = || {
        let options = EngineOptions { cache: Some(cache.path().join("cache")), force_path: None };
        let component = Engine::new(options).expect("an engine").load_bytes("bench", &ton).expect("a component");
        component.template(&component.class(None).expect("one class")).expect("a template")
    };
    group.bench_function("load with the cache", |b| b.iter(load));
    group.finish();
}

/// Resident memory of this process, bytes.
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: u64 = text.split(' ').nth(1).and_then(|p| p.parse().ok()).unwrap_or(0);
    pages * 4096
}

fn memory() {
    for (name, path) in [("plain", CallPath::Plain), ("component", CallPath::Component)] {
        let template = template(path, &shipped("ton"));
        let before = resident();
        let mut row = Row::new(instances(&template, 1000), 2, 2, 5 * SECOND);
        row.scan();
        println!("memory per block of 1000, {name}: {} KB", resident().saturating_sub(before) / 1000 / 1000);
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    memory();
    calls(&mut criterion);
    making(&mut criterion);
    criterion.final_summary();
}
