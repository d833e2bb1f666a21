//! The table of docs/languages.md.

use crate::projects::{Made, engine, root};
use latchwork_author::Language;
use latchwork_block::{Instance, Limits, Scan, Template};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Executions of one instance that are compared and timed.
const EXECUTIONS: usize = 2000;
/// Executions of a batch, so that one interrupt spoils no more than one of them.
const BATCH: usize = 50;
/// Where the table stands in docs/languages.md.
const MARKS: [&str; 2] = ["<!-- table -->\n", "<!-- end of table -->"];

/// What one component does.
struct Figures {
    ns: f64,
    memory: u64,
    path: &'static str,
    outputs: Vec<u64>,
}

/// Measures all, checks that every language gives the same outputs, and writes the table when all languages are there.
pub(crate) fn judge(table: &[(Language, &str, Made)]) {
    let mut rows = String::new();
    let mut reference: Vec<(&str, Language, Vec<u64>)> = Vec::new();
    for (language, block, made) in table {
        let figures = figures(made);
        match reference.iter().find(|(b, _, _)| b == block) {
            None => reference.push((block, *language, figures.outputs.clone())),
            Some((_, first, outputs)) => {
                let differs = outputs.iter().zip(&figures.outputs).position(|(a, b)| a != b);
                assert_eq!(
                    differs,
                    None,
                    "{block} in {} gives other outputs than in {}",
                    language.title(),
                    first.title()
                );
            }
        }
        let size = std::fs::metadata(&made.path).expect("the component").len();
        let _ = writeln!(
            rows,
            "| {} | {block} | {} | {} | {} | {:.1} s | {} ns ({}) | {} | same outputs |",
            language.title(),
            language.source(),
            bytes(size),
            if made.imports.is_empty() { "none".into() } else { made.imports.join(", ") },
            made.took.as_secs_f64(),
            rounded(figures.ns),
            figures.path,
            bytes(figures.memory),
        );
    }
    eprintln!("{rows}");
    let whole = table.len() == Language::ALL.len() * crate::BLOCKS.len();
    if whole && std::env::var_os("LATCHWORK_BLESS").is_some() {
        bless(&rows);
    }
}

fn figures(made: &Made) -> Figures {
    let engine = engine();
    let component = engine.load_file(&made.path).unwrap_or_else(|e| panic!("{}: {e}", made.path.display()));
    let class = component.class(None).expect("one class");
    let template = component.template(&class).expect("a template");
    let mut first = start(&template, 256 << 20).expect("an instance");
    let (ns, outputs) = exercise(&mut first).expect("no fault");
    let mut second = start(&template, 256 << 20).expect("an instance");
    let (again, same) = exercise(&mut second).expect("no fault");
    assert_eq!(outputs, same, "{}: two instances, the same inputs, other outputs", made.path.display());
    let path = match template.path() {
        latchwork_block::CallPath::Plain => "plain",
        latchwork_block::CallPath::Component => "component",
    };
    Figures { ns: ns.min(again), memory: memory(&template), path, outputs }
}

/// The least memory that it runs with, to 64 KiB, by halving.
fn memory(template: &Template) -> u64 {
    const PAGE: u64 = 1 << 16;
    let enough = |pages: u64| start(template, pages * PAGE).is_some_and(|mut i| exercise(&mut i).is_some());
    let (mut low, mut high) = (0, 1 << 12);
    while low + 1 < high {
        let middle = (low + high) / 2;
        if enough(middle) { high = middle } else { low = middle }
    }
    high * PAGE
}

fn start(template: &Template, memory: u64) -> Option<Instance> {
    let limits = Limits { memory, budget_ticks: u64::MAX / 2, ..Limits::default() };
    let mut instance = template.instantiate(&limits).ok()?;
    let settings = match instance.defaults().ok()? {
        Some(settings) => settings,
        // A second, for the one class without defaults.
        None => vec![1_000_000_000; instance.class().settings.len()],
    };
    instance.configure(&settings).ok()?.ok()?;
    Some(instance)
}

/// Executes with inputs from a fixed sequence; the time of one execution in ns, of the best batch, and all results.
fn exercise(instance: &mut Instance) -> Option<(f64, Vec<u64>)> {
    let (arguments, results) = (instance.class().argument_cells(), instance.class().output_cells());
    let ins: Vec<u32> = (0..arguments as u32).collect();
    let real = instance.class().inputs.iter().any(|p| p.ty.to_string() == "f64");
    let mut cells = vec![0; arguments + results];
    let mut all = Vec::with_capacity(EXECUTIONS * results);
    let mut seed: u64 = 1;
    let (mut best, mut batch) = (Duration::MAX, Duration::ZERO);
    for i in 0..EXECUTIONS {
        for cell in &mut cells[..arguments] {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // A real from -10 to 74, a bool, or three commands.
            *cell = if real { f64::to_bits((seed >> 40) as f64 / 200_000.0 - 10.0) } else { seed >> 63 };
        }
        if !instance.class().commands.is_empty() {
            cells[arguments - 1] = seed >> 61;
        }
        let scan = Scan { now: i as u64 * 10_000_000, elapsed: 10_000_000, first: i == 0 };
        let start = Instant::now();
        instance.execute(scan, &ins, arguments as u32, &mut cells).ok()?;
        batch += start.elapsed();
        if (i + 1) % BATCH == 0 {
            best = best.min(std::mem::take(&mut batch));
        }
        all.extend_from_slice(&cells[arguments..]);
    }
    Some((best.as_nanos() as f64 / BATCH as f64, all))
}

fn bytes(n: u64) -> String {
    match n {
        0..10_240 => format!("{:.1} KB", n as f64 / 1024.0),
        10_240..1_048_576 => format!("{} KB", n / 1024),
        _ => format!("{:.1} MB", n as f64 / 1_048_576.0),
    }
}

fn rounded(ns: f64) -> u64 {
    if ns < 1000.0 { ns as u64 / 10 * 10 } else { ns as u64 / 100 * 100 }
}

fn bless(rows: &str) {
    let path = root().join("docs/languages.md");
    let text = std::fs::read_to_string(&path).expect("docs/languages.md");
    let (before, rest) = text.split_once(MARKS[0]).expect("the mark of the table");
    let (_, after) = rest.split_once(MARKS[1]).expect("the mark of its end");
    let head = "| language | block | source | size | imports | build | execution | memory | determinism |\n|---|---|---|---|---|---|---|---|---|\n";
    std::fs::write(&path, format!("{before}{}{head}{rows}{}{after}", MARKS[0], MARKS[1])).expect("docs/languages.md");
}
