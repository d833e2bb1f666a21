//! The simulated board.

use rustix::mount::{MountFlags, mount, mount_bind};
use std::cell::RefCell;
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Registers of the pins, in bytes from the beginning; each bank has 32 pins.
pub(crate) const SET: u64 = 0x1c;
pub(crate) const CLEAR: u64 = 0x28;
const LEVEL: u64 = 0x34;

const SIM: &str = "/sys/kernel/config/gpio-sim/pi";
/// Pin that somebody else has from the beginning.
pub(crate) const HELD: u8 = 11;
/// Who has it.
pub(crate) const HOLDER: &str = "somebody-else";

/// The board.
pub(crate) struct Pi {
    registers: File,
    /// Folder of the pins of the chip; another one each time it is plugged.
    pins: RefCell<PathBuf>,
}

/// The machine says that it is a Raspberry Pi 3B and has registers, and no chip yet.
pub(crate) fn pretend() -> Result<(), String> {
    put("/tmp/cpuinfo", "Hardware\t: BCM2835\nRevision\t: a02082\n")?;
    mount_bind("/tmp/cpuinfo", "/proc/cpuinfo").map_err(|e| format!("mounting over /proc/cpuinfo: {e}"))?;
    fs::write("/dev/gpiomem", [0; 4096]).map_err(|e| format!("/dev/gpiomem: {e}"))
}

impl Pi {
    /// The chip appears.
    pub(crate) fn new() -> Result<Self, String> {
        let make = |path: &str| fs::create_dir_all(path).map_err(|e| format!("{path}: {e}"));
        let bank = format!("{SIM}/bank0");
        make(&bank)?;
        put(&format!("{bank}/num_lines"), "54")?;
        put(&format!("{bank}/label"), "pinctrl-bcm2835")?;
        let hog = format!("{bank}/line{HELD}/hog");
        make(&hog)?;
        put(&format!("{hog}/name"), HOLDER)?;
        put(&format!("{hog}/direction"), "input")?;
        let registers = OpenOptions::new().read(true).write(true).open("/dev/gpiomem");
        let pi = Self { registers: registers.map_err(|e| e.to_string())?, pins: RefCell::default() };
        pi.plug()?;
        Ok(pi)
    }

    /// The chip is there.
    pub(crate) fn plug(&self) -> Result<(), String> {
        put(&format!("{SIM}/live"), "1")?;
        let chip = get(format!("{SIM}/bank0/chip_name"))?;
        let device = get(format!("{SIM}/dev_name"))?;
        let folder = Path::new("/sys/devices/platform").join(device).join(chip);
        if !folder.exists() {
            return Err(format!("there is no {}", folder.display()));
        }
        self.pins.replace(folder);
        Ok(())
    }

    /// The chip is gone.
    pub(crate) fn unplug(&self) -> Result<(), String> {
        put(&format!("{SIM}/live"), "0")
    }

    /// Puts a level on a pin from outside. It makes an edge; the register does not follow.
    pub(crate) fn pull(&self, pin: u8, high: bool) {
        let path = self.pins.borrow().join(format!("sim_gpio{pin}/pull"));
        fs::write(&path, if high { "pull-up" } else { "pull-down" }).expect("gpio-sim takes a level");
    }

    /// Puts a level into the register.
    pub(crate) fn set_level(&self, pin: u8, high: bool) {
        let at = LEVEL + u64::from(pin / 32) * 4;
        let bit = 1 << (pin % 32);
        let old = self.word(at);
        self.set_word(at, if high { old | bit } else { old & !bit });
    }

    /// Function of a pin: 0 is input, 1 is output, 4 is a peripheral.
    pub(crate) fn function(&self, pin: u8) -> u32 {
        self.word(u64::from(pin / 10) * 4) >> (pin % 10 * 3) & 7
    }

    pub(crate) fn set_function(&self, pin: u8, function: u32) {
        let (at, shift) = (u64::from(pin / 10) * 4, pin % 10 * 3);
        self.set_word(at, self.word(at) & !(7 << shift) | function << shift);
    }

    /// The pin that was written last to a register of set or clear bits of the first 32 pins, if one was; forgets it.
    pub(crate) fn written(&self, register: u64) -> Option<u8> {
        let bits = self.word(register);
        self.set_word(register, 0);
        (bits.count_ones() == 1).then(|| bits.trailing_zeros() as u8)
    }

    fn word(&self, at: u64) -> u32 {
        let mut word = [0; 4];
        self.registers.read_exact_at(&mut word, at).expect("a register is read");
        u32::from_le_bytes(word)
    }

    fn set_word(&self, at: u64, word: u32) {
        self.registers.write_all_at(&word.to_le_bytes(), at).expect("a register is written");
    }
}

/// Folder of a PWM channel of a chip with two, all plain files.
pub(crate) fn pwm(channel: u8) -> Result<PathBuf, String> {
    let chip = Path::new("/sys/class/pwm/pwmchip0");
    if !chip.exists() {
        mount("pwm", "/sys/class/pwm", "tmpfs", MountFlags::empty(), None)
            .map_err(|e| format!("/sys/class/pwm: {e}"))?;
        for n in 0..2 {
            let folder = chip.join(format!("pwm{n}"));
            fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
            for (file, text) in [("enable", "0"), ("period", "0"), ("duty_cycle", "0"), ("polarity", "normal")] {
                fs::write(folder.join(file), text).map_err(|e| e.to_string())?;
            }
        }
        fs::write(chip.join("npwm"), "2").map_err(|e| e.to_string())?;
    }
    Ok(chip.join(format!("pwm{channel}")))
}

/// First line of a file.
pub(crate) fn get(path: impl AsRef<Path>) -> Result<String, String> {
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.as_ref().display()))?;
    Ok(text.lines().next().unwrap_or_default().trim().to_owned())
}

fn put(path: &str, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{path} = {text}: {e}"))
}
