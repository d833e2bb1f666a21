//! The hardware watchdog.

use super::access::allow;
use super::boot;
use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::Needs;
use std::path::Path;

/// A watchdog is there, may be written, and nobody else has it. It is not opened: it would begin to count.
pub(super) fn device(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "watchdog";
    const WHY: &str = "It resets the machine when the plant stops being on time, if the plant file names it.";
    let named = needs.and_then(|n| n.watchdog.as_deref());
    let path = named.unwrap_or(Path::new("/dev/watchdog"));
    let shown = path.display();
    let wanting = |found, mend| vec![Finding::wanting(Status::bad_if(named.is_some()), CHECK, WHY, found, mend)];
    let Some(node) = machine.nodes.get(path) else {
        let mend = match (machine.is_container(), machine.is_raspberry()) {
            (true, _) => vec![format!("docker run --device={shown} …")],
            (_, true) => boot::firmware_setting(machine, "dtparam=watchdog=on"),
            _ => vec!["sudo modprobe softdog  # by software; with hardware: iTCO_wdt (Intel), sp5100_tco (AMD)".into()],
        };
        return wanting(format!("no {shown}"), mend);
    };
    // `/dev/watchdog` is the first one under its old name.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = if name == "watchdog" { "watchdog0".into() } else { name };
    let fact = |file: &str| machine.text(&format!("/sys/class/watchdog/{name}/{file}"));
    let identity = fact("identity").map(|i| format!(" ({i})")).unwrap_or_default();
    let held = fact("state").as_deref() == Some("active");
    if held && named.is_some() {
        return wanting(
            format!("{shown}{identity} is in use: by systemd, another program, or a plant that runs"),
            release(),
        );
    }
    if !node.write {
        return wanting(format!("{shown}{identity} may not be written"), allow(machine, path, node, "watchdog"));
    }
    if fact("nowayout").as_deref() == Some("1") && named.is_some() {
        let found = format!("{shown}{identity} cannot be disarmed (nowayout): the machine is reset after every stop");
        let mend = vec![
            "# a module's parameter or the kernel's CONFIG_WATCHDOG_NOWAYOUT; leave it if a reset is what you want"
                .into(),
        ];
        return vec![Finding::wanting(Status::Note, CHECK, WHY, found, mend)];
    }
    let found = match held {
        true => format!("{shown}{identity} is in use, and no plant needs it"),
        false => format!("{shown}{identity} is there and free"),
    };
    vec![Finding::ok(CHECK, WHY, found)]
}

/// Makes systemd let go. Its own settings, and Raspberry Pi OS's 40-…, come earlier in the alphabet.
fn release() -> Vec<String> {
    let file = "/etc/systemd/system.conf.d/90-latchwork-watchdog.conf";
    vec![
        "sudo mkdir -p /etc/systemd/system.conf.d".into(),
        format!("printf '[Manager]\\nRuntimeWatchdogSec=0\\n' | sudo tee {file}"),
        "sudo reboot".into(),
    ]
}
