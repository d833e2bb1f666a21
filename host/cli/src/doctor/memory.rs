//! Memory: what could make a lane wait for a page.

use super::finding::{Finding, Status};
use super::machine::{IPC_LOCK, Limit, Machine};
use super::needs::Needs;
use super::numbers::{join, show_bytes};
use super::realtime;

/// All memory of a plant can be locked.
pub(super) fn lock(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "memory-lock";
    const WHY: &str = "A page that is not locked may have to be fetched first, and the lane that touches it waits.";
    let finding = if realtime::may_lock(machine) {
        let by = if machine.capable(IPC_LOCK) { "CAP_IPC_LOCK" } else { "no limit" };
        Finding::ok(CHECK, WHY, format!("all memory may be locked ({by})"))
    } else {
        let found = match machine.limit("Max locked memory") {
            Some(Limit::AtMost(bytes)) => {
                format!("only {} may be locked, and a plant takes more: no CAP_IPC_LOCK", show_bytes(bytes))
            }
            _ => "no CAP_IPC_LOCK, and the limit memlock is not known".into(),
        };
        // Cyclic lanes touch the same pages every scan; an interrupt lane may rest for days.
        let status = Status::bad_if(needs.is_none_or(Needs::interrupt));
        Finding::wanting(status, CHECK, WHY, found, realtime::permit(machine))
    };
    vec![finding]
}

/// No swap is on.
pub(super) fn swap(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "swap";
    const WHY: &str = "Under memory pressure the whole machine waits for its disk, and an SD card wears out.";
    let Some(swaps) = machine.text("/proc/swaps") else { return Vec::new() };
    let places: Vec<String> =
        swaps.lines().skip(1).filter_map(|l| l.split_whitespace().next()).map(String::from).collect();
    if places.is_empty() {
        return vec![Finding::ok(CHECK, WHY, "off")];
    }
    let mut mend = vec!["sudo swapoff -a".to_string()];
    // What Raspberry Pi OS switches it on with: a service up to Bookworm, a generator since Trixie.
    if machine.has("/etc/dphys-swapfile") {
        mend.push("sudo systemctl disable --now dphys-swapfile".into());
    } else if machine.has("/etc/rpi/swap.conf") {
        let file = "/etc/rpi/swap.conf.d/90-latchwork.conf";
        mend.push("sudo mkdir -p /etc/rpi/swap.conf.d".into());
        mend.push(format!("printf '[Main]\\nMechanism=none\\n' | sudo tee {file}"));
    } else {
        mend.push("sudo sed -i '/\\sswap\\s/ s/^[^#]/#&/' /etc/fstab".into());
    }
    vec![Finding::wanting(Status::Note, CHECK, WHY, format!("on: {}", join(&places)), mend)]
}

/// The kernel does not make huge pages behind a plant's back.
pub(super) fn huge_pages(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "transparent-huge-pages";
    const WHY: &str = "The kernel moves pages together in the background; a lane that touches one meanwhile waits.";
    const FILE: &str = "/sys/kernel/mm/transparent_hugepage/enabled";
    let finding = match machine.text(FILE) {
        None => Finding::ok(CHECK, WHY, "not in this kernel"),
        Some(text) if text.contains("[always]") => {
            let mut mend = vec![format!("echo madvise | sudo tee {FILE}")];
            let rule = format!("w {FILE} - - - - madvise");
            mend.push(format!("echo '{rule}' | sudo tee /etc/tmpfiles.d/latchwork-huge-pages.conf"));
            Finding::wanting(Status::Note, CHECK, WHY, "always", mend)
        }
        Some(text) => {
            let mode = text.split(['[', ']']).nth(1).unwrap_or(&text);
            let found = if mode == "never" { "never".into() } else { format!("{mode}: only for programs that ask") };
            Finding::ok(CHECK, WHY, found)
        }
    };
    vec![finding]
}
