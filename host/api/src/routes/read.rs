//! What is only looked at.

use crate::reply::Failure;
use crate::request::{Caller, Query};
use crate::server::Shared;
use axum::Json;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::IntoResponse;
use latchwork_plant::operate::{Answer, Operation};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

type Answered = Result<Json<Answer>, Failure>;

/// Nothing may be given.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Nothing {}

/// Which plant this is; needs no right.
pub(super) async fn greeting(State(shared): State<Arc<Shared>>) -> Json<Value> {
    Json(json!({ "plant": shared.plant, "latchwork": env!("CARGO_PKG_VERSION"), "document": "/openapi.json" }))
}

/// The document; needs no right.
pub(super) async fn document() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], crate::OPENAPI)
}

pub(super) async fn status(State(shared): State<Arc<Shared>>, caller: Caller, _: Query<Nothing>) -> Answered {
    caller.ask(&shared, None, Operation::Status).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tags {
    #[serde(rename = "match", default = "everything")]
    tags: Vec<String>,
}

/// What is read when no name is given.
pub(super) fn everything() -> Vec<String> {
    vec!["*".into()]
}

pub(super) async fn tags(State(shared): State<Arc<Shared>>, caller: Caller, Query(q): Query<Tags>) -> Answered {
    caller.ask(&shared, None, Operation::Read { tags: q.tags }).await.map(Json)
}

pub(super) async fn settings(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(block): Path<String>,
    _: Query<Nothing>,
) -> Answered {
    caller.ask(&shared, None, Operation::ReadValues { block }).await.map(Json)
}

pub(super) async fn forces(State(shared): State<Arc<Shared>>, caller: Caller, _: Query<Nothing>) -> Answered {
    caller.ask(&shared, None, Operation::Forces).await.map(Json)
}

/// The flight recorder's memory, as a file.
pub(super) async fn recording(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    _: Query<Nothing>,
) -> Result<impl IntoResponse, Failure> {
    let bytes = match caller.ask(&shared, None, Operation::Recording).await? {
        Answer::Recording(bytes) => bytes,
        _ => Vec::new(),
    };
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes))
}
