//! How a user comes to use a device.

use super::machine::{Machine, Node};
use std::path::Path;

/// Commands that let this user read and write a device: by the device's group if that may, else by a rule for udev that gives
/// it to `group`.
pub(super) fn allow(machine: &Machine, path: &Path, node: &Node, group: &str) -> Vec<String> {
    if machine.is_container() {
        return vec![format!("docker run --device={path} …", path = path.display())];
    }
    let user = machine.user();
    if let Some((name, members)) = machine.group(node.group)
        && name != "root"
        && node.mode & 0o060 == 0o060
    {
        // The group was given after this session began.
        return match members.contains(&user) {
            true => vec![format!("newgrp {name}  # or log in again: {user} is in the group, this session is not yet")],
            false => vec![format!("sudo usermod -aG {name} {user}  # then log in again")],
        };
    }
    let kernel_name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let pattern = kernel_name.trim_end_matches(|c: char| c.is_ascii_digit());
    let rule = format!(r#"KERNEL=="{pattern}*", GROUP="{group}", MODE="0660""#);
    vec![
        format!("sudo groupadd -rf {group}"),
        format!("echo '{rule}' | sudo tee -a /etc/udev/rules.d/60-latchwork.rules"),
        format!("sudo udevadm control --reload && sudo udevadm trigger --name-match={}", path.display()),
        format!("sudo usermod -aG {group} {user}  # then log in again"),
    ]
}

/// What this user may do with it.
pub(super) fn rights(node: &Node) -> &'static str {
    match (node.read, node.write) {
        (true, true) => "may be read and written",
        (true, false) => "may be read but not written",
        (false, true) => "may be written but not read",
        (false, false) => "may be neither read nor written",
    }
}
