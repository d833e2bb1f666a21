//! `mqtt`: against mosquitto, which is stopped, started again and killed meanwhile.

mod broker;
mod support;

use broker::{Broker, Subscriber};
use latchwork_image::Value;
use latchwork_record::{Kind, Record};
use latchwork_sink::kinds::mqtt::MQTT;
use latchwork_sink::{State, What};
use std::time::Duration;
use support::{Bench, config, record, skip, wait_for};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(120);

/// A broker, or the note that there is none.
fn broker(folder: &std::path::Path, more: &str) -> Option<Broker> {
    let broker = Broker::new(folder, more);
    if broker.is_none() {
        skip("mosquitto is missing; apt install mosquitto");
    }
    broker
}

fn seq(payload: &str) -> u64 {
    serde_json::from_str::<serde_json::Value>(payload).expect(payload)["seq"].as_u64().expect("a number")
}

#[test]
fn a_hundred_thousand_records_arrive_over_restarts_of_the_broker() {
    let folder = TempDir::new().unwrap();
    let Some(mut broker) = broker(folder.path(), "") else { return };
    broker.start();
    let subscriber = Subscriber::start(broker.port, "latchwork/pumps/records/#");
    let keys = format!("address = \"127.0.0.1\"\nport = {}\nbatch = 1000\nlist = 5000\ntimeout = \"2s\"", broker.port);
    let mut bench = Bench::start(&folder.path().join("data"), vec![(&MQTT, config(&MQTT, folder.path(), &keys))]);
    let statuses = bench.runner.as_ref().unwrap().statuses();
    bench.store(100_000);
    for midway in [20_000, 50_000, 80_000] {
        wait_for(PATIENCE, "some have arrived", || statuses.list()[0].cursor >= midway);
        // It keeps what it has acknowledged, as a broker in use does.
        broker.stop();
        wait_for(PATIENCE, "it is missed", || statuses.list()[0].state == State::Failing);
        broker.start();
    }
    bench.deliver(PATIENCE);
    let mut last = 0;
    let mut repeated = 0;
    while last < 100_000 {
        let seq = seq(&subscriber.next(PATIENCE).1);
        if seq <= last {
            repeated += 1;
            continue;
        }
        assert_eq!(seq, last + 1, "a record is missing");
        last = seq;
    }
    println!("{repeated} numbers came twice");
    let reports: Vec<_> = bench.reports.try_iter().map(|r| r.what).collect();
    let refused = reports.iter().filter(|r| matches!(r, What::Refused(_))).count();
    assert_eq!((refused, reports.len()), (3, 6), "told when it went and when it came back: {reports:?}");
    bench.stop();
}

#[test]
fn topics_are_those_of_the_documentation() {
    let folder = TempDir::new().unwrap();
    let Some(mut broker) = broker(folder.path(), "") else { return };
    broker.start();
    let subscriber = Subscriber::start(broker.port, "site/#");
    let keys = format!("address = \"localhost\"\nport = {}\ntopic = \"site/a\"\nwait = \"0ms\"", broker.port);
    let mut bench = Bench::start(&folder.path().join("data"), vec![(&MQTT, config(&MQTT, folder.path(), &keys))]);
    let next = || subscriber.next(PATIENCE);
    assert_eq!(next(), ("site/a/state".into(), "online".into()));
    let table = Record {
        kind: Kind::Event,
        source: "table.pump".into(),
        current: Value::Text("{\"running\":true}".into()),
        ..record(2)
    };
    let odd = Record { kind: Kind::Alarm, source: "a/b+#".into(), ..record(1) };
    bench.journal.push(&odd);
    bench.journal.push(&table);
    assert_eq!(next(), ("site/a/records/alarm/a_b__".into(), odd.to_json()));
    assert_eq!(next(), ("site/a/records/event/table.pump".into(), table.to_json()));
    assert_eq!(next(), ("site/a/tables/pump".into(), "{\"running\":true}".into()));
    bench.stop();
    assert_eq!(next(), ("site/a/state".into(), "offline".into()), "it takes leave");
    // What is retained is there for whoever comes later.
    let late = Subscriber::start(broker.port, "site/#");
    let mut retained = [late.next(PATIENCE), late.next(PATIENCE)];
    retained.sort();
    let expected = [("site/a/state", "offline"), ("site/a/tables/pump", "{\"running\":true}")];
    assert_eq!(retained, expected.map(|(t, p)| (t.to_owned(), p.to_owned())));
}

/// Names the folder and the port when this program is started as the process that will be killed.
const VICTIM: &str = "LATCHWORK_MQTT_VICTIM";

#[test]
fn victim_of_the_last_will_test() {
    let Ok(port) = std::env::var(VICTIM) else { return };
    let folder = TempDir::new().unwrap();
    let keys = format!("address = \"127.0.0.1\"\nport = {port}");
    let _bench = Bench::start(folder.path(), vec![(&MQTT, config(&MQTT, folder.path(), &keys))]);
    loop {
        std::thread::park();
    }
}

#[test]
fn a_plant_that_is_killed_is_offline_by_its_last_will() {
    let folder = TempDir::new().unwrap();
    let Some(mut broker) = broker(folder.path(), "") else { return };
    broker.start();
    let subscriber = Subscriber::start(broker.port, "latchwork/pumps/state");
    let mut child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["victim_of_the_last_will_test", "--exact", "--nocapture"])
        .env(VICTIM, broker.port.to_string())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let online = subscriber.next(PATIENCE);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(online.1, "online");
    assert_eq!(subscriber.next(PATIENCE).1, "offline");
}

#[test]
fn with_tls_and_a_password_and_not_without() {
    let folder = TempDir::new().unwrap();
    let more = "cafile ca.pem\ncertfile server.pem\nkeyfile server.key\nallow_anonymous false\npassword_file users\n";
    let Some(mut broker) = broker(folder.path(), more) else { return };
    broker::certificates(folder.path());
    broker::user(folder.path(), "anna", "secret");
    broker.start();
    std::fs::write(folder.path().join("right"), "secret\n").unwrap();
    std::fs::write(folder.path().join("wrong"), "sesame\n").unwrap();
    let outcome = |keys: &str| {
        let keys = format!("address = \"localhost\"\nport = {}\ntimeout = \"2s\"\n{keys}", broker.port);
        let mut sink = (MQTT.open)(&config(&MQTT, folder.path(), &keys))?;
        sink.write(&[record(1)])
    };
    let anna = "username = \"anna\"\npassword-file = ";
    assert_eq!(outcome(&format!("ca = \"ca.pem\"\n{anna}\"right\"")), Ok(1));
    for (what, keys, says) in [
        ("a wrong password", format!("ca = \"ca.pem\"\n{anna}\"wrong\""), "the password is wrong"),
        ("no user", "ca = \"ca.pem\"".to_owned(), "knows no such user"),
        ("no such file", format!("ca = \"ca.pem\"\n{anna}\"none\""), "password file"),
        ("an unknown signer", format!("ca = \"other.pem\"\n{anna}\"right\""), "certificate"),
        ("no certificates", format!("ca = \"right\"\n{anna}\"right\""), "BEGIN CERTIFICATE"),
        ("no TLS", format!("{anna}\"right\""), "takes nothing"),
    ] {
        let error = outcome(&keys).expect_err(what);
        assert!(error.contains(says), "{what}: {error}");
        assert!(!error.contains("secret") && !error.contains("sesame"), "{what}: {error}");
    }
}

#[test]
fn a_password_that_is_replaced_needs_no_restart() {
    let folder = TempDir::new().unwrap();
    let Some(mut broker) = broker(folder.path(), "allow_anonymous false\npassword_file users\n") else { return };
    broker::user(folder.path(), "anna", "secret");
    broker.start();
    let keys =
        format!("address = \"127.0.0.1\"\nport = {}\nusername = \"anna\"\npassword-file = \"password\"", broker.port);
    std::fs::write(folder.path().join("password"), "sesame\n").unwrap();
    let mut sink = (MQTT.open)(&config(&MQTT, folder.path(), &keys)).unwrap();
    assert!(sink.write(&[record(1)]).is_err());
    std::fs::write(folder.path().join("password"), "secret\n").unwrap();
    assert_eq!(sink.write(&[record(1)]), Ok(1));
}

#[test]
fn a_record_that_the_broker_never_takes_goes_without_its_text_and_holds_up_no_other() {
    let folder = TempDir::new().unwrap();
    let Some(mut broker) = broker(folder.path(), "max_packet_size 20000\n") else { return };
    broker.start();
    let subscriber = Subscriber::start(broker.port, "latchwork/pumps/records/#");
    let keys = format!("address = \"127.0.0.1\"\nport = {}", broker.port);
    let mut bench = Bench::start(&folder.path().join("data"), vec![(&MQTT, config(&MQTT, folder.path(), &keys))]);
    bench.journal.push(&record(1));
    bench.journal.push(&Record { text: "x".repeat(50_000), ..record(2) });
    bench.journal.push(&record(3));
    assert!(bench.journal.settle(PATIENCE));
    bench.deliver(PATIENCE);
    let mut texts = std::collections::BTreeMap::new();
    while !texts.contains_key(&3) {
        let text = subscriber.next(PATIENCE).1;
        texts.insert(seq(&text), text);
    }
    assert_eq!((&texts[&1], &texts[&3]), (&record(1).to_json(), &record(3).to_json()));
    assert!(texts[&2].contains("left out: the broker takes no message of 50"), "{}", texts[&2]);
    bench.stop();
}

#[test]
fn a_broker_that_is_not_there_is_an_error_that_names_it() {
    let folder = TempDir::new().unwrap();
    let port = broker::free_port();
    let keys = format!("address = \"127.0.0.1\"\nport = {port}");
    let mut sink = (MQTT.open)(&config(&MQTT, folder.path(), &keys)).unwrap();
    let error = sink.write(&[record(1)]).unwrap_err();
    assert!(error.contains(&format!("127.0.0.1:{port}")) && error.contains("refused"), "{error}");
}
