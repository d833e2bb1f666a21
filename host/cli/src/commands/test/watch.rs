//! Tests again whenever something changes.

use super::{files, finish, round};
use crate::Exit;
use crate::args::test::Test;
use crate::report;
use anyhow::Result;
use latchwork_block::Engine;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// How often files are looked at.
const LOOK: Duration = Duration::from_millis(200);

/// Ends with Ctrl-C, or with an error that no change of a file mends.
pub(super) fn execute(engine: &Engine, args: &Test) -> Result<Exit> {
    loop {
        let paths = files::find(&args.files)?;
        let before = stamps(&paths);
        let round = round(engine, args, &paths, true);
        let exit = finish(args, &round)?;
        if exit == Exit::Usage {
            return Ok(exit);
        }
        let mut watched = paths.clone();
        watched.extend(round.files.iter().flat_map(|f| f.checked.files.iter().cloned()));
        // What changed while the tests ran is seen at once; what the tests named first, from the next change on.
        let mut seen = before;
        seen.extend(stamps(&watched[paths.len()..]));
        report::say("waiting for a change; Ctrl-C ends\n\n");
        while stamps(&watched) == seen && files::find(&args.files).is_ok_and(|now| now == paths) {
            std::thread::sleep(LOOK);
        }
    }
}

/// What tells that a file is another one: its time and size; `None` while it is not there.
fn stamps(paths: &[PathBuf]) -> Vec<Option<(SystemTime, u64)>> {
    let stamp = |path: &PathBuf| {
        let data = std::fs::metadata(path).ok()?;
        Some((data.modified().ok()?, data.len()))
    };
    paths.iter().map(stamp).collect()
}
