//! What is no new version of a block leaves the old one as it is.

use crate::support::{start, target};
use crate::{row, text, version};
use std::path::PathBuf;
use std::process::Stdio;

#[test]
fn what_is_no_component_too_large_or_of_another_class_is_refused_and_nothing_is_touched() {
    let plant = start("");
    let folder = plant.folder.path();
    let file = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("a file");
        folder.join(name)
    };
    let large = file("large.wasm", b"");
    std::fs::File::options().write(true).open(&large).expect("it").set_len(100 << 20).expect("a length");
    let shipped = |name: &str| target().join("components").join(format!("{name}.wasm"));
    let mut cut = std::fs::read(shipped("alarm-unit")).expect("a component");
    cut.truncate(cut.len() / 2);
    let cases: [(PathBuf, &str); 7] = [
        (file("text.wasm", b"no component"), "text.wasm"),
        (file("empty.wasm", b""), "empty.wasm"),
        (file("module.wasm", b"\0asm\x01\0\0\0"), "module.wasm"),
        (file("cut.wasm", &cut), "cut.wasm"),
        (large, "large.wasm is too large"),
        (shipped("ton"), "change of class"),
        (folder.join("missing.wasm"), "cannot be read"),
    ];
    let before = row(&plant, "unit");
    for (path, says) in cases {
        let errors = plant.refuses(&["swap", "unit", text(&path), "--yes"]);
        assert!(errors.contains(says), "{}: {errors}", path.display());
    }
    let new = version(folder, "alarm-unit", "unit-2");
    assert!(plant.refuses(&["swap", "uint", text(&new), "--yes"]).contains("did you mean `unit`?"));
    let setting = ["swap", "unit", text(&new), "--yes", "--set", "unit.settings.puls=1s"];
    assert!(plant.refuses(&setting).contains("no setting `puls`"));
    assert_eq!(row(&plant, "unit"), before);
    // All or none.
    let [alarm, ton] = ["digital-alarm", "ton"].map(shipped);
    let both = ["swap", "fire", text(&alarm), "unit", text(&ton), "--yes"];
    assert!(plant.refuses(&both).contains("change of class"));
    assert_eq!(row(&plant, "fire")["versions"], 0);
}

#[test]
fn of_two_swaps_of_a_block_at_once_one_is_done_and_the_other_one_refused() {
    let plant = start("");
    let new = version(plant.folder.path(), "alarm-unit", "unit-2");
    let args = ["swap", "unit", text(&new), "--yes", "--probation", "300"];
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let both = [0, 1].map(|_| {
        let mut command = plant.command(program, &args);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    });
    let ends = both.map(|child| child.wait_with_output().expect("it ends"));
    let mut codes: Vec<_> = ends.iter().map(|e| e.status.code()).collect();
    codes.sort_unstable();
    assert_eq!(codes, [Some(0), Some(1)], "{ends:?}");
    let errors: String = ends.iter().map(|e| String::from_utf8_lossy(&e.stderr).into_owned()).collect();
    assert!(errors.contains("of the same block") || errors.contains("sending a component already"), "{errors}");
    assert_eq!(row(&plant, "unit")["versions"], 1);
}
