//! What reaches a lane from outside between two scans.

use super::tap::REPORTS;
use super::{BlockState, Exchange, Lane, Rest, Tap, TapSlot};
use latchwork_block::{FaultKind, Instance};
use latchwork_record::{Entry, Kind, Text};

/// Requests a lane takes per scan at most; the rest waits for the next.
const PER_SCAN: usize = 32;

/// How long a command stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// True for exactly one execution of the block.
    OneShot,
    /// Set or cleared until the next command.
    Level(bool),
}

/// A request to a lane.
pub enum Request {
    /// A command to a block.
    Command {
        /// Index of the block in the lane.
        block: u32,
        /// Bit of the commands word.
        bit: u8,
        /// How long.
        mode: Mode,
    },
    /// The supervisor's answer to a restart request.
    Restarted(Reply),
    /// New settings for a block, all of them.
    Configure {
        /// Index of the block in the lane.
        block: u32,
        /// Number of the request, for the answer.
        number: u64,
        /// Number of the version that they are for.
        version: u64,
        /// Cells of the settings; they come back, so that nothing is freed here.
        cells: Box<[u64]>,
        /// The same for the version before, while it waits.
        waiting: Option<Box<[u64]>>,
    },
    /// Other versions of some blocks.
    Exchange(Box<Exchange>),
    /// An operator wants those before back, which still wait.
    TakeBack {
        /// Number of the exchange.
        number: u64,
    },
    /// Listens to a block from when its state was saved on; settings that it takes before that come, too. A tap that has
    /// the place goes.
    Tap {
        /// Index of the block in the lane.
        block: u32,
        /// Who listens.
        slot: TapSlot,
        /// The lane's end; it comes back by [`super::Report::Tap`].
        tap: Box<Tap>,
    },
    /// Sends a tap the block's state, when there is time; nothing when another version has come meanwhile.
    Keyframe {
        /// Index of the block in the lane.
        block: u32,
        /// Number of the version whose state is wanted.
        version: u64,
        /// Who listens.
        slot: TapSlot,
    },
    /// Listens no more.
    Untap {
        /// Index of the block in the lane.
        block: u32,
        /// Who listened.
        slot: TapSlot,
    },
    /// The state of a block is wanted.
    Save(super::Save),
}

/// What a block says to new settings.
pub struct Configured {
    /// Number of the request.
    pub number: u64,
    /// Number of the version that they were for.
    pub version: u64,
    /// The settings.
    pub cells: Box<[u64]>,
    /// Those of the version before.
    pub waiting: Option<Box<[u64]>>,
    /// Why it does not take them.
    pub result: Result<(), Text>,
}

/// A new instance for a block that faulted, or why there is none.
pub struct Reply {
    /// Index of the block in the lane.
    pub block: u32,
    /// Number of the version.
    pub version: u64,
    /// The instance, configured.
    pub instance: Result<Box<Instance>, Box<(FaultKind, Text)>>,
}

/// A block that needs a new instance; the dead one goes along, to be dropped off the lane.
pub struct RestartRequest {
    /// Index of the block in the lane; `u32::MAX` when only the dead instance is handed over.
    pub block: u32,
    /// Index of the block in the model.
    pub model: usize,
    /// Number of the version that is wanted.
    pub version: u64,
    /// The dead instance.
    pub dead: Option<Instance>,
}

impl RestartRequest {
    /// Only hands an instance over that is of no more use.
    pub(super) fn dead(rest: &Rest, dead: Option<Instance>) -> Self {
        Self { block: u32::MAX, model: rest.model, version: rest.version, dead }
    }
}

impl Lane {
    pub(super) fn take_requests(&mut self, now: u64, clock: &dyn Fn() -> u64) {
        if !self.unsent.is_empty() {
            self.send_again();
        }
        if !self.trials.is_empty() {
            self.exchange_measured(now, clock);
        }
        for _ in 0..PER_SCAN {
            if self.parts.reports.slots() < REPORTS || !self.unsent.is_empty() {
                break;
            }
            match self.parts.requests.pop() {
                Ok(Request::Command { block, bit, mode }) => self.command(block, bit, mode),
                Ok(Request::Restarted(reply)) => self.restarted(reply, now),
                Ok(Request::Configure { block, number, version, cells, waiting }) => {
                    let result = self.configure(block as usize, version, &cells, now);
                    if let (Ok(()), Some(cells)) = (&result, &waiting) {
                        self.configure_waiting(block as usize, cells, now);
                    }
                    // There is room for as many answers as requests may wait.
                    let _ = self.parts.configured.push(Configured { number, version, cells, waiting, result });
                }
                Ok(Request::Save(save)) => self.take_save(save, now),
                Ok(Request::Exchange(exchange)) => self.take_exchange(exchange, now, clock),
                Ok(Request::TakeBack { number }) => self.take_back(number, now, clock),
                Ok(Request::Tap { block, slot, tap }) => self.tap(block as usize, slot, tap, now),
                Ok(Request::Keyframe { block, version, slot }) => {
                    if self.parts.blocks.get(block as usize).is_some_and(|b| b.rest.version == version) {
                        self.keyframe(block as usize, slot, now);
                    }
                }
                Ok(Request::Untap { block, slot }) => self.untap(block as usize, slot),
                Err(_) => break,
            }
        }
        self.restart_waiting(now);
    }

    /// Puts blocks back to work whose time has come.
    pub(super) fn restart_waiting(&mut self, now: u64) {
        let mut at = 0;
        while at < self.waiting.len() {
            let index = self.waiting[at] as usize;
            if self.restart(index, now) {
                self.waiting.swap_remove(at);
            } else {
                at += 1;
            }
        }
    }

    /// Takes requests while the lane waits for what happens next, and shows what has become of them.
    #[cold]
    pub(super) fn take_idle(&mut self, clock: &dyn Fn() -> u64) {
        let now = clock();
        if self.oldest_arrival().is_none() {
            // A fault makes a record.
            self.mark(now);
        }
        // The last execution has seen the commands that it had; the next one has those of now before it.
        if !std::mem::replace(&mut self.released, true) {
            self.release_one_shots();
        }
        self.take_requests(now, clock);
        self.publish_state(now);
        self.write_points(now);
        self.mark_oldest();
    }

    fn command(&mut self, index: u32, bit: u8, mode: Mode) {
        let Some(block) = self.parts.blocks.get_mut(index as usize) else { return };
        let Some(cell) = block.rest.commands else { return };
        let (cell, mask) = (&mut self.parts.cells[cell as usize], 1u64 << bit);
        match mode {
            Mode::Level(false) => *cell &= !mask,
            Mode::Level(true) => *cell |= mask,
            Mode::OneShot => {
                *cell |= mask;
                if block.rest.one_shot == 0 {
                    self.one_shots.push(index);
                }
                block.rest.one_shot |= mask;
            }
        }
    }

    /// Takes one-shot commands back that their block has seen.
    pub(super) fn release_one_shots(&mut self) {
        let parts = &mut self.parts;
        self.one_shots.retain(|index| {
            let block = &mut parts.blocks[*index as usize];
            let seen = block.ran || block.rest.one_shot == 0 || block.rest.state == BlockState::Parked;
            if seen && let Some(cell) = block.rest.commands {
                parts.cells[cell as usize] &= !block.rest.one_shot;
                block.rest.one_shot = 0;
            }
            !seen
        });
    }

    /// Between two executions, in the time of this scan: that is when a block may take settings.
    #[cold]
    #[expect(clippy::result_large_err, reason = "a text of fixed size is what a lane can make without allocation")]
    fn configure(&mut self, index: usize, version: u64, cells: &[u64], now: u64) -> Result<(), Text> {
        let block = self.parts.blocks.get_mut(index);
        if block.as_ref().is_some_and(|b| b.rest.version != version) {
            return Err(Text::new("another version executes in the meantime; try again"));
        }
        let Some((instance, taps)) = block.and_then(|b| b.instance.as_mut().map(|i| (i, &mut b.taps))) else {
            return Err(Text::new("the block is out of order; try again when it runs"));
        };
        let answer = instance.configure(cells);
        taps.settings(cells, answer.as_ref().map(Result::is_ok).map_err(|fault| fault.kind), &mut self.parts.tape);
        match answer {
            Ok(Ok(())) => Ok(()),
            Ok(Err(sentence)) => Err(Text::new(&sentence)),
            Err(fault) => {
                self.block_fault(index, now, &fault);
                Err(Text::format(format_args!("it failed: {}", fault.message)))
            }
        }
    }

    fn restarted(&mut self, reply: Reply, now: u64) {
        let index = reply.block as usize;
        let block = &mut self.parts.blocks[index];
        let wanted = block.rest.version == reply.version
            && block.rest.state == BlockState::Faulted
            && block.rest.ready.is_none();
        match reply.instance {
            Ok(instance) if wanted => block.rest.ready = Some(*instance),
            // Another version executes in the meantime.
            Ok(instance) => drop(self.parts.restarts.push(RestartRequest::dead(&block.rest, Some(*instance)))),
            Err(_) if !wanted => {}
            Err(fault) => {
                let (kind, text) = *fault;
                self.waiting.retain(|w| *w != reply.block);
                self.contain(index, now, kind, text.as_str());
                let block = &mut self.parts.blocks[index];
                if block.rest.state == BlockState::Faulted {
                    let (model, version) = (block.rest.model, block.rest.version);
                    let request = RestartRequest { block: reply.block, model, version, dead: None };
                    let _ = self.parts.restarts.push(request);
                }
            }
        }
    }

    /// Puts a waiting block back to work when its instance is there and its time has come.
    fn restart(&mut self, index: usize, now: u64) -> bool {
        let block = &mut self.parts.blocks[index];
        if now < block.rest.restart_at || block.rest.ready.is_none() {
            return false;
        }
        block.instance = block.rest.ready.take();
        block.rest.state = BlockState::Running;
        block.first = true;
        block.ran = false;
        block.taps.restarted(&mut self.parts.tape);
        let entry = Entry::new(now, Kind::Fault, block.rest.source, "restarted").priority(50);
        self.parts.recorder.push(entry);
        true
    }
}
