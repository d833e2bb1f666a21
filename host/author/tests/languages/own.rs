//! Classes of an author's own that are hard to write in a language.

use crate::kept;
use crate::projects::{Outcome, built, engine, run_tests};
use latchwork_author::{ClassChoice, Language};
use latchwork_block::{Limits, Scan};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages")
}

fn class(below: &str) -> ClassChoice {
    ClassChoice::Own { folder: folder().join(below), class: None }
}

/// Every type under every kind of name, then names that languages and glue have taken.
pub(crate) fn build_and_pass_their_first_test(language: Language) {
    for name in ["types", "names"] {
        let made = match built(language, name, &class(&format!("own/{name}")), &[]) {
            Outcome::Built(made) => made,
            Outcome::Missing(why) => return kept::skip(&why),
        };
        assert!(made.imports.is_empty(), "{name} in {language:?} imports {:?}", made.imports);
        let folder = made.path.parent().expect("a folder");
        run_tests(&folder.join(format!("{name}.test.toml")), folder, Some(64 << 20));
    }
}

/// Too deep is a fault, and no data is overwritten before it.
pub(crate) fn a_stack_that_overflows_is_a_fault(language: Language) {
    let text = std::fs::read_to_string(folder().join("own/stack.c")).expect("the source");
    let made = match built(language, "stack", &class("outside/wit"), &[(language.source().to_owned(), text)]) {
        Outcome::Built(made) => made,
        Outcome::Missing(why) => return kept::skip(&why),
    };
    let engine = engine();
    let component = engine.load_file(&made.path).unwrap_or_else(|e| panic!("{}: {e}", made.path.display()));
    let class = component.class(None).expect("one class");
    let template = component.template(&class).expect("a template");
    let mut instance = template.instantiate(&Limits::default()).expect("an instance");
    let mut nest = |deep: bool| {
        let mut cells = [0, u64::from(deep), 0, 0];
        let scan = Scan { now: 0, elapsed: 10_000_000, first: false };
        instance.execute(scan, &[0, 1], 2, &mut cells).map(|_| (cells[2], cells[3]))
    };
    assert_eq!(nest(false).expect("five calls of 2 KiB fit into 16 KiB"), (1 + 2 + 3 + 4 + 5, 0));
    assert!(nest(true).is_err(), "{language:?}: thirteen calls of 2 KiB do not");
}

/// The version of a class stands in its WIT and in the world, and nowhere else.
pub(crate) fn the_class_is_what_the_world_exports(language: Language) {
    let read = |path: &str| std::fs::read_to_string(folder().join(path)).expect("the WIT");
    let wit = read("outside/wit/asking.wit").replace("test:outside@0.1.0", "test:outside@0.2.0");
    let world = "package local:block;\n\nworld block {\n    export test:outside/asking@0.2.0;\n}\n";
    let sources = [("wit/deps/outside/asking.wit".to_owned(), wit), ("wit/world.wit".to_owned(), world.to_owned())];
    match built(language, "newer", &class("outside/wit"), &sources) {
        Outcome::Built(made) => {
            let component = engine().load_file(&made.path).expect("a component");
            assert_eq!(component.class(None).expect("one class").name, "test:outside/asking@0.2.0");
        }
        Outcome::Missing(why) => kept::skip(&why),
    }
}

/// What goes in, what is made, compared and kept has the right bits; in JavaScript, as exactly as its numbers are.
pub(crate) fn whole_numbers_are_right_at_their_edges(language: Language) {
    let edges = folder().join("edges");
    let source = match language {
        Language::Rust => "lib.rs",
        Language::AssemblyScript => "assemblyscript.ts",
        // One source for both dialects.
        Language::Cpp => "block.c",
        other => other.source(),
    };
    let text = std::fs::read_to_string(edges.join(source)).expect("the source");
    let made = match built(language, "edges", &class("edges/wit"), &[(language.source().to_owned(), text)]) {
        Outcome::Built(made) => made,
        Outcome::Missing(why) => return kept::skip(&why),
    };
    let within_53_bits = matches!(language, Language::JavaScript | Language::TypeScript);
    let may_be_too_much = within_53_bits || language == Language::Python;
    let files = [("edges", true), ("exact", !within_53_bits), ("too-much", may_be_too_much)];
    for (file, _) in files.into_iter().filter(|(_, meant)| *meant) {
        let file = edges.join(format!("{file}.test.toml"));
        run_tests(&file, made.path.parent().expect("a folder"), Some(64 << 20));
    }
}
