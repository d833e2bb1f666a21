//! `latchwork fuzz COMPONENT`

use crate::Exit;
use crate::args::fuzz::{Block, Fuzz};
use crate::report;
use anyhow::{Context, Result};
use latchwork_block::{Engine, LoadError, Ticker};
use latchwork_testbed::case::Subject;
use latchwork_testbed::fuzz::{Kind, Options, Progress, Report, fuzz};
use signal_hook::consts::SIGINT;
use std::io::{IsTerminal, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Period of the engine's ticks: what never ends is stopped by them.
const TICK: Duration = Duration::from_millis(10);
/// Time of a search that is given neither time nor number, ns.
const TIME: u64 = 30_000_000_000;

pub(super) fn execute(engine: &Engine, args: &Fuzz) -> Result<Exit> {
    let subject = match subject(engine, &args.block)? {
        Ok(subject) => subject,
        Err(exit) => return Ok(exit),
    };
    let seeded = options(&args.block);
    let path = match place(args, &subject, seeded.seed) {
        Ok(path) => path,
        Err(why) => {
            report::error(&why);
            return Ok(Exit::Usage);
        }
    };
    let time = args.time.or(if args.runs.is_none() { Some(TIME) } else { None });
    let options = Options { time, sequences: args.runs, ignored: args.ignore.clone(), ..seeded };
    let begun = Instant::now();
    let aloud = !args.block.json && std::io::stderr().is_terminal();
    let found = search(engine, &subject, &options, begun, aloud);
    // What was found is told even where it cannot be written.
    let written = write(&path, args, &found);
    let file = written.as_ref().ok().and_then(Option::as_ref);
    if args.block.json {
        let mut json = serde_json::to_value(&found)?;
        json["component"] = subject.component.name().into();
        json["hash"] = subject.component.hash().into();
        json["ok"] = found.findings.is_empty().into();
        json["file"] = file.map(|f| f.display().to_string()).into();
        report::say(&format!("{}\n", serde_json::to_string_pretty(&json)?));
    } else {
        print(&subject, &found, begun.elapsed(), file.map(PathBuf::as_path));
    }
    written?;
    Ok(if found.findings.is_empty() { Exit::Fine } else { Exit::Wanting })
}

/// Loads what is meant; the inner error is an exit, and has been told.
pub(super) fn subject(engine: &Engine, args: &Block) -> Result<Result<Subject, Exit>> {
    let name = || args.component.display().to_string();
    let component = engine.load_file(&args.component).with_context(name)?;
    let class = match component.class(args.class.as_deref()) {
        Ok(class) => class,
        Err(error @ (LoadError::SeveralClasses { .. } | LoadError::UnknownClass { .. })) => {
            let text = error.to_string().replace("`class = \"…\"`", "--class CLASS");
            report::error(&anyhow::anyhow!("{}: {text}", name()));
            return Ok(Err(Exit::Usage));
        }
        Err(error) => return Err(error).with_context(name),
    };
    let template = component.template(&class).with_context(name)?;
    Ok(Ok(Subject { component, class, template }))
}

/// Limits and seed.
pub(super) fn options(args: &Block) -> Options {
    Options {
        seed: args.seed.unwrap_or_else(some_seed),
        budget: args.budget,
        memory: args.memory,
        tick: TICK.as_nanos() as u64,
        ..Options::default()
    }
}

/// Another one each time, short enough to be typed again.
fn some_seed() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |t| t.as_micros() as u64 % 1_000_000_000)
}

/// Searches while the engine is ticked; on a terminal one line tells how far it is. Ctrl-C ends the search, and what was found
/// until then is told; a second one ends the program.
fn search(engine: &Engine, subject: &Subject, options: &Options, begun: Instant, aloud: bool) -> Report {
    const OFTEN: u64 = 200_000_000;
    let pressed = Arc::new(AtomicBool::new(false));
    // Where there is no handler, Ctrl-C ends the program as ever.
    let _ = signal_hook::flag::register_conditional_default(SIGINT, Arc::clone(&pressed));
    let _ = signal_hook::flag::register(SIGINT, Arc::clone(&pressed));
    let _ticker = Ticker::start(engine, TICK);
    let clock = clock(begun);
    let mut next = 0;
    let found = fuzz(subject, options, &clock, &mut |p: &Progress| {
        if aloud && p.time >= next {
            next = p.time + OFTEN;
            eprint!(
                "\r{:>3} s  {} sequences  {} executions  {} found ",
                p.time / 1_000_000_000,
                p.sequences,
                p.executions,
                p.findings
            );
            // A terminal that is gone is no reason to stop.
            let _ = std::io::stderr().flush();
        }
        if pressed.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    if aloud {
        eprint!("\r\x1b[K");
    }
    found
}

/// The machine's time, ns since `begun`.
pub(super) fn clock(begun: Instant) -> impl Fn() -> u64 {
    move || u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX)
}

/// Period of the ticks, for others who fuzz.
pub(super) fn ticker(engine: &Engine) -> Ticker {
    Ticker::start(engine, TICK)
}

/// Where the test file goes: never over another one, which may have been written by hand.
fn place(args: &Fuzz, subject: &Subject, seed: u64) -> Result<PathBuf> {
    let Some(path) = &args.out else {
        let name = format!("{}-fuzz-{seed}", subject.component.name());
        let more = (2..).map(|n| PathBuf::from(format!("{name}-{n}.test.toml")));
        let mut names = std::iter::once(PathBuf::from(format!("{name}.test.toml"))).chain(more);
        return names.find(|p| !p.exists()).context("no name is free");
    };
    anyhow::ensure!(!path.exists(), "{} exists; remove it, or give --out another name", path.display());
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    anyhow::ensure!(folder.is_dir(), "{} is no folder: make it, or give --out another place", folder.display());
    Ok(path.clone())
}

/// The test file with the cases of what was found.
fn write(path: &Path, args: &Fuzz, found: &Report) -> Result<Option<PathBuf>> {
    let Some(text) = found.test_file(&relative(path, &args.block.component)) else { return Ok(None) };
    super::create(path, text.as_bytes())?;
    Ok(Some(path.to_path_buf()))
}

/// The component's path as the test file has to name it.
fn relative(file: &Path, component: &Path) -> String {
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (folder, component) = match (std::fs::canonicalize(folder), std::fs::canonicalize(component)) {
        (Ok(folder), Ok(component)) => (folder, component),
        _ => return component.display().to_string(),
    };
    let shared = folder.components().zip(component.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| PathBuf::from(".."));
    let down = component.components().skip(shared).map(|c| PathBuf::from(c.as_os_str()));
    up.chain(down).collect::<PathBuf>().display().to_string()
}

fn print(subject: &Subject, found: &Report, took: Duration, file: Option<&Path>) {
    let mut out = format!("{}  {}  seed {}\n", subject.component.name(), found.class, found.seed);
    for finding in &found.findings {
        let (from, to) = (finding.executions_found, finding.executions);
        let more = if finding.smallest { "" } else { "; the time to look for a smaller one was over" };
        let shrunk = if to < from { format!(", shrunk to {to}{more}") } else { more.to_owned() };
        out += &format!("\n{}: {}\n", finding.kind.name(), finding.message);
        out += &format!("  sequence {} of {from} executions{shrunk}\n", finding.sequence);
        match &finding.case {
            Some(case) => {
                case.lines().for_each(|l| out += &if l.is_empty() { "\n".into() } else { format!("    {l}\n") })
            }
            None => out += "  no test case can show it\n",
        }
    }
    let executions = found.executions;
    let rate = executions as f64 / took.as_secs_f64().max(1e-6);
    out += &format!(
        "\n{} in {} sequences, {executions} executions, {} restarts; {:.1} s, {rate:.0} executions/s\n",
        match found.findings.len() {
            0 => "nothing found".to_owned(),
            1 => "1 thing found".to_owned(),
            n => format!("{n} things found"),
        },
        found.sequences,
        found.restarts,
        took.as_secs_f64(),
    );
    found.notes.iter().for_each(|n| out += &format!("note: {n}\n"));
    if let Some(file) = file {
        let late = found.findings.iter().any(|f| f.kind == Kind::Budget);
        let but = if late { "; the case of a budget only where it is missed by far" } else { "" };
        out += &format!("written to {0}: `latchwork test {0}` fails until it is mended{but}\n", file.display());
    }
    report::say(&out);
}
