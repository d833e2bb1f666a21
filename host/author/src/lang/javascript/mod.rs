//! JavaScript and TypeScript by jco, with QuickJS in the component and WASI stubbed: a clock is a fault, and `Math.random` a fixed
//! sequence.
//!
//! QuickJS takes a `u64` for a number: exact up to 2^53, which is 104 days in ns.

mod glue;

use super::{Block, File, banner};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::manifest::{Prepare, Step};
use crate::names::{camel, comment, lower_camel};
use std::fmt::Write;

/// The version that the tests build with, and what it must be pinned with.
const JCO: &str = "1.35.0";
const PREVIEW2_SHIM: &str = "0.26.0";
const COMPONENTIZE_QJS: &str = "0.4.5";

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    JavaScript,
    TypeScript,
}

impl Dialect {
    fn source(self) -> &'static str {
        match self {
            Self::JavaScript => "block.js",
            Self::TypeScript => "block.ts",
        }
    }

    fn glue(self) -> &'static str {
        match self {
            Self::JavaScript => "glue.js",
            Self::TypeScript => "glue.ts",
        }
    }
}

/// Words that no constant of a module can have for a name, and those that the author's file has.
#[rustfmt::skip]
const RESERVED: &[&str] = &[
    "arguments", "await", "break", "case", "catch", "class", "const", "continue", "debugger", "default", "delete", "do", "else",
    "enum", "eval", "export", "extends", "false", "finally", "for", "function", "if", "implements", "import", "in", "instanceof",
    "interface", "let", "new", "null", "package", "private", "protected", "public", "retained", "return", "settings", "static",
    "super", "switch", "this", "throw", "true", "try", "typeof", "undefined", "var", "void", "while", "with", "yield",
];

/// Before the block: QuickJS seeds its own generator with the time of the build.
const RANDOM: &str = "// Math.random() as every instance, and every build, has it: a fixed sequence.
let state = 0;
Math.random = () => {
  state = (state + 0x6d2b79f5) | 0;
  let x = Math.imul(state ^ (state >>> 15), state | 1);
  x ^= x + Math.imul(x ^ (x >>> 7), x | 61);
  return ((x ^ (x >>> 14)) >>> 0) / 4294967296;
};
";

pub(super) fn step(block: &Block, dialect: Dialect) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let command = [
        "npx",
        "--no-install",
        "jco",
        "componentize",
        dialect.glue(),
        "--wit",
        "wit",
        "--world-name",
        "block",
        "--backend",
        "qjs",
        "--backend-qjs-disable-async",
        "--backend-qjs-stub-wasi",
        "-o",
        &output,
    ];
    let prepare = Prepare {
        command: ["npm", "install", "--no-audit", "--no-fund"].map(str::to_owned).to_vec(),
        makes: super::PACKAGES.into(),
    };
    Step { prepare: Some(prepare), ..super::step(&command, output.clone()) }
}

/// What the block is built from, and types for editors and the compiler of TypeScript.
pub(super) fn generated(block: &Block, dialect: Dialect) -> Vec<File> {
    let class = &block.class;
    let random = match dialect {
        Dialect::JavaScript => "random.js",
        Dialect::TypeScript => "random.ts",
    };
    let mut files = vec![glue::text(block, dialect), File::new(random, RANDOM)];
    if dialect == Dialect::TypeScript {
        let mut out = banner(block, "//");
        for ty in &class.types {
            out += &type_text(class, ty);
        }
        files.push(File::new("class.ts", out.trim_end().to_owned() + "\n"));
    }
    files
}

fn type_text(class: &Class, ty: &TypeDef) -> String {
    let mut out = comment(&ty.doc, "//");
    let name = camel(&ty.name);
    match &ty.kind {
        Kind::Record(fields) => {
            let _ = writeln!(out, "export interface {name} {{");
            for field in fields {
                out += &comment(&field.doc, "  //");
                let _ = writeln!(out, "  {}: {};", lower_camel(&field.name), type_name(class, field.ty));
            }
            out += "}\n\n";
        }
        Kind::Flags(labels) => {
            let _ = writeln!(out, "export interface {name} {{");
            for label in labels {
                out += &comment(&label.doc, "  //");
                let _ = writeln!(out, "  {}: boolean;", lower_camel(&label.name));
            }
            out += "}\n\n";
        }
        Kind::Enum(labels) => {
            let labels: Vec<String> = labels.iter().map(|l| format!("{:?}", l.name)).collect();
            let _ = writeln!(out, "export type {name} = {};\n", labels.join(" | "));
        }
    }
    out
}

fn type_name(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "boolean".into(),
        Ty::Named(index) => camel(&class.types[index].name),
        _ => "number".into(),
    }
}

pub(super) fn authored(block: &Block, dialect: Dialect) -> Vec<File> {
    let class = &block.class;
    let typed = dialect == Dialect::TypeScript;
    let as_type = |name: &str| if typed { format!(": {name}") } else { String::new() };
    let mut out = comment(super::tagline(class), "//");
    out += "//\n// Time is an argument: add up scan.elapsed (ns), and ask no clock. NaN and infinity may come in.\n";
    if typed {
        let groups = [
            Some(class.scan),
            class.settings,
            class.inputs,
            class.commands,
            class.outputs,
            class.alarms,
            class.retained,
        ];
        let names: Vec<String> = groups.into_iter().flatten().map(|t| camel(&class.types[t].name)).collect();
        let _ = writeln!(out, "import type {{ {} }} from \"./class\";", names.join(", "));
    }
    out += "\n";
    for (variable, name, ty) in [("settings", "Settings", class.settings), ("retained", "Retained", class.retained)] {
        if let Some(ty) = ty {
            let _ = writeln!(out, "let {variable}{} = {};", as_type(name), literal(class, Ty::Named(ty), 0));
        }
    }
    let name = lower_camel(&class.name);
    // What cannot be the name of a constant can be that of an export.
    let taken = RESERVED.contains(&name.as_str());
    let _ = writeln!(out, "\n{} = {{", if taken { "const block".to_owned() } else { format!("export const {name}") });
    if let Some(ty) = class.settings {
        if class.defaults {
            let _ = writeln!(
                out,
                "  defaults(){} {{\n    return {};\n  }},\n",
                as_type("Settings"),
                literal(class, Ty::Named(ty), 2)
            );
        }
        let _ = writeln!(
            out,
            "  // Refuse settings with a sentence: throw \"…\"\n  configure(next{}){} {{\n    settings = next;\n  }},\n",
            as_type("Settings"),
            as_type("void")
        );
    }
    let parameters = class.execute_parameters().into_iter().map(|(n, _)| format!("{n}{}", as_type(&camel(n))));
    let results: Vec<String> = class.execute_results().into_iter().map(|(n, _)| camel(n)).collect();
    let result = match &results[..] {
        [] => "void".to_owned(),
        [one] => one.clone(),
        both => format!("[{}]", both.join(", ")),
    };
    let _ = writeln!(out, "  execute({}){} {{", parameters.collect::<Vec<_>>().join(", "), as_type(&result));
    let constant = |t: &str, l: &str| format!("{t}.{}", lower_camel(l));
    out += &comment(&super::execute_names(class, ".", &|n| lower_camel(n), &constant), "    //");
    let values: Vec<String> =
        class.execute_results().into_iter().map(|(_, ty)| literal(class, Ty::Named(ty), 2)).collect();
    match &values[..] {
        [] => {}
        [one] => {
            let _ = writeln!(out, "    return {one};");
        }
        both => {
            let _ = writeln!(out, "    return [{}];", both.join(", "));
        }
    }
    out += "  },\n";
    if class.retained.is_some() {
        let _ = writeln!(
            out,
            "\n  save(){} {{\n    return retained;\n  }},\n\n  restore(state{}){} {{\n    retained = state;\n  }},",
            as_type("Retained"),
            as_type("Retained"),
            as_type("void")
        );
    }
    out += "};\n";
    if taken {
        let _ = writeln!(out, "\nexport {{ block as {name} }};");
    }
    let package = format!(
        "{{\n  \"name\": \"{}\",\n  \"private\": true,\n  \"type\": \"module\",\n  \"devDependencies\": {{\n    \"@bytecodealliance/jco\": \"{JCO}\"\n  }},\n  \
         \"overrides\": {{\n    \"@bytecodealliance/preview2-shim\": \"{PREVIEW2_SHIM}\",\n    \"componentize-qjs\": \"{COMPONENTIZE_QJS}\"\n  }}\n}}\n",
        block.name
    );
    vec![File::new(dialect.source(), out), File::new("package.json", package)]
}

/// A value at rest.
fn literal(class: &Class, ty: Ty, indent: usize) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Record(fields) => {
                let fields: Vec<String> = fields
                    .iter()
                    .map(|f| format!("{}: {}", lower_camel(&f.name), literal(class, f.ty, indent + 1)))
                    .collect();
                let line = format!("{{ {} }}", fields.join(", "));
                if line.len() <= 90 {
                    return line;
                }
                let pad = "  ".repeat(indent + 1);
                format!("{{\n{pad}{},\n{}}}", fields.join(&format!(",\n{pad}")), "  ".repeat(indent))
            }
            Kind::Flags(labels) => {
                let labels: Vec<String> = labels.iter().map(|l| format!("{}: false", lower_camel(&l.name))).collect();
                format!("{{ {} }}", labels.join(", "))
            }
            Kind::Enum(cases) => format!("{:?}", cases[0].name),
        },
        _ => "0".into(),
    }
}
