//! `cargo xtask test`: everything that must hold before a change lands, in the order of cheapness.

use crate::cargo::{cargo, run, shown, target_dir};
use crate::cross;
use crate::demo;
use crate::dist;
use crate::guests;
use crate::languages;
use anyhow::{Context, Result, bail};
use clap::{Args, Parser};
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;
use std::time::Instant;

/// Arguments of `cargo xtask test`.
#[derive(Args, Debug)]
pub(crate) struct Test {
    /// Leave format and lints out.
    #[arg(long)]
    fast: bool,
}

/// Passed, failed, skipped.
#[derive(Default)]
struct Count {
    passed: u64,
    failed: u64,
    skipped: u64,
}

impl Count {
    /// Counts a step that is no test, if it was not done.
    fn step(&mut self, done: bool) {
        self.skipped += u64::from(!done);
    }

    /// The plain closing line that scripts look for.
    fn close(&self) {
        println!("{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped);
    }
}

pub(crate) fn execute(args: &Test) -> Result<()> {
    let start = Instant::now();
    if !args.fast {
        step("format");
        run(cargo().args(["fmt", "--all", "--check"])).context("`cargo fmt --all` mends it")?;
    }
    step("guests");
    guests::execute(&guests::Guests::default())?;
    if !args.fast {
        step("lints");
        run(cargo().args(["clippy", "--release", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]))?;
    }
    // With the very choice of targets that the tests have: another one would build the engine once more.
    step("build");
    run(cargo().args(["build", "--release", "--workspace", "--all-targets", "--quiet"]))?;
    step("programs for the GPIO VM");
    let built = cross::unless_missing(cross::STATIC_TOOLS, || cross::Machine::X86.build().map(drop))?;
    step("tests");
    let mut count = tests()?;
    count.step(built);
    if built {
        step("the archive for x86-64, unpacked and tried");
        dist::attempt(cross::Machine::X86)?;
        step("the systemd unit");
        count.step(cross::unless_missing(cross::UNIT_TOOLS, dist::verify_unit)?);
    }
    step("the example on aarch64, emulated");
    let native = target_dir()?.join("release/latchwork");
    count.step(cross::unless_missing(cross::AARCH64_TOOLS, || cross::compare_under_qemu(&native))?);
    step("the demo, for 5 s");
    demo::execute(&Demo::parse_from(["demo", "--for", "5s", "--port", "0", "--built"]).demo)?;
    step(&format!("all done in {} s", start.elapsed().as_secs()));
    count.close();
    if count.passed == 0 {
        bail!("no test ran");
    }
    Ok(())
}

#[derive(Parser)]
struct Demo {
    #[command(flatten)]
    demo: demo::Demo,
}

fn step(what: &str) {
    eprintln!("\n=== {what}");
}

/// All tests of the workspace, with the sum of cargo's own counts.
fn tests() -> Result<Count> {
    let mut command = cargo();
    command.args(["test", "--release", "--workspace", "--no-fail-fast"]).stdout(Stdio::piped());
    command.env("LATCHWORK_TARGET", target_dir()?);
    // The compilers of blocks in other languages.
    command.env("PATH", languages::path()?);
    // Tests that pass over what this machine lacks name it here: cargo believes that they have passed.
    let list = target_dir()?.join("skipped-tests");
    std::fs::write(&list, "").with_context(|| format!("{} cannot be written", list.display()))?;
    command.env("LATCHWORK_SKIPPED", &list);
    let mut child = command.spawn().with_context(|| format!("{} could not be started", shown(&command)))?;
    let mut count = Count::default();
    if let Some(out) = child.stdout.take() {
        for line in BufReader::new(out).lines() {
            let line = line?;
            writeln!(std::io::stdout(), "{line}")?;
            if let Some(rest) = line.strip_prefix("test result: ") {
                count.passed += number_before(rest, "passed");
                count.failed += number_before(rest, "failed");
                count.skipped += number_before(rest, "ignored");
            }
        }
    }
    let status = child.wait()?;
    let skipped = std::fs::read_to_string(&list).with_context(|| format!("{} cannot be read", list.display()))?;
    skipped.lines().for_each(|why| eprintln!("SKIPPED: {why}"));
    let skipped = skipped.lines().count() as u64;
    (count.passed, count.skipped) = (count.passed.saturating_sub(skipped), count.skipped + skipped);
    if !status.success() {
        count.close();
        bail!("{} failed", shown(&command));
    }
    Ok(count)
}

/// `12` of "ok. 12 passed; 0 failed".
fn number_before(text: &str, word: &str) -> u64 {
    let words: Vec<_> = text.split([' ', ';', '.']).filter(|w| !w.is_empty()).collect();
    words.windows(2).find(|w| w[1] == word).and_then(|w| w[0].parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::number_before;

    #[test]
    fn counts_are_read_from_cargos_closing_line() {
        let line = "ok. 12 passed; 3 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.11s";
        assert_eq!(["passed", "failed", "ignored"].map(|w| number_before(line, w)), [12, 3, 1]);
    }
}
