//! Machines for tests: trees of files in a temporary folder, and values beside them.

use crate::doctor::machine::{Cache, Machine, Node, Trial};
use latchwork_io::gpio::{ChipInfo, LineInfo};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A machine that is being made; the folder lives as long as it does.
pub(super) struct Fake {
    _folder: TempDir,
    pub(super) machine: Machine,
}

const PASSWD: &str = "root:x:0:0:root:/root:/bin/bash\nalice:x:1000:1000::/home/alice:/bin/bash";
const GROUPS: &str = "root:x:0:\ndialout:x:20:\ngpio:x:993:\nvideo:x:44:alice\nalice:x:1000:";
pub(super) const GPIO: u32 = 993;
pub(super) const DIALOUT: u32 = 20;

impl Fake {
    /// A machine about which nothing is known but its user, alice.
    pub(super) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let machine = Machine {
            root: folder.path().to_path_buf(),
            arch: "aarch64",
            trial: Trial { priority: 50, refused: None },
            nodes: BTreeMap::new(),
            chips: Vec::new(),
            program: PathBuf::from("/usr/local/bin/latchwork"),
            cache: Cache::Folder(PathBuf::from("/home/alice/.cache/latchwork")),
        };
        Self { _folder: folder, machine }
            .file("/etc/passwd", PASSWD)
            .file("/etc/group", GROUPS)
            .process(0, 0, "8388608")
    }

    /// Writes a file, or replaces it.
    pub(super) fn file(self, path: &str, text: &str) -> Self {
        let at = self.machine.root.join(path.trim_start_matches('/'));
        std::fs::create_dir_all(at.parent().unwrap()).unwrap();
        std::fs::write(at, format!("{text}\n")).unwrap();
        self
    }

    pub(super) fn files(self, files: &[(&str, &str)]) -> Self {
        files.iter().fold(self, |fake, (path, text)| fake.file(path, text))
    }

    pub(super) fn without(self, path: &str) -> Self {
        let at = self.machine.root.join(path.trim_start_matches('/'));
        if at.is_dir() {
            std::fs::remove_dir_all(at).unwrap()
        } else {
            std::fs::remove_file(at).unwrap()
        }
        self
    }

    /// Capabilities and limits of this process, which alice runs.
    pub(super) fn process(self, capabilities: u64, rtprio: u64, memlock: &str) -> Self {
        let status = format!("Name:\tlatchwork\nUid:\t1000\t1000\t1000\t1000\nCapEff:\t{capabilities:016x}");
        let limits = format!(
            "Limit                     Soft Limit           Hard Limit           Units     \n\
             Max locked memory         {memlock:<20} {memlock:<20} bytes     \n\
             Max realtime priority     {rtprio:<20} {rtprio:<20}           "
        );
        self.file("/proc/self/status", &status).file("/proc/self/limits", &limits)
    }

    pub(super) fn refused(mut self) -> Self {
        self.machine.trial.refused = Some("Operation not permitted".into());
        self
    }

    /// A device or folder, with what alice may do: `rw`, `r`, `w` or nothing.
    pub(super) fn node(mut self, path: &str, rights: &str, group: u32, mode: u32) -> Self {
        let (read, write, ours) = (rights.contains('r'), rights.contains('w'), path.starts_with("/home/alice"));
        self.machine.nodes.insert(path.into(), Node { read, write, ours, group, mode, real: path.into() });
        self
    }

    /// A second name of a device.
    pub(super) fn link(mut self, path: &str, to: &str) -> Self {
        let node = self.machine.nodes[Path::new(to)].clone();
        self.machine.nodes.insert(path.into(), node);
        self
    }

    /// A chip that alice may open; its lines with the names of those who hold them.
    pub(super) fn chip(mut self, path: &str, label: &str, holders: &[Option<&str>]) -> Self {
        let line = |(number, holder): (usize, &Option<&str>)| LineInfo {
            number: number as u32,
            name: format!("GPIO{number}"),
            direction: "input",
            active_low: false,
            bias: None,
            edge: None,
            drive: None,
            debounce: None,
            used: holder.is_some(),
            consumer: holder.unwrap_or_default().into(),
        };
        let lines = holders.iter().enumerate().map(line).collect();
        let name = path.trim_start_matches("/dev/").into();
        self.machine.chips.push(ChipInfo { path: path.into(), name, label: label.into(), lines });
        self.node(path, "rw", GPIO, 0o660)
    }

    /// CPUs 0 to n − 1 with a governor.
    pub(super) fn cpus(self, n: usize, governor: &str) -> Self {
        let online = if n == 1 { "0".into() } else { format!("0-{}", n - 1) };
        let fake = self.file("/sys/devices/system/cpu/online", &online).file("/sys/devices/system/cpu/isolated", "");
        (0..n).fold(fake, |fake, cpu| {
            fake.file(&format!("/sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor"), governor)
        })
    }

    fn kernel(self, release: &str, version: &str, clock: &str) -> Self {
        self.files(&[
            ("/proc/sys/kernel/osrelease", release),
            ("/proc/sys/kernel/version", version),
            ("/proc/sys/kernel/sched_rt_runtime_us", "950000"),
            ("/proc/sys/kernel/sched_rt_period_us", "1000000"),
            ("/sys/devices/system/clocksource/clocksource0/current_clocksource", clock),
            ("/sys/devices/system/clocksource/clocksource0/available_clocksource", clock),
        ])
    }
}

/// A Raspberry Pi 4 as it comes, with a weak supply.
pub(super) fn pi_4() -> Fake {
    Fake::new()
        .refused()
        .kernel("6.6.51+rpt-rpi-v8", "#1 SMP PREEMPT Debian 1:6.6.51-1+rpt3 (2024-10-08)", "arch_sys_counter")
        .cpus(4, "ondemand")
        .files(&[
            ("/proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0"),
            ("/etc/os-release", "PRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\nID=debian"),
            ("/boot/firmware/cmdline.txt", "console=tty1 root=PARTUUID=1234-02 rootwait"),
            ("/boot/firmware/config.txt", "arm_64bit=1"),
            ("/etc/init.d/raspi-config", "#!/bin/sh"),
            ("/etc/dphys-swapfile", "CONF_SWAPSIZE=200"),
            ("/proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n/var/swap   file   204796  0  -2"),
            ("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never"),
            ("/sys/devices/platform/soc/soc:firmware/get_throttled", "50005"),
            ("/proc/irq/default_smp_affinity", "f"),
        ])
        .node("/dev/gpiochip0", "", GPIO, 0o660)
        .node("/dev/gpiochip1", "", GPIO, 0o660)
        .node("/dev/gpiomem", "", GPIO, 0o660)
        .node("/dev/watchdog", "", 0, 0o600)
        .node("/home/alice", "rw", 1000, 0o755)
        .file("/sys/class/watchdog/watchdog0/identity", "Broadcom BCM2835 Watchdog timer")
}

/// A Raspberry Pi 5 after docs/tuning-raspberry-pi.md.
pub(super) fn pi_5() -> Fake {
    Fake::new()
        .process(1 << 14 | 1 << 23, 0, "8388608")
        .kernel("6.12.47+rpt-rpi-v8-rt", "#1 SMP PREEMPT_RT Debian 1:6.12.47-1+rpt1 (2025-09-16)", "arch_sys_counter")
        .cpus(4, "performance")
        .files(&[
            ("/proc/device-tree/model", "Raspberry Pi 5 Model B Rev 1.0\0"),
            ("/sys/kernel/realtime", "1"),
            ("/boot/firmware/cmdline.txt", "root=PARTUUID=1234-02 rootwait isolcpus=3 irqaffinity=0-2"),
            ("/sys/devices/system/cpu/isolated", "3"),
            ("/sys/devices/system/cpu/nohz_full", "3"),
            ("/proc/swaps", "Filename\tType\tSize\tUsed\tPriority"),
            ("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never"),
            ("/sys/devices/platform/soc@107c000000/soc@107c000000:firmware/get_throttled", "0"),
            ("/proc/irq/default_smp_affinity", "7"),
            ("/sys/class/watchdog/watchdog0/identity", "Broadcom BCM2835 Watchdog timer"),
            ("/sys/class/watchdog/watchdog0/state", "inactive"),
            ("/sys/class/watchdog/watchdog0/nowayout", "0"),
        ])
        .chip("/dev/gpiochip0", "pinctrl-rp1", &[None; 54])
        .node("/dev/gpiomem0", "rw", GPIO, 0o660)
        .node("/dev/watchdog", "rw", 1000, 0o660)
        .node("/dev/ttyUSB0", "rw", DIALOUT, 0o660)
        .node("/home/alice/.cache/latchwork", "rw", 1000, 0o700)
}

/// A virtual machine with Debian, for a root shell: nothing is refused.
pub(super) fn virtual_machine() -> Fake {
    let mut fake = Fake::new()
        .process(0x1ff_ffff_ffff, 0, "unlimited")
        .kernel("6.1.0-28-amd64", "#1 SMP PREEMPT_DYNAMIC Debian 6.1.119-1 (2024-11-22)", "acpi_pm")
        .cpus(2, "performance")
        .without("/sys/devices/system/cpu/cpu0")
        .without("/sys/devices/system/cpu/cpu1")
        .files(&[
            ("/proc/cmdline", "BOOT_IMAGE=/vmlinuz root=/dev/vda1 preempt=voluntary"),
            ("/sys/class/dmi/id/sys_vendor", "QEMU"),
            ("/sys/class/dmi/id/product_name", "Standard PC (Q35 + ICH9, 2009)"),
            ("/proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu vme hypervisor lahf_lm"),
            ("/etc/os-release", "ID=debian"),
            ("/etc/default/grub", "GRUB_CMDLINE_LINUX=\"\""),
            ("/proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n/dev/vda5  partition  998396  0  -2"),
        ])
        .node("/home/alice/.cache/latchwork", "rw", 1000, 0o775);
    fake.machine.arch = "x86_64";
    fake
}

/// A container to which nothing was given.
pub(super) fn container() -> Fake {
    let mut fake = Fake::new()
        .refused()
        .kernel("6.8.0-45-generic", "#45-Ubuntu SMP PREEMPT_DYNAMIC Fri Aug 30 12:02:04 UTC 2024", "tsc")
        .cpus(8, "powersave")
        .files(&[
            ("/.dockerenv", ""),
            ("/etc/os-release", "ID=debian"),
            ("/sys/kernel/mm/transparent_hugepage/enabled", "always madvise [never]"),
            ("/proc/swaps", "Filename\tType\tSize\tUsed\tPriority"),
        ])
        .node("/", "r", 0, 0o755);
    fake.machine.arch = "x86_64";
    fake.machine.cache = Cache::Unknown;
    fake
}
