//! Alarms to another program: one connection per batch, a JSON line per record. The batch has arrived when the other side has read
//! it to the end and closes; a line may come twice, and is never lost without a word.

use jiff::Timestamp;
use serde::Serialize;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};

/// A record, as all of Latchwork writes it in JSON.
#[derive(Serialize)]
pub(crate) struct Line<'a> {
    pub(crate) seq: u64,
    pub(crate) time: String,
    pub(crate) kind: &'static str,
    pub(crate) source: &'a str,
    pub(crate) transition: &'a str,
    pub(crate) previous: serde_json::Value,
    pub(crate) current: serde_json::Value,
    pub(crate) priority: u8,
    pub(crate) user: &'a str,
    pub(crate) text: &'a str,
}

/// ns since 1970 as RFC 3339 with nine decimals.
pub(crate) fn time(ns: u64) -> String {
    // 64 bits of nanoseconds end in the year 2554, long before this type does.
    format!("{:.9}", Timestamp::from_nanosecond(ns.into()).unwrap_or(Timestamp::UNIX_EPOCH))
}

/// Sends lines and waits until the other side has them all.
pub(crate) fn send(to: SocketAddr, lines: &[Line<'_>]) -> Result<(), String> {
    let mut bytes = Vec::with_capacity(lines.len() * 256);
    for line in lines {
        serde_json::to_writer(&mut bytes, line).map_err(|e| format!("no JSON: {e}"))?;
        bytes.push(b'\n');
    }
    let sent = || {
        let mut stream = TcpStream::connect(to)?;
        stream.write_all(&bytes)?;
        stream.shutdown(Shutdown::Write)?;
        let mut answer = [0; 512];
        loop {
            match stream.read(&mut answer) {
                // Closed on the other side, too, with nothing left unread: that would have been a reset.
                Ok(0) => return Ok(()),
                Ok(_) => {}
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    };
    sent().map_err(|e: std::io::Error| format!("{to} does not take the alarms: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    fn one_line() -> [Line<'static>; 1] {
        let (previous, current) = (false.into(), true.into());
        [Line {
            seq: 1,
            time: time(1_250_000_000),
            kind: "alarm",
            source: "unit.alarms.high",
            transition: "raised",
            previous,
            current,
            priority: 100,
            user: "",
            text: "level \"high\"",
        }]
    }

    #[test]
    fn lines_arrive_and_the_end_is_waited_for() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let to = listener.local_addr().unwrap();
        let reader = std::thread::spawn(move || {
            let mut text = String::new();
            listener.accept().unwrap().0.read_to_string(&mut text).unwrap();
            text
        });
        send(to, &one_line()).unwrap();
        let expected = concat!(
            r#"{"seq":1,"time":"1970-01-01T00:00:01.250000000Z","kind":"alarm","source":"unit.alarms.high","#,
            r#""transition":"raised","previous":false,"current":true,"priority":100,"user":"","text":"level \"high\""}"#,
            "\n"
        );
        assert_eq!(reader.join().unwrap(), expected);
    }

    #[test]
    fn nobody_there_is_told() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let to = listener.local_addr().unwrap();
        drop(listener);
        let error = send(to, &one_line()).unwrap_err();
        assert!(error.starts_with(&format!("{to} does not take the alarms: ")), "{error}");
    }
}
