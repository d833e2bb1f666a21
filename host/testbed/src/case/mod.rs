//! Component tests: cases of steps at virtual time, and what is expected after each.
//!
//! ```text
//! FILE.test.toml ─check_file─► Checked ─► TestFile, cases ─run─► CaseReport (failures, each with its timeline)
//!                                  └────► findings with line and column
//! ```
//!
//! A case starts a new instance. The block is executed once in `every`, from time 0 on, and at each step; inputs keep their
//! values until a step changes them. What is unset is as in a plant: settings are the component's defaults or 0.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use latchwork_block::{Engine, EngineOptions, Ticker};
//! use latchwork_testbed::case::{Options, check_file};
//!
//! let engine = Engine::new(EngineOptions::default())?;
//! let _ticker = Ticker::start(&engine, std::time::Duration::from_millis(10));
//! let checked = check_file("pump.test.toml".as_ref(), &engine, &Options::default());
//! let file = checked.file.as_ref().ok_or_else(|| checked.render(false))?;
//! for case in &file.cases {
//!     let report = file.run(case, 10_000_000);
//!     assert!(report.passed, "{}: {:#?}", report.name, report.failures);
//! }
//! # Ok(())
//! # }
//! ```

mod cells;
mod change;
mod columns;
mod compare;
mod history;
pub mod keys;
mod locate;
mod model;
mod ports;
mod read;
mod report;
mod run;
mod steps;
mod table;
mod tables;
mod values;
mod verdict;

/// What test files of other subjects than components are read and told with.
pub mod kit {
    pub use super::cells::{Cells, Part, no_column, quality, words};
    pub use super::compare::compare;
    pub use super::history::{Column, History, Kind};
    pub use super::locate::Finder;
    pub use super::model::{Expected, SetCell};
    pub use super::table::{Cell, Place, Row, Rows, rows};
    pub use super::tables::{cases, folders, get, group, table, tables};
    pub use super::values::{Group, Said, listed, tolerance};
}

pub(crate) use locate::built;
pub use model::{Case, Subject, TestFile};
pub use read::{Checked, Options, check_file, check_text};
pub use report::{CaseReport, Failure, Mismatch, Timeline, TimelineRow};
pub use run::FAILURES;
