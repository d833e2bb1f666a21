//! A folder with a plant and its test.

use latchwork_block::Engine;
use latchwork_plantbed::{Checked, check_text};
use latchwork_testbed::case::{CaseReport, Options};
use latchwork_tests_plant::{component_folders, engine, target};
use std::fmt::Write;
use tempfile::TempDir;

/// A unit on points of its own, a tank that is fed by a model, a timer in a lane that is slower, an interrupt lane.
pub(crate) const PLANT: &str = r#"
[lane.main]
every = "10ms"
[lane.slow]
every = "100ms"

[driver.field]
kind = "modbus-tcp"
address = "127.0.0.1:5020"
[driver.field.points]
level = { input-register = 0, type = "u16" }
door = { discrete-input = 0 }
open = { discrete-input = 1 }
lamp = { coil = 0, from = "unit.outputs.lamp", safe = false }

[sim.block.tank]
component = "tank-model"
lane = "main"
[sim.feed]
"field.level" = "tank.outputs.level"

[block.unit]
component = "alarm-unit"
lane = "main"
inputs.level = "field.level"
inputs.door = "field.door"
settings.veracity-time = "0ms"
retain = true

[block.late]
component = "ton"
lane = "slow"
inputs.in = "field.open"
inputs.pt = "200ms"

[block.count]
component = "ctu"
lane = "main"
inputs.cu = "field.open"
inputs.pv = 3
retain = true

[[alarm]]
match = 'unit\.alarms\.door'
code = 0xCC00
text = "the door is open"
"#;

/// A plant in a folder of its own.
pub(crate) struct Folder {
    folder: TempDir,
    engine: Engine,
}

impl Folder {
    pub(crate) fn new(plant: &str) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let list: Vec<_> = component_folders().iter().map(|f| format!("{:?}", f.display().to_string())).collect();
        let head = format!("[plant]\nname = \"hall\"\ncomponents = [{}]\n", list.join(", "));
        std::fs::write(folder.path().join("plant.toml"), format!("{head}{plant}")).expect("the plant file");
        Self { folder, engine: engine() }
    }

    /// With another file.
    pub(crate) fn with(self, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(self.folder.path().join(name), bytes).expect("a file");
        self
    }

    pub(crate) fn check(&self, text: &str) -> Checked {
        let mut folders = component_folders();
        folders.push(target().join("example-components"));
        check_text(&self.folder.path().join("hall.test.toml"), text.into(), &self.engine, &Options { folders })
    }

    /// The cases of a file that is right.
    pub(crate) fn run(&self, text: &str) -> Vec<CaseReport> {
        let checked = self.check(text);
        let Some(tests) = &checked.tests else { panic!("{}", checked.render(false)) };
        (0..tests.cases().len()).map(|case| tests.run(case, 10_000_000)).collect()
    }

    /// The cases as a person reads them.
    pub(crate) fn told(&self, text: &str) -> String {
        let mut out = String::new();
        for case in self.run(text) {
            // Writing to a String never fails.
            let _ = writeln!(out, "{}: {}", case.name, if case.passed { "fine" } else { "FAILED" });
            case.failures.iter().for_each(|f| out += &format!("{}\n", f.render(2)));
            if case.more_failures > 0 {
                let _ = writeln!(out, "  {} more", case.more_failures);
            }
        }
        out
    }

    #[track_caller]
    pub(crate) fn passes(&self, text: &str) {
        let told = self.told(text);
        assert!(!told.contains("FAILED"), "{told}");
    }

    /// Findings without the folders of this machine.
    pub(crate) fn shown(&self, checked: &Checked) -> String {
        let text = checked.render(false).replace(&self.folder.path().display().to_string(), "FOLDER");
        text.replace(&target().display().to_string(), "TARGET").trim_end().to_owned()
    }
}
