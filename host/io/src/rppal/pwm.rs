//! A PWM channel through the kernel's sysfs.
//!
//! The file of the pulse's width stays open, so that a change costs one system call and no memory. rppal's own PWM opens
//! it anew for each change, and waits up to a second for the system to hand a new channel over; a lane cannot wait.

use super::board::{Usual, denied};
use super::place::PwmPlace;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Where the kernel shows its PWM chips.
pub(super) const ROOT: &str = "/sys/class/pwm";

/// Why a channel is not open.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Closed {
    /// The system has yet to hand the channel over to the user's group: try again.
    Wait,
    /// What stands in the way.
    Refused(String),
}

/// A channel that runs.
#[derive(Debug)]
pub(super) struct Pwm {
    width: File,
    /// ns.
    period: u64,
    /// Width of the pulse it shows, ns.
    shown: u64,
}

impl Pwm {
    /// Switches a channel on with duty cycle `duty`. `chip` is the user's choice of the chip, `usual` the model's.
    pub(super) fn open(
        root: &Path,
        chip: Option<u8>,
        usual: Usual,
        place: &PwmPlace,
        duty: f64,
    ) -> Result<Self, Closed> {
        let chip = find(root, chip, usual, place.channel).map_err(Closed::Refused)?;
        let channel = chip.join(format!("pwm{}", place.channel));
        let fresh = !channel.exists();
        if fresh {
            let path = chip.join("export");
            put(&path, &place.channel.to_string()).map_err(|e| Closed::Refused(explain(&path, &e, place)))?;
        }
        let period = place.period;
        let shown = width(period, duty);
        start(&channel, period, shown).map(|width| Self { width, period, shown }).map_err(|(path, error)| match error {
            e if fresh && e.kind() == ErrorKind::PermissionDenied => Closed::Wait,
            e => Closed::Refused(explain(&path, &e, place)),
        })
    }

    /// Shows a duty cycle, if it does not already. Does not allocate.
    pub(super) fn show(&mut self, duty: f64) -> Result<(), String> {
        if width(self.period, duty) == self.shown { Ok(()) } else { self.force(duty) }
    }

    /// Shows a duty cycle, whatever it is believed to show.
    pub(super) fn force(&mut self, duty: f64) -> Result<(), String> {
        let width = width(self.period, duty);
        let mut text = [0; 24];
        let mut rest = &mut text[..];
        // 20 digits and the end of the line always fit.
        let _ = writeln!(rest, "{width}");
        let unused = rest.len();
        let end = text.len() - unused;
        self.width.write_all_at(&text[..end], 0).map_err(|e| e.to_string())?;
        self.shown = width;
        Ok(())
    }
}

/// Width of the pulse for a duty cycle, ns.
fn width(period: u64, duty: f64) -> u64 {
    (period as f64 * duty.clamp(0.0, 1.0)).round() as u64
}

/// The folder of the chip that has the channel.
fn find(root: &Path, chosen: Option<u8>, usual: Usual, channel: u8) -> Result<PathBuf, String> {
    let channels = |path: &Path| -> u32 {
        fs::read_to_string(path.join("npwm")).ok().and_then(|n| n.trim().parse().ok()).unwrap_or(0)
    };
    let mut chips: Vec<PathBuf> = fs::read_dir(root).into_iter().flatten().flatten().map(|e| e.path()).collect();
    chips.sort();
    let named = root.join(format!("pwmchip{}", chosen.unwrap_or(usual.number)));
    let device = |c: &PathBuf| usual.device.is_some_and(|d| is_of(c, d));
    if chosen.is_some() {
        chips.retain(|c| *c == named);
    } else if let Some(first) = chips.iter().position(device).or_else(|| chips.iter().position(|c| *c == named)) {
        chips[..=first].rotate_right(1);
    }
    if let Some(chip) = chips.iter().find(|c| channels(c) > channel.into()) {
        return Ok(chip.clone());
    }
    Err(match (chips.first(), chosen) {
        (Some(chip), _) => {
            format!("{} has no PWM channel {channel}, it has {}: choose a lower `pwm`", chip.display(), channels(chip))
        }
        (None, Some(_)) => {
            format!("there is no {}: see `ls {}`, or take `pwm-chip` away", named.display(), root.display())
        }
        (None, None) => format!(
            "{} has no PWM chip: switch it on with the line dtoverlay=pwm-2chan in /boot/firmware/config.txt and restart",
            root.display()
        ),
    })
}

/// A chip belongs to a device: sysfs has it as a link into the device's folder.
fn is_of(chip: &Path, device: &str) -> bool {
    let real = fs::canonicalize(chip).unwrap_or_default();
    real.components().any(|c| c.as_os_str().to_string_lossy().ends_with(device))
}

/// Sets a channel up and runs it.
fn start(channel: &Path, period: u64, width: u64) -> Result<File, (PathBuf, io::Error)> {
    let set = |name: &str, text: &str| {
        let path = channel.join(name);
        put(&path, text).map_err(|e| (path, e))
    };
    // A channel that was given back while it ran is believed to run and does not: it must be switched off first. The
    // kernel refuses that, and a width, while there is no period yet: neither matters then.
    for (name, text) in [("enable", "0"), ("duty_cycle", "0")] {
        match set(name, text) {
            Err((path, e)) if e.kind() == ErrorKind::PermissionDenied => return Err((path, e)),
            _ => {}
        }
    }
    set("period", &period.to_string())?;
    set("duty_cycle", &width.to_string())?;
    let polarity = fs::read_to_string(channel.join("polarity")).unwrap_or_default();
    if polarity.trim() == "inversed" {
        set("polarity", "normal")?;
    }
    set("enable", "1")?;
    let path = channel.join("duty_cycle");
    OpenOptions::new().write(true).open(&path).map_err(|e| (path, e))
}

fn put(path: &Path, text: &str) -> io::Result<()> {
    OpenOptions::new().write(true).truncate(true).open(path)?.write_all(text.as_bytes())
}

fn explain(path: &Path, error: &io::Error, place: &PwmPlace) -> String {
    match error.kind() {
        ErrorKind::PermissionDenied => denied(&path.display().to_string()),
        ErrorKind::ReadOnlyFilesystem => format!(
            "{} is read-only here: in a systemd unit write ProtectKernelTunables=no, in a container hand /sys/class/pwm in \
             as writable",
            path.display()
        ),
        ErrorKind::ResourceBusy => format!("PWM channel {} is in use by another driver of the kernel", place.channel),
        _ => format!("{} does not take a period of {} ns: {error}", path.display(), place.period),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder that looks like /sys/class/pwm.
    struct Sys(PathBuf);

    impl Sys {
        fn new(name: &str, chips: &[(&str, u8)]) -> Self {
            let root = std::env::temp_dir().join(format!("latchwork-pwm-{}-{name}", std::process::id()));
            for (chip, channels) in chips {
                for n in 0..*channels {
                    let channel = root.join(chip).join(format!("pwm{n}"));
                    fs::create_dir_all(&channel).unwrap();
                    for (file, text) in [("enable", "1"), ("period", "0"), ("duty_cycle", "77"), ("polarity", "normal")]
                    {
                        fs::write(channel.join(file), text).unwrap();
                    }
                }
                fs::write(root.join(chip).join("npwm"), format!("{channels}\n")).unwrap();
            }
            Self(root)
        }

        /// The first line of a file of channel 1 of `pwmchip2`.
        fn shown(&self, file: &str) -> String {
            let text = fs::read_to_string(self.0.join("pwmchip2/pwm1").join(file)).unwrap();
            text.lines().next().unwrap_or_default().to_owned()
        }
    }

    impl Drop for Sys {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn usual(number: u8) -> Usual {
        Usual { device: None, number }
    }

    const PLACE: PwmPlace = PwmPlace { channel: 1, period: 50_000 };

    #[test]
    fn a_channel_runs_with_its_first_value_and_takes_others() {
        let sys = Sys::new("runs", &[("pwmchip0", 1), ("pwmchip2", 2)]);
        fs::write(sys.0.join("pwmchip2/pwm1/polarity"), "inversed\n").unwrap();
        let mut pwm = Pwm::open(&sys.0, None, usual(2), &PLACE, 0.25).unwrap();
        assert_eq!(
            ["enable", "period", "duty_cycle", "polarity"].map(|f| sys.shown(f)),
            ["1", "50000", "12500", "normal"]
        );
        for (duty, width) in [(1.0, "50000"), (0.0, "0"), (0.5, "25000"), (7.0, "50000"), (-1.0, "0")] {
            pwm.show(duty).unwrap();
            assert_eq!(sys.shown("duty_cycle"), width, "{duty}");
        }
        // What it shows is not written again.
        fs::write(sys.0.join("pwmchip2/pwm1/duty_cycle"), "9").unwrap();
        pwm.show(0.0).unwrap();
        assert_eq!(sys.shown("duty_cycle"), "9");
        pwm.force(0.0).unwrap();
        assert_eq!(sys.shown("duty_cycle"), "0");
    }

    #[test]
    fn the_chip_is_the_chosen_one_else_the_usual_one_else_any_that_has_the_channel() {
        let sys = Sys::new("chips", &[("pwmchip0", 1), ("pwmchip2", 2), ("pwmchip3", 4)]);
        let found = |chosen, number, channel| {
            find(&sys.0, chosen, usual(number), channel).map(|p| p.file_name().unwrap().to_string_lossy().into_owned())
        };
        assert_eq!(found(None, 2, 0).as_deref(), Ok("pwmchip2"));
        assert_eq!(found(None, 0, 1).as_deref(), Ok("pwmchip2"));
        assert_eq!(found(None, 9, 3).as_deref(), Ok("pwmchip3"));
        assert_eq!(found(Some(3), 0, 0).as_deref(), Ok("pwmchip3"));
        assert!(found(Some(0), 2, 1).is_err());
    }

    #[test]
    fn on_a_pi_5_the_device_says_which_chip_it_is() {
        let sys = Sys::new("device", &[("pwmchip0", 4), ("pwmchip2", 4)]);
        let device = sys.0.join("devices/1f00098000.pwm/pwm/pwmchip6");
        fs::create_dir_all(&device).unwrap();
        fs::write(device.join("npwm"), "4\n").unwrap();
        let class = sys.0.join("class");
        fs::create_dir_all(&class).unwrap();
        for (name, to) in [("pwmchip0", "pwmchip0"), ("pwmchip2", "pwmchip2")] {
            std::os::unix::fs::symlink(sys.0.join(to), class.join(name)).unwrap();
        }
        let pi_5 = Usual { device: Some("1f00098000.pwm"), number: 2 };
        let found = |chosen| find(&class, chosen, pi_5, 0).unwrap().file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(found(None), "pwmchip2", "an older kernel: by its number");
        std::os::unix::fs::symlink(&device, class.join("pwmchip6")).unwrap();
        assert_eq!([found(None), found(Some(0))], ["pwmchip6", "pwmchip0"]);
    }

    #[test]
    fn what_stands_in_the_way() {
        let sys = Sys::new("way", &[("pwmchip0", 1)]);
        let hide = |r: Result<Pwm, Closed>| match r.unwrap_err() {
            Closed::Refused(text) => text.replace(&*sys.0.to_string_lossy(), ROOT),
            Closed::Wait => "wait".into(),
        };
        let none = Sys(sys.0.join("none"));
        let shown = [
            hide(Pwm::open(&none.0, None, usual(0), &PLACE, 0.0)).replace("/none", ""),
            hide(Pwm::open(&sys.0, Some(5), usual(0), &PLACE, 0.0)),
            hide(Pwm::open(&sys.0, None, usual(0), &PLACE, 0.0)),
            explain(Path::new("/sys/class/pwm/pwmchip0/export"), &ErrorKind::PermissionDenied.into(), &PLACE),
            explain(Path::new("/sys/class/pwm/pwmchip0/export"), &ErrorKind::ResourceBusy.into(), &PLACE),
            explain(Path::new("/sys/class/pwm/pwmchip0/export"), &ErrorKind::ReadOnlyFilesystem.into(), &PLACE),
            explain(Path::new("/sys/class/pwm/pwmchip0/pwm1/period"), &ErrorKind::InvalidInput.into(), &PLACE),
        ];
        insta::assert_snapshot!(shown.join("\n"));
    }
}
