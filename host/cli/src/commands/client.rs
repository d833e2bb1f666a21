//! What all commands on a running plant share: finding it, asking it, and saying what it answers.

use crate::Exit;
use crate::args::operate::{Change, Reach};
use crate::report;
use anyhow::{Result, anyhow};
use comfy_table::{Table, presets};
use latchwork_api::client::{Client, ClientError};
pub(super) use latchwork_image::plain;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{ErrorKind, IsTerminal};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

/// Folder of the sockets of services.
const SYSTEM: &str = "/run/latchwork";
/// Name of a socket in a folder of its own.
const NAME: &str = "latchwork.sock";

/// A client of the plant that is meant.
pub(super) fn client(reach: &Reach) -> Result<Client> {
    let path = match &reach.socket {
        Some(path) => path.clone(),
        None => the_only_one(served())?,
    };
    Ok(Client::new(&path, origin())?)
}

/// A person at a terminal, or a script.
fn origin() -> &'static str {
    if std::io::stdin().is_terminal() || std::io::stdout().is_terminal() { "cli" } else { "script" }
}

/// Sockets that plants serve, where they usually stand.
fn served() -> Vec<PathBuf> {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(|dir| PathBuf::from(dir).join("latchwork"));
    let mut found: Vec<PathBuf> =
        [Some(PathBuf::from(SYSTEM)), own].into_iter().flatten().flat_map(|f| sockets(&f)).collect();
    found.dedup();
    found
}

/// `FOLDER/*.sock` and `FOLDER/*/latchwork.sock` that somebody serves.
fn sockets(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let named = |path: &PathBuf| path.extension().is_some_and(|e| e == "sock");
    let candidates = entries.flatten().map(|e| e.path()).map(|p| if p.is_dir() { p.join(NAME) } else { p });
    let mut found: Vec<_> = candidates.filter(named).filter(|p| is_served(p)).collect();
    found.sort_unstable();
    found
}

/// A socket that one may not open is served, too, for all one knows.
fn is_served(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|m| m.file_type().is_socket())
        && !matches!(UnixStream::connect(path), Err(e) if e.kind() == ErrorKind::ConnectionRefused)
}

fn the_only_one(mut found: Vec<PathBuf>) -> Result<PathBuf> {
    let system = Path::new(SYSTEM).join(NAME);
    if found.contains(&system) {
        return Ok(system);
    }
    match (found.pop(), found.len()) {
        (Some(path), 0) => Ok(path),
        (None, _) => Err(anyhow!(
            "no plant was found: none serves a socket in {SYSTEM} or $XDG_RUNTIME_DIR/latchwork; name it with --socket PATH or in \
             LATCHWORK_SOCKET, as it was given to `latchwork run PLANT --socket PATH`"
        )),
        (Some(path), _) => {
            found.push(path);
            let list: Vec<_> = found.iter().map(|p| format!("  --socket {}", p.display())).collect();
            Err(anyhow!(
                "several plants run here; say which one is meant, or name it in LATCHWORK_SOCKET:\n{}",
                list.join("\n")
            ))
        }
    }
}

/// What was done.
#[derive(Deserialize)]
struct Done {
    done: Vec<String>,
}

/// Several wishes, one after the other: each answer is said, one that is refused does not keep the others from being tried.
pub(super) fn each(change: &Change, mut wishes: impl Iterator<Item = (&'static str, Value)>) -> Result<Exit> {
    let client = client(&change.reach)?;
    let mut refused = 0;
    wishes.try_for_each(|(path, body)| match client.post::<Value>(path, &with_reason(body, change)) {
        Ok(answer) => say_done(&change.reach, answer),
        Err(error @ ClientError::Refused { .. }) => {
            refused += 1;
            report::error(&error.into());
            Ok(())
        }
        Err(error) => Err(error.into()),
    })?;
    Ok(if refused == 0 { Exit::Fine } else { Exit::Wanting })
}

/// A body with the reason that was given.
pub(super) fn with_reason(mut body: Value, change: &Change) -> Value {
    if let (Some(reason), Some(fields)) = (&change.reason, body.as_object_mut()) {
        fields.insert("reason".into(), json!(reason));
    }
    body
}

/// Says what was done.
pub(super) fn say_done(reach: &Reach, answer: Value) -> Result<()> {
    if reach.json {
        return say_json(&answer);
    }
    let done: Done = serde_json::from_value(answer)?;
    done.done.iter().for_each(|line| report::say(&format!("{}\n", plain(line))));
    Ok(())
}

/// Says an answer as it came.
pub(super) fn say_json(answer: &Value) -> Result<()> {
    report::say(&format!("{}\n", serde_json::to_string_pretty(answer)?));
    Ok(())
}

/// A table in the style of all others.
pub(super) fn table<const N: usize>(header: [&str; N]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    table
}

/// A table without blanks at the ends of its lines.
pub(super) fn lines(table: &Table) -> String {
    table.lines().map(|l| l.trim_end().to_owned() + "\n").collect()
}

/// A value of a tag or record, for a person.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) => plain(text),
        other => other.to_string(),
    }
}

/// A time, ns since 1970, to the second; empty for never.
pub(super) fn time(ns: u64) -> String {
    let text = latchwork_record::rfc3339(ns);
    if ns == 0 { String::new() } else { text.get(..19).unwrap_or(&text).replace('T', " ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn sockets_that_are_served_are_found_and_others_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for dir in ["pumps", "ended", "empty"] {
            std::fs::create_dir(at(dir)).expect("a folder");
        }
        std::fs::write(at("notes.sock"), "no socket").expect("a file");
        let _served: Vec<_> = ["mixer.sock", "pumps/latchwork.sock", "other"]
            .map(|p| UnixListener::bind(at(p)).expect("a socket"))
            .into();
        drop(UnixListener::bind(at("ended/latchwork.sock")).expect("a socket"));
        assert_eq!(sockets(folder.path()), [at("mixer.sock"), at("pumps/latchwork.sock")]);
        assert!(sockets(&at("missing")).is_empty());
    }

    #[test]
    fn one_plant_is_meant_and_of_several_one_must_be_named() {
        let paths = |list: &[&str]| list.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(the_only_one(paths(&["/a.sock"])).expect("one"), Path::new("/a.sock"));
        let usual = "/run/latchwork/latchwork.sock";
        assert_eq!(the_only_one(paths(&["/a.sock", usual])).expect("the usual one"), Path::new(usual));
        let none = the_only_one(Vec::new()).expect_err("none").to_string();
        assert!(none.contains("--socket PATH") && none.contains("LATCHWORK_SOCKET"), "{none}");
        let several = the_only_one(paths(&["/a.sock", "/b.sock"])).expect_err("several").to_string();
        assert!(several.contains("--socket /a.sock") && several.contains("--socket /b.sock"), "{several}");
    }
}
