//! The WIT of loggers in Rust, and records in its types.

// What the macro writes has no comments; the WIT has them.
#[allow(missing_docs, unreachable_pub, clippy::all, reason = "generated from wit/journal")]
mod generated {
    wasmtime::component::bindgen!({
        path: "../../wit/journal",
        world: "logger",
        ownership: Borrowing { duplicate_if_necessary: false },
        exports: { default: async },
    });
}

use generated::latchwork::journal::types::{Kind, Value};
use latchwork_image::Value as Datum;
use latchwork_record::Record;

pub(super) use generated::latchwork::journal::types::Entry;
pub(super) use generated::{Logger, LoggerPre};

/// What of a batch must be written anew before entries can point at it: whole numbers that do not fit, in digits.
pub(super) struct Digits(Vec<[Option<String>; 2]>);

impl Digits {
    /// For the batch that is to be handed over.
    pub(super) fn of(batch: &[Record]) -> Self {
        let digits = |value: &Datum| match value {
            Datum::Integer(i) if i64::try_from(*i).is_err() => Some(i.to_string()),
            _ => None,
        };
        Self(batch.iter().map(|r| [digits(&r.previous), digits(&r.current)]).collect())
    }

    /// The batch as the logger gets it.
    pub(super) fn entries<'a>(&'a self, batch: &'a [Record]) -> Vec<Entry<'a>> {
        let entry = |(record, [previous, current]): (&'a Record, &'a [Option<String>; 2])| Entry {
            seq: record.seq,
            time: record.time,
            kind: kind(record.kind),
            source: &record.source,
            transition: &record.transition,
            previous: value(&record.previous, previous.as_deref()),
            current: value(&record.current, current.as_deref()),
            priority: record.priority,
            user: &record.user,
            text: &record.text,
        };
        batch.iter().zip(&self.0).map(entry).collect()
    }
}

fn value<'a>(value: &'a Datum, digits: Option<&'a str>) -> Value<'a> {
    match value {
        Datum::None => Value::None,
        Datum::Boolean(b) => Value::Boolean(*b),
        Datum::Integer(i) => match i64::try_from(*i) {
            Ok(i) => Value::Integer(i),
            Err(_) => Value::Text(digits.unwrap_or_default()),
        },
        Datum::Real(r) => Value::Real(*r),
        Datum::Text(t) => Value::Text(t),
    }
}

fn kind(kind: latchwork_record::Kind) -> Kind {
    use latchwork_record::Kind as From;
    match kind {
        From::Alarm => Kind::Alarm,
        From::Command => Kind::Command,
        From::Setting => Kind::Setting,
        From::Event => Kind::Event,
        From::Message => Kind::Message,
        From::Io => Kind::Io,
        From::Lane => Kind::Lane,
        From::Fault => Kind::Fault,
        From::Swap => Kind::Swap,
        From::Audit => Kind::Audit,
        From::Heartbeat => Kind::Heartbeat,
        From::Lost => Kind::Lost,
    }
}
