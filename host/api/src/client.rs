//! A client of the control socket that waits for its answers: what the command line uses.

use crate::ORIGIN;
use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::client::conn::http1;
use hyper::{Method, Request, Response};
use hyper_util::rt::TokioIo;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::future::Future;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::net::UnixStream;
use tokio::runtime::Runtime;

/// Longest wait for an answer: longer than the plant may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// The same, with a component to send.
const UPLOAD: Duration = Duration::from_secs(600);

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// There is no such socket.
    #[error(
        "no plant listens at {path}: there is no such socket; start one with `latchwork run PLANT --socket {path}`"
    )]
    Missing {
        /// Socket.
        path: PathBuf,
    },
    /// A socket that nobody serves.
    #[error("no plant listens at {path}: the socket is left of one that has ended")]
    Stale {
        /// Socket.
        path: PathBuf,
    },
    /// The file may not be opened.
    #[error(
        "{path} may not be opened by this user; only the user the plant runs as and root may, unless [policy] in the plant file \
         names others"
    )]
    Denied {
        /// Socket.
        path: PathBuf,
    },
    /// The plant says no.
    #[error("{message}")]
    Refused {
        /// Status of HTTP.
        status: u16,
        /// In one word.
        reason: String,
        /// For a person.
        message: String,
    },
    /// The connection broke, or whoever listens there is no plant.
    #[error("{path} does not answer as a plant does: {why}")]
    Broken {
        /// Socket.
        path: PathBuf,
        /// What was found.
        why: String,
    },
    /// This process lacks something.
    #[error("the client could not be started: {0}")]
    Start(std::io::Error),
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Failure {
    reason: String,
    message: String,
}

/// A client. Each request has a connection of its own, so that a plant that was restarted meanwhile is no error.
pub struct Client {
    path: PathBuf,
    origin: &'static str,
    runtime: Runtime,
}

impl Client {
    /// A client of a socket; `origin` is one of `cli`, `script`, `panel`, `api`.
    ///
    /// # Errors
    /// A process that can open nothing more.
    pub fn new(path: &Path, origin: &'static str) -> Result<Self, ClientError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(ClientError::Start)?;
        Ok(Self { path: path.into(), origin, runtime })
    }

    /// Asks for something; `query` are the fields behind the question mark.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn get<T: DeserializeOwned>(&self, path: &str, query: &[(&str, &str)]) -> Result<T, ClientError> {
        self.whole(Method::GET, &target(path, query), None)
    }

    /// Asks for a file.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn file(&self, path: &str) -> Result<Vec<u8>, ClientError> {
        self.wait(async {
            let response = self.send(Method::GET, path, None).await?;
            Ok(self.judged(response).await?.collect().await.map_err(|e| self.broken(e))?.to_bytes().into())
        })
    }

    /// Wants something to be done.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn post<T: DeserializeOwned>(&self, path: &str, body: &impl Serialize) -> Result<T, ClientError> {
        let body = serde_json::to_vec(body).map_err(|e| self.broken(format!("the request is no JSON: {e}")))?;
        self.whole(Method::POST, path, Some(body))
    }

    /// The same for what is large and takes its time to send.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn upload<T: DeserializeOwned>(&self, path: &str, body: Vec<u8>) -> Result<T, ClientError> {
        self.within(UPLOAD, self.answer(Method::POST, path, Some(body)))
    }

    /// Takes something away.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn delete<T: DeserializeOwned>(&self, path: &str, query: &[(&str, &str)]) -> Result<T, ClientError> {
        self.whole(Method::DELETE, &target(path, query), None)
    }

    /// Follows JSON Lines.
    ///
    /// # Errors
    /// What the plant refuses; nobody who listens.
    pub fn lines(&self, path: &str, query: &[(&str, &str)]) -> Result<Lines<'_>, ClientError> {
        let target = target(path, query);
        let body = self.wait(async {
            let response = self.send(Method::GET, &target, None).await?;
            self.judged(response).await
        })?;
        Ok(Lines { client: self, body, text: Vec::new() })
    }

    fn whole<T: DeserializeOwned>(
        &self,
        method: Method,
        target: &str,
        body: Option<Vec<u8>>,
    ) -> Result<T, ClientError> {
        self.wait(self.answer(method, target, body))
    }

    async fn answer<T: DeserializeOwned>(
        &self,
        method: Method,
        target: &str,
        body: Option<Vec<u8>>,
    ) -> Result<T, ClientError> {
        let response = self.send(method, target, body).await?;
        let body = self.judged(response).await?.collect().await.map_err(|e| self.broken(e))?.to_bytes();
        serde_json::from_slice(&body).map_err(|e| self.broken(format!("its answer is not what was expected: {e}")))
    }

    fn wait<T>(&self, work: impl Future<Output = Result<T, ClientError>>) -> Result<T, ClientError> {
        self.within(PATIENCE, work)
    }

    fn within<T>(
        &self,
        patience: Duration,
        work: impl Future<Output = Result<T, ClientError>>,
    ) -> Result<T, ClientError> {
        self.runtime.block_on(async {
            let late = || self.broken(format!("no answer within {} s", patience.as_secs()));
            tokio::time::timeout(patience, work).await.unwrap_or_else(|_| Err(late()))
        })
    }

    async fn send(
        &self,
        method: Method,
        target: &str,
        body: Option<Vec<u8>>,
    ) -> Result<Response<Incoming>, ClientError> {
        let stream = UnixStream::connect(&self.path).await.map_err(|error| self.unreachable(&error))?;
        let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await.map_err(|e| self.broken(e))?;
        // Its errors are those of the request, too.
        self.runtime.spawn(connection);
        let request =
            Request::builder().method(method).uri(target).header("host", "localhost").header(ORIGIN, self.origin);
        let request = if body.is_some() { request.header("content-type", "application/json") } else { request };
        let request = request.body(Full::new(Bytes::from(body.unwrap_or_default())));
        let request = request.map_err(|e| self.broken(format!("the request could not be made: {e}")))?;
        sender.send_request(request).await.map_err(|e| self.broken(e))
    }

    /// The body of an answer that is good news.
    async fn judged(&self, response: Response<Incoming>) -> Result<Incoming, ClientError> {
        let status = response.status();
        if status.is_success() {
            return Ok(response.into_body());
        }
        let body = response.into_body().collect().await.map_err(|e| self.broken(e))?.to_bytes();
        match serde_json::from_slice::<Failure>(&body) {
            Ok(Failure { reason, message }) => Err(ClientError::Refused { status: status.as_u16(), reason, message }),
            Err(_) => Err(self.broken(format!("status {status}"))),
        }
    }

    fn unreachable(&self, error: &std::io::Error) -> ClientError {
        let path = self.path.clone();
        match error.kind() {
            ErrorKind::NotFound => ClientError::Missing { path },
            ErrorKind::ConnectionRefused => ClientError::Stale { path },
            ErrorKind::PermissionDenied => ClientError::Denied { path },
            _ => self.broken(error),
        }
    }

    fn broken(&self, why: impl ToString) -> ClientError {
        ClientError::Broken { path: self.path.clone(), why: why.to_string() }
    }
}

fn target(path: &str, query: &[(&str, &str)]) -> String {
    match serde_html_form::to_string(query) {
        Ok(text) if !text.is_empty() => format!("{path}?{text}"),
        _ => path.into(),
    }
}

/// A name as a part of a path.
pub fn path_part(name: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// Lines that come as long as the plant runs.
pub struct Lines<'a> {
    client: &'a Client,
    body: Incoming,
    text: Vec<u8>,
}

impl Lines<'_> {
    /// The next line within some time; `None` in time for none, an error once the other end has closed.
    ///
    /// # Errors
    /// The end of the connection; what the plant says about it.
    pub fn next<T: DeserializeOwned>(&mut self, within: Duration) -> Result<Option<T>, ClientError> {
        loop {
            if let Some(end) = self.text.iter().position(|b| *b == b'\n') {
                let line: Vec<u8> = self.text.drain(..=end).collect();
                if let Ok(Failure { reason, message }) = serde_json::from_slice(&line) {
                    return Err(ClientError::Refused { status: 503, reason, message });
                }
                let read = serde_json::from_slice(&line);
                let unexpected = |e| self.client.broken(format!("its answer is not what was expected: {e}"));
                return read.map(Some).map_err(unexpected);
            }
            let frame = self.client.runtime.block_on(async { tokio::time::timeout(within, self.body.frame()).await });
            match frame {
                Err(_) => return Ok(None),
                Ok(Some(Ok(frame))) => self.text.extend(frame.into_data().unwrap_or_default()),
                Ok(Some(Err(_)) | None) => {
                    let message = "the plant has closed the connection; it may have ended".into();
                    return Err(ClientError::Refused { status: 503, reason: "gone".into(), message });
                }
            }
        }
    }
}
