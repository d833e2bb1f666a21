//! Stimulus files: what happens to the points of `sim` drivers, and when.
//!
//! CSV with the header `time,tag,value`. Times are durations since the start of the plant; rows may stand in any
//! order and take effect in the order of time, rows of the same time in the order of the file. Lines that begin with
//! `#` are comments. What a tag is and whether the value fits it is not known here.

use csv::{ReaderBuilder, StringRecord, Trim};
use latchwork_image::parse_duration;
use std::io::Read;

/// Columns of the file.
const HEADER: [&str; 3] = ["time", "tag", "value"];
/// Errors shown of one file; a file of another kind has one in every line.
const MOST_ERRORS: usize = 20;

/// One row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stimulus {
    /// Plant time, ns.
    pub time: u64,
    /// Full name of the tag.
    pub tag: String,
    /// The value as text.
    pub value: String,
    /// Line of the file, from 1.
    pub line: u64,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct StimulusError {
    /// Line of the file, from 1.
    pub line: u64,
    /// What was found, what was expected, the way out.
    pub message: String,
}

/// Reads a stimulus file; the rows come ordered by time. All errors are told at once.
pub fn read(from: impl Read) -> Result<Vec<Stimulus>, Vec<StimulusError>> {
    let mut from = from;
    let mut bytes = Vec::new();
    if let Err(error) = from.read_to_end(&mut bytes) {
        return Err(vec![StimulusError { line: 1, message: format!("the file cannot be read: {error}") }]);
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|b| **b == b'\n').count() as u64;
        vec![StimulusError { line, message: "the file is no UTF-8 text; save it as plain CSV in UTF-8".into() }]
    })?;
    rows(text.trim_start_matches('\u{feff}'))
}

fn rows(text: &str) -> Result<Vec<Stimulus>, Vec<StimulusError>> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let (mut rows, mut errors) = (Vec::new(), Vec::new());
    let mut seen_header = false;
    for record in reader.records() {
        let found = match record {
            Ok(record) => {
                let line = record.position().map_or(0, |p| line(text, p));
                let found = if seen_header { row(&record, line).map(Some) } else { header(&record).map(|()| None) };
                let first = !std::mem::replace(&mut seen_header, true);
                let wrong_file = first && found.is_err();
                let found = found.map_err(|message| StimulusError { line, message });
                if wrong_file {
                    errors.extend(found.err());
                    break;
                }
                found
            }
            Err(error) => {
                let line = error.position().map_or(0, |p| line(text, p));
                Err(StimulusError { line, message: error.to_string() })
            }
        };
        match found {
            Ok(row) => rows.extend(row),
            Err(error) => errors.push(error),
        }
    }
    if !seen_header {
        let message = "the file is empty; its first line must be the header `time,tag,value`".to_owned();
        errors.push(StimulusError { line: 1, message });
    }
    if errors.len() > MOST_ERRORS {
        let (line, more) = (errors[MOST_ERRORS].line, errors.len() - MOST_ERRORS);
        errors.truncate(MOST_ERRORS);
        errors.push(StimulusError { line, message: format!("and {more} more errors from here on") });
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    rows.sort_by_key(|r: &Stimulus| r.time);
    Ok(rows)
}

/// Line of a record: its position is that before the comments and empty lines that were skipped.
fn line(text: &str, position: &csv::Position) -> u64 {
    let from = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    // Between the two characters of a CRLF the rest begins with what looks like an empty line: it is not counted yet.
    let rest = text.get(from..).unwrap_or_default();
    position.line() + rest.lines().take_while(|l| l.is_empty() || l.starts_with('#')).count() as u64
}

fn header(record: &StringRecord) -> Result<(), String> {
    if record.iter().eq(HEADER) {
        return Ok(());
    }
    let found: Vec<&str> = record.iter().collect();
    Err(format!("the first line is `{}`; it must be the header `time,tag,value`", found.join(",")))
}

fn row(record: &StringRecord, line: u64) -> Result<Stimulus, String> {
    let [time, tag, value] = record.iter().collect::<Vec<_>>()[..] else {
        return Err(format!(
            "found {} columns, expected 3: time,tag,value (put a value that has a comma in it into \"quotes\")",
            record.len()
        ));
    };
    if tag.is_empty() {
        return Err("the tag is missing; name a point of a `sim` driver, as in `field.level`".into());
    }
    let time = parse_duration(time).map_err(|e| format!("the time {e}"))?;
    Ok(Stimulus { time, tag: tag.to_owned(), value: value.to_owned(), line })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rows_come_by_time_and_then_by_line() {
        let text = "\u{feff}time,tag,value\n# the door opens\n2s, gpio.door ,true\n1.25s,a.b,1\n\n2s,gpio.door,false\n0,a.b,\"x,y\"\n";
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            let rows = read(text.as_bytes()).unwrap();
            let short: Vec<_> = rows.iter().map(|r| (r.time, r.tag.as_str(), r.value.as_str(), r.line)).collect();
            assert_eq!(
                short,
                [
                    (0, "a.b", "x,y", 7),
                    (1_250_000_000, "a.b", "1", 4),
                    (2_000_000_000, "gpio.door", "true", 3),
                    (2_000_000_000, "gpio.door", "false", 6)
                ]
            );
        }
        assert_eq!(read("time,tag,value\n".as_bytes()), Ok(vec![]));
    }

    fn golden(bytes: &[u8]) -> String {
        let errors = read(bytes).unwrap_err();
        errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn all_errors_are_told_with_their_lines() {
        insta::assert_snapshot!(golden(
            b"time,tag,value\n1 sec,a.b,1\n1s,a.b\n5,a.b,1\n1s,,1\n1s,a.b,1,2\n-1s,a.b,1\n"
        ));
        insta::assert_snapshot!(golden(b""));
        insta::assert_snapshot!(golden(b"1s,a.b,1\n2s,a.b,2\n"));
        insta::assert_snapshot!(golden(b"time,tag,value\n1s,a.b,\xff\n"));
        let many = format!("time,tag,value\n{}", "x,y,z\n".repeat(1000));
        assert!(golden(many.as_bytes()).ends_with("line 22: and 980 more errors from here on"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes[..]);
        }

        #[test]
        fn any_lines_are_read_or_refused(text in "(time,tag,value\n)?[0-9a-z,.\"#\n ]{0,200}") {
            let _ = read(text.as_bytes());
        }
    }
}
