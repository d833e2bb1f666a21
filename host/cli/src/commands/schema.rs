//! `latchwork schema`

use crate::Exit;
use anyhow::Result;

pub(super) fn execute() -> Result<Exit> {
    println!("{}", serde_json::to_string_pretty(&latchwork_plant::schema::json_schema())?);
    Ok(Exit::Fine)
}
