//! `latchwork new NAME`

use crate::Exit;
use crate::args::author::New;
use crate::report;
use anyhow::{Context, Result};
use dialoguer::{Input, Select};
use latchwork_author::{AuthorError, ClassChoice, Language, Project, create, free, shipped_classes};
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::Path;

pub(super) fn execute(args: &New) -> Result<Exit> {
    let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let missing = |what: &str, help: &str| {
        let error = anyhow::anyhow!("{what} is missing, and there is no terminal to ask on{help}");
        Ok(usage(&error))
    };
    let name = match &args.name {
        Some(name) => name.clone(),
        None if terminal => Input::<String>::new().with_prompt("Name of the block").interact_text()?,
        None => return missing("NAME", ""),
    };
    // Before anything else is asked.
    match free(Path::new(""), &name) {
        Err(e @ AuthorError::Name(_)) => return Ok(usage(&e.into())),
        other => other?,
    }
    let language = match &args.lang {
        Some(lang) => match Language::parse(lang) {
            Ok(language) => language,
            Err(e) => return Ok(usage(&e.into())),
        },
        None if terminal => ask("Language", &Language::ALL.map(|l| l.title().to_owned())).map(|i| Language::ALL[i])?,
        None => {
            let names = Language::ALL.map(Language::name).join(", ");
            return missing("--lang", &format!(" (there are: {names})"));
        }
    };
    let class = match (&args.wit, &args.class) {
        (Some(folder), class) => ClassChoice::Own { folder: folder.clone(), class: class.clone() },
        (None, Some(class)) => ClassChoice::Shipped(class.clone()),
        (None, None) if terminal => {
            let classes = shipped_classes();
            ClassChoice::Shipped(classes[ask("Device class", &classes)?].clone())
        }
        (None, None) => return missing("--class", "; for a class of your own, give --wit"),
    };
    let project = create(Path::new(""), &name, language, &class)?;
    report::say(&told(&name, language, &project));
    Ok(Exit::Fine)
}

/// Says what is wrong with the command itself.
fn usage(error: &anyhow::Error) -> Exit {
    report::error(error);
    Exit::Usage
}

fn ask(what: &str, items: &[String]) -> Result<usize> {
    let answer = Select::new().with_prompt(what).items(items).default(0).max_length(12).interact_opt()?;
    answer.with_context(|| format!("no {} was chosen; nothing was written", what.to_lowercase()))
}

/// What there is now, and what comes next.
fn told(name: &str, language: Language, project: &Project) -> String {
    let mut text = format!("{name}: {} in {}\n", project.class, language.title());
    for file in &project.files {
        // A String takes whatever is written.
        let _ = writeln!(text, "  {name}/{file}");
    }
    let source = language.source();
    let _ = write!(
        text,
        "\nWrite the block in {name}/{source}, then:\n  latchwork build {name}\n  latchwork test {name}/{name}.test.toml\n"
    );
    text
}
