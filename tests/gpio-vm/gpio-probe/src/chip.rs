//! A simulated chip: made in configfs, moved and looked at in sysfs.

use std::fs;
use std::io::Result;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A chip of gpio-sim. Dropping it removes it.
pub(crate) struct Chip {
    config: PathBuf,
    lines: usize,
    names: Vec<(usize, String)>,
    label: String,
    /// Where `sim_gpioN` stand while it lives.
    sysfs: PathBuf,
    /// `/dev/gpiochipN` while it lives.
    pub(crate) device: PathBuf,
}

impl Chip {
    /// Makes a chip and brings it to life.
    pub(crate) fn new(label: &str, lines: usize, names: &[(usize, &str)]) -> std::result::Result<Self, String> {
        let config = Path::new("/sys/kernel/config/gpio-sim").join(format!("probe-{label}"));
        let names = names.iter().map(|(n, name)| (*n, (*name).to_owned())).collect();
        let (sysfs, device) = Default::default();
        let mut chip = Self { config, lines, names, label: label.to_owned(), sysfs, device };
        chip.plug().map_err(|e| format!("gpio-sim made no chip: {e}"))?;
        Ok(chip)
    }

    /// Brings it to life.
    pub(crate) fn plug(&mut self) -> Result<()> {
        let bank = self.config.join("bank0");
        if !self.config.exists() {
            fs::create_dir(&self.config)?;
            fs::create_dir(&bank)?;
            // A label in front of `@` may stand on two chips.
            fs::write(bank.join("label"), self.label.split('@').next().unwrap_or_default())?;
            fs::write(bank.join("num_lines"), self.lines.to_string())?;
            for (line, name) in &self.names {
                fs::create_dir(bank.join(format!("line{line}")))?;
                fs::write(bank.join(format!("line{line}/name")), name)?;
            }
        }
        fs::write(self.config.join("live"), "1")?;
        let read = |path: PathBuf| fs::read_to_string(path).map(|t| t.trim().to_owned());
        let chip = read(bank.join("chip_name"))?;
        let device = read(self.config.join("dev_name"))?;
        self.sysfs = Path::new("/sys/devices/platform").join(device).join(&chip);
        self.device = Path::new("/dev").join(chip);
        let end = Instant::now() + Duration::from_secs(2);
        while !self.device.exists() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    /// Pulls it out, whoever holds its lines.
    pub(crate) fn unplug(&mut self) {
        let _ = fs::write(self.config.join("live"), "0");
    }

    /// The device as a plant file names it.
    pub(crate) fn path(&self) -> String {
        self.device.display().to_string()
    }

    /// Moves a line from outside.
    pub(crate) fn pull(&self, line: usize, up: bool) {
        let file = self.sysfs.join(format!("sim_gpio{line}/pull"));
        fs::write(&file, if up { "pull-up" } else { "pull-down" })
            .unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    }

    /// The voltage of a line: high or low.
    pub(crate) fn value(&self, line: usize) -> bool {
        let file = self.sysfs.join(format!("sim_gpio{line}/value"));
        fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display())).trim() == "1"
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        self.unplug();
        let bank = self.config.join("bank0");
        for (line, _) in &self.names {
            let _ = fs::remove_dir(bank.join(format!("line{line}")));
        }
        let _ = fs::remove_dir(bank);
        let _ = fs::remove_dir(&self.config);
    }
}
