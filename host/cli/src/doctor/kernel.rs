//! The kernel: how soon it lets a lane run, how it tells the time, and whether it has the machine to itself.

use super::boot;
use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::Needs;

/// How much of the kernel can be interrupted by a lane.
pub(super) fn preemption(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "kernel-preemption";
    const WHY: &str = "What the kernel does for other programs delays a lane: with PREEMPT_RT by tens of microseconds, \
                       without it now and then by milliseconds.";
    let version = machine.text("/proc/sys/kernel/version").unwrap_or_default();
    if version.is_empty() {
        let mend = vec!["uname -v  # look for PREEMPT_RT yourself".into()];
        return vec![Finding::wanting(
            Status::Note,
            CHECK,
            WHY,
            "not known: the kernel does not tell its version",
            mend,
        )];
    }
    let words: Vec<&str> = version.split_whitespace().collect();
    let real_time = machine.text("/sys/kernel/realtime").as_deref() == Some("1")
        || words.contains(&"PREEMPT_RT")
        || version.contains("PREEMPT RT");
    if real_time {
        return vec![Finding::ok(CHECK, WHY, "PREEMPT_RT")];
    }
    let found = if words.contains(&"PREEMPT_DYNAMIC") {
        format!("PREEMPT_DYNAMIC, {}", dynamic_mode(machine))
    } else if words.contains(&"PREEMPT") {
        "PREEMPT: better than a server's kernel, but not PREEMPT_RT".into()
    } else {
        "none or voluntary: a lane waits until the kernel is done".into()
    };
    vec![Finding::wanting(Status::Note, CHECK, WHY, found, real_time_kernel(machine))]
}

/// What a kernel that can change its mode has chosen.
fn dynamic_mode(machine: &Machine) -> String {
    // The mode in force stands in brackets: `none voluntary (full)`. Only root can read it.
    let now = machine
        .text("/sys/kernel/debug/sched/preempt")
        .and_then(|t| t.split(['(', ')']).nth(1).map(|mode| format!("now {mode}")));
    let asked = || {
        let line = machine.text("/proc/cmdline")?;
        let mode = line.split_whitespace().filter_map(|a| a.strip_prefix("preempt=")).next_back()?;
        Some(format!("started with preempt={mode}"))
    };
    now.or_else(asked).unwrap_or_else(|| "its mode is not known (root sees it, with debugfs mounted)".into())
}

/// How to come by a kernel with PREEMPT_RT.
fn real_time_kernel(machine: &Machine) -> Vec<String> {
    let release = machine.text("/proc/sys/kernel/osrelease").unwrap_or_default();
    let system = machine.text("/etc/os-release").unwrap_or_default();
    let id = system.lines().find_map(|l| l.strip_prefix("ID=")).unwrap_or_default().trim_matches('"').to_string();
    let debian = |arch: &str| vec![format!("sudo apt install linux-image-rt-{arch}"), "sudo reboot".into()];
    match (machine.arch, id.as_str()) {
        _ if machine.is_container() => vec!["# on the host: a container shares its kernel".into()],
        // Raspberry Pi's own kernels: the one package serves Pi 3, 4 and 5.
        ("aarch64", _) if machine.is_raspberry() && (release.contains("rpi") || release.contains("-v8")) => {
            let mut mend = vec!["sudo apt install linux-image-rpi-v8-rt".to_string()];
            mend.extend(boot::firmware_setting(machine, "kernel=kernel8_rt.img"));
            mend
        }
        (_, "ubuntu") => vec!["sudo pro enable realtime-kernel".into(), "sudo reboot".into()],
        ("x86_64", "debian") => debian("amd64"),
        ("aarch64", "debian") => debian("arm64"),
        _ => vec!["# install a kernel that was built with CONFIG_PREEMPT_RT=y".into()],
    }
}

/// Reading the clock costs nanoseconds, not a visit to a device.
pub(super) fn clock_source(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "clock-source";
    const WHY: &str = "Every scan reads the clock several times; a slow source costs a microsecond and more each time.";
    const FOLDER: &str = "/sys/devices/system/clocksource/clocksource0";
    let Some(current) = machine.text(&format!("{FOLDER}/current_clocksource")) else { return Vec::new() };
    let available = machine.text(&format!("{FOLDER}/available_clocksource")).unwrap_or_default();
    let finding = match current.as_str() {
        // Read in user space, without a system call; those of hypervisors, too.
        "tsc" | "arch_sys_counter" | "kvm-clock" | "hyperv_clocksource_tsc_page" | "riscv_clocksource" => {
            Finding::ok(CHECK, WHY, current)
        }
        _ if available.split_whitespace().any(|s| s == "tsc") => {
            let mend = vec![format!("echo tsc | sudo tee {FOLDER}/current_clocksource")];
            Finding::wanting(Status::Note, CHECK, WHY, format!("{current}, although tsc is there"), mend)
        }
        _ => {
            let mend = vec!["sudo dmesg | grep -iE 'tsc|clocksource'  # the kernel says why it took this one".into()];
            Finding::wanting(Status::Note, CHECK, WHY, format!("{current} (there is: {available})"), mend)
        }
    };
    vec![finding]
}

/// The machine is one.
pub(super) fn virtual_machine(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "virtual-machine";
    const WHY: &str = "Its latencies are those of the machine below: no setting inside bounds them.";
    let mut found = Vec::new();
    if let Some(name) = hypervisor(machine) {
        found.push(format!("a virtual machine ({name}): the latencies are the host's"));
    }
    if machine.is_container() {
        found.push("a container: kernel, limits and devices are the host's".into());
    }
    if found.is_empty() {
        let model = machine.model();
        let found = if model.is_empty() { "no: a machine of its own".into() } else { format!("no: {model}") };
        return vec![Finding::ok(CHECK, WHY, found)];
    }
    vec![Finding::wanting(Status::Note, CHECK, WHY, found.join("; "), Vec::new())]
}

fn hypervisor(machine: &Machine) -> Option<String> {
    let dmi = |file: &str| machine.text(&format!("/sys/class/dmi/id/{file}")).unwrap_or_default();
    let maker = format!("{} {}", dmi("sys_vendor"), dmi("product_name"));
    let known = [
        ("QEMU", "QEMU"),
        ("VMware", "VMware"),
        ("VirtualBox", "VirtualBox"),
        ("Virtual Machine", "Hyper-V"),
        ("Amazon EC2", "Amazon EC2"),
        ("Google Compute", "Google Compute Engine"),
        ("Xen", "Xen"),
        ("Parallels", "Parallels"),
    ];
    if let Some((_, name)) = known.iter().find(|(mark, _)| maker.contains(mark)) {
        return Some((*name).into());
    }
    if let Some(kind) = machine.text("/sys/hypervisor/type") {
        return Some(kind);
    }
    let flags = machine.text("/proc/cpuinfo").unwrap_or_default();
    if flags.lines().any(|l| l.starts_with("flags") && l.split_whitespace().any(|f| f == "hypervisor")) {
        return Some("its processor says so".into());
    }
    // On ARM the device tree of QEMU and its like.
    let tree = machine.text("/proc/device-tree/compatible").unwrap_or_default();
    (tree.contains("linux,dummy-virt") || machine.has("/proc/device-tree/hypervisor"))
        .then(|| "its device tree says so".into())
}
