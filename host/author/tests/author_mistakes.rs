//! Every mistake an author can make, as it is told.

use latchwork_author::{AuthorError, ClassChoice, Language, build, create};
use std::path::Path;
use tempfile::TempDir;

fn shipped(name: &str) -> ClassChoice {
    ClassChoice::Shipped(name.into())
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// The message without this run's folder.
fn told(folder: &Path, error: &AuthorError) -> String {
    let real = std::fs::canonicalize(folder).expect("the folder");
    let text = error.to_string().replace(&real.display().to_string(), "DIR");
    text.replace(&folder.display().to_string(), "DIR")
}

#[test]
fn mistakes_of_new_are_told_with_the_way_out() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("there")).expect("a folder");
    let mut seen = String::new();
    for (name, class) in [
        ("Pump", "motor"),
        ("there", "motor"),
        ("pump", "motr"),
        ("pump", "latchwork:device/bound-check"),
        ("pump", "latchwork:device/motor@9.0.0"),
        ("pump", "acme:things/reactor"),
        ("pump", ""),
    ] {
        let error = create(folder.path(), name, Language::C, &shipped(class)).expect_err(class);
        seen += &format!("new {name} --class {class:?}\n  {}\n\n", told(folder.path(), &error));
    }
    for lang in ["c++", "pyhton", "fortran", ""] {
        let error = Language::parse(lang).expect_err(lang);
        seen += &format!("new pump --lang {lang:?}\n  {error}\n\n");
    }
    insta::assert_snapshot!(seen);
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("the folder").collect();
    assert_eq!(left.len(), 1, "a refused project leaves nothing: {left:?}");
}

/// An interface `reactor` with a body.
fn reactor(body: &str) -> String {
    format!(
        "package acme:things@1.0.0;\n\ninterface reactor {{\n    use latchwork:block/types@0.1.0.{{scan}};\n{body}}}\n"
    )
}

#[test]
fn mistakes_of_ones_own_class_name_the_place() {
    let execute = "    execute: func(scan: scan, inputs: inputs) -> outputs;\n";
    let ports = |input: &str| {
        reactor(&format!("    record inputs {{ {input} }}\n    record outputs {{ on: bool }}\n{execute}"))
    };
    let wits = [
        ("a syntax error", "package acme:things@1.0.0;\n\ninterface reactor {\n    record inputs { level f64 }\n}\n".to_owned()),
        ("an unknown type", ports("level: f46")),
        ("a string", ports("name: string")),
        ("a list in a record", reactor(&format!("    record inner {{ samples: list<f64> }}\n    record inputs {{ filter: inner }}\n    record outputs {{ on: bool }}\n{execute}"))),
        ("an option", ports("level: option<f64>")),
        ("no scan", "package acme:things@1.0.0;\n\ninterface reactor {\n    record scan { now: u64 }\n    execute: func(scan: scan);\n}\n".to_owned()),
        ("settings alone", reactor("    record settings { limit: f64 }\n    execute: func(scan: scan);\n")),
        ("another result", reactor("    record outputs { on: bool }\n    execute: func(scan: scan) -> bool;\n")),
        ("another order", reactor("    record inputs { a: bool }\n    flags commands { go }\n    execute: func(scan: scan, commands: commands, inputs: inputs);\n")),
        ("another function", reactor("    execute: func(scan: scan);\n    stop: func();\n")),
        ("commands as a record", reactor("    record commands { go: bool }\n    execute: func(scan: scan, commands: commands);\n")),
        ("a record without fields", ports("").replace("record inputs {  }", "record inputs {}")),
        ("flags without a flag", reactor("    flags alarms {}\n    execute: func(scan: scan) -> alarms;\n")),
        ("an enum without a case", reactor(&format!("    enum mode {{}}\n    record inputs {{ mode: mode }}\n    record outputs {{ on: bool }}\n{execute}"))),
        ("two types of one name", format!("{}interface common {{\n    enum mode {{ off, on }}\n    record limits {{ mode: mode }}\n}}\n", reactor(&format!("    use common.{{limits}};\n    enum mode {{ slow, fast }}\n    record inputs {{ mode: mode, limits: limits }}\n    record outputs {{ on: bool }}\n{execute}")))),
        ("two ports of one name", ports("level-1: f64, level1: f64")),
        ("no class", "package acme:things@1.0.0;\n\ninterface reactor { record inputs { on: bool } }\n".to_owned()),
        ("two classes", reactor("    execute: func(scan: scan);\n") + "interface other {\n    use latchwork:block/types@0.1.0.{scan};\n    execute: func(scan: scan);\n}\n"),
    ];
    let mut seen = String::new();
    for (what, wit) in wits {
        let folder = folder();
        let dir = folder.path().join("wit");
        std::fs::create_dir(&dir).expect("a folder");
        std::fs::write(dir.join("reactor.wit"), &wit).expect("the WIT");
        let own = ClassChoice::Own { folder: dir, class: None };
        let error = create(folder.path(), "pump", Language::C, &own).expect_err(what);
        seen += &format!("# {what}\n{}\n\n", told(folder.path(), &error));
        assert!(!folder.path().join("pump").exists(), "{what}: a refused project leaves nothing");
    }
    let folder = folder();
    for (what, place) in [("no such folder", "wit"), ("a file", "file")] {
        std::fs::write(folder.path().join("file"), "").expect("a file");
        let own = ClassChoice::Own { folder: folder.path().join(place), class: None };
        let error = create(folder.path(), "pump", Language::C, &own).expect_err(what);
        seen += &format!("# {what}\n{}\n\n", told(folder.path(), &error));
    }
    insta::assert_snapshot!(seen);
}

#[test]
fn names_that_a_language_has_no_way_to_write_are_refused_before_anything_is_written() {
    let with = |types: &str, input: &str| {
        let ports = format!("    record inputs {{ a: {input} }}\n    record outputs {{ on: bool }}\n");
        reactor(&format!("{types}{ports}    execute: func(scan: scan, inputs: inputs) -> outputs;\n"))
    };
    let two = with("    enum pump { off, mode-a }\n    enum pump-mode { a, b }\n", "pump, b: pump-mode");
    let hidden = with("    enum pump { mode, off }\n    enum pump-mode { a }\n", "pump, b: pump-mode");
    let renamed = "interface common {\n    enum self { this, that }\n}\n";
    let renamed = with("    use common.{self as its-own};\n", "its-own") + renamed;
    let mut seen = String::new();
    let mut attempt = |wit: &str, languages: &[Language]| {
        for language in Language::ALL {
            let folder = folder();
            let dir = folder.path().join("wit");
            std::fs::create_dir(&dir).expect("a folder");
            std::fs::write(dir.join("reactor.wit"), wit).expect("the WIT");
            let own = ClassChoice::Own { folder: dir, class: None };
            let made = create(folder.path(), "pump", language, &own);
            assert_eq!(made.is_err(), languages.contains(&language), "{language:?}: {made:?}");
            assert_eq!(folder.path().join("pump").exists(), made.is_ok());
            seen += &made.err().map_or_else(String::new, |error| format!("{error}\n\n"));
        }
    };
    attempt(&two, &[Language::C, Language::Cpp, Language::Go]);
    attempt(&hidden, &[Language::Go]);
    attempt(&renamed, &[Language::Rust]);
    attempt(&with("", "bool, gen: bool"), &[Language::Rust]);
    attempt(&with("    enum %flag { up, down }\n", "%flag"), &[Language::Python]);
    attempt(&with("    enum %enum { one, two }\n", "%enum"), &[Language::Python]);
    insta::assert_snapshot!(seen);
}

#[test]
fn mistakes_of_build_are_told_with_the_way_out() {
    let mut seen = String::new();
    let mut attempt = |what: &str, change: &dyn Fn(&Path)| {
        let folder = folder();
        let project = create(folder.path(), "pump", Language::Zig, &shipped("motor")).expect("a project");
        change(&project.folder);
        let error = build(&project.folder, &mut |_| {}).expect_err(what);
        seen += &format!("# {what}\n{}\n\n", told(folder.path(), &error));
    };
    let edit = |folder: &Path, from: &str, to: &str| {
        let path = folder.join("block.toml");
        let text = std::fs::read_to_string(&path).expect("the manifest");
        assert!(text.contains(from), "{text}");
        std::fs::write(path, text.replace(from, to)).expect("the manifest");
    };
    attempt("no project", &|f| std::fs::remove_file(f.join("block.toml")).expect("it is there"));
    attempt("no TOML", &|f| edit(f, "lang = ", "lang "));
    attempt("an unknown key", &|f| edit(f, "[build]", "[build]\nflags = []"));
    attempt("another language", &|f| edit(f, "lang = \"zig\"", "lang = \"zag\""));
    attempt("another class", &|f| edit(f, "[build]", "class = \"latchwork:device/engine@0.1.0\"\n\n[build]"));
    let world = |body: &'static str| {
        move |f: &Path| {
            let text = format!("package local:block;\n\nworld block {{\n{body}}}\n");
            std::fs::write(f.join("wit/world.wit"), text).expect("it is written");
        }
    };
    attempt("a world without a class", &world(""));
    attempt("another version in the world", &world("    export latchwork:device/motor@0.2.0;\n"));
    attempt("an output that would be the source", &|f| {
        edit(f, "output = \"build/pump.wasm\"", "output = \"block.zig\"")
    });
    attempt("an output outside", &|f| edit(f, "output = \"build/pump.wasm\"", "output = \"../pump.wasm\""));
    attempt("an output anywhere", &|f| edit(f, "output = \"build/pump.wasm\"", "output = \"/pump.wasm\""));
    attempt("no WIT", &|f| std::fs::remove_dir_all(f.join("wit")).expect("it is there"));
    attempt("broken WIT", &|f| std::fs::write(f.join("wit/world.wit"), "world").expect("it is written"));
    let command = "    \"zig\",\n    \"build-exe\",";
    attempt("a missing tool", &|f| edit(f, command, "    \"no-such-compiler\","));
    attempt("a tool that fails", &|f| edit(f, command, "    \"false\","));
    attempt("a tool of npm that fails", &|f| {
        edit(f, command, "    \"false\",");
        std::fs::write(f.join("package.json"), "{}").expect("it is written");
    });
    attempt("a tool that writes nothing", &|f| edit(f, command, "    \"true\","));
    attempt("a module of something else", &|f| {
        let empty = "\\\\000asm\\\\001\\\\000\\\\000\\\\000";
        edit(f, command, &format!("    \"sh\", \"-c\", \"printf '{empty}' > build/pump.wasm\","));
    });
    attempt("no module", &|f| edit(f, command, "    \"sh\", \"-c\", \"echo text > build/pump.wasm\","));
    insta::assert_snapshot!(seen);
}

#[test]
fn a_refused_output_removes_nothing() {
    let folder = folder();
    let project = create(folder.path(), "pump", Language::Zig, &shipped("motor")).expect("a project");
    let manifest = project.folder.join("block.toml");
    let text = std::fs::read_to_string(&manifest).expect("the manifest");
    std::fs::write(&manifest, text.replace("output = \"build/pump.wasm\"", "output = \"block.zig\""))
        .expect("the manifest");
    build(&project.folder, &mut |_| {}).expect_err("the source is no output");
    assert!(project.folder.join("block.zig").is_file());
}

#[test]
fn packages_are_installed_when_they_are_not_there_whole_or_the_list_is_newer() {
    let folder = folder();
    let project = create(folder.path(), "pump", Language::AssemblyScript, &shipped("motor")).expect("a project");
    let manifest = project.folder.join("block.toml");
    let text = std::fs::read_to_string(&manifest).expect("the manifest");
    let makes = "node_modules/.package-lock.json";
    let (head, _) = text.split_once("[build]").expect("the step");
    let step = format!(
        "[build]\ncommand = [\"true\"]\noutput = \"build/pump.wasm\"\nprepare = {{ command = [\"sh\", \"-c\", \"mkdir -p node_modules && touch {makes}\"], makes = {makes:?} }}\n"
    );
    assert!(text.contains(&format!("makes = {makes:?}")), "{text}");
    std::fs::write(&manifest, format!("{head}{step}")).expect("the manifest");
    let prepared = || {
        let mut said = Vec::new();
        build(&project.folder, &mut |command| said.push(command.to_owned())).expect_err("it writes nothing");
        said.len() == 2
    };
    std::fs::create_dir(project.folder.join("node_modules")).expect("what a broken installation leaves");
    assert!(prepared(), "the installation was broken off");
    assert!(!prepared(), "all is there");
    let newer = std::time::SystemTime::now() + std::time::Duration::from_secs(5);
    let set = |file: &str, time| {
        let file = std::fs::File::open(project.folder.join(file)).expect("a file");
        file.set_modified(time).expect("its time");
    };
    set("package.json", newer);
    assert!(prepared(), "the list is newer");
    set("package.json", std::time::SystemTime::UNIX_EPOCH);
    assert!(!prepared(), "the list is older");
}
