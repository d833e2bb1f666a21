//! Interrupt lanes: what starts them, what they run with, which points they serve themselves.

use super::drivers::DriverDraft;
use super::lanes::LaneDraft;
use super::notes::origin;
use super::tags::Tags;
use super::{CheckOptions, Draft};
use crate::file::PlantFile;
use crate::model::{Input, Model, Served, TagRef};
use latchwork_image::{Type, nearest};
use latchwork_io::direct::Role;
use latchwork_schema::{Checker, Finding, Value};

/// SCHED_FIFO priority of the kernel's interrupt threads, which every edge passes through.
const KERNEL_THREADS: u8 = 50;

/// Resolves `on`, `also-with` and `[sim.scan-time]`.
pub(super) fn resolve(
    checker: &mut Checker,
    file: &PlantFile,
    lanes: &mut [LaneDraft],
    drivers: &[DriverDraft<'_>],
    tags: &Tags,
    options: CheckOptions,
) {
    let sound: Vec<_> = drivers.iter().filter_map(|d| d.driver.as_ref()).collect();
    let mut taken: Vec<((usize, usize), String)> = Vec::new();
    for (index, entry) in file.lanes.iter().enumerate().filter(|(_, e)| e.interrupt) {
        let values = &entry.values;
        let poll = values.has("poll");
        let mut on = Vec::new();
        let Some(Value::List(names)) = values.get("on") else { continue };
        if names.is_empty() {
            let finding = Finding::error(&values.span_of("on"), format!("nothing starts lane `{}`", entry.name));
            checker.add(finding.help("name the input points whose changes start it, as in `on = [\"gpio.door\"]`"));
        }
        for (name, span) in names {
            let Value::Text(name) = name else { continue };
            let Some(tag) = tags.find(checker, name, span) else { continue };
            let TagRef::Point { driver, point } = tag.tag else {
                let finding = Finding::error(span, format!("`{name}` is no point of a driver"));
                checker.add(finding.help("a lane starts on input points of drivers"));
                continue;
            };
            let of = sound[driver];
            if of.config.points[point].safe.is_some() {
                let finding = Finding::error(span, format!("`{name}` is an output point"));
                checker.add(finding.help("a lane starts on input points"));
                continue;
            }
            if !poll && of.kind.direct.is_none() && !of.simulated(options.sim) {
                let message =
                    format!("points of kind \"{}\" make no edges, so `{name}` cannot start a lane", of.kind.name);
                checker
                    .add(Finding::error(span, message).help("add `poll = \"1ms\"` to the lane: it reads them itself"));
                continue;
            }
            if !poll && tag.ty != Type::Bool {
                let finding = Finding::error(span, format!("`{name}` is {}; edges are those of a bool", tag.ty));
                checker.add(finding.help("add `poll = \"1ms\"` to the lane: it runs when the value has changed"));
                continue;
            }
            let fed = of.sources[point].is_some_and(|w| !matches!(w.tag, TagRef::Output { .. } | TagRef::Alarm { .. }));
            if !poll && fed {
                let finding = Finding::error(span, format!("`{name}` is fed by what no block makes"));
                checker.add(finding.help("in [sim.feed], an input that starts a lane takes an output of a block"));
                continue;
            }
            if on.contains(&(driver, point)) {
                checker.add(Finding::error(span, format!("`{name}` stands in `on` twice")));
                continue;
            }
            if !poll {
                if let Some((_, other)) = taken.iter().find(|(p, _)| *p == (driver, point)) {
                    let finding = Finding::error(span, format!("`{name}` starts lane `{other}` already"));
                    checker.add(finding.help("an edge starts one lane; put the blocks into that lane, or use `poll`"));
                    continue;
                }
                taken.push(((driver, point), entry.name.clone()));
            }
            on.push((driver, point));
        }
        let also_with = also_with(checker, file, entry, lanes);
        if let Some(interrupt) = &mut lanes[index].lane.interrupt {
            interrupt.on = on;
            interrupt.also_with = also_with;
        }
    }
    for entry in &file.scan_times {
        match lanes.iter_mut().find(|l| l.lane.name == entry.lane) {
            Some(draft) => draft.lane.scan_times = entry.times.clone(),
            None if file.refused_lanes.contains(&entry.lane) => {}
            None => {
                let names: Vec<_> = lanes.iter().map(|l| l.lane.name.as_str()).collect();
                let finding = Finding::error(&entry.key, format!("there is no lane `{}`", entry.lane));
                checker.add(finding.help(hint(&entry.lane, &names)));
            }
        }
    }
}

fn hint(name: &str, names: &[&str]) -> String {
    match nearest(name, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", names.join(", ")),
    }
}

fn also_with(
    checker: &mut Checker,
    file: &PlantFile,
    entry: &crate::file::LaneEntry,
    lanes: &[LaneDraft],
) -> Option<usize> {
    let name = entry.values.text("also-with")?;
    let span = entry.values.span_of("also-with");
    let found = lanes.iter().position(|l| l.lane.name == name);
    match found {
        Some(index) if lanes[index].lane.interrupt.is_some() => {
            let finding = Finding::error(&span, format!("lane `{name}` is an interrupt lane itself"));
            checker.add(finding.help("`also-with` names a cyclic lane, one with `every`"));
            None
        }
        None if !file.refused_lanes.iter().any(|l| l == name) => {
            let cyclic: Vec<_> =
                lanes.iter().filter(|l| l.lane.interrupt.is_none()).map(|l| l.lane.name.as_str()).collect();
            let finding = Finding::error(&span, format!("there is no lane `{name}`"));
            checker.add(finding.help(hint(name, &cyclic)));
            None
        }
        found => found,
    }
}

/// What an interrupt lane may want to know of its plant file, and no single key is wrong about.
pub(super) fn notes(checker: &mut Checker, file: &PlantFile, lanes: &[LaneDraft], drafts: &[Draft<'_>]) {
    for (index, entry) in file.lanes.iter().enumerate().filter(|(_, e)| e.interrupt) {
        let lane = &lanes[index].lane;
        let above = lanes.iter().find(|l| l.lane.interrupt.is_none() && l.lane.priority >= lane.priority);
        if let Some(above) = above {
            let message = format!(
                "cyclic lane `{}` has priority {}, interrupt lane `{}` only {}: its scans delay the reaction to an edge",
                above.lane.name, above.lane.priority, lane.name, lane.priority
            );
            checker.add(Finding::note(&entry.key, message).help("give the interrupt lane the higher priority"));
        }
        let edges = lane.interrupt.as_ref().is_some_and(|i| !i.poll);
        let busy = lanes.iter().find(|l| edges && l.lane.interrupt.is_none() && l.lane.priority >= KERNEL_THREADS);
        if let Some(busy) = busy {
            let message = format!(
                "cyclic lane `{}` has priority {}; the kernel's threads that pass edges on to lane `{}` have {KERNEL_THREADS}",
                busy.lane.name, busy.lane.priority, lane.name
            );
            let help = "give the cyclic lane less than 50, or the threads `irq/…` more (`latchwork doctor` tells how)";
            checker.add(Finding::note(&entry.key, message).help(help));
        }
        let commands = drafts.iter().find(|d| {
            d.entry.values.text("lane") == Some(&entry.name)
                && d.class.as_ref().is_some_and(|(_, class)| !class.commands.is_empty())
        });
        if let Some(draft) = commands
            && !entry.values.has("also-with")
        {
            let message = format!(
                "commands reach block `{}` only with the next edge: lane `{}` has no `also-with`",
                draft.entry.name, entry.name
            );
            checker.add(Finding::note(&entry.key, message).help("add `also-with = \"LANE\"` with a cyclic lane"));
        }
    }
}

/// Which points the interrupt lanes serve themselves.
pub(super) fn serve(model: &mut Model) {
    let served = served(model);
    for (lane, served) in model.lanes.iter_mut().zip(served) {
        lane.served = served;
    }
}

fn served(model: &Model) -> Vec<Vec<Served>> {
    let mut served: Vec<Vec<Served>> = vec![Vec::new(); model.lanes.len()];
    let direct = |driver: usize| {
        let d = &model.drivers[driver];
        d.kind.direct.is_some() && !d.simulated(model.sim)
    };
    let is_taken = |served: &[Vec<Served>], driver: usize, point: usize| {
        served.iter().flatten().any(|s| (s.driver, s.point) == (driver, point))
    };
    let interrupts = || model.lanes.iter().enumerate().filter_map(|(i, l)| Some((i, l.interrupt.as_ref()?)));
    for (lane, interrupt) in interrupts().filter(|(_, i)| !i.poll) {
        let edges =
            interrupt.on.iter().map(|(driver, point)| Served { driver: *driver, point: *point, role: Role::Edge });
        served[lane].extend(edges);
    }
    for (lane, interrupt) in interrupts() {
        let blocks = model.blocks.iter().enumerate().filter(|(_, b)| b.lane == lane);
        let wired = blocks.flat_map(|(block, b)| {
            let inputs = b.inputs.iter().enumerate().filter(|(_, i)| matches!(i, Input::Wire(_)));
            inputs.map(move |(port, _)| origin(model, TagRef::Input { block, port }))
        });
        let read = wired
            .filter_map(|tag| if let TagRef::Point { driver, point } = tag { Some((driver, point)) } else { None });
        let levels: Vec<_> = interrupt.on.iter().copied().filter(|_| interrupt.poll).chain(read).collect();
        for (driver, point) in levels {
            let input = model.drivers[driver].config.points[point].safe.is_none();
            if input && direct(driver) && !is_taken(&served, driver, point) {
                served[lane].push(Served { driver, point, role: Role::Level });
            }
        }
    }
    for (driver, d) in model.drivers.iter().enumerate().filter(|(driver, _)| direct(*driver)) {
        for (point, _) in d.config.points.iter().enumerate().filter(|(_, p)| p.safe.is_some()) {
            let (TagRef::Output { block, .. } | TagRef::Alarm { block, .. }) =
                origin(model, TagRef::Point { driver, point })
            else {
                continue;
            };
            let lane = model.blocks[block].lane;
            if model.lanes[lane].interrupt.is_some() {
                served[lane].push(Served { driver, point, role: Role::Output });
            }
        }
    }
    served
}
