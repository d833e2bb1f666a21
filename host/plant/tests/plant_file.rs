//! What is read from a plant file and what is said of it, where names, words and the order of mistakes are tricky.
//! Wrong keys, wires and drivers one by one stand in tests/plant, with the components that ship.

use latchwork_block::{Engine, EngineOptions};
use latchwork_plant::check::{CheckOptions, Checked, check_file, check_text};
use latchwork_plant::model::Input;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What most cases begin with.
const HEAD: &str = r#"[plant]
name = "p"
components = ["components", "test-components"]
[lane.main]
every = "10ms"
[driver.hall]
kind = "sim"
[driver.hall.points]
button = { type = "bool" }
word = { type = "u16" }
"#;

/// The points in it.
const POINTS: &str = "[driver.hall.points]\nbutton = { type = \"bool\" }\nword = { type = \"u16\" }\n";

/// A block for each lane that would have none.
const TON: &str = "component = \"ton\"\nlane = \"main\"\ninputs.in = \"hall.button\"\n";

/// A block with ports of every type.
const SINK: &str = "[block.k]\ncomponent = \"everything\"\nlane = \"main\"\ninputs.real = 0.0\ninputs.on = true\n\
                    inputs.drive.torque = 0.0\n";

/// The build folder, where `cargo xtask guests` puts components.
fn target() -> PathBuf {
    let exe = std::env::current_exe().expect("this program has a path");
    let target = exe.ancestors().nth(3).expect("a test stands three folders below the build folder").to_path_buf();
    assert!(target.join("test-components").is_dir(), "components are missing: run `cargo xtask guests` first");
    target
}

fn engine() -> &'static Engine {
    static ENGINE: OnceLock<Engine> = OnceLock::new();
    ENGINE.get_or_init(|| {
        let cache = Some(target().join("test-cache"));
        Engine::new(EngineOptions { cache, ..EngineOptions::default() }).expect("an engine")
    })
}

fn check(text: &str, sim: bool) -> Checked {
    // The plant stands in the build folder, so that its folders are near.
    check_text(&target().join("plant.toml"), text.to_owned(), engine(), CheckOptions { sim })
}

fn said(text: &str, sim: bool) -> String {
    let said = check(text, sim).render(false).replace(&format!("{}/", target().display()), "");
    said.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// Cases by name; text is what follows the head.
fn golden(name: &str, cases: &[(&str, String)]) {
    let mut all = String::new();
    for (case, text) in cases {
        all += &format!("=== {case}\n{}\n\n", said(text, false));
    }
    insta::assert_snapshot!(name, all);
}

#[track_caller]
fn block_names(text: &str) -> Vec<String> {
    let checked = check(text, false);
    let said = checked.render(false);
    let model = checked.model.unwrap_or_else(|| panic!("{said}"));
    assert_eq!(said, "");
    model.blocks.iter().map(|b| b.name.clone()).collect()
}

#[test]
fn dots_in_names_of_blocks_mean_the_same_however_they_are_written() {
    for (header, name) in [
        ("[block.unit]", "unit"),
        ("[block.zone-b.turbo]", "zone-b.turbo"),
        ("[block.\"zone-b.turbo\"]", "zone-b.turbo"),
        ("[block.a.b.c.d]", "a.b.c.d"),
    ] {
        assert_eq!(block_names(&format!("{HEAD}{header}\n{TON}")), [name], "{header}");
    }
}

#[test]
fn only_the_words_of_tags_are_kept_from_names() {
    for word in ["memory", "class", "component", "budget", "retain", "wasi", "safe", "on-fault"] {
        let text = format!("{HEAD}[block.zone.{word}]\n{TON}");
        assert_eq!(block_names(&text), [format!("zone.{word}")]);
    }
}

#[test]
fn a_dotted_name_of_a_block_does_not_begin_like_that_of_a_sink() {
    for table in ["block.sink.pump", "block.\"sink.pump\"", "block.sink.a.b"] {
        let said = check(&format!("{HEAD}[{table}]\n{TON}"), false).render(false);
        assert!(said.contains("begins like the name of a sink"), "{table}: {said}");
    }
    for (table, name) in [("block.sink", "sink"), ("block.zone.sink", "zone.sink"), ("block.sink-a.b", "sink-a.b")] {
        assert_eq!(block_names(&format!("{HEAD}[{table}]\n{TON}")), [name]);
    }
}

#[test]
fn a_block_may_stand_below_another() {
    let text = format!("{HEAD}[block.a]\n{TON}[block.a.b]\n{TON}[block.a.c.d]\n{TON}[block.a.memory]\n{TON}");
    let mut names = block_names(&text);
    names.sort_unstable();
    assert_eq!(names, ["a", "a.b", "a.c.d", "a.memory"]);
}

#[test]
fn ports_of_nested_records_are_named_in_three_ways() {
    let low = |text: String| {
        let checked = check(&text, false);
        let said = checked.render(false);
        let model = checked.model.unwrap_or_else(|| panic!("{said}"));
        let block = &model.blocks[0];
        let port = block.class.inputs.iter().position(|p| p.path == "drive.limits.low").expect("the port");
        block.inputs[port].clone()
    };
    let expected = Input::Constant(2.5f64.to_bits());
    assert_eq!(low(format!("{HEAD}{SINK}inputs.drive.limits.low = 2.5\n")), expected);
    assert_eq!(low(format!("{HEAD}{SINK}inputs.\"drive.limits.low\" = 2.5\n")), expected);
    assert_eq!(low(format!("{HEAD}{SINK}inputs.drive.limits = {{ low = 2.5 }}\n")), expected);
}

#[test]
fn words_are_values_of_enums_and_flags_wherever_a_constant_stands() {
    let text = format!(
        "{HEAD}{SINK}inputs.mode = \"automatic\"\ninputs.options = \"fast|verbose\"\nsettings.mode = \"manual\"\n\
         settings.options = \"quiet\"\nsettings.time = \"3ms\"\nsafe.mode = \"manual\"\nsafe.options = \"fast | quiet\"\n"
    );
    let checked = check(&text, false);
    let said = checked.render(false);
    let model = checked.model.unwrap_or_else(|| panic!("{said}"));
    let block = &model.blocks[0];
    let at = |ports: &[latchwork_block::Port], path: &str| ports.iter().position(|p| p.path == path).expect("the port");
    assert_eq!(block.inputs[at(&block.class.inputs, "mode")], Input::Constant(2));
    assert_eq!(block.inputs[at(&block.class.inputs, "options")], Input::Constant(5));
    assert_eq!(block.settings[at(&block.class.settings, "mode")], Some(1));
    assert_eq!(block.settings[at(&block.class.settings, "options")], Some(2));
    assert_eq!(block.settings[at(&block.class.settings, "time")], Some(3_000_000));
    assert_eq!(block.safe[at(&block.class.outputs, "mode")], 1);
    assert_eq!(block.safe[at(&block.class.outputs, "options")], 3);
}

#[test]
fn values_of_ports() {
    let sink = |line: &str| format!("{HEAD}{SINK}{line}\n");
    golden(
        "values_of_ports",
        &[
            ("a misspelt case", sink("settings.mode = \"manul\"")),
            ("a case by number", sink("settings.mode = 1")),
            ("a misspelt case of an input", sink("inputs.mode = \"manul\"")),
            ("an unknown flag", sink("safe.options = \"fast|loud\"")),
            ("too large for f32", sink("inputs.i = 1e300")),
            ("too large for 64 bits", sink("inputs.d = 99999999999999999999")),
            ("negative for unsigned", sink("settings.b = -1")),
            ("a number in quotes", sink("inputs.j = \"0.5\"")),
            ("a bool in quotes", sink("inputs.yes = \"true\"")),
            (
                "a record without field",
                format!("{HEAD}[block.k]\ncomponent = \"everything\"\nlane = \"main\"\ninputs.drive = 1.0\n"),
            ),
            ("a misspelt field", sink("inputs.drive.limits.lwo = 1.0")),
            ("a tag for a setting", sink("settings.mode = { tag = \"hall.word\" }")),
            ("an input twice", sink("inputs.drive.limits.low = 1.0\ninputs.\"drive.limits.low\" = 2.0")),
            ("a table in two ways", sink("settings.a = 1\n[block.k.settings]\nb = 2")),
        ],
    );
}

#[test]
fn one_mistake_is_one_message() {
    let more: String = (0..5).map(|n| format!("[block.b{n}]\n{TON}")).collect();
    let good = format!("{HEAD}{more}");
    golden(
        "one_mistake_is_one_message",
        &[
            ("[plant] misspelt", good.replace("[plant]", "[plnat]")),
            ("folders of a wrong kind", good.replace("[\"components\", \"test-components\"]", "\"components\"")),
            ("[lane.main] misspelt", good.replace("[lane.main]", "[lnae.main]")),
            ("no lane", good.replace("[lane.main]\nevery = \"10ms\"\n", "")),
            ("a lane that is none", good.replace("[lane.main]\nevery = \"10ms\"", "[lane]\nmain = 1")),
            ("[driver] misspelt", good.replace("[driver.", "[drivr.")),
            ("points misspelt", good.replace("hall.points", "hall.pionts")),
            ("points that are none", good.replace(POINTS, "points = 3\n")),
            ("a kind that is none", good.replace("\"sim\"", "\"smi\"")),
            ("a point that is none", good.replace("{ type = \"bool\" }", "true")),
            ("a component that is none", {
                let reader = "[block.r]\ncomponent = \"sr\"\nlane = \"main\"\ninputs.s1 = \"b0.outputs.q\"\ninputs.r = \"b0.outputs.et\"\n";
                good.replacen("\"ton\"", "\"plant-file.txt.wasm\"", 1) + reader
            }),
        ],
    );
}

#[test]
fn circles_are_told_along_with_everything_else() {
    let text = format!(
        "{HEAD}[block.a]\ncomponent = \"ton\"\nlane = \"main\"\ninputs.in = \"b.inputs.in\"\ncolour = \"red\"\n\
         [block.broken]\ncomponent = \"tonn\"\nlane = \"main\"\n\
         [block.b]\ncomponent = \"ton\"\nlane = \"main\"\ninputs.in = \"a.inputs.in\"\n\
         [driver.other]\nkind = \"sim\"\n[driver.other.points]\nself = {{ type = \"bool\", from = \"other.self\" }}\n"
    );
    golden("circles", &[("two circles, a key and a component", text)]);
}

#[test]
fn names_that_are_not_allowed() {
    golden(
        "names",
        &[
            ("a word of tags in the middle", format!("{HEAD}[block.zone.inputs.delay]\n{TON}")),
            ("a word of tags in quotes", format!("{HEAD}[block.\"zone.alarms\"]\n{TON}")),
            ("a lane called lane", format!("{HEAD}[block.a]\n{TON}").replace("main", "lane")),
            ("an empty part", format!("{HEAD}[block.\"a..b\"]\n{TON}")),
            ("letters of another alphabet", format!("{HEAD}[block.\"gør\"]\n{TON}")),
            ("a point with a dot", format!("{HEAD}\"a.b\" = {{ type = \"bool\" }}\n[block.a]\n{TON}")),
            ("one name, two ways to write it", format!("{HEAD}[block.a.b]\n{TON}[block.\"a.b\"]\n{TON}")),
        ],
    );
}

#[test]
fn what_is_allowed_and_worth_knowing() {
    golden(
        "notes",
        &[
            ("signals without a source", format!("{HEAD}[block.k]\ncomponent = \"everything\"\nlane = \"main\"\n")),
            ("retain with state", format!("{HEAD}{SINK}retain = true\n")),
            ("retain without", format!("{HEAD}[block.c]\ncomponent = \"scale\"\nlane = \"main\"\nretain = true\n")),
            ("a budget beyond the period", format!("{HEAD}[block.a]\n{TON}budget = \"1s\"\n")),
            ("a folder that is not there", format!("{HEAD}[block.a]\n{TON}").replace("\"test-", "\"no-")),
        ],
    );
}

#[test]
fn sinks_and_the_journal() {
    let with = |text: &str| format!("{HEAD}[block.a]\n{TON}{text}\n");
    golden(
        "sinks",
        &[
            ("a sink", with("[sink.file]\nkind = \"jsonl\"\npath = \"r.jsonl\"")),
            ("no kind", with("[sink.file]\npath = \"r.jsonl\"")),
            ("a misspelt kind", with("[sink.file]\nkind = \"jsnol\"")),
            ("no path", with("[sink.file]\nkind = \"jsonl\"")),
            ("a misspelt key", with("[sink.file]\nkind = \"jsonl\"\npath = \"r.jsonl\"\nkidns = [\"alarm\"]")),
            ("a misspelt record kind", with("[sink.file]\nkind = \"jsonl\"\npath = \"r\"\nkinds = [\"alram\"]")),
            ("a pattern that is none", with("[sink.s]\nkind = \"syslog\"\nsources = [\"a{b\"]")),
            ("a batch that never fits", with("[sink.s]\nkind = \"syslog\"\nlist = 100\nbatch = 80")),
            ("keep without renaming", with("[sink.file]\nkind = \"jsonl\"\npath = \"r\"\nkeep = 3")),
            (
                "a port in the address",
                with("[sink.m]\nkind = \"mqtt\"\naddress = \"tcp://x\"\nca = \"c\"\ntls = false"),
            ),
            ("a password in the file", with("[sink.m]\nkind = \"mqtt\"\naddress = \"x\"\npassword = \"secret\"")),
            ("a topic with a wildcard", with("[sink.m]\nkind = \"mqtt\"\naddress = \"x\"\ntopic = \"a/+\"")),
            ("two targets", with("[sink.s]\nkind = \"syslog\"\ntarget = \"journald\"\npath = \"/dev/log\"")),
            ("a name with a dot", with("[sink.\"a.b\"]\nkind = \"syslog\"")),
            ("a file of two", {
                let sink = |name: &str, path: &str| format!("[sink.{name}]\nkind = \"jsonl\"\npath = \"{path}\"\n");
                with(&(sink("one", "log/r.jsonl") + &sink("two", "./log/../log/r.jsonl")))
            }),
            ("a client of two", {
                let sink = |name: &str, port: u16| {
                    format!("[sink.{name}]\nkind = \"mqtt\"\naddress = \"x\"\nport = {port}\nclient-id = \"me\"\n")
                };
                with(&(sink("one", 1883) + &sink("two", 1883) + &sink("three", 1884)))
            }),
            ("sinks that are none", with("[sink]\nfile = 1")),
            ("a journal that is too small", with("[journal]\nsize = \"1MiB\"\nage = \"90\"\nwithn = \"1s\"")),
        ],
    );
}

#[test]
fn the_journal_has_limits_and_knows_its_sinks() {
    let model = |text: &str| {
        let checked = check(&format!("{HEAD}[block.a]\n{TON}{text}"), false);
        let said = checked.render(false);
        checked.model.unwrap_or_else(|| panic!("{said}"))
    };
    let journal = model("").journal;
    assert_eq!((journal.age, journal.size, journal.queue), (None, Some(4 << 30), 200_000));
    let text = "[journal]\nage = \"90d\"\nsize = \"1GiB\"\nwithin = \"1s\"\nqueue = 5000\n\
                [sink.one]\nkind = \"syslog\"\n[sink.two]\nkind = \"jsonl\"\npath = \"r.jsonl\"\n";
    let model = model(text);
    let (journal, days) = (model.journal, std::time::Duration::from_secs(90 * 24 * 3600));
    assert_eq!((journal.age, journal.size, journal.queue), (Some(days), Some(1 << 30), 5000));
    assert_eq!((journal.within, journal.sinks), (std::time::Duration::from_secs(1), vec!["one".into(), "two".into()]));
    let kinds: Vec<_> = model.sinks.iter().map(|s| (s.config.name.as_str(), s.kind.name)).collect();
    assert_eq!(kinds, [("one", "syslog"), ("two", "jsonl")]);
}

#[test]
fn feeds_count_with_sim_alone_and_once() {
    let text =
        format!("{HEAD}[block.a]\n{TON}[sim.feed]\n\"hall.button\" = \"a.outputs.q\"\nhall.button = \"a.inputs.in\"\n");
    insta::assert_snapshot!("a_feed_twice", said(&text, true));
    let one = text.replace("hall.button = \"a.inputs.in\"\n", "");
    let fed = |sim| {
        let checked = check(&one, sim);
        let said = checked.render(false);
        checked.model.unwrap_or_else(|| panic!("{said}")).drivers[0].sources[0].is_some()
    };
    assert!(fed(true), "a feed drives a point of a sim driver under --sim");
    assert!(!fed(false), "[sim] exists only under --sim");
}

#[test]
fn defaults_are_those_of_the_reference() {
    let text = format!("{HEAD}[block.a]\n{TON}");
    let defaults = |every: &str| {
        let model = check(&text.replace("10ms", every), false).model.expect("a good plant");
        (model.lanes[0].watchdog, model.lanes[0].priority, model.blocks[0].budget, model.blocks[0].memory)
    };
    assert_eq!(defaults("10ms"), (50_000_000, 40, 5_000_000, 4 << 20));
    assert_eq!(defaults("1ms"), (5_000_000, 40, 1_000_000, 4 << 20), "a budget of at least 1 ms");
    assert_eq!(defaults("1s"), (5_000_000_000, 40, 100_000_000, 4 << 20), "a budget of at most 100 ms");
}

#[test]
fn a_file_that_is_no_text_is_refused_with_its_line() {
    let path = target().join("plant-file-bytes.toml");
    std::fs::write(&path, b"[plant]\nname = \"\xff\"\n").expect("the file is written");
    let said = check_file(&path, engine(), CheckOptions::default()).render(false);
    assert!(said.contains("line 2 holds bytes that are no UTF-8"), "{said}");
    let endless = check_file(Path::new("/dev/zero"), engine(), CheckOptions::default()).render(false);
    assert!(endless.contains("longer than 16 MiB"), "{endless}");
}

#[test]
fn places_count_characters_not_bytes() {
    let text = format!("{HEAD}# größer als üblich\r\n[block.a]\r\ncomponent = \"ton\" # ä\r\nlane = \"ü\"\r\n");
    let json = check(&text, false).json();
    let place = |key: &str| json[1][key].as_u64();
    assert_eq!(json[1]["message"], "there is no lane `ü`", "{json}");
    assert_eq!(
        (place("line"), place("column"), place("end-line"), place("end-column")),
        (Some(14), Some(8), Some(14), Some(11))
    );
}

#[test]
fn a_policy_names_users_groups_numbers_or_everyone() {
    let block = format!("[block.t]\n{TON}");
    let policy = "[policy]\nview = [\"everyone\"]\nset = [\"user:alice\", \"group:night-shift\", \"uid:1000\"]\n";
    let checked = check(&format!("{HEAD}{block}{policy}"), false);
    let said = checked.render(false);
    let model = checked.model.unwrap_or_else(|| panic!("{said}"));
    assert_eq!(said, "", "that this machine may not know them belongs to the start");
    let given: Vec<_> = model.policy.given("set").map(ToString::to_string).collect();
    assert_eq!(given, ["user:alice", "group:night-shift", "uid:1000"]);
    let page = include_str!("../../../docs/operators.md");
    let start = page.find("```toml\n[policy]").expect("the page's example") + "```toml\n".len();
    let example = &page[start..start + page[start..].find("```").expect("its end")];
    let checked = check(&format!("{HEAD}{block}{example}"), false);
    assert!(checked.model.is_some(), "docs/operators.md: {}", checked.render(false));
    let case = |policy: &str| format!("{HEAD}{block}[policy]\n{policy}\n");
    golden(
        "policy",
        &[
            ("a bare name", case("set = [\"alice\", \"user:bob\"]")),
            ("a bare number", case("alarm = [\"1000\"]")),
            ("a list in a string", case("alarm = [\"user:a, user:b\"]")),
            ("no list", case("command = \"everyone\"")),
            ("a right there is not", case("alarms = [\"everyone\"]")),
            ("no name", case("force = [\"user:\", \"all\", 7]")),
        ],
    );
}
