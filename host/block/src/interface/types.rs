//! From a component's value types to shapes, and names of types for messages.

use super::Shape;
use latchwork_image::Type;
use std::sync::Arc;
use wasmparser::PrimitiveValType as P;
use wasmparser::component_types::{ComponentDefinedType as D, ComponentValType};
use wasmparser::types::TypesRef;

/// Most flags in one word; the component model allows no more either.
const FLAGS: usize = 32;
/// Most scalars in one group of ports.
const LEAVES: usize = 4096;

/// Most records within records; a type could otherwise be as deep as the stack.
const DEPTH: usize = 32;

/// Reads the shape of a port type; every part that no port may have is added to `problems` with its path.
pub(super) fn shape(
    types: TypesRef<'_>,
    ty: ComponentValType,
    path: &str,
    problems: &mut Vec<String>,
) -> Option<Shape> {
    let refused = |problems: &mut Vec<String>| {
        problems.push(format!(
            "{path}: {}; a port is a bool, a number, an enum, flags, a duration, a signal, or a record of these",
            name(types, ty)
        ));
        None
    };
    let leaf = match ty {
        ComponentValType::Primitive(p) => primitive(p),
        ComponentValType::Type(id) => match &types[id] {
            D::Primitive(p) => primitive(*p),
            D::Enum(cases) => Some(Type::Enum(names(cases.iter().map(|c| c.as_str())))),
            D::Flags(flags) if flags.len() <= FLAGS => Some(Type::Flags(names(flags.iter().map(|f| f.as_str())))),
            D::Flags(flags) => {
                problems.push(format!("{path}: {} flags; at most {FLAGS} fit, split them", flags.len()));
                return None;
            }
            D::Record(_) if path.split('.').count() > DEPTH => {
                problems.push(format!("{path}: records within records, {DEPTH} deep; use fewer levels"));
                return None;
            }
            D::Record(record) => {
                let mut fields = Vec::new();
                for (field, ty) in &record.fields {
                    let shape = shape(types, *ty, &format!("{path}.{field}"), problems);
                    fields.extend(shape.map(|s| (field.to_string(), s)));
                }
                let shape = Shape::Record(fields);
                // A few nested records can stand for millions of scalars.
                if shape.leaves() > LEAVES {
                    problems.push(format!("{path}: {} scalars; at most {LEAVES} are allowed", shape.leaves()));
                    return None;
                }
                return Some(shape);
            }
            _ => None,
        },
    };
    match leaf {
        Some(ty) => Some(Shape::Leaf(ty)),
        None => refused(problems),
    }
}

fn primitive(ty: P) -> Option<Type> {
    Some(match ty {
        P::Bool => Type::Bool,
        P::U8 => Type::U8,
        P::U16 => Type::U16,
        P::U32 => Type::U32,
        P::U64 => Type::U64,
        P::S8 => Type::S8,
        P::S16 => Type::S16,
        P::S32 => Type::S32,
        P::S64 => Type::S64,
        P::F32 => Type::F32,
        P::F64 => Type::F64,
        P::Char | P::String | P::ErrorContext => return None,
    })
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> Arc<[String]> {
    names.map(String::from).collect()
}

/// A type's name as it is written in WIT, as far as needed to recognise it.
pub(super) fn name(types: TypesRef<'_>, ty: ComponentValType) -> String {
    shallow_name(types, ty, 3)
}

/// A name down to some depth.
fn shallow_name(types: TypesRef<'_>, ty: ComponentValType, depth: usize) -> String {
    let id = match ty {
        ComponentValType::Primitive(p) => return p.to_string(),
        ComponentValType::Type(_) if depth == 0 => return "…".into(),
        ComponentValType::Type(id) => id,
    };
    let name = |ty: &ComponentValType| shallow_name(types, *ty, depth - 1);
    match &types[id] {
        D::Primitive(p) => p.to_string(),
        D::Record(_) => "record".into(),
        D::Variant(_) => "variant".into(),
        D::List { element, .. } => format!("list<{}>", name(element)),
        D::Tuple(t) => format!("tuple<{}>", t.types.iter().map(name).collect::<Vec<_>>().join(", ")),
        D::Flags(_) => "flags".into(),
        D::Enum(_) => "enum".into(),
        D::Option { ty, .. } => format!("option<{}>", name(ty)),
        D::Result { ok, err, .. } => {
            let part = |t: &Option<ComponentValType>| t.as_ref().map_or("_".into(), name);
            format!("result<{}, {}>", part(ok), part(err))
        }
        D::Own(_) | D::Borrow(_) => "resource handle".into(),
        D::Map { .. } => "map".into(),
        D::FixedLengthList { element, length, .. } => format!("list<{}, {length}>", name(element)),
        D::Future { .. } => "future".into(),
        D::Stream { .. } => "stream".into(),
    }
}
