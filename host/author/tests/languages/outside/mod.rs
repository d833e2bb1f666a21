//! What a block gets that asks its language for the time, or for random numbers.

use crate::kept;
use crate::projects::{Outcome, attempt, engine, root};
use latchwork_author::{ClassChoice, Language};
use latchwork_block::{FaultKind, Instance, Limits, Scan, Ticker};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Plant times at which it is asked, ns; whole microseconds, which is what some clocks show.
const TIMES: [u64; 3] = [5_000_000_000, 5_020_000_000, 7_000_001_000];
/// Random numbers that are drawn.
const DRAWS: usize = 8;

/// Why there is no answer.
enum NoAnswer {
    /// A tool is missing.
    Missing(String),
    /// The block does not build.
    Refused,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages/outside")
}

/// Name of the source that asks for one thing; most ask for both.
fn source(language: Language, what: &str) -> String {
    match language {
        Language::Zig => format!("{what}.zig"),
        Language::AssemblyScript => format!("{what}.assemblyscript.ts"),
        Language::Rust => "lib.rs".into(),
        other => other.source().into(),
    }
}

/// Starts instances of the block that asks.
fn block(language: Language, what: &str) -> Result<Box<dyn Fn() -> Instance>, NoAnswer> {
    let path = folder().join(source(language, what));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let own = ClassChoice::Own { folder: folder().join("wit"), class: None };
    let made = match attempt(language, "asking", &own, &[(language.source().to_owned(), text)]) {
        Ok(Outcome::Built(made)) => made,
        Ok(Outcome::Missing(why)) => return Err(NoAnswer::Missing(why)),
        Err(_) => {
            // It is what is asked for that does not build.
            assert!(matches!(attempt(language, "asking", &own, &[]), Ok(Outcome::Built(_))), "{language:?}");
            return Err(NoAnswer::Refused);
        }
    };
    assert!(made.imports.is_empty(), "{language:?}: {:?}", made.imports);
    let engine = engine();
    let component = engine.load_file(&made.path).unwrap_or_else(|e| panic!("{}: {e}", made.path.display()));
    let class = component.class(None).expect("one class");
    let template = component.template(&class).expect("a template");
    let limits = Limits { memory: 64 << 20, budget_ticks: 500, ..Limits::default() };
    // What it asks for may never come.
    let ticker = Ticker::start(&engine, Duration::from_millis(10));
    Ok(Box::new(move || {
        let _as_long_as = &ticker;
        template.instantiate(&limits).expect("an instance")
    }))
}

/// `now` and `random` of one execution, or the fault.
fn ask(instance: &mut Instance, now: u64, time: bool, random: bool) -> Result<(u64, u64), FaultKind> {
    let mut cells = [u64::from(time), u64::from(random), 0, 0];
    let scan = Scan { now, elapsed: 10_000_000, first: false };
    instance.execute(scan, &[0, 1], 2, &mut cells).map_err(|f| f.kind)?;
    Ok((cells[2], cells[3]))
}

/// What the clock shows.
fn clock(_: Language, start: &dyn Fn() -> Instance) -> String {
    let mut instance = start();
    for time in TIMES {
        match ask(&mut instance, time, true, false) {
            Ok((now, _)) => assert_eq!(now, time, "the clock shows neither plant time nor nothing"),
            Err(kind) => return format!("a fault ({})", kind.name()),
        }
    }
    "plant time".into()
}

/// The sequence of a language whose own generator the build would seed: Python's Mersenne Twister of seed 0; Mulberry32 of seed 0 in JavaScript.
fn known(language: Language) -> Option<[u64; DRAWS]> {
    match language {
        Language::Python => {
            Some([3626764237, 1654615998, 3255389356, 3823568514, 1806341205, 173879092, 1112038970, 4146640122])
        }
        Language::JavaScript | Language::TypeScript => {
            Some([572152369, 708123, 479473028, 313966722, 1003578858, 1170483992, 1321242287, 1393685491])
        }
        _ => None,
    }
}

/// What is drawn.
fn random(language: Language, start: &dyn Fn() -> Instance) -> String {
    let draw = |instance: &mut Instance| -> Result<Vec<u64>, FaultKind> {
        (0..DRAWS).map(|_| ask(instance, 0, false, true).map(|(_, random)| random)).collect()
    };
    let first = match draw(&mut start()) {
        Ok(numbers) => numbers,
        Err(kind) => return format!("a fault ({})", kind.name()),
    };
    let second = draw(&mut start()).expect("what went well goes well again");
    assert_eq!(first, second, "two instances draw other numbers");
    if let Some(known) = known(language) {
        assert_eq!(first, known, "{language:?} draws what no other build would");
    }
    assert!(first.iter().any(|n| *n != first[0]), "always the same number: {first:?}");
    "a fixed sequence".into()
}

/// Asks in one language, and compares with the table of docs/languages.md.
pub(crate) fn is_as_the_table_says(language: Language) {
    let mut answers = Vec::new();
    for (what, answer) in [("clock", clock as fn(Language, &dyn Fn() -> Instance) -> String), ("random", random)] {
        answers.push(match block(language, what) {
            Ok(start) => answer(language, &*start),
            Err(NoAnswer::Refused) => "does not build".into(),
            Err(NoAnswer::Missing(why)) => return kept::skip(&why),
        });
    }
    let page = std::fs::read_to_string(root().join("docs/languages.md")).expect("docs/languages.md");
    let (_, table) = page.split_once("| language | a clock | random numbers |").expect("the table");
    let begin = format!("| {} | ", language.title());
    let row = table.lines().find(|l| l.starts_with(&begin));
    assert_eq!(row, Some(format!("{begin}{} |", answers.join(" | ")).as_str()), "the row of docs/languages.md");
}
