//! A block's recorded time, run again.

use super::player::{Player, Version};
use super::report::{Other, Replayed, clock};
use super::{Event, Recording, Segment, Start, Tolerances};
use latchwork_block::{Class, Component, Engine, LoadError};
use std::collections::HashMap;
use std::sync::Arc;

/// What is to be replayed and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// First plant time that counts, ns; what comes before is run through from the nearest state or cold start.
    pub from: u64,
    /// Last plant time that counts, ns.
    pub to: u64,
    /// Another component than the recorded one.
    pub with: Option<Component>,
    /// Deviations from the recorded outputs that do not count; only with another component.
    pub tolerances: Tolerances,
    /// Retained values and settings that do not fit the other component are clamped.
    pub lossy: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { from: 0, to: u64::MAX, with: None, tolerances: Tolerances::default(), lossy: false }
    }
}

/// Why a block cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The run or the block is not in the recording.
    #[error("run {run} has no recorded block `{block}`{hint}")]
    Unknown {
        /// Run.
        run: u64,
        /// Block.
        block: String,
        /// What there is.
        hint: String,
    },
    /// The component was not recorded, or is damaged.
    #[error("block `{block}`: its component {component} (SHA-256 {hash}) is not in the recording")]
    NoComponent {
        /// Block.
        block: String,
        /// Component.
        component: String,
        /// Its hash.
        hash: String,
    },
    /// A component that does not load, or has not the class.
    #[error("block `{block}`: {component}: {error}")]
    Load {
        /// Block.
        block: String,
        /// Component.
        component: String,
        /// Why.
        error: LoadError,
    },
    /// The recorded cells are not those of the class.
    #[error("block `{block}`: the recorded segment {number} does not fit class {class}: it is damaged or was changed")]
    Shape {
        /// Block.
        block: String,
        /// Segment.
        number: u64,
        /// Class.
        class: String,
    },
}

/// Runs what was recorded of a block again. The engine's ticker must run: a block may loop.
pub fn replay(
    recording: &Recording,
    engine: &Engine,
    run: u64,
    block: &str,
    options: &Options,
) -> Result<Replayed, ReplayError> {
    let segments = segments_of(recording, run, block)?;
    let mut replay = Replay {
        recording,
        engine,
        options,
        versions: HashMap::new(),
        player: None,
        playing: Default::default(),
        waits: None,
        following: None,
        told: Replayed { block: block.into(), run, ..Replayed::default() },
    };
    let begin = beginning(segments, options.from);
    for segment in &segments[begin..] {
        if segment.head.executions > 0 && segment.head.from > options.to {
            break;
        }
        replay.segment(segment)?;
    }
    Ok(replay.end())
}

/// Segments of a block.
pub(super) fn segments_of<'r>(recording: &'r Recording, run: u64, block: &str) -> Result<&'r [Segment], ReplayError> {
    let known: Vec<_> = recording.blocks(run).collect();
    if let Some((_, segments)) = known.iter().find(|(name, _)| *name == block) {
        return Ok(segments);
    }
    let names: Vec<_> = known.iter().map(|(name, _)| format!("`{name}`")).collect();
    let hint = if names.is_empty() { String::new() } else { format!("; it has {}", names.join(", ")) };
    Err(ReplayError::Unknown { run, block: block.into(), hint })
}

/// An error of a component of a block.
fn load_error(block: &str, component: &str) -> impl Fn(LoadError) -> ReplayError + use<> {
    let (block, component) = (block.to_string(), component.to_string());
    move |error| ReplayError::Load { block: block.clone(), component: component.clone(), error }
}

/// The recorded component and its class.
fn recorded(recording: &Recording, engine: &Engine, segment: &Segment) -> Result<(Component, Arc<Class>), ReplayError> {
    let head = &segment.head;
    let bytes = recording.component(&head.hash).ok_or_else(|| ReplayError::NoComponent {
        block: head.block.clone(),
        component: head.component.clone(),
        hash: head.hash.clone(),
    })?;
    let error = load_error(&head.block, &head.component);
    let component = engine.load_bytes(&head.component, bytes).map_err(&error)?;
    let class = component.class(Some(&head.class)).map_err(&error)?;
    Ok((component, class))
}

/// The recorded version of a segment.
pub(super) fn version_of(recording: &Recording, engine: &Engine, segment: &Segment) -> Result<Version, ReplayError> {
    let (component, class) = recorded(recording, engine, segment)?;
    Version::same(&component, class, &segment.head).map_err(load_error(&segment.head.block, &segment.head.component))
}

/// The segment to begin with: the last cold start before the time that counts, if everything since is there; else the last
/// state, which may lack what the class does not retain.
pub(super) fn beginning(segments: &[Segment], from: u64) -> usize {
    let before = |s: &Segment| s.head.from <= from || s.head.executions == 0;
    let last = |begins: &dyn Fn(&Start) -> bool| segments.iter().rposition(|s| before(s) && begins(&s.head.start));
    let state = last(&|start| matches!(start, Start::State(cells) if !cells.is_empty()));
    let cold = last(&|start| *start == Start::Cold).filter(|cold| {
        // What is damaged or was missed would have to be bridged by a state, after all.
        let end = state.unwrap_or(*cold).max(*cold);
        let whole = segments[*cold..=end].windows(2).all(|w| w[0].head.number + 1 == w[1].head.number);
        whole && segments[*cold..=end].iter().all(|s| s.head.missed == 0)
    });
    cold.or(state).or_else(|| segments.iter().position(|s| s.head.start != Start::Continued)).unwrap_or(0)
}

/// The nearest segment before a time from which a block can be run at all: what it gives from there is what counts.
pub(super) fn nearest(segments: &[Segment], from: u64) -> usize {
    let begins = |s: &Segment| match &s.head.start {
        Start::Cold => true,
        Start::State(cells) => !cells.is_empty(),
        Start::Continued => false,
    };
    let before = |s: &Segment| s.head.from <= from || s.head.executions == 0;
    segments.iter().rposition(|s| before(s) && begins(s)).unwrap_or_else(|| beginning(segments, from))
}

struct Replay<'a> {
    recording: &'a Recording,
    engine: &'a Engine,
    options: &'a Options,
    versions: HashMap<String, Version>,
    player: Option<Player>,
    /// Version and component of the player.
    playing: (u64, String),
    /// The version before, which may come back as it stood.
    waits: Option<((u64, String), Player)>,
    /// Number of the segment that goes on where the player is.
    following: Option<u64>,
    told: Replayed,
}

impl Replay<'_> {
    fn segment(&mut self, segment: &Segment) -> Result<(), ReplayError> {
        let head = &segment.head;
        let follows = self.following == Some(head.number);
        let new = !self.versions.contains_key(&head.hash);
        if !follows {
            self.settle_waiting();
        }
        let plays = (head.version, head.hash.clone());
        if self.player.is_none() || self.playing != plays {
            let back = self.waits.take_if(|(which, _)| *which == plays);
            self.settle_waiting();
            let before = std::mem::replace(&mut self.playing, plays);
            self.waits = self.player.take().map(|player| (before, player));
            self.player = Some(match back {
                Some((_, player)) => player,
                None => {
                    let version = self.version(segment)?;
                    Player::new(version, &self.options.tolerances, &head.block, self.options.lossy)
                }
            });
        }
        let Some(player) = &mut self.player else { return Ok(()) };
        if !player.fits(head) {
            let (block, number, class) = (head.block.clone(), head.number, head.class.clone());
            return Err(ReplayError::Shape { block, number, class });
        }
        if self.told.component.is_empty() {
            (self.told.component, self.told.hash) = (head.component.clone(), head.hash.clone());
            self.told.epoch = head.epoch;
        }
        match &head.start {
            Start::Cold => player.cold(&head.settings),
            Start::Continued if !follows => player.lose_with(&head.settings),
            // A version that came with a swap: this state is all it got.
            Start::State(cells) if new && follows && !cells.is_empty() => player.state(&head.settings, cells),
            Start::State(cells) if follows && player.lives() => player.check_state(cells, head.from),
            Start::State(cells) => {
                let (class, at) = (&head.class, clock(head.from));
                self.told.note(if cells.is_empty() {
                    format!(
                        "{class} retains nothing: what it remembers by itself is not in the recording, and from {at} on it is \
                         replayed without it. Exact is only a replay from its cold start"
                    )
                } else {
                    format!(
                        "it begins at {at} with the state that was saved there: what {class} remembers and does not retain is \
                         not in it"
                    )
                });
                player.state(&head.settings, cells);
            }
            Start::Continued => {}
        }
        self.following = Some(head.number + 1);
        let mut events = segment.events();
        loop {
            let event = match events.next_event() {
                Ok(Some(event)) => event,
                Ok(None) => return Ok(()),
                Err(damaged) => {
                    self.told.note(format!("segment {} is damaged: {damaged}", head.number));
                    player.lose();
                    return Ok(());
                }
            };
            match event {
                Event::Execution { scan, .. } if scan.now > self.options.to => return Ok(()),
                Event::Execution { scan, arguments, outputs } => {
                    player.execute(scan, arguments, outputs, scan.now >= self.options.from);
                }
                Event::Settings { cells, taken } => player.configure(cells, taken),
                Event::Restarted => player.restart(),
                Event::Missed(n) => {
                    self.told.missed = self.told.missed.saturating_add(n);
                    player.lose();
                }
            }
        }
    }

    /// The recorded version of a segment, and the one that is executed.
    fn version(&mut self, segment: &Segment) -> Result<Version, ReplayError> {
        let head = &segment.head;
        if let Some(known) = self.versions.get(&head.hash) {
            return Ok(known.clone());
        }
        let version = match &self.options.with {
            None => version_of(self.recording, self.engine, segment)?,
            Some(other) => {
                let (_, class) = recorded(self.recording, self.engine, segment)?;
                self.told.with = Some(Other { component: other.name().into(), hash: other.hash().into() });
                // Another version of the class is what one wants to try.
                let name = head.class.split('@').next().unwrap_or(&head.class);
                let error = load_error(&head.block, other.name());
                let other_class = other.class(Some(name)).map_err(&error)?;
                Version::other(class, other, &other_class, head).map_err(&error)?
            }
        };
        self.versions.insert(head.hash.clone(), version.clone());
        Ok(version)
    }

    /// What the version before has found: it does not come back.
    fn settle_waiting(&mut self) {
        if let Some((_, player)) = self.waits.take() {
            player.tell(&mut self.told);
        }
    }

    /// What the present player has found.
    fn settle(&mut self) {
        self.settle_waiting();
        if let Some(player) = self.player.take() {
            player.tell(&mut self.told);
        }
    }

    fn end(mut self) -> Replayed {
        self.settle();
        self.told
    }
}
