//! A swap from its order to its end.

use crate::support::{Running, start};
use crate::{row, text, version};
use serde_json::Value;
use std::process::Stdio;

/// Transitions of the records about swaps of a source, once there are so many.
fn told(plant: &Running, source: &str, count: usize) -> Vec<String> {
    let of_source = |r: &Value| r["kind"] == "swap" && r["source"] == source;
    let records = plant.records(count, of_source);
    records.iter().map(|r| r["transition"].as_str().expect("text").to_owned()).collect()
}

#[test]
fn a_block_is_swapped_rolled_back_and_each_step_is_on_record() {
    let plant = start("");
    let new = version(plant.folder.path(), "alarm-unit", "unit-2");
    let before = row(&plant, "unit");
    assert_eq!((&before["component"], &before["differs"]), (&"alarm-unit".into(), &false.into()));
    let args = ["swap", "unit", text(&new), "--yes", "--shadow", "20", "--probation", "20", "--reason", "trial"];
    let out = plant.does(&args);
    for part in [
        "unit: alarm-unit becomes unit-2\n",
        "  ports     the same\n",
        "shadow of unit: 20 executions, 0 different\n",
        "exchanged in ",
        "swap 1: done; unit runs unit-2\n",
    ] {
        assert!(out.contains(part), "{part:?} is not in\n{out}");
    }
    let now = row(&plant, "unit");
    assert_eq!((&now["component"], &now["differs"]), (&"unit-2".into(), &true.into()));
    assert_ne!(now["hash"], before["hash"]);
    let out = plant.does(&["rollback", "unit", "--yes"]);
    assert!(out.contains("swap 2: done"), "{out}");
    let back = row(&plant, "unit");
    assert_eq!((&back["component"], &back["hash"]), (&before["component"], &before["hash"]));
    let list = plant.does(&["swaps"]);
    assert!(list.contains("unit: alarm-unit → unit-2") && list.lines().count() == 3, "{list}");
    let told = told(&plant, "unit", 5);
    assert_eq!((told[0].as_str(), told.contains(&"exchanged".into())), ("asked", true), "{told:?}");
    assert!(told.contains(&"rolled-back".into()), "{told:?}");
}

#[test]
fn a_dry_run_changes_nothing_and_nobody_is_asked_where_nobody_reads() {
    let plant = start("");
    let new = version(plant.folder.path(), "alarm-unit", "unit-2");
    let out = plant.does(&["swap", "unit", text(&new), "--dry-run"]);
    assert!(out.contains("unit: alarm-unit becomes unit-2") && out.contains("nothing was changed"), "{out}");
    let json = plant.json(&["swap", "unit", text(&new), "--dry-run"]);
    assert_eq!((&json["stage"], &json["blocks"][0]["new"]["component"]), (&"planned".into(), &"unit-2".into()));
    let (code, out, errors) = plant.run(&["swap", "unit", text(&new)]);
    assert_eq!((code, out.as_str()), (Some(2), ""), "{errors}");
    assert!(errors.contains("add --yes"), "{errors}");
    assert_eq!(plant.run(&["rollback", "unit"]).0, Some(2));
    assert_eq!(row(&plant, "unit")["component"], "alarm-unit");
    assert!(plant.refuses(&["rollback", "unit", "--yes"]).contains("no earlier version"));
}

#[test]
fn what_is_saved_runs_after_a_restart_and_what_is_not_does_not() {
    let mut plant = start("");
    let [saved, other] = ["unit-2", "unit-3"].map(|n| version(plant.folder.path(), "alarm-unit", n));
    let file = plant.folder.path().join("plant.toml");
    let before = std::fs::read_to_string(&file).expect("the plant file");
    // A folder of its own comes first, so that nothing is written beside the shipped components.
    let text_of = before.replace("components = [", "components = [\"own\", ");
    std::fs::write(&file, &text_of).expect("the plant file");
    plant.again();
    let out = plant.does(&["swap", "unit", text(&saved), "--yes", "--probation", "5", "--save"]);
    assert!(out.contains("and the plant file says so"), "{out}");
    let after = std::fs::read_to_string(&file).expect("the plant file");
    assert_eq!(after, text_of.replace("component = \"alarm-unit\"", "component = \"unit-2\""));
    assert_eq!(row(&plant, "unit")["differs"], false);
    plant.does(&["swap", "unit", text(&other), "--yes", "--probation", "5"]);
    assert_eq!(row(&plant, "unit")["differs"], true);
    plant.again();
    let now = row(&plant, "unit");
    assert_eq!((&now["component"], &now["differs"]), (&"unit-2".into(), &false.into()));
    plant.records(1, |r| r["kind"] == "swap" && r["source"] == "unit" && r["transition"] == "saved");
}

#[test]
fn what_cannot_be_saved_is_not_swapped_and_a_plan_says_so() {
    let plant = start("");
    let new = version(plant.folder.path(), "alarm-unit", "unit-2");
    let file = plant.folder.path().join("plant.toml");
    let edited = std::fs::read_to_string(&file).expect("the plant file").replace("\"alarm-unit\"", "\"digital-alarm\"");
    std::fs::write(&file, &edited).expect("the plant file");
    let errors = plant.refuses(&["swap", "unit", text(&new), "--yes", "--save"]);
    assert!(errors.contains("it could not be saved") && errors.contains("`unit` has component"), "{errors}");
    assert!(errors.contains("leave --save out"), "{errors}");
    let out = plant.does(&["swap", "unit", text(&new), "--dry-run", "--save"]);
    assert!(out.contains("it could not be saved: the plant file was edited"), "{out}");
    assert!(!plant.does(&["swap", "unit", text(&new), "--dry-run"]).contains("saved"));
    assert_eq!(std::fs::read_to_string(&file).expect("the plant file"), edited);
    assert_eq!(row(&plant, "unit")["component"], "alarm-unit");
    plant.does(&["swap", "unit", text(&new), "--yes", "--probation", "5"]);
}

#[test]
fn a_plant_file_that_is_edited_during_the_probation_is_not_written_over_and_the_swap_says_so() {
    let plant = start("");
    let new = version(plant.folder.path(), "alarm-unit", "unit-2");
    let file = plant.folder.path().join("plant.toml");
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let mut command = plant.command(program, &["swap", "unit", text(&new), "--yes", "--probation", "300", "--save"]);
    let swap = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let end = std::time::Instant::now() + crate::support::LONG;
    while row(&plant, "unit")["swap"] != "probation" {
        assert!(std::time::Instant::now() < end, "no probation");
    }
    let edited = std::fs::read_to_string(&file).expect("the plant file").replace("\"alarm-unit\"", "\"unit-9\"");
    std::fs::write(&file, &edited).expect("the plant file");
    let ended = swap.wait_with_output().expect("it ends");
    let errors = String::from_utf8(ended.stderr).expect("text");
    assert_eq!(ended.status.code(), Some(1), "{errors}");
    assert!(errors.contains("it was not saved") && errors.contains("unit-9"), "{errors}");
    assert_eq!(std::fs::read_to_string(&file).expect("the plant file"), edited);
    assert_eq!(row(&plant, "unit")["component"], "unit-2");
}

#[test]
fn a_sink_is_swapped_between_two_batches_and_nothing_is_lost_or_comes_twice() {
    let sink =
        "[sink.day]\nkind = \"component\"\ncomponent = \"csv-days\"\ndirectory = \"logs\"\nbatch = 1\nwait = \"1ms\"\n";
    let plant = start(sink);
    let noise = |n: usize| (0..n).for_each(|_| drop(plant.does(&["command", "unit.commands.silence"])));
    noise(4);
    let day = || plant.json(&["status"])["sinks"][0].clone();
    let before = day();
    assert_eq!((&before["differs"], &before["by"]), (&false.into(), &"".into()), "{before}");
    assert_eq!(before["since"], plant.json(&["status"])["epoch-ns"]);
    for (number, name) in [(1, "day-2"), (2, "day-3")] {
        let new = version(plant.folder.path(), "csv-days", name);
        let out = plant.does(&["swap", "sink.day", text(&new), "--yes", "--probation", "1"]);
        assert!(out.contains(&format!("swap {number}: done; sink.day runs {name}")), "{out}");
        let now = day();
        assert_eq!((&now["component"], &now["differs"]), (&name.into(), &true.into()), "{now}");
        let hash = latchwork_block::Component::hash_of(&std::fs::read(&new).expect("a component"));
        assert_eq!(now["hash"], *hash);
        assert!(now["since"].as_u64() > before["since"].as_u64() && now["by"] != "", "{now}");
        assert_eq!(plant.json(&["swaps"])[number - 1]["left"], 0);
        noise(4);
    }
    let refused = plant.refuses(&["swap", "sink.dya", text(&version(plant.folder.path(), "csv-days", "x")), "--yes"]);
    assert!(refused.contains("did you mean `sink.day`?"), "{refused}");
    let out = plant.does(&["rollback", "sink.day", "--yes"]);
    assert!(out.contains("swap 3: done"), "{out}");
    noise(4);
    let status = plant.json(&["status"]);
    assert_eq!(status["sinks"][0]["component"], "day-2");
    let shown = plant.does(&["status"]);
    let titles = shown.lines().find(|l| l.contains("cursor")).expect("a table of sinks");
    assert!(["component", "hash", "differs", "since (UTC)", "by"].iter().all(|t| titles.contains(t)), "{shown}");
    let all = plant.records(20, |_| true);
    let last = all.last().expect("records")["seq"].as_u64().expect("a number");
    // Everything up to there is in the files, once.
    let end = std::time::Instant::now() + crate::support::LONG;
    while plant.json(&["status"])["sinks"][0]["cursor"].as_u64() < Some(last) {
        assert!(std::time::Instant::now() < end, "the sink does not follow: {}", plant.json(&["status"])["sinks"]);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let files = std::fs::read_dir(plant.folder.path().join("logs")).expect("the logs").flatten();
    let text: String = files.map(|f| std::fs::read_to_string(f.path()).expect("a log")).collect();
    let mut numbers: Vec<u64> =
        text.lines().filter_map(|l| l.split(',').next()?.trim_matches('"').parse().ok()).collect();
    numbers.retain(|n| *n <= last);
    numbers.sort_unstable();
    assert_eq!(numbers, (1..=last).collect::<Vec<_>>());
    let told = told(&plant, "sink.day", 8);
    let once = ["asked", "exchanged", "kept"];
    assert_eq!(told, [&once[..], &once, &["asked", "rolled-back"]].concat());
    let back = plant.records(1, |r| r["source"] == "sink.day" && r["transition"] == "rolled-back");
    let text = back[0]["text"].as_str().expect("a text");
    assert!(text.contains("day-3") && text.contains("→ day-2"), "{text}");
}

/// A logger that takes all there is, in the place of one of which nobody wants anything else.
fn first_logger(folder: &str, config: &str) -> String {
    let component = crate::support::target().join("test-components/first-logger.wasm");
    format!(
        "[sink.day]\nkind = \"component\"\ncomponent = {component:?}\ndirectory = \"{folder}\"\nbatch = 1\n\
         wait = \"1ms\"\nconfig = {config}\n"
    )
}

#[test]
fn a_sink_that_fails_on_probation_gives_way_to_the_one_before_and_each_step_is_on_record() {
    // It takes what comes until that record.
    let plant = start(&first_logger("logs", "{ at = 40, does = \"refuse\" }"));
    let before = plant.json(&["status"])["sinks"][0].clone();
    assert!(before["cursor"].as_u64() < Some(30), "{before}");
    let stray = crate::support::target().join("test-components/stray-logger.wasm");
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let mut command = plant.command(program, &["swap", "sink.day", text(&stray), "--yes", "--probation", "1000"]);
    let mut swap = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    while swap.try_wait().expect("its state").is_none() {
        plant.does(&["command", "unit.commands.silence"]);
        let last = plant.json(&["status"])["records"].as_u64();
        assert!(last < Some(2000), "it does not fail");
    }
    let ended = swap.wait_with_output().expect("it has ended");
    let [out, errors] = [ended.stdout, ended.stderr].map(|said| String::from_utf8(said).expect("text"));
    assert!(ended.status.code() == Some(1) && errors.contains("I do not like this one"), "{out}{errors}");
    assert!(out.contains("sink.day: first-logger becomes stray-logger"), "{out}");
    let after = plant.json(&["status"])["sinks"][0].clone();
    let same = ["component", "hash", "differs", "by"];
    assert!(same.iter().all(|key| after[key] == before[key]), "{before} {after}");
    let list = plant.json(&["swaps"]);
    assert_eq!((&list[0]["stage"], &list[0]["left"]), (&"rolled-back".into(), &0.into()), "{list}");
    assert_eq!(told(&plant, "sink.day", 3), ["asked", "exchanged", "rolled-back"]);
    let back = plant.records(1, |r| r["source"] == "sink.day" && r["transition"] == "rolled-back");
    assert!(back[0]["priority"].as_u64() >= Some(128), "{}", back[0]);
}

#[test]
fn a_component_that_is_no_logger_is_refused_and_that_is_on_record() {
    let plant = start(&first_logger("logs", "{}"));
    let ton = crate::support::target().join("components/ton.wasm");
    let errors = plant.refuses(&["swap", "sink.day", text(&ton), "--yes"]);
    assert!(errors.contains("expected \"latchwork:journal/sink@0.1.0\""), "{errors}");
    assert_eq!(told(&plant, "sink.day", 2), ["asked", "refused"]);
}
