//! What a step does to the plant, and how a failure is told.

use super::support::{Folder, PLANT};
use latchwork_plantbed::check_text;
use latchwork_testbed::case::Options;
use latchwork_tests_plant::{component_folders, engine};
use std::path::Path;

#[test]
fn inputs_are_there_for_every_scan_of_their_time_and_keep_their_values() {
    Folder::new(PLANT).passes(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "in the same scan, whichever lane"
        inputs = { field.open = true }
        step = [
            { at = "0ms", expect = { outputs = { count.outputs.cv = 1, late.outputs.et = "0s", lane.main.scans = 1, lane.slow.scans = 1 } } },
            { at = "200ms", expect = { outputs = { late.outputs.q = true, lane.main.scans = 21, lane.slow.scans = 3 } } },
            { at = "205ms", inputs = { field.open = false }, expect = { outputs = { field.open = false, late.outputs.q = true, lane.main.scans = 21 } } },
            { at = "290ms", expect = { outputs = { late.outputs.q = true } } },
            { at = "300ms", expect = { outputs = { late.outputs.q = false } } },
        ]
        [[case]]
        name = "without a time a step is the next scan of the first lane"
        step = [
            {},
            { inputs = { "field.open" = true }, expect = { outputs = { count.outputs.cv = 1, lane.main.scans = 2 } } },
            { inputs = { field = { open = false } }, expect = { outputs = { lane.main.scans = 3 } } },
        ]
        "#,
    );
}

#[test]
fn an_operator_s_wishes_are_those_of_a_running_plant() {
    Folder::new(PLANT).passes(
        r#"
        plant = "plant.toml"
        settings = { unit.settings.pulse = "10ms" }
        [[case]]
        name = "commands, acknowledgements and resets"
        step = [
            { at = "0ms", inputs = { field.door = true }, expect = { outputs = { unit.settings.pulse = "10ms", unit.outputs.violation = true }, alarms = { unit.alarms.door = "unacknowledged" }, records = ["unit.alarms.door raised"] } },
            { at = "100ms", commands = ["unit.commands.acknowledge"], expect = { outputs = { unit.outputs.violation = false }, records = ["unit.commands.acknowledge given"] } },
            { at = "110ms", ack = ["unit.alarms.*"], expect = { alarms = { unit.alarms.door = "active" } } },
            { at = "120ms", inputs = { field.door = false }, expect = { alarms = { unit.alarms.door = "awaiting-reset" } } },
            { at = "130ms", reset = ["unit.alarms.door"], expect = { alarms = [] } },
        ]
        [[case]]
        name = "forces, and what a model feeds"
        step = [
            { at = "0ms", force = { count.outputs.q = true, field.open = true }, expect = { outputs = { count.outputs.q = true, count.outputs.cv = 1 } } },
            { at = "50ms", unforce = ["count.*", "field.open"] },
            { at = "60ms", expect = { outputs = { count.outputs.q = false, field.open = false } } },
        ]
        [[case]]
        name = "settings are written, or refused as a whole"
        step = [
            { at = "0ms", settings = { unit.settings.low-limit = 90 }, expect = { refused = "low-limit" } },
            { at = "10ms", settings = { unit = { settings = { low-limit = 20, hysteresis = 2 } } }, expect = { outputs = { unit.settings.low-limit = 20, unit.settings.hysteresis = 2 } } },
        ]
        "#,
    );
}

#[test]
fn a_restart_keeps_what_is_retained_and_the_world_outside() {
    Folder::new(PLANT).passes(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "blocks with `retain` go on, others begin anew, time goes on"
        step = [
            { at = "0ms", inputs = { field.open = true, field.door = true }, expect = { outputs = { unit.outputs.violation = true, count.outputs.cv = 1 } } },
            { at = "500ms", expect = { outputs = { late.outputs.q = true } } },
            { at = "1s", restart = true, expect = { outputs = { field.open = true, unit.outputs.violation = true, late.outputs.q = false, late.outputs.et = "0s", lane.main.scans = 1 } } },
            { at = "1s 200ms", expect = { outputs = { late.outputs.q = true }, alarms = ["unit.alarms.door"] } },
        ]
        "#,
    );
}

#[test]
fn tables_in_the_file_and_beside_it() {
    let csv = "at,name,inputs.field.open,outputs.count.outputs.cv,outputs.late.outputs.q.quality,settings.unit.settings.pulse\n\
               0ms,first,true,1,good,\n10ms,,false,1,,20ms\n20ms,,1,2,,\n";
    // As spreadsheets write it: a mark of the encoding, bools in capitals.
    let sheet = "\u{feff}at,inputs.field.open,outputs.count.outputs.cv,outputs.field.open\r\n\
                 0ms,TRUE,1,TRUE\r\n10ms,FALSE,1,FALSE\r\n20ms,TRUE,2,TRUE\r\n";
    Folder::new(PLANT).with("open.csv", csv.as_bytes()).with("sheet.csv", sheet.as_bytes()).passes(
        r#"
        plant = "plant.toml"
        tolerance = 0.5
        [[case]]
        name = "beside it"
        table = "open.csv"
        [[case]]
        name = "of a spreadsheet"
        table = "sheet.csv"
        [[case]]
        name = "in it"
        [[case.table]]
        columns = ["at", "inputs.field.door", "commands", "outputs.unit.outputs.value", "outputs.unit.outputs.violation", "alarms"]
        rows = [
            ["0ms", true, "none", 30.4, true, "unit.alarms.door"],
            ["250ms", "", ["unit.commands.acknowledge"], { value = 31, within = 2, quality = "good" }, false, ["unit.alarms.door"]],
        ]
        "#,
    );
}

/// Faults that nobody expects fail a case, as they would fail a test of the block.
#[test]
fn a_fault_is_expected_or_wrong() {
    let plant = r#"
        [lane.main]
        every = "10ms"
        [block.odd]
        component = "stress"
        lane = "main"
        [block.strict]
        component = "stress"
        lane = "main"
        on-fault = "stop-lane"
    "#;
    let told = Folder::new(plant).told(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "expected"
        step = [
            { at = "0ms", commands = ["odd.commands.trap"], expect = { faults = ["odd"], outputs = { odd.outputs.alive = { quality = "bad" } } } },
            { at = "200ms", expect = { outputs = { odd.outputs.alive = { quality = "good" } } } },
            { at = "300ms", commands = ["strict.commands.trap"], expect = { faults = ["strict", "lane.main"] } },
            { at = "400ms", expect = { outputs = { lane.main.scans = 31 } } },
        ]
        [[case]]
        name = "unexpected, between two steps"
        step = [{ at = "0ms" }, { at = "5ms", commands = ["odd.commands.trap"] }, { at = "20ms" }, { at = "30ms" }]
        [[case]]
        name = "expected of another block"
        step = [{ at = "0ms", commands = ["odd.commands.trap"], expect = { faults = ["strict"] } }]
        [[case]]
        name = "nobody answers any more"
        step = [{ at = "0ms", commands = ["strict.commands.trap"], expect = { faults = ["strict", "lane.main"] } }, { at = "20ms", commands = ["odd.commands.trap"] }]
        "#,
    );
    insta::assert_snapshot!("faults", told);
}

#[test]
fn a_failure_shows_what_the_case_speaks_of_around_it() {
    let told = Folder::new(PLANT).told(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "values, alarms, records"
        step = [
            { at = "0ms", expect = { outputs = { unit.outputs.violation = true, unit.outputs.value = { value = 31, within = 0.5, quality = "bad" } } } },
            { name = "the door opens", at = "50ms", inputs = { field.door = true }, expect = { outputs = { field.lamp = false }, alarms = [], records = ["unit.alarms.door raised", "unit.alarms.high raised"] } },
            { at = "60ms", inputs = { field.door = false }, expect = { alarms = { unit.alarms.door = "normal" } } },
            { at = "80ms", expect = { outputs = { unit.outputs.violation = true } } },
        ]
        [[case]]
        name = "what an operator is told"
        step = [
            { at = "0ms", settings = { unit.settings.low-limit = 90 } },
            { at = "10ms", settings = { unit.settings.low-limit = 80 }, expect = { refused = "because" } },
            { at = "20ms", settings = { unit.settings.low-limit = 9 }, expect = { refused = "low-limit" } },
            { at = "30ms", ack = ["unit.alarms.door"] },
            { at = "35ms", commands = ["unit.commands.acknowledge"], settings = { unit.settings.low-limit = 8 } },
        ]
        [[case]]
        name = "settings that the plant cannot start with"
        settings = { unit.settings.high-limit = 5 }
        step = [{ at = "0ms" }]
        [[case]]
        name = "a swap that was to be refused"
        step = [{ at = "0ms", swap = { late = "ton" }, expect = { refused = "ports" } }, { at = "200ms" }]
        "#,
    );
    insta::assert_snapshot!("failures", told);
}

#[test]
fn whoever_waits_for_a_change_is_told_every_file_that_the_tests_are_made_of() {
    let folder = Folder::new(PLANT).with("open.csv", b"inputs.field.open\ntrue\n");
    let text = "plant = \"plant.toml\"\n[[case]]\nname = \"c\"\nstep = [{ swap = { late = \"ton\" } }]\ntable = \"open.csv\"\n";
    let checked = folder.check(text);
    assert!(checked.tests.is_some(), "{}", checked.render(false));
    for name in ["plant.toml", "open.csv", "components/alarm-unit.wasm", "components/ton.wasm"] {
        assert!(checked.files.iter().any(|f| f.ends_with(name)), "{name} is not among {:?}", checked.files);
    }
    // Also while the plant is not right: whoever builds the component that is missing is waited for.
    let plant = "[lane.main]\nevery = \"10ms\"\n[block.a]\ncomponent = \"to-be-built\"\nlane = \"main\"\n";
    let checked = Folder::new(plant).check("plant = \"plant.toml\"\n[[case]]\nname = \"c\"\nstep = [{}]\n");
    assert!(checked.tests.is_none());
    assert!(checked.files.iter().any(|f| f.ends_with("components/to-be-built.wasm")), "{:?}", checked.files);
}

#[test]
fn what_the_page_on_testing_a_plant_shows_passes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/testing-a-plant.md")).expect("the page");
    let blocks: Vec<_> = page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    let head = "plant = \"plant.toml\"\ninputs = { gpio.door = true, gpio.beam = true, gpio.vacuum = true, gpio.level = true, gpio.air = true, gpio.heat = true }\n";
    let table = format!("{head}{}", blocks[2]);
    let engine = engine();
    for (example, text) in [("alarm-unit", blocks[0]), ("fast-interlock", &table), ("hot-swap", blocks[3])] {
        let path = root.join("examples").join(example).join("page.test.toml");
        let checked = check_text(&path, text.into(), &engine, &Options { folders: component_folders() });
        let Some(tests) = &checked.tests else { panic!("{}", checked.render(false)) };
        for case in 0..tests.cases().len() {
            let report = tests.run(case, 10_000_000);
            assert!(report.passed, "{example}: {report:#?}");
        }
    }
}
