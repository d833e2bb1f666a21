//! One mistake in a test file is one message: where it is, what was found, what was expected, the way out.

mod support;

use std::path::Path;
use support::{check, engine, target};

/// A step that is right, for `ton`.
const STEP: &str = "[[case]]\nname = \"c\"\n[[case.step]]\n";

/// Every text with its messages, the build folder left out.
fn messages(texts: &[String]) -> String {
    let engine = engine();
    // Tables stand beside the file.
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    for (name, text) in [
        ("fits.csv", "at,inputs.in\n0ms,true\n"),
        ("odd.csv", "at,inputs.in,outputs.q,alarms\n0ms,treu,true,none\n10,true,maybe,\n"),
        ("ragged.csv", "at,inputs.in\n0ms,true\n10ms\n"),
        ("head.csv", "at,inputs.in\n"),
        ("comment.csv", "# 1\nname,inputs.in,outputs.q\n#2,true,false\n"),
        ("semicolons.csv", "at;inputs.in\n0ms;true\n"),
        ("core.wasm", "\0asm\x01\0\0\0"),
    ] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let path = folder.path().join("ton.test.toml");
    let mut out = String::new();
    for text in texts {
        let checked = check(&engine, &path, text);
        assert!(checked.file.is_none(), "nothing is wrong with\n{text}");
        let rendered = checked.render(false);
        let rendered = rendered.replace(&folder.path().display().to_string(), "FOLDER");
        let rendered = rendered.replace(&target().display().to_string(), "TARGET");
        out += &format!("{text}\n~~~\n{}\n\n========\n\n", rendered.trim_end());
    }
    out
}

/// Texts that are right but for the lines given: each begins with the component.
fn of(component: &str, lines: &[&str]) -> Vec<String> {
    lines.iter().map(|line| format!("component = \"{component}\"\n{line}")).collect()
}

/// The same within a step.
fn steps(component: &str, lines: &[&str]) -> Vec<String> {
    let lines: Vec<_> = lines.iter().map(|line| format!("{STEP}{line}")).collect();
    of(component, &lines.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn of_the_file_and_its_component() {
    let mut texts: Vec<String> = [
        "",
        "component = ton\n[[case]]",
        "componnet = \"ton\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"tno\"\n[[case]]\nname = \"c\"\nstep = [{ inputs = { x = 1 } }]",
        "component = \"tno\"\ncomponents = [\"nowhere\"]\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"missing.wasm\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"core.wasm\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"two-classes\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"ton\"\nclass = \"latchwork:device/tof\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"no-such-thing-at-all\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = \"csv-days\"\n[[case]]\nname = \"c\"\nstep = [{}]",
        "component = 1\n[[case]]\nname = \"c\"\nstep = [{}]",
    ]
    .map(String::from)
    .into();
    texts.extend(of(
        "ton",
        &[
            "every = 10\n[[case]]\nname = \"c\"\nstep = [{}]",
            "tolerance = -1\n[[case]]\nname = \"c\"\nstep = [{}]",
            "tolerance = \"wide\"\n[[case]]\nname = \"c\"\nstep = [{}]",
            "budget = \"1us\"\n[[case]]\nname = \"c\"\nstep = [{}]",
            "inputs = { inn = true }\n[[case]]\nname = \"c\"\nstep = [{}]",
            "inputs = true\n[[case]]\nname = \"c\"\nstep = [{}]",
        ],
    ));
    insta::assert_snapshot!("file", messages(&texts));
}

#[test]
fn of_cases() {
    let mut texts = of(
        "ton",
        &[
            "",
            "[case]\nname = \"c\"",
            "[[case]]\nstep = [{}]",
            "[[case]]\nname = \"c\"",
            "[[case]]\nname = \"c\"\nstep = [{}]\n[[case]]\nname = \"c\"\nstep = [{}]",
            "[[case]]\nname = \"c\"\nstep = {}",
            "[[case]]\nname = \"c\"\nsteps = []\nstep = [{}]",
            "[[case]]\nname = \"c\"\nstate = { ett = \"1s\" }\nstep = [{}]",
            "[[case]]\nname = \"c\"\nexpect = { refused = \"x\" }\nstep = [{}]",
            "[[case]]\nname = \"c\"\nexpect = { outputs = {} }",
            "[[case]]\nname = \"c\"\nevery = \"0ms\"\nstep = [{}, {}]",
            "[[case]]\nname = \"c\"\nevery = \"1ns\"\nstep = [{ at = \"1h\" }]",
            "[[case]]\nname = \"c\"\nstep = [{ at = \"20ms\" }, { at = \"10ms\" }]",
        ],
    );
    texts.extend(of("scale", &["[[case]]\nname = \"c\"\nstate = { x = 1 }\nstep = [{}]"]));
    insta::assert_snapshot!("cases", messages(&texts));
}

#[test]
fn of_values() {
    let mut texts = steps(
        "ton",
        &[
            "at = 10",
            "at = \"later\"",
            "inputs = { in = 1 }",
            "inputs = { in = \"true\" }",
            "inputs = { pt = 20 }",
            "inputs = { pt = [1] }",
            "inputs = { in = { value = true, quality = \"bad\" } }",
            "inputs = { in = true, \"in\" = false }",
            "inputs = { x = 1 }",
            "inputs = [1]",
            "settings = { x = 1 }",
            "commands = [\"reset\"]",
            "commands = \"reset\"",
            "expect = true",
            "expect = { output = { q = true } }",
            "expect = { outputs = { p = true } }",
            "expect = { outputs = { q = 1 } }",
            "expect = { outputs = { q = {} } }",
            "expect = { outputs = { q = { value = true, within = 1 } } }",
            "expect = { outputs = { et = { value = \"1s\", within = 1 } } }",
            "expect = { outputs = { q = { quality = \"good\" } } }",
            "expect = { alarms = [\"high\"] }",
            "expect = { state = { ett = \"1s\" } }",
        ],
    );
    texts.extend(steps(
        "alarm-unit",
        &[
            "inputs = { level = 70000 }",
            "inputs = { level = 1.5 }",
            "settings = { average = -1 }",
            "commands = [\"acknowlege\"]",
            "commands = [\"go\"]",
            "expect = { alarms = [\"hi\"] }",
            "expect = { outputs = { value = { value = 1, quality = \"fine\" } } }",
            "expect = { outputs = { value = { value = 1, within = -0.5 } } }",
            "expect = { outputs = { value = { value = 1, within = nan } } }",
        ],
    ));
    texts.extend(steps(
        "everything",
        &[
            "inputs = { mode = \"manuel\" }",
            "inputs = { drive = 1 }",
            "inputs = { something-else = 1 }",
            "expect = { state = { something-else = 1 } }",
            "inputs = { drive = { limits = { lo = 1 } } }",
            "inputs = { options = \"fast|loud\" }",
            "inputs = { i = 1e300 }",
        ],
    ));
    insta::assert_snapshot!("values", messages(&texts));
}

#[test]
fn of_what_happens_in_a_step() {
    let mut texts = steps(
        "ton",
        &[
            "restart = 1",
            "restart = true\nswap = \"ton\"",
            "swap = \"tonn\"",
            "swap = \"tof\"",
            "allow-lossy = true",
            "expect = { refused = \"x\" }",
            "expect = { fault = \"crash\" }",
            "expect = { fault = \"trap\", outputs = { q = true } }",
            "expect = { fault = \"trap\" }\n[[case.step]]\nat = \"20ms\"",
        ],
    );
    texts.extend(of("ton", &["[[case]]\nname = \"c\"\nstep = [{ swap = \"tof\" }, { inputs = { x = 1 } }]"]));
    insta::assert_snapshot!("steps", messages(&texts));
}

#[test]
fn of_tables() {
    let tables = [
        "table = 1",
        "table = \"nowhere.csv\"",
        "table = \"odd.csv\"",
        "table = \"ragged.csv\"",
        "table = \"head.csv\"",
        "[[case.table]]\ncolumns = [\"inputs.in\"]",
        "[[case.table]]\nrows = [[true]]",
        "[[case.table]]\nfile = \"fits.csv\"\ncolumns = [\"inputs.in\"]",
        "[[case.table]]\ncolumns = [\"inputs.in\"]\nrows = 1",
        "[[case.table]]\ncolumns = [\"inputs.in\"]\nrows = [true]",
        "[[case.table]]\ncolumns = [\"inputs.in\"]\nrows = [[true, false]]",
        "[[case.table]]\ncolumns = [\"inputs.in\", \"inputs.in\"]\nrows = [[true, false]]",
        "[[case.table]]\ncolumns = [\"inputs.inn\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"in\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"alarm\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"alarms.high\"]\nrows = [[true]]",
        "[[case.table]]\ncolumns = [\"alarms\"]\nrows = [[\"high\"]]",
        "[[case.table]]\ncolumns = [\"inputs.in.quality\"]\nrows = [[\"bad\"]]",
        "[[case.table]]\ncolumns = [\"inputs.in\", \"outputs.q\"]\nrows = [[1, {}]]",
        "[[case.table]]\ncolumns = [\"at\"]\nrows = [[10], [\"10\"]]",
        "[[case.table]]\ncolumns = [\"at\"]\nrows = [[\"20ms\"], [\"10ms\"]]",
    ];
    let lines: Vec<_> = tables.iter().map(|t| format!("[[case]]\nname = \"c\"\n{t}")).collect();
    let mut texts = of("ton", &lines.iter().map(String::as_str).collect::<Vec<_>>());
    // A class with commands, alarms and signals.
    let rows = [
        ("commands", "\"acknowlege\""),
        ("commands", "\"go\""),
        ("commands", "{}"),
        ("alarms", "\"hi\""),
        ("alarms.high", "\"on\""),
        ("alarms.hihg", "true"),
        ("outputs.value.quality", "\"fine\""),
        ("settings.average", "\"few\""),
        ("state.accepted", "\"much\""),
    ];
    let tables = rows.map(|(column, cell)| {
        format!("[[case]]\nname = \"c\"\n[[case.table]]\ncolumns = [\"{column}\"]\nrows = [[{cell}]]")
    });
    texts.extend(of("alarm-unit", &tables.iter().map(String::as_str).collect::<Vec<_>>()));
    insta::assert_snapshot!("tables", messages(&texts));
}

/// A test that tests nothing, or not all that stands in it, passes unseen.
#[test]
fn of_what_would_not_be_tested() {
    let case = "[[case]]\nname = \"c\"\n";
    let texts: Vec<_> = [
        "step = []",
        "table = []",
        "[[case.table]]\ncolumns = [\"inputs.in\"]\nrows = []",
        "[[case.table]]\ncolumns = [\"commands\"]\nrows = [[[\"reset\", 5]]]",
        "table = \"comment.csv\"",
        "table = \"semicolons.csv\"",
        "table = \".\"",
    ]
    .into_iter()
    .map(|lines| format!("{case}{lines}"))
    .collect();
    let texts = of("ton", &texts.iter().map(String::as_str).collect::<Vec<_>>());
    insta::assert_snapshot!(messages(&texts));
}

#[test]
fn all_at_once_in_the_order_of_the_file_and_as_json() {
    let text = "component = \"ton\"\nevry = \"1ms\"\n[[case]]\nname = \"c\"\nstep = [{ inputs = { inn = true }, expect = { outputs = { q = 1 } } }]\n";
    let checked = check(&engine(), Path::new("ton.test.toml"), text);
    insta::assert_json_snapshot!("json", checked.json());
}

#[test]
fn a_file_that_is_not_there_and_one_that_is_no_text() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let path = folder.path().join("odd.test.toml");
    std::fs::write(&path, [0xff, 0xfe]).expect("a file");
    let mut out = String::new();
    for path in [folder.path().join("missing.test.toml"), path] {
        let checked = latchwork_testbed::case::check_file(&path, &engine(), &Default::default());
        assert!(checked.file.is_none());
        out += &checked.render(false).replace(&folder.path().display().to_string(), "FOLDER");
    }
    insta::assert_snapshot!("unreadable", out);
}
