//! `latchwork replay RECORDING` and `latchwork record`

use super::client::client;
use crate::Exit;
use crate::args::replay::{Record, Replay, Time};
use crate::report;
use anyhow::{Context, Result, bail};
use latchwork_block::{Engine, Ticker};
use latchwork_image::format_duration;
use latchwork_testbed::replay::{Options, Recording, Replayed, Tolerances, export, replay};
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

/// Deviations that are listed.
const LISTED: usize = 20;

pub(super) fn execute(engine: &Engine, args: &Replay) -> Result<Exit> {
    let recording = Recording::open(&args.recording)?;
    recording.damage.iter().for_each(|damage| eprintln!("warning: {damage}"));
    let runs = recording.runs();
    let run = match args.run {
        Some(run) if !runs.contains(&run) => {
            let runs: Vec<_> = runs.iter().map(u64::to_string).collect();
            bail!("the recording has no run {run}; it has {}", runs.join(", "));
        }
        Some(run) => run,
        None => runs.last().copied().unwrap_or(0),
    };
    let with = match &args.with {
        Some(path) => Some(engine.load_file(path).with_context(|| format!("{}", path.display()))?),
        None => None,
    };
    let epoch = recording.blocks(run).find_map(|(_, s)| s.first().map(|s| s.head.epoch)).unwrap_or(0);
    let plant_time = |time: Option<Time>, otherwise| match time {
        None => otherwise,
        Some(Time::Plant(ns)) => ns,
        Some(Time::World(ns)) => ns.saturating_sub(epoch),
    };
    let options = Options {
        from: plant_time(args.from, 0),
        to: plant_time(args.to, u64::MAX),
        with,
        tolerances: Tolerances::new(args.tolerance.iter().map(|(tag, within)| (tag.as_str(), *within)))?,
        lossy: args.allow_lossy,
    };
    let _ticker = Ticker::start(engine, Duration::from_millis(10));
    if let (Some(file), Some(block)) = (&args.export, &args.block) {
        return write(&recording, engine, run, block, &options, file);
    }
    let blocks: Vec<String> = match &args.block {
        Some(block) => vec![block.clone()],
        None => recording.blocks(run).map(|(name, _)| name.to_string()).collect(),
    };
    let reports = blocks.iter().map(|b| replay(&recording, engine, run, b, &options)).collect::<Result<Vec<_>, _>>()?;
    if args.json {
        report::say(&format!("{}\n", serde_json::to_string_pretty(&reports)?));
    } else {
        reports.iter().for_each(|r| report::say(&text(r)));
    }
    Ok(if reports.iter().all(Replayed::equal) { Exit::Fine } else { Exit::Wanting })
}

/// `latchwork record`: the ring of a running plant as a file.
pub(super) fn record(args: &Record) -> Result<Exit> {
    let bytes = client(&args.reach)?.file("/v1/recording")?;
    let file = args.save.display().to_string();
    std::fs::write(&args.save, &bytes).with_context(|| format!("{file} cannot be written"))?;
    if args.reach.json {
        report::say(&format!("{}\n", serde_json::json!({ "file": file, "bytes": bytes.len() })));
    } else {
        report::say(&format!("{file}: {} bytes; run it again with `latchwork replay {file}`\n", bytes.len()));
    }
    Ok(Exit::Fine)
}

/// One block in words.
fn text(r: &Replayed) -> String {
    let mut text = format!("{}  {}", r.block, r.component);
    if let Some(with) = &r.with {
        let _ = write!(text, " → {} {}", with.component, short(&with.hash));
    }
    let _ = write!(text, "  run {}", r.run);
    if r.executions > 0 {
        let _ = write!(text, ", {} to {}", format_duration(r.from), format_duration(r.to));
    }
    text.push('\n');
    let _ = match (r.equal(), &r.with) {
        _ if r.executions == 0 => writeln!(text, "  nothing could be replayed"),
        (true, None) => {
            writeln!(text, "  equal bit for bit: {} executions, outputs {}", r.executions, short(&r.recorded))
        }
        (true, Some(_)) => writeln!(text, "  the same: {} executions, within the tolerances", r.executions),
        (false, None) => {
            let (recorded, replayed) = (short(&r.recorded), short(&r.replayed));
            let n = r.different;
            writeln!(text, "  DIFFERENT: {n} of {} executions; recorded {recorded}, replayed {replayed}", r.executions)
        }
        (false, Some(_)) => writeln!(text, "  different: {} of {} executions", r.different, r.executions),
    };
    for d in r.deviations.iter().take(LISTED) {
        let _ = writeln!(text, "  {}: {} times, first at {}", d.port, d.count, format_duration(d.first));
        let by = if d.worst > 0.0 { format!(", {} apart", d.worst) } else { String::new() };
        let at = format_duration(d.worst_at);
        let _ = writeln!(text, "    at {at}: recorded {}, now {}{by}", d.running, d.candidate);
        let _ = writeln!(text, "      with {}", pairs(&d.inputs));
    }
    if let Some(more) = r.deviations.len().checked_sub(LISTED + 1) {
        let _ = writeln!(text, "  and {} more; --json has all", more + 1);
    }
    if let Some(fault) = &r.fault {
        let _ = writeln!(text, "  fault ({}) at {}: {}", fault.kind, format_duration(fault.at), fault.message);
        let _ = writeln!(text, "      with {}", pairs(&fault.inputs));
    }
    if r.skipped > 0 {
        let _ = writeln!(text, "  {} recorded executions were left out: no state came before them", r.skipped);
    }
    if r.missed > 0 {
        let _ = writeln!(text, "  {} executions are not in the recording", r.missed);
    }
    r.notes.iter().for_each(|note| drop(writeln!(text, "  note: {note}")));
    text
}

fn pairs(named: &[(String, String)]) -> String {
    named.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ")
}

/// As much of a hash as a person compares.
fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

fn write(
    recording: &Recording,
    engine: &Engine,
    run: u64,
    block: &str,
    options: &Options,
    file: &Path,
) -> Result<Exit> {
    let exported = export(recording, engine, run, block, options)?;
    let written = |path: &Path| format!("{} cannot be written", path.display());
    std::fs::write(file, &exported.text).with_context(|| written(file))?;
    let component = file.with_file_name(format!("{}.wasm", exported.component));
    if let (false, Some(bytes)) = (component.exists(), recording.component(&exported.hash)) {
        std::fs::write(&component, bytes).with_context(|| written(&component))?;
    }
    let (steps, executions) = (exported.steps, exported.executions);
    report::say(&format!(
        "{}: {steps} steps for {executions} executions; tests {}\n",
        file.display(),
        component.display()
    ));
    exported.notes.iter().for_each(|note| report::say(&format!("note: {note}\n")));
    Ok(Exit::Fine)
}
