//! `cargo xtask`: the only build tool besides cargo.
//!
//! Owns what cargo alone cannot do: function blocks to components, the demo, all tests in one command, the figures.

use clap::{Parser, Subcommand};
use std::process::ExitCode;

mod bench;
mod cargo;
mod cross;
mod demo;
mod dist;
mod guests;
mod languages;
mod test;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Builds and tests what cargo alone cannot")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run the alarm unit against a simulated field device, building whatever is missing
    Demo(demo::Demo),
    /// Run everything that must hold: format, guests, lints, all tests, the demo
    Test(test::Test),
    /// Build function blocks to components
    Guests(guests::Guests),
    /// Build any crate written with latchwork-sdk to a component
    Component(guests::Component),
    /// Build and test blocks in every language
    Languages(languages::Languages),
    /// Build the static programs that the virtual machine of tests/gpio-vm runs
    Static,
    /// Make the archives for x86-64 and aarch64 in TARGET/dist
    Dist(dist::Dist),
    /// Measure the figures of docs/performance.md
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let done = match Cli::parse().task {
        Task::Demo(args) => demo::execute(&args),
        Task::Test(args) => test::execute(&args),
        Task::Guests(args) => guests::execute(&args),
        Task::Component(args) => guests::execute_component(&args),
        Task::Languages(args) => languages::execute(&args),
        Task::Static => cross::Machine::X86.build().map(drop),
        Task::Dist(args) => dist::execute(&args),
        Task::Bench(args) => bench::execute(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            error.chain().skip(1).for_each(|cause| eprintln!("  because: {cause}"));
            ExitCode::FAILURE
        }
    }
}
