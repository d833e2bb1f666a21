//! Transmitters that fail: input points with a quality.

use super::support::Folder;

/// A transmitter, a contact of an I/O station, two contacts that start interrupt lanes, one that a lane polls.
const PLANT: &str = r#"
[lane.main]
every = "10ms"
[lane.trip]
on = ["gpio.both", "gpio.rising"]
[lane.poll]
on = ["gpio.polled"]
poll = "1ms"

[driver.field]
kind = "modbus-tcp"
address = "127.0.0.1:5020"
[driver.field.points]
temperature = { input-register = 0, type = "u16", real = true }
contact = { discrete-input = 0 }

[driver.gpio]
kind = "gpio"
chip = "/dev/gpiochip0"
[driver.gpio.points]
both = { line = 1, edge = "both" }
rising = { line = 2, edge = "rising" }
polled = { line = 3 }

[block.hot]
component = "analog-input"
lane = "main"
inputs.raw = "field.temperature"
settings.raw-high = 100

[block.shut]
component = "digital-input"
lane = "main"
inputs.raw = "field.contact"
retain = true

[block.fast]
component = "digital-input"
lane = "trip"
inputs.raw = "gpio.both"
[block.once]
component = "digital-input"
lane = "trip"
inputs.raw = "gpio.rising"
[block.slow]
component = "digital-input"
lane = "poll"
inputs.raw = "gpio.polled"
[block.seen]
component = "digital-input"
lane = "main"
inputs.raw = "gpio.both"
"#;

#[test]
fn a_point_with_a_quality_keeps_its_value_unless_it_is_given_another() {
    Folder::new(PLANT).passes(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "a transmitter fails and comes back"
        inputs = { field.temperature = 20 }
        step = [
            { at = "10ms", expect = { outputs = { hot.outputs.value = { value = 20, quality = "good" } }, alarms = [] } },
            { at = "20ms", inputs = { field.temperature = { quality = "bad" } }, expect = { outputs = { field.temperature = { value = 20, quality = "bad" }, hot.outputs.value = { value = 20, quality = "bad" } }, alarms = ["hot.alarms.io-error"] } },
            { at = "30ms", inputs = { field.contact = true }, expect = { outputs = { field.temperature = { quality = "bad" }, shut.outputs.position = { value = true, quality = "good" } } } },
            { at = "40ms", inputs = { field.temperature = { value = 0, quality = "bad" } }, expect = { outputs = { field.temperature = { value = 0, quality = "bad" }, hot.outputs.value = { value = 20, quality = "bad" } } } },
            { at = "50ms", inputs = { field.temperature = { quality = "uncertain" } }, expect = { outputs = { field.temperature = { value = 0, quality = "uncertain" } } } },
            { at = "60ms", inputs = { field.temperature = 30 }, expect = { outputs = { hot.outputs.value = { value = 30, quality = "good" } }, alarms = { hot.alarms.io-error = "normal" } } },
            { at = "70ms", inputs = { field.temperature = { quality = "bad" } } },
            { at = "80ms", inputs = { field.temperature = { value = 40 } }, expect = { outputs = { hot.outputs.value = { value = 40, quality = "good" } } } },
        ]
        [[case]]
        name = "it is bad from the start, and the restart of the plant mends no transmitter"
        inputs = { field.contact = { value = true, quality = "bad" } }
        step = [
            { at = "0ms", expect = { outputs = { shut.outputs.position = { value = true, quality = "bad" } }, alarms = ["shut.alarms.io-error"] } },
            { at = "50ms", restart = true, expect = { outputs = { field.contact = { value = true, quality = "bad" }, shut.outputs.position = { quality = "bad" } } } },
            { at = "60ms", inputs = { field.contact = false }, expect = { outputs = { shut.outputs.position = { value = false, quality = "good" } } } },
            { at = "70ms", restart = true, expect = { outputs = { shut.outputs.position = { value = false, quality = "good" } } } },
        ]
        [[case]]
        name = "only the quality was ever given: the plant keeps its first value over a restart"
        step = [
            { at = "0ms", inputs = { field.contact = { quality = "bad" } } },
            { at = "50ms", restart = true, expect = { outputs = { field.contact = { value = false, quality = "bad" } } } },
        ]
        "#,
    );
}

#[test]
fn a_line_that_fails_lets_its_interrupt_lane_execute_at_once() {
    Folder::new(PLANT).passes(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "with the quality alone, with an edge, and between the scans of others"
        step = [
            { at = "0ms" },
            { at = "12ms", inputs = { gpio.both = { quality = "bad" } }, expect = { outputs = { fast.outputs.position = { value = false, quality = "bad" }, seen.outputs.position = { quality = "good" }, lane.trip.scans = 2 } } },
            { at = "20ms", expect = { outputs = { seen.outputs.position = { quality = "bad" } }, alarms = ["fast.alarms.io-error", "seen.alarms.io-error"] } },
            { at = "23ms", inputs = { gpio.both = { value = true, quality = "uncertain" } }, expect = { outputs = { fast.outputs.position = { value = true, quality = "uncertain" }, lane.trip.scans = 3 }, records = ["gpio.both rising"] } },
            { at = "24ms", inputs = { gpio.both = true }, expect = { outputs = { fast.outputs.position = { value = true, quality = "good" }, lane.trip.scans = 4 } } },
            { at = "25ms", inputs = { gpio.both = { value = true, quality = "good" } }, expect = { outputs = { lane.trip.scans = 4 } } },
        ]
        [[case]]
        name = "a line of which one edge counts"
        step = [
            { at = "5ms", inputs = { gpio.rising = { value = true, quality = "bad" } }, expect = { outputs = { once.outputs.position = { value = true, quality = "bad" }, lane.trip.scans = 2 } } },
            { at = "6ms", inputs = { gpio.rising = { value = false, quality = "bad" } }, expect = { outputs = { gpio.rising = { value = false, quality = "bad" }, lane.trip.scans = 2 } } },
            { at = "7ms", inputs = { gpio.rising = false }, expect = { outputs = { once.outputs.position = { value = false, quality = "good" }, lane.trip.scans = 3 } } },
        ]
        [[case]]
        name = "a line that is polled"
        step = [
            { at = "1.5ms", inputs = { gpio.polled = { quality = "bad" } }, expect = { outputs = { slow.outputs.position = { quality = "good" } } } },
            { at = "2ms", expect = { outputs = { slow.outputs.position = { value = false, quality = "bad" } }, alarms = ["slow.alarms.io-error"] } },
        ]
        "#,
    );
}

#[test]
fn tables_have_a_column_for_it_on_either_side_of_the_value_s() {
    let csv = "at,inputs.field.contact.quality,inputs.field.contact,outputs.shut.outputs.position,outputs.shut.outputs.position.quality\n\
               0ms,bad,true,true,bad\n10ms,uncertain,,true,uncertain\n20ms,,false,false,good\n30ms,bad,,false,bad\n";
    Folder::new(PLANT).with("contact.csv", csv.as_bytes()).passes(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "beside the file"
        table = "contact.csv"
        [[case]]
        name = "in it"
        [[case.table]]
        columns = ["at", "inputs.field.temperature", "inputs.field.temperature.quality", "outputs.hot.outputs.value"]
        rows = [
            ["0ms", 20, "", { value = 20, quality = "good" }],
            ["10ms", { quality = "bad" }, "", { value = 20, quality = "bad" }],
            ["20ms", 30, "uncertain", { quality = "uncertain" }],
            ["30ms", "", "good", { value = 30, quality = "good" }],
            ["40ms", { value = 0, quality = "bad" }, "", { value = 30, quality = "bad" }],
        ]
        "#,
    );
}

#[test]
fn a_failure_shows_the_quality_of_the_points() {
    let told = Folder::new(PLANT).told(
        r#"
        plant = "plant.toml"
        [[case]]
        name = "the transmitter is bad"
        step = [
            { at = "0ms", inputs = { field.temperature = 20 } },
            { at = "20ms", inputs = { field.temperature = { quality = "bad" } }, expect = { outputs = { hot.outputs.value = { quality = "uncertain" } } } },
        ]
        "#,
    );
    insta::assert_snapshot!("quality", told);
}

#[test]
fn what_the_page_shows_of_a_transmitter_that_fails_passes() {
    let page = include_str!("../../../../docs/testing-a-plant.md");
    let (_, rest) = page.split_once("### A transmitter that fails\n\n```toml\n").expect("the section");
    let (text, _) = rest.split_once("```").expect("the end of the block");
    Folder::new(PLANT).passes(text);
}
