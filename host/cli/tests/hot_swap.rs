//! `examples/hot-swap/run.sh` goes as its README says, with this build of `latchwork`.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The script waits for executions at the machine's clock: some ten seconds of them.
const LONGEST: Duration = Duration::from_secs(180);

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

#[test]
fn the_example_of_a_hot_swap_does_what_it_says() {
    let blocks = target().join("example-components");
    assert!(blocks.is_dir(), "{} is missing: run `cargo xtask guests` first", blocks.display());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/hot-swap/run.sh");
    let out = tempfile::NamedTempFile::new().expect("a file for the output");
    let mut child = Command::new("bash")
        .arg(script)
        .arg(env!("CARGO_BIN_EXE_latchwork"))
        .arg(&blocks)
        .env("XDG_CACHE_HOME", target().join("test-cache"))
        .env("NO_COLOR", "1")
        .env_remove("LATCHWORK_CACHE")
        .stdin(Stdio::null())
        .stdout(out.reopen().expect("the file"))
        .stderr(out.reopen().expect("the file"))
        .spawn()
        .expect("bash starts");
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            break Some(status);
        }
        if begun.elapsed() > LONGEST {
            // It ends its plant itself when it is asked to.
            let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
            let _ = child.wait();
            break None;
        }
        std::thread::sleep(Duration::from_millis(100));
    };
    let said = std::fs::read_to_string(out.path()).expect("its output");
    assert!(status.is_some_and(|s| s.success()), "{status:?}\n{said}");
    // The block in C wants a compiler that not every machine has; the script passes over it and says so.
    if let Some(why) = said.lines().find_map(|l| l.strip_prefix("SKIPPED: ")) {
        assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
        println!("{why}");
    }
    assert!(said.ends_with("everything went as it should\n"), "{said}");
}
