//! `latchwork test FILE…`

mod files;
mod junit;
mod print;
mod watch;

use crate::Exit;
use crate::args::test::Test;
use crate::report;
use anyhow::{Context, Result};
use latchwork_block::{Engine, Ticker};
use latchwork_plantbed::{Checked, Tests, check_file};
use latchwork_testbed::case::{CaseReport, Options};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Period of the engine's ticks while tests run: only a block that never ends is stopped by them.
const TICK: Duration = Duration::from_millis(10);

/// Everything that one round found.
struct Round {
    files: Vec<Tested>,
    took: Duration,
}

/// A file and how its cases went.
struct Tested {
    checked: Checked,
    cases: Vec<Timed>,
}

/// A case and how long it took by the machine's clock.
struct Timed {
    report: CaseReport,
    took: Duration,
}

pub(super) fn execute(engine: &Engine, args: &Test) -> Result<Exit> {
    let _ticker = Ticker::start(engine, TICK);
    if let Some(junit) = &args.junit
        && !may_be_written(junit)
    {
        let junit = junit.display();
        report::error(&anyhow::anyhow!(
            "--junit {junit}: there is another file of this name; the report needs a name of its own, and the tests come after it"
        ));
        return Ok(Exit::Usage);
    }
    if args.watch {
        return watch::execute(engine, args);
    }
    let paths = files::find(&args.files)?;
    let round = round(engine, args, &paths, !args.json);
    finish(args, &round)
}

/// Nothing but an earlier report is written over: `--junit *.test.toml` would take the first test for it.
fn may_be_written(junit: &Path) -> bool {
    match std::fs::read_to_string(junit) {
        Ok(text) => text.is_empty() || text.contains("<testsuites"),
        Err(error) => error.kind() == std::io::ErrorKind::NotFound,
    }
}

/// Tests all files once. With `aloud`, each is printed as soon as it is done.
fn round(engine: &Engine, args: &Test, paths: &[PathBuf], aloud: bool) -> Round {
    let begun = Instant::now();
    let options = Options { folders: args.folders.clone() };
    let mut files = Vec::new();
    for path in paths {
        let checked = check_file(path, engine, &options);
        let mut cases = Vec::new();
        if let Some(tests) = &checked.tests {
            let chosen = |name: &str| args.filter.as_ref().is_none_or(|f| name.contains(f.as_str()));
            for (case, _) in tests.cases().into_iter().enumerate().filter(|(_, name)| chosen(name)) {
                let begun = Instant::now();
                let report = tests.run(case, TICK.as_nanos() as u64);
                cases.push(Timed { report, took: begun.elapsed() });
            }
        }
        let tested = Tested { checked, cases };
        if aloud {
            print::file(&tested);
        }
        files.push(tested);
    }
    Round { files, took: begun.elapsed() }
}

/// Summary, reports, exit code.
fn finish(args: &Test, round: &Round) -> Result<Exit> {
    if args.json {
        report::say(&format!("{}\n", serde_json::to_string_pretty(&round.json())?));
    } else {
        report::say(&print::summary(round));
    }
    if let Some(path) = &args.junit {
        let xml = junit::document(round)?;
        std::fs::write(path, xml).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(match round {
        round if round.wrong() > 0 || round.failed() > 0 => Exit::Wanting,
        round if round.cases().next().is_none() => {
            let all = args
                .filter
                .as_ref()
                .map_or(String::new(), |f| format!(" has \"{f}\" in its name; without --filter all are tested"));
            report::error(&anyhow::anyhow!("no case{all}"));
            Exit::Usage
        }
        _ => Exit::Fine,
    })
}

impl Round {
    fn cases(&self) -> impl Iterator<Item = &Timed> {
        self.files.iter().flat_map(|f| &f.cases)
    }

    fn failed(&self) -> usize {
        self.cases().filter(|c| !c.report.passed).count()
    }

    /// Files that could not be tested.
    fn wrong(&self) -> usize {
        self.files.iter().filter(|f| f.checked.tests.is_none()).count()
    }

    fn json(&self) -> serde_json::Value {
        let file = |f: &Tested| {
            let (subject, plant) = match &f.checked.tests {
                Some(Tests::Component(file)) => (Some(&file.subject), None),
                Some(Tests::Plant(file)) => (None, Some(file.model.name.as_str())),
                None => (None, None),
            };
            json!({
                "file": f.checked.path.display().to_string(),
                "component": subject.map(|s| s.component.name()),
                "class": subject.map(|s| s.class.name.as_str()),
                "hash": subject.map(|s| s.component.hash()),
                "plant": plant,
                "findings": f.checked.json(),
                "cases": f.cases.iter().map(|c| &c.report).collect::<Vec<_>>(),
            })
        };
        json!({
            "ok": self.failed() == 0 && self.wrong() == 0,
            "passed": self.cases().count() - self.failed(),
            "failed": self.failed(),
            "wrong-files": self.wrong(),
            "took-ns": self.took.as_nanos() as u64,
            "files": self.files.iter().map(file).collect::<Vec<_>>(),
        })
    }
}
