//! `[policy]`: who may do what.
//!
//! Whether a user or group is known belongs to the machine the plant will run on, not to the file: that is told at the start.

use super::sections;
use crate::operate::{Policy, RIGHTS, Whom};
use latchwork_schema::{Checker, Finding, Span, Value};
use toml::de::DeTable;

pub(super) fn policy(checker: &mut Checker, table: &DeTable<'_>, key: Span) -> Policy {
    checker.whose = "[policy]".into();
    let values = checker.table(&[&sections::POLICY], table, key);
    let mut policy = Policy::default();
    for right in RIGHTS {
        let Some(Value::List(list)) = values.get(right) else { continue };
        for (value, span) in list {
            let Value::Text(text) = value else { continue };
            match text.parse::<Whom>() {
                Ok(whom) => policy.give(right, whom),
                Err(error) => {
                    let near = meant(text).map(|t| format!("did you mean \"{t}\"?"));
                    checker.add(Finding::error(span, format!("`{right}`: {error}")).maybe_help(near));
                }
            }
        }
    }
    policy
}

/// What was probably meant.
fn meant(text: &str) -> Option<String> {
    match text {
        "all" | "any" | "anyone" | "anybody" | "everybody" | "*" => Some("everyone".into()),
        _ if text.is_empty() || text.contains(':') => None,
        _ if text.parse::<u32>().is_ok() => Some(format!("uid:{text}")),
        _ if text.starts_with(['@', '%']) => Some(format!("group:{}", &text[1..])),
        _ => Some(format!("user:{text}")),
    }
    .filter(|t| t.parse::<Whom>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_are_the_rights() {
        let keys: Vec<_> = sections::POLICY.keys.iter().map(|k| k.name).collect();
        assert_eq!(keys, RIGHTS);
    }

    #[test]
    fn slips_of_the_pen_are_understood() {
        for (text, near) in [
            ("alice", Some("user:alice")),
            ("1000", Some("uid:1000")),
            ("%wheel", Some("group:wheel")),
            ("all", Some("everyone")),
            ("users:alice", None),
            ("a b", None),
            ("", None),
        ] {
            assert_eq!(meant(text).as_deref(), near, "{text}");
        }
    }
}
