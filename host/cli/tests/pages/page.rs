//! What a page tells its reader to do.

use latchwork_author::Language;
use std::path::Path;

/// One thing to do.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A command.
    Run(String),
    /// A file to save.
    Save { path: String, text: String },
    /// What the last command shows.
    Shows(String),
}

/// The steps of a page, but for the first commands, which install the tools.
pub(crate) fn steps(language: Language) -> Vec<Step> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../docs/blocks-in-{}.md", language.name()));
    let page = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut steps = Vec::new();
    let mut before = "";
    let mut commands = 0;
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(kind) = line.strip_prefix("```") else {
            if !line.is_empty() {
                before = line;
            }
            continue;
        };
        let block: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
        let text = block.join("\n") + "\n";
        match (kind, saved_as(before)) {
            ("sh", _) => {
                commands += 1;
                if commands > 1 {
                    steps.extend(block.iter().map(|l| Step::Run(without_comment(l).to_owned())));
                }
            }
            (_, Some(path)) => steps.push(Step::Save { path: path.to_owned(), text }),
            (_, None) => steps.push(Step::Shows(text)),
        }
    }
    steps
}

/// The name of a file: "… as `NAME`:" or "`NAME` is where you write …:".
fn saved_as(line: &str) -> Option<&str> {
    let line = line.strip_suffix(':')?;
    if let Some(rest) = line.strip_suffix('`') {
        return rest.rsplit_once("as `").map(|(_, name)| name);
    }
    let (head, _) = line.split_once("` is where you write")?;
    head.rsplit_once('`').map(|(_, name)| name)
}

fn without_comment(line: &str) -> &str {
    line.split("  # ").next().unwrap_or(line).trim_end()
}
