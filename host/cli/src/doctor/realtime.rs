//! Real-time priority: whether a lane gets it, and whether it keeps it.

use super::finding::{Finding, Status};
use super::machine::{IPC_LOCK, Limit, Machine, SYS_NICE};
use super::needs::Needs;

/// The line that gives real-time priority and locked memory. One line for both findings: setcap replaces what was there.
pub(super) fn permit(machine: &Machine) -> Vec<String> {
    if machine.is_container() {
        let options = "--cap-add=SYS_NICE --cap-add=IPC_LOCK --ulimit rtprio=99 --ulimit memlock=-1";
        return vec![format!("docker run {options} …")];
    }
    vec![format!("sudo setcap cap_sys_nice,cap_ipc_lock+ep {}", machine.program.display())]
}

/// A lane gets SCHED_FIFO: it was tried.
pub(super) fn priority(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "real-time-priority";
    const WHY: &str = "Without SCHED_FIFO any other program may run first, and a lane is late by milliseconds.";
    let priority = machine.trial.priority;
    let capable = machine.capable(SYS_NICE);
    let limit = machine.limit("Max realtime priority");
    let allowed = capable || limit.is_some_and(|l| l.allows(u64::from(priority)));
    let rights = match (capable, limit) {
        (true, _) => "CAP_SYS_NICE".to_string(),
        (false, Some(Limit::AtMost(n))) => format!("the limit rtprio is {n}"),
        (false, Some(Limit::Unlimited)) => "no limit".into(),
        (false, None) => "the limit is not known".into(),
    };
    let finding = match &machine.trial.refused {
        None => Finding::ok(CHECK, WHY, format!("a thread got SCHED_FIFO priority {priority} ({rights})")),
        Some(why) if !allowed => {
            let found = format!("SCHED_FIFO priority {priority} was refused ({why}): no CAP_SYS_NICE, and {rights}");
            Finding::wanting(Status::Bad, CHECK, WHY, found, permit(machine))
        }
        Some(why) => {
            let found = format!(
                "SCHED_FIFO priority {priority} was refused ({why}) in spite of {rights}: a control group without \
                 real-time budget, or a container's filter"
            );
            // With control groups for real time (CONFIG_RT_GROUP_SCHED) only this lifts the refusal.
            let budget = vec!["sudo sysctl -w kernel.sched_rt_runtime_us=-1".into()];
            let mend = if machine.is_container() { permit(machine) } else { budget };
            Finding::wanting(Status::Bad, CHECK, WHY, found, mend)
        }
    };
    vec![finding]
}

/// What the kernel leaves to real-time threads, and to everything else.
pub(super) fn throttling(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "real-time-throttling";
    const WHY: &str = "The share that is left to other programs keeps a machine reachable when a lane runs away; lanes that \
                       need more than theirs are paused.";
    let number = |name: &str| machine.text(&format!("/proc/sys/kernel/{name}")).and_then(|t| t.parse::<i64>().ok());
    let (Some(runtime), Some(period)) = (number("sched_rt_runtime_us"), number("sched_rt_period_us")) else {
        return Vec::new();
    };
    let mend = vec!["sudo sysctl -w kernel.sched_rt_runtime_us=950000".into()];
    let found = format!("{runtime} of every {period} µs are for real-time threads");
    let finding = match runtime {
        // Since 6.12 a server of its own keeps 5 % for other programs, whatever this figure says.
        _ if machine.kernel().is_some_and(|k| k >= (6, 12)) && runtime != 0 => {
            Finding::ok(CHECK, WHY, "this kernel keeps a share for other programs by its fair server")
        }
        0 => Finding::wanting(Status::Bad, CHECK, WHY, "real-time threads get no time at all", mend),
        r if r < 0 => {
            let found = "off: a lane that runs away keeps its CPU for ever, also from what would stop it";
            Finding::wanting(Status::Note, CHECK, WHY, found, mend)
        }
        r if r < period / 100 * 90 => Finding::wanting(Status::Note, CHECK, WHY, found, mend),
        _ => Finding::ok(CHECK, WHY, found),
    };
    vec![finding]
}

/// This process may lock all its memory.
pub(super) fn may_lock(machine: &Machine) -> bool {
    machine.capable(IPC_LOCK) || machine.limit("Max locked memory") == Some(Limit::Unlimited)
}
