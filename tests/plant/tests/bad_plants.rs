//! What a user reads about a wrong plant file: every message names the place, what was found, what would fit.

use latchwork_plant::check::{CheckOptions, check_file, check_text};
use latchwork_tests_plant::{component_folders, engine};
use proptest::prelude::*;
use std::path::Path;

/// A plant that is right, to be spoilt.
const GOOD: &str = r#"[plant]
name = "good"
components = ["components"]

[lane.main]
every = "10ms"

[driver.field]
kind = "modbus-tcp"
address = "127.0.0.1:5020"
[driver.field.points]
level = { input-register = 0, type = "u16" }
door = { discrete-input = 0 }
lamp = { coil = 0, from = "unit.outputs.lamp", safe = false }

[driver.hall]
kind = "sim"
[driver.hall.points]
button = { type = "bool" }
speed = { type = "f64" }

[block.unit]
component = "alarm-unit"
lane = "main"
inputs.level = "field.level"
inputs.door = { tag = "field.door", not = true }
inputs.offset = 0.5
settings.pulse = "200ms"
safe.lamp = false
on-fault = "safe"
budget = "1ms"
memory = "4MiB"

[block.zone-b.delay]
component = "ton"
lane = "main"
inputs.in = "hall.button"
inputs.pt = "2s"

[sim.block.tank]
component = "tank-model"
lane = "main"
inputs.pump = "field.lamp"

[sim.feed]
"field.level" = "tank.outputs.level"
"#;

/// What is said about a text, with `--sim` if asked for; the folders' names are left out.
fn said(text: &str, sim: bool) -> String {
    let folders = component_folders();
    let text = with_folders(text);
    let checked = check_text(Path::new("plant.toml"), text, &engine(), CheckOptions { sim });
    let mut said = checked.render(false);
    for folder in &folders {
        said =
            said.replace(&folder.display().to_string(), &format!("FOLDER/{}", folder.file_name().unwrap().display()));
    }
    // The line of [plant] with the folders is as long as their paths.
    said.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The folders of the build in place of the plant's own.
fn with_folders(text: &str) -> String {
    let list: Vec<_> = component_folders().iter().map(|f| format!("{:?}", f.display().to_string())).collect();
    text.replace("[\"components\"]", &format!("[{}]", list.join(", ")))
}

#[test]
fn a_good_plant_is_good_with_and_without_its_hardware() {
    assert_eq!(said(GOOD, false), "");
    assert_eq!(said(GOOD, true), "");
}

/// A name of the case, what to replace, by what.
type Case<'a> = (&'a str, &'a str, &'a str);

fn golden(name: &str, cases: &[Case<'_>], sim: bool) {
    let mut all = String::new();
    for (case, from, to) in cases {
        assert!(GOOD.contains(from), "{case}: {from:?} is not in the good plant");
        let said = said(&GOOD.replacen(from, to, 1), sim);
        assert!(!said.is_empty(), "{case}: nothing was said");
        all += &format!("=== {case}\n{said}\n\n");
    }
    insta::assert_snapshot!(name, all);
}

#[test]
fn text_and_tables() {
    golden(
        "text_and_tables",
        &[
            ("no TOML", "name = \"good\"", "name = good"),
            ("a key twice", "every = \"10ms\"", "every = \"10ms\"\nevery = \"20ms\""),
            ("a table twice", "[sim.feed]", "[lane.main]\nevery = \"1s\"\n[sim.feed]"),
            ("no [plant]", "[plant]\nname = \"good\"\ncomponents = [\"components\"]\n", ""),
            ("an unknown table", "[sim.feed]", "[blok.a]\n[sim.feed]"),
            ("a table of a later version", "[sim.feed]", "[sink.file]\nkind = \"jsonl\"\n[sim.feed]"),
            ("a value where tables stand", "[lane.main]\nevery = \"10ms\"", "[x]"),
            ("an unknown key", "budget = \"1ms\"", "bugdet = \"1ms\""),
            ("an unknown key like none", "budget = \"1ms\"", "colour = \"red\""),
            ("a missing key", "lane = \"main\"\ninputs.level", "inputs.level"),
            (
                "several at once",
                "every = \"10ms\"",
                "every = 10\nwatchdog = \"5\"\npriority = 100\ncpu = \"one\"\nspeed = 3",
            ),
        ],
        false,
    );
}

#[test]
fn values() {
    golden(
        "values",
        &[
            ("a bare number for a time", "every = \"10ms\"", "every = 10"),
            ("a wrong unit of time", "every = \"10ms\"", "every = \"10 minuts\""),
            ("no unit of time", "every = \"10ms\"", "every = \"10\""),
            ("out of range", "every = \"10ms\"", "every = \"1us\""),
            ("watchdog below every", "every = \"10ms\"", "every = \"10ms\"\nwatchdog = \"5ms\""),
            ("a size without unit", "memory = \"4MiB\"", "memory = \"4\""),
            ("a number for a size", "memory = \"4MiB\"", "memory = 4"),
            ("an unknown word", "on-fault = \"safe\"", "on-fault = \"save\""),
            ("a name with a space", "[block.zone-b.delay]", "[block.\"zone b\".delay]"),
            ("a name that means something", "[block.zone-b.delay]", "[block.zone-b.inputs.delay]"),
        ],
        false,
    );
}

#[test]
fn lanes_and_components() {
    golden(
        "lanes_and_components",
        &[
            ("an unknown lane", "lane = \"main\"\ninputs.level", "lane = \"mian\"\ninputs.level"),
            ("a lane without blocks", "[sim.feed]", "[lane.slow]\nevery = \"1s\"\n[sim.feed]"),
            ("an unknown component", "component = \"ton\"", "component = \"tonn\""),
            ("a component like none", "component = \"ton\"", "component = \"./blocks/mine.wasm\""),
            ("two classes and none chosen", "component = \"ton\"", "component = \"two-classes\""),
            (
                "a class it does not have",
                "component = \"ton\"",
                "component = \"ton\"\nclass = \"latchwork:device/tof\"",
            ),
            (
                "a misspelt class",
                "component = \"ton\"",
                "component = \"two-classes\"\nclass = \"latchwork:device/r-tirg\"",
            ),
            ("wasi", "component = \"ton\"", "component = \"ton\"\nwasi = \"empty\""),
            ("a block named like a driver", "[block.zone-b.delay]", "[block.field]"),
            ("a block named like one of sim", "[block.zone-b.delay]", "[block.tank]"),
        ],
        false,
    );
}

#[test]
fn interrupt_lanes() {
    // A right one besides the rest, to be spoilt in turn.
    let trip = "[lane.trip]\non = [\"hall.button\"]\nalso-with = \"main\"\n\
                [block.guard]\ncomponent = \"r-trig\"\nlane = \"trip\"\ninputs.clk = \"hall.button\"\n[sim.feed]";
    let with = |from: &str, to: &str| {
        assert!(trip.contains(from), "{from}");
        trip.replace(from, to)
    };
    let cases = [
        ("nothing in `on`", with("[\"hall.button\"]", "[]")),
        ("no `on`", with("on = [\"hall.button\"]\n", "")),
        ("`on` is no list", with("[\"hall.button\"]", "\"hall.button\"")),
        ("a period, too", with("also-with", "every = \"10ms\"\nalso-with")),
        ("a misspelt key", with("also-with", "allso-with")),
        ("a point there is not", with("[\"hall.button\"]", "[\"hall.buton\"]")),
        ("an output of a block", with("[\"hall.button\"]", "[\"unit.outputs.lamp\"]")),
        ("an output point", with("[\"hall.button\"]", "[\"field.lamp\"]")),
        ("a driver without edges", with("[\"hall.button\"]", "[\"field.door\"]")),
        ("a real number", with("[\"hall.button\"]", "[\"hall.speed\"]")),
        ("the same point twice", with("[\"hall.button\"]", "[\"hall.button\", \"hall.button\"]")),
        ("a point of another lane", with("[block.guard]", "[lane.second]\non = [\"hall.button\"]\n[block.guard]")),
        ("with a lane there is not", with("also-with = \"main\"", "also-with = \"mian\"")),
        ("with itself", with("also-with = \"main\"", "also-with = \"trip\"")),
        ("a priority below a cyclic lane's", with("also-with", "priority = 30\nalso-with")),
        ("a limit of nothing", with("also-with", "storm-limit = 0\nalso-with")),
        ("a watchdog shorter than the polling", with("also-with", "poll = \"5ms\"\nwatchdog = \"2ms\"\nalso-with")),
        ("scan times of a lane there is not", with("[sim.feed]", "[sim.scan-time]\nmian = \"1ms\"\n[sim.feed]")),
        ("a scan time without unit", with("[sim.feed]", "[sim.scan-time]\nmain = 3\n[sim.feed]")),
    ];
    let cases: Vec<_> = cases.iter().map(|(what, to)| (*what, "[sim.feed]", to.as_str())).collect();
    golden("interrupt_lanes", &cases, false);
}

#[test]
fn hardware_watchdogs() {
    let named = "name = \"good\"\nwatchdog-device = \"/dev/watchdog\"";
    let slow =
        format!("{named}\nwatchdog-timeout = \"6s\"\ncomponents = [\"components\"]\n\n[lane.main]\nevery = \"4s\"");
    let polling =
        format!("{named}\ncomponents = [\"components\"]\n\n[lane.main]\non = [\"hall.button\"]\npoll = \"10ms\"");
    let head = "name = \"good\"\ncomponents = [\"components\"]\n\n[lane.main]\nevery = \"10ms\"";
    golden(
        "hardware_watchdogs",
        &[
            ("shorter than the drivers' stop", "name = \"good\"", &format!("{named}\nwatchdog-timeout = \"2s\"")),
            ("a lane too slow to pet it", head, &slow),
            ("no cyclic lane to pet it", head, &polling),
        ],
        false,
    );
}

#[test]
fn wires() {
    golden(
        "wires",
        &[
            ("an unknown tag", "inputs.level = \"field.level\"", "inputs.level = \"field.lewel\""),
            ("an unknown point", "inputs.level = \"field.level\"", "inputs.level = \"field.temperature-of-the-oil\""),
            ("an unknown owner", "inputs.level = \"field.level\"", "inputs.level = \"cellar.level\""),
            ("an unknown port", "inputs.level = ", "inputs.lewel = "),
            ("an unknown setting", "settings.pulse", "settings.puls"),
            ("a setting of another type", "settings.pulse = \"200ms\"", "settings.pulse = 200"),
            ("an unknown safe output", "safe.lamp", "safe.lmp"),
            ("another type", "inputs.level = \"field.level\"", "inputs.level = \"hall.speed\""),
            ("a constant of another type", "inputs.offset = 0.5", "inputs.offset = true"),
            ("a constant out of range", "inputs.level = \"field.level\"", "inputs.level = 70000"),
            ("a wrong unit of time", "inputs.pt = \"2s\"", "inputs.pt = \"2 ticks\""),
            ("not of a word", "inputs.level = \"field.level\"", "inputs.level = { tag = \"field.level\", not = true }"),
            ("a wire without a tag", "{ tag = \"field.door\", not = true }", "{ not = true }"),
            ("a list", "inputs.offset = 0.5", "inputs.offset = [1, 2]"),
            ("an output point without a tag", "from = \"unit.outputs.lamp\"", "from = \"unit.outputs.lam\""),
            ("a circle", "inputs.in = \"hall.button\"", "inputs.in = \"zone-b.delay.inputs.in\""),
            ("a block of sim", "inputs.in = \"hall.button\"", "inputs.in = \"tank.outputs.full\""),
            (
                "the previous scan",
                "inputs.door = { tag = \"field.door\", not = true }",
                "inputs.door = \"zone-b.delay.outputs.q\"",
            ),
        ],
        false,
    );
}

#[test]
fn drivers() {
    golden(
        "drivers",
        &[
            ("an unknown kind", "kind = \"modbus-tcp\"", "kind = \"modbus-tpc\""),
            ("no kind", "kind = \"modbus-tcp\"\n", ""),
            ("no address", "address = \"127.0.0.1:5020\"\n", ""),
            ("an unknown key of the kind", "address = ", "adress = "),
            ("an unknown key of a point", "input-register = 0,", "inputregister = 0,"),
            ("two tables of the device", "{ discrete-input = 0 }", "{ discrete-input = 0, coil = 1 }"),
            ("an output that can only be read", "{ coil = 0, from", "{ discrete-input = 1, from"),
            ("a safe value of an input", "{ discrete-input = 0 }", "{ discrete-input = 0, safe = true }"),
            ("a safe value of another type", "safe = false }", "safe = 3 }"),
            ("a register that is not there", "input-register = 0", "input-register = 70000"),
        ],
        false,
    );
}

#[test]
fn feeds() {
    golden(
        "feeds",
        &[
            ("a feed to nowhere", "\"field.level\" = ", "\"field.lewel\" = "),
            ("a feed from nowhere", "\"tank.outputs.level\"", "\"tank.outputs.lewel\""),
            ("a feed to an output point", "\"field.level\" = ", "\"field.lamp\" = "),
            ("a feed to a block", "\"field.level\" = ", "\"unit.inputs.level\" = "),
            ("a feed of another type", "\"tank.outputs.level\"", "\"tank.outputs.full\""),
            ("a feed that is no tag", "\"tank.outputs.level\"", "3"),
        ],
        true,
    );
}

#[test]
fn files_that_are_none() {
    let engine = engine();
    let mut all = String::new();
    for path in ["no/such/plant.toml", "."] {
        all += &check_file(Path::new(path), &engine, CheckOptions::default()).render(false);
    }
    insta::assert_snapshot!("files_that_are_none", all);
}

#[test]
fn findings_for_scripts_have_lines_and_columns() {
    let text = GOOD.replace("every = \"10ms\"", "every = 10").replace("[\"components\"]", "[]");
    let checked = check_text(Path::new("plant.toml"), text, &engine(), CheckOptions::default());
    let json = checked.json();
    let first = &json[0];
    assert_eq!(first["line"], 6, "{first}");
    assert_eq!(first["column"], 9);
    assert_eq!(first["severity"], "error");
}

/// One change of a text: at a place, so many characters replaced by others.
fn damage() -> impl Strategy<Value = Vec<(f64, usize, String)>> {
    let piece = prop_oneof![
        "[a-z.=\"\\[\\]{}, 0-9\n-]{0,8}",
        Just("[lane.main]\n".to_owned()),
        Just("inputs.in = ".to_owned()),
        Just("\"zone-b.delay.inputs.in\"".to_owned()),
        Just("= 99999999999999999999".to_owned()),
        Just("é\u{0}\u{1F980}".to_owned()),
    ];
    prop::collection::vec((0.0..1.0, 0usize..12, piece), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever stands in the file: no panic, no hang, and every finding points into it.
    #[test]
    fn a_damaged_plant_file_is_never_more_than_wrong(damages in damage(), sim: bool) {
        let mut text: Vec<char> = with_folders(GOOD).chars().collect();
        for (place, length, piece) in damages {
            let at = (place * text.len() as f64) as usize;
            let end = (at + length).min(text.len());
            text.splice(at..end, piece.chars());
        }
        let text: String = text.into_iter().collect();
        let length = text.len();
        let checked = check_text(Path::new("plant.toml"), text, engine_once(), CheckOptions { sim });
        for finding in &checked.findings {
            if let Some(span) = &finding.span {
                prop_assert!(span.start <= span.end && span.end <= length, "{finding:?}");
            }
        }
        prop_assert!(!checked.render(false).contains("panicked"));
        checked.json();
    }
}

fn engine_once() -> &'static latchwork_block::Engine {
    static ENGINE: std::sync::OnceLock<latchwork_block::Engine> = std::sync::OnceLock::new();
    ENGINE.get_or_init(engine)
}
