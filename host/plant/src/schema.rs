//! The plant file as JSON Schema and as a reference page, both from the tables that check it.

use crate::file::sections;
use latchwork_io::kinds::KINDS;
use latchwork_schema::{json_schema as of, reference};
use serde_json::{Value, json};

/// JSON Schema (draft 7) of the plant file, for editors.
pub fn json_schema() -> Value {
    let kinds: Vec<_> = KINDS
        .iter()
        .map(|kind| {
            let mut driver = of(&[&sections::DRIVER, kind.keys]);
            driver["properties"]["kind"] = json!({ "const": kind.name });
            let point = of(&[kind.point_keys, &sections::POINT]);
            driver["properties"]["points"] = json!({
                "type": "object",
                "description": "Points by name.",
                "additionalProperties": point,
            });
            driver
        })
        .collect();
    let sinks: Vec<_> = latchwork_sink::kinds::KINDS
        .iter()
        .map(|kind| {
            let mut sink = of(&[&latchwork_sink::KEYS, kind.keys]);
            sink["properties"]["kind"] = json!({ "const": kind.name });
            sink
        })
        .collect();
    let source = json!({ "anyOf": [{ "type": ["boolean", "number", "string"] }, { "type": "object" }] });
    let mut block = of(&[&sections::BLOCK]);
    for (group, what) in [("inputs", &source), ("settings", &source), ("safe", &source)] {
        block["properties"][group]["type"] = json!("object");
        block["properties"][group]["additionalProperties"] = what.clone();
    }
    // Names with dots make nested tables: what has a component is a block, and both may hold further blocks.
    let named = json!({ "$ref": "#/definitions/block" });
    block["additionalProperties"] = named.clone();
    let beginning = json!({
        "type": "object",
        "description": "The beginning of names with dots.",
        "not": { "required": ["component"] },
        "additionalProperties": named,
    });
    let lanes = [of(&[&sections::LANE]), of(&[&sections::INTERRUPT_LANE])];
    let blocks = json!({ "type": "object", "additionalProperties": named });
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Latchwork plant file",
        "type": "object",
        "required": ["plant"],
        "additionalProperties": false,
        "definitions": { "block": { "anyOf": [block, beginning] } },
        "properties": {
            "plant": of(&[&sections::PLANT]),
            "lane": { "type": "object", "additionalProperties": { "anyOf": lanes } },
            "driver": { "type": "object", "additionalProperties": { "oneOf": kinds } },
            "block": blocks,
            "policy": of(&[&sections::POLICY]),
            "table": { "type": "object", "additionalProperties": of(&[&sections::TABLE]) },
            "heartbeat": of(&[&sections::HEARTBEAT]),
            "recorder": of(&[&sections::RECORDER]),
            "alarm": { "type": "array", "items": of(&[&sections::ALARM]) },
            "sink": { "type": "object", "additionalProperties": { "oneOf": sinks } },
            "journal": of(&[&sections::JOURNAL]),
            "sim": {
                "type": "object",
                "additionalProperties": false,
                "properties": {
                    "block": blocks,
                    "feed": { "type": "object", "description": "Tag that drives each input point, by name." },
                    "scan-time": {
                        "type": "object",
                        "description": "Virtual time that the scans of each lane take: one, or several in turn.",
                    },
                },
            },
        },
    })
}

/// The tables of docs/plant-file.md as Markdown.
pub fn reference_page() -> String {
    let mut page = String::new();
    let mut add = |title: &str, section| page += &format!("### {title}\n\n{}\n", reference(section));
    add("`[plant]`", &sections::PLANT);
    add("`[lane.NAME]`, cyclic", &sections::LANE);
    add("`[lane.NAME]`, interrupt", &sections::INTERRUPT_LANE);
    add("`[block.NAME]`", &sections::BLOCK);
    add("`{ tag = … }`, the source of an input", &sections::WIRE);
    add("`[[alarm]]`", &sections::ALARM);
    add("`[table.NAME]`", &sections::TABLE);
    add("`[heartbeat]`", &sections::HEARTBEAT);
    add("`[recorder]`", &sections::RECORDER);
    add("`[driver.NAME]`", &sections::DRIVER);
    add("Every point", &sections::POINT);
    add("`[policy]`", &sections::POLICY);
    for kind in KINDS {
        add(&format!("Driver `{}`", kind.name), kind.keys);
        add(&format!("Points of `{}`", kind.name), kind.point_keys);
    }
    add("`[journal]`", &sections::JOURNAL);
    add("`[sink.NAME]`", &latchwork_sink::KEYS);
    for kind in latchwork_sink::kinds::KINDS {
        add(&format!("Sink `{}`", kind.name), kind.keys);
    }
    page
}
