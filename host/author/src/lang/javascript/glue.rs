//! The glue between the author's object and QuickJS, which takes whole numbers for signed ones of 32 bits where it can: a `u32`
//! above 2^31-1 would come in negative and go out as 2147483647, and what fits no port would be cut to something that does.
//!
//! So the glue converts every whole number of the class. What goes out must fit, or the call is a fault: no number is better
//! than a wrong one.

use super::Dialect;
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::lang::{Block, File, banner};
use crate::names::{camel, lower_camel};
use std::fmt::Write;

/// The most that a port of 64 bits holds, as the nearest number of JavaScript: one more. QuickJS makes the most of it again.
const MOST_U64: &str = "18446744073709551616";
const MOST_S64: &str = "9223372036854775808";

/// Converters of numbers that go out.
const WHOLE: &str = "// A whole number that goes out: towards 0, as everywhere. One that does not fit is a fault.
function whole(value, least, most) {
  const number = typeof value === \"bigint\" ? Number(value) : value;
  if (typeof number !== \"number\" || (typeof value === \"bigint\" && BigInt(number) !== value)) {
    throw new TypeError(`${typeof value} ${value} is no number that a port can have`);
  }
  const result = Math.trunc(number);
  if (!(result >= least && result <= most)) {
    throw new RangeError(`${value} is not within ${least} and ${most}`);
  }
  return result;
}
";

/// What the component is made from: `glue.js` or `glue.ts`.
pub(super) fn text(block: &Block, dialect: Dialect) -> File {
    let class = &block.class;
    let (random, source) = match dialect {
        Dialect::JavaScript => ("./random.js", "./block.js"),
        Dialect::TypeScript => ("./random", "./block"),
    };
    let mut out = banner(block, "//");
    if dialect == Dialect::TypeScript {
        out += "// @ts-nocheck\n";
    }
    let name = lower_camel(&class.name);
    let _ = writeln!(out, "import \"{random}\";\nimport {{ {name} as block }} from \"{source}\";");
    let converted = |groups: &[Option<usize>], test: &dyn Fn(Ty) -> bool| {
        let reached = |ty: usize| groups.iter().flatten().any(|group| reaches(class, *group, ty));
        let list = (0..class.types.len()).filter(|ty| reached(*ty) && holds(class, *ty, test));
        list.map(|ty| &class.types[ty]).collect::<Vec<_>>()
    };
    let defaults = class.settings.filter(|_| class.defaults);
    let incoming = converted(&[class.settings, class.inputs, class.retained], &comes_in_wrong);
    let outgoing = converted(&[defaults, class.outputs, class.retained], &is_whole);
    if !outgoing.is_empty() {
        out += "\n";
        out += WHOLE;
    }
    for ty in outgoing {
        lower(&mut out, class, ty);
    }
    if !incoming.is_empty() {
        out += "\n// What comes in, made anew for each call.\n";
    }
    for ty in incoming {
        lift(&mut out, class, ty);
    }
    functions(&mut out, class);
    let _ = writeln!(out, "export {{ glue as {name} }};");
    File::new(dialect.glue(), out)
}

/// The object that is exported.
fn functions(out: &mut String, class: &Class) {
    // Plant time never comes to where it would be wrong, in 584 years.
    let lifted = |name: &str, ty: usize| match ty != class.scan && holds(class, ty, &comes_in_wrong) {
        true => format!("lift{}({name})", camel(&class.types[ty].name)),
        false => name.to_owned(),
    };
    let lowered = |value: &str, ty: usize| match holds(class, ty, &is_whole) {
        true => format!("lower{}({value})", camel(&class.types[ty].name)),
        false => value.to_owned(),
    };
    out.push_str("\nconst glue = {\n");
    if let Some(ty) = class.settings {
        if class.defaults {
            let _ = writeln!(out, "  defaults: () => {},", lowered("block.defaults()", ty));
        }
        let _ = writeln!(out, "  configure: (settings) => block.configure({}),", lifted("settings", ty));
    }
    let parameters = class.execute_parameters();
    let names: Vec<&str> = parameters.iter().map(|(n, _)| *n).collect();
    let arguments: Vec<String> = parameters.iter().map(|(n, t)| lifted(n, *t)).collect();
    let (names, call) = (names.join(", "), format!("block.execute({})", arguments.join(", ")));
    match class.execute_results()[..] {
        [(_, one)] => {
            let _ = writeln!(out, "  execute: ({names}) => {},", lowered(&call, one));
        }
        [(first, one), (second, _)] => {
            let _ = writeln!(out, "  execute: ({names}) => {{\n    const [{first}, {second}] = {call};");
            let _ = writeln!(out, "    return [{}, {second}];\n  }},", lowered(first, one));
        }
        _ => {
            let _ = writeln!(out, "  execute: ({names}) => {call},");
        }
    }
    if let Some(ty) = class.retained {
        let _ = writeln!(out, "  save: () => {},", lowered("block.save()", ty));
        let _ = writeln!(out, "  restore: (state) => block.restore({}),", lifted("state", ty));
    }
    out.push_str("};\n");
}

/// Whether a field of the type, or one below it, is such a type.
fn holds(class: &Class, ty: usize, test: &dyn Fn(Ty) -> bool) -> bool {
    class.fields(ty).iter().any(|field| match field.ty {
        Ty::Named(inner) => holds(class, inner, test),
        ty => test(ty),
    })
}

/// Whether a type is another one or has it somewhere.
fn reaches(class: &Class, from: usize, to: usize) -> bool {
    let below = |ty| matches!(ty, Ty::Named(inner) if reaches(class, inner, to));
    from == to || class.fields(from).iter().any(|field| below(field.ty))
}

fn is_whole(ty: Ty) -> bool {
    !matches!(ty, Ty::Bool | Ty::F32 | Ty::F64 | Ty::Named(_))
}

fn comes_in_wrong(ty: Ty) -> bool {
    matches!(ty, Ty::U32 | Ty::U64)
}

/// A record that goes out, as a new one: that of the author may be kept.
fn lower(out: &mut String, class: &Class, ty: &TypeDef) {
    let Kind::Record(fields) = &ty.kind else { return };
    let _ = writeln!(out, "const lower{} = (value) => ({{", camel(&ty.name));
    for field in fields {
        let name = lower_camel(&field.name);
        let value = format!("value.{name}");
        let value = match (field.ty, bounds(field.ty)) {
            // The bits are those of the signed number.
            (Ty::U32, Some((least, most))) => format!("whole({value}, {least}, {most}) | 0"),
            (_, Some((least, most))) => format!("whole({value}, {least}, {most})"),
            (Ty::Named(inner), _) if holds(class, inner, &is_whole) => {
                format!("lower{}({value})", camel(&class.types[inner].name))
            }
            _ => value,
        };
        let _ = writeln!(out, "  {name}: {value},");
    }
    out.push_str("});\n");
}

fn bounds(ty: Ty) -> Option<(&'static str, &'static str)> {
    Some(match ty {
        Ty::U8 => ("0", "255"),
        Ty::S8 => ("-128", "127"),
        Ty::U16 => ("0", "65535"),
        Ty::S16 => ("-32768", "32767"),
        Ty::U32 => ("0", "4294967295"),
        Ty::S32 => ("-2147483648", "2147483647"),
        Ty::U64 => ("0", MOST_U64),
        Ty::S64 => ("-9223372036854775808", MOST_S64),
        Ty::Bool | Ty::F32 | Ty::F64 | Ty::Named(_) => return None,
    })
}

/// A record that comes in, mended where it is: it is the call's own.
fn lift(out: &mut String, class: &Class, ty: &TypeDef) {
    let Kind::Record(fields) = &ty.kind else { return };
    let _ = writeln!(out, "function lift{}(value) {{", camel(&ty.name));
    for field in fields {
        let name = lower_camel(&field.name);
        let _ = match field.ty {
            Ty::U32 => writeln!(out, "  value.{name} >>>= 0;"),
            Ty::U64 => writeln!(out, "  if (value.{name} < 0) value.{name} += {MOST_U64};"),
            Ty::Named(inner) if holds(class, inner, &comes_in_wrong) => {
                writeln!(out, "  lift{}(value.{name});", camel(&class.types[inner].name))
            }
            _ => Ok(()),
        };
    }
    out.push_str("  return value;\n}\n");
}
