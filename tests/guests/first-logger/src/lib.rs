use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::sync::Mutex;

wit_bindgen::generate!({ path: "wit", world: "logger" });
use exports::latchwork::journal::sink::Guest;
use latchwork::journal::types::Entry;

struct State {
    file: File,
    last: u64,
}

static STATE: Mutex<Option<State>> = Mutex::new(None);

struct MyLogger;
#[cfg(target_arch = "wasm32")] // so that `cargo test` can build it natively, too
export!(MyLogger);

impl Guest for MyLogger {
    fn open(_config: String) -> Result<(), String> {
        let state = find_place().map_err(|e| format!("/data/records.txt: {e}; grant a `directory`"))?;
        *STATE.lock().unwrap() = Some(state);
        Ok(())
    }

    fn write(batch: Vec<Entry>) -> Result<u64, String> {
        let mut state = STATE.lock().unwrap();
        let State { file, last } = state.as_mut().ok_or("not open")?;
        let mut lines = String::new();
        for entry in batch.iter().filter(|e| e.seq > *last) {
            lines += &format!("{} {} {}\n", entry.seq, entry.source, entry.transition);
        }
        file.write_all(lines.as_bytes()).and_then(|()| file.sync_data()).map_err(|e| e.to_string())?;
        let kept = batch.last().map_or(0, |e| e.seq);
        *last = kept.max(*last);
        Ok(kept)
    }
}

/// The number in the last whole line; what a kill left after it is cut off.
fn find_place() -> std::io::Result<State> {
    let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open("/data/records.txt")?;
    let mut text = String::new();
    file.read_to_string(&mut text)?;
    let whole = text.rfind('\n').map_or(0, |at| at + 1);
    file.set_len(whole as u64)?;
    file.seek(SeekFrom::Start(whole as u64))?;
    let number = text[..whole].lines().last().and_then(|line| line.split(' ').next()?.parse().ok());
    Ok(State { file, last: number.unwrap_or(0) })
}
