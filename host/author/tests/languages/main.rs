//! Every language, from `new` over its own tool to a component that passes its tests. What is built is kept in the build folder
//! by the hash of its sources and of its tools' versions; a language whose tools are not here is passed over.
//!
//! `LATCHWORK_LANGUAGES=c,zig` restricts the tests to some; `LATCHWORK_BLESS=1` writes the table of docs/languages.md.

mod figures;
mod kept;
mod outside;
mod own;
mod projects;

use latchwork_author::{ClassChoice, Language, shipped_classes};
use latchwork_testbed::fuzz::Kind;
use projects::{Outcome, built, root, run_tests};
use std::path::Path;

/// The blocks that exist in every language.
const BLOCKS: [&str; 2] = ["bounds-check", "motor"];

fn class(name: &str) -> ClassChoice {
    ClassChoice::Shipped(name.into())
}

/// The source of an example's block, below the project's folder.
fn source(language: Language, block: &str) -> (String, String) {
    let path = root().join("examples/blocks").join(block).join(language.name()).join(language.source());
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    (language.source().to_owned(), text)
}

/// Tests of one language each, so that a failure or a missing tool names it.
macro_rules! each_language {
    ($($module:ident: $language:ident,)*) => {$(
        mod $module {
            use latchwork_author::Language;

            #[test]
            fn the_shared_blocks_pass_the_shared_tests_and_fuzzing() {
                super::shared_blocks(Language::$language);
            }

            #[test]
            fn new_projects_build_and_pass_their_first_test() {
                super::new_projects(Language::$language);
            }

            #[test]
            fn own_classes_build_and_pass_their_first_test() {
                if super::kept::wanted(Language::$language) {
                    super::own::build_and_pass_their_first_test(Language::$language);
                }
            }

            #[test]
            fn whole_numbers_are_right_at_their_edges() {
                if super::kept::wanted(Language::$language) {
                    super::own::whole_numbers_are_right_at_their_edges(Language::$language);
                }
            }

            #[test]
            fn a_clock_and_random_numbers_are_what_the_table_says() {
                if super::kept::wanted(Language::$language) {
                    super::outside::is_as_the_table_says(Language::$language);
                }
            }
        }
    )*};
}

each_language! {
    rust: Rust,
    c: C,
    cpp: Cpp,
    python: Python,
    javascript: JavaScript,
    typescript: TypeScript,
    go: Go,
    zig: Zig,
    assemblyscript: AssemblyScript,
}

fn shared_blocks(language: Language) {
    for block in BLOCKS.into_iter().filter(|_| kept::wanted(language)) {
        let made = match built(language, block, &class(block), &[source(language, block)]) {
            Outcome::Built(made) => made,
            Outcome::Missing(why) => return kept::skip(&why),
        };
        assert!(made.imports.is_empty(), "{block} in {language:?} imports {:?}", made.imports);
        let tests = root().join("examples/blocks").join(format!("{block}.test.toml"));
        // Interpreters bring their own heap.
        run_tests(&tests, made.path.parent().expect("a folder"), Some(256 << 20));
        // The class of the motor retains starts and hours: after a restart it stands, and its alarms are judged anew.
        let meant: &[Kind] = if block == "motor" { &[Kind::NotRestored] } else { &[] };
        projects::fuzz(&made.path, if slow(language) { 50 } else { 500 }, meant);
    }
}

/// A runtime comes along: these take long to build or to start.
fn slow(language: Language) -> bool {
    matches!(language, Language::Python | Language::Go | Language::JavaScript | Language::TypeScript)
}

fn new_projects(language: Language) {
    // Signals, durations, flags, state in records, more than 16 parameters; enums; a result of one value.
    for class in ["analog-alarm", "pco", "ton", "and"].into_iter().filter(|_| kept::wanted(language)) {
        // Half a minute each; TypeScript has JavaScript's generator.
        let slow = matches!(language, Language::Rust | Language::Python | Language::Go | Language::JavaScript);
        if (!slow || class == "analog-alarm") && !first_test(language, class) {
            return;
        }
    }
}

#[test]
fn every_language_gives_the_same_outputs() {
    let mut table = Vec::new();
    for language in Language::ALL.into_iter().filter(|l| kept::wanted(*l)) {
        for block in BLOCKS {
            // What is missing is told by the tests of each language.
            if let Outcome::Built(made) = built(language, block, &class(block), &[source(language, block)]) {
                table.push((language, block, made));
            }
        }
    }
    figures::judge(&table);
}

#[test]
fn a_new_project_of_any_class_builds_and_passes_its_first_test() {
    for class_name in shipped_classes().iter().filter(|_| kept::wanted(Language::C)) {
        if !first_test(Language::C, class_name.rsplit('/').next().expect("a name")) {
            return;
        }
    }
}

/// Whether its tools are there.
fn first_test(language: Language, name: &str) -> bool {
    match built(language, name, &class(name), &[]) {
        Outcome::Built(made) => {
            let folder = made.path.parent().expect("a folder");
            run_tests(&folder.join(format!("{name}.test.toml")), folder, None);
            true
        }
        Outcome::Missing(why) => {
            kept::skip(&why);
            false
        }
    }
}

#[test]
fn in_c_a_stack_that_overflows_is_a_fault() {
    for language in [Language::C, Language::Cpp].into_iter().filter(|l| kept::wanted(*l)) {
        own::a_stack_that_overflows_is_a_fault(language);
    }
}

#[test]
fn the_class_of_a_project_is_what_its_world_exports() {
    if kept::wanted(Language::C) {
        own::the_class_is_what_the_world_exports(Language::C);
    }
}

#[test]
fn a_clock_shows_plant_time_and_random_numbers_are_a_fixed_sequence() {
    let sources = [("block.cpp".to_owned(), include_str!("clock.cpp").to_owned())];
    let wit = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages/wit");
    let own = ClassChoice::Own { folder: wit, class: None };
    let made = match built(Language::Cpp, "clock", &own, &sources) {
        Outcome::Built(made) => made,
        Outcome::Missing(why) => return kept::skip(&why),
    };
    assert!(made.imports.is_empty(), "{:?}", made.imports);
    run_tests(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages/clock.test.toml"),
        made.path.parent().expect("a folder"),
        None,
    );
}
