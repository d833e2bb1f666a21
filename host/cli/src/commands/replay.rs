//! `latchwork replay RECORDING` and `latchwork record`

use super::client::client;
use crate::Exit;
use crate::args::replay::{Record, Replay, Time};
use crate::report;
use anyhow::{Context, Result, bail};
use latchwork_block::{Engine, Ticker};
use latchwork_image::format_duration;
use latchwork_record::rfc3339;
use latchwork_testbed::replay::{Options, Recording, Replayed, Tolerances, export, hash_of, replay};
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
        None => run_at(&recording, &runs, [args.from, args.to])?,
    };
    let with = match &args.with {
        Some(path) => Some(engine.load_file(path).with_context(|| format!("{}", path.display()))?),
        None => None,
    };
    let epoch = recording.blocks(run).find_map(|(_, s)| s.first().map(|s| s.head.epoch)).unwrap_or(0);
    let plant_time = |time: Option<Time>, otherwise| match time {
        None => Ok(otherwise),
        Some(Time::Plant(ns)) => Ok(ns),
        Some(Time::World(_)) if epoch == 0 => bail!("{}", without_dates(run)),
        Some(Time::World(ns)) => Ok(ns.saturating_sub(epoch)),
    };
    let options = Options {
        from: plant_time(args.from, 0)?,
        to: plant_time(args.to, u64::MAX)?,
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

/// The run that is meant: the last one, with dates the last one that has recorded anything between them.
fn run_at(recording: &Recording, runs: &[u64], [from, to]: [Option<Time>; 2]) -> Result<u64> {
    let last = runs.last().copied().unwrap_or(0);
    let date = |time| if let Some(Time::World(ns)) = time { Some(ns) } else { None };
    if date(from).or(date(to)).is_none() {
        return Ok(last);
    }
    // What is given as plant time is so in whichever run it is.
    let (from, to) = (date(from).unwrap_or(0), date(to).unwrap_or(u64::MAX));
    let spans: Vec<_> = runs.iter().filter_map(|run| Some((*run, span(recording, *run)?))).collect();
    if let Some((run, _)) = spans.iter().rev().find(|(_, [begin, end])| *begin <= to && from <= *end) {
        return Ok(*run);
    }
    let named =
        |(run, [begin, end]): &(u64, [u64; 2])| format!("run {run} from {} to {}", rfc3339(*begin), rfc3339(*end));
    match spans.iter().map(named).collect::<Vec<_>>() {
        none if none.is_empty() => bail!("{}", without_dates(last)),
        known => bail!("nothing was recorded then; the recording has {}", known.join(", ")),
    }
}

/// What a run at virtual time has to say to dates.
fn without_dates(run: u64) -> String {
    format!("run {run} was at virtual time, which has no dates: say plant time, as in 1m 30s")
}

/// When the first and the last recorded execution of a run were, ns since 1970; none of a run at virtual time.
fn span(recording: &Recording, run: u64) -> Option<[u64; 2]> {
    let heads =
        || recording.blocks(run).flat_map(|(_, s)| s).map(|s| &s.head).filter(|h| h.executions > 0 && h.epoch > 0);
    let begin = heads().map(|h| h.epoch.saturating_add(h.from)).min()?;
    Some([begin, heads().map(|h| h.epoch.saturating_add(h.to)).max()?])
}

/// `latchwork record`: the ring of a running plant as a file.
pub(super) fn record(args: &Record) -> Result<Exit> {
    let bytes = client(&args.reach)?.file("/v1/recording")?;
    let file = args.save.display().to_string();
    super::create(&args.save, &bytes)?;
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
    for note in &r.notes {
        let _ = writeln!(text, "  note: {note}");
    }
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
    super::create(file, exported.text.as_bytes())?;
    let component = file.with_file_name(format!("{}.wasm", exported.component));
    if let (false, Some(bytes)) = (component.exists(), recording.component(&exported.hash)) {
        std::fs::write(&component, bytes).with_context(|| written(&component))?;
    }
    if std::fs::read(&component).is_ok_and(|there| hash_of(&there) != exported.hash) {
        report::say(&format!(
            "note: {} is another component than the recorded one, and stays; the test is about that of SHA-256 {}\n",
            component.display(),
            exported.hash
        ));
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

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_testbed::replay::{Event, Head, Start, Writer, header, segment_chunk};

    const YEAR: u64 = 31_536_000_000_000_000;
    const HOUR: u64 = 3_600_000_000_000;

    /// Runs of an hour, each begun at one of these times.
    fn recording(epochs: &[u64]) -> Recording {
        let mut bytes = header();
        for (n, epoch) in epochs.iter().enumerate() {
            let mut writer = Writer::new(Head {
                run: n as u64 + 1,
                epoch: *epoch,
                block: "b".into(),
                lane: "main".into(),
                every: HOUR,
                component: "c".into(),
                hash: String::new(),
                version: 0,
                class: "c".into(),
                memory: 0,
                number: 0,
                start: Start::Cold,
                settings: Vec::new(),
                cells: [0, 0],
                from: 0,
                to: 0,
                executions: 0,
                missed: 0,
            });
            for now in [0, HOUR] {
                let scan = latchwork_block::Scan { now, elapsed: 0, first: now == 0 };
                writer.add(Event::Execution { scan, arguments: &[], outputs: Ok(&[]) });
            }
            bytes.extend(segment_chunk(&writer.cut(Start::Continued).expect("two executions")));
        }
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("r.latchrec");
        std::fs::write(&file, bytes).expect("written");
        Recording::open(&file).expect("a recording")
    }

    #[test]
    fn a_date_chooses_the_run_that_holds_it() {
        let recording = recording(&[50 * YEAR, 51 * YEAR, 52 * YEAR]);
        let run = |from, to| run_at(&recording, &recording.runs(), [from, to]);
        let world = |ns| Some(Time::World(ns));
        assert_eq!(run(None, None).expect("the last"), 3);
        assert_eq!(run(Some(Time::Plant(5)), None).expect("the last"), 3);
        assert_eq!(run(world(51 * YEAR + 5), world(51 * YEAR + 6)).expect("the second"), 2);
        assert_eq!(run(world(50 * YEAR + HOUR), world(51 * YEAR - 1)).expect("the first"), 1);
        assert_eq!(run(None, world(50 * YEAR)).expect("the first"), 1);
        let between = run(world(51 * YEAR - 5), world(51 * YEAR - 1)).expect_err("between two").to_string();
        assert!(between.starts_with("nothing was recorded then; the recording has run 1 from 20"), "{between}");
        assert!(between.contains(", run 3 from "), "{between}");
    }

    #[test]
    fn a_run_at_virtual_time_has_no_dates() {
        let recording = recording(&[0]);
        let error = run_at(&recording, &recording.runs(), [Some(Time::World(YEAR)), None]).expect_err("none");
        assert!(error.to_string().contains("which has no dates"), "{error}");
    }
}
