//! `latchwork doctor [PLANT]`

use super::load;
use crate::Exit;
use crate::args::Doctor;
use crate::doctor::{Cache, LaneKind, LaneNeeds, LineName, LineNeeds, Machine, Needs, Status, examine, json, text};
use crate::report;
use anyhow::Result;
use latchwork_block::Engine;
use latchwork_io::driver::DriverConfig;
use latchwork_plant::model::{Lane, Model};

pub(super) fn execute(engine: impl Fn() -> Result<Engine>, args: &Doctor, cache: Cache) -> Result<Exit> {
    // Without a plant no engine is needed: the machine may be one on which it does not start.
    let plant = match &args.plant {
        Some(plant) => match load(&engine()?, plant, false) {
            Some(model) => Some((model.name.clone(), needs(&model))),
            None => return Ok(Exit::Wanting),
        },
        None => None,
    };
    let needs = plant.as_ref().map(|(_, needs)| needs);
    let groups = examine(&Machine::this(needs, cache), needs);
    if args.json {
        report::say(&format!("{}\n", json(&groups)?));
    } else {
        let title = match &plant {
            Some((name, _)) => format!("This machine for plant {name}"),
            None => "This machine, for any plant (name one to see what it needs)".into(),
        };
        let colours = std::io::IsTerminal::is_terminal(&std::io::stdout()) && report::colours();
        report::say(&text(&title, &groups, colours));
    }
    let bad = groups.iter().any(|(_, findings)| findings.iter().any(|f| f.status == Status::Bad));
    Ok(if bad { Exit::Wanting } else { Exit::Fine })
}

/// What a plant needs of its machine.
fn needs(model: &Model) -> Needs {
    let of_kind = |kind: &'static str| model.drivers.iter().filter(move |d| d.kind.name == kind).map(|d| &d.config);
    Needs {
        lanes: model.lanes.iter().map(lane).collect(),
        gpio: of_kind("gpio").map(|d| (d.name.clone(), d.values.text("chip").map(String::from))).collect(),
        rppal: of_kind("rppal").map(|d| d.name.clone()).collect(),
        lines: ["gpio", "rppal"].into_iter().flat_map(of_kind).flat_map(lines).collect(),
        serial: of_kind("modbus-rtu").filter_map(|d| d.values.text("device")).map(Into::into).collect(),
        watchdog: model.watchdog.as_ref().map(|(path, _)| path.clone()),
    }
}

/// The lines of a driver's points. PWM channels are none.
fn lines(driver: &DriverConfig) -> impl Iterator<Item = LineNeeds> {
    driver.points.iter().filter_map(|point| {
        let number = point.values.integer("line").or_else(|| point.values.integer("pin"));
        let line = match (number, point.values.text("line")) {
            (Some(number), _) => LineName::Number(u32::try_from(number).ok()?),
            (None, Some(name)) => LineName::Name(name.into()),
            (None, None) => return None,
        };
        let chip = driver.values.text("chip").map(String::from);
        Some(LineNeeds { point: format!("{}.{}", driver.name, point.name), chip, line })
    })
}

fn lane(lane: &Lane) -> LaneNeeds {
    let kind = match &lane.interrupt {
        None => LaneKind::Cyclic,
        Some(interrupt) if interrupt.poll => LaneKind::Poll,
        Some(_) => LaneKind::Edges,
    };
    LaneNeeds { name: lane.name.clone(), priority: lane.priority, cpu: lane.cpu, kind }
}
