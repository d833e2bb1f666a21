//! What came out: size, memory, imports, classes; the limits a shipped block keeps; the table.

use super::find::Crate;
use anyhow::{Result, bail};
use std::fmt::Write;
use wasmparser::{Parser, Payload};
use wit_component::DecodedWasm;
use wit_parser::{Resolve, WorldItem, WorldKey};

/// Largest component that is shipped, bytes.
const MAX_SIZE: usize = 32 * 1024;
/// Largest logger that is shipped, bytes: it brings files, JSON and dates along.
const MAX_LOGGER: usize = 512 * 1024;
/// Largest memory a shipped component starts with, pages of 64 KiB.
const MAX_PAGES: u64 = 2;
/// The only interface a block may call.
const LOG: &str = "latchwork:block/log@";
/// The only interface of a logger.
const SINK: &str = "latchwork:journal/sink@";

/// What is known of one component.
pub(super) struct Facts {
    name: String,
    /// Interfaces with an `execute`; a logger's `sink`.
    classes: Vec<String>,
    size: usize,
    pages: u64,
    /// Interfaces with functions; one that only carries types asks nothing of a host.
    imports: Vec<String>,
}

/// Reads a component.
pub(super) fn facts(krate: &Crate, bytes: &[u8]) -> Result<Facts> {
    let DecodedWasm::Component(resolve, world) = wit_component::decode(bytes)? else { bail!("it is no component") };
    let mut pages = 0;
    for payload in Parser::new(0).parse_all(bytes) {
        if let Payload::MemorySection(memories) = payload? {
            for memory in memories {
                pages += memory?.initial;
            }
        }
    }
    let world = &resolve.worlds[world];
    let imports = world.imports.iter().filter(|(_, item)| !only_types(&resolve, item));
    let exports = world.exports.iter().filter(|(_, item)| is_class(&resolve, item));
    let name = |(key, _): (&WorldKey, &WorldItem)| resolve.name_world_key(key);
    Ok(Facts {
        name: krate.name.clone(),
        classes: exports.map(name).collect(),
        size: bytes.len(),
        pages,
        imports: imports.map(name).collect(),
    })
}

/// All of WASI in a word.
fn short(imports: &[String]) -> Vec<String> {
    let mut short: Vec<String> = imports.iter().filter(|i| !i.starts_with("wasi:")).cloned().collect();
    if short.len() < imports.len() {
        short.push("WASI".into());
    }
    short
}

fn only_types(resolve: &Resolve, item: &WorldItem) -> bool {
    match item {
        WorldItem::Interface { id, .. } => resolve.interfaces[*id].functions.is_empty(),
        WorldItem::Function(_) => false,
        WorldItem::Type { .. } => true,
    }
}

fn is_class(resolve: &Resolve, item: &WorldItem) -> bool {
    let WorldItem::Interface { id, .. } = item else { return false };
    let has = |function| resolve.interfaces[*id].functions.contains_key(function);
    has("execute") || resolve.id_of(*id).is_some_and(|name| name.starts_with(SINK))
}

/// What is wrong with a component, each with the way out.
pub(super) fn faults(krate: &Crate, facts: &Facts) -> Vec<String> {
    let mut faults = Vec::new();
    let name = &facts.name;
    if krate.logger {
        return logger_faults(krate, facts);
    }
    for import in facts.imports.iter().filter(|i| !i.starts_with(LOG)) {
        faults.push(format!(
            "{name} imports `{import}`; a block may import nothing but latchwork:block/log: \
             look for a dependency that wants a clock, files or random numbers"
        ));
    }
    if facts.classes.is_empty() {
        faults.push(format!(
            "{name} exports no device class; put #[latchwork_sdk::block(\"…\")] on the impl of a struct"
        ));
    }
    if krate.shipped && facts.size > MAX_SIZE {
        faults.push(format!("{name} has {} bytes; a shipped block keeps below {MAX_SIZE}", facts.size));
    }
    if krate.shipped && facts.pages > MAX_PAGES {
        faults
            .push(format!("{name} starts with {} pages of memory; a shipped block keeps to {MAX_PAGES}", facts.pages));
    }
    faults
}

/// Which of WASI a logger uses is told when a plant loads it.
fn logger_faults(krate: &Crate, facts: &Facts) -> Vec<String> {
    let mut faults = Vec::new();
    let name = &facts.name;
    if !facts.classes.iter().any(|class| class.starts_with(SINK)) {
        faults
            .push(format!("{name} exports no latchwork:journal/sink; build it for the world latchwork:journal/logger"));
    }
    if krate.shipped && facts.size > MAX_LOGGER {
        faults.push(format!("{name} has {} bytes; a shipped logger keeps below {MAX_LOGGER}", facts.size));
    }
    faults
}

/// One line for each component.
pub(super) fn table(facts: &[Facts]) -> String {
    let none = |list: &[String]| if list.is_empty() { "–".to_owned() } else { list.join(", ") };
    let widest = |of: fn(&Facts) -> usize, title: &str| facts.iter().map(of).chain([title.len()]).max().unwrap_or(0);
    let name = widest(|f| f.name.len(), "component");
    let class = widest(|f| f.classes.join(", ").len(), "class");
    let mut out = format!("{:name$}  {:class$}  {:>7}  {:>6}  imports\n", "component", "class", "bytes", "memory");
    for f in facts {
        let memory = format!("{} KiB", f.pages * 64);
        // A String takes whatever is written.
        let _ = writeln!(
            out,
            "{:name$}  {:class$}  {:>7}  {memory:>6}  {}",
            f.name,
            none(&f.classes),
            f.size,
            none(&short(&f.imports))
        );
    }
    out
}
