//! The flight recorder: what chosen blocks got and gave, in a bounded ring, and on disk under `--data`.
//!
//! ```text
//! lane ─tape─► Channel (one per block: events, coded off the lane) ─Segment─► Ring (memory) ─► a file on demand
//!                                                                 └───────► Spill (own thread) ─► DATA/recorder/*
//! ```
//!
//! A segment begins with a state, a cold start, or goes on where the one before ended; it is cut at every state, when it is
//! full, when a block faults and when the plant stops.

mod channel;
mod rehearse;
mod ring;
mod spill;
mod writer;

use crate::assemble::{Plant, Time};
use crate::lane::{Request, Tap, TapReader, TapSlot, on_tape, room, tap_words, tape};
use crate::operate::Refused;
use crate::supervisor::Recipe;
use channel::{Channel, Turn};
use latchwork_block::Component;
use latchwork_record::{Draft, Kind};
use latchwork_testbed::replay::{Head, Segment, Start, component_chunk, hash_of, segment_chunk};
use rehearse::Rehearsals;
use ring::Ring;
use spill::{Order, Spill, Told};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Weak;

/// Words that the tape of a lane has room for at least: some states of any length, and versions that need more than those before.
const WORDS: usize = 1 << 16;
/// Bytes of a segment after which it is cut, at most.
const SEGMENT: u64 = 32 << 10;
/// A state that was asked for and has not come is asked for again after so long, ns of plant time.
const PATIENCE: u64 = 1_000_000_000;
/// Nothing was missed for so long, ns: that is over.
const CALM: u64 = 10_000_000_000;

/// What is recorded.
#[derive(Default)]
pub(crate) struct Recorder {
    channels: Vec<Channel>,
    /// What the lanes tell, of those with a block that is recorded.
    tapes: Vec<TapReader>,
    /// Taps so far.
    taps: u16,
    ring: Ring,
    spill: Option<Spill>,
    rehearsals: Rehearsals,
    /// Hashes of the components whose segments may still come.
    in_use: BTreeSet<String>,
    /// Number of this run.
    run: u64,
    keyframe: u64,
    /// Bytes of a segment after which it is cut.
    cut: usize,
    /// Events missed since the record that says so, and plant time of the last, ns.
    missed: Option<(u64, u64)>,
    real_time: bool,
}

impl Plant {
    /// The flight recorder goes on in files of this folder, which is made; call it before the run. Does nothing in a plant
    /// without one.
    pub fn record_into(&mut self, folder: &Path) -> std::io::Result<()> {
        if let Some(config) = &self.model.recorder {
            self.recorder.spill = Some(Spill::open(folder, config.spill)?);
        }
        Ok(())
    }

    /// Before the first scan: every block that is to be recorded is, from its cold start on.
    pub(crate) fn begin_recorder(&mut self) {
        let Some(config) = self.model.recorder.clone() else { return };
        let recorder = &mut self.recorder;
        let blocks = config.blocks.len().max(1) as u64;
        recorder.run = recorder.spill.as_ref().map_or(1, Spill::run);
        recorder.keyframe = config.keyframe;
        recorder.real_time = self.time == Time::Real;
        // Of the memory half at most is in segments that are not cut yet.
        let cut = SEGMENT.min(config.memory / (2 * blocks));
        recorder.cut = cut as usize;
        recorder.ring = Ring::new(config.memory - cut * blocks);
        for (n, block) in config.blocks.iter().enumerate() {
            let lane = self.model.blocks[*block].lane;
            let place = self.layout.lanes[lane].blocks.iter().position(|b| b.block == *block).unwrap_or(0) as u32;
            // One after another: states are not saved all at once.
            let first = config.keyframe / blocks * (n as u64 + 1);
            recorder.channels.push(Channel::new(*block, lane, place, first));
        }
        for lane in 0..self.lanes.len() {
            let of_lane = self.recorder.channels.iter().filter(|c| c.lane() == lane);
            let words: usize = of_lane.map(|c| tap_words(self.supervisor.recipes[c.block()].template.class())).sum();
            if words > 0 {
                let (tape, reader) = tape((words * room(self.model.lanes[lane].every)).max(WORDS));
                self.lanes[lane].record_on(tape);
                self.recorder.tapes.push(reader);
            }
        }
        self.listen(true);
    }

    /// Taps what is not tapped: all of it before the first scan, later what became another version.
    fn listen(&mut self, at_start: bool) {
        for index in 0..self.recorder.channels.len() {
            let channel = &self.recorder.channels[index];
            let (block, lane, place) = (channel.block(), channel.lane(), channel.place());
            if channel.listens() || self.desk.is_configuring(block) {
                continue;
            }
            let (recipe, component) = (self.supervisor.recipes[block].clone(), self.component_of(block).clone());
            self.recorder.want_rehearsal(index, &recipe);
            // The lane saves a state for a tap that comes later, unless that fails.
            let saves = self.recorder.channels[index].saves(recipe.version);
            if !at_start && saves.is_none() {
                continue;
            }
            let (mut lane_end, wire) = self.recorder.tap(index, &recipe);
            if saves == Some(false) {
                lane_end.without_states();
            }
            if at_start {
                // Not by a request: a lane takes but some of them in its first scan.
                self.lanes[lane].tap_at_start(place as usize, TapSlot::Recorder, lane_end);
            } else {
                let request = Request::Tap { block: place, slot: TapSlot::Recorder, tap: lane_end };
                if self.supervisor.send(lane, request).is_err() {
                    continue;
                }
            }
            let head = self.head(block, &recipe, &component);
            self.recorder.channels[index].listen(wire, head, true);
            self.recorder.add_component(component.bytes());
        }
        self.rehearse();
    }

    /// A tap for the version of a block that an exchange brings, so that its first execution is recorded, too; none for a
    /// block that is not.
    pub(crate) fn record_version(&mut self, block: usize, recipe: &Recipe, component: &Component) -> Option<Box<Tap>> {
        let index = self.recorder.channels.iter().position(|c| c.block() == block)?;
        let (lane_end, wire) = self.recorder.tap(index, recipe);
        let head = self.head(block, recipe, component);
        self.recorder.channels[index].listen(wire, head, false);
        self.recorder.want_rehearsal(index, recipe);
        self.recorder.add_component(component.bytes());
        Some(lane_end)
    }

    /// What the segments of a version of a block say of themselves.
    fn head(&self, block: usize, recipe: &Recipe, component: &Component) -> Head {
        let (of, class) = (&self.model.blocks[block], recipe.template.class());
        let lane = &self.model.lanes[of.lane];
        Head {
            run: self.recorder.run,
            epoch: self.router.epoch(),
            block: of.name.clone(),
            lane: lane.name.clone(),
            every: lane.every,
            component: component.name().into(),
            hash: component.hash().into(),
            version: recipe.version,
            class: class.name.clone(),
            memory: of.memory,
            number: 0,
            start: Start::Continued,
            settings: recipe.settings.clone(),
            cells: [class.argument_cells(), class.output_cells()],
            from: 0,
            to: 0,
            executions: 0,
            missed: 0,
        }
    }

    /// Takes what the lanes have recorded, at plant time `now`, ns.
    pub(crate) fn recorder_turn(&mut self, now: u64) {
        if self.recorder.channels.is_empty() {
            return;
        }
        let Recorder { channels, tapes, cut, .. } = &mut self.recorder;
        // Whoever is gone now has told all it had to.
        channels.iter_mut().for_each(Channel::look);
        let mut all = Turn::default();
        for tape in tapes {
            // What comes meanwhile waits for the next turn: a lane may be faster than this.
            let mut left = tape.waiting();
            while left > 0
                && let Some((number, missed, frame)) = tape.next_of_all(&mut left)
            {
                let wire = Number::from(number);
                if let Some(channel) = channels.get_mut(usize::from(wire.channel)) {
                    channel.hear(wire.serial, missed, frame, now, *cut, &mut all);
                }
            }
        }
        channels.iter_mut().for_each(|channel| channel.settle(now, &mut all));
        self.recorder.take(std::mem::take(&mut all.segments));
        if all.ended {
            self.recorder.let_components_go();
        }
        if all.faulted {
            // What led to it is on disk before anything else can happen.
            self.recorder.cut_all();
            self.recorder.sync();
        }
        self.tell_missed(all.missed, now);
        self.ask_for_states(now);
        self.listen(false);
    }

    /// Everything that is in memory, as a recording in one file.
    pub fn recording(&self) -> Vec<u8> {
        let open = self.recorder.channels.iter().flat_map(Channel::so_far);
        self.recorder.ring.to_bytes(open.map(|segment| (segment.head.hash.clone(), segment_chunk(&segment))))
    }

    /// The same for an operator; refused where nothing is recorded.
    pub(crate) fn recording_asked(&self) -> Result<Vec<u8>, Refused> {
        if self.recorder.channels.is_empty() {
            let why = "nothing is recorded: say in [recorder] of the plant file which blocks are to be";
            return Err(Refused::new("state", why));
        }
        Ok(self.recording())
    }

    /// At most one state per lane is on its way.
    fn ask_for_states(&mut self, now: u64) {
        let recorder = &mut self.recorder;
        let due = |c: &Channel| c.is_due(now).map(|version| (c.due(), version));
        let mut wanted: Vec<_> = recorder.channels.iter().enumerate().filter_map(|(n, c)| Some((due(c)?, n))).collect();
        // Whoever has waited longest goes first: where there is not time for all, none is left out.
        wanted.sort_unstable();
        for ((_, version), index) in wanted {
            let lane = recorder.channels[index].lane();
            if recorder.channels.iter().any(|c| c.lane() == lane && c.waits_for_state(now, PATIENCE)) {
                continue;
            }
            let channel = &mut recorder.channels[index];
            let request = Request::Keyframe { block: channel.place(), version, slot: TapSlot::Recorder };
            if self.supervisor.send(lane, request).is_ok() {
                channel.asked(now, recorder.keyframe);
            }
        }
    }

    /// One record when events begin to be missed, one when it is over.
    fn tell_missed(&mut self, missed: u64, now: u64) {
        let record = |transition, text: String| {
            let mut draft = Draft::new(now, Kind::Lost, "recorder", transition);
            (draft.priority, draft.text) = (100, text);
            draft
        };
        for told in self.recorder.spill.as_mut().map(Spill::told).unwrap_or_default() {
            let draft = match told {
                Told::NotWritten(why) => {
                    record("not-written", format!("the flight recorder's files are incomplete: {why}"))
                }
                Told::Written(1) => record("written", "the flight recorder's files go on; 1 segment is missing".into()),
                Told::Written(lost) => {
                    record("written", format!("the flight recorder's files go on; {lost} segments are missing"))
                }
            };
            self.tell(draft, Vec::new());
        }
        match &mut self.recorder.missed {
            None if missed > 0 => {
                self.recorder.missed = Some((missed, now));
                let text = "the flight recorder misses executions: this machine is too busy to record so much".into();
                self.tell(record("missing", text), Vec::new());
            }
            Some((sum, last)) if missed > 0 => (*sum, *last) = (*sum + missed, now),
            Some((sum, last)) if now.saturating_sub(*last) > CALM => {
                let text = format!("the flight recorder records everything again; {sum} executions are missing");
                self.recorder.missed = None;
                self.tell(record("recording", text), Vec::new());
            }
            _ => {}
        }
    }
}

/// A tap as its channel sees it.
struct Wire {
    /// Number among the taps of the channel that are in use.
    serial: u16,
    /// Dead when nothing more will come.
    there: Weak<()>,
}

/// Number of a tap on its tape.
struct Number {
    channel: u16,
    serial: u16,
}

impl From<u32> for Number {
    fn from(number: u32) -> Self {
        Self { channel: number as u16, serial: (number >> 16) as u16 }
    }
}

impl From<Number> for u32 {
    fn from(number: Number) -> Self {
        Self::from(number.channel) | Self::from(number.serial) << 16
    }
}

impl Recorder {
    /// A tap for this version of the block of a channel.
    fn tap(&mut self, channel: usize, recipe: &Recipe) -> (Box<Tap>, Wire) {
        self.taps = self.taps.wrapping_add(1);
        // A plant has fewer blocks than that.
        let number = Number { channel: channel as u16, serial: self.taps };
        let serial = number.serial;
        let (mut lane_end, there) = on_tape(recipe.template.class(), number.into());
        // The lane may have another version already, which the recipe has in the next turn.
        lane_end.only(recipe.version);
        (lane_end, Wire { serial, there })
    }

    fn add_component(&mut self, bytes: &[u8]) {
        let hash = hash_of(bytes);
        self.ring.add_component(&hash, || component_chunk(bytes));
        if self.in_use.insert(hash.clone()) {
            self.order(|| Order::Component(hash, bytes.to_vec()));
        }
    }

    /// Of the components that no version runs any more those go that no segment needs.
    fn let_components_go(&mut self) {
        self.in_use = self.channels.iter().flat_map(Channel::components).map(String::from).collect();
        self.ring.in_use(&self.in_use);
        let in_use = self.in_use.clone();
        self.order(|| Order::InUse(in_use));
    }

    /// In real time nobody waits for the disk.
    fn order(&mut self, order: impl FnOnce() -> Order) {
        let waiting = !self.real_time;
        if let Some(spill) = &mut self.spill {
            spill.order(order(), waiting);
        }
    }

    fn take(&mut self, segments: Vec<Segment>) {
        for segment in segments {
            let chunk = segment_chunk(&segment);
            self.order(|| Order::Segment(segment.head.hash.clone(), chunk.clone()));
            self.ring.add(segment.head.hash, chunk);
        }
    }

    fn cut_all(&mut self) {
        let segments: Vec<_> = self.channels.iter_mut().flat_map(Channel::cut).collect();
        self.take(segments);
    }

    fn sync(&mut self) {
        self.order(|| Order::Sync);
    }
}

impl Drop for Recorder {
    /// The plant has stopped: the rest goes to the disk, too.
    fn drop(&mut self) {
        self.real_time = false;
        self.cut_all();
    }
}
