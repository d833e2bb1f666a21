//! Alarms: their list, and what operators do with them.

use crate::reply::Failure;
use crate::request::{Caller, Fields, Query};
use crate::server::Shared;
use axum::Json;
use axum::extract::State;
use latchwork_image::parse_duration;
use latchwork_plant::operate::{Answer, Operation};
use serde::Deserialize;
use std::sync::Arc;

type Answered = Result<Json<Answer>, Failure>;

/// Longest shelf, ns: what is hidden for longer is out of service.
const LONGEST_SHELF: u64 = 7 * 24 * 3600 * 1_000_000_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct List {
    #[serde(default)]
    all: bool,
}

pub(super) async fn list(State(shared): State<Arc<Shared>>, caller: Caller, Query(q): Query<List>) -> Answered {
    caller.ask(&shared, None, Operation::Alarms { all: q.all }).await.map(Json)
}

/// An alarm, or several by a glob.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Which {
    alarm: String,
    reason: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Acknowledge {
    alarm: String,
    seen: Option<u64>,
    reason: Option<String>,
}

pub(super) async fn acknowledge(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Fields(f): Fields<Acknowledge>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::Acknowledge { alarm: f.alarm, seen: f.seen }).await.map(Json)
}

pub(super) async fn reset(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Which>) -> Answered {
    caller.ask(&shared, f.reason, Operation::Reset { alarm: f.alarm }).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shelve {
    alarm: String,
    duration: String,
    reason: Option<String>,
}

pub(super) async fn shelve(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Shelve>) -> Answered {
    let duration = parse_duration(&f.duration).map_err(|e| Failure::value(format!("`duration`: {e}")))?;
    if duration == 0 || duration > LONGEST_SHELF {
        let found = &f.duration;
        return Err(Failure::value(format!(
            "`duration` is {found}; expected more than nothing and at most 168h; what is hidden for longer is out of service"
        )));
    }
    caller.ask(&shared, f.reason, Operation::Shelve { alarm: f.alarm, duration }).await.map(Json)
}

pub(super) async fn unshelve(State(shared): State<Arc<Shared>>, caller: Caller, Fields(f): Fields<Which>) -> Answered {
    caller.ask(&shared, f.reason, Operation::Unshelve { alarm: f.alarm }).await.map(Json)
}

pub(super) async fn out_of_service(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Fields(f): Fields<Which>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::OutOfService { alarm: f.alarm, out: true }).await.map(Json)
}

pub(super) async fn in_service(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Fields(f): Fields<Which>,
) -> Answered {
    caller.ask(&shared, f.reason, Operation::OutOfService { alarm: f.alarm, out: false }).await.map(Json)
}
