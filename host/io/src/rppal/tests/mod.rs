//! What holds without a Raspberry Pi: keys, checks, words, and the refusal on a machine that is none. What needs pins
//! runs in a virtual machine, see tests/gpio-vm.

mod problems;
mod refusal;

use crate::driver::{DriverConfig, PointConfig};
use latchwork_schema::{Constant, Value, Values};

fn values(keys: &[(&str, Value)]) -> Values {
    let entries = keys.iter().map(|(k, v)| ((*k).to_owned(), (v.clone(), 0..0))).collect();
    Values { span: 0..0, entries }
}

fn text(t: &str) -> Value {
    Value::Text(t.into())
}

fn real(r: f64) -> Value {
    Value::Constant(Constant::Real(r))
}

/// A point; `safe` makes it an output.
fn point(name: &str, keys: &[(&str, Value)], safe: Option<u64>) -> PointConfig {
    let values = values(keys);
    let ty = super::place::point(&values).map_or(latchwork_image::Type::Bool, |shape| shape.ty);
    PointConfig { name: name.into(), values, ty, safe }
}

fn driver(points: Vec<PointConfig>) -> DriverConfig {
    DriverConfig { name: "pins".into(), values: Values::default(), points }
}
