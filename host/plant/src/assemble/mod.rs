//! From the checked model to a plant that can run: instances, regions, lanes, drivers.

mod alarms;
mod blocks;
mod interrupt;
mod lane;
mod points;
mod trace;

use crate::alarms::Annunciator;
use crate::lane::{Change, Lane, Tracer, Wake, Watch};
use crate::layout::{Layout, lane_source};
use crate::model::Model;
use crate::operate::{Desk, Wish};
use crate::recorder::Recorder as FlightRecorder;
use crate::retain::Keeper;
use crate::sim::SimPoints;
use crate::supervision::{Beats, Table};
use crate::supervisor::{LaneLink, Supervisor};
use crate::swap::Swaps;
use interrupt::Interrupts;
use lane::LaneWiring;
pub(crate) use lane::registers;
use latchwork_block::{Engine, LoadError, Ticker};
use latchwork_image::{ForceBoard, Quality, RegionReader, RegionWriter, Resolved, TagId, View, region};
use latchwork_io::driver::{Driver, Outputs};
use latchwork_record::{Recorder, Router, SourceId, queue};
use points::DriverSources;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

/// Entries one lane, driver or operator interface may have under way.
const QUEUE: usize = 1024;
/// The same of an interrupt lane, whose edges come in bursts.
const INTERRUPT_QUEUE: usize = 16_384;
/// Requests to one lane that may wait, besides one per block.
const REQUESTS: usize = 64;
/// Trace rows one lane may have under way.
const TRACE: usize = 65536;

/// Which clock the plant will run by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// The machine's; budgets are what the plant file says.
    Real,
    /// Virtual: budgets only catch what would never end, or the result would depend on the machine's speed.
    Virtual,
}

/// How to assemble.
pub struct Options<'a> {
    /// Clock.
    pub time: Time,
    /// Tags to trace, a glob; `None` traces nothing. Statistics of lanes are traced only when named from `lane.` on.
    pub trace: Option<&'a str>,
}

/// Why a plant could not be assembled, although its file is right.
#[derive(Debug, thiserror::Error)]
pub enum AssembleError {
    /// A component.
    #[error("block `{block}`: {error}")]
    Load {
        /// Block.
        block: String,
        /// Why.
        error: LoadError,
    },
    /// A block that could not be made or refused its settings.
    #[error("block `{block}`: {message}")]
    Block {
        /// Block.
        block: String,
        /// Why.
        message: String,
    },
    /// A driver.
    #[error("driver `{driver}`: {message}")]
    Driver {
        /// Driver.
        driver: String,
        /// Why.
        message: String,
    },
    /// Tags.
    #[error(transparent)]
    Tag(#[from] latchwork_image::TagError),
    /// What only a running lane needs.
    #[error("lane `{lane}`: {message}")]
    Lane {
        /// Lane.
        lane: String,
        /// Why.
        message: String,
    },
    /// The glob of traced tags.
    #[error("\"{glob}\" is not a glob of tags: {error}; use * and ?, as in \"unit.outputs.*\"")]
    Glob {
        /// What was given.
        glob: String,
        /// Why.
        error: String,
    },
}

/// A driver, ready to run.
pub struct DriverParts {
    /// Name.
    pub name: String,
    /// The driver.
    pub driver: Box<dyn Driver>,
    /// Its region.
    pub region: RegionWriter,
    /// What its output points show.
    pub outputs: Outputs,
    /// Its records.
    pub recorder: Recorder,
    /// Its name and those of its points as sources.
    pub sources: HashMap<String, SourceId>,
}

/// A plant, ready to run.
pub struct Plant {
    /// What it was made from.
    pub model: Arc<Model>,
    /// Where everything stands.
    pub layout: Arc<Layout>,
    /// Lanes.
    pub lanes: Vec<Lane>,
    /// Real drivers; empty under `--sim`.
    pub drivers: Vec<DriverParts>,
    /// Points of `sim` drivers.
    pub sim: SimPoints,
    /// Restarts blocks.
    pub supervisor: Supervisor,
    /// Orders records, and what operators want of alarms.
    pub router: Router<Wish>,
    /// Life of the alarms.
    pub annunciator: Annunciator,
    /// What operators have under way.
    pub desk: Desk,
    /// Which clock it runs by.
    pub(crate) time: Time,
    /// Swaps of blocks.
    pub(crate) swaps: Swaps,
    /// State that outlives a restart.
    pub(crate) keeper: Keeper,
    /// The flight recorder.
    pub(crate) recorder: FlightRecorder,
    /// Status tables.
    pub(crate) tables: Vec<Table>,
    /// Signs of life.
    pub(crate) beats: Beats,
    /// Trace rows by lane.
    pub trace: Vec<rtrb::Consumer<Change>>,
    /// Readers of all regions by number.
    pub regions: Arc<[RegionReader]>,
    /// Forces.
    pub forces: ForceBoard,
    /// The engine its blocks run on; its ticker watches their budgets.
    pub(crate) engine: Engine,
    /// Period of that ticker, ns.
    pub(crate) tick: u64,
    /// Wakes the threads of interrupt lanes.
    pub(crate) wakes: Vec<Arc<Wake>>,
    /// The way for records about the journal, for whoever keeps it.
    pub journal: Option<(Recorder, SourceId)>,
    /// What records about each sink name as their source.
    pub sinks: Vec<SourceId>,
    /// Time of the oldest record that a lane may still make, by lane.
    pub(crate) oldest: Vec<Arc<AtomicU64>>,
}

impl Plant {
    /// A view of some tags that stays valid while the plant runs.
    pub fn view(&self, tags: &[TagId]) -> View {
        view(&self.layout, &self.regions, tags)
    }
}

fn view(layout: &Layout, regions: &[RegionReader], tags: &[TagId]) -> View {
    let resolved = tags.iter().map(|t| layout.tags.resolve(*t).unwrap_or(Resolved::Constant(0)));
    View::new(regions, &resolved.collect::<Vec<_>>())
}

/// Names of sources of records, numbered as they are asked for.
#[derive(Default)]
struct Sources {
    names: Vec<String>,
}

impl Sources {
    fn add(&mut self, name: String) -> SourceId {
        self.names.push(name);
        SourceId((self.names.len() - 1) as u32)
    }
}

/// Assembles a plant. Every block is instantiated and configured once here, so what fails at start fails before anything
/// moves.
pub fn assemble(model: Model, engine: &Engine, options: &Options<'_>) -> Result<Plant, AssembleError> {
    let model = Arc::new(model);
    let shortest_budget = model.blocks.iter().map(|b| b.budget).min().unwrap_or(100_000_000);
    let tick = blocks::tick_ns(shortest_budget, options.time);
    // A block that loops in `configure` is stopped, too.
    let _ticker = Ticker::start(engine, Duration::from_nanos(tick));
    let (recipes, instances) = blocks::instantiate(&model, options.time, tick)?;
    let settings: Vec<_> = recipes.iter().map(|r| r.settings.clone()).collect();
    let mut layout = Layout::new(&model, &settings)?;
    let traced = trace::traced_tags(&model, &layout, options.trace)?;
    let mut watches: Vec<Vec<Watch>> = model.lanes.iter().map(|_| Vec::new()).collect();
    for (tag, lanes) in traced {
        for lane in lanes {
            if let Some(probe) = layout.probe(lane, tag)? {
                watches[lane].push(Watch::new(tag, probe));
            }
        }
    }

    let polled = interrupt::polled(&model, &mut layout)?;
    let watched = alarms::watched(&model, &mut layout)?;

    let mut forces = ForceBoard::default();
    let (mut writers, mut readers) = (Vec::new(), Vec::new());
    let mut add_region = |cells: &[u64]| {
        let (writer, reader) = region(cells);
        writers.push(Some(writer));
        readers.push(reader);
    };
    for lane in &layout.lanes {
        add_region(&lane.cells[..lane.published as usize]);
    }
    for driver in 0..model.drivers.len() {
        add_region(&[0, Quality::Bad.cell()].repeat(model.region_inputs(driver).count()));
    }
    add_region(&layout.operators);
    let regions: Arc<[RegionReader]> = readers.into();

    let mut sources = Sources::default();
    let driver_sources: Vec<_> = model.drivers.iter().map(|d| DriverSources::new(d, &mut sources)).collect();
    let mut annunciator = Annunciator::new(&model);
    let mut conditions = alarms::connect(&model, watched, &mut sources, &mut annunciator);
    let mut sim = SimPoints::default();
    let oldest: Vec<_> = model.lanes.iter().map(|_| Arc::new(AtomicU64::new(u64::MAX))).collect();
    let context = interrupt::Context {
        model: &model,
        layout: &layout,
        oldest: &oldest,
        sources: &driver_sources,
        time: options.time,
    };
    let mut interrupts = Interrupts::new(&context, polled, &mut sim)?;
    let (mut lanes, mut links, mut trace, mut queues) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut instances: Vec<_> = instances.into_iter().map(Some).collect();
    for (index, watches) in watches.into_iter().enumerate() {
        let Some(writer) = writers[index].take() else { continue };
        let source = sources.add(lane_source(&model.lanes[index]));
        let interrupt = interrupts.take(index);
        let (recorder, incoming) = queue(if interrupt.is_some() { INTERRUPT_QUEUE } else { QUEUE }, source);
        queues.push(incoming);
        let blocks = layout.lanes[index].blocks.len();
        let (to_lane, requests) = rtrb::RingBuffer::new(REQUESTS + blocks);
        // A block has at most one restart under way of each of two versions, and hands over one dead instance of each.
        let (restarts, from_lane) = rtrb::RingBuffer::new(4 * blocks + 1);
        let (configured, answers) = rtrb::RingBuffer::new(REQUESTS + blocks);
        let (reports, back) = rtrb::RingBuffer::new(REQUESTS + blocks);
        links.push(LaneLink { restarts: from_lane, requests: to_lane, configured: answers, reports: back });
        let changes = options.trace.map(|_| {
            let (producer, consumer) = rtrb::RingBuffer::new(TRACE);
            trace.push(consumer);
            producer
        });
        let wiring = LaneWiring {
            index,
            oldest: Arc::clone(&oldest[index]),
            region: writer,
            source,
            recorder,
            requests,
            restarts,
            configured,
            reports,
            conditions: std::mem::take(&mut conditions[index]),
            tracer: Tracer::new(index as u32, watches, changes),
            forces: forces.add_writer(),
            followers: std::mem::take(&mut interrupts.followers[index]),
            interrupt,
            initial: std::mem::take(&mut interrupts.initial[index]),
        };
        lanes.push(wiring.lane(&model, &layout, &regions, &mut instances, &mut sources));
    }

    let mut drivers = Vec::new();
    for (index, driver) in model.drivers.iter().enumerate() {
        let Some(mut region) = writers[layout.driver_region(index) as usize].take() else { continue };
        region.hold(forces.add_writer());
        if driver.simulated(model.sim) {
            sim.add(&model, index, region);
            continue;
        }
        let Some(config) = points::for_io_thread(&model, index) else { continue };
        let name = driver.config.name.clone();
        let error = |message| AssembleError::Driver { driver: name.clone(), message };
        let made = (driver.kind.build)(config).map_err(error)?;
        let DriverSources { source, known } = &driver_sources[index];
        let (recorder, incoming) = queue(QUEUE, *source);
        queues.push(incoming);
        let outputs = points::outputs(&model, &layout, &regions, index)?;
        drivers.push(DriverParts { name, driver: made, region, outputs, recorder, sources: known.clone() });
    }
    alarms::listen(&model, &mut lanes, &mut annunciator);
    // Settings are written, not forced; but every region has its number among the writers.
    forces.add_writer();
    let settings = writers[layout.operators_region() as usize].take();
    let source = sources.add(latchwork_record::journal::SOURCE.into());
    let (recorder, incoming) = queue(QUEUE, source);
    queues.push(incoming);
    let journal = Some((recorder, source));
    let sinks = model.sinks.iter().map(|s| sources.add(format!("sink.{}", s.config.name))).collect();

    let mut router = Router::new(sources.names);
    router.rank_by(crate::alarms::rank);
    for incoming in queues {
        router.add(incoming);
    }
    let supervisor = Supervisor { recipes, lanes: links, held: Vec::new() };
    let layout = Arc::new(layout);
    let desk = Desk::new(&model, &layout, settings, &regions);
    let tables = model.tables.iter().map(|table| {
        let ids: Vec<_> = table.tags.iter().map(|what| layout.ids[what]).collect();
        Table::new(&table.name, &ids, &layout.tags, view(&layout, &regions, &ids), table.every)
    });
    let tables = tables.collect();
    Ok(Plant {
        tables,
        beats: Beats::default(),
        model,
        layout,
        lanes,
        drivers,
        sim,
        supervisor,
        router,
        annunciator,
        desk,
        time: options.time,
        swaps: Swaps::default(),
        keeper: Keeper::default(),
        recorder: FlightRecorder::default(),
        trace,
        regions,
        forces,
        engine: engine.clone(),
        tick,
        wakes: interrupts.wakes,
        oldest,
        journal,
        sinks,
    })
}
