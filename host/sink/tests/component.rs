//! The host of loggers: what is refused, and what a logger that misbehaves can do (nothing).
#![allow(clippy::unwrap_used, reason = "a test")]

mod loggers;

use latchwork_sink::{COMPONENT, Sink};
use loggers::{config, open, records, target};
use std::net::TcpListener;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A stray logger that does something at record 3.
fn stray(folder: &TempDir, does: &str, more: &str) -> Box<dyn Sink> {
    let table = format!(
        "kind = 'component'\ncomponent = 'stray-logger'\nbudget = '300ms'\nmemory = '8MiB'\n{more}\n[config]\nat = 3\n{does}"
    );
    open(folder.path(), &table)
}

/// What the logger does at record 3, and that it takes all others before and after.
fn fault(does: &str, more: &str) -> String {
    let folder = TempDir::new().unwrap();
    let mut sink = stray(&folder, does, more);
    assert_eq!(sink.write(&records(1..=2)), Ok(2), "{does}");
    let begun = Instant::now();
    let fault = sink.write(&records(3..=4)).expect_err(does);
    assert!(begun.elapsed() < Duration::from_secs(20), "{does}: {:?}", begun.elapsed());
    // The same instance would be no use any more.
    assert_eq!(sink.write(&records(5..=9)), Ok(9), "{does}");
    fault
}

#[test]
fn a_logger_that_fails_is_thrown_away_and_its_fault_told() {
    let table = [
        ("does = 'panic'", "the logger failed in `write`: it trapped: ", "tired of it"),
        ("does = 'hang'", "it computed longer than 300ms; grant it more with `budget`", ""),
        ("does = 'sleep'", "it waited longer than 300ms; grant it more with `budget`", ""),
        ("does = 'recurse'", "it trapped: call stack exhausted", ""),
        ("does = 'eat'", "it wanted more than the 8MiB that `memory` grants", ""),
        ("does = 'exit'", "it ended itself with status ", ""),
        ("does = 'refuse'", "I do not like this one at all", ""),
        ("does = 'lie'", "says that it keeps record 18446744073709551615, but 4 is the last that it was offered", ""),
        ("does = 'lie'\nclaim = 5", "says that it keeps record 5, but 4 is the last that it was offered", ""),
        ("does = 'environment'", "[]", ""),
    ];
    for (does, sentence, said) in table {
        let told = fault(does, "");
        assert!(told.contains(sentence) && told.contains(said), "{does}: {told}");
    }
}

#[test]
fn a_logger_that_claims_less_is_taken_at_its_word() {
    let folder = TempDir::new().unwrap();
    for (claim, kept) in [(3, 3), (0, 0)] {
        let mut sink = stray(&folder, &format!("does = 'lie'\nclaim = {claim}"), "");
        assert_eq!(sink.write(&records(1..=5)), Ok(kept));
    }
}

#[test]
fn open_is_repeated_until_it_succeeds_and_its_sentence_is_told() {
    let folder = TempDir::new().unwrap();
    for (does, sentence) in [
        ("refuse", "the logger does not open: I do not like this one at all"),
        ("panic", "the logger failed in `open`: it trapped: "),
        ("hang", "the logger failed in `open`: it computed longer than 300ms"),
    ] {
        let table = format!(
            "kind = 'component'\ncomponent = 'stray-logger'\nbudget = '300ms'\nconfig = {{ does = '{does}', at = 0 }}"
        );
        let mut sink = open(folder.path(), &table);
        for _ in 0..2 {
            let told = sink.write(&records(1..=1)).unwrap_err();
            assert!(told.starts_with(sentence), "{does}: {told}");
        }
    }
}

#[test]
fn no_file_is_reached_but_those_of_the_granted_directory() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("secret"), "the secret").unwrap();
    std::fs::create_dir(folder.path().join("logs")).unwrap();
    std::fs::write(folder.path().join("logs/own"), "its own").unwrap();
    std::os::unix::fs::symlink("../secret", folder.path().join("logs/link")).unwrap();
    std::os::unix::fs::symlink(folder.path(), folder.path().join("logs/out")).unwrap();
    let read = |path: &str, more: &str| {
        stray(&folder, &format!("does = 'read'\npath = '{path}'"), more).write(&records(3..=3)).unwrap_err()
    };
    let granted = "directory = 'logs'";
    assert_eq!(read("/data/own", granted), "its own");
    for path in ["/etc/passwd", "/data/../secret", "/data/link", "/data/out/secret", "../secret", "/proc/self/environ"]
    {
        let told = read(path, granted);
        assert!(!told.contains("secret") && !told.contains("root:"), "{path}: {told}");
        assert!(["NotFound", "PermissionDenied"].iter().any(|k| told == *k), "{path}: {told}");
    }
    assert_eq!(read("/data/own", ""), "NotFound");
    let absolute = folder.path().join("secret");
    assert_eq!(read(&absolute.display().to_string(), granted), "NotFound");
}

#[test]
fn no_address_is_reached_but_those_granted() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = listener.local_addr().unwrap();
    let connect = |granted: &str| {
        let folder = TempDir::new().unwrap();
        stray(&folder, &format!("does = 'connect'\nto = '{to}'"), granted).write(&records(3..=3))
    };
    assert_eq!(connect(&format!("connect = ['127.0.0.1:1', '{to}']")), Ok(3));
    assert_eq!(connect("connect = ['127.0.0.1:1']"), Err("PermissionDenied".into()));
    let told = connect("").unwrap_err();
    assert!(told == "PermissionDenied" || told == "Unsupported", "{told}");
    for does in ["listen", "datagram", "look-up"] {
        let told = fault(&format!("does = '{does}'"), &format!("connect = ['{to}']"));
        assert!(!told.contains("longer") && !told.contains("trapped"), "{does}: {told}");
    }
}

#[test]
fn a_peer_that_never_answers_is_waited_for_no_longer_than_the_budget() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = listener.local_addr().unwrap();
    let told = fault(&format!("does = 'wait'\nto = '{to}'"), &format!("connect = ['{to}']"));
    assert!(told.contains("it waited longer than 300ms"), "{told}");
}

#[test]
fn a_logger_has_a_bounded_number_of_files_open() {
    let folder = TempDir::new().unwrap();
    let mut sink = stray(&folder, "does = 'files'", "directory = 'logs'");
    let told = sink.write(&records(3..=3)).unwrap_err();
    assert!(told.contains("it wanted more than 256 files, connections and streams at once"), "{told}");
    let files = std::fs::read_dir(folder.path().join("logs")).unwrap().count();
    assert!((100..=256).contains(&files), "{files}");
}

#[test]
fn what_is_no_logger_is_told_before_the_plant_runs() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("text.wasm"), "# not wasm").unwrap();
    let write =
        |name: &str, text: &str| std::fs::write(folder.path().join(name), wat::parse_str(text).unwrap()).unwrap();
    write("module.wasm", "(module)");
    write("nothing.wasm", "(component)");
    write("http.wasm", r#"(component (import "wasi:http/outgoing-handler@0.2.3" (instance)))"#);
    write("own.wasm", r#"(component (import "acme:bus/send@1.0.0" (instance)))"#);
    write("old.wasm", r#"(component (import "wasi:io/streams@0.3.0" (instance)))"#);
    let mut cut = std::fs::read(target().join("components/csv-days.wasm")).unwrap();
    cut.truncate(cut.len() / 2);
    std::fs::write(folder.path().join("cut.wasm"), cut).unwrap();
    for (component, message, help) in [
        ("csv-day", "there is no component `csv-day`; searched in ", "did you mean \"csv-days\"?"),
        ("none.wasm", "there is no file ", "check the path"),
        ("text.wasm", "this is no WebAssembly", "name the file that the build"),
        ("module.wasm", "no component", "wasm32-wasip2"),
        (
            "nothing.wasm",
            "the component exports nothing; expected \"latchwork:journal/sink@0.1.0\"",
            "latchwork:journal/logger",
        ),
        (
            "ton",
            "the component exports \"latchwork:device/ton@0.1.0\"; expected",
            "a function block belongs into [block.NAME]",
        ),
        ("http.wasm", "the logger imports \"wasi:http/outgoing-handler@0.2.3\"; it may import WASI 0.2", "`connect`"),
        ("own.wasm", "the logger imports \"acme:bus/send@1.0.0\"", "without the dependency"),
        ("old.wasm", "the logger imports \"wasi:io/streams@0.3.0\"", "build it for WASI 0.2"),
        ("cut.wasm", "the component is damaged", "build or copy it again"),
    ] {
        let config = config(folder.path(), &format!("kind = 'component'\ncomponent = '{component}'"));
        let problems = (COMPONENT.check)(&config);
        let [problem] = &problems[..] else { panic!("{component}: {problems:?}") };
        assert_eq!(problem.key, "component");
        assert!(problem.message.contains(message), "{component}: {}", problem.message);
        assert!(problem.help.as_ref().unwrap().contains(help), "{component}: {:?}", problem.help);
        assert!((COMPONENT.open)(&config).is_err_and(|e| e.contains(message)));
    }
}

#[test]
fn all_that_is_wrong_with_the_grants_is_told_at_once() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("file"), "").unwrap();
    let table = "kind = 'component'\ncomponent = 'csv-days'\ndirectory = 'file'\nconnect = ['localhost:1', '127.0.0.1']\nconfig = 7";
    let problems = (COMPONENT.check)(&config(folder.path(), table));
    let told: Vec<_> = problems.iter().map(|p| (&*p.key, &*p.message)).collect();
    let file = folder.path().join("file");
    let no_directory = format!("`directory` is {}, which is no directory", file.display());
    assert_eq!(
        told,
        [
            ("connect", "`connect` names \"localhost:1\"; expected an IP address with a port"),
            ("connect", "`connect` names \"127.0.0.1\"; expected an IP address with a port"),
            ("directory", &no_directory),
            ("config", "`config` is integer; expected a table"),
        ]
    );
}
