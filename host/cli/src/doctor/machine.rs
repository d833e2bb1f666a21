//! The machine as the checks see it: files below a folder, and what can only be found out by trying.

use super::needs::Needs;
use super::numbers::cpu_list;
use latchwork_io::gpio::ChipInfo;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// `CAP_IPC_LOCK`
pub(super) const IPC_LOCK: u32 = 14;
/// `CAP_SYS_NICE`
pub(super) const SYS_NICE: u32 = 23;
/// Priority that is tried without a plant: a lane's default.
const USUAL_PRIORITY: u8 = 50;

/// A machine.
pub(crate) struct Machine {
    /// Folder that stands for `/`.
    pub(super) root: PathBuf,
    /// Architecture, as Rust names it.
    pub(super) arch: &'static str,
    /// What became of asking for SCHED_FIFO.
    pub(super) trial: Trial,
    /// Devices and folders that are there, with what this user may do.
    pub(super) nodes: BTreeMap<PathBuf, Node>,
    /// GPIO chips that this user may open, with their lines and who holds them.
    pub(super) chips: Vec<ChipInfo>,
    /// The program that would run a plant.
    pub(super) program: PathBuf,
    /// Folder for compiled components, if any is used.
    pub(super) cache: Cache,
}

/// A thread asked for SCHED_FIFO.
pub(super) struct Trial {
    /// The priority.
    pub(super) priority: u8,
    /// Why it was refused.
    pub(super) refused: Option<String>,
}

/// A device or folder.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// This user may read it.
    pub(super) read: bool,
    /// This user may write it.
    pub(super) write: bool,
    /// This user owns it.
    pub(super) ours: bool,
    /// Its group's number.
    pub(super) group: u32,
    /// Its permissions.
    pub(super) mode: u32,
    /// Where it really stands, for one that is a link.
    pub(super) real: PathBuf,
}

/// Where compiled components are kept.
#[derive(Clone, Debug)]
pub(crate) enum Cache {
    /// Nowhere: the user wants none.
    Unwanted,
    /// Nowhere: no folder is known.
    Unknown,
    /// Here.
    Folder(PathBuf),
}

/// A resource limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    /// None.
    Unlimited,
    /// At most this.
    AtMost(u64),
}

impl Limit {
    /// It is not below this.
    pub(super) fn allows(self, value: u64) -> bool {
        match self {
            Self::Unlimited => true,
            Self::AtMost(most) => value <= most,
        }
    }
}

impl Machine {
    /// This machine. Asks for real-time priority in a thread of its own for a moment. Of devices it opens GPIO chips alone, to
    /// read their labels and lines: a watchdog starts to count when it is opened.
    pub(crate) fn this(needs: Option<&Needs>, cache: Cache) -> Self {
        let priority = needs.and_then(Needs::priority).unwrap_or(USUAL_PRIORITY);
        let mut machine = Self {
            root: PathBuf::from("/"),
            arch: std::env::consts::ARCH,
            trial: Trial { priority, refused: try_fifo(priority) },
            nodes: BTreeMap::new(),
            chips: latchwork_io::gpio::list(None).chips,
            program: std::env::current_exe().unwrap_or_else(|_| PathBuf::from("latchwork")),
            cache,
        };
        let named = machine.list("/dev").into_iter().filter(|n| {
            n.starts_with("gpiochip") || n.starts_with("gpiomem") || n.starts_with("watchdog") || n == "cpu_dma_latency"
        });
        let mut paths: Vec<PathBuf> = named.map(|n| Path::new("/dev").join(n)).collect();
        if let Some(needs) = needs {
            paths.extend(needs.serial.iter().chain(&needs.watchdog).cloned());
            // A link to a chip may have any name.
            paths.extend(
                needs.gpio.iter().filter_map(|(_, chip)| chip.as_ref()).filter(|c| c.contains('/')).map(PathBuf::from),
            );
        }
        if let Cache::Folder(folder) = &machine.cache {
            paths.extend(folder.ancestors().map(Path::to_path_buf));
        }
        machine.nodes = paths.into_iter().filter_map(|p| Some((p.clone(), look(&p)?))).collect();
        machine
    }

    /// A file's text without white space and NUL at its ends; `None` when it is not there or may not be read.
    pub(super) fn text(&self, path: &str) -> Option<String> {
        let bytes = std::fs::read(self.root.join(path.trim_start_matches('/'))).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_string())
    }

    /// A file or folder is there.
    pub(super) fn has(&self, path: &str) -> bool {
        self.root.join(path.trim_start_matches('/')).exists()
    }

    /// Names in a folder, sorted; none when it is not there.
    pub(super) fn list(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.root.join(folder.trim_start_matches('/')));
        let mut names: Vec<String> =
            entries.into_iter().flatten().flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// CPUs that are on.
    pub(super) fn online(&self) -> Vec<usize> {
        cpu_list(&self.text("/sys/devices/system/cpu/online").unwrap_or_default())
    }

    /// CPUs that the scheduler leaves alone.
    pub(super) fn isolated(&self) -> Vec<usize> {
        cpu_list(&self.text("/sys/devices/system/cpu/isolated").unwrap_or_default())
    }

    /// Major and minor number of the kernel.
    pub(super) fn kernel(&self) -> Option<(u32, u32)> {
        let release = self.text("/proc/sys/kernel/osrelease")?;
        let mut numbers = release.split(['.', '-', '+']);
        Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
    }

    /// The board, as its device tree names it.
    pub(super) fn model(&self) -> String {
        self.text("/proc/device-tree/model").unwrap_or_default()
    }

    /// It is a Raspberry Pi.
    pub(super) fn is_raspberry(&self) -> bool {
        self.model().contains("Raspberry Pi")
    }

    /// It is a container, where permissions are given from outside.
    pub(super) fn is_container(&self) -> bool {
        ["/.dockerenv", "/run/.containerenv", "/run/systemd/container"].iter().any(|f| self.has(f))
    }

    /// A line of a `name: value` file such as /proc/self/status.
    pub(super) fn field(&self, path: &str, name: &str) -> Option<String> {
        let text = self.text(path)?;
        let value = text.lines().find_map(|l| l.strip_prefix(name)?.strip_prefix(':'));
        value.map(|v| v.trim().to_string())
    }

    /// This process has a capability.
    pub(super) fn capable(&self, capability: u32) -> bool {
        let effective = self.field("/proc/self/status", "CapEff").and_then(|c| u64::from_str_radix(&c, 16).ok());
        effective.is_some_and(|c| c >> capability & 1 == 1)
    }

    /// A soft limit of this process, by its name in /proc/self/limits.
    pub(super) fn limit(&self, name: &str) -> Option<Limit> {
        let limits = self.text("/proc/self/limits")?;
        let soft = limits.lines().find_map(|l| l.strip_prefix(name)?.split_whitespace().next().map(String::from))?;
        if soft == "unlimited" { Some(Limit::Unlimited) } else { soft.parse().ok().map(Limit::AtMost) }
    }

    /// The user's name, or `$USER` where it is not known: a shell fills that in.
    pub(super) fn user(&self) -> String {
        let id = self.field("/proc/self/status", "Uid").and_then(|u| u.split_whitespace().nth(1).map(String::from));
        let users = self.text("/etc/passwd").unwrap_or_default();
        let of = |line: &str| {
            let mut fields = line.split(':');
            let name = fields.next()?.to_string();
            (fields.nth(1).map(String::from) == id && id.is_some()).then_some(name)
        };
        users.lines().find_map(of).unwrap_or_else(|| "$USER".into())
    }

    /// Name of a group and its members.
    pub(super) fn group(&self, id: u32) -> Option<(String, Vec<String>)> {
        let groups = self.text("/etc/group")?;
        groups.lines().find_map(|line| {
            let fields: Vec<&str> = line.split(':').collect();
            let [name, _, number, members] = fields[..] else { return None };
            let members = members.split(',').filter(|m| !m.is_empty()).map(String::from).collect();
            (number.parse() == Ok(id)).then(|| (name.to_string(), members))
        })
    }
}

/// `None` when nothing is there.
fn look(path: &Path) -> Option<Node> {
    use rustix::fs::{Access, access};
    let found = std::fs::metadata(path).ok()?;
    Some(Node {
        read: access(path, Access::READ_OK).is_ok(),
        write: access(path, Access::WRITE_OK).is_ok(),
        ours: found.uid() == rustix::process::geteuid().as_raw(),
        group: found.gid(),
        mode: found.mode() & 0o7777,
        real: std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()),
    })
}

/// Asks for SCHED_FIFO as a lane does, in a thread that ends at once; says why it was refused.
fn try_fifo(priority: u8) -> Option<String> {
    let ask = move || {
        let value = ThreadPriorityValue::try_from(priority).map_err(|e| e.to_string())?;
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy).map_err(|e| {
            match e {
                thread_priority::Error::OS(number) => in_words(number),
                other => format!("{other:?}"),
            }
        })
    };
    match std::thread::Builder::new().name("doctor".into()).spawn(ask) {
        Ok(thread) => thread.join().unwrap_or_else(|_| Err("the thread died".into())).err(),
        Err(error) => Some(format!("no thread: {error}")),
    }
}

/// An error of the system, without its number.
fn in_words(number: i32) -> String {
    let text = std::io::Error::from_raw_os_error(number).to_string();
    text.split(" (os error").next().unwrap_or(&text).to_string()
}
