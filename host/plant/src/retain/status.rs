//! What is kept, how often, and what it costs.

use super::Keeper;
use serde_json::{Value, json};

impl Keeper {
    /// For the plant's status; `None` when nothing is kept.
    pub(crate) fn status(&self) -> Option<Value> {
        let keeping = self.keeping.as_ref().filter(|k| !k.members.is_empty())?;
        let figures = keeping.vault.figures();
        let blocks = keeping.members.iter().filter(|m| m.fields > 0).map(|member| {
            json!({
                "name": member.name,
                "fields": member.fields,
                "save-max-ns": member.took.longest(),
                "saved-ns": member.saved,
            })
        });
        Some(json!({
            "every-ns": keeping.every,
            "rounds": figures.rounds,
            "writes": figures.writes,
            "bytes": figures.bytes,
            "bytes-a-day": figures.bytes_a_day(keeping.every),
            "blocks": blocks.collect::<Vec<_>>(),
        }))
    }
}
