//! `component`: a logger written in any language that becomes a WebAssembly component, exporting `latchwork:journal/sink`.
//!
//! It runs in the sink's own thread, in a sandbox: of the machine it sees the directory and the TCP addresses that the plant
//! file grants, and clocks and random numbers; no other file, no name lookup, no listening. Memory and the time of each call are
//! limited. A logger that fails is thrown away, and a new instance is opened at the next write.
//!
//! ```text
//! Config ──Grants──► Host (engine, compiled code, runtime) ──► Running (store, instance) ◄──batch── Logger: Sink
//!                      ▲ Watch: ends a call that computes beyond its budget
//! ```

mod bindings;
mod config;
mod grants;
mod host;
mod imports;
mod limiter;
mod locate;
mod logger;
mod said;
mod version;
mod watch;
mod world;

pub use version::Version;

use crate::{Claim, Config, Sink, SinkKind};
use latchwork_schema::{Key, Kind, Section};

/// The kind `component`.
pub static COMPONENT: SinkKind = SinkKind { name: "component", keys: &KEYS, check: grants::check, claim, open };

fn claim(config: &Config) -> Option<Claim> {
    Some(Claim::path("directory", &config.folder.join(config.values.text("directory")?)))
}

const SECOND: u64 = 1_000_000_000;
/// Bytes of memory without the key `memory`.
const MEMORY: u64 = 64 << 20;
/// Nanoseconds of a call without the key `budget`.
const BUDGET: u64 = 5 * SECOND;

static KEYS: Section = Section {
    name: "sink (component)",
    doc: "A logger of one's own: a WebAssembly component that exports `latchwork:journal/sink`, written in any language. It runs \
          in a thread and a sandbox of its own and sees nothing but what is granted here.",
    keys: &[
        Key::required(
            "component",
            Kind::Text,
            "Name of the component, a file `NAME.wasm` in the plant's folders; or a path that ends in `.wasm`, relative to this \
             file.",
        ),
        Key::optional(
            "directory",
            Kind::Text,
            "",
            "The only directory that the logger sees, as `/data`, relative to this file; made if it is not there. Without it the \
             logger sees no files.",
        ),
        Key::optional(
            "connect",
            Kind::List(&Kind::Text),
            "",
            "The only addresses that the logger may connect to by TCP, such as `\"192.168.1.9:5140\"`. Names are not looked up.",
        ),
        Key::optional(
            "config",
            Kind::Any,
            "",
            "A table with what the logger's author asks for; the logger gets it as JSON.",
        ),
        Key::optional(
            "memory",
            Kind::Size { min: 1 << 20, max: 2 << 30 },
            "\"64MiB\"",
            "Most memory that the logger may have.",
        ),
        Key::optional(
            "budget",
            Kind::Duration { min: SECOND / 100, max: 600 * SECOND },
            "\"5s\"",
            "Longest time that a batch of records may take. A logger that takes longer is thrown away and opened anew.",
        ),
    ],
};

fn open(config: &Config) -> Result<Box<dyn Sink>, String> {
    sink(grants::Grants::read(config))
}

/// A sink with another component than its table names, and with the same grants.
pub(crate) fn candidate(config: &Config, file: &str, bytes: &[u8]) -> Result<Box<dyn Sink>, String> {
    sink(grants::Grants::of(config, file, bytes))
}

/// Which component a sink's table names.
pub(crate) fn version(config: &Config) -> Option<Version> {
    let (path, bytes) = grants::component(config).ok()?;
    Version::read(&path.to_string_lossy(), &bytes).ok()
}

fn sink(grants: Result<grants::Grants, Vec<crate::Problem>>) -> Result<Box<dyn Sink>, String> {
    let grants = grants.map_err(|problems| {
        let sentences: Vec<String> = problems.into_iter().map(|p| p.message).collect();
        sentences.join("; ")
    })?;
    Ok(Box::new(logger::Logger::new(grants)?))
}
