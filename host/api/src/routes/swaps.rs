//! Swaps: another version of a block, how far it is, and the way back.

use super::change::text;
use super::read::Nothing;
use crate::reply::Failure;
use crate::request::{Caller, Fields, Query, json};
use crate::server::{Limits, Shared};
use crate::upload::{discard, receive};
use axum::Json;
use axum::extract::{Path, Request, State};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use latchwork_plant::operate::{Answer, Operation, Refused};
use latchwork_plant::swap::{Part, SwapOrder, Tolerance, WayBack};
use serde::Deserialize;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

type Answered = Result<Json<Answer>, Failure>;

/// Blocks of one swap.
const BLOCKS: usize = 256;
/// Longest shadow and probation, executions: eleven days of a lane of 1 ms.
const EXECUTIONS: u64 = 1_000_000_000;
/// Most characters of a file's name.
const NAME: usize = 128;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Start<'a> {
    #[serde(borrow)]
    blocks: Vec<Block<'a>>,
    #[serde(default)]
    shadow: u64,
    #[serde(default)]
    tolerances: BTreeMap<String, f64>,
    probation: Option<u64>,
    #[serde(default)]
    allow_lossy: bool,
    #[serde(default)]
    dry_run: bool,
    #[serde(default)]
    save: bool,
    reason: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Block<'a> {
    block: String,
    file: String,
    /// Base64.
    #[serde(borrow)]
    component: Option<Cow<'a, str>>,
    /// Instead: the block before this one that gets the same component.
    #[serde(rename = "same-as")]
    same_as: Option<String>,
    #[serde(default)]
    settings: BTreeMap<String, Value>,
    expects: Option<String>,
}

pub(super) async fn start(State(shared): State<Arc<Shared>>, caller: Caller, request: Request) -> Answered {
    if shared.gate.forbids(&caller.peer, "swap").is_some() {
        discard(request.into_body(), &shared).await;
        // The plant records that, and refuses; whatever was sent is nothing to it.
        return caller.ask(&shared, None, Operation::Swap(Box::new(nothing()))).await.map(Json);
    }
    let turn = match shared.uploads.turn(caller.peer.uid) {
        Ok(turn) => turn,
        Err(busy) => {
            discard(request.into_body(), &shared).await;
            return Err(busy);
        }
    };
    let declared = request.headers().get("content-length").and_then(|l| l.to_str().ok()?.parse::<u64>().ok());
    let bytes = receive(request.into_body(), declared, &shared).await?;
    let limits = shared.limits;
    let read = tokio::task::spawn_blocking(move || order(&bytes, &limits)).await;
    let (order, reason) = read.map_err(|e| Failure::internal(format!("the body could not be read: {e}")))??;
    let answer = caller.ask(&shared, reason, Operation::Swap(Box::new(order))).await;
    drop(turn);
    answer.map(Json)
}

/// What somebody wants who may not want anything.
fn nothing() -> SwapOrder {
    SwapOrder {
        parts: Vec::new(),
        shadow: 0,
        tolerances: Vec::new(),
        probation: 0,
        allow_lossy: false,
        dry_run: true,
        save: false,
    }
}

fn order(bytes: &[u8], limits: &Limits) -> Result<(SwapOrder, Option<String>), Failure> {
    let start: Start<'_> = json(bytes)?;
    if start.blocks.is_empty() || start.blocks.len() > BLOCKS {
        let found = start.blocks.len();
        return Err(Failure::value(format!("`blocks` has {found} entries; expected 1 to {BLOCKS}")));
    }
    let usual = |block: &Block<'_>| latchwork_plant::swap::usual_probation(&block.block);
    let probation = start.probation.or_else(|| start.blocks.first().map(usual)).unwrap_or_default();
    for (name, found) in [("shadow", start.shadow), ("probation", probation)] {
        if found > EXECUTIONS {
            return Err(Failure::value(format!("`{name}` is {found}; expected at most {EXECUTIONS} executions")));
        }
    }
    let tolerances = start.tolerances.into_iter().map(|(tag, within)| {
        let sound = within.is_finite() && within >= 0.0;
        let tolerance = Tolerance { tag, within };
        if sound { Ok(tolerance) } else { Err(wrong_tolerance(&tolerance)) }
    });
    let tolerances = tolerances.collect::<Result<_, _>>()?;
    let mut parts: Vec<Part> = Vec::with_capacity(start.blocks.len());
    let mut left = limits.components;
    for (at, block) in start.blocks.into_iter().enumerate() {
        let part = part(at, block, &parts)?;
        // One component for several blocks counts once.
        if !parts.iter().any(|p| Arc::ptr_eq(&p.bytes, &part.bytes)) {
            left = left.checked_sub(part.bytes.len()).ok_or_else(|| limits.too_large())?;
        }
        parts.push(part);
    }
    let order = SwapOrder {
        parts,
        shadow: start.shadow,
        tolerances,
        probation,
        allow_lossy: start.allow_lossy,
        dry_run: start.dry_run,
        save: start.save,
    };
    Ok((order, start.reason))
}

fn wrong_tolerance(tolerance: &Tolerance) -> Failure {
    let Tolerance { tag, within } = tolerance;
    Failure::value(format!("`tolerances.{tag}` is {within}; expected a number that is not negative"))
}

fn part(at: usize, block: Block<'_>, before: &[Part]) -> Result<Part, Failure> {
    let field = |name: &str| format!("blocks[{at}].{name}");
    if before.iter().any(|p| p.block == block.block) {
        return Err(Failure::value(format!("`{}` is {}, which is named twice", field("block"), block.block)));
    }
    let wrong = |c: char| c == '/' || c.is_control();
    let name = &block.file;
    if name.starts_with('.') || name.contains(wrong) || !name.ends_with(".wasm") || name.chars().count() > NAME {
        return Err(Failure::value(format!(
            "`{}` is \"{}\"; expected the name of a file such as tank-2.wasm, without its folder",
            field("file"),
            name.escape_debug()
        )));
    }
    let bytes = component(block.component.as_deref(), block.same_as.as_deref(), before, field)?;
    let settings = block.settings.into_iter().map(|(name, value)| {
        let tag = field(&format!("settings.{name}"));
        text(&tag, value).map(|value| (name, value))
    });
    let settings = settings.collect::<Result<_, _>>()?;
    Ok(Part { block: block.block, file: block.file, bytes, settings, expects: block.expects })
}

/// The component that was sent, or the one that another block gets, too; the same one for several blocks is held once.
fn component(
    sent: Option<&str>,
    same_as: Option<&str>,
    before: &[Part],
    field: impl Fn(&str) -> String,
) -> Result<Arc<[u8]>, Failure> {
    let [component, reference] = ["component", "same-as"].map(field);
    match (sent, same_as) {
        (Some(text), None) => {
            let bytes = BASE64_STANDARD.decode(text.as_bytes());
            let bytes = bytes.map_err(|e| Failure::value(format!("`{component}` is no base64: {e}")))?;
            let same = before.iter().find(|p| *p.bytes == *bytes).map(|p| Arc::clone(&p.bytes));
            Ok(same.unwrap_or_else(|| bytes.into()))
        }
        (None, Some(name)) => before.iter().find(|p| p.block == name).map(|p| Arc::clone(&p.bytes)).ok_or_else(|| {
            let name = name.escape_debug();
            Failure::value(format!("`{reference}` is \"{name}\"; expected the name of a block before this one"))
        }),
        (Some(_), Some(_)) => {
            Err(Failure::value(format!("`{component}` and `{reference}` are both given; expected one of them")))
        }
        (None, None) => Err(Failure::value(format!("neither `{component}` nor `{reference}` is given; expected one"))),
    }
}

pub(super) async fn list(State(shared): State<Arc<Shared>>, caller: Caller, _: Query<Nothing>) -> Answered {
    caller.ask(&shared, None, Operation::Swaps { number: None }).await.map(Json)
}

pub(super) async fn one(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(number): Path<String>,
    _: Query<Nothing>,
) -> Answered {
    let number = numbered(&number)?;
    match caller.ask(&shared, None, Operation::Swaps { number: Some(number) }).await? {
        Answer::Swaps(found) => {
            let one = found.into_iter().find(|s| s.number == number).ok_or_else(|| unknown(number))?;
            Ok(Json(Answer::Swap(Box::new(one))))
        }
        answer => Ok(Json(answer)),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cancel {
    reason: Option<String>,
}

pub(super) async fn cancel(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(number): Path<String>,
    Fields(f): Fields<Cancel>,
) -> Answered {
    let number = numbered(&number)?;
    caller.ask(&shared, f.reason, Operation::CancelSwap { number }).await.map(Json)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rollback {
    steps: Option<u64>,
    /// Beginning of the hash of the version, instead of steps.
    to: Option<String>,
    reason: Option<String>,
}

pub(super) async fn rollback(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Path(block): Path<String>,
    Fields(f): Fields<Rollback>,
) -> Answered {
    let to = match (f.steps, f.to) {
        (Some(_), Some(_)) => return Err(Failure::value("`steps` and `to` are both given; expected one of them")),
        (Some(0), None) => return Err(Failure::value("`steps` is 0; expected how many versions back, from 1")),
        (steps, None) => WayBack::Steps(steps.unwrap_or(1)),
        (None, Some(hash)) => WayBack::To(hash),
    };
    caller.ask(&shared, f.reason, Operation::Rollback { block, to }).await.map(Json)
}

fn numbered(text: &str) -> Result<u64, Failure> {
    text.parse()
        .map_err(|_| Failure::value(format!("the swap's number is \"{text}\"; expected a whole number, from 1")))
}

fn unknown(number: u64) -> Failure {
    Refused::new("unknown", format!("the plant knows no swap {number}; GET /v1/swaps lists those it knows")).into()
}
