//! SIGKILL in the middle of swaps and saves: the next start runs the old version or the new one, never half of either.

use crate::support::start;
use crate::{row, text, version};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Kills.
const KILLS: u64 = 24;
/// Time for them: a slow machine makes fewer.
const TIME: Duration = Duration::from_secs(60);
/// Latest kill after the order: by then the swap is over where nothing else runs.
const LATEST: u64 = 400;

#[test]
fn a_kill_at_any_moment_of_a_swap_and_its_save_leaves_the_old_version_or_the_new() {
    let mut plant = start("");
    let folder = plant.folder.path().to_owned();
    let file = folder.join("plant.toml");
    let read = || std::fs::read_to_string(&file).expect("the plant file");
    std::fs::write(&file, read().replace("components = [", "components = [\"own\", ")).expect("the plant file");
    plant.again();
    let (begin, mut saved, mut kept) = (Instant::now(), 0, 0);
    for n in 0..KILLS {
        let before = read();
        let old = row(&plant, "unit")["component"].as_str().expect("a name").to_owned();
        let name = format!("unit-{n}");
        let new = version(&folder, "alarm-unit", &name);
        let save = n % 3 != 2;
        let args = ["swap", "unit", text(&new), "--yes", "--probation", "3", "--save"];
        let args = if save { &args[..] } else { &args[..6] };
        let program = std::path::Path::new(env!("CARGO_BIN_EXE_latchwork"));
        let mut swap = plant.command(program, args);
        let mut swap = swap.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        // Moments that are spread over the whole way, the same in every run.
        std::thread::sleep(Duration::from_millis(n * 97 % LATEST));
        plant.again();
        swap.wait().expect("it ends");
        let (after, row) = (read(), row(&plant, "unit"));
        let of_new = before.replace(&format!("component = \"{old}\""), &format!("component = \"{name}\""));
        let is_new = after == of_new;
        assert!(is_new && save || after == before, "{n}: {after}");
        assert_eq!(row["component"], if is_new { name.as_str() } else { old.as_str() }, "{n}");
        assert_eq!(row["differs"], false, "{n}");
        if is_new {
            saved += 1
        } else {
            kept += 1
        }
        if begin.elapsed() > TIME {
            break;
        }
    }
    eprintln!("{saved} saved, {kept} as before");
    assert!(kept > 0, "no kill came early");
}
