//! A record as files, displays and sinks see it.

use crate::Kind;
use latchwork_image::Value;
use serde::{Serialize, Serializer};
use std::borrow::Cow;

/// One numbered record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    /// Number, from 1, without gaps.
    pub seq: u64,
    /// Time of the event, ns since 1970-01-01T00:00:00Z.
    #[serde(serialize_with = "time")]
    pub time: u64,
    /// Kind.
    pub kind: Kind,
    /// What it is about: a tag, a block, a driver, a lane.
    pub source: String,
    /// What happened, in one word.
    pub transition: Cow<'static, str>,
    /// Value before.
    pub previous: Value,
    /// Value after.
    pub current: Value,
    /// 0 (a note) to 255.
    pub priority: u8,
    /// Who did it; empty for the plant itself.
    pub user: String,
    /// One sentence for a person; may be empty.
    pub text: String,
}

/// A record that has no number yet. Its time is plant time, ns.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// Plant time, ns.
    pub time: u64,
    /// Kind.
    pub kind: Kind,
    /// What it is about.
    pub source: String,
    /// What happened, in one word.
    pub transition: Cow<'static, str>,
    /// Value before.
    pub previous: Value,
    /// Value after.
    pub current: Value,
    /// 0 (a note) to 255.
    pub priority: u8,
    /// Who did it; empty for the plant itself.
    pub user: String,
    /// One sentence for a person; may be empty.
    pub text: String,
}

impl Draft {
    /// A draft without values, priority, user and text.
    pub fn new(time: u64, kind: Kind, source: impl Into<String>, transition: &'static str) -> Self {
        Self {
            time,
            kind,
            source: source.into(),
            transition: transition.into(),
            previous: Value::None,
            current: Value::None,
            priority: 0,
            user: String::new(),
            text: String::new(),
        }
    }
}

/// What outlives the run together with the record that tells of it: the state of an alarm, a setting, a retained command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Name, as `alarm/unit.alarms.high`.
    pub name: String,
    /// State as text; `None` forgets it.
    pub value: Option<String>,
}

impl Record {
    /// The record as one line of JSON, without the line's end.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_else(|e| format!("{{\"seq\":{},\"error\":\"{e}\"}}", self.seq))
    }
}

fn time<S: Serializer>(time: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&rfc3339(*time))
}

/// Nanoseconds since 1970 as RFC 3339 in UTC with nine decimals.
pub fn rfc3339(ns: u64) -> String {
    match jiff::Timestamp::from_nanosecond(ns.into()) {
        Ok(t) => format!("{t:.9}"),
        Err(_) => format!("{ns}ns"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_form_is_the_contracts() {
        let record = Record {
            seq: 1,
            time: 1_250_000_000,
            kind: Kind::Alarm,
            source: "unit.alarms.high".into(),
            transition: "raised".into(),
            previous: Value::Boolean(false),
            current: Value::Boolean(true),
            priority: 100,
            user: String::new(),
            text: "level \"high\"".into(),
        };
        insta::assert_snapshot!(record.to_json(), @r#"{"seq":1,"time":"1970-01-01T00:00:01.250000000Z","kind":"alarm","source":"unit.alarms.high","transition":"raised","previous":false,"current":true,"priority":100,"user":"","text":"level \"high\""}"#);
    }

    #[test]
    fn what_json_cannot_hold_is_text() {
        assert_eq!(serde_json::to_string(&Value::Real(f64::NAN)).unwrap(), "\"NaN\"");
        assert_eq!(serde_json::to_string(&Value::Real(f64::NEG_INFINITY)).unwrap(), "\"-inf\"");
        assert_eq!(serde_json::to_string(&Value::Integer(u64::MAX.into())).unwrap(), "18446744073709551615");
    }
}
