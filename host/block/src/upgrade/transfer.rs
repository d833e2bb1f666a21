//! How cells of one version of a record become those of another: by name and type.

use super::convert::{Convert, Loss};
use crate::Port;
use latchwork_image::Type;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// What becomes of a field.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "fate")]
pub enum Fate {
    /// It keeps its value.
    Carried,
    /// It keeps its value in another type that holds every value of its own: wider integers, f32 in f64, integers in reals
    /// that hold them exactly, u64 and duration, flags and enums with the same and further names in whatever order.
    Converted {
        /// Before.
        from: String,
        /// After.
        to: String,
    },
    /// It would keep its value where it fits, and does not: only with `--allow-lossy`, clamped to what the type holds. A real
    /// is cut to a whole number, NaN is 0; of flags those that are gone are off, and where an enum's case is gone the field
    /// takes what the new version starts with.
    Lossy {
        /// Before.
        from: String,
        /// After.
        to: String,
        /// It is allowed, and done.
        allowed: bool,
    },
    /// The new version has it, the old one had not: it takes what the new version starts with. A field whose kind is
    /// another one now, such as a bool that became a number, is new and its namesake dropped.
    New,
    /// The new version does not have it any more.
    Dropped,
}

/// One field and what becomes of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field {
    /// Path.
    pub name: String,
    /// Type in the new version, or in the old one of a field that is dropped.
    #[serde(rename = "type")]
    pub ty: String,
    /// What becomes of it.
    #[serde(flatten)]
    pub fate: Fate,
}

/// A plan for moving cells, one per port; applying it allocates nothing.
#[derive(Clone, Debug)]
pub struct Transfer {
    fields: Vec<Field>,
    moves: Box<[Move]>,
}

/// One cell.
#[derive(Clone, Debug)]
struct Move {
    from: usize,
    to: usize,
    convert: Convert,
}

impl Transfer {
    /// From cells of `old` to cells of `new`. With `lossy`, values that do not fit are clamped.
    pub fn new(old: &[Port], new: &[Port], lossy: bool) -> Self {
        let places: HashMap<&str, usize> = old.iter().enumerate().map(|(i, p)| (p.path.as_str(), i)).collect();
        let (mut fields, mut moves, mut taken) = (Vec::new(), Vec::new(), vec![false; old.len()]);
        for (to, port) in new.iter().enumerate() {
            let found = places.get(port.path.as_str()).copied();
            let found = found.and_then(|from| Some((from, Convert::new(&old[from].ty, &port.ty)?)));
            let fate = match found {
                None => Fate::New,
                Some((from, (convert, loss))) => {
                    taken[from] = true;
                    let fate = fate(loss, &old[from].ty, &port.ty, lossy);
                    if !matches!(fate, Fate::Lossy { allowed: false, .. }) {
                        moves.push(Move { from, to, convert });
                    }
                    fate
                }
            };
            fields.push(Field { name: port.path.clone(), ty: port.ty.to_string(), fate });
        }
        let dropped = old.iter().zip(taken).filter(|(_, taken)| !taken);
        fields.extend(dropped.map(|(p, _)| Field { name: p.path.clone(), ty: p.ty.to_string(), fate: Fate::Dropped }));
        Self { fields, moves: moves.into() }
    }

    /// Every field of the new version in its order, then those that are dropped.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Fields that would lose something and may not.
    pub fn refused(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|f| matches!(f.fate, Fate::Lossy { allowed: false, .. }))
    }

    /// Moves what is carried; all other cells of `new` stay as they are: put there first what the new version starts with.
    ///
    /// # Panics
    /// When there are fewer cells than ports.
    pub fn apply(&self, old: &[u64], new: &mut [u64]) {
        for Move { from, to, convert } in &self.moves {
            if let Some(cell) = convert.apply(old[*from]) {
                new[*to] = cell;
            }
        }
    }
}

fn fate(loss: Loss, old: &Type, new: &Type, allowed: bool) -> Fate {
    let (from, to) = (old.to_string(), new.to_string());
    match loss {
        Loss::Same => Fate::Carried,
        Loss::Nothing => Fate::Converted { from, to },
        Loss::Some => Fate::Lossy { from, to, allowed },
    }
}

/// Names and types of a record in one line, the same for every version that is laid out the same: what a stored state is
/// checked against. `starts:u32,hours:f64,mode:enum(off|on)`; no name can have a sign of those between them.
pub fn schema(ports: &[Port]) -> String {
    let named = |kind: &str, names: &[String]| format!("{kind}({})", names.join("|"));
    let field = |port: &Port| {
        let ty = match &port.ty {
            Type::Enum(cases) => named("enum", cases),
            Type::Flags(names) => named("flags", names),
            other => other.to_string(),
        };
        format!("{}:{ty}{}", port.path, if port.signal { "+quality" } else { "" })
    };
    ports.iter().map(field).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn port(path: &str, ty: Type) -> Port {
        Port { path: path.into(), ty, signal: false, doc: None }
    }

    fn names(n: &[&str]) -> std::sync::Arc<[String]> {
        n.iter().map(|s| s.to_string()).collect()
    }

    #[test]
    fn a_state_goes_by_name_and_type() {
        let old =
            [port("starts", Type::U16), port("on", Type::Bool), port("gone", Type::F64), port("hours", Type::F64)];
        let new = [port("hours", Type::F64), port("starts", Type::U32), port("on", Type::U8), port("more", Type::S8)];
        let transfer = Transfer::new(&old, &new, false);
        let fates: Vec<_> = transfer.fields().iter().map(|f| (f.name.as_str(), f.ty.as_str(), &f.fate)).collect();
        let converted = Fate::Converted { from: "u16".into(), to: "u32".into() };
        assert_eq!(
            fates,
            [
                ("hours", "f64", &Fate::Carried),
                ("starts", "u32", &converted),
                ("on", "u8", &Fate::New),
                ("more", "s8", &Fate::New),
                ("on", "bool", &Fate::Dropped),
                ("gone", "f64", &Fate::Dropped),
            ]
        );
        let mut cells = [0, 0, 77, 88];
        transfer.apply(&[9, 1, 5, 1.5f64.to_bits()], &mut cells);
        assert_eq!(cells, [1.5f64.to_bits(), 9, 77, 88]);
    }

    #[test]
    fn what_would_lose_something_is_moved_only_with_leave() {
        let modes = |cases: &[&str]| port("mode", Type::Enum(names(cases)));
        let old = [port("n", Type::U32), modes(&["off", "on"])];
        let new = [port("n", Type::U8), modes(&["on", "new"])];
        let refusing = Transfer::new(&old, &new, false);
        assert_eq!(refusing.refused().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["n", "mode"]);
        let mut cells = [7, 1];
        refusing.apply(&[300, 1], &mut cells);
        assert_eq!(cells, [7, 1]);

        let leave = Transfer::new(&old, &new, true);
        assert_eq!(leave.refused().count(), 0);
        leave.apply(&[300, 1], &mut cells);
        assert_eq!(cells, [255, 0]);
        // "off" is gone: what the new version starts with stays.
        cells = [7, 1];
        leave.apply(&[300, 0], &mut cells);
        assert_eq!(cells, [255, 1]);
    }

    #[test]
    fn a_schema_says_names_types_and_order() {
        let mut ports = vec![
            port("starts", Type::U32),
            port("a.b", Type::Duration),
            port("mode", Type::Enum(names(&["off", "on"]))),
            port("set", Type::Flags(names(&["x"]))),
        ];
        assert_eq!(schema(&ports), "starts:u32,a.b:duration,mode:enum(off|on),set:flags(x)");
        ports[0].doc = Some("documentation does not count".into());
        ports.push(Port { signal: true, ..port("level", Type::F64) });
        assert_eq!(schema(&ports), "starts:u32,a.b:duration,mode:enum(off|on),set:flags(x),level:f64+quality");
        assert_eq!(schema(&[]), "");
    }
}
