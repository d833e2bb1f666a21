//! From the checked model to a plant that can run: instances, regions, lanes, drivers.

use crate::lane::{Block, BlockState, Change, Lane, LaneParts, Mode, Request, Rest, RestartRequest, Tracer, Watch};
use crate::layout::{Layout, STATE, lane_source};
use crate::model::{Model, TagRef};
use crate::sim::{Action, SimPoints};
use crate::supervisor::{LaneLink, Recipe, Supervisor};
use globset::{Glob, GlobMatcher};
use latchwork_block::{Class, Engine, Limits, LoadError, Template, Ticker};
use latchwork_image::{ForceBoard, Location, Quality, RegionReader, RegionWriter, Resolved, TagId, View, region};
use latchwork_io::driver::{Driver, Outputs};
use latchwork_record::{Recorder, Router, SourceId, queue};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

/// Entries one lane, driver or operator interface may have under way.
const QUEUE: usize = 1024;
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
    /// Orders records.
    pub router: Router,
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
}

impl Plant {
    /// Does what a row of the stimulus says.
    pub fn stimulate(&mut self, action: Action) {
        match action {
            Action::Point { place, cell } => self.sim.set(place, cell),
            Action::Command { block, bit, set } => {
                let lane = self.model.blocks[block].lane;
                let at = self.layout.lanes[lane].blocks.iter().position(|b| b.block == block);
                let mode = if set { Mode::OneShot } else { Mode::Level(false) };
                if let Some(index) = at {
                    // A stimulus sends few commands; a lane that is too busy to take them has faulted.
                    let _ = self.supervisor.send(lane, Request::Command { block: index as u32, bit, mode });
                }
            }
        }
    }

    /// A view of some tags that stays valid while the plant runs.
    pub fn view(&self, tags: &[TagId]) -> View {
        let resolved: Vec<_> =
            tags.iter().map(|t| self.layout.tags.resolve(*t).unwrap_or(Resolved::Constant(0))).collect();
        View::new(&self.regions, &resolved)
    }
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
    let tick = tick_ns(shortest_budget, options.time);
    // A block that loops in `configure` is stopped, too.
    let _ticker = Ticker::start(engine, Duration::from_nanos(tick));
    let (recipes, instances) = instantiate(&model, options.time, tick)?;
    let settings: Vec<_> = recipes.iter().map(|r| r.settings.clone()).collect();
    let mut layout = Layout::new(&model, &settings)?;
    let traced = traced_tags(&model, &layout, options.trace)?;
    let mut watches: Vec<Vec<Watch>> = model.lanes.iter().map(|_| Vec::new()).collect();
    for (tag, lanes) in traced {
        for lane in lanes {
            if let Some(probe) = layout.probe(lane, tag)? {
                watches[lane].push(Watch::new(tag, probe));
            }
        }
    }

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
    for driver in &model.drivers {
        let inputs = driver.config.points.iter().filter(|p| p.safe.is_none()).count();
        add_region(&[0, Quality::Bad.cell()].repeat(inputs));
    }
    add_region(&layout.operators);
    let regions: Arc<[RegionReader]> = readers.into();

    let mut sources = Sources::default();
    let (mut lanes, mut links, mut trace, mut queues) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut instances: Vec<_> = instances.into_iter().map(Some).collect();
    for (index, watches) in watches.into_iter().enumerate() {
        let Some(writer) = writers[index].take() else { continue };
        let source = sources.add(lane_source(&model.lanes[index]));
        let (recorder, incoming) = queue(QUEUE, source);
        queues.push(incoming);
        let blocks = layout.lanes[index].blocks.len();
        let (to_lane, requests) = rtrb::RingBuffer::new(REQUESTS + blocks);
        // A block has at most one restart under way, and hands over one dead instance when it is parked.
        let (restarts, from_lane) = rtrb::RingBuffer::new(2 * blocks + 1);
        links.push(LaneLink { restarts: from_lane, requests: to_lane });
        let changes = options.trace.map(|_| {
            let (producer, consumer) = rtrb::RingBuffer::new(TRACE);
            trace.push(consumer);
            producer
        });
        let wiring = LaneWiring {
            index,
            region: writer,
            source,
            recorder,
            requests,
            restarts,
            tracer: Tracer::new(index as u32, watches, changes),
            forces: forces.add_writer(),
        };
        lanes.push(wiring.lane(&model, &layout, &regions, &mut instances, &mut sources));
    }

    let mut sim = SimPoints::default();
    let mut drivers = Vec::new();
    for (index, driver) in model.drivers.iter().enumerate() {
        let Some(region) = writers[layout.driver_region(index) as usize].take() else { continue };
        forces.add_writer();
        if model.sim || driver.kind.name == "sim" {
            sim.add(driver, region);
            continue;
        }
        let name = driver.config.name.clone();
        let error = |message| AssembleError::Driver { driver: name.clone(), message };
        let made = (driver.kind.build)(driver.config.clone()).map_err(error)?;
        let source = sources.add(name.clone());
        let (recorder, incoming) = queue(QUEUE, source);
        queues.push(incoming);
        let mut known = HashMap::from([(name.clone(), source)]);
        for point in &driver.config.points {
            let full = format!("{name}.{}", point.name);
            known.insert(full.clone(), sources.add(full));
        }
        let outputs = outputs(&model, &layout, &regions, index)?;
        drivers.push(DriverParts { name, driver: made, region, outputs, recorder, sources: known });
    }
    forces.add_writer();

    let mut router = Router::new(sources.names);
    for incoming in queues {
        router.add(incoming);
    }
    let supervisor = Supervisor { recipes, lanes: links };
    let layout = Arc::new(layout);
    Ok(Plant {
        model,
        layout,
        lanes,
        drivers,
        sim,
        supervisor,
        router,
        trace,
        regions,
        forces,
        engine: engine.clone(),
        tick,
    })
}

/// Period of the epoch ticker for a shortest budget, ns.
fn tick_ns(shortest_budget: u64, time: Time) -> u64 {
    match time {
        Time::Real => (shortest_budget / 2).clamp(500_000, 10_000_000),
        Time::Virtual => 10_000_000,
    }
}

fn instantiate(
    model: &Model,
    time: Time,
    tick: u64,
) -> Result<(Vec<Recipe>, Vec<latchwork_block::Instance>), AssembleError> {
    let mut templates: HashMap<(String, String), Template> = HashMap::new();
    let (mut recipes, mut instances) = (Vec::new(), Vec::new());
    for b in &model.blocks {
        let key = (b.component.hash().to_string(), b.class.name.clone());
        let template = match templates.get(&key) {
            Some(t) => t.clone(),
            None => {
                let load = |error| AssembleError::Load { block: b.name.clone(), error };
                let t = b.component.template(&b.class).map_err(load)?;
                templates.insert(key, t.clone());
                t
            }
        };
        // At virtual time the wall clock decides nothing but what never ends.
        let budget = if time == Time::Virtual { b.budget.max(1_000_000_000) } else { b.budget };
        let limits = Limits { memory: b.memory, budget_ticks: budget.div_ceil(tick) + 1, ..Limits::default() };
        let wrong = |message: String| AssembleError::Block { block: b.name.clone(), message };
        let mut probe = template.instantiate(&limits).map_err(|f| wrong(f.to_string()))?;
        let defaults = probe.defaults().map_err(|f| wrong(f.to_string()))?;
        let settings = complete(&b.class, &b.settings, defaults.as_deref());
        if let Err(sentence) = probe.configure(&settings).map_err(|f| wrong(f.to_string()))? {
            return Err(wrong(format!("it refuses its settings: {sentence}")));
        }
        recipes.push(Recipe { template, limits, settings });
        instances.push(probe);
    }
    Ok((recipes, instances))
}

/// The file's settings, completed by the component's defaults, or 0.
fn complete(class: &Class, given: &[Option<u64>], defaults: Option<&[u64]>) -> Vec<u64> {
    (0..class.settings.len())
        .map(|i| given.get(i).copied().flatten().or_else(|| defaults.and_then(|d| d.get(i).copied())).unwrap_or(0))
        .collect()
}

/// What belongs to one lane alone.
struct LaneWiring {
    index: usize,
    region: RegionWriter,
    source: SourceId,
    recorder: Recorder,
    requests: rtrb::Consumer<Request>,
    restarts: rtrb::Producer<RestartRequest>,
    tracer: Tracer,
    forces: latchwork_image::ForceInbox,
}

impl LaneWiring {
    fn lane(
        self,
        model: &Model,
        layout: &Layout,
        regions: &[RegionReader],
        instances: &mut [Option<latchwork_block::Instance>],
        sources: &mut Sources,
    ) -> Lane {
        let (this, config) = (&layout.lanes[self.index], &model.lanes[self.index]);
        let (mut ins, mut converts, mut reals, mut blocks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for b in &this.blocks {
            let of = &model.blocks[b.block];
            let source = sources.add(of.name.clone());
            let alarm_sources =
                of.class.alarms.iter().map(|a| sources.add(format!("{}.alarms.{a}", of.name))).collect();
            blocks.push(Block {
                instance: instances[b.block].take(),
                last: 0,
                first: true,
                ran: false,
                not_finite: false,
                ins: extend(&mut ins, &b.ins),
                converts: extend(&mut converts, &b.converts),
                reals: extend(&mut reals, &b.reals),
                out: b.out.clone(),
                quality: b.quality,
                alarms: b.alarms.map(|cell| (cell, 0)),
                rest: Box::new(Rest {
                    model: b.block,
                    source,
                    alarm_sources,
                    commands: b.commands,
                    one_shot: 0,
                    qualities: b.qualities.clone(),
                    safe: b.safe.clone(),
                    on_fault: of.on_fault,
                    state: BlockState::Running,
                    strikes: 0,
                    faults: 0,
                    faulted_at: 0,
                    restart_at: 0,
                    ready: None,
                    messages: Default::default(),
                    not_finite: 0,
                }),
            });
        }
        let imports = this.imports.iter().map(|(r, list)| (regions[*r as usize].clone(), list.clone())).collect();
        Lane::new(LaneParts {
            name: config.name.clone(),
            index: self.index,
            every: config.every,
            watchdog: config.watchdog,
            cells: this.cells.clone(),
            region: self.region,
            imports,
            blocks,
            ins,
            converts,
            reals,
            forces: self.forces,
            recorder: self.recorder,
            source: self.source,
            requests: self.requests,
            restarts: self.restarts,
            tracer: self.tracer,
        })
    }
}

/// Appends to a lane-wide list and returns the place.
fn extend<T: Clone>(all: &mut Vec<T>, part: &[T]) -> std::ops::Range<u32> {
    let start = all.len() as u32;
    all.extend_from_slice(part);
    start..all.len() as u32
}

/// Two entries per output point of a driver: its value, and the state of the lane it comes from.
fn outputs(
    model: &Model,
    layout: &Layout,
    regions: &[RegionReader],
    driver: usize,
) -> Result<Outputs, latchwork_image::TagError> {
    let mut wanted = Vec::new();
    for (point, config) in model.drivers[driver].config.points.iter().enumerate() {
        if config.safe.is_none() {
            continue;
        }
        let value = layout.tags.resolve(layout.ids[&TagRef::Point { driver, point }])?;
        wanted.push(value);
        wanted.push(match value {
            Resolved::Cell { location, .. } if (location.region as usize) < model.lanes.len() => Resolved::Cell {
                location: Location { region: location.region, slot: STATE, bit: None, quality: None },
                not: false,
            },
            // A point that repeats another driver's input or a setting follows no lane.
            _ => Resolved::Constant(Outputs::RUNNING),
        });
    }
    Ok(Outputs::new(View::new(regions, &wanted)))
}

/// The traced tags and the lanes that trace them: a block's by its own lane, an input point by every lane that reads it.
fn traced_tags(model: &Model, layout: &Layout, glob: Option<&str>) -> Result<Vec<(TagId, Vec<usize>)>, AssembleError> {
    let Some(glob) = glob else { return Ok(Vec::new()) };
    let matcher: GlobMatcher = Glob::new(glob)
        .map_err(|e| AssembleError::Glob { glob: glob.into(), error: e.kind().to_string() })?
        .compile_matcher();
    let mut traced: Vec<(TagId, Vec<usize>)> = Vec::new();
    for (what, id) in &layout.ids {
        let lanes = match *what {
            TagRef::Lane { lane, .. } if glob.starts_with("lane.") => vec![lane],
            TagRef::Lane { .. } => continue,
            TagRef::Point { .. } => point_lanes(model, layout, *id),
            TagRef::Input { block, .. }
            | TagRef::Output { block, .. }
            | TagRef::Alarm { block, .. }
            | TagRef::Command { block, .. }
            | TagRef::Setting { block, .. } => vec![model.blocks[block].lane],
        };
        if matcher.is_match(&layout.tags.get(*id).name) {
            traced.push((*id, lanes));
        }
    }
    traced.sort_unstable();
    Ok(traced)
}

/// The lanes that see a point: the one that writes it, or those that read it, or the first.
fn point_lanes(model: &Model, layout: &Layout, id: TagId) -> Vec<usize> {
    let Ok(Resolved::Cell { location, .. }) = layout.tags.resolve(id) else { return vec![0] };
    if (location.region as usize) < model.lanes.len() {
        return vec![location.region as usize];
    }
    let reads = |lane: &crate::layout::LaneLayout| {
        lane.imports.iter().any(|(r, list)| *r == location.region && list.iter().any(|(s, _)| *s == location.slot))
    };
    let lanes: Vec<_> = layout.lanes.iter().enumerate().filter(|(_, l)| reads(l)).map(|(i, _)| i).collect();
    if lanes.is_empty() { vec![0] } else { lanes }
}
