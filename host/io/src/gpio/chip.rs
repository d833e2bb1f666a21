//! Finding a chip, and why it cannot be had, in words that help.

use gpiocdev::Error;
use gpiocdev::chip::Chip;
use gpiocdev_uapi::Error as UapiError;
use latchwork_image::nearest;
use rustix::io::Errno;
use std::collections::BTreeSet;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Why a chip cannot be had. Two troubles of one class are the same trouble, whatever their words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// It is not there, or was pulled out.
    Absent,
    /// The user may not open it.
    Denied,
    /// What is there is no GPIO chip, or it is not clear which is meant.
    Wrong,
    /// Anything else the kernel says.
    Other(Option<Errno>),
}

/// Why a chip cannot be had, for a person.
#[derive(Clone, Debug)]
pub(super) struct Trouble {
    pub(super) class: Class,
    words: Words,
}

/// What a trouble's text is made of, once somebody wants to read it: a lane that only tries again must not pay for it.
#[derive(Clone, Debug)]
enum Words {
    Plain(String),
    /// And what chips there are instead.
    Instead(String),
    /// This may not be opened.
    Denied(PathBuf),
}

impl Trouble {
    pub(super) fn new(class: Class, text: impl Into<String>) -> Self {
        Self { class, words: Words::Plain(text.into()) }
    }

    fn instead(class: Class, text: impl Into<String>) -> Self {
        Self { class, words: Words::Instead(text.into()) }
    }

    /// The whole text.
    pub(super) fn text(&self) -> String {
        match &self.words {
            Words::Plain(text) => text.clone(),
            Words::Instead(text) => format!("{text}; {}", here()),
            Words::Denied(path) => denied(path),
        }
    }

    /// The trouble of a chip that is known by its path.
    pub(super) fn of(path: &Path, error: &Error) -> Self {
        let shown = path.display();
        match (errno(error), error) {
            (Some(Errno::NODEV | Errno::NXIO | Errno::NOENT), _) => {
                Self::instead(Class::Absent, format!("{shown} is not there"))
            }
            (Some(Errno::ACCESS | Errno::PERM), _) => Self { class: Class::Denied, words: Words::Denied(path.into()) },
            (Some(Errno::NOTTY | Errno::INVAL), _) | (None, Error::GpioChip(..)) => {
                Self::instead(Class::Wrong, format!("{shown} is no GPIO chip"))
            }
            (code, _) => Self::new(Class::Other(code), format!("{shown} cannot be opened: {}", words(error))),
        }
    }
}

/// The number of an error of the kernel.
pub(crate) fn errno(error: &Error) -> Option<Errno> {
    match error {
        Error::Os(code) | Error::Uapi(_, UapiError::Os(code)) => Some(Errno::from_raw_os_error(code.0)),
        _ => None,
    }
}

/// An error without its number.
pub(super) fn words(error: &Error) -> String {
    let text = errno(error).map_or_else(|| error.to_string(), |code| std::io::Error::from(code).to_string());
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}

/// The chips of this machine by path, in the order of their numbers; a chip with several names comes once.
pub(super) fn paths() -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir("/dev") else { return Vec::new() };
    let names = entries.filter_map(Result::ok).filter(|e| e.file_name().to_string_lossy().starts_with("gpiochip"));
    let real: BTreeSet<PathBuf> = names.filter_map(|e| std::fs::canonicalize(e.path()).ok()).collect();
    let mut paths: Vec<_> = real.into_iter().collect();
    paths.sort_by(|a, b| gpiocdev::chip::path_compare(a, b));
    paths
}

/// What chips there are instead.
fn here() -> String {
    let named = |path: PathBuf| match Chip::from_path(&path).and_then(|c| c.info()) {
        Ok(info) => format!("{} (\"{}\")", path.display(), info.label),
        Err(_) => path.display().to_string(),
    };
    let chips: Vec<String> = paths().into_iter().map(named).collect();
    if chips.is_empty() {
        "this machine has no GPIO character device".into()
    } else {
        format!("the chips here are {}", chips.join(", "))
    }
}

/// Opens the chip a plant file names by path, name or label.
pub(super) fn find(key: &str) -> Result<Chip, Trouble> {
    let numbered = key.strip_prefix("gpiochip").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    if key.contains('/') || numbered {
        let path = if key.contains('/') { PathBuf::from(key) } else { Path::new("/dev").join(key) };
        let chip = Chip::from_path(&path).map_err(|e| Trouble::of(&path, &e))?;
        // The name alone proves nothing: only the kernel knows whether there is a chip behind it.
        chip.info().map_err(|e| Trouble::of(&path, &e))?;
        return Ok(chip);
    }
    by_label(key)
}

fn by_label(label: &str) -> Result<Chip, Trouble> {
    let (mut found, mut labels, mut closed) = (Vec::new(), Vec::new(), None);
    for path in paths() {
        match Chip::from_path(&path).and_then(|chip| chip.info().map(|info| (chip, info))) {
            Ok((chip, info)) if info.label == label || info.name == label => found.push(chip),
            Ok((_, info)) => labels.push(info.label),
            // It may be the one that is meant.
            Err(error) if matches!(errno(&error), Some(Errno::ACCESS | Errno::PERM)) => {
                closed = Some(Trouble::of(&path, &error));
            }
            Err(_) => {}
        }
    }
    if found.len() > 1 {
        let paths: Vec<String> = found.iter().map(|c| c.path().display().to_string()).collect();
        let text =
            format!("{} have the label \"{label}\"; name the path of the one that is meant", paths.join(" and "));
        return Err(Trouble::new(Class::Wrong, text));
    }
    match (found.pop(), closed) {
        (Some(chip), _) => Ok(chip),
        (None, Some(closed)) => Err(closed),
        (None, None) => {
            let near = nearest(label, labels.iter().map(String::as_str));
            let hint = near.map_or(String::new(), |n| format!(" (did you mean \"{n}\"?)"));
            Err(Trouble::instead(Class::Absent, format!("no chip has the label \"{label}\"{hint}")))
        }
    }
}

/// What to do about a chip that this user may not open.
fn denied(path: &Path) -> String {
    const RULE: &str = r#"SUBSYSTEM=="gpio", KERNEL=="gpiochip[0-9]*", GROUP="gpio", MODE="0660""#;
    let group = std::fs::metadata(path).ok().filter(|m| m.gid() != 0 && m.mode() & 0o040 != 0).map(|m| m.gid());
    let group = group.and_then(|gid| group_name(&std::fs::read_to_string("/etc/group").unwrap_or_default(), gid));
    let path = path.display();
    match group {
        Some(group) => format!(
            "this user may not open {path}, but group `{group}` may: `sudo usermod -aG {group} USER`, then log in again \
             (a service: SupplementaryGroups={group})"
        ),
        None => format!(
            "this user may not open {path}, and no group may: write `{RULE}` into /etc/udev/rules.d/60-gpio.rules, then \
             `sudo groupadd -rf gpio && sudo usermod -aG gpio USER && sudo udevadm control --reload && \
             sudo udevadm trigger -s gpio`, and log in again"
        ),
    }
}

/// The name of a group in the text of `/etc/group`.
fn group_name(file: &str, gid: u32) -> Option<String> {
    let mut groups = file.lines().map(|l| l.split(':').collect::<Vec<_>>());
    let group = groups.find(|fields| fields.get(2).and_then(|g| g.parse().ok()) == Some(gid))?;
    group.first().map(|name| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_have_names() {
        let file = "root:x:0:\ngpio:x:997:pi\nbroken\n";
        assert_eq!(group_name(file, 997).as_deref(), Some("gpio"));
        assert_eq!(group_name(file, 12), None);
    }

    #[test]
    fn what_is_no_chip_is_told_from_what_is_absent() {
        for (key, class) in [
            ("/dev/gpiochip4711", Class::Absent),
            ("gpiochip4711", Class::Absent),
            ("/dev/null", Class::Wrong),
            ("no-such-label", Class::Absent),
        ] {
            assert_eq!(find(key).map(|_| ()).unwrap_err().class, class, "{key}");
        }
    }
}
