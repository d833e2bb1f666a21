//! `latchwork inspect COMPONENT`

use crate::Exit;
use crate::args::Inspect;
use crate::report;
use anyhow::{Context, Result};
use comfy_table::{Table, presets};
use latchwork_block::{CallPath, Class, Component, Engine, Port, Template};
use serde_json::{Value, json};

pub(super) fn execute(engine: &Engine, args: &Inspect) -> Result<Exit> {
    let component = engine.load_file(&args.component).with_context(|| format!("{}", args.component.display()))?;
    let mut classes = Vec::new();
    for class in component.classes() {
        classes.push((class, component.template(class)?));
    }
    if args.json {
        report::say(&format!("{}\n", serde_json::to_string_pretty(&as_json(&component, &classes))?));
    } else {
        print(&component, &classes);
    }
    Ok(Exit::Fine)
}

fn path_name(template: &Template) -> &'static str {
    match template.path() {
        CallPath::Plain => "plain",
        CallPath::Component => "component",
    }
}

/// One line of the report: a port, or one flag of commands or alarms, which is a bool tag of its own.
struct Line {
    name: String,
    ty: String,
    signal: bool,
    doc: Option<String>,
}

/// The groups of ports in the order of the contract.
fn groups(class: &Class) -> [(&'static str, Vec<Line>); 6] {
    let port = |p: &Port| Line { name: p.path.clone(), ty: p.ty.to_string(), signal: p.signal, doc: p.doc.clone() };
    let ports = |ports: &[Port]| ports.iter().map(port).collect();
    let flags = |group: &str, names: &[String]| {
        let flag =
            |n: &String| Line { name: n.clone(), ty: "bool".into(), signal: false, doc: class.flag_doc(group, n) };
        names.iter().map(flag).collect()
    };
    [
        ("inputs", ports(&class.inputs)),
        ("outputs", ports(&class.outputs)),
        ("settings", ports(&class.settings)),
        ("commands", flags("commands", &class.commands)),
        ("alarms", flags("alarms", &class.alarms)),
        ("retained", ports(&class.retained)),
    ]
}

fn as_json(component: &Component, classes: &[(&Class, Template)]) -> Value {
    let classes: Vec<_> = classes
        .iter()
        .map(|(class, template)| {
            let mut entry = json!({
                "name": class.name,
                "docs": class.doc,
                "call-path": path_name(template),
                "why-not-plain": template.why_not_plain(),
            });
            for (group, ports) in groups(class) {
                entry[group] = ports
                    .into_iter()
                    .map(|l| json!({ "name": l.name, "type": l.ty, "signal": l.signal, "docs": l.doc }))
                    .collect();
            }
            entry
        })
        .collect();
    json!({
        "name": component.name(),
        "hash": component.hash(),
        "size": component.size(),
        "imports": component.imports(),
        "classes": classes,
    })
}

fn print(component: &Component, classes: &[(&Class, Template)]) {
    report::say(&format!("{}  {} bytes  sha256 {}\n", component.name(), component.size(), component.hash()));
    let imports = component.imports();
    report::say(&format!("imports: {}\n", if imports.is_empty() { "none".into() } else { imports.join(", ") }));
    for (class, template) in classes {
        report::say(&format!("\nclass {}\n", class.name));
        if let Some(doc) = &class.doc {
            report::say(&format!("{doc}\n"));
        }
        match template.why_not_plain() {
            Some(why) => report::say(&format!("call path: {} ({why})\n", path_name(template))),
            None => report::say(&format!("call path: {}\n", path_name(template))),
        }
        for (group, ports) in groups(class) {
            if ports.is_empty() {
                continue;
            }
            let mut table = Table::new();
            table.load_style(presets::NOTHING).set_content_arrangement(comfy_table::ContentArrangement::Dynamic);
            for line in ports {
                let ty = if line.signal { format!("{} + quality", line.ty) } else { line.ty };
                table.add_row([format!("  {}", line.name), ty, line.doc.unwrap_or_default()]);
            }
            report::say(&format!("\n {group}\n{table}\n"));
        }
    }
}
