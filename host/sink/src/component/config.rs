//! The plant file's table of a sink as JSON, for the logger.

use crate::Config;
use latchwork_image::format_duration;
use latchwork_schema::{Constant, Value, Values, format_size};
use serde_json::{Map, Value as Json, json};

/// The table with all its keys, the names of sink and plant beside them, and the identity of the journal.
pub(super) fn json(config: &Config) -> String {
    let mut table = object(&config.values);
    table.insert("name".into(), json!(config.name));
    table.insert("plant".into(), json!(config.plant));
    table.insert("journal".into(), json!(config.journal));
    Json::Object(table).to_string()
}

fn object(values: &Values) -> Map<String, Json> {
    values.entries.iter().map(|(key, (value, _))| (key.clone(), of(value))).collect()
}

fn of(value: &Value) -> Json {
    match value {
        Value::Text(text) => json!(text),
        Value::Bool(b) => json!(b),
        Value::Integer(i) => json!(i),
        // As they stand in the plant file, with their units.
        Value::Duration(ns) => json!(format_duration(*ns)),
        Value::Size(bytes) => json!(format_size(*bytes)),
        Value::Constant(Constant::Bool(b)) => json!(b),
        Value::Constant(Constant::Integer(i)) => json!(i),
        Value::Constant(Constant::Real(r)) => real(*r),
        Value::Constant(Constant::Text(text)) => json!(text),
        Value::List(list) => list.iter().map(|(v, _)| of(v)).collect(),
        Value::Table(values) => Json::Object(object(values)),
        Value::Map(entries) => Json::Object(entries.iter().map(|(key, _, v, _)| (key.clone(), of(v))).collect()),
        Value::Raw(raw) => toml(raw),
    }
}

/// What the logger's author asks for.
fn toml(value: &toml::Value) -> Json {
    match value {
        toml::Value::String(text) => json!(text),
        toml::Value::Integer(i) => json!(i),
        toml::Value::Float(r) => real(*r),
        toml::Value::Boolean(b) => json!(b),
        toml::Value::Datetime(time) => json!(time.to_string()),
        toml::Value::Array(list) => list.iter().map(toml).collect(),
        toml::Value::Table(table) => Json::Object(table.iter().map(|(key, v)| (key.clone(), toml(v))).collect()),
    }
}

/// JSON has no NaN and no infinities: they are carried as text.
fn real(real: f64) -> Json {
    if real.is_finite() { json!(real) } else { json!(format!("{real:?}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logger_gets_the_whole_table_with_units_and_the_names() {
        let at = |value| (value, 0..0);
        let raw: toml::Value = toml::from_str("a = [1, 2.5, nan]\nb = { c = 2026-11-27 }").expect("TOML");
        let entries = [
            ("budget", at(Value::Duration(2_500_000_000))),
            ("memory", at(Value::Size(64 << 20))),
            ("connect", at(Value::List(vec![at(Value::Text("127.0.0.1:9".into()))]))),
            ("config", at(Value::Raw(raw))),
        ];
        let values = Values { span: 0..0, entries: entries.map(|(k, v)| (k.to_owned(), v)).into() };
        let config = Config {
            name: "night".into(),
            plant: "pumps".into(),
            folder: "/".into(),
            components: Vec::new(),
            cache: None,
            journal: "5eed".into(),
            values,
        };
        let expected = json!({
            "budget": "2s 500ms", "memory": "64MiB", "connect": ["127.0.0.1:9"], "name": "night", "plant": "pumps",
            "journal": "5eed", "config": { "a": [1, 2.5, "NaN"], "b": { "c": "2026-11-27" } },
        });
        assert_eq!(serde_json::from_str::<Json>(&json(&config)).expect("JSON"), expected);
    }
}
