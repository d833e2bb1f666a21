//! Errors and colours.

use std::io::{IsTerminal, Write};

/// Prints to standard output. Whoever reads it may have gone (`latchwork tags PLANT | head`), which is no error.
pub(crate) fn say(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Prints an error with its causes.
pub(crate) fn error(error: &anyhow::Error) {
    let (bold, plain) = if colours() { ("\x1b[1;31m", "\x1b[0m") } else { ("", "") };
    let mut text = format!("{bold}error{plain}: {error}\n");
    let mut before = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        // Some errors tell their cause themselves.
        if !before.contains(&cause) {
            text.push_str(&format!("  because: {cause}\n"));
        }
        before = cause;
    }
    // The terminal may have gone, which is no reason to panic.
    let _ = std::io::stderr().write_all(text.as_bytes());
}

/// Colours only on a terminal, and not when the user said no (<https://no-color.org>).
pub(crate) fn colours() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}
