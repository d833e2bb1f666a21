//! `latchwork alarms codes`: which variable has which code by which rule; lists out and in.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

fn latchwork(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("XDG_CACHE_HOME", target().join("test-cache")).env("NO_COLOR", "1");
    command.env("COLUMNS", "100").env_remove("LATCHWORK_CACHE").args(args).output().expect("latchwork starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The output of a command that succeeds.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = latchwork(folder, args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// A pump and a fan with an alarm each, points, and these rules.
fn plant(rules: &str) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    let block = |name: &str| {
        format!(
            "[block.{name}]\ncomponent = \"digital-alarm\"\nlane = \"main\"\ninputs.input = \"field.{name}\"\n\
             inputs.disable = false\n"
        )
    };
    let components = target().join("components").display().to_string();
    let plant = format!(
        "[plant]\nname = \"hall <1>\"\ncomponents = [{components:?}]\n[lane.main]\nevery = \"10ms\"\n[driver.field]\nkind = \"sim\"\n\
         [driver.field.points]\npump = {{ type = \"bool\" }}\nfan = {{ type = \"bool\" }}\n\
         lamp = {{ type = \"bool\", from = \"fan.outputs.interlock\" }}\n{}{}\n{rules}",
        block("pump"),
        block("fan"),
    );
    std::fs::write(folder.path().join("plant.toml"), plant).expect("the plant file");
    folder
}

const RULES: &str = r#"[[alarm]]
match = 'pump\.alarms\.alarm'
code = 0xCC00
priority = "high"
group = "air & <water>"
text = "the \"pump\" of <hall>"
[[alarm]]
match = '(.*)\.alarms\.alarm'
code = 0xC800
[[alarm]]
match = '.*\.alarms\.gone'
code = 0xC000
[[alarm]]
match = '.*\.commands\.acknowledge'
code = 0x9080
[[alarm]]
match = 'field\.fan'
code = 0xA000
[[alarm]]
match = "field.lamp"
code = 0xB000
"#;

#[test]
fn the_list_says_which_rule_gave_what() {
    let folder = plant(RULES);
    insta::assert_snapshot!("codes_table", said(folder.path(), &["alarms", "codes", "plant.toml"]));
    insta::assert_snapshot!("codes_csv", said(folder.path(), &["alarms", "codes", "plant.toml", "--format", "csv"]));
    insta::assert_snapshot!("codes_json", said(folder.path(), &["alarms", "codes", "plant.toml", "--format", "json"]));
}

#[test]
fn control_characters_leave_the_xml_well_formed() {
    let strange = "[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC000\ntext = \"bell\\u0007 \\uFFFF,\\nline\"\ngroup = \"a\\u001Bb\"\n";
    let folder = plant(strange);
    let xml = said(folder.path(), &["alarms", "codes", "plant.toml", "--format", "xml"]);
    assert!(xml.contains("<text>bell\u{fffd} \u{fffd},\nline</text>"), "{xml}");
    assert!(xml.contains("group=\"a\u{fffd}b\""), "{xml}");
}

#[test]
fn without_rules_nothing_has_a_code() {
    let folder = plant("");
    let out = said(folder.path(), &["alarms", "codes", "plant.toml"]);
    assert!(out.starts_with("No variable has a code.\n\nWithout a code, 10:\n  pump.alarms.alarm (alarm)\n"), "{out}");
}

#[test]
fn the_xml_tells_a_panel_what_to_do() {
    let folder = plant(RULES);
    let args = ["alarms", "codes", "plant.toml", "--format", "xml", "--output", "alarms.xml"];
    assert_eq!(said(folder.path(), &args), "");
    let xml = std::fs::read_to_string(folder.path().join("alarms.xml")).expect("the file");
    insta::assert_snapshot!("codes_xml", xml);
    // Read again: names and texts are what they were, and each action belongs to what the code asks for.
    let mut reader = quick_xml::Reader::from_str(&xml);
    let (mut alarms, mut texts) = (Vec::new(), String::new());
    loop {
        use quick_xml::events::Event;
        match reader.read_event().expect("well-formed") {
            Event::Start(tag) | Event::Empty(tag) => {
                let attribute = |name: &str| {
                    let found = tag.try_get_attribute(name).expect("attributes");
                    found.map_or(String::new(), |a| a.unescape_value().expect("a value").into_owned())
                };
                match tag.name().as_ref() {
                    b"alarm" => {
                        let part = |name| attribute(name);
                        alarms.push(([part("tag"), part("requireAck"), part("requireReset"), part("group")], vec![]));
                    }
                    b"action" => alarms.last_mut().expect("it is in an alarm").1.push(attribute("on")),
                    _ => {}
                }
            }
            Event::Text(part) => texts += &part.decode().expect("UTF-8"),
            Event::GeneralRef(name) => {
                let name = name.decode().expect("UTF-8");
                texts += quick_xml::escape::resolve_predefined_entity(&name).expect("a known entity");
            }
            Event::Eof => break,
            _ => {}
        }
    }
    let alarms: Vec<_> =
        alarms.iter().map(|(a, actions)| (a.each_ref().map(String::as_str), actions.join(" "))).collect();
    let expected = [
        (["pump.alarms.alarm", "true", "true", "air & <water>"], "ack reset"),
        (["fan.alarms.alarm", "false", "true", ""], "reset"),
        (["field.fan", "false", "false", ""], ""),
        (["field.lamp", "false", "false", ""], ""),
    ];
    assert_eq!(alarms, expected.map(|(alarm, actions)| (alarm, actions.to_owned())));
    assert!(texts.contains("the \"pump\" of <hall>"), "{texts}");
}

#[test]
fn a_list_that_was_written_comes_back_as_rules_that_give_the_same_codes() {
    let folder = plant(RULES);
    let list = said(folder.path(), &["alarms", "codes", "plant.toml", "--format", "csv"]);
    std::fs::write(folder.path().join("codes.csv"), &list).expect("the list");
    let rules = said(folder.path(), &["alarms", "codes", "plant.toml", "--import", "codes.csv"]);
    insta::assert_snapshot!("codes_import", rules);
    let again = plant(&rules);
    assert_eq!(said(again.path(), &["alarms", "codes", "plant.toml", "--format", "csv"]), list);
}

#[test]
fn a_list_of_a_spreadsheet_with_semicolons_and_hexadecimal_codes() {
    let folder = plant("");
    let list = "\u{feff}Code;Tag name;remark\r\n0xc400; pump.alarms.alarm ;yes\r\n;fan.alarms.alarm;none\r\n;;\r\n";
    std::fs::write(folder.path().join("codes.csv"), list).expect("the list");
    let rules = said(folder.path(), &["alarms", "codes", "plant.toml", "--import", "codes.csv"]);
    assert_eq!(
        rules,
        "# Codes of codes.csv\n\n[[alarm]]\nmatch = 'pump\\.alarms\\.alarm'\n\
         code = 0xC400    # logged alarm, resets itself, must be acknowledged\n"
    );
}

#[test]
fn a_wrong_list_is_refused_with_every_line_that_is_wrong() {
    let folder = plant("");
    let list = "id,tag name,code\n1,pump.alarms.alarm,51201\n2,fan.alarms.alarm,0x9000\n3,fan.commands.block,49152\n\
                4,fan.alarms.alarms,49152\n5,pump.alarms.io-error,many\n6,fan.alarms.alarm,49152\n7,fan.alarms.io-error,99999\n";
    std::fs::write(folder.path().join("codes.csv"), list).expect("the list");
    let output = latchwork(folder.path(), &["alarms", "codes", "plant.toml", "--import", "codes.csv"]);
    assert_eq!((output.status.code(), text(&output.stdout).as_str()), (Some(1), ""));
    insta::assert_snapshot!("codes_wrong_list", text(&output.stderr));
    for (list, part) in [
        (
            "tag,code\na,1\n",
            "there is no column `tag name`; expected the header `id,tag name,code,memory type,data type`",
        ),
        ("tag name\na\n", "there is no column `code`"),
        ("", "there is no column `tag name`"),
    ] {
        std::fs::write(folder.path().join("codes.csv"), list).expect("the list");
        let output = latchwork(folder.path(), &["alarms", "codes", "plant.toml", "--import", "codes.csv"]);
        let errors = text(&output.stderr);
        assert!(output.status.code() == Some(1) && errors.contains(part), "{list:?}: {errors}");
    }
    let output = latchwork(folder.path(), &["alarms", "codes", "plant.toml", "--import", "nothing.csv"]);
    assert!(text(&output.stderr).contains("nothing.csv cannot be read"));
}
