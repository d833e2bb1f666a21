//! One module per command.

mod alarms;
mod build;
mod check;
mod check_block;
mod client;
mod command;
mod doctor;
mod force;
mod fuzz;
mod gpio;
mod inspect;
mod journal;
mod new;
mod records;
mod replay;
mod run;
mod schema;
mod set;
mod status;
mod swap;
mod tags;
mod test;
mod watch;

use crate::Exit;
use crate::args::{Args, Command};
use crate::doctor::Cache;
use crate::report;
use anyhow::{Context, Result, bail};
use latchwork_block::{Engine, EngineOptions};
use latchwork_plant::check::{CheckOptions, check_file};
use latchwork_plant::model::Model;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Executes a command.
pub(crate) fn execute(args: Args) -> Result<Exit> {
    let engine = || engine(args.cache.clone(), args.no_cache);
    match &args.command {
        Command::Run(run) => run::execute(&engine()?, run),
        Command::Check(check) => check::execute(&engine()?, check),
        Command::Inspect(inspect) => inspect::execute(&engine()?, inspect),
        Command::Tags(tags) => tags::execute(&engine()?, tags),
        Command::Doctor(doctor) => doctor::execute(engine, doctor, folder(args.cache.clone(), args.no_cache)),
        Command::Gpio(gpio) => gpio::execute(gpio),
        Command::Journal(journal) => journal::execute(journal),
        Command::Record(record) => replay::record(record),
        Command::Replay(replay) => replay::execute(&engine()?, replay),
        Command::Status(status) => status::execute(status),
        Command::Watch(watch) => watch::execute(watch),
        Command::Set(set) => set::execute(set),
        Command::Force(force) => force::force(force),
        Command::Unforce(unforce) => force::unforce(unforce),
        Command::Give(give) => command::execute(give),
        Command::Alarms(alarms) => alarms::execute(engine, alarms),
        Command::Ack(which) => alarms::acknowledge(which),
        Command::Reset(which) => alarms::change(which, "/v1/alarms/reset"),
        Command::Shelve(shelve) => alarms::shelve(shelve),
        Command::Unshelve(which) => alarms::change(which, "/v1/alarms/unshelve"),
        Command::OutOfService(which) => alarms::change(which, "/v1/alarms/out-of-service"),
        Command::InService(which) => alarms::change(which, "/v1/alarms/in-service"),
        Command::Heartbeat(beat) => command::heartbeat(beat),
        Command::Records(records) => records::execute(records),
        Command::New(new) => new::execute(new),
        Command::Build(build) => build::execute(build),
        Command::Swap(args) => swap::swap(args),
        Command::Rollback(args) => swap::rollback(args),
        Command::Swaps(args) => swap::swaps(args),
        Command::Test(test) => test::execute(&engine()?, test),
        Command::Fuzz(fuzz) => fuzz::execute(&engine()?, fuzz),
        Command::CheckBlock(check) => check_block::execute(&engine()?, check),
        Command::Schema => schema::execute(),
    }
}

fn engine(cache: Option<PathBuf>, no_cache: bool) -> Result<Engine> {
    let cache = match folder(cache, no_cache) {
        Cache::Folder(folder) => Some(folder),
        Cache::Unwanted | Cache::Unknown => None,
    };
    Engine::new(EngineOptions { cache, ..EngineOptions::default() }).context("the WebAssembly engine did not start")
}

/// Where compiled components are kept.
fn folder(cache: Option<PathBuf>, no_cache: bool) -> Cache {
    match cache.or_else(default_cache) {
        _ if no_cache => Cache::Unwanted,
        Some(folder) => Cache::Folder(folder),
        None => Cache::Unknown,
    }
}

/// `$XDG_CACHE_HOME/latchwork`, else `~/.cache/latchwork`.
fn default_cache() -> Option<PathBuf> {
    let base = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).filter(|p| p.is_absolute());
    base.or_else(|| std::env::home_dir().map(|h| h.join(".cache"))).map(|b| b.join("latchwork"))
}

/// The checked model, or `None` after its errors were printed. Notes are printed only by `check`.
fn load(engine: &Engine, plant: &Path, sim: bool) -> Option<Model> {
    let checked = check_file(plant, engine, CheckOptions { sim });
    if checked.model.is_none() {
        eprint!("{}", checked.render(report::colours()));
    }
    checked.model
}

/// A new file: what is there, a test that somebody has mended perhaps, is not written over.
fn create(path: &Path, bytes: &[u8]) -> Result<()> {
    let new = std::fs::File::create_new(path).and_then(|mut file| file.write_all(bytes));
    match new {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            bail!("{} exists and stays as it is: remove it, or give another name", path.display())
        }
        other => other.with_context(|| format!("{} cannot be written", path.display())),
    }
}
