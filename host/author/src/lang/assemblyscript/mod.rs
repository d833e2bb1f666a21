//! AssemblyScript: the glue copies field by field, since its objects hold others by reference.
//!
//! The compiler gives exports only names that are identifiers: `latchwork_execute` is renamed when the component is made.

mod glue;

pub(super) use glue::generated;

use super::{Block, File};
use crate::abi::Tuple;
use crate::class::{Class, Kind, Ty};
use crate::manifest::{Prepare, Step};
use crate::names::{camel, comment, lower_camel, unless};
use std::fmt::Write;

/// The version that the tests build with.
const ASC: &str = "0.28.20";

pub(super) fn step(block: &Block) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let command = [
        "npx",
        "--no-install",
        "asc",
        "glue.ts",
        "-o",
        &output,
        "-O3",
        "--runtime",
        "incremental",
        "--use",
        "abort=",
        "--zeroFilledMemory",
    ];
    let prepare = Prepare {
        command: ["npm", "install", "--no-audit", "--no-fund"].map(str::to_owned).to_vec(),
        makes: super::PACKAGES.into(),
    };
    Step { prepare: Some(prepare), ..super::step(&command, output.clone()) }
}

fn type_name(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "bool".into(),
        Ty::U8 => "u8".into(),
        Ty::S8 => "i8".into(),
        Ty::U16 => "u16".into(),
        Ty::S16 => "i16".into(),
        Ty::U32 => "u32".into(),
        Ty::S32 => "i32".into(),
        Ty::U64 => "u64".into(),
        Ty::S64 => "i64".into(),
        Ty::F32 => "f32".into(),
        Ty::F64 => "f64".into(),
        Ty::Named(index) => match class.types[index].kind {
            Kind::Flags(_) => "u32".into(),
            _ => type_ident(&class.types[index].name),
        },
    }
}

/// What AssemblyScript and the glue have by these names.
#[rustfmt::skip]
const TAKEN: &[&str] = &[
    "Array", "ArrayBuffer", "Atomics", "Bool", "Boolean", "DataView", "Date", "Error", "F32", "F64", "Function", "I16", "I32",
    "I64", "I8", "Infinity", "Int16Array", "Isize", "LogLevel", "Map", "Math", "Mathf", "Number", "Object", "RangeError", "RegExp",
    "Set", "StaticArray", "String", "Symbol", "TypeError", "U16", "U32", "U64", "U8", "Uint8Array", "Usize", "V128",
];

fn type_ident(name: &str) -> String {
    unless(TAKEN, camel(name))
}

/// A field: any word but those that stand before fields, and that of the function that makes the object.
fn field(name: &str) -> String {
    const TAKEN: [&str; 9] =
        ["abstract", "constructor", "declare", "override", "private", "protected", "public", "readonly", "static"];
    let name = lower_camel(name);
    if TAKEN.contains(&name.as_str()) { name + "_" } else { name }
}

fn zero(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::Named(index) => {
            let def = &class.types[index];
            match &def.kind {
                Kind::Record(_) => format!("new {}()", type_ident(&def.name)),
                Kind::Flags(_) => "0".into(),
                Kind::Enum(cases) => format!("{}.{}", type_ident(&def.name), flag(&cases[0].name)),
            }
        }
        _ => "0".into(),
    }
}

pub(super) fn authored(block: &Block) -> Vec<File> {
    let class = &block.class;
    let mut out = comment(super::tagline(class), "//");
    out += "//\n// Time is an argument: add up scan.elapsed (ns), and ask no clock. NaN and infinity may come in.\n";
    let mut names = vec!["Scan".to_owned()];
    for ty in [class.settings, class.inputs, class.outputs, class.retained].into_iter().flatten() {
        names.push(type_ident(&class.types[ty].name));
    }
    let leaves = |name: &str, ty: usize| Tuple::new(class, &[(name, ty)]).leaves;
    for leaf in class.outputs.map(|ty| leaves("outputs", ty)).into_iter().flatten() {
        if let Ty::Named(index) = leaf.ty
            && matches!(class.types[index].kind, Kind::Enum(_))
        {
            let name = type_ident(&class.types[index].name);
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    let _ = writeln!(out, "import {{ {} }} from \"./class\";\n", names.join(", "));
    if class.settings.is_some() {
        out += "let current = new Settings();\n";
    }
    if class.retained.is_some() {
        out += "let retained = new Retained();\n";
    }
    out += "\n";
    if class.settings.is_some() {
        if class.defaults {
            out += "// `settings` comes with zeros in it.\nexport function defaults(settings: Settings): void {}\n\n";
        }
        out += "// Takes new settings (null), or refuses them with a sentence.\n";
        out += "export function configure(settings: Settings): string | null {\n  current = settings;\n  return null;\n}\n\n";
    }
    let mut parameters = vec!["scan: Scan"];
    parameters.extend(class.inputs.map(|_| "inputs: Inputs"));
    parameters.extend(class.commands.map(|_| "commands: u32"));
    parameters.extend(class.outputs.map(|_| "outputs: Outputs"));
    let result = if class.alarms.is_some() { "u32" } else { "void" };
    let _ = writeln!(out, "export function execute({}): {result} {{", parameters.join(", "));
    let constant = |t: &str, l: &str| format!("{}.{}", type_ident(t), flag(l));
    out += &comment(&super::execute_names(class, ".", &field, &constant), "  //");
    for leaf in class.outputs.map(|ty| leaves("outputs", ty)).into_iter().flatten() {
        let _ = writeln!(out, "  {} = {};", place(&leaf.path), zero(class, leaf.ty));
    }
    if class.alarms.is_some() {
        out += "  return 0;\n";
    }
    out += "}\n";
    if let Some(ty) = class.retained {
        out += "\nexport function save(state: Retained): void {\n";
        for leaf in leaves("state", ty) {
            let rest = place(&leaf.path);
            let _ = writeln!(out, "  {rest} = retained{};", rest.strip_prefix("state").unwrap_or_default());
        }
        out += "}\n\nexport function restore(state: Retained): void {\n  retained = state;\n}\n";
    }
    let package = format!(
        "{{\n  \"name\": \"{}\",\n  \"private\": true,\n  \"type\": \"module\",\n  \"devDependencies\": {{ \"assemblyscript\": \"{ASC}\" }}\n}}\n",
        block.name
    );
    vec![File::new("block.ts", out), File::new("package.json", package)]
}

fn place(path: &[String]) -> String {
    super::place(path, &field)
}

/// A name that is no keyword: as a name of its own, not of a property, it would be one.
fn flag(name: &str) -> String {
    camel(name)
}
