//! `cargo xtask`: the only build tool besides cargo.

use clap::{Parser, Subcommand};

mod guests;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Builds and tests what cargo alone cannot")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build function blocks to components
    Guests(guests::Guests),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().task {
        Task::Guests(args) => guests::execute(&args),
    }
}
