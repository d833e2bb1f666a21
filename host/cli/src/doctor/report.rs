//! The report: a table for people, a list for scripts.

use super::finding::{Finding, Status};
use std::fmt::Write;

/// Longest line of an explanation, in characters.
const WIDTH: usize = 100;

/// For people.
pub(crate) fn text(title: &str, groups: &[(&str, Vec<Finding>)], colours: bool) -> String {
    let all = || groups.iter().flat_map(|(_, findings)| findings);
    let width = all().map(|f| f.check.len()).max().unwrap_or(0);
    let paint = |text: &str, colour: &str| if colours { format!("\x1b[{colour}m{text}\x1b[0m") } else { text.into() };
    let mut out = format!("{}\n", paint(title, "1"));
    for (group, findings) in groups {
        let _ = writeln!(out, "\n{group}");
        for finding in findings {
            let colour = match finding.status {
                Status::Ok => "32",
                Status::Note => "33",
                Status::Bad => "1;31",
            };
            let status = paint(&format!("{:<4}", finding.status.name()), colour);
            let _ = writeln!(out, "  {status}  {:<width$}  {}", finding.check, finding.found);
            if finding.status == Status::Ok {
                continue;
            }
            // Commands stay whole, so that they can be copied.
            for (word, lines) in [("why", wrap(finding.why)), ("mend", finding.mend.clone())] {
                for (n, line) in lines.iter().enumerate() {
                    let _ = writeln!(out, "        {:<4}  {line}", if n == 0 { word } else { "" });
                }
            }
        }
    }
    let count = |status: Status| all().filter(|f| f.status == status).count();
    let (bad, notes) = (count(Status::Bad), count(Status::Note));
    let plural = |n: usize| if n == 1 { "note" } else { "notes" };
    let verdict = match (bad, notes) {
        (0, 0) => paint("Ready.", "1;32"),
        (0, n) => format!("{} {n} {}: what could be better.", paint("Ready.", "1;32"), plural(n)),
        (b, 0) => format!("{} {b} bad.", paint("Not ready:", "1;31")),
        (b, n) => format!("{} {b} bad, {n} {}.", paint("Not ready:", "1;31"), plural(n)),
    };
    let _ = writeln!(out, "\n{verdict}");
    out
}

/// Lines of at most [`WIDTH`] characters, unless a word is longer.
fn wrap(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().filter(|l| l.chars().count() + word.chars().count() < WIDTH);
        match line {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.into()),
        }
    }
    lines
}

/// For scripts: a list of `{check, status, found, why, mend}`.
pub(crate) fn json(groups: &[(&str, Vec<Finding>)]) -> serde_json::Result<String> {
    let all: Vec<&Finding> = groups.iter().flat_map(|(_, findings)| findings).collect();
    serde_json::to_string_pretty(&all)
}
