//! The share of a CPU that the kernel keeps for ordinary programs: 50 ms of a second in which no real-time thread runs. A scan
//! of 1000 ms would meet it in every cycle, and so would cyclictest: it is taken away while the bench runs.

use std::path::PathBuf;

/// Gives the share back when dropped.
pub(crate) struct Share {
    changed: Option<(PathBuf, String)>,
}

impl Share {
    /// Takes it away on a CPU, or says that it could not.
    pub(crate) fn take(cpu: usize) -> Self {
        let server = PathBuf::from(format!("/sys/kernel/debug/sched/fair_server/cpu{cpu}/runtime"));
        let old = PathBuf::from("/proc/sys/kernel/sched_rt_runtime_us");
        // Since Linux 6.12 a server of its own; before, the limit of all real-time threads.
        let (path, none) = if server.exists() { (server, "0") } else { (old, "-1") };
        let before = std::fs::read_to_string(&path).map(|text| text.trim().to_owned());
        match before.and_then(|before| std::fs::write(&path, none).map(|()| before)) {
            Ok(before) => Self { changed: Some((path, before)) },
            Err(error) => {
                eprintln!(
                    "{}: {error}: the kernel will halt real-time threads for 50 ms of each second of a long scan; as root, \
                     with `mount -t debugfs none /sys/kernel/debug`, it can be kept from that",
                    path.display()
                );
                Self { changed: None }
            }
        }
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        if let Some((path, before)) = &self.changed
            && let Err(error) = std::fs::write(path, before)
        {
            eprintln!("{} could not be set back to {before}: {error}", path.display());
        }
    }
}
