//! Text of others, for a terminal.

/// The text with what would move the cursor, change the colour or turn the line around shown as what it is: `\u{1b}`, `\n`.
pub fn plain(text: &str) -> String {
    let acts = |c: char| c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let shown = |c: char| if acts(c) { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_text_acts_on_a_terminal() {
        assert_eq!(plain("a\x1b[2Jb\nc\u{9b}d é"), "a\\u{1b}[2Jb\\nc\\u{9b}d é");
        assert_eq!(plain("\u{202e}\"it's\""), "\\u{202e}\"it's\"");
    }
}
