//! Other users of the machine: the kernel says who they are, the plant file what they may do.

use crate::support::{Running, Said, said, skipped, start};
use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};

/// `nobody` of Debian and most others.
const NOBODY: u32 = 65_534;

/// The program where another user may run it, or `None` if we cannot be one.
fn for_others(plant: &Running) -> Option<PathBuf> {
    if !rustix::process::geteuid().is_root() {
        skipped("operate::who: only root can be another user");
        return None;
    }
    let open = |path: &Path| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("it is ours");
    };
    open(plant.folder.path());
    let copy = plant.folder.path().join("latchwork");
    std::fs::copy(env!("CARGO_BIN_EXE_latchwork"), &copy).expect("a copy");
    open(&copy);
    Some(copy)
}

fn as_nobody(plant: &Running, program: &Path, args: &[&str]) -> Said {
    said(plant.command(program, args).uid(NOBODY).gid(NOBODY))
}

#[test]
fn without_a_policy_nobody_else_gets_in() {
    let plant = start("");
    let Some(program) = for_others(&plant) else { return };
    // The folder was made by the plant, for its own user alone.
    let (code, out, errors) = as_nobody(&plant, &program, &["status"]);
    assert_eq!((code, out.as_str()), (Some(1), ""));
    assert!(errors.contains("may not be opened by this user") && errors.contains("[policy]"), "{errors}");
}

#[test]
fn a_policy_lets_others_in_for_what_it_says_and_refusals_are_on_record() {
    let plant = start("[policy]\nview = [\"everyone\"]\nalarm = [\"user:nobody\", \"group:no-such-group-here\"]\n");
    assert!(plant.errors().contains("warning: [policy] names group:no-such-group-here"), "{}", plant.errors());
    let Some(program) = for_others(&plant) else { return };
    let (code, out, errors) = as_nobody(&plant, &program, &["status"]);
    assert_eq!(code, Some(0), "{out}{errors}");
    plant.does(&["set", "field.smoke=true"]);
    plant.until_alarm_is("fire.alarms.alarm", "unacknowledged");
    let (code, out, errors) = as_nobody(&plant, &program, &["ack", "--all"]);
    assert_eq!(code, Some(0), "{out}{errors}");
    plant.until_alarm_is("fire.alarms.alarm", "active");
    for args in [&["force", "field.level=0"][..], &["set", "field.smoke=false"], &["command", "unit.commands.reset"]] {
        let (code, out, errors) = as_nobody(&plant, &program, args);
        assert_eq!((code, out.as_str()), (Some(1), ""), "{args:?}: {errors}");
        assert!(
            errors.contains("nobody has no right to `") && errors.contains("in [policy] of the plant file"),
            "{errors}"
        );
    }
    let acknowledged = plant.records(1, |r| r["transition"] == "acknowledged");
    assert_eq!(acknowledged[0]["user"], "nobody");
    let refused = plant.records(3, |r: &Value| r["transition"] == "refused" && r["user"] == "nobody");
    let kinds: Vec<_> = refused.iter().map(|r| r["kind"].as_str().expect("a kind")).collect();
    assert_eq!(kinds, ["audit", "setting", "command"], "{refused:#?}");
}
