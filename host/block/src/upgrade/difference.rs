//! What differs between two versions of a class.

use crate::Class;
use serde::{Deserialize, Serialize};

/// A part of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// Input ports.
    Inputs,
    /// Output ports.
    Outputs,
    /// Settings.
    Settings,
    /// Retained state.
    Retained,
    /// Commands.
    Commands,
    /// Alarms.
    Alarms,
}

/// What happens to one port, command or alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "change")]
pub enum Change {
    /// The new version has it, the old one had not.
    Added {
        /// Its type.
        #[serde(rename = "type")]
        ty: String,
    },
    /// The new version does not have it any more.
    Gone {
        /// Its type.
        #[serde(rename = "type")]
        ty: String,
    },
    /// Its type is another one, or it is a signal now, or no longer.
    Type {
        /// Before.
        from: String,
        /// After.
        to: String,
    },
}

/// One difference.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PortChange {
    /// Where.
    pub part: Part,
    /// Path of the port, name of the command or alarm.
    pub name: String,
    /// What.
    #[serde(flatten)]
    pub change: Change,
}

/// Everything that differs; the order of ports does not count.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Difference {
    /// Added, gone and changed ports, in the order of the parts and of the classes.
    pub ports: Vec<PortChange>,
}

impl Difference {
    /// Compares two versions of a class.
    pub fn new(old: &Class, new: &Class) -> Self {
        let _ = (old, new);
        todo!()
    }
}
