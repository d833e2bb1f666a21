//! `cargo xtask bench`: the figures of docs/performance.md.

use crate::cargo::{cargo, root, run, target_dir};
use crate::guests;
use anyhow::{Context, Result};
use clap::Args;
use std::path::Path;

/// Arguments of `cargo xtask bench`.
#[derive(Args, Debug)]
pub(crate) struct Bench {
    /// Only the benches whose names contain this; `latency` is the interrupt lane's reaction, `swap` a plant that is
    /// swapped without end, `taps` what listening to a block costs; no other choice runs these three.
    filter: Option<String>,
    /// `latency`: edges per length of the main scan.
    #[arg(long, default_value_t = 100_000)]
    events: usize,
    /// `latency`: CPU of the lanes and of cyclictest; the last one without it.
    #[arg(long)]
    cpu: Option<usize>,
    /// `swap`: seconds of swapping; a fifth of it comes before without a swap.
    #[arg(long, default_value_t = 300)]
    seconds: u64,
}

/// Calls of single blocks, whole scans, the journal, its sinks, reports on it. Guests first: a bench of yesterday's blocks
/// tells nothing.
pub(crate) fn execute(args: &Bench) -> Result<()> {
    guests::execute(&guests::Guests::default())?;
    if args.filter.as_deref() == Some("latency") {
        return latency(args);
    }
    if args.filter.as_deref() == Some("swap") {
        return swap(args);
    }
    if args.filter.as_deref() == Some("taps") {
        return taps();
    }
    for bench in ["call", "scan", "journal", "sinks", "component", "report"] {
        let mut command = cargo();
        // With the very choice of packages that everything else has: another one would build the engine once more.
        command.args(["bench", "--workspace", "--bench", bench, "--"]).args(&args.filter);
        run(&mut command)?;
    }
    Ok(())
}

/// Some ten minutes; best on a machine that does nothing else, as root or with the right to SCHED_FIFO.
fn latency(args: &Bench) -> Result<()> {
    let table = target_dir()?.join("latency.md");
    let docs = root().join("docs");
    let mut command = cargo();
    command.args(["bench", "--workspace", "--bench", "latency", "--"]);
    command.arg("--events").arg(args.events.to_string());
    command.arg("--plot").arg(docs.join("latency.svg")).arg("--table").arg(&table);
    if let Some(cpu) = args.cpu {
        command.arg("--cpu").arg(cpu.to_string());
    }
    run(&mut command)?;
    insert("latency", &table)
}

/// Some six minutes; best on a machine that does nothing else, as root or with the right to SCHED_FIFO.
fn swap(args: &Bench) -> Result<()> {
    let table = target_dir()?.join("swap.md");
    let mut command = cargo();
    command.args(["bench", "--workspace", "--bench", "swap", "--"]);
    command.arg("--seconds").arg(args.seconds.to_string()).arg("--table").arg(&table);
    run(&mut command)?;
    insert("swap", &table)
}

/// Half a minute; best on a machine that does nothing else.
fn taps() -> Result<()> {
    let table = target_dir()?.join("taps.md");
    let mut command = cargo();
    command.args(["bench", "--workspace", "--bench", "taps", "--"]).arg("--table").arg(&table);
    run(&mut command)?;
    insert("taps", &table)
}

/// Puts a table between its marks in docs/performance.md.
fn insert(name: &str, table: &Path) -> Result<()> {
    let begin = format!("<!-- {name}: made by `cargo xtask bench {name}` -->\n");
    let end = format!("<!-- {name} ends -->\n");
    let page = root().join("docs/performance.md");
    let text = std::fs::read_to_string(&page).with_context(|| format!("{} cannot be read", page.display()))?;
    let (Some(from), Some(to)) = (text.find(&begin), text.find(&end)) else {
        anyhow::bail!("{} has lost the marks `{}` and `{}`", page.display(), begin.trim(), end.trim());
    };
    let new = format!("{}{}{}", &text[..from + begin.len()], std::fs::read_to_string(table)?, &text[to..]);
    std::fs::write(&page, new).with_context(|| format!("{} cannot be written", page.display()))
}
