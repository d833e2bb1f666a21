//! A hardware watchdog: a device that resets the machine when nobody has petted it for a while.
//!
//! It counts from the moment it is opened. An orderly stop disarms it (the *magic close*: the letter `V` as the last thing
//! written); a fault, a panic and a kill do not, so that a machine whose control is gone is reset. Two things are the
//! device's to decide, and [`Watchdog::shortfall`] tells them: a timeout other than the one asked for, and a driver without
//! the magic close, which stops at every close. A kernel or module with `nowayout` ignores the disarming: the machine is
//! reset after every stop. See the kernel's `Documentation/watchdog/watchdog-api.rst`.

use rustix::ioctl::{self, Getter, Opcode, Updater, opcode};
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

/// The letter that announces an orderly close.
const MAGIC_CLOSE: &[u8] = b"V";
/// What a pet writes: any letter but the magic one.
const PET: &[u8] = b"p";
/// `WDIOC_GETSUPPORT`
const GET_SUPPORT: Opcode = opcode::read::<Support>(b'W', 0);
/// `WDIOC_SETTIMEOUT`, in seconds; writes back what the device has taken.
const SET_TIMEOUT: Opcode = opcode::read_write::<i32>(b'W', 6);
/// `WDIOF_MAGICCLOSE`
const HAS_MAGIC_CLOSE: u32 = 0x0100;

/// `struct watchdog_info`
#[repr(C)]
struct Support {
    options: u32,
    firmware: u32,
    identity: [u8; 32],
}

/// An armed watchdog. Dropped without [`disarm`](Self::disarm), it stays armed.
pub(crate) struct Watchdog {
    device: File,
    shortfall: Option<String>,
}

impl Watchdog {
    /// Opens and arms the device, usually `/dev/watchdog`, with a timeout in whole seconds, rounded up, at least 1 s.
    ///
    /// A device that cannot set its timeout, as well as a plain file or pipe, keeps its own.
    ///
    /// # Errors
    /// `NotFound` without the device, `PermissionDenied`, `ResourceBusy` when someone else holds it (a device has one holder).
    pub(crate) fn open(path: &Path, timeout: Duration) -> io::Result<Self> {
        // Never created and never truncated: only what is there. Rust opens with O_CLOEXEC, so no child keeps it armed.
        let device = OpenOptions::new()
            .write(true)
            .custom_flags(rustix::fs::OFlags::NONBLOCK.bits() as i32)
            .open(path)
            .map_err(|e| io::Error::new(e.kind(), explain(path, &e)))?;
        let mut shortfall = String::new();
        let asked = i32::try_from(timeout.as_millis().div_ceil(1000)).unwrap_or(i32::MAX).max(1);
        match set_timeout(&device, asked) {
            Ok(taken) if taken == asked => {}
            Ok(taken) => drop(write!(shortfall, "its timeout is {taken} s instead of {asked} s")),
            Err(error) => drop(write!(shortfall, "its timeout cannot be set to {asked} s ({error}): it keeps its own")),
        }
        if support(&device).is_ok_and(|s| s.options & HAS_MAGIC_CLOSE == 0) {
            let and = if shortfall.is_empty() { "" } else { "; " };
            shortfall.push_str(and);
            shortfall.push_str("its driver stops at every close: a process that dies does not reset the machine");
        }
        Ok(Self { device, shortfall: (!shortfall.is_empty()).then_some(shortfall) })
    }

    /// Starts its countdown anew. Never blocks.
    ///
    /// # Errors
    /// `WouldBlock` from a full pipe; whatever the device has, `NotConnected` or `Other` when it has gone.
    pub(crate) fn pet(&mut self) -> io::Result<()> {
        self.device.write_all(PET)
    }

    /// Disarms it: only after an orderly stop, with every output safe.
    ///
    /// # Errors
    /// The last letter was not taken: the machine will be reset.
    pub(crate) fn disarm(mut self) -> io::Result<()> {
        self.device.write_all(MAGIC_CLOSE)
    }

    /// What the device does otherwise than asked, one sentence for a record.
    pub(crate) fn shortfall(&self) -> Option<&str> {
        self.shortfall.as_deref()
    }
}

fn explain(path: &Path, error: &io::Error) -> String {
    let way_out = match error.kind() {
        io::ErrorKind::NotFound => "is there a watchdog? On a Raspberry Pi: dtparam=watchdog=on in config.txt",
        io::ErrorKind::PermissionDenied => "it needs a udev rule that lets this user write it",
        io::ErrorKind::ResourceBusy => {
            "someone else holds it: systemd with RuntimeWatchdogSec, or the watchdog service"
        }
        _ => return format!("{}: {error}", path.display()),
    };
    format!("{}: {error}; {way_out}; `latchwork doctor` tells more", path.display())
}

/// The timeout that the device has taken, s.
fn set_timeout(device: &File, seconds: i32) -> io::Result<i32> {
    let mut value = seconds;
    // SAFETY: WDIOC_SETTIMEOUT reads and writes one C int, which an i32 is wherever Linux runs, and `value` outlives the
    // call. Any other device refuses the number with ENOTTY.
    unsafe { ioctl::ioctl(device, Updater::<SET_TIMEOUT, i32>::new(&mut value)) }?;
    Ok(value)
}

fn support(device: &File) -> io::Result<Support> {
    // SAFETY: WDIOC_GETSUPPORT fills a `struct watchdog_info`, whose layout `Support` has; all its bit patterns are valid.
    Ok(unsafe { ioctl::ioctl(device, Getter::<GET_SUPPORT, Support>::new()) }?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{PipeReader, PipeWriter, Read};
    use std::os::fd::AsRawFd;
    use std::path::PathBuf;

    const SECOND: Duration = Duration::from_secs(1);

    /// A pipe in place of a device: its reader sees what the device would.
    fn pipe() -> (PipeReader, PipeWriter, PathBuf) {
        let (reader, writer) = io::pipe().unwrap();
        let path = PathBuf::from(format!("/proc/self/fd/{}", writer.as_raw_fd()));
        (reader, writer, path)
    }

    /// What was written, after every writer has gone.
    fn written((mut reader, writer, _): (PipeReader, PipeWriter, PathBuf)) -> String {
        drop(writer);
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn an_orderly_stop_ends_with_the_magic_letter() {
        let pipe = pipe();
        let mut watchdog = Watchdog::open(&pipe.2, SECOND).unwrap();
        watchdog.pet().unwrap();
        watchdog.pet().unwrap();
        watchdog.disarm().unwrap();
        assert_eq!(written(pipe), "ppV");
    }

    #[test]
    fn dropped_it_stays_armed() {
        let pipe = pipe();
        let mut watchdog = Watchdog::open(&pipe.2, SECOND).unwrap();
        watchdog.pet().unwrap();
        drop(watchdog);
        assert_eq!(written(pipe), "p");
    }

    #[test]
    fn after_a_panic_it_stays_armed() {
        let pipe = pipe();
        let path = pipe.2.clone();
        let thread = std::thread::spawn(move || {
            let mut watchdog = Watchdog::open(&path, SECOND).unwrap();
            watchdog.pet().unwrap();
            panic!("a fault");
        });
        assert!(thread.join().is_err());
        assert_eq!(written(pipe), "p");
    }

    #[test]
    fn petting_never_blocks() {
        let pipe = pipe();
        let mut watchdog = Watchdog::open(&pipe.2, SECOND).unwrap();
        // Nobody reads: the pipe fills, and then every pet must come back at once.
        let refused = (0..1 << 20).find_map(|_| watchdog.pet().err()).expect("a pipe holds less than a mebibyte");
        assert_eq!(refused.kind(), io::ErrorKind::WouldBlock);
    }

    #[test]
    fn a_plain_file_is_written_from_its_beginning_and_not_made_shorter() {
        let path = std::env::temp_dir().join(format!("latchwork-watchdog-{}", std::process::id()));
        std::fs::write(&path, "....").unwrap();
        let watchdog = Watchdog::open(&path, SECOND).unwrap();
        watchdog.disarm().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(text, "V...");
    }

    #[test]
    fn what_cannot_set_its_timeout_says_so() {
        for (timeout, seconds) in [
            (Duration::ZERO, "1 s"),
            (Duration::from_millis(1), "1 s"),
            (Duration::from_millis(2_000), "2 s"),
            (Duration::from_millis(2_001), "3 s"),
            (Duration::MAX, "2147483647 s"),
        ] {
            let pipe = pipe();
            let watchdog = Watchdog::open(&pipe.2, timeout).unwrap();
            let shortfall = watchdog.shortfall().unwrap();
            assert!(shortfall.starts_with(&format!("its timeout cannot be set to {seconds} (")), "{shortfall}");
            assert!(shortfall.ends_with("it keeps its own"), "{shortfall}");
        }
    }

    #[test]
    fn a_device_that_is_not_there_is_not_made() {
        let path = std::env::temp_dir().join(format!("latchwork-no-watchdog-{}", std::process::id()));
        let error = Watchdog::open(&path, SECOND).err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        let text = error.to_string();
        assert!(text.contains("dtparam=watchdog=on") && text.contains("latchwork-no-watchdog"), "{text}");
        assert!(!path.exists());
    }

    #[test]
    fn the_numbers_are_the_kernels() {
        // From linux/watchdog.h: _IOWR('W', 6, int) and _IOR('W', 0, struct watchdog_info) where ioctls have their usual layout.
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        assert_eq!((SET_TIMEOUT, GET_SUPPORT), (0xc004_5706, 0x8028_5700));
        assert_eq!(size_of::<Support>(), 40);
    }
}
