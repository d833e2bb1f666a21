//! A Python with pymodbus in it, of exactly one version.
//!
//! `LATCHWORK_PYTHON` names an interpreter that has it already; without it `python3 -m pip` brings it once into the
//! target folder. A machine that can do neither fails the tests: a skipped peer proves nothing.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const PACKAGES: [&str; 2] = ["pymodbus==3.16.1", "pyserial==3.5"];
const PROBE: &str = "import serial, pymodbus; assert pymodbus.__version__ == '3.16.1', pymodbus.__version__";

/// An interpreter and the folder of its extra packages.
#[derive(Clone, Debug)]
pub(crate) struct Python {
    program: String,
    packages: Option<PathBuf>,
}

impl Python {
    /// A command that runs a script.
    pub(crate) fn run(&self, script: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.arg(script);
        if let Some(packages) = &self.packages {
            command.env("PYTHONPATH", packages);
        }
        command
    }

    fn probe(&self) -> Result<(), String> {
        let mut command = Command::new(&self.program);
        command.args(["-c", PROBE]);
        if let Some(packages) = &self.packages {
            command.env("PYTHONPATH", packages);
        }
        said(command.output(), &self.program).map(drop)
    }
}

/// The interpreter, found or made once per process.
pub(crate) fn python() -> Python {
    static FOUND: OnceLock<Result<Python, String>> = OnceLock::new();
    FOUND.get_or_init(find).clone().unwrap_or_else(|why| {
        panic!(
            "these tests need Python 3.10 or newer with {}:\n{why}\n\
             Install python3 and python3-pip, or set LATCHWORK_PYTHON to an interpreter that has these packages.",
            PACKAGES.join(" and ")
        )
    })
}

fn find() -> Result<Python, String> {
    if let Ok(program) = std::env::var("LATCHWORK_PYTHON") {
        let python = Python { program, packages: None };
        return python.probe().map(|()| python);
    }
    let exe = std::env::current_exe().map_err(|e| e.to_string())?;
    // target/PROFILE/deps/THIS
    let target = exe.ancestors().nth(3).ok_or("the test stands in no target folder")?;
    let folder = target.join("python");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    // Other test processes may want the same at the same time.
    let lock = std::fs::File::create(folder.join("lock")).map_err(|e| e.to_string())?;
    lock.lock().map_err(|e| e.to_string())?;
    let packages = folder.join(PACKAGES.join("+").replace("==", "-"));
    let python = Python { program: "python3".into(), packages: Some(packages.clone()) };
    if python.probe().is_ok() {
        return Ok(python);
    }
    let _ = std::fs::remove_dir_all(&packages);
    let mut pip = Command::new(&python.program);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target"])
        .arg(&packages)
        .args(PACKAGES);
    said(pip.output(), "python3 -m pip install")?;
    python.probe().map(|()| python)
}

fn said(output: std::io::Result<Output>, what: &str) -> Result<String, String> {
    let output = output.map_err(|e| format!("`{what}` does not start: {e}"))?;
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if output.status.success() { Ok(text) } else { Err(format!("`{what}` failed ({}):\n{text}", output.status)) }
}
