//! A swap on its way, as a person follows it: a line for each stage, and on a terminal one that counts.

use super::text;
use crate::report;
use anyhow::{Context, Result};
use latchwork_api::client::Client;
use latchwork_plant::swap::{Stage, SwapStatus};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often the plant is asked.
const EVERY: Duration = Duration::from_millis(100);

/// How following it ended.
pub(super) enum End {
    /// It goes no further.
    Over(Box<SwapStatus>),
    /// It goes on, but nobody follows it any more; its number.
    Left(u64),
}

/// Follows a swap to its end, or until Ctrl-C. `planned`: its plan was shown already. `quiet`: nothing is said.
pub(super) fn follow(client: &Client, mut status: SwapStatus, planned: bool, quiet: bool) -> Result<End> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let handler = signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::clone(&interrupted));
    let handler = handler.context("the handler of Ctrl-C could not be set")?;
    let mut teller = Teller::new(std::io::stdout().is_terminal(), planned);
    let end = loop {
        if !quiet {
            report::say(&teller.tell(&status));
        }
        if status.stage.ended() {
            break Ok(End::Over(Box::new(status)));
        }
        if interrupted.load(Ordering::Relaxed) {
            if !quiet {
                report::say(&teller.clear());
            }
            break Ok(End::Left(status.number));
        }
        std::thread::sleep(EVERY);
        status = match client.get(&format!("/v1/swaps/{}", status.number), &[]) {
            Ok(status) => status,
            Err(error) => break Err(error.into()),
        };
    };
    signal_hook::low_level::unregister(handler);
    end
}

/// What was said so far.
pub(super) struct Teller {
    /// The last line can be written anew.
    terminal: bool,
    stage: Option<Stage>,
    planned: bool,
    compared: bool,
    exchanged: bool,
    /// A line that counts stands on the terminal.
    counting: bool,
}

impl Teller {
    pub(super) fn new(terminal: bool, planned: bool) -> Self {
        Self { terminal, stage: None, planned, compared: false, exchanged: false, counting: false }
    }

    /// What there is to say now.
    pub(super) fn tell(&mut self, status: &SwapStatus) -> String {
        let mut said = String::new();
        if !self.planned && !status.blocks.is_empty() {
            self.planned = true;
            said += &status.blocks.iter().map(text::plan).collect::<String>();
            said += &format!("prepared in {}, beside the lanes\n", text::span(status.prepare_ns));
        }
        // The report stands when the shadow is over, whatever comes next.
        if !self.compared && !status.shadow.is_empty() && !matches!(status.stage, Stage::Preparing | Stage::Shadow) {
            self.compared = true;
            said += &status.shadow.iter().map(text::shadow).collect::<String>();
        }
        if !self.exchanged && status.exchange_ns > 0 {
            self.exchanged = true;
            let at = text::moment(status.exchanged_at);
            said += &format!("exchanged in {} at plant time {at}\n", text::span(status.exchange_ns));
        }
        let new = self.stage.replace(status.stage) != Some(status.stage);
        let line = text::progress(status);
        if new && status.stage.ended() {
            said += &format!("{line}\n");
        } else if !status.stage.ended() && self.terminal {
            let shown = format!("{}{said}{line}", self.clear());
            self.counting = true;
            return shown;
        } else if new {
            said += &format!("{line}\n");
        }
        if said.is_empty() { said } else { format!("{}{said}", self.clear()) }
    }

    /// Takes the line that counts away.
    pub(super) fn clear(&mut self) -> String {
        if std::mem::take(&mut self.counting) { "\r\x1b[K".into() } else { String::new() }
    }
}
