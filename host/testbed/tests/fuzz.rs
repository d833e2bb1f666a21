//! Every kind of defect is found, shrunk, and written as a case that fails in the same way. Needs `cargo xtask guests`.

use latchwork_block::{Engine, EngineOptions, Ticker};
use latchwork_testbed::case::{self, Subject, check_text};
use latchwork_testbed::check::check;
use latchwork_testbed::fuzz::{Finding, Kind, Options, Report, fuzz};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

const TICK: u64 = 10_000_000;

fn engine() -> &'static Engine {
    static ENGINE: LazyLock<(Engine, Ticker)> = LazyLock::new(|| {
        let engine = Engine::new(EngineOptions::default()).expect("an engine");
        let ticker = Ticker::start(&engine, Duration::from_nanos(TICK));
        (engine, ticker)
    });
    &ENGINE.0
}

fn target() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder")
}

fn defects() -> PathBuf {
    target().join("test-components/defects.wasm")
}

fn subject(path: &Path, class: Option<&str>) -> Subject {
    let component = engine().load_file(path);
    let component = component.unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", path.display()));
    let class = component.class(class).expect("the class");
    let template = component.template(&class).expect("it compiles");
    Subject { component, class, template }
}

fn clock() -> impl Fn() -> u64 {
    let begun = Instant::now();
    move || begun.elapsed().as_nanos() as u64
}

fn search(subject: &Subject, options: &Options) -> Report {
    fuzz(subject, options, &clock(), &mut |_| std::ops::ControlFlow::Continue(()))
}

/// Fuzzes one of the defects.
fn of(defect: &str) -> Report {
    let subject = subject(&defects(), Some(&format!("test:defects/{defect}")));
    // What never ends costs time in every sequence.
    let sequences = if ["endless", "slow"].contains(&defect) { 40 } else { 400 };
    // Budgets that no busy machine misses by itself, three times in the same place.
    let options = Options { seed: 7, sequences: Some(sequences), budget: 5_000_000, ..Options::default() };
    search(&subject, &options)
}

/// The one finding, whose case fails in the way it says.
fn one(defect: &str, kind: &str) -> (Finding, String) {
    let report = of(defect);
    let kinds: Vec<_> = report.findings.iter().map(|f| f.kind.name()).collect();
    assert_eq!(kinds, [kind], "{:#?}", report.findings);
    let text = report.test_file("defects.wasm").expect("a case");
    let checked =
        check_text(&defects().with_file_name("x.test.toml"), text.clone(), engine(), &case::Options::default());
    let file = checked.file.as_ref().unwrap_or_else(|| panic!("{text}\n{}", checked.render(false)));
    // A quick machine stops what is slow only sometimes: a test's budget is kept by the engine's ticks.
    if defect != "slow" {
        assert!(!file.run(&file.cases[0], TICK).passed, "the case passes:\n{text}");
    }
    (report.findings[0].clone(), text)
}

macro_rules! golden {
    ($name:literal, $kind:literal) => {
        let (finding, text) = one($name, $kind);
        insta::assert_snapshot!(concat!("defect-", $name), format!("{}\n\n{text}", finding.message));
    };
}

#[test]
fn a_trap_on_a_value_is_found_and_the_value_is_simple() {
    golden!("trap-above", "trap");
}

#[test]
fn a_trap_after_thousands_of_executions_is_found_and_told_in_two_steps() {
    golden!("trap-late", "trap");
}

#[test]
fn an_execution_that_never_ends_is_found() {
    golden!("endless", "budget");
}

#[test]
fn an_execution_that_takes_longer_than_its_budget_is_found() {
    let (finding, text) = one("slow", "budget");
    // How long it took is the machine's affair, and so is the time that is the simplest with which it is too long.
    assert!(finding.message.starts_with("an execution "), "{}", finding.message);
    assert!(finding.message.ends_with(" its budget of 5ms"), "{}", finding.message);
    assert_eq!((finding.executions, text.matches("[[case.step]]").count()), (2, 2), "{text}");
    assert!(text.contains("inputs = { on = true }"), "{text}");
}

#[test]
fn memory_that_grows_for_ever_is_found() {
    golden!("leak", "memory-growth");
}

#[test]
fn a_field_that_retained_lacks_is_found() {
    golden!("forgetful", "not-restored");
}

#[test]
fn settings_that_are_refused_and_yet_in_force_are_found() {
    golden!("half-refused", "refusal-disturbs");
}

#[test]
fn a_save_that_changes_the_block_is_found() {
    let report = of("save-resets");
    let kinds: Vec<_> = report.findings.iter().map(|f| f.kind).collect();
    assert!(kinds.contains(&Kind::SaveDisturbs), "{:#?}", report.findings);
    let finding = report.findings.iter().find(|f| f.kind == Kind::SaveDisturbs).expect("it is there");
    insta::assert_snapshot!("defect-save-resets", finding.case.as_deref().expect("a case"));
}

#[test]
fn nan_out_of_finite_inputs_is_a_note_and_no_finding() {
    let report = of("quotient");
    assert_eq!(report.findings, []);
    let notes = report.notes.join("\n");
    assert!(notes.contains("outputs.q was NaN though every input and setting was a finite number"), "{notes}");
}

#[test]
fn the_same_seed_finds_the_same_and_another_one_searches_elsewhere() {
    let subject = subject(&defects(), Some("test:defects/trap-above"));
    let found = |seed| {
        let options = Options { seed, sequences: Some(100), budget: 1_000_000_000, ..Options::default() };
        let report = search(&subject, &options);
        (report.executions, report.findings, report.notes)
    };
    assert_eq!(found(3), found(3));
    assert_ne!(found(3).0, found(4).0);
}

/// How many there were depends on the constants in the code, which depend on the compiler.
fn without_counts(text: &str) -> String {
    let number = |word: &str| word.bytes().all(|b| b.is_ascii_digit());
    let mut words: Vec<&str> = text.split(' ').collect();
    for i in 1..words.len() {
        let counted = ["executions", "random", "times"].iter().any(|w| words[i].starts_with(w));
        if counted && number(words[i - 1]) {
            words[i - 1] = "N";
        }
    }
    words.join(" ")
}

#[test]
fn what_is_meant_to_be_so_is_not_told() {
    let subject = subject(&defects(), Some("test:defects/forgetful"));
    let options = Options { sequences: Some(100), ignored: vec![Kind::NotRestored], ..Options::default() };
    assert_eq!(search(&subject, &options).findings, []);
}

#[test]
fn a_check_says_what_a_plant_would_get() {
    let told = |class: &str| {
        let subject = subject(&defects(), Some(&format!("test:defects/{class}")));
        // No time that is measured: it differs from machine to machine.
        let options = Options { seed: 7, sequences: Some(400), ..Options::default() };
        let check = check(&subject, &options, &|| 0);
        let lines = check.lines.iter().filter(|l| l.name != "size");
        let lines: Vec<_> = lines.map(|l| format!("{:?} {}: {}", l.status, l.name, l.found)).collect();
        let lines = without_counts(&lines.join("\n"));
        let reservations: String = check.reservations.iter().map(|r| format!("  {r}\n")).collect();
        format!("{:?} {}\n{lines}\n{reservations}", check.verdict, if check.ok { "yes" } else { "no" })
    };
    let all = ["quotient", "forgetful", "half-refused", "save-resets", "trap-above", "leak"].map(told).join("\n");
    insta::assert_snapshot!("checks", all);
}

#[test]
fn every_fault_of_the_stress_block_is_found() {
    let subject = subject(&target().join("components/stress.wasm"), None);
    // To take 4 MiB page by page is long work on a busy machine.
    let memory = 512 << 10;
    let options = Options { seed: 1, sequences: Some(60), budget: 20_000_000, memory, ..Options::default() };
    let report = search(&subject, &options);
    let kinds: Vec<_> = report.findings.iter().map(|f| f.kind.name()).collect();
    for kind in ["trap", "budget", "memory", "stack", "result"] {
        assert!(kinds.contains(&kind), "{kind} is missing: {kinds:?}");
    }
}
