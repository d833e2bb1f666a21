//! `latchwork tags PLANT`

use super::load;
use crate::Exit;
use crate::args::Tags;
use crate::report;
use anyhow::Result;
use comfy_table::{Table, presets};
use latchwork_block::Engine;
use latchwork_image::Source;
use latchwork_plant::assemble::{Options, Plant, Time, assemble};
use latchwork_plant::model::TagRef;
use serde::Serialize;

/// One tag as users see it.
#[derive(Serialize)]
struct Row {
    tag: String,
    #[serde(rename = "type")]
    ty: String,
    /// Who writes it, or what it reads.
    source: String,
}

pub(super) fn execute(engine: &Engine, args: &Tags) -> Result<Exit> {
    let Some(model) = load(engine, &args.plant, args.sim) else { return Ok(Exit::Wanting) };
    let plant = assemble(model, engine, &Options { time: Time::Virtual, trace: None })?;
    let rows = rows(&plant);
    if args.json {
        report::say(&format!("{}\n", serde_json::to_string_pretty(&rows)?));
        return Ok(Exit::Fine);
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["tag", "type", "source"]);
    for row in rows {
        table.add_row([row.tag, row.ty, row.source]);
    }
    report::say(&format!("{table}\n"));
    Ok(Exit::Fine)
}

fn rows(plant: &Plant) -> Vec<Row> {
    let mut what: Vec<_> = plant.layout.ids.iter().map(|(what, id)| (*id, *what)).collect();
    what.sort_unstable_by_key(|(id, _)| *id);
    what.into_iter()
        .map(|(id, what)| {
            let tag = plant.layout.tags.get(id);
            Row { tag: tag.name.clone(), ty: tag.ty.to_string(), source: source(plant, what, &tag.source) }
        })
        .collect()
}

fn source(plant: &Plant, what: TagRef, source: &Source) -> String {
    let model = &plant.model;
    match (what, source) {
        (_, Source::Alias { tag, not }) => {
            format!("reads {}{}", if *not { "not " } else { "" }, plant.layout.tags.get(*tag).name)
        }
        (TagRef::Input { block, port }, Source::Constant(cell)) => match model.blocks[block].inputs[port] {
            latchwork_plant::model::Input::Unwired => "not wired".into(),
            _ => format!("constant {}", model.tag_type(what).format(*cell)),
        },
        (TagRef::Point { driver, .. }, _) => format!("driver {}", model.drivers[driver].config.name),
        (TagRef::Output { block, .. } | TagRef::Alarm { block, .. }, _) => {
            format!("lane {}", model.lanes[model.blocks[block].lane].name)
        }
        (TagRef::Lane { lane, .. }, _) => format!("lane {}", model.lanes[lane].name),
        (TagRef::Command { .. } | TagRef::Setting { .. }, _) => "operators".into(),
        (TagRef::Input { .. }, _) => "-".into(),
    }
}
