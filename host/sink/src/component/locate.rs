//! Where the file of a logger is.

use super::grants::problem;
use crate::{Config, Problem};
use latchwork_image::nearest;
use std::path::{Path, PathBuf};

/// The file of the component that the plant file names: `NAME` in the plant's folders, or a path that ends in `.wasm`.
pub(super) fn component(config: &Config, name: &str) -> Result<PathBuf, Problem> {
    if name.ends_with(".wasm") {
        let path = config.folder.join(name);
        if path.is_file() {
            return Ok(path);
        }
        return Err(problem("component", format!("there is no file {}", path.display()), "check the path"));
    }
    let file = format!("{name}.wasm");
    let found = config.components.iter().map(|folder| folder.join(&file)).find(|path| path.is_file());
    found.ok_or_else(|| missing(config, name))
}

fn missing(config: &Config, name: &str) -> Problem {
    let mut there: Vec<String> = config.components.iter().flat_map(|folder| names(folder)).collect();
    there.sort_unstable();
    there.dedup();
    let searched = match &config.components[..] {
        [] => "the plant names no folders".to_owned(),
        folders => {
            let list: Vec<_> = folders.iter().map(|f| f.display().to_string()).collect();
            format!("searched in {}", list.join(", "))
        }
    };
    let help = match nearest(name, there.iter().map(String::as_str)) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None if config.components.is_empty() => {
            "add `components = [\"FOLDER\"]` to [plant], or name a file that ends in .wasm".into()
        }
        None if there.is_empty() => {
            "no folder holds any component; `cargo xtask guests` builds those that ship with Latchwork".into()
        }
        None => format!("there are {}", there.join(", ")),
    };
    problem("component", format!("there is no component `{name}`; {searched}"), &help)
}

fn names(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = files.filter_map(|f| f.file_name().into_string().ok());
    names.filter_map(|n| n.strip_suffix(".wasm").map(str::to_owned)).collect()
}
