//! The two kinds and their keys.

use super::connect::{SerialPeer, TcpPeer, characters, gap};
use super::plan::{Range, group};
use super::point::{Place, Table, check_points, point};
use super::session::Session;
use crate::driver::{Driver, DriverConfig, DriverKind, Problem};
use latchwork_image::parse_duration;
use latchwork_schema::{Key, Kind, Section, Values};
use std::time::Duration;
use tokio_serial::{Parity, StopBits};

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;
const HOUR: u64 = 3_600 * SECOND;
/// Port of Modbus TCP when an address names none.
const PORT: u16 = 502;

/// Modbus TCP.
pub(crate) static TCP: DriverKind = DriverKind {
    name: "modbus-tcp",
    keys: &TCP_SECTION,
    point_keys: &POINT_SECTION,
    point,
    check: check_tcp,
    build: build_tcp,
    direct: None,
};

/// Modbus RTU over a serial line.
pub(crate) static RTU: DriverKind = DriverKind {
    name: "modbus-rtu",
    keys: &RTU_SECTION,
    point_keys: &POINT_SECTION,
    point,
    check: check_rtu,
    build: build_rtu,
    direct: None,
};

static TCP_SECTION: Section = Section {
    name: "driver (modbus-tcp)",
    doc: "A Modbus TCP device. All points are read every `every`; changed outputs are written.",
    keys: &[
        Key::required(
            "address",
            Kind::Text,
            "Host name or IP address and port, as in \"192.168.0.10:502\"; without a port 502 is meant.",
        ),
        Key::optional(
            "unit",
            Kind::Integer { min: 0, max: 255 },
            "1",
            "Unit identifier; many devices ignore it, behind a gateway it chooses the device.",
        ),
        EVERY,
        TIMEOUT,
        REFRESH,
        RECONNECT_MIN,
        RECONNECT_MAX,
    ],
};

static RTU_SECTION: Section = Section {
    name: "driver (modbus-rtu)",
    doc: "A Modbus RTU device on a serial line, 8 data bits. One driver per line.",
    keys: &[
        Key::required("device", Kind::Text, "The serial port, as in \"/dev/ttyUSB0\"."),
        Key::optional("baud", Kind::Integer { min: 300, max: 4_000_000 }, "19200", "Speed of the line, bit/s."),
        Key::optional("parity", Kind::OneOf(&["even", "odd", "none"]), "\"even\"", "Parity of the line."),
        Key::optional(
            "stop-bits",
            Kind::Integer { min: 1, max: 2 },
            "",
            "Stop bits. Without it as the standard says: 1 with parity, 2 without.",
        ),
        Key::optional("unit", Kind::Integer { min: 1, max: 247 }, "1", "Address of the device on the line."),
        EVERY,
        TIMEOUT,
        REFRESH,
        RECONNECT_MIN,
        RECONNECT_MAX,
    ],
};

const EVERY: Key = Key::optional(
    "every",
    Kind::Duration { min: MS, max: HOUR },
    "\"100ms\"",
    "Period of the cycle: read everything, then write what has changed. A cycle that takes longer leaves out the next.",
);
const TIMEOUT: Key = Key::optional(
    "timeout",
    Kind::Duration { min: MS, max: 60 * SECOND },
    "\"500ms\"",
    "Longest time from sending a request to the end of its answer, and for connecting. After that the peer counts as lost.",
);
const REFRESH: Key = Key::optional(
    "refresh",
    Kind::Duration { min: 10 * MS, max: HOUR },
    "\"1s\"",
    "Every output is written at least this often even when it does not change, so a device that restarted gets it again.",
);
const RECONNECT_MIN: Key = Key::optional(
    "reconnect-min",
    Kind::Duration { min: 10 * MS, max: HOUR },
    "\"250ms\"",
    "Pause before the first try to reach a lost peer again; it doubles with each try.",
);
const RECONNECT_MAX: Key = Key::optional(
    "reconnect-max",
    Kind::Duration { min: 10 * MS, max: HOUR },
    "\"5s\"",
    "Longest pause between two tries. A link that has held this long begins again with the shortest.",
);

static POINT_SECTION: Section = Section {
    name: "point (modbus)",
    doc: "One value of the device. Exactly one of the four tables must be named, with the address as it goes over the \
          wire: 0 is what many manuals number 1, 10001, 30001 or 40001.",
    keys: &[
        Key::optional("discrete-input", ADDRESS, "", "Address of a bit that can only be read."),
        Key::optional("coil", ADDRESS, "", "Address of a bit that can be read or, with `from`, written."),
        Key::optional("input-register", ADDRESS, "", "Address of the first 16-bit register, read only."),
        Key::optional(
            "holding-register",
            ADDRESS,
            "",
            "Address of the first 16-bit register that can be read or, with `from`, written.",
        ),
        Key::optional(
            "type",
            Kind::OneOf(&["bool", "u16", "s16", "u32", "s32", "f32", "f64"]),
            "",
            "Type of the value. Bits are bool; registers are u16 without it; u32, s32 and f32 take two registers, f64 four. \
             A bool in a register is true when the register is not 0, and is written as 1.",
        ),
        Key::optional(
            "words",
            Kind::OneOf(&["big", "little"]),
            "\"big\"",
            "Order of the registers of one value: \"big\" has the most significant one at the lowest address.",
        ),
        Key::optional(
            "bit",
            Kind::Integer { min: 0, max: 15 },
            "",
            "This bit of the register (0 is the least significant) as a bool; only for reading.",
        ),
        Key::optional(
            "real",
            Kind::Bool,
            "false",
            "The tag is an f64, whatever number the registers hold: for blocks that take reals, with the quality of the reading. \
             What is written is rounded and kept within the range of `type`; NaN is 0 there.",
        ),
    ],
};

const ADDRESS: Kind = Kind::Integer { min: 0, max: 65535 };

/// Keys both kinds have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub(super) every: Duration,
    pub(super) timeout: Duration,
    pub(super) refresh: Duration,
    pub(super) reconnect_min: Duration,
    pub(super) reconnect_max: Duration,
}

impl Timing {
    fn of(values: &Values) -> Self {
        Self {
            every: duration(values, &EVERY),
            timeout: duration(values, &TIMEOUT),
            refresh: duration(values, &REFRESH),
            reconnect_min: duration(values, &RECONNECT_MIN),
            reconnect_max: duration(values, &RECONNECT_MAX),
        }
    }
}

fn duration(values: &Values, key: &Key) -> Duration {
    let default = || parse_duration(key.default.trim_matches('"')).unwrap_or_default();
    Duration::from_nanos(values.duration(key.name).unwrap_or_else(default))
}

fn integer(values: &Values, section: &Section, name: &str) -> i64 {
    let default = || section.keys.iter().find(|k| k.name == name).and_then(|k| k.default.parse().ok());
    values.integer(name).or_else(default).unwrap_or_default()
}

fn check_tcp(config: &DriverConfig) -> Vec<Problem> {
    let mut problems = check_common(config);
    let address = config.values.text("address").unwrap_or_default();
    if config.values.has("address") && with_port(address).is_none() {
        problems.push(Problem {
            point: None,
            key: "address".into(),
            message: format!("\"{address}\" is no address of a device"),
            help: Some("write a host and a port 1 to 65535, as in \"192.168.0.10:502\" or \"[::1]:502\"".into()),
        });
    }
    problems
}

fn check_rtu(config: &DriverConfig) -> Vec<Problem> {
    let mut problems = check_common(config);
    if config.values.text("device").is_some_and(str::is_empty) {
        problems.push(Problem {
            point: None,
            key: "device".into(),
            message: "the serial port has no name".into(),
            help: Some("name it, as in \"/dev/ttyUSB0\"; `ls /dev/serial/by-id` shows names that stay".into()),
        });
    }
    let baud = integer(&config.values, &RTU_SECTION, "baud") as u32;
    let timeout = Timing::of(&config.values).timeout;
    if let Some((range, time)) = longest(config, baud).filter(|(_, time)| *time >= timeout) {
        problems.push(Problem {
            point: None,
            key: TIMEOUT.name.into(),
            message: format!(
                "reading {range} takes {} ms on the line at {baud} baud, longer than the timeout of {timeout:?}",
                time.as_millis()
            ),
            help: Some("raise `timeout`, best to twice that time or more, or the line's speed".into()),
        });
    }
    problems
}

/// The request for reading that keeps the line busy longest, and how long.
fn longest(config: &DriverConfig, baud: u32) -> Option<(String, Duration)> {
    let inputs = config.points.iter().filter(|p| p.safe.is_none());
    let places = inputs.filter_map(|p| Place::of(&p.values).ok()).enumerate();
    let time = |r: &Range| {
        let data = if r.table.is_bits() { u32::from(r.count).div_ceil(8) } else { 2 * u32::from(r.count) };
        // 8 bytes of question, 5 around the data of the answer, and the silence before it.
        characters(8 + 5 + data, baud) + gap(baud)
    };
    group(places, Table::most_read).iter().map(|r| (r.name(), time(r))).max_by_key(|(_, time)| *time)
}

fn check_common(config: &DriverConfig) -> Vec<Problem> {
    let mut problems = check_points(config);
    let timing = Timing::of(&config.values);
    if timing.reconnect_min > timing.reconnect_max {
        let key = if config.values.has("reconnect-min") { RECONNECT_MIN.name } else { RECONNECT_MAX.name };
        problems.push(Problem {
            point: None,
            key: key.into(),
            message: format!(
                "the shortest pause {:?} is longer than the longest, {:?}",
                timing.reconnect_min, timing.reconnect_max
            ),
            help: Some("raise `reconnect-max` or lower `reconnect-min`".into()),
        });
    }
    problems
}

/// The address with its port; `None` when it is none.
fn with_port(address: &str) -> Option<String> {
    let bare_v6 = address.parse::<std::net::Ipv6Addr>().is_ok();
    let (host, port) = match address.rsplit_once(':') {
        _ if bare_v6 => return Some(format!("[{address}]:{PORT}")),
        Some((host, port)) if !host.starts_with('[') || host.ends_with(']') => (host, port.parse().ok()?),
        _ => (address, PORT),
    };
    let is_v6 = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
    let good = match is_v6 {
        Some(inside) => inside.parse::<std::net::Ipv6Addr>().is_ok(),
        None => !host.is_empty() && !host.contains(|c: char| c.is_whitespace() || "/:[]@".contains(c)),
    };
    (good && port != 0).then(|| format!("{host}:{port}"))
}

fn build_tcp(config: DriverConfig) -> Result<Box<dyn Driver>, String> {
    let values = &config.values;
    let address = values.text("address").and_then(with_port).ok_or("the address is missing or wrong")?;
    let peer = TcpPeer { address, unit: integer(values, &TCP_SECTION, "unit") as u8 };
    Ok(Box::new(Session::new(&config, Timing::of(values), peer)?))
}

fn build_rtu(config: DriverConfig) -> Result<Box<dyn Driver>, String> {
    let values = &config.values;
    let parity = match values.text("parity") {
        Some("none") => Parity::None,
        Some("odd") => Parity::Odd,
        _ => Parity::Even,
    };
    let stop_bits = match (values.integer("stop-bits"), parity) {
        (Some(2), _) | (None, Parity::None) => StopBits::Two,
        _ => StopBits::One,
    };
    let peer = SerialPeer {
        device: values.text("device").ok_or("the serial port is missing")?.to_owned(),
        baud: integer(values, &RTU_SECTION, "baud") as u32,
        parity,
        stop_bits,
        unit: integer(values, &RTU_SECTION, "unit") as u8,
    };
    Ok(Box::new(Session::new(&config, Timing::of(values), peer)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses() {
        for (address, full) in [
            ("127.0.0.1:5020", Some("127.0.0.1:5020")),
            ("plc-7.local", Some("plc-7.local:502")),
            ("::1", Some("[::1]:502")),
            ("[::1]", Some("[::1]:502")),
            ("[::1]:5020", Some("[::1]:5020")),
            ("", None),
            (":502", None),
            ("host:", None),
            ("host:0", None),
            ("host:65536", None),
            ("http://host:502", None),
            ("a b:502", None),
            ("[::g]:502", None),
        ] {
            assert_eq!(with_port(address).as_deref(), full, "{address:?}");
        }
    }

    #[test]
    fn defaults_are_what_the_key_table_says() {
        let timing = Timing::of(&Values::default());
        assert_eq!(
            (timing.every, timing.timeout, timing.refresh, timing.reconnect_min, timing.reconnect_max),
            (
                Duration::from_millis(100),
                Duration::from_millis(500),
                Duration::from_secs(1),
                Duration::from_millis(250),
                Duration::from_secs(5)
            )
        );
        assert_eq!(integer(&Values::default(), &RTU_SECTION, "baud"), 19200);
    }
}
