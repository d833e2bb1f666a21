//! Records as lines of CSV. A line ends with CR LF, as RFC 4180 has it, and nothing else does: within a field a line break is LF
//! alone. So the end of the last whole record is found from the end of a file, whatever its fields hold.

use csv::{QuoteStyle, Terminator, WriterBuilder};
use jiff::Timestamp;

/// What ends a record, and stands nowhere else.
pub(crate) const END: &[u8] = b"\r\n";

const HEADER: [&str; 10] =
    ["seq", "time", "kind", "source", "transition", "previous", "current", "priority", "user", "text"];

/// One record.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Row {
    pub(crate) seq: u64,
    /// ns since 1970.
    pub(crate) time: u64,
    pub(crate) kind: &'static str,
    pub(crate) source: String,
    pub(crate) transition: String,
    pub(crate) previous: String,
    pub(crate) current: String,
    pub(crate) priority: u8,
    pub(crate) user: String,
    pub(crate) text: String,
}

impl Row {
    /// Day of the record in UTC, `2026-11-27`.
    pub(crate) fn day(&self) -> String {
        let time = format!("{:.0}", self.timestamp());
        time.split('T').next().unwrap_or_default().to_owned()
    }

    fn timestamp(&self) -> Timestamp {
        // 64 bits of nanoseconds end in the year 2554, long before this type does.
        Timestamp::from_nanosecond(self.time.into()).unwrap_or(Timestamp::UNIX_EPOCH)
    }
}

/// The rows as bytes of a file; with the header where the file begins.
pub(crate) fn lines(rows: &[Row], header: bool) -> Result<Vec<u8>, String> {
    let mut out = WriterBuilder::new()
        .terminator(Terminator::CRLF)
        .quote_style(QuoteStyle::Necessary)
        .from_writer(Vec::with_capacity(rows.len() * 128));
    let no = |e: csv::Error| format!("a record cannot be written as CSV: {e}");
    if header {
        out.write_record(HEADER).map_err(no)?;
    }
    for row in rows {
        let (seq, time, priority) = (row.seq.to_string(), format!("{:.9}", row.timestamp()), row.priority.to_string());
        let texts = [&row.source, &row.transition, &row.previous, &row.current, &row.user, &row.text]
            .map(|t| one_kind_of_break(t));
        let [source, transition, previous, current, user, text] = &texts;
        let fields = [&*seq, &time, row.kind, source, transition, previous, current, &priority, user, text];
        out.write_record(fields).map_err(no)?;
    }
    out.into_inner().map_err(|e| format!("a record cannot be written as CSV: {}", e.error()))
}

/// A text that a spreadsheet takes for a formula gets a `'` before it: names and texts come from anywhere, and what is opened in
/// an office shall not do anything there.
pub(crate) fn harmless(text: String) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}") } else { text }
}

/// Line breaks as LF alone.
fn one_kind_of_break(text: &str) -> std::borrow::Cow<'_, str> {
    if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n").into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> Row {
        Row { seq: 7, time: 1_795_737_600_000_000_000 - 1, kind: "alarm", priority: 100, ..Row::default() }
    }

    #[test]
    fn the_day_ends_at_midnight_utc() {
        assert_eq!(row().day(), "2026-11-26");
        assert_eq!(Row { time: row().time + 1, ..row() }.day(), "2026-11-27");
        assert_eq!(Row { time: u64::MAX, ..row() }.day(), "2554-07-21");
    }

    #[test]
    fn fields_are_quoted_and_come_back_as_they_were() {
        let text = "level \"high\", 3 m\nsecond line;\tumlauts: Störung";
        let hard = Row { text: text.into(), user: "o'neil, jr".into(), ..row() };
        let bytes = lines(&[hard, row()], true).unwrap();
        let mut reader = csv::Reader::from_reader(&*bytes);
        let read: Vec<_> = reader.records().map(Result::unwrap).collect();
        assert_eq!(read.len(), 2);
        assert_eq!((&read[0][0], &read[0][1], &read[0][8]), ("7", "2026-11-26T23:59:59.999999999Z", "o'neil, jr"));
        assert_eq!(&read[0][9], text);
    }

    #[test]
    fn only_the_end_of_a_record_is_cr_lf() {
        let hard = Row { text: "a\r\nb\rc\n\r\r\n".into(), source: "\r\n7,\r\n".into(), ..row() };
        let bytes = lines(&[hard.clone(), hard], false).unwrap();
        assert_eq!(bytes.windows(2).filter(|w| *w == END).count(), 2);
        assert_eq!(bytes.iter().filter(|b| **b == b'\r').count(), 2);
        assert!(bytes.ends_with(END));
    }
}
