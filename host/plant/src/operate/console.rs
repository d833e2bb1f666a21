//! The way from whoever brings wishes to the plant's own thread.

use super::{Answer, Operation, Operator, Refused};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::time::Duration;

/// Wishes that may wait at once.
const WAITING: usize = 256;

/// A wish on its way.
pub struct Pending {
    /// Who.
    pub operator: Operator,
    /// What.
    pub operation: Operation,
    /// Why the policy forbids it: the plant refuses it then, and records that.
    pub forbidden: Option<String>,
    pub(super) answer: Option<Sender<Result<Answer, Refused>>>,
    /// Whoever asked was told that there is no answer: it must not be done any more.
    pub(super) given_up: Arc<AtomicBool>,
}

impl Pending {
    /// A wish of somebody who waits for no answer: a stimulus.
    pub(crate) fn unanswered(operator: Operator, operation: Operation) -> Self {
        Self { operator, operation, forbidden: None, answer: None, given_up: Arc::default() }
    }

    /// Whoever asked waits no longer.
    pub(crate) fn given_up(&self) -> bool {
        self.given_up.load(Ordering::Acquire)
    }

    /// Answers; whoever asked may be gone.
    pub fn answer(self, answer: Result<Answer, Refused>) {
        if let Some(to) = self.answer {
            let _ = to.send(answer);
        }
    }
}

/// The operators' end; clone it for each connection.
#[derive(Clone)]
pub struct Console {
    sender: SyncSender<Pending>,
}

/// The plant's end.
pub struct Wishes {
    receiver: Receiver<Pending>,
}

/// A console and the plant's end of it.
pub fn console() -> (Console, Wishes) {
    let (sender, receiver) = sync_channel(WAITING);
    (Console { sender }, Wishes { receiver })
}

impl Console {
    /// Brings a wish and waits for the answer at most `limit`. It blocks: not for an asynchronous task.
    ///
    /// # Errors
    /// What the plant refuses; a plant that has ended or does not answer.
    pub fn ask(
        &self,
        operator: Operator,
        operation: Operation,
        forbidden: Option<String>,
        limit: Duration,
    ) -> Result<Answer, Refused> {
        let given_up = Arc::new(AtomicBool::new(false));
        let told = self.bring(operator, operation, forbidden, &given_up)?;
        told.recv_timeout(limit).unwrap_or_else(|_| {
            given_up.store(true, Ordering::Release);
            Err(Refused::new("gone", "the plant has not answered, and does not do it any more; it may have ended"))
        })
    }
}

impl Console {
    /// Brings a wish and does not wait: the answer comes through what is returned, unless `given_up` is set before.
    ///
    /// # Errors
    /// Too many wishes wait; a plant that has ended.
    pub fn bring(
        &self,
        operator: Operator,
        operation: Operation,
        forbidden: Option<String>,
        given_up: &Arc<AtomicBool>,
    ) -> Result<Receiver<Result<Answer, Refused>>, Refused> {
        let (answer, told) = channel();
        let given_up = Arc::clone(given_up);
        self.sender.try_send(Pending { operator, operation, forbidden, answer: Some(answer), given_up }).map_err(
            |error| match error {
                TrySendError::Full(_) => Refused::new("busy", "too many wishes wait for the plant; try again"),
                TrySendError::Disconnected(_) => Refused::new("gone", "the plant has ended"),
            },
        )?;
        Ok(told)
    }
}

impl Wishes {
    /// The next wish, if one waits.
    pub fn next(&self) -> Option<Pending> {
        self.receiver.try_recv().ok()
    }
}
