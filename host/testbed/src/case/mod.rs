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

mod history;
pub mod keys;
mod locate;
mod model;
mod read;
mod report;
mod run;
mod steps;
mod table;
mod values;

pub(crate) use locate::built;
pub use model::{Case, Subject, TestFile};
pub use read::{Checked, Options, check_file, check_text};
pub use report::{CaseReport, Failure, Mismatch, Timeline, TimelineRow};
pub use run::FAILURES;
