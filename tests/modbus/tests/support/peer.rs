//! The foreign server as a process that can be asked, and killed.

use super::python::python;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};

/// A running server.
pub(crate) struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    /// Starts it and waits until it serves.
    pub(crate) fn start(arguments: &[String]) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("server.py");
        let mut command = python().run(&script);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("python starts");
        let (input, output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut peer = Self { child, input, output };
        assert_eq!(peer.hear(), json!({"ready": true}));
        peer
    }

    fn hear(&mut self) -> Value {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("the server talks");
        serde_json::from_str(&line).unwrap_or_else(|e| panic!("the server said {line:?} ({e}); its errors stand above"))
    }

    /// One command, one answer.
    pub(crate) fn ask(&mut self, command: &Value) -> Value {
        writeln!(self.input, "{command}").expect("the server listens");
        self.hear()
    }

    /// Entries of a table.
    pub(crate) fn read(&mut self, table: &str, address: u16, count: u16) -> Value {
        self.ask(&json!({"read": table, "address": address, "count": count}))["values"].clone()
    }

    /// Holding registers as pymodbus understands them.
    pub(crate) fn decode(&mut self, kind: &str, order: &str, address: u16) -> Value {
        self.ask(&json!({"decode": kind, "order": order, "address": address}))["value"].clone()
    }

    /// SIGKILL: no farewell.
    pub(crate) fn kill(mut self) {
        self.child.kill().expect("it is ours to kill");
        self.child.wait().expect("it is gone");
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
