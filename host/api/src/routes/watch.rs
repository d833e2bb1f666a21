//! Values that are followed: first every tag, then those that have changed, as JSON Lines.
//!
//! The next line is made when the client has taken the last one: one that reads slowly gets what is true then, and costs no memory.

use super::read::everything;
use crate::reply::Failure;
use crate::request::{Caller, Query};
use crate::server::Shared;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use latchwork_image::{format_duration, parse_duration};
use latchwork_plant::operate::{Answer, Operation, TagRow};
use latchwork_record::rfc3339;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Shortest period, ns: what is faster is for traces.
const SHORTEST: u64 = 50_000_000;
/// Longest period, ns.
const LONGEST: u64 = 3600 * 1_000_000_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Watch {
    #[serde(rename = "match", default = "everything")]
    tags: Vec<String>,
    every: Option<String>,
}

/// A line: a tag with the time at which it was read.
#[derive(Serialize)]
struct Line<'a> {
    time: &'a str,
    #[serde(flatten)]
    row: &'a TagRow,
}

struct Follower {
    shared: Arc<Shared>,
    caller: Caller,
    tags: Vec<String>,
    every: Duration,
    seen: HashMap<String, TagRow>,
    /// Lines that were made while the request was still being judged.
    first: Option<Bytes>,
    over: bool,
}

pub(super) async fn watch(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Query(q): Query<Watch>,
) -> Result<Response, Failure> {
    let every = q.every.as_deref().map_or(Ok(200_000_000), parse_duration);
    let every = every.map_err(|e| Failure::value(format!("`every`: {e}")))?;
    if !(SHORTEST..=LONGEST).contains(&every) {
        let [found, min, max] = [every, SHORTEST, LONGEST].map(format_duration);
        return Err(Failure::value(format!("`every` is {found}; expected {min} to {max}")));
    }
    let every = Duration::from_nanos(every);
    let mut follower = Follower { shared, caller, tags: q.tags, every, seen: HashMap::new(), first: None, over: false };
    // What is wrong with the names is told as the answer's status.
    follower.first = Some(follower.read().await?);
    let lines = futures_util::stream::unfold(follower, async |mut follower| {
        follower.next().await.map(|lines| (Ok::<_, Infallible>(lines), follower))
    });
    Ok(([(header::CONTENT_TYPE, "application/jsonl")], Body::from_stream(lines)).into_response())
}

impl Follower {
    /// Lines about what has changed; `None` once the plant has ended.
    async fn next(&mut self) -> Option<Bytes> {
        if self.over {
            return None;
        }
        if let Some(first) = self.first.take() {
            return Some(first);
        }
        loop {
            tokio::time::sleep(self.every).await;
            match self.read().await {
                Ok(lines) if lines.is_empty() => {}
                Ok(lines) => return Some(lines),
                Err(failure) if failure.reason == "busy" => {}
                Err(failure) => {
                    self.over = true;
                    return Some((failure.json() + "\n").into());
                }
            }
        }
    }

    async fn read(&mut self) -> Result<Bytes, Failure> {
        let operation = Operation::Read { tags: self.tags.clone() };
        let Answer::Tags(rows) = self.caller.ask(&self.shared, None, operation).await? else {
            return Err(Failure::internal("the plant gave another answer than tags"));
        };
        let time = now();
        let mut lines = Vec::new();
        for row in rows {
            if self.seen.get(&row.tag) == Some(&row) {
                continue;
            }
            let written = serde_json::to_writer(&mut lines, &Line { time: &time, row: &row });
            written.map_err(|e| Failure::internal(format!("a tag could not be written: {e}")))?;
            lines.push(b'\n');
            self.seen.insert(row.tag.clone(), row);
        }
        Ok(lines.into())
    }
}

fn now() -> String {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    rfc3339(u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}
