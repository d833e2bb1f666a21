//! Each check's cases: what is changed on a machine, and what its check then says. Here those of kernel and processors.

use super::machines::{Fake, container, pi_4, pi_5, virtual_machine};
use super::{findings, interlock, lane};
use crate::doctor::needs::{LaneKind, Needs};
use crate::doctor::{Finding, Status};

/// The only finding of a check.
fn of(check: &str, fake: &Fake, needs: Option<&Needs>) -> Finding {
    let all: Vec<Finding> = findings(fake, needs).into_iter().filter(|f| f.check == check).collect();
    let [one] = &all[..] else { panic!("{check}: {all:?}") };
    one.clone()
}

/// A case: what it is, the machine, the plant, the status and a part of what is found or mends it.
pub(super) type Case = (&'static str, Fake, Option<Needs>, Status, &'static str);

#[track_caller]
pub(super) fn table(check: &str, cases: impl IntoIterator<Item = Case>) {
    for (what, fake, needs, status, part) in cases {
        let finding = of(check, &fake, needs.as_ref());
        assert_eq!(finding.status, status, "{what}: {finding:?}");
        let text = format!("{}\n{}", finding.found, finding.mend.join("\n"));
        assert!(text.contains(part), "{what}: {part} is not in {text}");
    }
}

pub(super) fn cyclic() -> Option<Needs> {
    Some(Needs { lanes: vec![lane("main", LaneKind::Cyclic, 50, None)], ..Needs::default() })
}

#[test]
fn real_time_priority() {
    const NICE: u64 = 1 << 23;
    table(
        "real-time-priority",
        [
            ("given by capability", Fake::new().process(NICE, 0, "0"), None, Status::Ok, "CAP_SYS_NICE"),
            ("given by limit", Fake::new().process(0, 95, "0"), None, Status::Ok, "rtprio is 95"),
            (
                "neither",
                Fake::new().refused(),
                None,
                Status::Bad,
                "sudo setcap cap_sys_nice,cap_ipc_lock+ep /usr/local/bin/latchwork",
            ),
            ("limit too low", Fake::new().process(0, 49, "0").refused(), None, Status::Bad, "rtprio is 49"),
            (
                "allowed and refused",
                Fake::new().process(NICE, 0, "0").refused(),
                None,
                Status::Bad,
                "sched_rt_runtime_us=-1",
            ),
            ("in a container", container(), None, Status::Bad, "--cap-add=SYS_NICE"),
            ("also for cyclic lanes", pi_4(), cyclic(), Status::Bad, "setcap"),
        ],
    );
}

#[test]
fn throttling() {
    let set = |runtime: &str| pi_4().file("/proc/sys/kernel/sched_rt_runtime_us", runtime);
    table(
        "real-time-throttling",
        [
            ("usual", set("950000"), None, Status::Ok, "950000 of every 1000000"),
            ("off", set("-1"), None, Status::Note, "for ever"),
            ("nothing", set("0"), None, Status::Bad, "sched_rt_runtime_us=950000"),
            ("little", set("500000"), None, Status::Note, "500000 of"),
            ("fair server", pi_5().file("/proc/sys/kernel/sched_rt_runtime_us", "-1"), None, Status::Ok, "fair server"),
        ],
    );
}

#[test]
fn memory() {
    table(
        "memory-lock",
        [
            ("by limit", Fake::new().process(0, 0, "unlimited"), None, Status::Ok, "no limit"),
            ("by capability", Fake::new().process(1 << 14, 0, "65536"), None, Status::Ok, "CAP_IPC_LOCK"),
            ("too little", Fake::new().process(0, 0, "65536"), None, Status::Bad, "64 KiB"),
            ("for an interrupt lane", pi_4(), Some(interlock(50, 60, None)), Status::Bad, "8 MiB"),
            ("for cyclic lanes", pi_4(), cyclic(), Status::Note, "8 MiB"),
        ],
    );
    let zram = "Filename Type Size\n/dev/zram0 partition 2097148";
    let trixie = || pi_5().file("/proc/swaps", zram).file("/etc/rpi/swap.conf", "");
    table(
        "swap",
        [
            ("off", pi_5(), None, Status::Ok, "off"),
            ("Bookworm's", pi_4(), None, Status::Note, "disable --now dphys-swapfile"),
            ("Trixie's", trixie(), None, Status::Note, "Mechanism=none"),
            ("fstab's", virtual_machine(), None, Status::Note, "/etc/fstab"),
        ],
    );
    table(
        "transparent-huge-pages",
        [
            ("always", pi_4(), None, Status::Note, "echo madvise"),
            ("madvise", pi_5(), None, Status::Ok, "only for programs that ask"),
            ("never", container(), None, Status::Ok, "never"),
            ("not built", Fake::new(), None, Status::Ok, "not in this kernel"),
        ],
    );
}

#[test]
fn kernel() {
    let version = |text: &str| pi_4().file("/proc/sys/kernel/version", text);
    let dynamic = || version("#1 SMP PREEMPT_DYNAMIC");
    table(
        "kernel-preemption",
        [
            ("PREEMPT_RT", version("#1 SMP PREEMPT_RT Debian"), None, Status::Ok, "PREEMPT_RT"),
            ("an older name", version("#1 SMP PREEMPT RT 2019"), None, Status::Ok, "PREEMPT_RT"),
            ("by its file", pi_4().file("/sys/kernel/realtime", "1"), None, Status::Ok, "PREEMPT_RT"),
            ("PREEMPT", pi_4(), None, Status::Note, "kernel=kernel8_rt.img"),
            ("voluntary", version("#1 SMP Debian 6.1.1-1"), None, Status::Note, "voluntary"),
            ("dynamic, not known", dynamic(), None, Status::Note, "not known"),
            (
                "dynamic, asked",
                dynamic().file("/proc/cmdline", "quiet preempt=full"),
                None,
                Status::Note,
                "preempt=full",
            ),
            (
                "dynamic, seen",
                dynamic().file("/sys/kernel/debug/sched/preempt", "none (voluntary) full"),
                None,
                Status::Note,
                "now voluntary",
            ),
            ("Debian on a PC", virtual_machine(), None, Status::Note, "linux-image-rt-amd64"),
            (
                "Ubuntu",
                virtual_machine().file("/etc/os-release", "ID=ubuntu"),
                None,
                Status::Note,
                "pro enable realtime-kernel",
            ),
            (
                "another system",
                virtual_machine().file("/etc/os-release", "ID=arch"),
                None,
                Status::Note,
                "CONFIG_PREEMPT_RT",
            ),
        ],
    );
    let clock = |now: &str, there: &str| {
        let folder = "/sys/devices/system/clocksource/clocksource0";
        Fake::new()
            .file(&format!("{folder}/current_clocksource"), now)
            .file(&format!("{folder}/available_clocksource"), there)
    };
    table(
        "clock-source",
        [
            ("tsc", clock("tsc", "tsc hpet"), None, Status::Ok, "tsc"),
            ("tsc left", clock("hpet", "tsc hpet"), None, Status::Note, "echo tsc"),
            ("no tsc", clock("hpet", "hpet acpi_pm"), None, Status::Note, "dmesg"),
            ("ARM", pi_4(), None, Status::Ok, "arch_sys_counter"),
        ],
    );
    table(
        "virtual-machine",
        [
            ("a board", pi_4(), None, Status::Ok, "Raspberry Pi 4"),
            ("a PC", Fake::new(), None, Status::Ok, "no"),
            ("QEMU", virtual_machine(), None, Status::Note, "QEMU"),
            (
                "another",
                Fake::new().file("/proc/cpuinfo", "flags\t: fpu hypervisor"),
                None,
                Status::Note,
                "processor says so",
            ),
            (
                "on ARM",
                Fake::new().file("/proc/device-tree/compatible", "linux,dummy-virt"),
                None,
                Status::Note,
                "device tree",
            ),
            ("a container", container(), None, Status::Note, "a container"),
        ],
    );
}

#[test]
fn processors() {
    let one_slow = pi_5().file("/sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "schedutil");
    table(
        "cpu-governor",
        [
            ("full speed", pi_5(), None, Status::Ok, "performance on CPU 0-3"),
            ("one is not", one_slow, None, Status::Note, "performance on CPU 0-1,3, schedutil on CPU 2"),
            ("Raspberry Pi OS", pi_4(), None, Status::Note, "/etc/default/cpu_governor"),
            (
                "elsewhere",
                virtual_machine().cpus(2, "powersave"),
                None,
                Status::Note,
                "cpufreq.default_governor=performance /' /etc/default/grub",
            ),
            ("a container", container(), None, Status::Note, "# on the host"),
            ("none", virtual_machine(), None, Status::Ok, "does not change"),
        ],
    );
    let pinned = |cpu| Some(interlock(40, 45, Some(cpu)));
    table(
        "isolated-cpus",
        [
            ("the lane's", pi_5(), pinned(3), Status::Ok, "CPU 3 (without scheduler tick: 3)"),
            ("another's", pi_5(), pinned(2), Status::Note, "isolcpus=2 nohz_full=2 rcu_nocbs=2 irqaffinity=0-1,3"),
            ("nobody's", pi_5(), cyclic(), Status::Note, "cpu = 3"),
            ("none, and edges", pi_4(), Some(interlock(40, 45, None)), Status::Note, "isolcpus=3"),
            ("none, cyclic lanes", pi_4(), cyclic(), Status::Ok, "no lane asks"),
            ("one CPU", pi_4().cpus(1, "performance"), pinned(0), Status::Ok, "one CPU"),
            ("one that is not there", pi_5(), pinned(9), Status::Ok, "CPU 3"),
        ],
    );
    let state = |fake: Fake, n: u32, name: &str, latency: &str, disable: &str| {
        let folder = format!("/sys/devices/system/cpu/cpu0/cpuidle/state{n}");
        fake.file(&format!("{folder}/name"), name)
            .file(&format!("{folder}/latency"), latency)
            .file(&format!("{folder}/disable"), disable)
    };
    let shallow = || state(state(virtual_machine(), 0, "POLL", "0", "0"), 1, "C1", "2", "0");
    let deep = |off| state(state(shallow(), 2, "C6", "133", off), 3, "C10", "890", off);
    table(
        "cpu-idle",
        [
            ("no states", pi_5(), None, Status::Ok, "no sleep"),
            ("shallow", shallow(), None, Status::Ok, "C1, 2 µs"),
            ("deep", deep("0"), None, Status::Note, "cpuidle/state[23]/disable"),
            ("deep, switched off", deep("1"), None, Status::Ok, "C1, 2 µs"),
        ],
    );
    let word = |text: &str| pi_4().file("/sys/devices/platform/soc/soc:firmware/get_throttled", text);
    table(
        "power-and-heat",
        [
            ("fine", word("0"), None, Status::Ok, "never"),
            ("weak now", word("50005"), None, Status::Bad, "# the supply"),
            ("was weak", word("0x50000"), None, Status::Note, "since the start: the voltage"),
            ("hot", word("80008"), None, Status::Bad, "# a heat sink"),
        ],
    );
}
