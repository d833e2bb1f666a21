//! What `new` writes, and what the docs show of it.

use latchwork_author::{ClassChoice, Language, create, shipped_classes};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn a_new_motor_in_each_language() {
    for language in Language::ALL {
        let folder = TempDir::new().expect("a temporary folder");
        let project =
            create(folder.path(), "pump", language, &ClassChoice::Shipped("motor".into())).expect("a project");
        let mut seen = project.files.join("\n") + "\n";
        for file in [language.source(), "block.toml", "pump.test.toml", "README.md", "wit/world.wit"] {
            seen += &format!("\n=== {file}\n{}", read(&project.folder.join(file)));
        }
        insta::assert_snapshot!(format!("motor_{}", language.name()), seen);
        let readme = read(&project.folder.join("README.md")).lines().count();
        assert!(readme <= 10, "{readme} lines");
    }
}

#[test]
fn the_names_of_ports_are_those_of_the_class_in_every_language_and_class() {
    for class in shipped_classes() {
        for language in Language::ALL {
            let folder = TempDir::new().expect("a temporary folder");
            let name = class.rsplit('/').next().expect("a name");
            let project =
                create(folder.path(), name, language, &ClassChoice::Shipped(class.clone())).expect("a project");
            let source = read(&project.folder.join(language.source())).to_lowercase().replace(['_', '@', '"'], "");
            let tests = read(&project.folder.join(format!("{name}.test.toml")));
            let wit = read(&project.folder.join(format!("wit/deps/latchwork-device/{name}.wit")));
            for record in ["record inputs {", "record outputs {"] {
                let Some((_, body)) = wit.split_once(record) else { continue };
                let fields = body.split('}').next().expect("a body").lines().map(str::trim);
                for field in fields.filter(|l| !l.starts_with('/')).filter_map(|l| l.split_once(": ")).map(|(n, _)| n) {
                    let port = field.trim_start_matches('%');
                    assert!(source.contains(&port.replace('-', "")), "{class} in {language:?}: no {port}\n{source}");
                    assert!(tests.contains(port), "{class}: no {port} in\n{tests}");
                }
            }
        }
    }
}

#[test]
fn an_own_class_is_copied_with_what_it_needs_and_without_what_latchwork_brings() {
    let folder = TempDir::new().expect("a temporary folder");
    let wit = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages/wit");
    let own = ClassChoice::Own { folder: wit, class: None };
    let project = create(folder.path(), "clock", Language::C, &own).expect("a project");
    assert_eq!(project.class, "test:clocks/clock@0.1.0");
    let wit: Vec<&String> = project.files.iter().filter(|f| f.starts_with("wit/")).collect();
    let types = "wit/deps/latchwork-block/types.wit";
    assert_eq!(wit, ["wit/deps/clocks/clock.wit", "wit/deps/latchwork-block/log.wit", types, "wit/world.wit"]);
}

#[test]
fn an_own_class_in_each_language() {
    let mut seen = String::new();
    for language in Language::ALL {
        let folder = TempDir::new().expect("a temporary folder");
        let wit = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/languages/outside/wit");
        let own = ClassChoice::Own { folder: wit, class: None };
        let project = create(folder.path(), "ask", language, &own).expect("a project");
        assert_eq!(project.class, "test:outside/asking@0.1.0");
        seen += &format!("=== {}\n{}\n", language.title(), read(&project.folder.join(language.source())));
    }
    insta::assert_snapshot!(seen);
}

#[test]
fn the_page_of_each_language_shows_its_example_and_how_its_tools_are_installed() {
    for language in Language::ALL {
        let page = read(&root().join(format!("docs/blocks-in-{}.md", language.name())));
        let example = root().join("examples/blocks/bounds-check").join(language.name()).join(language.source());
        assert!(page.contains(read(&example).trim_end()), "{language:?}: the page shows another example");
        let folder = TempDir::new().expect("a temporary folder");
        let project = create(folder.path(), "x", language, &ClassChoice::Shipped("motor".into())).expect("a project");
        let readme = read(&project.folder.join("README.md"));
        let tools = readme.lines().find(|l| l.starts_with("- tools")).expect("the line of the tools");
        let commands: Vec<&str> = tools.split('`').skip(1).step_by(2).collect();
        assert!(!commands.is_empty());
        for command in commands {
            assert!(page.lines().any(|l| l == command), "{language:?}: the page has no line\n{command}");
        }
        assert!(page.contains(&format!("--lang {} ", language.name())));
    }
}
