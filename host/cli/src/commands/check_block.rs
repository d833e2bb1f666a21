//! `latchwork check-block COMPONENT`

use super::fuzz;
use crate::Exit;
use crate::args::fuzz::CheckBlock;
use crate::report;
use anyhow::Result;
use latchwork_block::{Class, Engine};
use latchwork_testbed::case::Subject;
use latchwork_testbed::check::{BlockCheck, Status, Verdict, check};
use latchwork_testbed::fuzz::Options;
use serde_json::json;
use std::sync::Arc;
use std::time::Instant;

pub(super) fn execute(engine: &Engine, args: &CheckBlock) -> Result<Exit> {
    let name = args.block.component.display().to_string();
    let component = match engine.load_file(&args.block.component) {
        Ok(component) => component,
        Err(error) => return refused(args, &name, &error.to_string()),
    };
    // All of its classes, unless one is named.
    let classes: Vec<Arc<Class>> = if args.block.class.is_some() {
        match fuzz::subject(engine, &args.block)? {
            Ok(subject) => vec![subject.class],
            Err(exit) => return Ok(exit),
        }
    } else {
        let names: Vec<String> = component.classes().map(|c| c.name.clone()).collect();
        names.iter().map(|n| component.class(Some(n))).collect::<Result<_, _>>()?
    };
    let options = Options { sequences: Some(args.runs), ..fuzz::options(&args.block) };
    let clock = fuzz::clock(Instant::now());
    let _ticker = fuzz::ticker(engine);
    let mut checks = Vec::new();
    for class in classes {
        let template = match component.template(&class) {
            Ok(template) => template,
            Err(error) => return refused(args, &name, &error.to_string()),
        };
        let subject = Subject { component: component.clone(), class, template };
        checks.push(check(&subject, &options, &clock));
    }
    let verdict = checks.iter().map(|c| c.verdict).max().unwrap_or(Verdict::Refused);
    let ok = verdict != Verdict::Refused;
    if args.block.json {
        let (name, hash, size) = (component.name(), component.hash(), component.size());
        let json = json!({
            "ok": ok, "verdict": verdict, "component": name, "hash": hash, "size": size, "classes": checks
        });
        report::say(&format!("{}\n", serde_json::to_string_pretty(&json)?));
    } else {
        report::say(&checks.iter().map(told).collect::<Vec<_>>().join("\n"));
        report::say(&format!("\n{name}: {} (seed {})\n", sentence(verdict), options.seed));
        let reservations = checks.iter().flat_map(|c| &c.reservations);
        report::say(&reservations.map(|r| format!("  {r}\n")).collect::<String>());
        report::say(&again(args, &checks, verdict, &options));
    }
    Ok(if ok && !(args.strict && verdict != Verdict::Accepted) { Exit::Fine } else { Exit::Wanting })
}

/// The search that shows how it comes to a verdict.
fn again(args: &CheckBlock, checks: &[BlockCheck], verdict: Verdict, options: &Options) -> String {
    let name = args.block.component.display();
    let such = checks.iter().find(|c| c.verdict == verdict);
    let Some(such) = such.filter(|_| verdict != Verdict::Accepted) else { return String::new() };
    let such = Some(such.fuzz.class.as_str()).filter(|_| checks.len() > 1);
    let class = args.block.class.as_deref().or(such).map_or(String::new(), |c| format!(" --class {c}"));
    let (runs, seed, limits) = (args.runs, options.seed, limits(options));
    format!("`latchwork fuzz {name}{class} --runs {runs} --seed {seed}{limits}` shows how it comes to that\n")
}

/// Limits that are not those that `latchwork fuzz` has by itself.
fn limits(options: &Options) -> String {
    let own = Options::default();
    let mut said = String::new();
    if options.budget != own.budget {
        said += &format!(" --budget {}", latchwork_image::format_duration(options.budget));
    }
    if options.memory != own.memory {
        said += &format!(" --memory {}", latchwork_schema::format_size(options.memory));
    }
    said
}

fn sentence(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Accepted => "a plant takes it",
        Verdict::AcceptedWithReservations => "a plant takes it, with reservations",
        Verdict::Refused => "not for a plant",
    }
}

/// A component that is not even loaded.
fn refused(args: &CheckBlock, name: &str, error: &str) -> Result<Exit> {
    if args.block.json {
        let verdict = Verdict::Refused;
        let json = json!({ "ok": false, "verdict": verdict, "component": name, "error": error, "classes": [] });
        report::say(&format!("{}\n", serde_json::to_string_pretty(&json)?));
    } else {
        report::say(&format!("bad   load         {error}\n\n{name}: {}\n", sentence(Verdict::Refused)));
    }
    Ok(Exit::Wanting)
}

fn told(check: &BlockCheck) -> String {
    let line = |l: &latchwork_testbed::check::Line| {
        let status = match l.status {
            Status::Fine => "fine",
            Status::Note => "note",
            Status::Doubt => "doubt",
            Status::Bad => "bad",
        };
        format!("{status:5} {:12} {}\n", l.name, l.found)
    };
    check.lines.iter().map(line).collect()
}
