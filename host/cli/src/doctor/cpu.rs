//! Processors: their speed, their sleep, and who else uses them.

use super::boot;
use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::Needs;
use super::numbers::{cpu_list, show_cpus};
use std::collections::BTreeMap;

const CPUS: &str = "/sys/devices/system/cpu";
/// Idle states that take longer to leave than this delay a lane noticeably, µs.
const SHALLOW: u64 = 10;

/// Every CPU runs at its full speed.
pub(super) fn governor(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "cpu-governor";
    const WHY: &str = "A CPU that saves power is slow when an event comes, and takes milliseconds to speed up.";
    let mut by_name: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for cpu in machine.online() {
        if let Some(name) = machine.text(&format!("{CPUS}/cpu{cpu}/cpufreq/scaling_governor")) {
            by_name.entry(name).or_default().push(cpu);
        }
    }
    if by_name.is_empty() {
        return vec![Finding::ok(CHECK, WHY, "the kernel does not change the frequency here")];
    }
    let found: Vec<String> = by_name.iter().map(|(name, cpus)| format!("{name} on CPU {}", show_cpus(cpus))).collect();
    let found = found.join(", ");
    if by_name.keys().all(|n| n == "performance") {
        return vec![Finding::ok(CHECK, WHY, found)];
    }
    let mut mend = vec![format!("echo performance | sudo tee {CPUS}/cpu*/cpufreq/scaling_governor")];
    // Raspberry Pi OS sets the governor at every start, after the kernel has set its own.
    if machine.has("/etc/init.d/raspi-config") {
        mend.push("echo 'CPU_DEFAULT_GOVERNOR=performance' | sudo tee /etc/default/cpu_governor  # for good".into());
    } else {
        mend.extend(boot::kernel_arguments(machine, "cpufreq.default_governor=performance"));
    }
    vec![Finding::wanting(Status::Note, CHECK, WHY, found, mend)]
}

/// Lanes have CPUs of their own.
pub(super) fn isolation(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "isolated-cpus";
    const WHY: &str = "On a CPU that the scheduler leaves alone, and that serves no device, nothing delays a lane.";
    let (online, isolated) = (machine.online(), machine.isolated());
    let no_tick = machine.text(&format!("{CPUS}/nohz_full"));
    let no_tick = no_tick.map_or("not in this kernel".into(), |t| show_cpus(&cpu_list(&t)));
    let pinned = needs.map(Needs::cpus).unwrap_or_default();
    let open: Vec<usize> = pinned.iter().copied().filter(|c| online.contains(c) && !isolated.contains(c)).collect();
    let note = |found: String, mend| vec![Finding::wanting(Status::Note, CHECK, WHY, found, mend)];
    let Some(last) = online.last().copied().filter(|_| online.len() > 1) else {
        return vec![Finding::ok(CHECK, WHY, "one CPU: nothing to isolate")];
    };
    if !open.is_empty() {
        let found = format!(
            "lanes are pinned to CPU {}, but isolated is: {}; other programs run there, too",
            show_cpus(&open),
            show_cpus(&isolated)
        );
        return note(found, isolate(machine, &online, &pinned));
    }
    if !isolated.is_empty() && pinned.is_empty() && needs.is_some() {
        let found = format!("CPU {} is isolated, but no lane is pinned to it: it idles", show_cpus(&isolated));
        return note(found, vec![format!("cpu = {}  # in the table of the fastest lane", isolated[0])]);
    }
    if isolated.is_empty() && needs.is_none_or(Needs::interrupt) {
        let found = format!("none of CPU {}", show_cpus(&online));
        let mut mend = vec![format!("cpu = {last}  # in the table of the fastest lane")];
        mend.extend(isolate(machine, &online, &[last]));
        return note(found, mend);
    }
    let found = match isolated.is_empty() {
        true => "none; no lane asks for one".into(),
        false => format!("CPU {} (without scheduler tick: {no_tick})", show_cpus(&isolated)),
    };
    vec![Finding::ok(CHECK, WHY, found)]
}

fn isolate(machine: &Machine, online: &[usize], cpus: &[usize]) -> Vec<String> {
    let others: Vec<usize> = online.iter().copied().filter(|c| !cpus.contains(c)).collect();
    if others.is_empty() {
        return vec!["# leave one CPU to everything else: pin the lanes to fewer CPUs".into()];
    }
    let (cpus, others) = (show_cpus(cpus), show_cpus(&others));
    boot::kernel_arguments(machine, &format!("isolcpus={cpus} nohz_full={cpus} rcu_nocbs={cpus} irqaffinity={others}"))
}

/// No CPU sleeps deeply.
pub(super) fn idle(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "cpu-idle";
    const WHY: &str = "A CPU that sleeps deeply needs up to hundreds of microseconds to wake for an event.";
    // Depth by number of the state: CPUs of one machine have the same states, some perhaps switched off.
    let mut states: BTreeMap<String, (String, u64)> = BTreeMap::new();
    for cpu in machine.online() {
        let folder = format!("{CPUS}/cpu{cpu}/cpuidle");
        for state in machine.list(&folder).into_iter().filter(|n| n.starts_with("state")) {
            let file = |name: &str| machine.text(&format!("{folder}/{state}/{name}")).unwrap_or_default();
            if file("disable") != "1" {
                states.insert(state.clone(), (file("name"), file("latency").parse().unwrap_or(0)));
            }
        }
    }
    let deep: Vec<(&String, &(String, u64))> = states.iter().filter(|(_, (_, l))| *l > SHALLOW).collect();
    let Some((_, (name, latency))) = deep.iter().max_by_key(|(_, (_, l))| *l) else {
        let found = match states.values().max_by_key(|(_, l)| *l) {
            Some((name, latency)) => format!("the deepest sleep is {name}, {latency} µs"),
            None => "no sleep but waiting for the next interrupt".into(),
        };
        return vec![Finding::ok(CHECK, WHY, found)];
    };
    let digits: String = deep.iter().filter_map(|(state, _)| state.strip_prefix("state")).collect();
    let mut mend = vec![format!("echo 1 | sudo tee {CPUS}/cpu*/cpuidle/state[{digits}]/disable")];
    mend.extend(boot::kernel_arguments(machine, "cpuidle.off=1"));
    let found = format!("the deepest sleep is {name}: {latency} µs to wake");
    vec![Finding::wanting(Status::Note, CHECK, WHY, found, mend)]
}
