//! What changes something: settings, forces, commands; and the sign of life.

use crate::reply::Failure;
use crate::request::{Caller, Fields, Query};
use crate::server::Shared;
use axum::Json;
use axum::extract::{Path, State};
use latchwork_plant::operate::{Answer, Operation};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;

type Answered = Result<Json<Answer>, Failure>;

/// Nothing but a reason.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reason {
    reason: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Set {
    values: BTreeMap<String, Value>,
    #[serde(default)]
    write: bool,
    reason: Option<String>,
}

/// A value as the plant takes it: text.
pub(super) fn text(tag: &str, value: Value) -> Result<String, Failure> {
    match value {
        Value::String(text) => Ok(text),
        Value::Bool(_) | Value::Number(_) => Ok(value.to_string()),
        Value::Null | Value::Array(_) | Value::Object(_) => {
            Err(Failure::value(format!("`{tag}` is {value}; expected a string, a number, true or false")))
        }
    }
}

pub(super) async fn set(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Set>) -> Answered {
    if f.values.is_empty() {
        return Err(Failure::value("`values` is empty; expected tags with their new values"));
    }
    let values = f.values.into_iter().map(|(tag, value)| text(&tag, value).map(|v| (tag, v)));
    let values = values.collect::<Result<Vec<_>, _>>()?;
    caller.ask(&shared, f.reason, Operation::Set { values, write: f.write }).await.map(Json)
}

pub(super) async fn write(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(block): Path<String>,
    Fields(f): Fields<Reason>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::WriteValues { block }).await.map(Json)
}

pub(super) async fn discard(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(block): Path<String>,
    Fields(f): Fields<Reason>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::DiscardValues { block }).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Force {
    tag: String,
    value: Value,
    reason: Option<String>,
}

pub(super) async fn force(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Force>) -> Answered {
    let value = text("value", f.value)?;
    caller.ask(&shared, f.reason, Operation::Force { tag: f.tag, value }).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Unforce {
    tag: String,
    reason: Option<String>,
}

/// Its fields stand in the query: many clients send no body with DELETE.
pub(super) async fn unforce(State(shared): State<Arc<Shared>>, caller: Caller, Query(q): Query<Unforce>) -> Answered {
    caller.ask(&shared, q.reason, Operation::Unforce { tag: q.tag }).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Command {
    tag: String,
    on: Option<bool>,
    reason: Option<String>,
}

pub(super) async fn command(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Command>) -> Answered {
    caller.ask(&shared, f.reason, Operation::Command { tag: f.tag, on: f.on }).await.map(Json)
}

pub(super) async fn heartbeat(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Fields(f): Fields<Reason>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::Heartbeat).await.map(Json)
}
