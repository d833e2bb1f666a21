//! mosquitto as a process of the test's own, and who listens to it.

use rumqttc::{Client, Event, MqttOptions, Packet, QoS, SubscribeReasonCode};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A port of the loopback interface that nobody listens at.
pub(crate) fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port()
}

fn program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain([PathBuf::from("/usr/sbin")]);
    folders.map(|f| f.join(name)).find(|p| p.exists())
}

/// A broker that keeps what it has acknowledged over a restart.
pub(crate) struct Broker {
    pub(crate) port: u16,
    program: PathBuf,
    folder: PathBuf,
    child: Option<Child>,
}

impl Broker {
    /// A broker with its files in a folder, not started; `None` where there is no mosquitto.
    pub(crate) fn new(folder: &Path, more: &str) -> Option<Self> {
        let program = program("mosquitto")?;
        let port = free_port();
        let anonymous = if more.contains("allow_anonymous") { "" } else { "allow_anonymous true\n" };
        let text = format!(
            "listener {port} 127.0.0.1\n{anonymous}persistence true\npersistence_location {}/\nmax_queued_messages 0\n\
             log_type none\nuser root\n{more}",
            folder.display()
        );
        std::fs::write(folder.join("mosquitto.conf"), text).expect("its configuration");
        Some(Self { port, program, folder: folder.into(), child: None })
    }

    /// Starts it and waits until it listens.
    pub(crate) fn start(&mut self) {
        let mut command = Command::new(&self.program);
        command.args(["-c", "mosquitto.conf"]).current_dir(&self.folder).stderr(Stdio::null());
        let mut child = command.spawn().expect("mosquitto starts");
        let end = Instant::now() + Duration::from_secs(30);
        while std::net::TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            assert_eq!(child.try_wait().expect("a child"), None, "mosquitto has ended");
            assert!(Instant::now() < end, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(10));
        }
        self.child = Some(child);
    }

    /// Ends it in order: it stores what it has.
    pub(crate) fn stop(&mut self) {
        let Some(mut child) = self.child.take() else { return };
        let ended = Command::new("kill").arg(child.id().to_string()).status();
        assert!(ended.is_ok_and(|s| s.success()), "kill");
        child.wait().expect("it ends");
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// A client that hears topics, over restarts of the broker.
pub(crate) struct Subscriber {
    messages: Receiver<(String, String)>,
}

impl Subscriber {
    /// Subscribes; returns when the broker has taken that in.
    pub(crate) fn start(port: u16, topic: &str) -> Self {
        let id = format!("listener-{}", free_port());
        let mut options = MqttOptions::new(id, "127.0.0.1", port);
        options.set_clean_session(false).set_keep_alive(Duration::from_secs(5)).set_max_packet_size(1 << 20, 1 << 20);
        let (client, mut connection) = Client::new(options, 10);
        client.subscribe(topic, QoS::AtLeastOnce).expect("room for a request");
        let (send, messages) = channel();
        let (ready, subscribed) = channel();
        std::thread::spawn(move || {
            let _client = client;
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::SubAck(ack))) => {
                        assert!(ack.return_codes.iter().all(|c| *c != SubscribeReasonCode::Failure));
                        let _ = ready.send(());
                    }
                    Ok(Event::Incoming(Packet::Publish(message))) => {
                        let payload = String::from_utf8(message.payload.to_vec()).expect("text");
                        // Nobody wants them any more.
                        if send.send((message.topic, payload)).is_err() {
                            return;
                        }
                    }
                    Ok(_) => {}
                    Err(_) => std::thread::sleep(Duration::from_millis(50)),
                }
            }
        });
        subscribed.recv_timeout(Duration::from_secs(30)).expect("a subscription");
        Self { messages }
    }

    /// Topic and text of the next message.
    pub(crate) fn next(&self, patience: Duration) -> (String, String) {
        self.messages.recv_timeout(patience).expect("a message")
    }
}

fn openssl(folder: &Path, args: &str) {
    let mut command = Command::new("openssl");
    command.args(args.split_whitespace()).current_dir(folder);
    let output = command.output().expect("openssl; apt install openssl");
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
}

/// `ca.pem`, and `server.pem` with `server.key` for localhost; `other.pem` has signed nothing.
pub(crate) fn certificates(folder: &Path) {
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2";
    for name in ["ca", "other"] {
        openssl(folder, &format!("req -x509 {key} -keyout {name}.key -out {name}.pem -subj /CN={name}"));
    }
    openssl(folder, &format!("req {key} -keyout server.key -out server.csr -subj /CN=localhost"));
    std::fs::write(folder.join("names"), "subjectAltName=DNS:localhost\n").expect("a file");
    openssl(
        folder,
        "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile names -out server.pem",
    );
}

/// A user that the broker knows.
pub(crate) fn user(folder: &Path, name: &str, password: &str) {
    let mut command = Command::new(program("mosquitto_passwd").expect("it comes with mosquitto"));
    let output = command.args(["-c", "-b", "users", name, password]).current_dir(folder).output().expect("it starts");
    assert!(output.status.success(), "{output:?}");
}
