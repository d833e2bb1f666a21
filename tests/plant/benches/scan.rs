//! Whole scans: blocks, snapshot, publication; the start of large plants; memory per block.
//!
//! `cargo xtask bench` runs this and prints the table of docs/performance.md.

use criterion::{BenchmarkId, Criterion, Throughput};
use latchwork_block::{Engine, EngineOptions};
use latchwork_plant::assemble::{Plant, Time};
use latchwork_tests_plant::{Rig, assemble_file, target};
use std::fmt::Write;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// A lane of `n` blocks of one kind, each reading the one before it; every 64th reads a point of a driver.
fn chain(n: usize) -> String {
    let mut text = String::from(
        "[lane.main]\nevery = \"10ms\"\n[driver.field]\nkind = \"sim\"\n[driver.field.points]\nin = { type = \"bool\" }\n",
    );
    for i in 0..n {
        let source = if i % 64 == 0 { "field.in".into() } else { format!("b{}.outputs.q", i - 1) };
        let _ = write!(
            text,
            "[block.b{i}]\ncomponent = \"ton\"\nlane = \"main\"\ninputs.in = \"{source}\"\ninputs.pt = \"5s\"\n"
        );
    }
    text
}

/// One block that reads the last of `n` points; the others are read by nobody, or all are read.
fn points(n: usize, read: usize) -> String {
    let mut text =
        String::from("[lane.main]\nevery = \"10ms\"\n[driver.field]\nkind = \"sim\"\n[driver.field.points]\n");
    for i in 0..n {
        let _ = writeln!(text, "p{i} = {{ type = \"bool\" }}");
    }
    for i in 0..read {
        let _ = write!(text, "[block.b{i}]\ncomponent = \"r-trig\"\nlane = \"main\"\ninputs.clk = \"field.p{i}\"\n");
    }
    text
}

fn plant(text: &str) -> Plant {
    Rig::new(text).trace(None).plant(Time::Real)
}

/// Scans of a lane at a period, by virtual `now` but the machine's clock for the scan's own time.
fn scan(plant: &mut Plant) -> impl FnMut() + '_ {
    let lane = &mut plant.lanes[0];
    let start = Instant::now();
    let mut now = 0;
    move || {
        now += 10_000_000;
        black_box(lane.scan(now, now, || now + (start.elapsed().as_nanos() as u64 & 0xff)));
    }
}

fn scans(c: &mut Criterion) {
    let mut group = c.benchmark_group("scan");
    group.measurement_time(Duration::from_secs(4)).sample_size(40);
    for n in [1, 10, 100, 1000] {
        let mut plant = plant(&chain(n));
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("blocks", n), |b| b.iter(scan(&mut plant)));
    }
    group.finish();
    let mut group = c.benchmark_group("snapshot");
    group.measurement_time(Duration::from_secs(2)).sample_size(30);
    // What a scan does not read costs it nothing: 1 of 10 000 points costs as much as 1 of 1.
    for (n, read) in [(1, 1), (10_000, 1), (100, 100), (1000, 1000)] {
        let mut plant = plant(&points(n, read));
        group.bench_function(BenchmarkId::new("read", format!("{read} of {n}")), |b| b.iter(scan(&mut plant)));
    }
    group.finish();
}

/// Resident memory of this process, bytes.
fn resident() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: u64 = text.split(' ').nth(1).and_then(|p| p.parse().ok()).unwrap_or(0);
    pages * 4096
}

fn starts() {
    let rig = Rig::new(&chain(1000));
    let folder = target().join("bench-cache");
    let _ = std::fs::remove_dir_all(&folder);
    for what in ["cold", "with the cache"] {
        let before = Instant::now();
        let engine =
            Engine::new(EngineOptions { cache: Some(folder.clone()), ..EngineOptions::default() }).expect("an engine");
        let memory = resident();
        let plant = assemble_file(&rig.path(), &engine, false, Time::Real, None);
        let (took, memory) = (before.elapsed(), resident().saturating_sub(memory));
        println!(
            "start of 1000 blocks, {what}: {} ms; {} KB of memory per block",
            took.as_millis(),
            memory / 1000 / 1000
        );
        drop(plant);
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    scans(&mut criterion);
    starts();
    criterion.final_summary();
}
