//! The ports as classes, and the functions between them and the canonical ABI.

use super::super::{Block, File, banner};
use super::{field as ident, flag, place, type_ident, type_name, zero};
use crate::abi::{Core, Leaf, Tuple, word};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::names::comment;
use std::fmt::Write;

fn core(core: Core) -> &'static str {
    match core {
        Core::I32 => "i32",
        Core::I64 => "i64",
        Core::F32 => "f32",
        Core::F64 => "f64",
    }
}

/// The type that a leaf has in memory.
fn stored(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "u8".into(),
        Ty::Named(index) => format!("u{}", word(&class.types[index].kind) * 8),
        _ => type_name(class, ty),
    }
}

/// Writes `value` where a leaf is.
fn assign(class: &Class, leaf: &Leaf, value: &str) -> String {
    let to = place(&leaf.path);
    match leaf.ty {
        Ty::Bool => format!("{to} = {value} != 0;"),
        ty => format!("{to} = <{}>{value};", type_name(class, ty)),
    }
}

/// Puts results into memory.
fn store(class: &Class, leaf: &Leaf) -> String {
    let stored = stored(class, leaf.ty);
    format!("store<{stored}>(area + {}, <{stored}>{});", leaf.offset, place(&leaf.path))
}

pub(in crate::lang) fn generated(block: &Block) -> Vec<File> {
    let (class, abi) = (&block.class, &block.abi);
    let mut out = banner(block, "//");
    for ty in &class.types {
        out += &type_text(class, ty);
    }
    let types = out + LOG;
    // Apart from the types: what the entry file exports is an export of the module.
    let mut out = banner(block, "//");
    out += "import * as block from \"./block\";\n";
    let _ = writeln!(out, "import {{ {} }} from \"./class\";\n", glue_types(class).join(", "));
    let sizes = [Some(&abi.result), abi.settings.as_ref(), abi.retained.as_ref()];
    let size = sizes.into_iter().flatten().map(|t| t.size).chain([12]).max().unwrap_or(12);
    let _ = writeln!(out, "// Results lie here.\nconst area: usize = memory.data({size}, 8);");
    out += "let now: u64 = 0;\nexport function latchwork_now(): u64 {\n  return now;\n}\n\n";
    if let Some(size) = abi.spill() {
        let _ = writeln!(out, "// More than 16 parameters come by a pointer into this memory; one call at a time.");
        let _ = writeln!(out, "const spill: usize = memory.data({size}, 8);");
        out += "export function cabi_realloc(old: usize, oldSize: usize, align: usize, size: usize): usize {\n";
        let _ = writeln!(out, "  if (old != 0 || align > 8 || size > {size}) unreachable();\n  return spill;\n}}\n");
    }
    if let Some(tuple) = &abi.settings {
        if class.defaults {
            let result = Tuple { ..tuple.clone() };
            out += "export function latchwork_defaults(): ";
            fill(&mut out, class, &result, "Settings", "settings", "defaults");
        }
        let _ = writeln!(out, "let refusal: ArrayBuffer | null = null;");
        let _ = writeln!(out, "export function latchwork_configure({}): usize {{", list(tuple));
        out += "  // A new one each time: what is refused must not change the settings in force.\n  const settings = new Settings();\n";
        out += &lift(class, tuple);
        out += "  const why = block.configure(settings);\n  store<u8>(area, why !== null ? 1 : 0);\n  if (why !== null) {\n";
        out += "    const text = String.UTF8.encode(why);\n    refusal = text;\n    store<u32>(area + 4, changetype<usize>(text));\n    store<u32>(area + 8, text.byteLength);\n  }\n  return area;\n}\n\n";
    }
    execute(&mut out, block);
    if let Some(tuple) = &abi.retained {
        out += "export function latchwork_save(): ";
        fill(&mut out, class, tuple, "Retained", "state", "save");
        let _ = writeln!(
            out,
            "export function latchwork_restore({}): void {{\n  const state = new Retained();",
            list(tuple)
        );
        out += &lift(class, tuple);
        out += "  block.restore(state);\n}\n";
    }
    let tidy = |text: String| text.trim_end().to_owned() + "\n";
    vec![File::new("class.ts", tidy(types)), File::new("glue.ts", tidy(out))]
}

/// Types that the glue names: records that travel, and enums.
fn glue_types(class: &Class) -> Vec<String> {
    let groups = [Some(class.scan), class.settings, class.inputs, class.outputs, class.retained];
    let records = groups.into_iter().flatten();
    let enums = (0..class.types.len()).filter(|t| matches!(class.types[*t].kind, Kind::Enum(_)));
    records.chain(enums).map(|t| type_ident(&class.types[t].name)).collect()
}

const LOG: &str = r#"// A line for the plant's records. Only a block that calls it imports the log.
// @ts-ignore: decorator
@external("latchwork:block/log@0.1.0", "write")
declare function hostLog(level: u32, message: usize, bytes: usize): void;
export enum LogLevel { debug, info, warning, error }
export function log(level: LogLevel, message: string): void {
  const text = String.UTF8.encode(message);
  hostLog(level, changetype<usize>(text), text.byteLength);
}
"#;

/// Parameters as core values, or one pointer.
fn list(tuple: &Tuple) -> String {
    if tuple.spilled() {
        return "at: usize".into();
    }
    let typed = tuple.leaves.iter().enumerate().map(|(i, l)| format!("p{i}: {}", core(l.core())));
    typed.collect::<Vec<_>>().join(", ")
}

/// Puts parameters into the objects.
fn lift(class: &Class, tuple: &Tuple) -> String {
    let value = |i: usize, leaf: &Leaf| {
        if tuple.spilled() {
            format!("load<{}>(at + {})", stored(class, leaf.ty), leaf.offset)
        } else {
            format!("p{i}")
        }
    };
    let lines = tuple.leaves.iter().enumerate().filter(|(_, l)| l.path.len() > 1);
    lines.map(|(i, l)| format!("  {}\n", assign(class, l, &value(i, l)))).collect()
}

/// The end of a function whose result the author fills in.
fn fill(out: &mut String, class: &Class, tuple: &Tuple, ty: &str, name: &str, function: &str) {
    let head = |result: &str| format!("{result} {{\n  const {name} = new {ty}();\n  block.{function}({name});\n");
    if let [one] = &tuple.leaves[..] {
        let core = core(one.core());
        let _ = writeln!(out, "{}  return <{core}>{};\n}}\n", head(core), place(&one.path));
        return;
    }
    out.push_str(&head("usize"));
    for leaf in &tuple.leaves {
        let _ = writeln!(out, "  {}", store(class, leaf));
    }
    out.push_str("  return area;\n}\n\n");
}

fn execute(out: &mut String, block: &Block) {
    let (class, abi) = (&block.class, &block.abi);
    out.push_str("const scan = new Scan();\n");
    if class.inputs.is_some() {
        out.push_str("const inputs = new Inputs();\n");
    }
    let result = match &abi.result.leaves[..] {
        [] => "void",
        [one] => core(one.core()),
        _ => "usize",
    };
    let _ = writeln!(out, "export function latchwork_execute({}): {result} {{", list(&abi.execute));
    out.push_str(&lift(class, &abi.execute));
    out.push_str("  now = scan.now;\n");
    let mut arguments = vec!["scan".to_owned()];
    arguments.extend(class.inputs.map(|_| "inputs".to_owned()));
    if class.commands.is_some()
        && let Some((i, leaf)) = abi.execute.leaves.iter().enumerate().find(|(_, l)| l.path[0] == "commands")
    {
        arguments.push(if abi.execute.spilled() {
            format!("load<{}>(at + {})", stored(class, leaf.ty), leaf.offset)
        } else {
            format!("<u32>p{i}")
        });
    }
    if class.outputs.is_some() {
        out.push_str("  const outputs = new Outputs();\n");
        arguments.push("outputs".into());
    }
    let alarms = if class.alarms.is_some() { "const alarms: u32 = " } else { "" };
    let _ = writeln!(out, "  {alarms}block.execute({});", arguments.join(", "));
    match &abi.result.leaves[..] {
        [] => {}
        [one] => {
            let _ = writeln!(out, "  return <{}>{};", core(one.core()), place(&one.path));
        }
        leaves => {
            for leaf in leaves {
                let _ = writeln!(out, "  {}", store(class, leaf));
            }
            out.push_str("  return area;\n");
        }
    }
    out.push_str("}\n\n");
}

fn type_text(class: &Class, ty: &TypeDef) -> String {
    let mut out = comment(&ty.doc, "//");
    let name = type_ident(&ty.name);
    match &ty.kind {
        Kind::Record(fields) => {
            let _ = writeln!(out, "export class {name} {{");
            for field in fields {
                out += &comment(&field.doc, "  //");
                let typed = type_name(class, field.ty);
                let _ = writeln!(out, "  {}: {typed} = {};", ident(&field.name), zero(class, field.ty));
            }
        }
        Kind::Flags(labels) => {
            let _ = writeln!(out, "export namespace {name} {{");
            for (i, label) in labels.iter().enumerate() {
                out += &comment(&label.doc, "  //");
                let _ = writeln!(out, "  export const {}: u32 = 1 << {i};", flag(&label.name));
            }
        }
        Kind::Enum(labels) => {
            let _ = writeln!(out, "export enum {name} {{");
            for label in labels {
                out += &comment(&label.doc, "  //");
                let _ = writeln!(out, "  {},", flag(&label.name));
            }
        }
    }
    out + "}\n\n"
}
