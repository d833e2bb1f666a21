//! Looking at a request of the driver from behind: a second descriptor of the same lines.
//!
//! gpio-sim lets a line fall back to its pull when it is released, so what the driver wrote last is visible only while
//! somebody still holds the request. The second descriptor holds it, and can change lines behind the driver's back.

use gpiocdev_uapi::v2::{LineValues, get_line_values, set_line_values};
use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
use std::collections::BTreeSet;
use std::fs::File;

/// The numbers of this process's descriptors of requests.
pub(crate) fn requests() -> BTreeSet<i32> {
    let entries = std::fs::read_dir("/proc/self/fd").expect("proc is mounted").filter_map(Result::ok);
    let is_request = |link: std::path::PathBuf| link.to_string_lossy().contains("gpio-line");
    let requests = entries.filter(|e| std::fs::read_link(e.path()).is_ok_and(is_request));
    requests.filter_map(|e| e.file_name().to_string_lossy().parse().ok()).collect()
}

/// A second descriptor of the one request that was made since `before`.
pub(crate) struct Taken(File);

impl Taken {
    pub(crate) fn since(before: &BTreeSet<i32>) -> Result<Self, String> {
        let new: Vec<i32> = requests().difference(before).copied().collect();
        let [one] = new[..] else { return Err(format!("{} requests were made instead of one", new.len())) };
        let this = pidfd_open(getpid(), PidfdFlags::empty()).map_err(|e| format!("pidfd_open: {e}"))?;
        let second = pidfd_getfd(&this, one, PidfdGetfdFlags::empty()).map_err(|e| format!("pidfd_getfd: {e}"))?;
        Ok(Self(File::from(second)))
    }

    /// Logical levels of the first lines (in the order of their numbers), one bit each, read in one step.
    pub(crate) fn levels(&self, lines: u32) -> u64 {
        let mut values = LineValues { bits: 0, mask: (1 << lines) - 1 };
        get_line_values(&self.0, &mut values).expect("the request is open");
        values.bits
    }

    /// Sets one line behind the driver's back.
    pub(crate) fn set(&self, line: usize, level: bool) {
        let mut values = LineValues::default();
        values.set(line, level);
        set_line_values(&self.0, &values).expect("the request is open");
    }
}
