//! `latchwork check PLANT`

use crate::Exit;
use crate::args::Check;
use crate::report;
use anyhow::Result;
use latchwork_block::Engine;
use latchwork_plant::assemble::{Options, Time, assemble};
use latchwork_plant::check::{CheckOptions, check_file};
use serde_json::json;

pub(super) fn execute(engine: &Engine, args: &Check) -> Result<Exit> {
    let checked = check_file(&args.plant, engine, CheckOptions { sim: args.sim });
    let mut findings = checked.json();
    if !args.json {
        eprint!("{}", checked.render(report::colours()));
    }
    let Some(model) = checked.model else {
        if args.json {
            report::say(&format!("{}\n", serde_json::to_string_pretty(&json!({ "ok": false, "findings": findings }))?));
        }
        return Ok(Exit::Wanting);
    };
    let counts = (model.blocks.len(), model.lanes.len(), model.drivers.len());
    let name = model.name.clone();
    // Assembling instantiates and configures every block: a block that refuses its settings is found here.
    let assembled = assemble(model, engine, &Options { time: Time::Virtual, trace: None });
    if args.json {
        if let (Err(error), Some(list)) = (&assembled, findings.as_array_mut()) {
            list.push(
                json!({ "severity": "error", "file": args.plant.display().to_string(), "message": error.to_string() }),
            );
        }
        let report = json!({ "ok": assembled.is_ok(), "findings": findings });
        report::say(&format!("{}\n", serde_json::to_string_pretty(&report)?));
        return Ok(if assembled.is_ok() { Exit::Fine } else { Exit::Wanting });
    }
    let plant = assembled?;
    let (blocks, lanes, drivers) = counts;
    let parts = [(blocks, "block"), (lanes, "lane"), (drivers, "driver"), (plant.layout.tags.len(), "tag")]
        .map(|(n, what)| format!("{n} {what}{}", if n == 1 { "" } else { "s" }));
    report::say(&format!("{name}: fine ({})\n", parts.join(", ")));
    Ok(Exit::Fine)
}
