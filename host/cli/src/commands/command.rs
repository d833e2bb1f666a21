//! `latchwork command`, `latchwork heartbeat`

use super::client::each;
use crate::Exit;
use crate::args::operate::{Give, Heartbeat};
use anyhow::Result;
use serde_json::json;

pub(super) fn execute(args: &Give) -> Result<Exit> {
    let mut body = json!({ "tag": args.tag });
    if args.on || args.off {
        body["on"] = json!(args.on);
    }
    each(&args.change, std::iter::once(("/v1/commands", body)))
}

pub(super) fn heartbeat(args: &Heartbeat) -> Result<Exit> {
    each(&args.change, std::iter::once(("/v1/heartbeat", json!({}))))
}
