//! What a logger says, on its standard streams or through `latchwork:block/log`: the last lines are kept for the sentence that
//! tells its next fault. They become no records: the logger would get them in turn, and say more.

use std::collections::VecDeque;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use tokio::io::AsyncWrite;
use wasmtime_wasi::cli::{IsTerminal, StdoutStream};

/// Lines kept: the end of a traceback.
const LINES: usize = 4;
/// Most bytes kept of a line.
const LENGTH: usize = 256;

/// The last lines. Clones share them.
#[derive(Clone, Default)]
pub(super) struct Said(Arc<Mutex<Lines>>);

#[derive(Default)]
struct Lines {
    whole: VecDeque<String>,
    begun: Vec<u8>,
}

impl Lines {
    fn end(&mut self) {
        let line = String::from_utf8_lossy(&self.begun).trim().to_owned();
        self.begun.clear();
        if line.is_empty() {
            return;
        }
        if self.whole.len() == LINES {
            self.whole.pop_front();
        }
        self.whole.push_back(line);
    }
}

impl Said {
    /// Takes text as it comes.
    pub(super) fn push(&self, text: &[u8]) {
        let mut lines = self.lock();
        for byte in text {
            match byte {
                b'\n' => lines.end(),
                _ if lines.begun.len() < LENGTH => lines.begun.push(*byte),
                _ => {}
            }
        }
    }

    /// The last lines in one, if there are any; they are forgotten.
    pub(super) fn take(&self) -> Option<String> {
        let mut lines = self.lock();
        lines.end();
        let whole: Vec<String> = lines.whole.drain(..).collect();
        (!whole.is_empty()).then(|| whole.join(" / "))
    }

    fn lock(&self) -> MutexGuard<'_, Lines> {
        // Lines are whole between any two statements that could panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl AsyncWrite for Said {
    fn poll_write(self: Pin<&mut Self>, _: &mut Context<'_>, text: &[u8]) -> Poll<std::io::Result<usize>> {
        self.push(text);
        Poll::Ready(Ok(text.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

impl IsTerminal for Said {
    fn is_terminal(&self) -> bool {
        false
    }
}

impl StdoutStream for Said {
    fn async_stream(&self) -> Box<dyn AsyncWrite + Send + Sync> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_lines_are_kept_and_long_ones_cut() {
        let said = Said::default();
        assert_eq!(said.take(), None);
        (0..9).for_each(|n| said.push(format!("line {n}\n\n").as_bytes()));
        said.push("ä".repeat(1000).as_bytes());
        let expected = format!("line 6 / line 7 / line 8 / {}", "ä".repeat(128));
        assert_eq!(said.take(), Some(expected));
        assert_eq!(said.take(), None);
    }
}
