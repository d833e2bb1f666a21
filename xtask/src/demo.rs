//! `cargo xtask demo`: the alarm unit against a simulated field device, from nothing to a live table.

use crate::cargo::{cargo, root, run, target_dir};
use crate::guests;
use anyhow::{Context, Result, bail};
use clap::Args;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

/// Arguments of `cargo xtask demo`.
#[derive(Args, Debug)]
pub(crate) struct Demo {
    /// How long to run, such as 20s or 1m.
    #[arg(long = "for", value_name = "TIME", default_value = "20s")]
    duration: String,
    /// Port of the field device on the loopback interface; 0 takes a free one.
    #[arg(long, default_value_t = 5020)]
    port: u16,
    /// Everything is built already.
    #[arg(long, hide = true)]
    built: bool,
    /// Further arguments for `latchwork run`, after `--`.
    #[arg(last = true)]
    run: Vec<String>,
}

/// The field device while it runs; ended on every way out.
struct Device(Child);

impl Drop for Device {
    fn drop(&mut self) {
        // It may have ended by itself; then there is nothing to end and nothing to tell.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn execute(args: &Demo) -> Result<()> {
    if !args.built {
        eprintln!("building the host and the field device (the first time takes some minutes)");
        run(cargo().args(["build", "--release", "--package", "latchwork-cli", "--package", "field-device"]))?;
        guests::execute(&guests::Guests::default())?;
    }
    let target = target_dir()?;
    let (device, address) = start_device(&target, args.port)?;
    eprintln!("field device: Modbus TCP on {address}, process {}", device.0.id());
    let plant = plant(&target, &address)?;
    let mut latchwork = Command::new(target.join("release/latchwork"));
    latchwork.arg("run").arg(&plant).args(["--for", &args.duration]).args(&args.run);
    // Ctrl-C and its like are for the plant, which stops in order; this program waits for it.
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    for signal in [SIGINT, SIGTERM, SIGHUP, SIGQUIT] {
        signal_hook::flag::register(signal, Arc::default()).context("the handler of Ctrl-C could not be set")?;
    }
    let status = latchwork.status().context("latchwork could not be started")?;
    drop(device);
    if !status.success() {
        bail!("latchwork run ended with {status}");
    }
    Ok(())
}

fn start_device(target: &Path, port: u16) -> Result<(Device, String)> {
    let mut command = Command::new(target.join("release/field-device"));
    // Its own bound on its life, should this program be killed.
    command.args(["--listen", &format!("127.0.0.1:{port}"), "--for", "1h"]);
    // A group of its own: Ctrl-C stops the plant, which then still finds the device and leaves it safe.
    let child = command.process_group(0).stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut device = Device(child.context("the field device could not be started")?);
    let mut line = String::new();
    if let Some(out) = device.0.stdout.take() {
        BufReader::new(out).read_line(&mut line).context("the field device said nothing")?;
    }
    let bound: Option<serde_json::Value> = serde_json::from_str(&line).ok();
    match bound.as_ref().and_then(|b| b["listening"].as_str()) {
        Some(address) => Ok((device, address.to_string())),
        None => bail!("the field device did not come up on port {port}; is the port taken? --port 0 takes a free one"),
    }
}

/// The example's plant file; a copy with another address or folder of components when these differ from the file's.
fn plant(target: &Path, address: &str) -> Result<PathBuf> {
    let original = root().join("examples/alarm-unit/plant.toml");
    if target == root().join("target") && address == "127.0.0.1:5020" {
        return Ok(original);
    }
    let text = std::fs::read_to_string(&original).with_context(|| format!("{}", original.display()))?;
    let components = toml_string(&target.join("components").display().to_string());
    let copy =
        text.replace("\"127.0.0.1:5020\"", &toml_string(address)).replace("\"../../target/components\"", &components);
    let path = target.join("demo/plant.toml");
    std::fs::create_dir_all(target.join("demo"))?;
    std::fs::write(&path, copy).with_context(|| format!("{}", path.display()))?;
    Ok(path)
}

/// A basic string of TOML; its escapes are those of JSON.
fn toml_string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
