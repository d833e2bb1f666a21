//! `latchwork test`

use clap::Args;
use std::path::PathBuf;

/// `latchwork test`
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 all cases passed, 1 a case failed or a file is wrong, 2 the command line is wrong or no case was chosen.")]
pub(crate) struct Test {
    /// Test files, or folders with FILE.test.toml somewhere below.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Only cases with this in their name.
    #[arg(long, value_name = "NAME")]
    pub(crate) filter: Option<String>,
    /// Folder with components, searched before those of the test file and of its plant; may be given several times.
    #[arg(long = "components", value_name = "DIR")]
    pub(crate) folders: Vec<PathBuf>,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Also write a report that build servers read (JUnit XML).
    #[arg(long, value_name = "FILE")]
    pub(crate) junit: Option<PathBuf>,
    /// Test again whenever a test file, a component or a table changes, until Ctrl-C.
    #[arg(long, conflicts_with = "json")]
    pub(crate) watch: bool,
}
