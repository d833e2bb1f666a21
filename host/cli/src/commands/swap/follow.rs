//! A swap on its way, as a person follows it: a line for each stage, and on a terminal one that counts.

use super::text;
use crate::report;
use anyhow::{Result, anyhow};
use latchwork_api::client::{Client, ClientError};
use latchwork_plant::swap::{Stage, SwapStatus};
use signal_hook::consts::SIGINT;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// How often the plant is asked.
const EVERY: Duration = Duration::from_millis(100);

/// How following it ended.
pub(super) enum End {
    /// It goes no further.
    Over(Box<SwapStatus>),
    /// It goes on, but nobody follows it any more; its number.
    Left(u64),
}

/// How long a plant that is busy may give no answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// What Ctrl-C does. The handler is set once: one that is taken away again leaves a program that hears nothing.
struct Interrupt {
    pressed: Arc<AtomicBool>,
    /// It ends the program, as it does everywhere else.
    ends: Arc<AtomicBool>,
}

static INTERRUPT: OnceLock<std::io::Result<Interrupt>> = OnceLock::new();

impl Interrupt {
    fn new() -> std::io::Result<Self> {
        let (pressed, ends) = (Arc::<AtomicBool>::default(), Arc::<AtomicBool>::default());
        signal_hook::flag::register_conditional_default(SIGINT, Arc::clone(&ends))?;
        signal_hook::flag::register(SIGINT, Arc::clone(&pressed))?;
        Ok(Self { pressed, ends })
    }
}

/// While it lives, Ctrl-C is only noted.
pub(super) struct Noted(&'static Interrupt);

impl Noted {
    pub(super) fn new() -> Result<Self> {
        let interrupt = INTERRUPT.get_or_init(Interrupt::new).as_ref();
        let interrupt = interrupt.map_err(|e| anyhow!("the handler of Ctrl-C could not be set: {e}"))?;
        interrupt.ends.store(false, Ordering::SeqCst);
        Ok(Self(interrupt))
    }

    pub(super) fn pressed(&self) -> bool {
        self.0.pressed.load(Ordering::SeqCst)
    }
}

impl Drop for Noted {
    fn drop(&mut self) {
        self.0.ends.store(true, Ordering::SeqCst);
    }
}

/// Follows a swap to its end, or until Ctrl-C. `planned`: its plan was shown already. `quiet`: nothing is said.
pub(super) fn follow(client: &Client, mut status: SwapStatus, planned: bool, quiet: bool) -> Result<End> {
    let interrupt = Noted::new()?;
    let mut answered = Instant::now();
    let mut teller = Teller::new(std::io::stdout().is_terminal(), planned);
    loop {
        if !quiet {
            report::say(&teller.tell(&status));
        }
        if status.stage.ended() {
            return Ok(End::Over(Box::new(status)));
        }
        if interrupt.pressed() {
            if !quiet {
                report::say(&teller.clear());
            }
            return Ok(End::Left(status.number));
        }
        std::thread::sleep(EVERY);
        match client.get(&format!("/v1/swaps/{}", status.number), &[]) {
            Ok(now) => (status, answered) = (now, Instant::now()),
            // Too many ask at once, or the plant's own thread is late: the swap goes on all the same.
            Err(ClientError::Refused { status: 503, .. }) if answered.elapsed() < PATIENCE => {}
            Err(error) => return Err(error.into()),
        }
    }
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
