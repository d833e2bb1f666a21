//! `sim`: points without a device behind them.
//!
//! Only the description of the kind stands here. Its input points are moved by a stimulus file or a feed and its
//! outputs are only looked at, so the plant serves them itself, in step with plant time: that is what makes a run at
//! virtual time the same on every machine.

use crate::driver::{Driver, DriverConfig, DriverKind, PointShape, Problem};
use latchwork_image::Type;
use latchwork_schema::{Key, Kind, Section, Values, cell};

/// The kind.
pub(crate) static SIM: DriverKind = DriverKind {
    name: "sim",
    keys: &Section {
        name: "driver (sim)",
        doc: "Points without a device: a stimulus file moves the inputs, the outputs are only shown.",
        keys: &[],
    },
    point_keys: &Section { name: "point (sim)", doc: "A simulated point.", keys: POINT_KEYS },
    point,
    check: |_| Vec::new(),
    build,
    direct: None,
};

const TYPES: &[(&str, Type)] = &[
    ("bool", Type::Bool),
    ("u8", Type::U8),
    ("u16", Type::U16),
    ("u32", Type::U32),
    ("u64", Type::U64),
    ("s8", Type::S8),
    ("s16", Type::S16),
    ("s32", Type::S32),
    ("s64", Type::S64),
    ("f32", Type::F32),
    ("f64", Type::F64),
    ("duration", Type::Duration),
];

const POINT_KEYS: &[Key] = &[
    Key::required(
        "type",
        Kind::OneOf(&["bool", "u8", "u16", "u32", "u64", "s8", "s16", "s32", "s64", "f32", "f64", "duration"]),
        "Type of the point.",
    ),
    Key::optional(
        "initial",
        Kind::Constant,
        "",
        "Value of an input point until the stimulus changes it; 0 or false without it. Its quality is good.",
    ),
    Key::optional(
        "edge",
        Kind::OneOf(&["both", "rising", "falling"]),
        "\"both\"",
        "Which changes of a bool start the interrupt lane that names it in `on`.",
    ),
];

fn point(values: &Values) -> Result<PointShape, Vec<Problem>> {
    let problem = |key: &str, message, help: &str| {
        vec![Problem { point: None, key: key.into(), message, help: Some(help.into()) }]
    };
    let name = values.text("type").unwrap_or_default();
    let Some((_, ty)) = TYPES.iter().find(|(n, _)| *n == name) else {
        let message = if name.is_empty() {
            "the point has no `type`".to_owned()
        } else {
            format!("\"{name}\" is no type of a simulated point")
        };
        return Err(problem("type", message, "write for example type = \"f64\""));
    };
    if let Some(constant) = values.constant("initial")
        && let Err(error) = cell(ty, constant)
    {
        return Err(problem("initial", error.to_string(), "change `initial` or `type` so that they fit"));
    }
    Ok(PointShape { ty: ty.clone(), writable: true, readable: true })
}

fn build(config: DriverConfig) -> Result<Box<dyn Driver>, String> {
    Err(format!("`{}` is simulated: the plant itself serves its points, no driver runs", config.name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_schema::{Constant, Value};

    fn values(ty: &str, initial: Option<Constant>) -> Values {
        let mut values = Values::default();
        values.entries.insert("type".into(), (Value::Text(ty.into()), 0..0));
        values.entries.extend(initial.map(|c| ("initial".into(), (Value::Constant(c), 0..0))));
        values
    }

    #[test]
    fn every_type_of_the_table_is_known_by_its_name() {
        let Kind::OneOf(names) = &POINT_KEYS[0].kind else { panic!("type is one of some words") };
        assert_eq!(names.len(), TYPES.len());
        for name in *names {
            let shape = (SIM.point)(&values(name, None)).unwrap();
            assert_eq!((shape.ty.to_string().as_str(), shape.writable, shape.readable), (*name, true, true));
        }
    }

    #[test]
    fn an_initial_value_fits_its_type() {
        for (ty, constant, fits) in [
            ("bool", Constant::Bool(true), true),
            ("bool", Constant::Integer(1), false),
            ("u8", Constant::Integer(255), true),
            ("u8", Constant::Integer(256), false),
            ("u8", Constant::Real(1.0), false),
            ("f64", Constant::Integer(3), true),
            ("f64", Constant::Text("3".into()), false),
            ("duration", Constant::Text("20ms".into()), true),
            ("duration", Constant::Integer(20), false),
        ] {
            assert_eq!((SIM.point)(&values(ty, Some(constant.clone()))).is_ok(), fits, "{ty} = {constant:?}");
        }
        let problems = (SIM.point)(&values("u8", Some(Constant::Integer(256)))).unwrap_err();
        insta::assert_debug_snapshot!(problems);
    }
}
