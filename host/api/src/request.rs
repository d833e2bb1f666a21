//! What comes in: who asks, and fields that are checked before anything else happens.

use crate::ORIGIN;
use crate::peer::Peer;
use crate::reply::Failure;
use crate::server::Shared;
use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use latchwork_plant::operate::{Answer, Operation, Operator};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// Words that say where a wish comes from.
const ORIGINS: &[&str] = &["api", "cli", "panel", "script"];
/// Bytes a reason may have: it stands in a record.
const REASON: usize = 160;

/// Who asks, and from where.
pub(crate) struct Caller {
    pub(crate) peer: Arc<Peer>,
    origin: &'static str,
}

impl FromRequestParts<Arc<Shared>> for Caller {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, _: &Arc<Shared>) -> Result<Self, Failure> {
        let peer = parts.extensions.get::<Arc<Peer>>().cloned();
        let peer = peer.ok_or_else(|| Failure::internal("the connection has no user"))?;
        let origin = match parts.headers.get(ORIGIN) {
            None => ORIGINS[0],
            Some(said) => ORIGINS.iter().find(|o| said.as_bytes() == o.as_bytes()).copied().ok_or_else(|| {
                let said = String::from_utf8_lossy(said.as_bytes());
                Failure::malformed(format!("header {ORIGIN} is \"{said}\"; expected one of {}", ORIGINS.join(", ")))
            })?,
        };
        Ok(Self { peer, origin })
    }
}

impl Caller {
    /// Brings a wish to the plant, also one that the policy forbids: the plant records it and refuses.
    pub(crate) async fn ask(
        &self,
        shared: &Arc<Shared>,
        reason: Option<String>,
        operation: Operation,
    ) -> Result<Answer, Failure> {
        let reason = reason.unwrap_or_default();
        if reason.len() > REASON || reason.chars().any(char::is_control) {
            let message = format!("`reason`: expected one line of at most {REASON} bytes");
            return Err(Failure::value(message));
        }
        let forbidden = shared.gate.forbids(&self.peer, operation.right());
        let operator = Operator { user: self.peer.name(), origin: self.origin.into(), reason };
        let (console, limit, why) = (shared.console.clone(), shared.limits.plant, forbidden.clone());
        let asked = tokio::task::spawn_blocking(move || console.ask(operator, operation, why, limit)).await;
        let answer = asked.map_err(|e| Failure::internal(format!("the wish was lost: {e}")))?;
        match forbidden {
            // Whatever the plant says: what is forbidden does not come true.
            Some(why) => {
                tokio::time::sleep(shared.limits.forbidden).await;
                Err(answer.err().map_or_else(|| Failure::forbidden(why), Failure::from))
            }
            None => Ok(answer?),
        }
    }

    /// Passes only who may view, without asking the plant.
    pub(crate) async fn may_view(&self, shared: &Shared) -> Result<(), Failure> {
        match shared.gate.forbids(&self.peer, "view") {
            None => Ok(()),
            Some(why) => {
                tokio::time::sleep(shared.limits.forbidden).await;
                Err(Failure::forbidden(why))
            }
        }
    }
}

/// The fields of a JSON body; no body is one without fields.
pub(crate) struct Fields<T>(pub(crate) T);

impl<T: DeserializeOwned> FromRequest<Arc<Shared>> for Fields<T> {
    type Rejection = Failure;

    async fn from_request(request: Request, shared: &Arc<Shared>) -> Result<Self, Failure> {
        let limits = &shared.limits;
        let declared = request.headers().get("content-length").and_then(|l| l.to_str().ok()?.parse::<u64>().ok());
        if declared.is_some_and(|length| length > limits.body as u64) {
            return Err(Failure::large(limits.body));
        }
        let bytes = tokio::time::timeout(limits.idle, collect(request.into_body(), limits.body)).await;
        let bytes = bytes.map_err(|_| Failure::slow())??;
        json(&bytes).map(Self)
    }
}

/// Reads the fields of a body.
pub(crate) fn json<'de, T: Deserialize<'de>>(bytes: &'de [u8]) -> Result<T, Failure> {
    let text = if bytes.trim_ascii().is_empty() { b"{}" } else { bytes };
    // A list would be taken for the fields in their order.
    if text.trim_ascii_start().first() != Some(&b'{') {
        let begin = &text.trim_ascii_start()[..text.trim_ascii_start().len().min(80)];
        let begin: String = String::from_utf8_lossy(begin).chars().take(20).collect();
        return Err(Failure::malformed(format!("the body begins with `{begin}`; expected a JSON object")));
    }
    let mut json = serde_json::Deserializer::from_slice(text);
    let read = fields(&mut json, "the body")?;
    json.end().map_err(|e| Failure::malformed(format!("the body: {e}")))?;
    Ok(read)
}

async fn collect(body: Body, limit: usize) -> Result<Vec<u8>, Failure> {
    match Limited::new(body, limit).collect().await {
        Ok(whole) => Ok(whole.to_bytes().to_vec()),
        Err(error) if error.is::<LengthLimitError>() => Err(Failure::large(limit)),
        Err(error) => Err(Failure::malformed(format!("the body of the request breaks off: {error}"))),
    }
}

/// The fields behind the question mark.
pub(crate) struct Query<T>(pub(crate) T);

impl<T: DeserializeOwned> FromRequestParts<Arc<Shared>> for Query<T> {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, _: &Arc<Shared>) -> Result<Self, Failure> {
        let text = parts.uri.query().unwrap_or_default().as_bytes();
        fields(serde_html_form::Deserializer::from_bytes(text), "the query").map(Self)
    }
}

/// Reads fields; what is wrong names the field.
pub(crate) fn fields<'de, T: Deserialize<'de>, D: serde::Deserializer<'de>>(from: D, what: &str) -> Result<T, Failure>
where
    D::Error: std::fmt::Display,
{
    serde_path_to_error::deserialize(from).map_err(|error| {
        let path = error.path().to_string();
        let inner = error.inner();
        Failure::malformed(if path == "." || path.contains('?') {
            format!("{what}: {inner}")
        } else {
            format!("`{path}`: {inner}")
        })
    })
}
