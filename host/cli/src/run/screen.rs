//! The terminal's alternate screen, given back on every way out.

use crossterm::{cursor, execute, queue, style, terminal};
use std::io::{self, Stdout, Write, stdout};

/// The screen while it is ours.
pub(crate) struct Screen {
    out: Stdout,
}

impl Screen {
    /// Takes the screen.
    pub(crate) fn open() -> io::Result<Self> {
        let mut out = stdout();
        execute!(out, terminal::EnterAlternateScreen, cursor::Hide)?;
        Ok(Self { out })
    }

    /// Columns and rows.
    pub(crate) fn size() -> (u16, u16) {
        terminal::size().unwrap_or((80, 24))
    }

    /// Replaces what is shown; lines that do not fit are left out.
    pub(crate) fn draw(&mut self, lines: &[String]) -> io::Result<()> {
        let rows = usize::from(Self::size().1);
        queue!(self.out, terminal::BeginSynchronizedUpdate, cursor::MoveTo(0, 0))?;
        for line in lines.iter().take(rows.saturating_sub(1)) {
            queue!(
                self.out,
                style::Print(line),
                terminal::Clear(terminal::ClearType::UntilNewLine),
                cursor::MoveToNextLine(1)
            )?;
        }
        queue!(self.out, terminal::Clear(terminal::ClearType::FromCursorDown), terminal::EndSynchronizedUpdate)?;
        self.out.flush()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // Nothing is left to tell an error to.
        let _ = execute!(self.out, cursor::Show, terminal::LeaveAlternateScreen);
    }
}
