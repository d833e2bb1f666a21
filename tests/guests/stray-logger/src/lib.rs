//! A logger that misbehaves in every way the host must survive. `config = { does = "…", at = N }` says what it does when
//! record N is in a batch (0: in `open`); everything else it takes and forgets.

use exports::latchwork::journal::sink::Guest;
use latchwork::journal::types::Entry;
use std::io::{Error, Read};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::Mutex;

// What the macro writes has no comments; the WIT has them.
#[allow(
    missing_docs,
    unreachable_pub,
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    reason = "generated from wit/journal"
)]
mod generated {
    wit_bindgen::generate!({ path: "../../../wit/journal", world: "logger" });
}
use generated::{exports, latchwork};

static CONFIG: Mutex<serde_json::Value> = Mutex::new(serde_json::Value::Null);

struct Stray;

impl Guest for Stray {
    fn open(config: String) -> Result<(), String> {
        let config: serde_json::Value = serde_json::from_str(&config).map_err(|e| e.to_string())?;
        *CONFIG.lock().unwrap() = config["config"].clone();
        if CONFIG.lock().unwrap()["at"] == 0 { act().map(drop) } else { Ok(()) }
    }

    fn write(batch: Vec<Entry>) -> Result<u64, String> {
        let last = batch.last().map_or(0, |e| e.seq);
        let at = CONFIG.lock().unwrap()["at"].as_u64().unwrap_or(u64::MAX);
        if batch.iter().any(|e| e.seq == at) { act().map(|claim| claim.unwrap_or(last)) } else { Ok(last) }
    }
}

// The names of the exports are none that a native linker takes.
#[cfg(target_arch = "wasm32")]
generated::export!(Stray with_types_in generated);

/// Does it; a number to claim, if it lies.
fn act() -> Result<Option<u64>, String> {
    let config = CONFIG.lock().unwrap().clone();
    let text = |key: &str| config[key].as_str().unwrap_or_default().to_owned();
    let told = |e: Error| format!("{:?}", e.kind());
    match &*text("does") {
        "panic" => panic!("tired of it"),
        "hang" => loop {
            std::hint::spin_loop();
        },
        "sleep" => std::thread::sleep(std::time::Duration::from_secs(3600)),
        "eat" => {
            let mut eaten = Vec::new();
            loop {
                eaten.push(vec![1u8; 1 << 20]);
            }
        }
        "recurse" => return Ok(Some(recurse(config["at"].as_u64().unwrap_or(1)))),
        "exit" => std::process::exit(3),
        "refuse" => return Err("I do not like this one\nat all".into()),
        "lie" => return Ok(Some(config["claim"].as_u64().unwrap_or(u64::MAX))),
        "read" => return Err(std::fs::read_to_string(text("path")).map_err(told)?),
        "write" => std::fs::write(text("path"), "mine").map_err(told)?,
        "connect" => return TcpStream::connect(text("to")).map(|_| None).map_err(told),
        "wait" => {
            let mut stream = TcpStream::connect(text("to")).map_err(told)?;
            let mut all = Vec::new();
            stream.read_to_end(&mut all).map_err(told)?;
        }
        "listen" => return TcpListener::bind("127.0.0.1:0").map(|_| None).map_err(told),
        "datagram" => return UdpSocket::bind("127.0.0.1:0").map(|_| None).map_err(told),
        "look-up" => return TcpStream::connect("localhost:5140").map(|_| None).map_err(told),
        "files" => {
            let mut open = Vec::new();
            loop {
                match std::fs::File::create(format!("/data/{}", open.len())) {
                    Ok(file) => open.push(file),
                    Err(e) => return Err(format!("{} files: {:?}", open.len(), e.kind())),
                }
            }
        }
        "environment" => {
            let seen: Vec<String> = std::env::vars().map(|(k, _)| k).chain(std::env::args()).collect();
            return Err(format!("{seen:?}"));
        }
        other => return Err(format!("no such act: {other}")),
    }
    Ok(None)
}

#[allow(unconditional_recursion, reason = "that is the point")]
fn recurse(n: u64) -> u64 {
    std::hint::black_box(recurse(std::hint::black_box(n + 1))) + n
}
