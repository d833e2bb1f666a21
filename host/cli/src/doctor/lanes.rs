//! A plant's lanes on this machine: their CPUs, and their priorities next to the kernel's own threads.

use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::{LaneKind, LaneNeeds, Needs};
use super::numbers::{cpu_mask, join, show_cpus};

/// SCHED_FIFO priority that the kernel gives its interrupt threads.
const INTERRUPT_THREADS: u8 = 50;
/// Above this run threads without which the kernel does not work.
const HIGHEST: u8 = 98;

/// The CPUs that lanes are pinned to are there.
pub(super) fn cpus(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "lane-cpus";
    const WHY: &str = "A lane whose CPU is not there runs anywhere, between other programs.";
    let (Some(needs), online) = (needs, machine.online()) else { return Vec::new() };
    if needs.cpus().is_empty() || online.is_empty() {
        return Vec::new();
    }
    let missing = |l: &&LaneNeeds| l.cpu.is_some_and(|c| !online.contains(&c));
    let wrong: Vec<&LaneNeeds> = needs.lanes.iter().filter(missing).collect();
    if wrong.is_empty() {
        return vec![Finding::ok(CHECK, WHY, format!("CPU {} of {}", show_cpus(&needs.cpus()), show_cpus(&online)))];
    }
    let names =
        wrong.iter().map(|l| format!("lane {} wants CPU {}", l.name, l.cpu.unwrap_or_default())).collect::<Vec<_>>();
    let found = format!("{}, but there is only CPU {}", join(&names), show_cpus(&online));
    let last = online[online.len() - 1];
    let mend = wrong.iter().map(|l| format!("cpu = {last}  # in [lane.{}]", l.name)).collect();
    vec![Finding::wanting(Status::Bad, CHECK, WHY, found, mend)]
}

/// No two lanes are pinned to one CPU.
pub(super) fn sharing(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "lanes-per-cpu";
    const WHY: &str = "Of two lanes on one CPU the lower waits for the other's whole scan.";
    let Some(needs) = needs.filter(|n| !n.cpus().is_empty()) else { return Vec::new() };
    let mut found = Vec::new();
    let mut mend = Vec::new();
    let mut taken = needs.cpus();
    for cpu in needs.cpus() {
        let lanes: Vec<&LaneNeeds> = needs.lanes.iter().filter(|l| l.cpu == Some(cpu)).collect();
        if lanes.len() < 2 {
            continue;
        }
        found
            .push(format!("lanes {} share CPU {cpu}", join(&lanes.iter().map(|l| l.name.clone()).collect::<Vec<_>>())));
        // The first may stay; isolated CPUs are the better ones for the others.
        for lane in &lanes[1..] {
            let free = machine.isolated().into_iter().chain(machine.online()).find(|c| !taken.contains(c));
            mend.push(match free {
                Some(free) => {
                    taken.push(free);
                    format!("cpu = {free}  # in [lane.{}]", lane.name)
                }
                None => format!("# remove cpu from [lane.{}]: every CPU has a lane", lane.name),
            });
        }
    }
    if found.is_empty() {
        return vec![Finding::ok(CHECK, WHY, "no two lanes are pinned to one CPU")];
    }
    vec![Finding::wanting(Status::Note, CHECK, WHY, found.join("; "), mend)]
}

/// Interrupt lanes are above cyclic ones, and all of them below the kernel's interrupt threads.
pub(super) fn priorities(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "lane-priorities";
    const WHY: &str = "Edges come through a kernel thread of their own, also without PREEMPT_RT: while a lane of the same or \
                       a higher priority runs on its CPU, edges of one line that follow each other closely become one.";
    let Some(needs) = needs else { return Vec::new() };
    let kernel = gpio_threads(machine).unwrap_or(INTERRUPT_THREADS);
    let edges = needs.lanes.iter().any(|l| l.kind == LaneKind::Edges);
    // A lane alone on a CPU to which no interrupt is sent disturbs none.
    let serving = machine.text("/proc/irq/default_smp_affinity").map(|t| cpu_mask(&t)).unwrap_or_default();
    let online = machine.online();
    let apart =
        |l: &LaneNeeds| l.cpu.is_some_and(|c| !serving.is_empty() && !serving.contains(&c) && online.contains(&c));
    let suggestion = |l: &LaneNeeds| kernel.saturating_sub(if l.is_interrupt() { 5 } else { 10 }).max(1);
    let highest_cyclic = needs.lanes.iter().filter(|l| !l.is_interrupt()).max_by_key(|l| l.priority);
    let mut found = Vec::new();
    let mut mend = Vec::new();
    for lane in &needs.lanes {
        let (name, priority) = (&lane.name, lane.priority);
        if edges && priority >= kernel && !apart(lane) {
            found.push(format!("lane {name} ({priority}) is not below the kernel's GPIO interrupt thread ({kernel})"));
            mend.push(format!("priority = {}  # in [lane.{name}]", suggestion(lane)));
        } else if priority > HIGHEST {
            found.push(format!("lane {name} has {priority}, the priority of threads the kernel cannot do without"));
            mend.push(format!("priority = {HIGHEST}  # in [lane.{name}]"));
        } else if let Some(cyclic) = highest_cyclic.filter(|c| lane.is_interrupt() && priority <= c.priority) {
            found.push(format!(
                "interrupt lane {name} ({priority}) is not above lane {} ({})",
                cyclic.name, cyclic.priority
            ));
            mend.push(format!("priority = {}  # in [lane.{name}]", cyclic.priority.saturating_add(5).min(HIGHEST)));
        }
    }
    if found.is_empty() {
        let list: Vec<String> = needs.lanes.iter().map(|l| format!("{} {}", l.name, l.priority)).collect();
        let kernel = if edges { format!("; the kernel's GPIO interrupt thread {kernel}") } else { String::new() };
        return vec![Finding::ok(CHECK, WHY, format!("{}{kernel}", list.join(", ")))];
    }
    vec![Finding::wanting(Status::Note, CHECK, WHY, found.join("; "), mend)]
}

/// The lowest priority of the interrupt threads of GPIO lines, if any is there now: they come with the request of a line.
fn gpio_threads(machine: &Machine) -> Option<u8> {
    let processes = machine.list("/proc").into_iter().filter(|n| n.bytes().all(|b| b.is_ascii_digit()));
    let priority = |process: String| {
        let stat = machine.text(&format!("/proc/{process}/stat"))?;
        // The name may have spaces and brackets itself; the fields after it have not.
        let (head, fields) = stat.rsplit_once(')')?;
        let (_, name) = head.split_once('(')?;
        let (_, label) = name.strip_prefix("irq/")?.split_once('-')?;
        // Field 40 of all, the 38th after the name.
        let priority = fields.split_whitespace().nth(37)?.parse().ok()?;
        // Its label is that of the line's request; older kernels cut names at 15 characters.
        label.starts_with("latch").then_some(priority)
    };
    processes.filter_map(priority).min()
}
