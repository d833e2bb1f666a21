//! One mistake in the test file of a plant is one message: where it is, what was found, what was expected, the way out.

use super::support::{Folder, PLANT};

/// Every text with its messages.
fn messages(folder: &Folder, texts: &[String]) -> String {
    let mut out = String::new();
    for text in texts {
        let checked = folder.check(text);
        assert!(checked.tests.is_none(), "nothing is wrong with\n{text}");
        out += &format!("{text}\n~~~\n{}\n\n========\n\n", folder.shown(&checked));
    }
    out
}

fn of(lines: &[&str]) -> Vec<String> {
    lines.iter().map(|line| format!("plant = \"plant.toml\"\n{line}")).collect()
}

fn steps(lines: &[&str]) -> Vec<String> {
    lines.iter().map(|line| format!("plant = \"plant.toml\"\n[[case]]\nname = \"c\"\n[[case.step]]\n{line}")).collect()
}

#[test]
fn of_the_file_and_its_plant() {
    const CASE: &str = "[[case]]\nname = \"c\"\nstep = [{}]";
    let folder = Folder::new(PLANT)
        .with("broken.toml", b"[plant]\nname = \"x\"\n[lane.main]\nevry = \"10ms\"\n[block.a]\ncomponent = \"tonn\"\n")
        .with("syntax.toml", b"[plant\n");
    let mut texts: Vec<String> = [
        "plnat = \"plant.toml\"",
        "plant = 1",
        "plant = \"nowhere.toml\"",
        "plant = \"broken.toml\"",
        "plant = \"syntax.toml\"",
        "plant = \"plant.toml\"\ncomponent = \"ton\"",
        "plant = \"plant.toml\"\nsim = false",
        "plant = \"plant.toml\"\nevery = \"10ms\"",
        "plant = \"plant.toml\"\ntolerance = -1",
        "plant = \"plant.toml\"\ninputs = { field.lamp = true }",
        "plant = \"plant.toml\"\nsettings = { unit.settings.puls = \"1s\" }",
    ]
    .iter()
    .map(|head| format!("{head}\n{CASE}"))
    .collect();
    texts.extend(of(&[
        "",
        "case = 1",
        "[[case]]\nstep = [{}]",
        "[[case]]\nname = \"c\"",
        "[[case]]\nname = \"c\"\nevery = \"1s\"\nstep = [{}]",
        "[[case]]\nname = \"c\"\nstep = [{}]\n[[case]]\nname = \"c\"\nstep = [{}]",
        "[[case]]\nname = \"c\"\nstep = [{ at = \"20ms\" }, { at = \"10ms\" }]",
        "[[case]]\nname = \"c\"\nstep = [{ at = \"1000000h\" }]",
    ]));
    insta::assert_snapshot!("file", messages(&folder, &texts));
}

#[test]
fn of_steps() {
    let texts = steps(&[
        "at = 10",
        "input = { field.door = true }",
        "inputs = { field.dor = true }",
        "inputs = { field = true }",
        "inputs = { field.door = 1 }",
        "inputs = { field.door = { value = true, quality = \"broken\" } }",
        "inputs = { field.door = { value = 1, quality = \"bad\" } }",
        "inputs = { field.door = { value = true, within = 1 } }",
        "inputs = { field.level = { quality = \"bad\" } }",
        "inputs = { field.level = 1 }",
        "inputs = { unit.outputs.lamp = true }",
        "settings = { field.door = true }",
        "settings = { unit.settings.pulse = 20 }",
        "settings = { unit.settings.pulse = { value = \"20ms\", quality = \"bad\" } }",
        "commands = [\"acknowledge\"]",
        "commands = [\"unit.commands.acknowlege\"]",
        "commands = { unit.commands.acknowledge = 1 }",
        "commands = true",
        "force = { field.dor = true }",
        "force = { field.door = { value = true, quality = \"bad\" } }",
        "unforce = [\"field.dor\"]",
        "ack = [\"unit.alarms.doors\"]",
        "ack = \"unit.alarms.door\"",
        "shelve = { unit.alarms.door = 10 }",
        "shelve = [\"unit.alarms.door\"]",
        "restart = 1",
        "swap = { lat = \"ton\" }",
        "swap = { late = \"tonn\" }",
        "swap = { late = \"tof.wasm\" }",
        "swap = { late = 1 }",
        "swap = { late = \"tof\" }",
        "allow-lossy = true",
        "probation = 5",
        "expect = true",
        "expect = { output = {} }",
        "expect = { outputs = { unit.outputs.lmap = true } }",
        "expect = { outputs = { unit.outputs.lamp = 1 } }",
        "expect = { outputs = { unit.outputs = true } }",
        "expect = { outputs = { unit.outputs.lamp = {} } }",
        "expect = { outputs = { unit.outputs.lamp = { value = true, within = 1 } } }",
        "expect = { alarms = [\"door\"] }",
        "expect = { alarms = { unit.alarms.door = \"on\" } }",
        "expect = { alarms = 1 }",
        "expect = { records = [\"unit.alarms.door\"] }",
        "expect = { refused = \"x\" }",
        "expect = { faults = [\"main\"] }",
    ]);
    insta::assert_snapshot!("steps", messages(&Folder::new(PLANT), &texts));
}

#[test]
fn of_tables() {
    let tables = [
        "table = \"nowhere.csv\"",
        "table = \"odd.csv\"",
        "[[case.table]]\ncolumns = [\"field.door\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"input.field.door\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"inputs.field.dor\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"inputs.field.level\"]\nrows = [[1]]",
        "[[case.table]]\ncolumns = [\"inputs.field.door.quality\"]\nrows = [[\"broken\"], [true]]",
        "[[case.table]]\ncolumns = [\"inputs.field.dor.quality\"]\nrows = [[\"bad\"]]",
        "[[case.table]]\ncolumns = [\"inputs.field.level.quality\"]\nrows = [[\"bad\"]]",
        "[[case.table]]\ncolumns = [\"settings.unit.settings.pulse.quality\"]\nrows = [[\"bad\"]]",
        "[[case.table]]\ncolumns = [\"settings.field.door\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"outputs.unit.outputs.lamp.quality\"]\nrows = [[\"fine\"]]",
        "[[case.table]]\ncolumns = [\"inputs.field.door\", \"outputs.unit.outputs.lamp\"]\nrows = [[1, 2]]",
        "[[case.table]]\ncolumns = [\"commands\", \"alarms\"]\nrows = [[\"acknowledge\", \"unit.alarms.dor\"], [{}, 1]]",
        "[[case.table]]\ncolumns = [\"at\", \"inputs.field.door\"]\nrows = [[\"0ms\"]]",
    ];
    let lines: Vec<_> = tables.iter().map(|t| format!("[[case]]\nname = \"c\"\n{t}")).collect();
    let texts = of(&lines.iter().map(String::as_str).collect::<Vec<_>>());
    let odd = "at,inputs.field.door,outputs.unit.outputs.value,commands,alarms,outputs.unit.outputs.value.quality\n\
               10,perhaps,much,stop,fire,fine\n";
    insta::assert_snapshot!("tables", messages(&Folder::new(PLANT).with("odd.csv", odd.as_bytes()), &texts));
}

#[test]
fn all_at_once_in_the_order_of_the_file_and_as_json() {
    let text = "plant = \"plant.toml\"\nevry = 1\n[[case]]\nname = \"c\"\nstep = [{ inputs = { field.dor = true }, ack = [\"x\"] }]\n";
    let folder = Folder::new(PLANT);
    let checked = folder.check(text);
    let lines = checked.json().as_array().expect("a list").iter().map(|f| f["line"].clone()).collect::<Vec<_>>();
    assert_eq!(lines, [2, 5, 5]);
    insta::assert_snapshot!("at-once", folder.shown(&checked));
}
