//! A device class as a component exports it: its ports with types, its commands and alarms, their documentation.

use latchwork_image::Type;
use std::collections::{HashMap, HashSet};

/// A device class: an exported interface that follows the pattern of the contract. The default one has no ports.
#[derive(Clone, Debug, Default)]
pub struct Class {
    /// Full name with version, `latchwork:device/ton@0.1.0`.
    pub name: String,
    /// What the class is, from the component's documentation.
    pub doc: Option<String>,
    /// Fields of `inputs`, nested ones flattened.
    pub inputs: Vec<Port>,
    /// Fields of `outputs`.
    pub outputs: Vec<Port>,
    /// Fields of `settings`. A signal here is two ports, `NAME.value` and `NAME.quality`: settings come from no tag.
    pub settings: Vec<Port>,
    /// Fields of `retained`, signals as two ports each.
    pub retained: Vec<Port>,
    /// Names of the commands, by bit.
    pub commands: Vec<String>,
    /// Names of the alarms, by bit.
    pub alarms: Vec<String>,
    pub(crate) flag_docs: HashMap<String, String>,
}

/// One port: a field of `inputs`, `outputs`, `settings` or `retained`.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Name; `a.b` for the field `b` of the record `a`.
    pub path: String,
    /// Type of the value. It says how the port's bits stand in a cell.
    pub ty: Type,
    /// The port carries its own quality: its value's cell is followed by a quality cell. Only inputs and outputs.
    pub signal: bool,
    /// Documentation.
    pub doc: Option<String>,
}

impl Class {
    /// Documentation of one command or alarm; `group` is `commands` or `alarms`.
    pub fn flag_doc(&self, group: &str, name: &str) -> Option<String> {
        self.flag_docs.get(&format!("{group}.{name}")).cloned()
    }

    /// This version with what another one has besides: its ports, commands and alarms stand behind those of this one. Where both
    /// have a name, this one's type counts. Retained state is of no version but its own: it stays as it is here.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut union = self.clone();
        for (ports, more) in [
            (&mut union.inputs, &other.inputs),
            (&mut union.outputs, &other.outputs),
            (&mut union.settings, &other.settings),
        ] {
            let known: HashSet<String> = ports.iter().map(|p| p.path.clone()).collect();
            ports.extend(more.iter().filter(|p| !known.contains(&p.path)).cloned());
        }
        for (names, more) in [(&mut union.commands, &other.commands), (&mut union.alarms, &other.alarms)] {
            let known: HashSet<String> = names.iter().cloned().collect();
            names.extend(more.iter().filter(|n| !known.contains(*n)).cloned());
        }
        for (name, doc) in &other.flag_docs {
            union.flag_docs.entry(name.clone()).or_insert_with(|| doc.clone());
        }
        union
    }

    /// Argument cells of `execute`: inputs with their qualities, then the commands word.
    pub fn argument_cells(&self) -> usize {
        cells(&self.inputs) + usize::from(!self.commands.is_empty())
    }

    /// Cells that `execute` writes: outputs with their qualities, then the alarms word.
    pub fn output_cells(&self) -> usize {
        cells(&self.outputs) + usize::from(!self.alarms.is_empty())
    }
}

fn cells(ports: &[Port]) -> usize {
    ports.iter().map(|p| 1 + usize::from(p.signal)).sum()
}
