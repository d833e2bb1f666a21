//! The shape of a group of ports: records down to scalars, and the path, type and cell of every scalar.
//!
//! One order rules everything: the leaves of a shape, depth first. It is the order of the canonical ABI's flat values, of
//! the ports of a class and of the cells that hold them.

use crate::Port;
use latchwork_image::Type;
use std::collections::HashMap;

/// A scalar, or a record of shapes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// One flat value.
    Leaf(Type),
    /// Fields in order, never empty.
    Record(Vec<(String, Shape)>),
}

impl Shape {
    /// Number of leaves.
    pub(crate) fn leaves(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Record(fields) => fields.iter().map(|(_, s)| s.leaves()).sum(),
        }
    }

    /// Calls `visit` with every leaf in order.
    pub(crate) fn each_leaf<'a>(&'a self, visit: &mut impl FnMut(&'a Type)) {
        match self {
            Self::Leaf(ty) => visit(ty),
            Self::Record(fields) => fields.iter().for_each(|(_, s)| s.each_leaf(visit)),
        }
    }

    /// The fields of a record; a leaf has none.
    pub(crate) fn fields(&self) -> &[(String, Shape)] {
        match self {
            Self::Leaf(_) => &[],
            Self::Record(fields) => fields,
        }
    }

    /// `latchwork:block/types.duration`, by its structure: component types are structural, and a tool may rename them.
    fn is_duration(&self) -> bool {
        matches!(self.fields(), [(name, Shape::Leaf(Type::U64))] if name == "ns")
    }

    /// The value's type of a signal record, by structure.
    fn signal(&self) -> Option<&Type> {
        match self.fields() {
            [(v, Shape::Leaf(ty @ (Type::F64 | Type::Bool))), (q, Shape::Leaf(quality))]
                if v == "value" && q == "quality" && is_quality(quality) =>
            {
                Some(ty)
            }
            _ => None,
        }
    }

    /// The ports of a group's record. `docs` maps `GROUP.PATH` to texts. With `signals`, a signal record is one port.
    pub(crate) fn ports(&self, group: &str, signals: bool, docs: &HashMap<String, String>) -> Vec<Port> {
        let mut ports = Vec::new();
        for (name, shape) in self.fields() {
            shape.add_ports(name.clone(), group, signals, docs, &mut ports);
        }
        ports
    }

    fn add_ports(&self, path: String, group: &str, signals: bool, docs: &HashMap<String, String>, to: &mut Vec<Port>) {
        let doc = docs.get(&format!("{group}.{path}")).cloned();
        if self.is_duration() {
            to.push(Port { path, ty: Type::Duration, signal: false, doc });
        } else if signals && let Some(ty) = self.signal() {
            to.push(Port { path, ty: ty.clone(), signal: true, doc });
        } else {
            match self {
                Self::Leaf(ty) => to.push(Port { path, ty: ty.clone(), signal: false, doc }),
                Self::Record(fields) => {
                    for (name, shape) in fields {
                        shape.add_ports(format!("{path}.{name}"), group, signals, docs, to);
                    }
                }
            }
        }
    }
}

fn is_quality(ty: &Type) -> bool {
    matches!(ty, Type::Enum(cases) if cases.iter().eq(["good", "uncertain", "bad"].iter()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(fields: &[(&str, Shape)]) -> Shape {
        Shape::Record(fields.iter().map(|(n, s)| (n.to_string(), s.clone())).collect())
    }

    #[test]
    fn durations_and_signals_are_single_ports_and_settings_have_no_signals() {
        let quality = Type::Enum(["good", "uncertain", "bad"].map(String::from).into());
        let signal = record(&[("value", Shape::Leaf(Type::F64)), ("quality", Shape::Leaf(quality))]);
        let shape = record(&[
            ("t", record(&[("ns", Shape::Leaf(Type::U64))])),
            ("s", signal.clone()),
            ("r", record(&[("a", Shape::Leaf(Type::U8)), ("s", signal)])),
        ]);
        let paths = |signals| {
            let ports = shape.ports("inputs", signals, &HashMap::new());
            ports.into_iter().map(|p| format!("{}:{}:{}", p.path, p.ty.kind(), p.signal)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(paths(true), "t:duration:false s:f64:true r.a:u8:false r.s:f64:true");
        assert_eq!(
            paths(false),
            "t:duration:false s.value:f64:false s.quality:enum:false r.a:u8:false r.s.value:f64:false r.s.quality:enum:false"
        );
        assert_eq!(shape.leaves(), 6);
    }
}
