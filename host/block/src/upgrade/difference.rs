//! What differs between two versions of a class.

use crate::{Class, Port};
use latchwork_image::Type;
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};

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
        let mut ports = Vec::new();
        for (part, old, new) in [
            (Part::Inputs, &old.inputs, &new.inputs),
            (Part::Outputs, &old.outputs, &new.outputs),
            (Part::Settings, &old.settings, &new.settings),
            (Part::Retained, &old.retained, &new.retained),
        ] {
            compare(part, &typed(old), &typed(new), &mut ports);
        }
        for (part, old, new) in
            [(Part::Commands, &old.commands, &new.commands), (Part::Alarms, &old.alarms, &new.alarms)]
        {
            compare(part, &flags(old), &flags(new), &mut ports);
        }
        Self { ports }
    }

    /// The versions have the same ports.
    pub fn is_empty(&self) -> bool {
        self.ports.is_empty()
    }

    /// What differs in one part.
    pub fn of(&self, part: Part) -> impl Iterator<Item = &PortChange> {
        self.ports.iter().filter(move |change| change.part == part)
    }
}

/// Names with types: first what the new version has, then what is gone.
fn compare(part: Part, old: &[(&str, String)], new: &[(&str, String)], to: &mut Vec<PortChange>) {
    let before: HashMap<&str, &String> = old.iter().map(|(name, ty)| (*name, ty)).collect();
    let after: HashSet<&str> = new.iter().map(|(name, _)| *name).collect();
    let mut add = |name: &str, change| to.push(PortChange { part, name: name.into(), change });
    for (name, ty) in new {
        match before.get(name) {
            None => add(name, Change::Added { ty: ty.clone() }),
            Some(from) if *from != ty => add(name, Change::Type { from: (*from).clone(), to: ty.clone() }),
            Some(_) => {}
        }
    }
    for (name, ty) in old.iter().filter(|(name, _)| !after.contains(name)) {
        add(name, Change::Gone { ty: ty.clone() });
    }
}

/// A signal has another type than a plain port.
fn typed(ports: &[Port]) -> Vec<(&str, String)> {
    let ty = |p: &Port| if p.signal { format!("{}-signal", signal(&p.ty)) } else { p.ty.to_string() };
    ports.iter().map(|p| (p.path.as_str(), ty(p))).collect()
}

/// As the record is called in `latchwork:block/types`.
fn signal(ty: &Type) -> &'static str {
    match ty {
        Type::F64 => "real",
        other => other.kind(),
    }
}

fn flags(names: &[String]) -> Vec<(&str, String)> {
    names.iter().map(|name| (name.as_str(), Type::Bool.to_string())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn class(inputs: &[(&str, Type, bool)], alarms: &[&str]) -> Class {
        let port = |(path, ty, signal): &(&str, Type, bool)| Port {
            path: path.to_string(),
            ty: ty.clone(),
            signal: *signal,
            doc: None,
        };
        Class {
            name: "acme:line/thing@1.0.0".into(),
            doc: None,
            inputs: inputs.iter().map(port).collect(),
            outputs: Vec::new(),
            settings: Vec::new(),
            retained: Vec::new(),
            commands: Vec::new(),
            alarms: alarms.iter().map(|a| a.to_string()).collect(),
            flag_docs: HashMap::new(),
        }
    }

    #[test]
    fn added_gone_and_changed_ports_are_told_and_their_order_does_not_count() {
        let old = class(
            &[("a", Type::Bool, false), ("b", Type::F64, false), ("c", Type::U8, false), ("gone", Type::U8, false)],
            &["high", "low"],
        );
        let new = class(
            &[("c", Type::U8, false), ("b", Type::F64, true), ("new", Type::Duration, false), ("a", Type::Bool, false)],
            &["low", "stuck"],
        );
        let change = |part, name: &str, change| PortChange { part, name: name.into(), change };
        assert_eq!(
            Difference::new(&old, &new).ports,
            [
                change(Part::Inputs, "b", Change::Type { from: "f64".into(), to: "real-signal".into() }),
                change(Part::Inputs, "new", Change::Added { ty: "duration".into() }),
                change(Part::Inputs, "gone", Change::Gone { ty: "u8".into() }),
                change(Part::Alarms, "stuck", Change::Added { ty: "bool".into() }),
                change(Part::Alarms, "high", Change::Gone { ty: "bool".into() }),
            ]
        );
        assert_eq!(Difference::new(&old, &new).of(Part::Alarms).count(), 2);
        assert!(Difference::new(&old, &old).is_empty());
    }
}
