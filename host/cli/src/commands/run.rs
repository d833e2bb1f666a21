//! `latchwork run PLANT`

use super::load;
use crate::Exit;
use crate::args::{Run, Speed};
use crate::report;
use crate::run::{Files, Kept, Lines, Screen, Show, Table, Watcher, summary};
use anyhow::{Context, Result, bail};
use latchwork_api::{Config, Limits, Server};
use latchwork_block::Engine;
use latchwork_plant::assemble::{Options, Plant, Time, assemble};
use latchwork_plant::model::Model;
use latchwork_plant::run::{MachineClock, RunOptions, resolve_stimulus, run_real, run_virtual};
use latchwork_plant::sim::Stimulus;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::SystemTime;

pub(super) fn execute(engine: &Engine, args: &Run) -> Result<Exit> {
    if args.speed == Speed::Max && args.socket.is_some() {
        eprintln!(
            "error: --socket needs the machine's clock: at virtual time nobody could follow\n  help: leave --speed max or --socket out"
        );
        return Ok(Exit::Usage);
    }
    let Some(model) = load(engine, &args.plant, args.sim) else { return Ok(Exit::Wanting) };
    let time = match args.speed {
        Speed::Real => Time::Real,
        Speed::Max => Time::Virtual,
    };
    if time == Time::Virtual
        && let Some(real) = real_drivers(&model)
    {
        eprintln!(
            "error: --speed max needs a plant without real drivers, but {real}\n  help: add --sim to replace every driver by `sim` \
             points, or leave --speed max out"
        );
        return Ok(Exit::Usage);
    }
    if time == Time::Virtual && args.duration.is_none() && args.scans.is_none() {
        eprintln!("error: --speed max would never end\n  help: say how long with --for 10s or --scans 1000");
        return Ok(Exit::Usage);
    }
    if let (Some(trace), Some(records)) = (&args.trace, &args.records)
        && trace == records
    {
        eprintln!("error: --trace and --records name the same file {}\n  help: give each its own", trace.display());
        return Ok(Exit::Usage);
    }
    // A handler from the beginning on: a Ctrl-C while components are compiled stops as soon as the plant runs.
    let stop = Arc::new(AtomicBool::new(false));
    for signal in signals() {
        signal_hook::flag::register(signal, Arc::clone(&stop)).context("the handler of Ctrl-C could not be set")?;
    }
    let trace = args.trace.as_ref().map(|_| args.trace_tags.as_str());
    let mut plant = assemble(model, engine, &Options { time, trace })?;
    let options = RunOptions { duration: args.duration, scans: args.scans, stimulus: stimulus(&plant, args)? };
    let name = plant.model.name.clone();
    let files = Files::create(&plant, args.trace.as_deref(), args.records.as_deref())?;
    if args.data.is_none() && !plant.model.sinks.is_empty() {
        let names: Vec<_> = plant.model.sinks.iter().map(|s| format!("`{}`", s.config.name)).collect();
        eprintln!("note: nothing goes to {}: sinks read the journal\n  help: add --data FOLDER", names.join(", "));
    }
    let journal = args.data.as_ref().map(|folder| Kept::open(folder, &mut plant)).transpose()?;
    if let Some(data) = &args.data {
        let folder = data.join("recorder");
        let cannot = || format!("the flight recorder cannot write to {}", folder.display());
        plant.record_into(&folder).with_context(cannot)?;
    }
    let server = args.socket.as_ref().map(|socket| serve(socket, &mut plant, args)).transpose()?;
    let show = show(&plant, args);
    let mut watcher = Watcher::new(files, journal, show);
    let outcome = match time {
        Time::Virtual => run_virtual(plant, &options, &stop, &mut watcher),
        Time::Real => {
            plant.set_epoch(epoch());
            run_real(plant, &options, Arc::new(MachineClock::start()), &stop, &mut watcher)
        }
    };
    drop(server);
    let written = watcher.finish();
    if args.json {
        report::say(&format!("{}\n", serde_json::to_string_pretty(&summary::json(&name, &outcome, &written))?));
    } else {
        report::say(&summary::text(&name, &outcome, &written));
    }
    // A fault of the plant says more than a file that is incomplete: scripts and systemd go by it.
    match written.error {
        Some(error) if !outcome.faulted() => bail!("{error}"),
        Some(error) => report::error(&anyhow::anyhow!("{error}")),
        None => {}
    }
    Ok(if outcome.faulted() { Exit::Faulted } else { Exit::Fine })
}

/// Serves the control socket of a plant from now on.
fn serve(socket: &Path, plant: &mut Plant, args: &Run) -> Result<Server> {
    let config = Config {
        socket: socket.into(),
        plant: plant.model.name.clone(),
        policy: plant.model.policy.clone(),
        data: args.data.clone(),
        limits: Limits::default(),
    };
    let server = Server::start(config, plant.console())?;
    server.warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(server)
}

/// Signals that stop a plant in order: Ctrl-C, what systemd sends, Ctrl-\, and the end of the terminal or the network
/// connection it was started from, unless that was to be survived (`nohup`).
fn signals() -> impl Iterator<Item = i32> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    let ignored = std::fs::read_to_string("/proc/self/status").ok().and_then(|status| {
        let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    });
    let survive = ignored.is_some_and(|mask| mask >> (SIGHUP - 1) & 1 == 1);
    [SIGINT, SIGTERM, SIGQUIT].into_iter().chain((!survive).then_some(SIGHUP))
}

/// "driver `field` is modbus-tcp, …", or `None`.
fn real_drivers(model: &Model) -> Option<String> {
    let real: Vec<_> = model.drivers.iter().filter(|d| !model.sim && d.kind.name != "sim").collect();
    let list = real.iter().map(|d| format!("driver `{}` is {}", d.config.name, d.kind.name));
    (!real.is_empty()).then(|| list.collect::<Vec<_>>().join(", "))
}

fn stimulus(plant: &Plant, args: &Run) -> Result<Vec<Stimulus>> {
    let Some(path) = &args.stimulus else { return Ok(Vec::new()) };
    let shown = path.display();
    let file = std::fs::File::open(path).with_context(|| format!("the stimulus file {shown} cannot be read"))?;
    let rows = match latchwork_io::stimulus::read(file) {
        Ok(rows) => rows,
        Err(errors) => {
            let list: Vec<_> = errors.iter().map(|e| format!("{shown}: {e}")).collect();
            bail!("the stimulus file is wrong\n{}", list.join("\n"));
        }
    };
    resolve_stimulus(plant, &rows).map_err(|errors| {
        let list: Vec<_> = errors.iter().map(|e| format!("{shown}: {e}")).collect();
        anyhow::anyhow!("the stimulus file does not fit the plant\n{}", list.join("\n"))
    })
}

fn show(plant: &Plant, args: &Run) -> Box<dyn Show> {
    if args.quiet || args.json {
        Box::new(())
    } else if std::io::stdout().is_terminal() && args.speed == Speed::Real {
        match Screen::open() {
            Ok(screen) => Box::new(Table::new(plant, screen)),
            Err(_) => Box::new(Lines::new(plant)),
        }
    } else {
        Box::new(Lines::new(plant))
    }
}

/// Now, ns since 1970.
fn epoch() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| u64::try_from(d.as_nanos()).unwrap_or(0))
}
