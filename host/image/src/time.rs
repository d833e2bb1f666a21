//! Durations as users write and read them: `"200ms"`, `"1.25s"`, `"1m 30s"`.

use jiff::fmt::friendly::{SpanParser, SpanPrinter};
use jiff::{SignedDuration, SpanRelativeTo};

/// A text that is no duration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"{found}\" is not a duration; expected a number with a unit h, m, s, ms, us or ns, as in \"200ms\" or \"1.5s\""
)]
pub struct DurationError {
    /// What was found.
    pub found: String,
}

/// Reads a duration of plant time in nanoseconds, 0 up to `u64::MAX` (584 years). Negative durations are refused. Besides the
/// units of the message, which are those for control, a day `d` and a week `w` are taken: for what is kept so long.
///
/// ```
/// assert_eq!(latchwork_image::parse_duration("200ms"), Ok(200_000_000));
/// assert!(latchwork_image::parse_duration("200").is_err());
/// ```
pub fn parse_duration(text: &str) -> Result<u64, DurationError> {
    static PARSER: SpanParser = SpanParser::new();
    let error = || DurationError { found: text.to_owned() };
    // A bare zero needs no unit to be understood.
    if text.trim() == "0" {
        return Ok(0);
    }
    let duration = PARSER.parse_duration(text.trim()).or_else(|_| {
        // A day is 24 hours here, whatever the clocks of people do.
        PARSER.parse_span(text.trim())?.to_duration(SpanRelativeTo::days_are_24_hours())
    });
    let duration: SignedDuration = duration.map_err(|_| error())?;
    u64::try_from(duration.as_nanos()).map_err(|_| error())
}

/// Writes nanoseconds with the fewest designators: `1h 1m 1s 200ms`. The text parses back to the same value.
pub fn format_duration(ns: u64) -> String {
    static PRINTER: SpanPrinter = SpanPrinter::new();
    let secs = i64::try_from(ns / 1_000_000_000).unwrap_or(i64::MAX);
    let nanos = i32::try_from(ns % 1_000_000_000).unwrap_or(0);
    PRINTER.duration_to_string(&SignedDuration::new(secs, nanos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reads_what_plant_files_hold() {
        for (text, ns) in [
            ("10ms", 10_000_000),
            ("1.25s", 1_250_000_000),
            ("1m 30s", 90_000_000_000),
            ("500us", 500_000),
            ("7ns", 7),
            ("2h", 7_200_000_000_000),
            ("90d", 7_776_000_000_000_000),
            ("1w 1d 1h", 694_800_000_000_000),
            ("0", 0),
            ("0ms", 0),
            ("0.5ms", 500_000),
        ] {
            assert_eq!(parse_duration(text), Ok(ns), "{text}");
        }
    }

    #[test]
    fn refuses_what_is_no_duration() {
        for text in ["", "10", "ms", "10 sek", "-5ms", "1y", "10ms later", "1mo", "-1d", "1e3s", "∞"] {
            assert!(parse_duration(text).is_err(), "{text}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back(ns: u64) {
            prop_assert_eq!(parse_duration(&format_duration(ns)), Ok(ns));
        }

        #[test]
        fn any_text_is_read_or_refused(text in ".*") {
            let _ = parse_duration(&text);
        }
    }
}
