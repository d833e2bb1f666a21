//! The board: is it one, and may this program take that pin?
//!
//! The registers would let it take any pin from anybody, so it asks the kernel who has the line and looks what the pin
//! does before it touches it.

use gpiocdev::Chip;
use rppal::gpio::{Error, Gpio, Mode, Pin};
use rppal::system::{DeviceInfo, SoC};
use std::io::ErrorKind;
use std::path::Path;

/// The pins' chips, as the kernel labels them.
const LABELS: [&str; 3] = ["pinctrl-bcm2835", "pinctrl-bcm2711", "pinctrl-rp1"];
/// Registers of the boards before the Raspberry Pi 5, and of those from it on.
const REGISTERS: [&str; 2] = ["/dev/gpiomem", "/dev/gpiomem0"];

/// The PWM chip that a model has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Usual {
    /// The end of its device's name, if that is known.
    pub(super) device: Option<&'static str>,
    /// Number the kernel usually gives it.
    pub(super) number: u8,
}

/// Which board it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Model {
    /// The pins stand in a chip of their own, which the Raspberry Pi 5 brought.
    rp1: bool,
}

impl Model {
    /// Looks at the board.
    pub(super) fn find() -> Result<Self, String> {
        match DeviceInfo::new() {
            Ok(info) => Ok(Self { rp1: info.soc() == SoC::Bcm2712 }),
            Err(_) => {
                Err("this machine is no Raspberry Pi that this driver knows (neither /proc/cpuinfo nor the device \
                           tree names one); on any other Linux board write kind = \"gpio\" and `line` in place of `pin`"
                    .into())
            }
        }
    }

    fn registers(self) -> &'static str {
        REGISTERS[usize::from(self.rp1)]
    }

    /// Its PWM chip.
    pub(super) fn pwm(self) -> Usual {
        // The kernel numbers chips as it finds them; only the device behind it says that it is the one of the header.
        if self.rp1 { Usual { device: Some("1f00098000.pwm"), number: 2 } } else { Usual { device: None, number: 0 } }
    }
}

/// The pins while some of them are being opened.
pub(super) struct Board {
    gpio: Gpio,
    chip: Chip,
}

impl Board {
    /// Finds the chip and, unless `mapped` has them, maps the registers. They must be kept while there are points: rppal
    /// does not find a chip that came back under another number, and does not need to as long as somebody has them.
    pub(super) fn open(model: Model, mapped: &mut Option<Gpio>) -> Result<Self, String> {
        let gpio = match mapped {
            Some(gpio) => gpio.clone(),
            None => mapped.insert(Gpio::new().map_err(|error| explain(&error, model))?).clone(),
        };
        let chips = gpiocdev::chip::chips().map_err(|e| format!("looking for /dev/gpiochip* failed: {e}"))?;
        let is_it = |chip: &Chip| chip.info().is_ok_and(|i| LABELS.contains(&i.label.as_str()));
        let chip = chips.into_iter().filter_map(|path| Chip::from_path(path).ok()).find(is_it);
        match chip {
            Some(chip) => Ok(Self { gpio, chip }),
            None => Err(no_chip()),
        }
    }

    /// The chip's device.
    pub(super) fn path(&self) -> &Path {
        self.chip.path()
    }

    /// Takes a pin that nobody else has. The pin itself is not touched.
    pub(super) fn take(&self, pin: u8) -> Result<Pin, String> {
        let taken = self.gpio.get(pin).map_err(|error| match error {
            Error::PinUsed(_) => {
                format!("another driver of this plant has GPIO{pin}: one pin, one driver; remove one of the points")
            }
            Error::PinNotAvailable(_) => format!("this board has no GPIO{pin}: choose another `pin`"),
            other => format!("GPIO{pin} cannot be had: {other}"),
        })?;
        let info = self
            .chip
            .line_info(pin.into())
            .map_err(|e| format!("the kernel does not know GPIO{pin}: {}", cause(&e)))?;
        if info.used {
            let holder = if info.consumer.is_empty() { "the kernel".into() } else { format!("\"{}\"", info.consumer) };
            return Err(format!("GPIO{pin} is held by {holder}: end that program, or choose another `pin`"));
        }
        match taken.mode() {
            Mode::Input | Mode::Output | Mode::Null => Ok(taken),
            function => Err(format!(
                "GPIO{pin} works for a peripheral of the board (function {function}, as serial port, I2C, SPI or PWM): \
                 switch that off in /boot/firmware/config.txt and restart, or choose another `pin`"
            )),
        }
    }
}

fn no_chip() -> String {
    format!(
        "no /dev/gpiochip0, 1, … up to the first number that is missing carries the label {}: the kernel has no driver for \
         the pins, or their chip came back under another number, which a restart of the machine mends",
        LABELS.join(" or ")
    )
}

/// What an error of rppal means, and the way out.
fn explain(error: &Error, model: Model) -> String {
    let registers = model.registers();
    match error {
        Error::PermissionDenied(path) if path == "/dev/mem" => missing(registers),
        Error::PermissionDenied(path) => denied(path),
        Error::Io(e) if e.kind() == ErrorKind::PermissionDenied => denied(registers),
        Error::Io(e) if e.kind() == ErrorKind::NotFound && !Path::new(registers).exists() => missing(registers),
        Error::Io(e) if e.kind() == ErrorKind::NotFound => no_chip(),
        Error::Io(e) => format!("{registers} cannot be used: {e}"),
        other => format!("the pins cannot be used: {other}"),
    }
}

fn missing(path: &str) -> String {
    format!(
        "there is no {path}: the kernel has no driver for the pins' registers; Raspberry Pi OS has one. Or write \
             kind = \"gpio\" and `line` in place of `pin`: that needs no registers"
    )
}

/// Permission denied, and the way out.
pub(super) fn denied(path: &str) -> String {
    format!(
        "permission denied for {path}: the user must be in the group `gpio` (sudo usermod -aG gpio USER, then log in \
         again; in a systemd unit SupplementaryGroups=gpio)"
    )
}

/// The cause alone, without the library's names for it.
pub(super) fn cause(error: &gpiocdev::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}
