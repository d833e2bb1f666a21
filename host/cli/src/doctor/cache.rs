//! The folder for compiled components.

use super::finding::{Finding, Status};
use super::machine::{Cache, Machine};
use super::needs::Needs;

/// Compiled components can be kept. The rules are those of the cache itself: a folder that nobody else can write.
pub(super) fn folder(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "cache-folder";
    const WHY: &str =
        "Without it every start compiles every component again: seconds for some, on a slow board minutes.";
    let user = machine.user();
    let note = |found: String, mend: String| vec![Finding::wanting(Status::Note, CHECK, WHY, found, vec![mend])];
    let folder = match &machine.cache {
        Cache::Unwanted => return Vec::new(),
        Cache::Unknown => {
            let mend = "export LATCHWORK_CACHE=/var/cache/latchwork".into();
            return note("this user has no home folder, and LATCHWORK_CACHE is not set".into(), mend);
        }
        Cache::Folder(folder) => folder,
    };
    let shown = folder.display();
    match machine.nodes.get(folder) {
        Some(node) if !node.ours => {
            note(format!("{shown} belongs to another user: it is not used"), format!("sudo chown {user} {shown}"))
        }
        Some(node) if node.mode & 0o022 != 0 => {
            note(format!("others may write {shown}: it is not used"), format!("chmod go-w {shown}"))
        }
        Some(node) if !node.write => note(format!("{shown} may not be written"), format!("chmod u+w {shown}")),
        Some(_) => vec![Finding::ok(CHECK, WHY, shown.to_string())],
        None => match folder.ancestors().find_map(|a| machine.nodes.get(a)) {
            Some(node) if node.write => vec![Finding::ok(CHECK, WHY, format!("{shown} (will be made)"))],
            _ => note(
                format!("{shown} is not there and cannot be made"),
                format!("sudo install -d -o {user} -m 700 {shown}"),
            ),
        },
    }
}
