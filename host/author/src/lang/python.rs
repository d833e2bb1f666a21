//! Python by componentize-py, with the interpreter in the component and WASI stubbed: a clock is a fault, `random` a fixed sequence.

use super::{Block, File, banner};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::manifest::Step;
use crate::names::{camel, comment, shout, snake, unless};
use std::fmt::Write;

const KEYWORDS: &[&str] = &[
    "and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else", "except",
    "finally", "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise",
    "return", "try", "while", "with", "yield",
];

pub(super) fn step(block: &Block) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let command =
        ["componentize-py", "-d", "wit", "-w", "block", "componentize", "glue", "--stub-wasi", "-o", output.as_str()];
    super::step(&command, output.clone())
}

fn ident(name: &str) -> String {
    let name = snake(name);
    if KEYWORDS.contains(&name.as_str()) { name + "_" } else { name }
}

/// Words of Python that begin as types do.
const CAPITALS: [&str; 3] = ["False", "None", "True"];

/// `Block` is the author's, `Err` is how settings are refused.
fn type_ident(name: &str) -> String {
    unless(&["Block", "Err", CAPITALS[0], CAPITALS[1], CAPITALS[2]], camel(name))
}

/// As componentize-py names a type or a class.
fn there(name: &str) -> String {
    let name = camel(name);
    if CAPITALS.contains(&name.as_str()) { name + "_" } else { name }
}

/// What componentize-py writes by these names it needs itself.
pub(super) fn refuses(class: &Class) -> Option<String> {
    let own = class.types.iter().find(|t| ["Enum", "Flag"].contains(&camel(&t.home.name).as_str()))?;
    let (name, base) = (&own.home.name, camel(&own.home.name));
    Some(format!("a type of the name `{name}` hides Python's own `{base}`, which the other types are made from"))
}

fn constant(ty: &str, label: &str) -> String {
    format!("{}.{}", type_ident(ty), shout(label))
}

/// `from … import …`, a line for each interface that defines types of the class, its own first.
fn imports(class: &Class) -> String {
    let mut modules: Vec<(String, Vec<String>)> = Vec::new();
    let mut types: Vec<&TypeDef> = class.types.iter().collect();
    types.sort_by_key(|t| (!t.home.class, t.shared, camel(&t.name)));
    for ty in types {
        let home = &ty.home;
        let part = if home.class { "exports" } else { "imports" };
        let module = format!("wit_world.{part}.{}", ident(&home.interface));
        let (there, here) = (there(&home.name), type_ident(&ty.name));
        let name = if there == here { here } else { format!("{there} as {here}") };
        match modules.iter_mut().find(|(m, _)| *m == module) {
            Some((_, names)) => names.push(name),
            None => modules.push((module, vec![name])),
        }
    }
    modules.iter().map(|(module, names)| format!("from {module} import {}\n", names.join(", "))).collect()
}

/// componentize-py makes an object of its own for each function, so what they share is apart from them.
pub(super) fn generated(block: &Block) -> Vec<File> {
    let class = &block.class;
    let name = there(&class.name);
    let mut out = banner(block, "#");
    out += "import random\n\n# Before the block: every instance, and every build, draws the same numbers.\nrandom.seed(0)\n\n";
    out += "from app import Block\nfrom wit_world import exports\n\nblock = Block()\n\n\n";
    let _ = writeln!(out, "class {name}(exports.{name}):");
    let parameters: Vec<&str> = class.execute_parameters().iter().map(|(n, _)| *n).collect();
    let parameters = parameters.join(", ");
    let functions = [
        (class.defaults, "defaults", ""),
        (class.settings.is_some(), "configure", "settings"),
        (true, "execute", parameters.as_str()),
        (class.retained.is_some(), "save", ""),
        (class.retained.is_some(), "restore", "state"),
    ];
    for (_, function, parameters) in functions.into_iter().filter(|(there, _, _)| *there) {
        let own = if parameters.is_empty() { "self".to_owned() } else { format!("self, {parameters}") };
        let _ = writeln!(out, "    def {function}({own}):\n        return block.{function}({parameters})\n");
    }
    vec![File::new("glue.py", out.trim_end().to_owned() + "\n")]
}

pub(super) fn authored(block: &Block) -> Vec<File> {
    let class = &block.class;
    let mut out = format!(
        "\"\"\"{}\n\nTime is an argument: add up scan.elapsed (ns), and ask no clock. NaN and infinity may come in.\n\"\"\"\n",
        super::tagline(class)
    );
    out += &imports(class);
    if class.settings.is_some() {
        out += "from componentize_py_types import Err\n";
    }
    let _ = writeln!(out, "\n\nclass Block:\n    def __init__(self) -> None:");
    let start = out.len();
    for (field, ty) in [("settings", class.settings), ("retained", class.retained)] {
        if let Some(ty) = ty {
            let _ = writeln!(out, "        self.{field} = {}", literal(class, Ty::Named(ty)));
        }
    }
    if out.len() == start {
        out += "        pass\n";
    }
    if let Some(ty) = class.settings {
        if class.defaults {
            let _ = writeln!(
                out,
                "\n    def defaults(self) -> Settings:\n        return {}",
                literal(class, Ty::Named(ty))
            );
        }
        out += "\n    def configure(self, settings: Settings) -> None:\n        # Refuse settings with a sentence: raise Err(\"…\")\n        self.settings = settings\n";
    }
    let parameters = class.execute_parameters().into_iter().map(|(n, _)| format!(", {n}: {}", camel(n)));
    let results: Vec<String> = class.execute_results().into_iter().map(|(n, _)| camel(n)).collect();
    let result = match &results[..] {
        [] => "None".to_owned(),
        [one] => one.clone(),
        both => format!("tuple[{}]", both.join(", ")),
    };
    let _ = writeln!(out, "\n    def execute(self{}) -> {result}:", parameters.collect::<String>());
    out += &comment(&super::execute_names(class, ".", &ident, &constant), "        #");
    let values: Vec<String> =
        class.execute_results().into_iter().map(|(_, ty)| literal(class, Ty::Named(ty))).collect();
    let _ = writeln!(out, "        return {}", if values.is_empty() { "None".into() } else { values.join(", ") });
    if class.retained.is_some() {
        out += "\n    def save(self) -> Retained:\n        return self.retained\n\n    def restore(self, state: Retained) -> None:\n        self.retained = state\n";
    }
    vec![File::new("app.py", out), File::new("requirements.txt", "componentize-py==0.25.1\n")]
}

/// A value at rest.
fn literal(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "False".into(),
        Ty::F32 | Ty::F64 => "0.0".into(),
        Ty::Named(index) => {
            let def = &class.types[index];
            let name = type_ident(&def.name);
            match &def.kind {
                Kind::Record(fields) => {
                    let fields = fields.iter().map(|f| format!("{}={}", ident(&f.name), literal(class, f.ty)));
                    format!("{name}({})", fields.collect::<Vec<_>>().join(", "))
                }
                Kind::Flags(_) => format!("{name}(0)"),
                Kind::Enum(cases) => format!("{name}.{}", shout(&cases[0].name)),
            }
        }
        _ => "0".into(),
    }
}
