//! Records, from the journal on disk: what is shown here survives a power failure.

use crate::reply::Failure;
use crate::request::{Caller, Query};
use crate::server::Shared;
use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use globset::{GlobBuilder, GlobMatcher};
use latchwork_record::journal::{Filter, Reader};
use latchwork_record::{Kind, Record};
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Records of an answer, when no limit is given, and at most.
const LIMIT: (usize, usize) = (100, 10_000);
/// Records read from the disk at once.
const PAGE: u64 = 4_000;
/// Records looked through for one answer; `next` says where to go on.
const LOOK: u64 = 400_000;
/// How often the journal is looked at for new records.
const FOLLOW: Duration = Duration::from_millis(100);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    after: Option<u64>,
    from: Option<String>,
    to: Option<String>,
    kind: Option<String>,
    source: Option<String>,
    limit: Option<usize>,
    #[serde(default)]
    follow: bool,
}

/// An answer.
#[derive(Serialize)]
struct Found {
    records: Vec<Record>,
    /// Number up to which the journal was looked through: `after` of the next request.
    next: u64,
}

/// What is looked for.
#[derive(Clone)]
struct Search {
    folder: PathBuf,
    from: u64,
    to: u64,
    kind: Option<Kind>,
    source: Option<GlobMatcher>,
    limit: usize,
}

pub(super) async fn records(
    State(shared): State<Arc<Shared>>,
    caller: Caller,
    Query(q): Query<Wanted>,
) -> Result<Response, Failure> {
    caller.may_view(&shared).await?;
    let Some(folder) = shared.data.clone() else {
        return Err(Failure::state("the plant keeps no journal; run it with --data DIR"));
    };
    let search = Search::new(folder, &q)?;
    if !q.follow {
        let found = blocking(&shared, move || match q.after {
            Some(after) => search.forward(after),
            None if q.from.is_some() => search.forward(0),
            None => search.newest(),
        });
        return Ok(Json(found.await?).into_response());
    }
    let after = match q.after {
        Some(after) => after,
        None => {
            let search = search.clone();
            blocking(&shared, move || search.last()).await?
        }
    };
    let lines = futures_util::stream::unfold((shared, search, after, false), async |(shared, search, after, over)| {
        if over {
            return None;
        }
        Some(follow(shared, search, after).await)
    });
    Ok(([(header::CONTENT_TYPE, "application/jsonl")], Body::from_stream(lines)).into_response())
}

type Followed = (Result<Bytes, Infallible>, (Arc<Shared>, Search, u64, bool));

/// Waits for the next lines.
async fn follow(shared: Arc<Shared>, search: Search, mut after: u64) -> Followed {
    loop {
        let this = search.clone();
        let (lines, next) = match blocking(&shared, move || this.forward(after)).await {
            Ok(found) => (found.records.iter().map(|r| r.to_json() + "\n").collect::<String>(), found.next),
            Err(failure) => return (Ok((failure.json() + "\n").into()), (shared, search, after, true)),
        };
        if !lines.is_empty() {
            return (Ok(lines.into()), (shared, search, next, false));
        }
        if next == after {
            tokio::time::sleep(FOLLOW).await;
        }
        after = next;
    }
}

async fn blocking<T: Send + 'static>(
    shared: &Shared,
    read: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let turn = Arc::clone(&shared.reading).acquire_owned().await;
    let turn = turn.map_err(|e| Failure::internal(format!("the journal was not read: {e}")))?;
    // The turn ends with the reading, not with the client that may have gone.
    let reading = move || {
        let _turn = turn;
        read()
    };
    let done = tokio::task::spawn_blocking(reading).await;
    done.map_err(|e| Failure::internal(format!("the journal was not read: {e}")))?
}

impl Search {
    fn new(folder: PathBuf, q: &Wanted) -> Result<Self, Failure> {
        let time = |name: &str, text: &Option<String>, default: u64| match text {
            None => Ok(default),
            Some(text) => instant(text).ok_or_else(|| {
                let message = format!("`{name}` is \"{text}\"; expected a time such as 2026-11-27T09:30:00Z");
                Failure::value(message)
            }),
        };
        let kind = q.kind.as_ref().map(|word| {
            Kind::ALL.into_iter().find(|k| k.name() == word).ok_or_else(|| {
                let words = Kind::ALL.map(Kind::name).join(", ");
                Failure::value(format!("`kind` is \"{word}\"; expected one of {words}"))
            })
        });
        let source = q.source.as_ref().map(|glob| {
            let built = GlobBuilder::new(glob).build();
            built.map(|g| g.compile_matcher()).map_err(|e| Failure::value(format!("`source`: {e}")))
        });
        let limit = q.limit.unwrap_or(LIMIT.0);
        if limit == 0 || limit > LIMIT.1 {
            return Err(Failure::value(format!("`limit` is {limit}; expected 1 to {}", LIMIT.1)));
        }
        let (from, to) = (time("from", &q.from, 0)?, time("to", &q.to, u64::MAX)?);
        Ok(Self { folder, from, to, kind: kind.transpose()?, source: source.transpose()?, limit })
    }

    fn open(&self) -> Result<Reader, Failure> {
        Reader::open(&self.folder).map_err(|e| Failure::state(e.to_string()))
    }

    fn matches(&self, record: &Record) -> bool {
        (self.from..self.to).contains(&record.time)
            && self.kind.is_none_or(|kind| record.kind == kind)
            && self.source.as_ref().is_none_or(|glob| glob.is_match(&record.source))
    }

    /// Number of the newest record.
    fn last(&self) -> Result<u64, Failure> {
        self.open()?.last().map_err(|e| Failure::state(e.to_string()))
    }

    /// The first records that match, after a number.
    fn forward(&self, after: u64) -> Result<Found, Failure> {
        let reader = self.open()?;
        let mut found = Found { records: Vec::new(), next: after };
        let mut looked = 0;
        while looked < LOOK {
            let filter = Filter { after: found.next, ..Filter::default() };
            let page = reader.records(filter, PAGE as usize).map_err(|e| Failure::state(e.to_string()))?;
            if page.is_empty() {
                break;
            }
            looked += page.len() as u64;
            for record in page {
                found.next = record.seq;
                if self.matches(&record) {
                    found.records.push(record);
                    if found.records.len() == self.limit {
                        return Ok(found);
                    }
                }
            }
        }
        Ok(found)
    }

    /// The newest records that match, in their order.
    fn newest(&self) -> Result<Found, Failure> {
        let reader = self.open()?;
        let failed = |e: latchwork_record::journal::JournalError| Failure::state(e.to_string());
        let next = reader.last().map_err(failed)?;
        let (mut records, mut before, mut looked) = (Vec::new(), next, 0);
        while records.len() < self.limit && before > 0 && looked < LOOK {
            let after = before.saturating_sub(PAGE);
            let page =
                reader.records(Filter { after, ..Filter::default() }, (before - after) as usize).map_err(failed)?;
            let newer = page.into_iter().filter(|r| r.seq <= before && self.matches(r)).rev();
            records.extend(newer.take(self.limit - records.len()));
            (before, looked) = (after, looked + PAGE);
        }
        records.reverse();
        Ok(Found { records, next })
    }
}

/// A point in time, ns since 1970.
fn instant(text: &str) -> Option<u64> {
    let time = text.parse::<jiff::Timestamp>().ok()?;
    u64::try_from(time.as_nanosecond()).ok()
}
