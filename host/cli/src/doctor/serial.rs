//! Serial ports of a plant.

use super::access::{allow, rights};
use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::Needs;

/// The ports a plant names are there and may be used. Not opened: that would move their control lines.
pub(super) fn ports(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "serial-ports";
    const WHY: &str = "A driver of kind modbus-rtu talks through this port.";
    let port = |path: &std::path::PathBuf| {
        let shown = path.display();
        match machine.nodes.get(path) {
            Some(node) if node.read && node.write => {
                Finding::ok(CHECK, WHY, format!("{shown} may be read and written"))
            }
            Some(node) => {
                let mend = allow(machine, path, node, "dialout");
                Finding::wanting(Status::Bad, CHECK, WHY, format!("{shown} {}", rights(node)), mend)
            }
            None => {
                let mend =
                    vec!["ls -l /dev/serial/by-id/ /dev/ttyUSB* /dev/ttyACM* /dev/ttyAMA*  # what is there".into()];
                Finding::wanting(Status::Bad, CHECK, WHY, format!("{shown} is not there"), mend)
            }
        }
    };
    needs.into_iter().flat_map(|n| &n.serial).map(port).collect()
}
