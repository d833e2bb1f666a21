//! What goes back: answers of the plant, and why there is none.

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use latchwork_plant::operate::Refused;
use serde_json::json;

/// Why a request does not come true; `{reason, message}` to the client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) status: StatusCode,
    /// In one word, for scripts.
    pub(crate) reason: &'static str,
    /// For a person.
    pub(crate) message: String,
}

impl Failure {
    fn new(status: StatusCode, reason: &'static str, message: impl Into<String>) -> Self {
        Self { status, reason, message: message.into() }
    }

    /// The request cannot be understood; the message names the field.
    pub(crate) fn malformed(message: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "malformed", message)
    }

    /// The value of a field does not fit.
    pub(crate) fn value(message: impl Into<String>) -> Self {
        Refused::new("value", message).into()
    }

    /// The plant is not in a state for it.
    pub(crate) fn state(message: impl Into<String>) -> Self {
        Refused::new("state", message).into()
    }

    /// Nobody has time.
    pub(crate) fn busy(message: impl Into<String>) -> Self {
        Refused::new("busy", message).into()
    }

    /// The policy does not allow it.
    pub(crate) fn forbidden(message: impl Into<String>) -> Self {
        Refused::new("forbidden", message).into()
    }

    /// Something of our own went wrong.
    pub(crate) fn internal(message: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, "failed", message)
    }

    /// The body is too large.
    pub(crate) fn large(limit: usize) -> Self {
        let message = format!("the body of the request is too large; expected at most {limit} bytes");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, "large", message)
    }

    /// The components of a swap are too large.
    pub(crate) fn large_components(limit: usize) -> Self {
        let message = format!("the components are too large; expected at most {limit} bytes together");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, "large", message)
    }

    /// The request did not arrive in time.
    pub(crate) fn slow() -> Self {
        Self::new(StatusCode::REQUEST_TIMEOUT, "slow", "the request did not arrive whole in time")
    }

    /// There is no such path.
    pub(crate) fn no_route(path: &str) -> Self {
        Self::new(StatusCode::NOT_FOUND, "unknown", format!("there is no {path}; /openapi.json lists all there is"))
    }

    /// There is the path, but not for this method.
    pub(crate) fn no_method(method: &str, path: &str) -> Self {
        let message = format!("{path} does not take {method}; /openapi.json lists all there is");
        Self::new(StatusCode::METHOD_NOT_ALLOWED, "method", message)
    }

    /// The body.
    pub(crate) fn json(&self) -> String {
        json!({ "reason": self.reason, "message": self.message }).to_string()
    }
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        let status = match refused.reason {
            "forbidden" => StatusCode::FORBIDDEN,
            "unknown" => StatusCode::NOT_FOUND,
            "value" => StatusCode::UNPROCESSABLE_ENTITY,
            "busy" | "gone" => StatusCode::SERVICE_UNAVAILABLE,
            _ => StatusCode::CONFLICT,
        };
        Self::new(status, refused.reason, refused.message)
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let mut response =
            (self.status, Json(json!({ "reason": self.reason, "message": self.message }))).into_response();
        // What is left of a body that nobody reads would be taken for the next request.
        if matches!(self.status, StatusCode::PAYLOAD_TOO_LARGE | StatusCode::REQUEST_TIMEOUT) {
            response.headers_mut().insert(header::CONNECTION, header::HeaderValue::from_static("close"));
        }
        response
    }
}
