//! The first test of a project: it passes with the logic that `new` writes, and names every port.

use crate::abi::{Leaf, Tuple};
use crate::class::{Class, Kind, Ty};
use crate::lang::Block;
use std::fmt::Write;

/// The test file; `memory` is what the block needs, if that is more than blocks get.
pub(crate) fn test_file(block: &Block, memory: Option<&str>) -> String {
    let (name, class) = (&block.name, &block.class);
    let memory = memory.map_or_else(String::new, |m| format!("memory = \"{m}\"\n"));
    let mut text = format!(
        "# latchwork test {name}.test.toml\ncomponent = \"{name}.wasm\"\nevery = \"10ms\"\n{memory}\n[[case]]\nname = \"nothing is on at rest\"\n"
    );
    if let Some(settings) = class.settings.filter(|_| !class.defaults) {
        let _ = writeln!(text, "settings = {}", table(class, "settings", settings));
    }
    text += "\n[[case.step]]\nat = \"0ms\"\n";
    if let Some(inputs) = class.inputs {
        let _ = writeln!(text, "inputs = {}", table(class, "inputs", inputs));
    }
    let mut expect = Vec::new();
    if let Some(outputs) = class.outputs {
        expect.push(format!("outputs = {}", table(class, "outputs", outputs)));
    }
    if class.alarms.is_some() {
        expect.push("alarms = []".to_owned());
    }
    // A String takes whatever is written.
    let _ = writeln!(text, "expect = {{ {} }}", expect.join(", "));
    text
}

/// `{ value = 0.0, on = false }`: every port at rest.
fn table(class: &Class, group: &str, ty: usize) -> String {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for leaf in Tuple::new(class, &[(group, ty)]).leaves {
        let (path, value) = port(class, group, ty, &leaf);
        if !pairs.iter().any(|(p, _)| *p == path) {
            pairs.push((path, value));
        }
    }
    let pairs: Vec<String> = pairs.into_iter().map(|(p, v)| format!("{p} = {v}")).collect();
    format!("{{ {} }}", pairs.join(", "))
}

/// Name and value of the port that a leaf belongs to: durations are one port, and signals but in settings, which come from no tag.
fn port(class: &Class, group: &str, ty: usize, leaf: &Leaf) -> (String, String) {
    let mut names = Vec::new();
    let mut fields = class.fields(ty);
    for part in &leaf.path[1..] {
        names.push(part.as_str());
        let Some(field) = fields.iter().find(|f| f.name == *part) else { break };
        let Ty::Named(inner) = field.ty else { break };
        if is_duration(class, inner) {
            return (key(&names), "\"0ms\"".into());
        }
        if let Some(value) = signal(class, inner)
            && group != "settings"
        {
            return (key(&names), zero(class, value));
        }
        fields = class.fields(inner);
    }
    (key(&names), zero(class, leaf.ty))
}

/// By its structure, as the runtime tells it.
fn is_duration(class: &Class, ty: usize) -> bool {
    matches!(class.fields(ty), [f] if f.name == "ns" && f.ty == Ty::U64)
}

/// The value's type of a signal, by its structure.
fn signal(class: &Class, ty: usize) -> Option<Ty> {
    let [value, quality] = class.fields(ty) else { return None };
    let Ty::Named(index) = quality.ty else { return None };
    let Kind::Enum(cases) = &class.types[index].kind else { return None };
    let named = value.name == "value" && quality.name == "quality";
    let qualities = cases.iter().map(|c| c.name.as_str()).eq(["good", "uncertain", "bad"]);
    (named && qualities && matches!(value.ty, Ty::F64 | Ty::Bool)).then_some(value.ty)
}

fn key(names: &[&str]) -> String {
    names.join(".")
}

fn zero(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::F32 | Ty::F64 => "0.0".into(),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Enum(cases) => format!("{:?}", cases[0].name),
            _ => "\"\"".into(),
        },
        _ => "0".into(),
    }
}
