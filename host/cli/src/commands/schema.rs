//! `latchwork schema`

use crate::Exit;
use crate::report;
use anyhow::Result;

pub(super) fn execute() -> Result<Exit> {
    report::say(&format!("{}\n", serde_json::to_string_pretty(&latchwork_plant::schema::json_schema())?));
    Ok(Exit::Fine)
}
