//! Sections as JSON Schema (draft 7, which the TOML extensions of editors read).

use crate::{Key, Kind, Section};
use serde_json::{Map, Value, json};

/// The schema of a table whose keys are those of all `sections` together.
pub fn json_schema(sections: &[&Section]) -> Value {
    let keys: Vec<&Key> = sections.iter().flat_map(|s| s.keys).collect();
    let properties: Map<String, Value> = keys.iter().map(|k| (k.name.to_owned(), property(k))).collect();
    let required: Vec<_> = keys.iter().filter(|k| k.required).map(|k| k.name).collect();
    let mut schema = json!({
        "type": "object",
        "description": sections.first().map_or("", |s| s.doc),
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    schema
}

fn property(key: &Key) -> Value {
    let mut schema = kind(&key.kind);
    let default = if key.default.is_empty() { String::new() } else { format!(" Default: {}.", key.default) };
    schema["description"] = json!(format!("{}{default}", key.doc));
    schema
}

/// The schema of one kind of value.
fn kind(kind_of: &Kind) -> Value {
    match kind_of {
        Kind::Text | Kind::Tag => json!({ "type": "string" }),
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::Integer { min, max } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Kind::Duration { .. } => {
            // Only the unit is asked for: what else a duration may look like, the check knows.
            json!({ "type": "string", "pattern": "^ *0 *$|[0-9] *[a-zµ]" })
        }
        Kind::Size { .. } => json!({ "type": "string", "pattern": "^[0-9]+ ?(B|KiB|MiB|GiB)$" }),
        Kind::OneOf(words) => json!({ "type": "string", "enum": words }),
        Kind::Constant => json!({ "type": ["boolean", "number", "string"] }),
        Kind::List(of) => json!({ "type": "array", "items": kind(of) }),
        Kind::Table(section) => json_schema(&[section]),
        Kind::Map(of) => json!({ "type": "object", "additionalProperties": kind(of) }),
        Kind::Either(one, other) => json!({ "anyOf": [kind(one), kind(other)] }),
        Kind::Any => json!({}),
    }
}
