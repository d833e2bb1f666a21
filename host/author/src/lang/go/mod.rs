//! Go's own compiler, for wasip1 with the stand-in for WASI: its runtime comes along, 2 MB of it.
//!
//! Go lays structs of numbers out as the canonical ABI does, and moves no global: a result is a variable and its address.

mod glue;

pub(super) use glue::generated;

use super::{Block, File};
use crate::abi::Tuple;
use crate::class::{Class, Kind, Ty};
use crate::manifest::Step;
use crate::names::{camel, comment, twice, unless};
use std::fmt::Write;

pub(super) fn step(block: &Block) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let command = ["go", "build", "-buildmode=c-shared", "-trimpath", "-ldflags=-s -w", "-o", &output, "."];
    let env = [("GOOS", "wasip1"), ("GOARCH", "wasm"), ("CGO_ENABLED", "0"), ("GOFLAGS", "-buildvcs=false")];
    let env = env.into_iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
    Step { env, ..super::step(&command, output.clone()) }
}

fn type_name(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "bool".into(),
        Ty::U8 => "uint8".into(),
        Ty::S8 => "int8".into(),
        Ty::U16 => "uint16".into(),
        Ty::S16 => "int16".into(),
        Ty::U32 => "uint32".into(),
        Ty::S32 => "int32".into(),
        Ty::U64 => "uint64".into(),
        Ty::S64 => "int64".into(),
        Ty::F32 => "float32".into(),
        Ty::F64 => "float64".into(),
        Ty::Named(index) => type_ident(&class.types[index].name),
    }
}

/// Names of the glue, and of what the author writes.
const TAKEN: &[&str] = &[
    "Configure",
    "Defaults",
    "Execute",
    "Log",
    "LogDebug",
    "LogError",
    "LogInfo",
    "LogLevel",
    "LogWarning",
    "Restore",
    "Save",
];

fn type_ident(name: &str) -> String {
    unless(TAKEN, camel(name))
}

/// Constants are beside the types, and begin with the name of their own.
pub(super) fn refuses(class: &Class) -> Option<String> {
    let mut names: Vec<_> = class.types.iter().map(|t| (t.name.clone(), type_ident(&t.name))).collect();
    names.extend(
        super::labels(class)
            .map(|(ty, label)| (format!("{}.{label}", ty.name), format!("{}{}", type_ident(&ty.name), camel(label)))),
    );
    twice(&names).map(|(first, second)| format!("`{first}` and `{second}` become one name"))
}

fn place(path: &[String]) -> String {
    super::place(path, &camel)
}

pub(super) fn authored(block: &Block) -> Vec<File> {
    let class = &block.class;
    let mut out = comment(super::tagline(class), "//");
    out += "//\n// Time is an argument: add up scan.Elapsed (ns), and ask no clock. NaN and infinity may come in.\npackage main\n\n";
    let fields = [(class.settings, "settings Settings"), (class.retained, "retained Retained")];
    for (_, field) in fields.iter().filter(|(t, _)| t.is_some()) {
        let _ = writeln!(out, "var {field}\n");
    }
    if let Some(ty) = class.settings {
        if class.defaults {
            let fields: Vec<String> = class
                .fields(ty)
                .iter()
                .filter_map(|f| Some(format!("\t\t{}: {},\n", camel(&f.name), zero(class, f.ty)?)))
                .collect();
            let _ = writeln!(
                out,
                "// Defaults are the settings that a plant file need not set.\nfunc Defaults() Settings {{\n\treturn Settings{{\n{}\t}}\n}}\n",
                fields.concat()
            );
        }
        out += "// Configure takes new settings, or refuses them with a sentence.\nfunc Configure(next Settings) error {\n\tsettings = next\n\treturn nil\n}\n\n";
    }
    let parameters = class.execute_parameters().into_iter().map(|(n, _)| format!("{n} {}", camel(n)));
    let results: Vec<String> = class.execute_results().into_iter().map(|(n, _)| format!("{n} {}", camel(n))).collect();
    let results = if results.is_empty() { String::new() } else { format!("({}) ", results.join(", ")) };
    let _ = writeln!(
        out,
        "// Execute is one execution.\nfunc Execute({}) {results}{{",
        parameters.collect::<Vec<_>>().join(", ")
    );
    let constant = |t: &str, l: &str| format!("{}{}", type_ident(t), camel(l));
    out += &comment(&super::execute_names(class, ".", &|n| camel(n), &constant), "\t//");
    if let Some(ty) = class.outputs {
        for leaf in Tuple::new(class, &[("outputs", ty)]).leaves {
            let value = zero(class, leaf.ty).unwrap_or_default();
            let _ = writeln!(out, "\t{} = {value}", place(&leaf.path));
        }
    }
    if !results.is_empty() {
        out += "\treturn\n";
    }
    out += "}\n";
    if class.retained.is_some() {
        out += "\n// Save is the state that a restart or a swap carries over.\nfunc Save() Retained { return retained }\n\n// Restore goes on from a saved state.\nfunc Restore(state Retained) { retained = state }\n";
    }
    let module = format!("module {}\n\ngo 1.24\n", block.name);
    vec![File::new("block.go", out), File::new("go.mod", module)]
}

/// A value at rest; none for a record, which is at rest as it is.
fn zero(class: &Class, ty: Ty) -> Option<String> {
    match ty {
        Ty::Bool => Some("false".into()),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Record(_) => None,
            Kind::Enum(cases) => Some(format!("{}{}", type_ident(&class.types[index].name), camel(&cases[0].name))),
            Kind::Flags(_) => Some("0".into()),
        },
        _ => Some("0".into()),
    }
}
