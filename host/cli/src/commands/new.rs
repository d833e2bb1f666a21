//! `latchwork new NAME`

use crate::Exit;
use crate::args::author::New;
use crate::report;
use anyhow::{Context, Result, bail};
use dialoguer::{Input, Select};
use latchwork_author::{ClassChoice, Language, Project, create, shipped_classes};
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::Path;

pub(super) fn execute(args: &New) -> Result<Exit> {
    let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let missing = |what: &str| format!("{what} is missing, and there is no terminal to ask on");
    let name = match &args.name {
        Some(name) => name.clone(),
        None if terminal => Input::<String>::new().with_prompt("Name of the block").interact_text()?,
        None => bail!(missing("NAME")),
    };
    let language = match &args.lang {
        Some(lang) => Language::parse(lang)?,
        None if terminal => ask("Language", &Language::ALL.map(|l| l.title().to_owned())).map(|i| Language::ALL[i])?,
        None => {
            let names = Language::ALL.map(Language::name).join(", ");
            bail!("{} (there are: {names})", missing("--lang"))
        }
    };
    let class = match (&args.wit, &args.class) {
        (Some(folder), class) => ClassChoice::Own { folder: folder.clone(), class: class.clone() },
        (None, Some(class)) => ClassChoice::Shipped(class.clone()),
        (None, None) if terminal => {
            let classes = shipped_classes();
            ClassChoice::Shipped(classes[ask("Device class", &classes)?].clone())
        }
        (None, None) => bail!("{}; for a class of your own, give --wit", missing("--class")),
    };
    let project = create(Path::new(""), &name, language, &class)?;
    report::say(&told(&name, language, &project));
    Ok(Exit::Fine)
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
