//! The ports as structs, and the functions between them and the canonical ABI.

use super::super::{Block, File, banner};
use super::{execute_result, ident, type_ident, type_name};
use crate::abi::{Core, Leaf, Tuple, word};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::names::comment;
use std::fmt::Write;

fn core(core: Core) -> &'static str {
    match core {
        Core::I32 => "u32",
        Core::I64 => "u64",
        Core::F32 => "f32",
        Core::F64 => "f64",
    }
}

/// A leaf from a core value.
fn lift(class: &Class, ty: Ty, value: &str) -> String {
    match ty {
        Ty::Bool => format!("{value} != 0"),
        Ty::U8 | Ty::U16 => format!("@truncate({value})"),
        Ty::S8 => format!("@bitCast(@as(u8, @truncate({value})))"),
        Ty::S16 => format!("@bitCast(@as(u16, @truncate({value})))"),
        Ty::S32 | Ty::S64 => format!("@bitCast({value})"),
        Ty::U32 | Ty::U64 | Ty::F32 | Ty::F64 => value.to_owned(),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Enum(_) => format!("@enumFromInt({value})"),
            kind => format!("@bitCast(@as(u{}, @truncate({value})))", word(kind) * 8),
        },
    }
}

/// A core value from a leaf.
fn lower(class: &Class, ty: Ty, value: &str) -> String {
    match ty {
        Ty::Bool => format!("@intFromBool({value})"),
        Ty::S8 | Ty::S16 => format!("@bitCast(@as(i32, {value}))"),
        Ty::S32 | Ty::S64 => format!("@bitCast({value})"),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Enum(_) => format!("@intFromEnum({value})"),
            kind => format!("@as(u{}, @bitCast({value}))", word(kind) * 8),
        },
        _ => value.to_owned(),
    }
}

fn place(path: &[String]) -> String {
    crate::lang::place(path, &ident)
}

pub(in crate::lang) fn generated(block: &Block) -> Vec<File> {
    let (class, abi) = (&block.class, &block.abi);
    let mut out = banner(block, "//");
    out += "const block = @import(\"block.zig\");\n\n";
    for ty in &class.types {
        out += &type_text(class, ty);
    }
    let both = class.outputs.is_some() && class.alarms.is_some();
    if both {
        out += "/// What an execution returns.\npub const Result = extern struct { outputs: Outputs, alarms: Alarms = .{} };\n\n";
    }
    out += LOG;
    out += "\n/// Plant time, ns.\nvar now: u64 = 0;\nexport fn latchwork_now() u64 {\n    return now;\n}\n\n";
    if let Some(size) = abi.spill() {
        let _ = writeln!(out, "/// More than 16 parameters come by a pointer into this memory; one call at a time.");
        let _ = writeln!(out, "var arguments: [{size}]u8 align(8) = undefined;\n");
        out += "export fn cabi_realloc(_: usize, old: usize, alignment: usize, size: usize) usize {\n";
        out += "    if (old != 0 or alignment > 8 or size > arguments.len) @trap();\n    return @intFromPtr(&arguments);\n}\n\n";
    }
    if let Some((ty, tuple)) = class.settings.zip(abi.settings.as_ref()) {
        if class.defaults {
            export(&mut out, class, "defaults", None, &[("settings", ty)], "Settings", "block.defaults()");
        }
        export(&mut out, class, "configure", Some((&[("settings", ty)], tuple)), &[], "", "block.configure(settings)");
    }
    let names: Vec<&str> = class.execute_parameters().iter().map(|(n, _)| *n).collect();
    let call = format!("block.execute({})", names.join(", "));
    let results = class.execute_results();
    let result = execute_result(class);
    export(&mut out, class, "execute", Some((&class.execute_parameters(), &abi.execute)), &results, result, &call);
    if let Some((ty, tuple)) = class.retained.zip(abi.retained.as_ref()) {
        export(&mut out, class, "save", None, &[("state", ty)], "Retained", "block.save()");
        export(&mut out, class, "restore", Some((&[("state", ty)], tuple)), &[], "", "block.restore(state)");
    }
    vec![File::new("class.zig", out.trim_end().to_owned() + "\n")]
}

const LOG: &str = r#"/// A line for the plant's records. Only a block that calls it imports the log.
pub const log = struct {
    pub const Level = enum(u32) { debug, info, warning, @"error" };
    pub fn write(level: Level, message: []const u8) void {
        host.write(@intFromEnum(level), message.ptr, message.len);
    }
};
const host = struct {
    extern "latchwork:block/log@0.1.0" fn write(level: u32, message: [*]const u8, bytes: usize) void;
};
"#;

fn type_text(class: &Class, ty: &TypeDef) -> String {
    let mut out = comment(&ty.doc, "///");
    let name = type_ident(&ty.name);
    match &ty.kind {
        Kind::Record(fields) => {
            let _ = writeln!(out, "pub const {name} = extern struct {{");
            for field in fields {
                out += &comment(&field.doc, "    ///");
                let _ = writeln!(out, "    {}: {},", ident(&field.name), type_name(class, field.ty));
            }
        }
        Kind::Flags(labels) => {
            let bits = word(&ty.kind) * 8;
            let _ = writeln!(out, "pub const {name} = packed struct(u{bits}) {{");
            for label in labels {
                out += &comment(&label.doc, "    ///");
                let _ = writeln!(out, "    {}: bool = false,", ident(&label.name));
            }
            if bits > labels.len() {
                let _ = writeln!(out, "    _: u{} = 0,", bits - labels.len());
            }
        }
        Kind::Enum(labels) => {
            let _ = writeln!(out, "pub const {name} = enum(u{}) {{", word(&ty.kind) * 8);
            for label in labels {
                out += &comment(&label.doc, "    ///");
                let _ = writeln!(out, "    {},", ident(&label.name));
            }
        }
    }
    out + "};\n\n"
}

/// One exported function.
fn export(
    out: &mut String,
    class: &Class,
    name: &str,
    parameters: Option<(&[(&str, usize)], &Tuple)>,
    results: &[(&str, usize)],
    result: &str,
    call: &str,
) {
    let tuple = Tuple::new(class, results);
    let leaves: &[Leaf] = parameters.map_or(&[], |(_, t)| &t.leaves);
    let groups: &[(&str, usize)] = parameters.map_or(&[], |(g, _)| g);
    let spilled = parameters.is_some_and(|(_, t)| t.spilled());
    let list = if spilled {
        let fields = groups.iter().map(|(n, t)| format!("{n}: {}", type_name(class, Ty::Named(*t))));
        format!("at: *const extern struct {{ {} }}", fields.collect::<Vec<_>>().join(", "))
    } else {
        let typed = leaves.iter().enumerate().map(|(i, l)| format!("p{i}: {}", core(l.core())));
        typed.collect::<Vec<_>>().join(", ")
    };
    let refusal = name == "configure";
    let returned = match &tuple.leaves[..] {
        _ if refusal => "usize",
        [] => "void",
        [one] => core(one.core()),
        _ => "usize",
    };
    if refusal {
        out.push_str("var refusal: extern struct { refused: u8, why: ?[*]const u8, bytes: usize } = undefined;\n");
    } else if tuple.leaves.len() > 1 {
        let _ = writeln!(out, "var {name}_result: {result} = undefined;");
    }
    let _ = writeln!(out, "export fn @\"{}#{name}\"({list}) {returned} {{", class.id);
    for (group, ty) in groups {
        if spilled {
            let _ = writeln!(out, "    const {group} = at.{group};");
            continue;
        }
        let typed = type_name(class, Ty::Named(*ty));
        let own: Vec<(usize, &Leaf)> = leaves.iter().enumerate().filter(|(_, l)| l.path[0] == **group).collect();
        match own[..] {
            [(i, leaf)] if leaf.path.len() == 1 => {
                let _ = writeln!(out, "    const {group}: {typed} = {};", lift(class, leaf.ty, &format!("p{i}")));
            }
            _ => {
                let _ = writeln!(out, "    var {group}: {typed} = undefined;");
                for (i, leaf) in own {
                    let _ = writeln!(out, "    {} = {};", place(&leaf.path), lift(class, leaf.ty, &format!("p{i}")));
                }
            }
        }
    }
    if name == "execute" {
        out.push_str("    now = scan.now;\n");
    }
    match &tuple.leaves[..] {
        _ if refusal => {
            let _ = writeln!(out, "    const why: ?[]const u8 = {call};");
            out.push_str("    refusal = .{ .refused = @intFromBool(why != null), .why = if (why) |w| w.ptr else null, .bytes = if (why) |w| w.len else 0 };\n");
            out.push_str("    return @intFromPtr(&refusal);\n");
        }
        [] => {
            let _ = writeln!(out, "    {call};");
        }
        [one] => {
            let _ = writeln!(out, "    const result: {result} = {call};");
            let rest: Vec<String> = one.path[1..].iter().map(|p| format!(".{}", ident(p))).collect();
            let _ = writeln!(out, "    return {};", lower(class, one.ty, &format!("result{}", rest.concat())));
        }
        _ => {
            let _ = writeln!(out, "    {name}_result = {call};\n    return @intFromPtr(&{name}_result);");
        }
    }
    out.push_str("}\n\n");
}
