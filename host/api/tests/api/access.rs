//! Who may do what: other users of the machine are processes that run as them.

use crate::support::{LONG, Rig, rig};
use latchwork_api::{ApiError, Config, Limits, Server};
use latchwork_plant::operate::{Operation, Policy, console};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A user that no machine has a name for.
const NAMELESS: u32 = 61_234;
/// `nobody` of Debian and most others.
const NOBODY: u32 = 65_534;

/// Status and body of a request by another user; `None`: the socket may not be opened.
fn as_user(rig: &Rig, uid: u32, gid: u32, method: &str, path: &str, body: &str) -> Option<(u16, String)> {
    // The tests' folders are only root's: others are to be stopped by the socket, not by the way to it.
    let way = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(rig.folder.path(), way).expect("the folder is ours");
    let script = "import http.client, socket, sys\n\
                  s = socket.socket(socket.AF_UNIX)\n\
                  try: s.connect(sys.argv[1])\n\
                  except PermissionError: sys.exit(77)\n\
                  c = http.client.HTTPConnection('x')\n\
                  c.sock = s\n\
                  c.request(sys.argv[2], sys.argv[3], sys.stdin.read())\n\
                  r = c.getresponse()\n\
                  print(r.status, r.read().decode())\n";
    let ids = [format!("--reuid={uid}"), format!("--regid={gid}"), "--clear-groups".into()];
    let mut child = Command::new("setpriv")
        .args(ids)
        .args(["--", "python3", "-I", "-c", script])
        .arg(rig.socket())
        .args([method, path])
        .current_dir("/")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("setpriv starts");
    child.stdin.take().expect("its input").write_all(body.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    if output.status.code() == Some(77) {
        return None;
    }
    let text = String::from_utf8(output.stdout).expect("text");
    let (status, body) = text.split_once(' ').unwrap_or_else(|| panic!("{:?}: {text}", output.status));
    Some((status.parse().expect("a status"), body.trim().into()))
}

/// Only root can be somebody else; a machine on which we are not root, or that lacks the means, is named.
fn can_be_others() -> bool {
    let able = rustix::process::geteuid().is_root()
        && Command::new("setpriv")
            .args(["--reuid=65534", "--regid=65534", "--clear-groups", "python3", "-V"])
            .output()
            .is_ok_and(|o| o.status.success());
    if !able {
        let why = format!("{}: needs root, setpriv and python3\n", module_path!());
        eprint!("SKIPPED {why}");
        if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
            let file = std::fs::OpenOptions::new().append(true).open(list);
            file.and_then(|mut f| f.write_all(why.as_bytes())).expect("the list of skipped tests");
        }
    }
    able
}

fn mode(path: &Path) -> u32 {
    std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777
}

#[test]
fn without_a_policy_the_socket_is_the_own_users_alone() {
    let rig = rig(&[], Limits::default());
    assert_eq!(mode(&rig.socket()), 0o600);
    if can_be_others() {
        assert_eq!(as_user(&rig, NOBODY, NOBODY, "GET", "/v1/status", ""), None);
    }
}

#[test]
fn the_kernel_says_who_it_is_and_the_policy_what_that_one_may() {
    if !can_be_others() {
        return;
    }
    let given = [("view", "everyone"), ("alarm", "uid:61234"), ("command", "user:nobody"), ("set", "group:daemon")];
    let rig = rig(&given, Limits { forbidden: Duration::from_millis(10), ..Limits::default() });
    assert_eq!(mode(&rig.socket()), 0o666);
    let daemon = 1; // the group of that number, on every Linux
    let status =
        |uid, gid, path: &str, body: &str| as_user(&rig, uid, gid, "POST", path, body).expect("a connection").0;
    let acknowledge = ("/v1/alarms/acknowledge", r#"{"alarm": "a"}"#);
    let command = ("/v1/commands", r#"{"tag": "a.commands.go"}"#);
    let set = ("/v1/settings", r#"{"values": {"a.settings.x": 1}}"#);
    let force = ("/v1/forces", r#"{"tag": "a", "value": 1}"#);
    for (what, uid, gid, expected) in [
        ("by number", NAMELESS, NAMELESS, [200, 403, 403, 403]),
        ("by name", NOBODY, NOBODY, [403, 200, 403, 403]),
        ("by group", NAMELESS + 1, daemon, [403, 403, 200, 403]),
        ("root", 0, 0, [200, 200, 200, 200]),
    ] {
        let found = [acknowledge, command, set, force].map(|(path, body)| status(uid, gid, path, body));
        assert_eq!(found, expected, "{what}");
        assert_eq!(as_user(&rig, uid, gid, "GET", "/v1/tags", "").expect("a connection").0, 200, "{what}");
    }
    // What was refused has reached the plant, as what it is, under the name the kernel knows.
    let wishes = rig.wishes();
    let forced = wishes.iter().find(|w| w.operator.user == "nobody" && matches!(w.operation, Operation::Force { .. }));
    let why = forced.and_then(|w| w.forbidden.clone()).expect("a forbidden wish");
    assert!(why.contains("nobody has no right to `force`") && why.contains(r#"force = ["user:nobody"]"#), "{why}");
    assert!(wishes.iter().any(|w| w.operator.user == "uid:61234" && w.forbidden.is_none()));
    assert!(wishes.iter().any(|w| w.operator.user == "root" && matches!(w.operation, Operation::Force { .. })));
}

#[test]
fn who_may_not_view_sees_no_values_and_no_records() {
    if !can_be_others() {
        return;
    }
    let rig = rig(&[("view", "user:nobody")], Limits { forbidden: Duration::from_millis(10), ..Limits::default() });
    for path in ["/v1/status", "/v1/tags", "/v1/watch", "/v1/alarms", "/v1/forces", "/v1/records", "/v1/settings/a"] {
        let (status, body) = as_user(&rig, NAMELESS, NAMELESS, "GET", path, "").expect("a connection");
        assert_eq!(status, 403, "{path}: {body}");
        assert!(body.contains("has no right to `view`"), "{path}: {body}");
    }
    // Which plant it is, and what its requests are like, is no secret.
    assert_eq!(as_user(&rig, NAMELESS, NAMELESS, "GET", "/", "").expect("a connection").0, 200);
}

#[test]
fn who_may_not_swap_is_told_so_whatever_he_sends_and_the_plant_records_it() {
    if !can_be_others() {
        return;
    }
    let rig = rig(&[("set", "user:nobody")], Limits { forbidden: Duration::from_millis(10), ..Limits::default() });
    for body in [r#"{"blocks": []}"#.to_owned(), "x".repeat(4 << 20)] {
        let (status, answer) = as_user(&rig, NOBODY, NOBODY, "POST", "/v1/swaps", &body).expect("a connection");
        assert_eq!(status, 403, "{answer}");
        assert!(answer.contains("nobody has no right to `swap`"), "{answer}");
    }
    let wishes = rig.wishes();
    let refused = wishes.iter().filter(|w| matches!(w.operation, Operation::Swap(_)) && w.forbidden.is_some());
    assert_eq!(refused.count(), 2, "{wishes:?}");
}

#[test]
fn many_forbidden_wishes_take_their_time() {
    if !can_be_others() {
        return;
    }
    let rig = rig(&[("view", "everyone")], Limits { forbidden: Duration::from_millis(400), ..Limits::default() });
    let start = Instant::now();
    let (status, _) = as_user(&rig, NOBODY, NOBODY, "GET", "/v1/status", "").expect("a connection");
    assert_eq!(status, 200);
    let (status, _) = as_user(&rig, NOBODY, NOBODY, "POST", "/v1/commands", r#"{"tag": "a"}"#).expect("a connection");
    assert_eq!(status, 403);
    assert!(start.elapsed() >= Duration::from_millis(400) && start.elapsed() < LONG);
}

#[test]
fn names_nobody_knows_are_a_warning_and_a_second_plant_is_refused() {
    let rig = rig(&[("set", "user:no-such-user-here"), ("view", "group:no-such-group")], Limits::default());
    let warnings = rig.server.as_ref().expect("a server").warnings();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    let config = Config {
        socket: rig.socket(),
        plant: "second".into(),
        policy: Policy::default(),
        data: None,
        limits: Limits::default(),
    };
    let (console, _wishes) = console();
    let Err(error) = Server::start(config, console) else { panic!("two plants on one socket") };
    assert!(matches!(error, ApiError::Taken { .. }), "{error}");
    assert_eq!(rig.raw("GET / HTTP/1.1", "").0, 200, "the first one is still there");
}

#[test]
fn a_server_that_ends_leaves_no_socket() {
    let mut rig = rig(&[], Limits::default());
    let socket = rig.socket();
    let mut open = rig.connect();
    rig.server = None;
    assert!(!socket.exists());
    // Closed, or cut before it was even accepted; but not left open.
    let closed = std::io::Read::read_to_end(&mut open, &mut Vec::new());
    assert!(closed.is_ok() || closed.is_err_and(|e| e.kind() == std::io::ErrorKind::ConnectionReset));
    let error = rig.client().get::<serde_json::Value>("/", &[]).expect_err("nobody listens");
    assert!(error.to_string().contains("no plant listens at"), "{error}");
}
