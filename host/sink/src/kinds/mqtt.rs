//! `mqtt`: a broker, each record as a message of QoS 1.
//!
//! ```toml
//! [sink.broker]
//! kind = "mqtt"
//! address = "broker.example"
//! tls = true
//! username = "pumps"
//! password-file = "/etc/latchwork/broker.password"
//! ```
//!
//! Topics are `PREFIX/records/KIND/SOURCE`; `PREFIX/state` is retained, `online` and, by the last will, `offline`;
//! `PREFIX/tables/NAME` is the last text of the status table `table.NAME`, retained. A record is kept when the broker has
//! acknowledged it. After a connection that broke, what was not acknowledged is sent again: a subscriber may see a number
//! twice, but never a later one without those before.

use super::mqtt_session::{Payload, Session};
use crate::{Claim, Config, Problem, Sink, SinkKind};
use latchwork_image::Value;
use latchwork_record::Record;
use latchwork_schema::{Key, Kind, Section};
use rumqttc::{LastWill, MqttOptions, QoS, TlsConfiguration, Transport};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The kind.
pub static MQTT: SinkKind = SinkKind { name: "mqtt", keys: &KEYS, check, claim, open };

fn claim(config: &Config) -> Option<Claim> {
    let (address, port) = (config.values.text("address")?, port(config));
    Some(Claim { key: "client-id", what: format!("the name {} at {address}:{port}", client_id(config)) })
}

const SECOND: u64 = 1_000_000_000;
/// Messages that may be without their acknowledgement: brokers hold back what is beyond their own limit.
const IN_FLIGHT: u16 = 10;
/// Largest message, bytes.
const LARGEST: usize = 16 << 20;
/// Pause before a connection is tried again while there is nothing to send.
const PAUSE: Duration = Duration::from_secs(5);
/// A record that is sent alone, is longer than this and makes the broker close the connection so many times goes without what
/// makes it long: brokers have limits of their own, and MQTT 3.1.1 does not tell them.
const TOO_LONG: (usize, u32) = (1024, 4);
/// Records with this at the beginning of their source are status tables.
const TABLE: &str = "table.";

static KEYS: Section = Section {
    name: "[sink.NAME] (mqtt)",
    doc: "A broker of MQTT 3.1.1, QoS 1.",
    keys: &[
        Key::required(
            "address",
            Kind::Text,
            "Host name or address of the broker; with TLS the name in its certificate.",
        ),
        Key::optional("port", Kind::Integer { min: 1, max: 65_535 }, "1883, with TLS 8883", "Its TCP port."),
        Key::optional("tls", Kind::Bool, "false, with `ca` true", "Encrypts, and checks the broker's certificate."),
        Key::optional(
            "ca",
            Kind::Text,
            "the system's",
            "File with the certificates (PEM) that the broker's is signed by, relative to this file.",
        ),
        Key::optional("username", Kind::Text, "", "User to log in as."),
        Key::optional(
            "password-file",
            Kind::Text,
            "",
            "File whose first line is the password, relative to this file. A password never stands in the plant file.",
        ),
        Key::optional(
            "client-id",
            Kind::Text,
            "latchwork-PLANT-NAME",
            "Name of this client; the broker knows one of a name.",
        ),
        Key::optional("topic", Kind::Text, "latchwork/PLANT", "What all topics begin with."),
        Key::optional(
            "keep-alive",
            Kind::Duration { min: 5 * SECOND, max: 3600 * SECOND },
            "\"30s\"",
            "A sign of life is sent so often; a broker that hears none for one and a half of it publishes the last will.",
        ),
        Key::optional(
            "timeout",
            Kind::Duration { min: SECOND, max: 600 * SECOND },
            "\"5s\"",
            "Longest wait for a connection, and for an acknowledgement. Whole seconds.",
        ),
    ],
};

fn check(config: &Config) -> Vec<Problem> {
    let values = &config.values;
    let problem = |key: &str, message: &str, help: &str| Problem {
        key: key.into(),
        message: message.into(),
        help: Some(help.into()),
    };
    let mut problems = Vec::new();
    if values.has("ca") && values.bool("tls") == Some(false) {
        problems.push(problem("ca", "`ca` has no effect: `tls` is false", "take one of the two out"));
    }
    if values.has("password-file") && !values.has("username") {
        problems.push(problem("password-file", "there is a password and no user", "add `username = \"…\"`"));
    }
    let address = values.text("address").unwrap_or_default();
    if address.is_empty() || address.contains(['/', ' ']) {
        let message = format!("`address` is \"{address}\"; expected a host name or an address");
        problems.push(problem(
            "address",
            &message,
            "as in `address = \"broker.example\"`; the port has a key of its own",
        ));
    }
    if values.text("topic").is_some_and(|t| t.is_empty() || t.contains(['+', '#', '\0']) || t.starts_with('$')) {
        let message = "`topic` is no beginning of topics: those have no `+`, `#`, and no `$` at the beginning";
        problems.push(problem("topic", message, "as in `topic = \"site/pumps\"`"));
    }
    problems
}

fn open(config: &Config) -> Result<Box<dyn Sink>, String> {
    let prefix = match config.values.text("topic") {
        Some(topic) => topic.trim_end_matches('/').to_owned(),
        None => format!("latchwork/{}", level(&config.plant)),
    };
    let (settings, state) = (config.clone(), state(&prefix));
    options(config, &state)?;
    let will = state.clone();
    // Read anew for each connection: passwords and certificates are replaced while a plant runs.
    let session = Session::new(Box::new(move || options(&settings, &will)), timeout(config), state);
    Ok(Box::new(Mqtt { prefix, session, next: Instant::now(), stuck: None }))
}

fn timeout(config: &Config) -> Duration {
    Duration::from_nanos(config.values.duration("timeout").unwrap_or(5 * SECOND))
}

fn state(prefix: &str) -> String {
    format!("{prefix}/state")
}

fn tls(config: &Config) -> bool {
    config.values.bool("tls").unwrap_or(config.values.has("ca"))
}

fn port(config: &Config) -> u16 {
    let given = config.values.integer("port").and_then(|p| u16::try_from(p).ok());
    given.unwrap_or(if tls(config) { 8883 } else { 1883 })
}

fn client_id(config: &Config) -> String {
    let default = || format!("latchwork-{}-{}", config.plant, config.name);
    config.values.text("client-id").map_or_else(default, Into::into)
}

/// What a connection is made with. `state` is the topic of the last will.
fn options(config: &Config, state: &str) -> Result<MqttOptions, String> {
    let (values, tls) = (&config.values, tls(config));
    let mut options = MqttOptions::new(client_id(config), values.text("address").unwrap_or_default(), port(config));
    options.set_keep_alive(Duration::from_secs(values.duration("keep-alive").unwrap_or(30 * SECOND) / SECOND));
    options.set_inflight(IN_FLIGHT).set_max_packet_size(LARGEST, LARGEST);
    options.set_last_will(LastWill::new(state, "offline", QoS::AtLeastOnce, true));
    if let Some(user) = values.text("username") {
        options.set_credentials(user, password(config)?);
    }
    if tls {
        options.set_transport(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(trust(config)?))));
    }
    Ok(options)
}

fn password(config: &Config) -> Result<String, String> {
    let Some(path) = config.values.text("password-file").map(|p| config.folder.join(p)) else {
        return Ok(String::new());
    };
    let text = read(&path, "password")?;
    Ok(String::from_utf8_lossy(&text).lines().next().unwrap_or_default().to_owned())
}

fn read(path: &Path, what: &str) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|e| format!("the {what} file {} cannot be read: {e}", path.display()))
}

/// Whose certificates count.
fn trust(config: &Config) -> Result<rustls::ClientConfig, String> {
    use rustls::pki_types::{CertificateDer, pem::PemObject};
    let mut roots = rustls::RootCertStore::empty();
    match config.values.text("ca").map(|p| config.folder.join(p)) {
        Some(path) => {
            let text = read(&path, "certificate")?;
            let bad = |e: &dyn std::fmt::Display| format!("the certificate file {} is none: {e}", path.display());
            for certificate in CertificateDer::pem_slice_iter(&text) {
                roots.add(certificate.map_err(|e| bad(&e))?).map_err(|e| bad(&e))?;
            }
            if roots.is_empty() {
                return Err(bad(&"expected text with `-----BEGIN CERTIFICATE-----`"));
            }
        }
        None => {
            roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
            if roots.is_empty() {
                let way = "install ca-certificates, or name a file with `ca`";
                return Err(format!("this system has no list of certificates it trusts; {way}"));
            }
        }
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = rustls::ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    Ok(builder.map_err(|e| e.to_string())?.with_root_certificates(roots).with_no_client_auth())
}

/// A name as one level of a topic.
fn level(name: &str) -> String {
    name.replace(['/', '+', '#', '\0'], "_")
}

/// A long record without what makes it long.
fn shortened(record: &Record) -> Option<Record> {
    let length = record.to_json().len();
    (length > TOO_LONG.0).then(|| Record {
        previous: Value::None,
        current: Value::None,
        text: format!("left out: the broker takes no message of {length} bytes; the journal has the record"),
        ..record.clone()
    })
}

struct Mqtt {
    prefix: String,
    session: Session,
    /// When a connection may be tried while there is nothing to send.
    next: Instant,
    /// A record that the broker has closed the connection at, and how many times in a row.
    stuck: Option<(u64, u32)>,
}

impl Mqtt {
    /// The messages of a record.
    fn messages<'a>(&'a self, record: &'a Record) -> impl Iterator<Item = Payload> + 'a {
        let topic = format!("{}/records/{}/{}", self.prefix, record.kind.name(), level(&record.source));
        let of_record = Payload { seq: record.seq, topic, retain: false, text: record.to_json() };
        let table = match (record.source.strip_prefix(TABLE), &record.current) {
            (Some(name), Value::Text(text)) => {
                let topic = format!("{}/tables/{}", self.prefix, level(name));
                Some(Payload { seq: record.seq, topic, retain: true, text: text.clone() })
            }
            _ => None,
        };
        [of_record].into_iter().chain(table)
    }
}

impl Sink for Mqtt {
    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        let Some(first) = batch.first() else { return Ok(0) };
        let tries = self.stuck.filter(|(seq, _)| *seq == first.seq).map_or(0, |(_, tries)| tries);
        // After the first time alone, so that nobody else's length is its fault.
        let batch = if tries > 0 { &batch[..1] } else { batch };
        let short = (tries >= TOO_LONG.1).then(|| shortened(first)).flatten();
        let batch = short.as_ref().map_or(batch, std::slice::from_ref);
        let messages: Vec<_> = batch.iter().flat_map(|r| self.messages(r).collect::<Vec<_>>()).collect();
        let sent = self.session.send(messages);
        match &sent {
            Ok(_) => self.stuck = None,
            Err(_) if self.session.was_shut() => self.stuck = Some((first.seq, tries.saturating_add(1))),
            Err(_) => {}
        }
        sent
    }

    fn idle(&mut self) {
        if self.session.is_open() || Instant::now() >= self.next {
            // A broker that is away is told as soon as there is something for it.
            let _ = self.session.attend();
            self.next = Instant::now() + PAUSE;
        }
    }
}

impl Drop for Mqtt {
    fn drop(&mut self) {
        self.session.say_goodbye();
    }
}
