//! Every language, from `new` over its own tool to a component that passes its tests. What is built is kept in the build folder
//! by the hash of its sources and of its tools' versions; a language whose tools are not here is passed over.
//!
//! `LATCHWORK_LANGUAGES=c,zig` restricts the tests to some; `LATCHWORK_BLESS=1` writes the table of docs/languages.md.

mod figures;
mod kept;
mod projects;

use latchwork_author::{ClassChoice, Language, shipped_classes};
use projects::{Outcome, built, root, run_tests};
use std::path::Path;

/// The blocks that exist in every language.
const BLOCKS: [&str; 2] = ["bounds-check", "motor"];

fn class(name: &str) -> ClassChoice {
    ClassChoice::Shipped(name.into())
}

/// The languages of this run.
fn languages() -> Vec<Language> {
    Language::ALL.into_iter().filter(|l| kept::wanted(*l)).collect()
}

/// The source of an example's block, below the project's folder.
fn source(language: Language, block: &str) -> (String, String) {
    let path = root().join("examples/blocks").join(block).join(language.name()).join(language.source());
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    (language.source().to_owned(), text)
}

#[test]
fn the_same_blocks_in_every_language_pass_the_same_tests() {
    let mut table = Vec::new();
    for language in languages() {
        for block in BLOCKS {
            let sources = [source(language, block)];
            let made = match built(language, block, &class(block), &sources) {
                Outcome::Built(made) => made,
                Outcome::Missing(why) => {
                    kept::skip(&why);
                    continue;
                }
            };
            assert!(made.imports.is_empty(), "{block} in {language:?} imports {:?}", made.imports);
            let tests = root().join("examples/blocks").join(format!("{block}.test.toml"));
            run_tests(&tests, made.path.parent().expect("a folder"));
            table.push((language, block, made));
        }
    }
    figures::judge(&table);
}

#[test]
fn a_new_project_of_any_class_builds_and_passes_its_first_test() {
    for class_name in shipped_classes() {
        let name = class_name.rsplit('/').next().expect("a name");
        first_test(Language::C, name);
    }
}

#[test]
fn a_new_project_in_any_language_builds_and_passes_its_first_test() {
    // Signals, durations, flags, state in records, more than 16 parameters; enums; a result of one value.
    for class in ["analog-alarm", "pco", "ton", "and"] {
        for language in languages() {
            // These take half a minute and share one generator with others: one class each.
            let slow = matches!(language, Language::Rust | Language::Python | Language::Go | Language::JavaScript);
            if !slow || class == "analog-alarm" {
                first_test(language, class);
            }
        }
    }
}

fn first_test(language: Language, name: &str) {
    match built(language, name, &class(name), &[]) {
        Outcome::Built(made) => {
            let folder = made.path.parent().expect("a folder");
            run_tests(&folder.join(format!("{name}.test.toml")), folder);
        }
        Outcome::Missing(why) => kept::skip(&why),
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
    );
}
