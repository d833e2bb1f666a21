//! Arguments of the commands for authors of blocks.

use clap::Args as ClapArgs;
use std::path::PathBuf;

/// `latchwork new`
#[derive(ClapArgs, Debug)]
pub(crate) struct New {
    /// Name of the block and of the new folder: lower-case letters, digits and single `-`.
    #[arg(value_name = "NAME")]
    pub(crate) name: Option<String>,
    /// The language it is written in; without it, a terminal is asked.
    #[arg(long, value_name = "LANG", long_help = LANG_HELP)]
    pub(crate) lang: Option<String>,
    /// Device class it has: `latchwork:device/motor`, or `motor`; with --wit, which one of that folder.
    #[arg(long, value_name = "CLASS")]
    pub(crate) class: Option<String>,
    /// Folder with the WIT package of a class of your own.
    #[arg(long, value_name = "DIR")]
    pub(crate) wit: Option<PathBuf>,
}

const LANG_HELP: &str = "\
The language it is written in; without it, a terminal is asked.
One of: rust, c, cpp, zig, assemblyscript, go, python, javascript, typescript.";

/// `latchwork build`
#[derive(ClapArgs, Debug)]
pub(crate) struct Build {
    /// The folder that `latchwork new` wrote.
    #[arg(value_name = "DIR", default_value = ".")]
    pub(crate) folder: PathBuf,
    /// Print the result as JSON: {path, class, bytes, imports}.
    #[arg(long)]
    pub(crate) json: bool,
}
