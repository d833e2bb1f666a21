//! The report as one page: no scripts, nothing from elsewhere, to be read in a browser or on paper.

use super::super::printable;
use super::words::{self, Section};
use super::{Found, plot};
use anyhow::Result;
use latchwork_alarm::report::Rank;
use quick_xml::escape::escape;
use std::fmt::Write;

/// Rows of a list on the page; the whole lists are in the JSON form.
const ROWS: usize = 200;

const STYLE: &str = "\
:root { color-scheme: light dark; --ink: #1b1f24; --ground: #ffffff; --faint: #6b7280; --line: #d4d8dd; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8eb; --ground: #15181c; --faint: #9aa3ad; --line: #343a41; } }
@media print { :root { --ink: #000; --ground: #fff; --faint: #444; --line: #bbb; } }
body { margin: 2rem auto; max-width: 60rem; padding: 0 1rem; background: var(--ground); color: var(--ink);
  font: 15px/1.45 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin-bottom: 0.2rem; }
h2 { font-size: 1.1rem; margin: 2rem 0 0.5rem; break-after: avoid; }
p.faint, figcaption { color: var(--faint); }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: 0.25rem 0.8rem 0.25rem 0; border-bottom: 1px solid var(--line); overflow-wrap: anywhere; }
tr { break-inside: avoid; }
figure { margin: 1rem 0; break-inside: avoid; }
svg { width: 100%; height: auto; }
svg [fill=\"#000000\"] { fill: var(--ink); }
svg [stroke=\"#000000\"] { stroke: var(--ink); }
.met { color: #2e8b57; }
.manageable { color: #b7791f; }
.missed { color: #cd3c3c; font-weight: 600; }
";

/// The whole page.
pub(super) fn document(found: &Found) -> Result<String> {
    let report = &found.report;
    let mut out = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n");
    let title = format!("Alarms of {}", found.journal);
    out += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n";
    out += &format!("<title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n", safe(&title));
    out += &format!("<h1>{}</h1>\n<p class=\"faint\">{}</p>\n", safe(&title), safe(&words::period(report)));
    for note in words::notes(found) {
        out += &format!("<p>Note: {}.</p>\n", safe(&note));
    }
    let sections = words::sections(report);
    let mut lists = sections.iter();
    // The figures first, then what they look like, then the lists.
    if let Some(figures) = lists.next() {
        section(&mut out, figures);
    }
    if report.raised > 0 {
        let ranks = Rank::ALL.into_iter().zip(plot::COLOURS);
        let ranks =
            ranks.map(|(rank, c)| format!("<b style=\"color:#{:02x}{:02x}{:02x}\">{}</b>", c.0, c.1, c.2, rank.name()));
        let caption = format!(
            "Alarms per 10 minutes, the worst of each column; a flood begins above the line. Priority: {}.",
            ranks.collect::<Vec<_>>().join(", ")
        );
        for (title, svg, caption) in [
            ("Alarms over time", plot::over_time(report)?, caption.as_str()),
            ("The most frequent", plot::most_frequent(report)?, ""),
            ("By priority", plot::by_rank(report)?, "The marks show the recommended distribution."),
        ] {
            out += &format!("<h2>{title}</h2>\n<figure>\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n");
        }
    }
    lists.for_each(|list| section(&mut out, list));
    out +=
        "<p class=\"faint\">Limits: ANSI/ISA-18.2 (IEC 62682) and EEMUA 191, for one operator.</p>\n</body>\n</html>\n";
    Ok(out)
}

fn section(out: &mut String, section: &Section) {
    let cells = |out: &mut String, tag: &str, row: &mut dyn Iterator<Item = &str>| {
        *out += "<tr>";
        for cell in row {
            let class = if ["met", "manageable", "missed"].contains(&cell) {
                format!(" class=\"{cell}\"")
            } else {
                String::new()
            };
            // Writing to a String never fails.
            let _ = write!(out, "<{tag}{class}>{}</{tag}>", safe(cell));
        }
        *out += "</tr>\n";
    };
    *out += &format!("<h2>{}</h2>\n<table>\n<thead>", safe(section.title));
    cells(out, "th", &mut section.header.iter().copied());
    *out += "</thead>\n<tbody>\n";
    for row in section.rows.iter().take(ROWS) {
        cells(out, "td", &mut row.iter().map(String::as_str));
    }
    *out += "</tbody>\n</table>\n";
    if section.rows.len() > ROWS {
        *out += &format!("<p class=\"faint\">… {} more; --format json has all.</p>\n", section.rows.len() - ROWS);
    }
}

/// A text that may stand anywhere in the page: names come from files.
fn safe(text: &str) -> String {
    escape(printable(text)).into_owned()
}
