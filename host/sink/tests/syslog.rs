//! `syslog`: against a socket of this test's own, and against one in the place of journald's.

mod support;

use latchwork_record::{Kind, Record};
use latchwork_sink::kinds::syslog::SYSLOG;
use latchwork_sink::{State, What};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::Command;
use std::time::Duration;
use support::{Bench, config, record, skip, wait_for};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(30);

fn listen(path: &Path) -> UnixDatagram {
    let socket = UnixDatagram::bind(path).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    socket
}

fn datagram(socket: &UnixDatagram) -> Vec<u8> {
    let mut buffer = vec![0; 64 << 10];
    let length = socket.recv(&mut buffer).expect("a datagram");
    buffer.truncate(length);
    buffer
}

#[test]
fn a_record_is_a_line_with_severity_and_all_that_is_known() {
    let folder = TempDir::new().unwrap();
    let socket = listen(&folder.path().join("log"));
    let mut sink = (SYSLOG.open)(&config(&SYSLOG, folder.path(), "path = \"log\"")).unwrap();
    let alarm = Record {
        kind: Kind::Alarm,
        source: "pump.alarms.dry".into(),
        transition: "raised".into(),
        priority: 255,
        user: "anna".into(),
        text: "no\nwater".into(),
        ..record(17)
    };
    assert_eq!(sink.write(&[alarm, Record { text: String::new(), ..record(18) }]), Ok(18));
    let lines = [datagram(&socket), datagram(&socket)].map(|d| String::from_utf8(d).unwrap());
    // <25>: facility daemon (3), severity alert (1); then the time, which is that of sending.
    let (head, text) = lines[0].split_once(" latchwork[").unwrap();
    assert!(head.starts_with("<25>") && head.len() == "<25>Jan 15 08:00:00".len(), "{head}");
    assert_eq!(
        text.split_once("]: ").unwrap().1,
        "pumps: alarm pump.alarms.dry raised 17 -> 18 by anna: no water [seq 17, 2027-01-15T08:00:00.017000000Z]"
    );
    assert!(lines[1].starts_with("<30>"), "informational: {}", lines[1]);
    assert!(
        lines[1]
            .ends_with("pumps: event unit.outputs.status changed 18 -> 19 [seq 18, 2027-01-15T08:00:00.018000000Z]")
    );
}

#[test]
fn a_record_that_no_socket_takes_whole_is_cut() {
    let folder = TempDir::new().unwrap();
    let socket = listen(&folder.path().join("log"));
    let mut sink = (SYSLOG.open)(&config(&SYSLOG, folder.path(), "path = \"log\"")).unwrap();
    assert_eq!(sink.write(&[Record { text: "ä".repeat(1 << 20), ..record(17) }]), Ok(17));
    let text = String::from_utf8(datagram(&socket)).unwrap();
    assert!(text.len() > 32_000 && text.ends_with("ä… [seq 17, 2027-01-15T08:00:00.017000000Z]"), "{}", text.len());
}

#[test]
fn a_daemon_that_goes_and_comes_back_gets_the_rest() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("log");
    let keys = "path = \"log\"\nwait = \"0ms\"";
    let mut bench = Bench::start(&folder.path().join("data"), vec![(&SYSLOG, config(&SYSLOG, folder.path(), keys))]);
    let socket = listen(&path);
    bench.store(1);
    datagram(&socket);
    drop(socket);
    std::fs::remove_file(&path).unwrap();
    let statuses = bench.runner.as_ref().unwrap().statuses();
    bench.store(2);
    wait_for(PATIENCE, "it is missed", || statuses.list()[0].state == State::Failing);
    let socket = listen(&path);
    for seq in [2, 3] {
        let text = String::from_utf8(datagram(&socket)).unwrap();
        assert!(text.contains(&format!("[seq {seq},")), "{text}");
    }
    bench.deliver(PATIENCE);
    let reports = [(); 2].map(|()| bench.reports.recv_timeout(PATIENCE).unwrap().what);
    assert!(matches!(&reports[0], What::Refused(why) if why.contains("log takes nothing")), "{reports:?}");
    assert!(matches!(reports[1], What::Accepted { .. }), "{reports:?}");
    bench.stop();
}

/// Set where this program runs with a folder of its own in the place of journald's.
const INSIDE: &str = "LATCHWORK_JOURNALD_INSIDE";

#[test]
fn inside_a_place_of_journalds() {
    if std::env::var_os(INSIDE).is_none() {
        return;
    }
    let socket = listen(Path::new("/run/systemd/journal/socket"));
    // `auto` sees that it is there.
    let mut sink = (SYSLOG.open)(&config(&SYSLOG, Path::new("/"), "")).unwrap();
    assert_eq!(sink.write(&[Record { priority: 150, text: "two\nlines".into(), ..record(17) }]), Ok(17));
    let text = String::from_utf8(datagram(&socket)).unwrap();
    let fields: Vec<_> = text.lines().collect();
    let expected = [
        "PRIORITY=3",
        "MESSAGE=pumps: event unit.outputs.status changed 17 -> 18: two lines [seq 17, 2027-01-15T08:00:00.017000000Z]",
        "SYSLOG_IDENTIFIER=latchwork",
        "LATCHWORK_PLANT=pumps",
        "LATCHWORK_SEQ=17",
        "LATCHWORK_TIME=2027-01-15T08:00:00.017000000Z",
        "LATCHWORK_KIND=event",
        "LATCHWORK_SOURCE=unit.outputs.status",
        "LATCHWORK_TRANSITION=changed",
        "LATCHWORK_PREVIOUS=17",
        "LATCHWORK_CURRENT=18",
        "LATCHWORK_PRIORITY=150",
        "LATCHWORK_USER=",
    ];
    assert_eq!(fields, expected);
    println!("seen from the inside");
}

#[test]
fn journald_gets_fields_of_their_own() {
    // A mount that only this child sees, so that the machine's own journald is left alone.
    let script = "mkdir -p /run/systemd/journal && mount -t tmpfs none /run/systemd/journal && \
                  exec \"$0\" inside_a_place_of_journalds --exact --nocapture";
    let mut command = Command::new("unshare");
    command.args(["--mount", "sh", "-c", script]).arg(std::env::current_exe().unwrap()).env(INSIDE, "1");
    let output = match command.output() {
        Ok(output) if output.status.success() || !output.stdout.is_empty() => output,
        other => return skip(&format!("a mount of its own is not allowed here; run as root: {other:?}")),
    };
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("seen from the inside"), "{said}{output:?}");
}
