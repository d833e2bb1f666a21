//! Where the kernel's command line and the firmware's settings are kept.

use super::machine::Machine;

/// Commands that add arguments to the kernel's command line for good.
pub(super) fn kernel_arguments(machine: &Machine, arguments: &str) -> Vec<String> {
    if machine.is_container() {
        return vec![format!("# on the host, add to the kernel's command line: {arguments}")];
    }
    // Raspberry Pi OS moved it from /boot to /boot/firmware; the old place may hold a file that only says so.
    let file = ["/boot/firmware/cmdline.txt", "/boot/cmdline.txt"].into_iter().find(|f| machine.has(f));
    let mut mend = match file {
        Some(file) if machine.is_raspberry() => vec![format!("sudo sed -i '1 s/$/ {arguments}/' {file}")],
        _ if machine.has("/etc/default/grub") => vec![
            format!("sudo sed -i 's/^GRUB_CMDLINE_LINUX=\"/&{arguments} /' /etc/default/grub"),
            "sudo update-grub".into(),
        ],
        _ => vec![format!("# add to the kernel's command line: {arguments}")],
    };
    mend.push("sudo reboot".into());
    mend
}

/// Commands that add a line to a Raspberry Pi's config.txt.
pub(super) fn firmware_setting(machine: &Machine, line: &str) -> Vec<String> {
    let file = if machine.has("/boot/firmware/config.txt") { "/boot/firmware/config.txt" } else { "/boot/config.txt" };
    // Sections such as [pi4] may stand at the end of the file.
    vec![format!("printf '[all]\\n{line}\\n' | sudo tee -a {file}"), "sudo reboot".into()]
}
