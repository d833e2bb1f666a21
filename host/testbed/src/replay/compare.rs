//! Outputs and alarms of two versions of a class, compared by name.

use super::report::{Deviation, named};
use latchwork_block::{Class, Port};
use latchwork_image::{Type, Value};
use std::sync::Arc;

/// Compares what one version gives with what another gives to the same arguments, and keeps of each output and alarm that was
/// ever different the first time, the worst, and the arguments that caused it.
pub struct Comparer {
    reference: Arc<Class>,
    pairs: Vec<Pair>,
    /// By pair.
    found: Vec<Option<Found>>,
    exact: bool,
}

/// An output that both versions have, or a quality, or an alarm.
struct Pair {
    port: String,
    /// Cells in the reference's outputs and in the other's; a missing quality is good.
    cells: (usize, Option<usize>),
    types: (Type, Type),
    /// Bits of an alarm in the cells.
    bits: Option<(u32, u32)>,
    within: f64,
}

/// What was different of one pair.
struct Found {
    count: u64,
    first: u64,
    worst: f64,
    worst_at: u64,
    values: (u64, u64),
    arguments: Vec<u64>,
}

impl Comparer {
    /// For two versions; `within` gives the largest deviation of an output that does not count, by the output's name. Outputs
    /// and alarms that only one of them has are not compared.
    pub fn new(reference: &Arc<Class>, other: &Class, within: impl Fn(&str) -> Option<f64>) -> Self {
        let (left, right) = (cells(&reference.outputs), cells(&other.outputs));
        let mut pairs = Vec::new();
        for (a, at) in &left.ports {
            let Some((b, b_at)) = right.ports.iter().find(|(b, _)| b.path == a.path) else { continue };
            let port = format!("outputs.{}", a.path);
            pairs.push(Pair {
                port: port.clone(),
                cells: (*at, Some(*b_at)),
                types: (a.ty.clone(), b.ty.clone()),
                bits: None,
                within: within(&a.path).unwrap_or(0.0),
            });
            if a.signal {
                pairs.push(Pair {
                    port: format!("{port}.quality"),
                    cells: (at + 1, b.signal.then_some(b_at + 1)),
                    types: (quality(), quality()),
                    bits: None,
                    within: 0.0,
                });
            }
        }
        for (bit, name) in reference.alarms.iter().enumerate() {
            let Some(other_bit) = other.alarms.iter().position(|a| a == name) else { continue };
            pairs.push(Pair {
                port: format!("alarms.{name}"),
                cells: (left.end, Some(right.end)),
                types: (Type::Bool, Type::Bool),
                bits: Some((bit as u32, other_bit as u32)),
                within: 0.0,
            });
        }
        let found = pairs.iter().map(|_| None).collect();
        Self { reference: Arc::clone(reference), pairs, found, exact: false }
    }

    /// Every bit counts, also of zeros and NaN.
    pub fn exact(self) -> Self {
        Self { exact: true, ..self }
    }

    /// Compares one execution at plant time `now`, ns; true when nothing was different beyond tolerance.
    pub fn compare(&mut self, now: u64, arguments: &[u64], reference: &[u64], other: &[u64]) -> bool {
        let mut same = true;
        for (pair, found) in self.pairs.iter().zip(&mut self.found) {
            let values = pair.values(reference, other);
            let Some(deviation) = pair.deviation(values, self.exact) else { continue };
            same = false;
            let found = found.get_or_insert_with(|| Found {
                count: 0,
                first: now,
                worst: deviation,
                worst_at: now,
                values,
                arguments: arguments.to_vec(),
            });
            found.count += 1;
            if deviation > found.worst {
                (found.worst, found.worst_at, found.values) = (deviation, now, values);
                found.arguments.copy_from_slice(arguments);
            }
        }
        same
    }

    /// What was different, in the order of the reference's outputs and alarms.
    pub fn deviations(&self) -> Vec<Deviation> {
        let told = self.pairs.iter().zip(&self.found).filter_map(|(pair, found)| {
            let f = found.as_ref()?;
            Some(Deviation {
                port: pair.port.clone(),
                count: f.count,
                first: f.first,
                worst: f.worst,
                worst_at: f.worst_at,
                running: pair.types.0.format(f.values.0),
                candidate: pair.types.1.format(f.values.1),
                inputs: named(&self.reference, &f.arguments),
            })
        });
        told.collect()
    }

    /// Outputs and alarms that are compared.
    pub fn compared(&self) -> usize {
        self.pairs.len()
    }
}

impl Pair {
    fn values(&self, reference: &[u64], other: &[u64]) -> (u64, u64) {
        let (a, b) = (reference[self.cells.0], self.cells.1.map_or(0, |at| other[at]));
        match self.bits {
            Some((left, right)) => (a >> left & 1, b >> right & 1),
            None => (a, b),
        }
    }

    /// How far the values are apart, if that counts: of numbers the difference (no finite one: the largest number), of others 0.
    fn deviation(&self, (a, b): (u64, u64), exact: bool) -> Option<f64> {
        if self.types.0 == self.types.1 && a == b {
            return None;
        }
        let exact = exact.then_some(0.0);
        match (number(&self.types.0, a), number(&self.types.1, b)) {
            (Some(Number::Whole(a)), Some(Number::Whole(b))) => {
                let apart = a.abs_diff(b) as f64;
                (a != b && apart > self.within).then_some(apart)
            }
            (Some(a), Some(b)) => {
                let (a, b) = (a.real(), b.real());
                if a == b || (a.is_nan() && b.is_nan()) {
                    return exact;
                }
                let apart = (a - b).abs();
                let apart = if apart.is_finite() { apart } else { f64::MAX };
                (apart > self.within).then_some(apart)
            }
            // Enums, flags and bools of two versions: by their names.
            _ => (self.types.0.value(a) != self.types.1.value(b)).then_some(0.0),
        }
    }
}

enum Number {
    Whole(i128),
    Real(f64),
}

impl Number {
    fn real(self) -> f64 {
        match self {
            Self::Whole(i) => i as f64,
            Self::Real(r) => r,
        }
    }
}

fn number(ty: &Type, cell: u64) -> Option<Number> {
    match ty {
        Type::Duration => Some(Number::Whole(cell.into())),
        // As it is, not with the shortest text.
        Type::F32 => Some(Number::Real(f32::from_bits(cell as u32).into())),
        Type::Enum(_) | Type::Flags(_) | Type::Bool => None,
        ty => match ty.value(cell) {
            Value::Integer(i) => Some(Number::Whole(i)),
            Value::Real(r) => Some(Number::Real(r)),
            _ => None,
        },
    }
}

struct Cells<'a> {
    ports: Vec<(&'a Port, usize)>,
    end: usize,
}

/// Ports and their cells.
fn cells(ports: &[Port]) -> Cells<'_> {
    let mut end = 0;
    let mut placed = Vec::with_capacity(ports.len());
    for port in ports {
        placed.push((port, end));
        end += 1 + usize::from(port.signal);
    }
    Cells { ports: placed, end }
}

fn quality() -> Type {
    Type::Enum(["good", "uncertain", "bad"].map(String::from).into())
}
