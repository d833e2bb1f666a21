//! What the plant file says about a logger: which component, and what of the machine it gets to see.

use super::{BUDGET, MEMORY, config, imports, locate};
use crate::{Config, Problem};
use latchwork_schema::Value;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// A sink's table, read.
pub(super) struct Grants {
    /// File of the component.
    pub(super) component: PathBuf,
    /// Content of the file.
    pub(super) bytes: Vec<u8>,
    /// The directory it sees.
    pub(super) directory: Option<PathBuf>,
    /// The addresses it may connect to.
    pub(super) connect: Vec<SocketAddr>,
    /// Most memory, bytes.
    pub(super) memory: u64,
    /// Longest call.
    pub(super) budget: Duration,
    /// What `open` gets.
    pub(super) config: String,
    /// Folder for compiled code.
    pub(super) cache: Option<PathBuf>,
}

/// What is wrong with a sink's table and its component.
pub(super) fn check(config: &Config) -> Vec<Problem> {
    Grants::read(config).err().unwrap_or_default()
}

impl Grants {
    /// Reads a table, or says everything that is wrong with it.
    pub(super) fn read(config: &Config) -> Result<Self, Vec<Problem>> {
        Self::with(config, component(config))
    }

    /// The same for another component than the table names.
    pub(super) fn of(config: &Config, file: &str, bytes: &[u8]) -> Result<Self, Vec<Problem>> {
        Self::with(config, Ok((file.into(), bytes.into())))
    }

    fn with(config: &Config, found: Result<(PathBuf, Vec<u8>), Problem>) -> Result<Self, Vec<Problem>> {
        let mut problems = Vec::new();
        let (connect, directory) = (connect(config, &mut problems), directory(config, &mut problems));
        if let Some(Value::Raw(raw)) = config.values.get("config")
            && !raw.is_table()
        {
            let message = format!("`config` is {}; expected a table", raw.type_str());
            problems.push(problem("config", message, "write `config = { … }`, with what the logger asks for"));
        }
        let found = found.map_err(|p| problems.push(p));
        let (Ok((component, bytes)), true) = (found, problems.is_empty()) else { return Err(problems) };
        Ok(Self {
            component,
            bytes,
            directory,
            connect,
            memory: config.values.size("memory").unwrap_or(MEMORY),
            budget: Duration::from_nanos(config.values.duration("budget").unwrap_or(BUDGET)),
            config: config::json(config),
            cache: config.cache.clone(),
        })
    }
}

/// What the table names: its file and the content of that.
pub(super) fn component(config: &Config) -> Result<(PathBuf, Vec<u8>), Problem> {
    let name = config.values.text("component").unwrap_or_default();
    let path = locate::component(config, name)?;
    let at = |message: String, help: String| problem("component", message, &help);
    let bytes = std::fs::read(&path)
        .map_err(|e| at(format!("{} cannot be read: {e}", path.display()), "check its path and permissions".into()))?;
    imports::check(&bytes).map_err(|(message, help)| at(format!("{}: {message}", path.display()), help))?;
    Ok((path, bytes))
}

fn connect(config: &Config, problems: &mut Vec<Problem>) -> Vec<SocketAddr> {
    let Some(Value::List(list)) = config.values.get("connect") else { return Vec::new() };
    let mut addresses = Vec::new();
    for (value, _) in list {
        let Value::Text(text) = value else { continue };
        match text.parse() {
            Ok(address) => addresses.push(address),
            Err(_) => problems.push(problem(
                "connect",
                format!("`connect` names \"{text}\"; expected an IP address with a port"),
                "write \"192.168.1.9:5140\" or \"[fd00::9]:5140\"; names are not looked up for a logger",
            )),
        }
    }
    addresses
}

fn directory(config: &Config, problems: &mut Vec<Problem>) -> Option<PathBuf> {
    let directory = config.folder.join(config.values.text("directory")?);
    if directory.exists() && !directory.is_dir() {
        let message = format!("`directory` is {}, which is no directory", directory.display());
        problems.push(problem("directory", message, "name a directory; it is made if it is not there"));
    }
    Some(directory)
}

pub(super) fn problem(key: &str, message: String, help: &str) -> Problem {
    Problem { key: key.into(), message, help: Some(help.into()) }
}
