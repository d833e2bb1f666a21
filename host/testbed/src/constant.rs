//! Values as a test file has them.

use latchwork_image::Type;

/// A cell as TOML. Names of WIT are bare keys there, and the dots of nested fields mean the same.
pub(crate) fn constant(ty: &Type, cell: u64) -> String {
    let real = |real: f64| match real {
        r if r.is_nan() => "nan".into(),
        r if r.is_infinite() => if r > 0.0 { "inf" } else { "-inf" }.into(),
        r => format!("{r:?}"),
    };
    match ty {
        Type::F32 => real(f32::from_bits(cell as u32).into()),
        Type::F64 => real(f64::from_bits(cell)),
        Type::Duration | Type::Enum(_) | Type::Flags(_) => format!("{:?}", ty.format(cell)),
        // TOML has no such number.
        Type::U64 if i64::try_from(cell).is_err() => format!("\"{cell}\""),
        ty => ty.format(cell),
    }
}
