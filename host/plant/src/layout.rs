//! Where everything stands: regions, cells, tags and the wiring of each lane, computed once from the model.
//!
//! Region `n` is lane `n`'s, then come the drivers' regions, then the operators' (settings). A lane works on one array of
//! cells. Its first part is its own region, published at the end of a scan:
//!
//! ```text
//! state | statistics | inputs it serves itself: value, quality | per block: quality, commands word, output leaves …, alarms word | … │ imports, constants, converted inputs
//! └────────────────────────── published ──────────────────────────────────────────────────────────────────────────┘ └── private …
//! ```
//! Behind the blocks the published part has spare cells, for ports that versions of blocks bring along while the plant runs.
//!
//! Wires cost nothing: a block's argument list holds the index of the source's cell. Only inverted inputs and single
//! flags of a word need a cell of their own, filled right before the block executes.

use crate::model::{Input, Lane, Model, Statistic, TagRef, Wire};
use latchwork_block::Port;
use latchwork_image::{Location, Quality, Resolved, Source, TagError, TagId, TagTable, Type};
use std::collections::HashMap;
use std::ops::Range;

mod grow;

pub use grow::NoRoom;

/// First cell of a lane's region: its state.
pub const STATE: u32 = 0;
/// First of the lane's statistics.
pub const STATISTICS: u32 = 1;

/// The whole plant's layout.
#[derive(Clone)]
pub struct Layout {
    /// Every tag with its place.
    pub tags: TagTable,
    /// Tag by what it is.
    pub ids: HashMap<TagRef, TagId>,
    /// Per lane.
    pub lanes: Vec<LaneLayout>,
    /// Cells of the operators' region: the settings of all blocks, then spare ones.
    pub operators: Vec<u64>,
    /// Cells of it that are in use.
    operators_used: usize,
    /// Per block: where its settings stand in the operators' region, by port.
    pub settings: Vec<Vec<usize>>,
    drivers: usize,
}

/// One lane's cells and wiring.
#[derive(Clone, Default)]
pub struct LaneLayout {
    /// Number of cells that can be published.
    pub published: u32,
    /// Number of those that are in use; the others are spare.
    pub used: u32,
    /// A cell that is always 0, and behind it one that is the quality bad.
    pub nothing: u32,
    /// All cells with their first values.
    pub cells: Vec<u64>,
    /// Per foreign region: `(slot, cell)`.
    pub imports: Vec<(u32, Vec<(u32, u32)>)>,
    /// Per point of [`crate::model::Lane::served`]: cell of its value, its quality follows; `None` for an output point.
    pub served: Vec<Option<u32>>,
    /// Blocks in the order of execution.
    pub blocks: Vec<BlockLayout>,
}

/// One block's place in its lane.
#[derive(Clone)]
pub struct BlockLayout {
    /// Index in the model.
    pub block: usize,
    /// Quality of the block's plain outputs and alarms.
    pub quality: u32,
    /// Commands word.
    pub commands: Option<u32>,
    /// Output leaves, then the alarms word, as the plant file's version has them.
    pub out: Range<u32>,
    /// Those of the laid-out version, which may have grown since.
    pub outs: Vec<u32>,
    /// It has grown by cells: only an adapter reaches those.
    pub scattered: bool,
    /// Alarms word.
    pub alarms: Option<u32>,
    /// Argument cells: input leaves, then the commands word.
    pub ins: Vec<u32>,
    /// Conversions before execution.
    pub converts: Vec<Convert>,
    /// Plain real outputs: cell and exponent mask, all ones in a value that is not finite.
    pub reals: Vec<(u32, u64)>,
    /// Quality cells of signal outputs.
    pub qualities: Vec<u32>,
    /// Output values under `on-fault = "safe"`.
    pub safe: Vec<(u32, u64)>,
    /// Status registers: outputs of a flags type named `status`; port and cell.
    pub status: Vec<(usize, u32)>,
}

/// One bool input that is a flag of a word or inverted: `cells[to] = cells[from] >> shift & 1 ^ flip`.
#[derive(Clone, Copy, Debug)]
pub struct Convert {
    /// Source cell.
    pub from: u32,
    /// Destination cell.
    pub to: u32,
    /// Bit of the source.
    pub shift: u8,
    /// Inverted.
    pub flip: bool,
}

/// Where a lane sees a tag.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// The lane's cell.
    pub cell: u32,
    /// The tag is this bit of it.
    pub shift: Option<u8>,
    /// Inverted.
    pub not: bool,
}

impl Probe {
    /// The tag's value.
    #[inline]
    pub fn read(self, cells: &[u64]) -> u64 {
        let cell = cells[self.cell as usize];
        let cell = self.shift.map_or(cell, |b| cell >> b & 1);
        if self.not { cell ^ 1 } else { cell }
    }
}

impl Layout {
    /// Lays out a model. `settings` are the cells of each block's settings, complete.
    pub fn new(model: &Model, settings: &[Vec<u64>]) -> Result<Self, TagError> {
        let mut layout = Self {
            tags: TagTable::default(),
            ids: HashMap::new(),
            lanes: model.lanes.iter().map(|_| LaneLayout::default()).collect(),
            operators: Vec::new(),
            operators_used: 0,
            settings: Vec::new(),
            drivers: model.drivers.len(),
        };
        for (lane, of) in layout.lanes.iter_mut().zip(&model.lanes) {
            lane.cells = vec![0; STATISTICS as usize + Statistic::ALL.len()];
            lane.served = vec![None; of.served.len()];
        }
        layout.place_points(model)?;
        layout.place_lanes(model)?;
        for (index, cells) in settings.iter().enumerate() {
            layout.place_block(model, index, cells)?;
        }
        layout.link(model);
        layout.spare();
        for lane in 0..model.lanes.len() {
            layout.wire_lane(model, lane)?;
        }
        Ok(layout)
    }

    /// Region of the operators.
    pub fn operators_region(&self) -> u32 {
        (self.lanes.len() + self.drivers) as u32
    }

    /// Region of a driver.
    pub fn driver_region(&self, driver: usize) -> u32 {
        (self.lanes.len() + driver) as u32
    }

    /// Makes a tag visible in a lane's cells, importing it if nothing there reads it yet; `None` for a constant.
    pub fn probe(&mut self, lane: usize, tag: TagId) -> Result<Option<Probe>, TagError> {
        let Resolved::Cell { location: Location { region, slot, bit, .. }, not } = self.tags.resolve(tag)? else {
            return Ok(None);
        };
        Ok(Some(Probe { cell: self.visible(lane, region, slot), shift: bit, not }))
    }

    /// The same for a tag's quality; `None` for one that is always good.
    pub fn probe_quality(&mut self, lane: usize, tag: TagId) -> Result<Option<Probe>, TagError> {
        let Resolved::Cell { location: Location { region, quality: Some(slot), .. }, .. } = self.tags.resolve(tag)?
        else {
            return Ok(None);
        };
        Ok(Some(Probe { cell: self.visible(lane, region, slot), shift: None, not: false }))
    }

    /// The lane's cell that shows a slot of a region: its own, or an import.
    fn visible(&mut self, lane: usize, region: u32, slot: u32) -> u32 {
        if region as usize == lane {
            return slot;
        }
        let layout = &mut self.lanes[lane];
        let at = layout.imports.partition_point(|(r, _)| *r < region);
        if layout.imports.get(at).is_none_or(|(r, _)| *r != region) {
            layout.imports.insert(at, (region, Vec::new()));
        }
        let list = &mut layout.imports[at].1;
        if let Some((_, known)) = list.iter().find(|(s, _)| *s == slot) {
            return *known;
        }
        layout.cells.push(0);
        let new = (layout.cells.len() - 1) as u32;
        list.push((slot, new));
        new
    }

    fn tag(&mut self, model: &Model, what: TagRef, source: Source) -> Result<(), TagError> {
        let id = self.tags.add(model.tag_name(what), model.tag_type(what), source)?;
        self.ids.insert(what, id);
        Ok(())
    }

    /// Input points: value and quality in the driver's region, or in that of the interrupt lane that serves them. Output
    /// points are linked to their sources later.
    fn place_points(&mut self, model: &Model) -> Result<(), TagError> {
        for (driver, d) in model.drivers.iter().enumerate() {
            let mut inputs = 0;
            for (point, config) in d.config.points.iter().enumerate() {
                let server = model.server(driver, point);
                let source = if let (None, Some(lane)) = (config.safe, server) {
                    let slot = self.push(lane, 0);
                    let quality = self.push(lane, Quality::Bad.cell());
                    let at = model.lanes[lane].served.iter().position(|s| (s.driver, s.point) == (driver, point));
                    if let Some(at) = at {
                        self.lanes[lane].served[at] = Some(slot);
                    }
                    Source::Cell(Location { region: lane as u32, slot, bit: None, quality: Some(quality) })
                } else if config.safe.is_none() {
                    let slot = 2 * inputs;
                    inputs += 1;
                    Source::Cell(Location {
                        region: self.driver_region(driver),
                        slot,
                        bit: None,
                        quality: Some(slot + 1),
                    })
                } else {
                    Source::Constant(0)
                };
                self.tag(model, TagRef::Point { driver, point }, source)?;
            }
        }
        Ok(())
    }

    fn place_lanes(&mut self, model: &Model) -> Result<(), TagError> {
        for lane in 0..model.lanes.len() {
            for statistic in Statistic::ALL {
                let location =
                    Location { region: lane as u32, slot: STATISTICS + statistic as u32, bit: None, quality: None };
                self.tag(model, TagRef::Lane { lane, statistic }, Source::Cell(location))?;
            }
        }
        Ok(())
    }

    fn place_block(&mut self, model: &Model, block: usize, settings: &[u64]) -> Result<(), TagError> {
        let b = &model.blocks[block];
        let region = b.lane as u32;
        for port in 0..b.inputs.len() {
            // Linked once every tag is there.
            self.tag(model, TagRef::Input { block, port }, Source::Constant(0))?;
        }
        let quality = self.push(b.lane, Quality::Bad.cell());
        let commands = (!b.class.commands.is_empty()).then(|| self.push(b.lane, 0));
        let first = self.lanes[b.lane].cells.len() as u32;
        let (mut reals, mut qualities, mut safe, mut status) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (port, p) in b.class.outputs.iter().enumerate() {
            let slot = self.push(b.lane, 0);
            safe.push((slot, b.safe[port]));
            if matches!(p.ty, Type::Flags(_)) && p.path.rsplit('.').next() == Some("status") {
                status.push((port, slot));
            }
            let q = if p.signal {
                let q = self.push(b.lane, Quality::Bad.cell());
                qualities.push(q);
                q
            } else {
                reals.extend(exponent(p).map(|mask| (slot, mask)));
                quality
            };
            let location = Location { region, slot, bit: None, quality: Some(q) };
            self.tag(model, TagRef::Output { block, port }, Source::Cell(location))?;
        }
        let alarms = (!b.class.alarms.is_empty()).then(|| self.push(b.lane, 0));
        for bit in 0..b.class.alarms.len() as u8 {
            let location = Location { region, slot: alarms.unwrap_or(0), bit: Some(bit), quality: Some(quality) };
            self.tag(model, TagRef::Alarm { block, bit }, Source::Cell(location))?;
        }
        for bit in 0..b.class.commands.len() as u8 {
            let location = Location { region, slot: commands.unwrap_or(0), bit: Some(bit), quality: None };
            self.tag(model, TagRef::Command { block, bit }, Source::Cell(location))?;
        }
        let start = self.operators.len();
        for (port, cell) in settings.iter().enumerate() {
            let location = Location {
                region: self.operators_region(),
                slot: self.operators.len() as u32,
                bit: None,
                quality: None,
            };
            self.operators.push(*cell);
            self.tag(model, TagRef::Setting { block, port }, Source::Cell(location))?;
        }
        self.settings.push((start..self.operators.len()).collect());
        let out = first..self.lanes[b.lane].cells.len() as u32;
        self.lanes[b.lane].blocks.push(BlockLayout {
            block,
            quality,
            commands,
            outs: out.clone().collect(),
            out,
            scattered: false,
            alarms,
            ins: Vec::new(),
            converts: Vec::new(),
            reals,
            qualities,
            safe,
            status,
        });
        Ok(())
    }

    /// Points the tags that read others at what they read.
    fn link(&mut self, model: &Model) {
        for (driver, d) in model.drivers.iter().enumerate() {
            for (point, wire) in d.sources.iter().enumerate() {
                // What feeds an input that starts a lane arrives as edges.
                let edges = d.config.points[point].safe.is_none() && model.server(driver, point).is_some();
                if let Some(wire) = wire
                    && !edges
                {
                    let source = self.alias(wire);
                    self.tags.set_source(self.ids[&TagRef::Point { driver, point }], source);
                }
            }
        }
        for (block, b) in model.blocks.iter().enumerate() {
            for (port, input) in b.inputs.iter().enumerate() {
                let source = match input {
                    Input::Unwired => Source::Constant(0),
                    Input::Constant(cell) => Source::Constant(*cell),
                    Input::Wire(wire) => self.alias(wire),
                };
                self.tags.set_source(self.ids[&TagRef::Input { block, port }], source);
            }
        }
    }

    fn alias(&self, wire: &Wire) -> Source {
        Source::Alias { tag: self.ids[&wire.tag], not: wire.not }
    }

    fn push(&mut self, lane: usize, cell: u64) -> u32 {
        let cells = &mut self.lanes[lane].cells;
        cells.push(cell);
        (cells.len() - 1) as u32
    }

    fn wire_lane(&mut self, model: &Model, lane: usize) -> Result<(), TagError> {
        let mut wiring = Wiring {
            lane: lane as u32,
            layout: &mut self.lanes[lane],
            imports: HashMap::new(),
            constants: HashMap::new(),
        };
        for index in 0..wiring.layout.blocks.len() {
            let block = wiring.layout.blocks[index].block;
            let b = &model.blocks[block];
            let (mut ins, mut converts) = (Vec::new(), Vec::new());
            for (port, input) in b.inputs.iter().enumerate() {
                let signal = b.class.inputs[port].signal;
                let source = self.tags.resolve(self.ids[&TagRef::Input { block, port }])?;
                let quality = match (input, source) {
                    (Input::Unwired, _) => wiring.constant(Quality::Bad.cell()),
                    (_, Resolved::Constant(_)) => wiring.constant(Quality::Good.cell()),
                    (_, Resolved::Cell { location, .. }) => match location.quality {
                        Some(slot) if signal => wiring.cell(location.region, slot),
                        _ => wiring.constant(Quality::Good.cell()),
                    },
                };
                ins.push(wiring.value(source, &mut converts));
                if signal {
                    ins.push(quality);
                }
            }
            ins.extend(wiring.layout.blocks[index].commands);
            wiring.layout.blocks[index].ins = ins;
            wiring.layout.blocks[index].converts = converts;
        }
        let mut imports: Vec<_> = wiring.imports.into_iter().collect();
        imports.sort_unstable();
        for ((region, slot), cell) in imports {
            match self.lanes[lane].imports.last_mut() {
                Some((r, list)) if *r == region => list.push((slot, cell)),
                _ => self.lanes[lane].imports.push((region, vec![(slot, cell)])),
            }
        }
        Ok(())
    }
}

/// The private cells of one lane while its wires are laid.
struct Wiring<'a> {
    lane: u32,
    layout: &'a mut LaneLayout,
    imports: HashMap<(u32, u32), u32>,
    constants: HashMap<u64, u32>,
}

impl Wiring<'_> {
    fn push(&mut self, cell: u64) -> u32 {
        self.layout.cells.push(cell);
        (self.layout.cells.len() - 1) as u32
    }

    fn constant(&mut self, cell: u64) -> u32 {
        if let Some(known) = self.constants.get(&cell) {
            return *known;
        }
        let new = self.push(cell);
        self.constants.insert(cell, new);
        new
    }

    /// The lane's cell that shows a slot of a region: its own, or an import.
    fn cell(&mut self, region: u32, slot: u32) -> u32 {
        if region == self.lane {
            return slot;
        }
        if let Some(known) = self.imports.get(&(region, slot)) {
            return *known;
        }
        let new = self.push(0);
        self.imports.insert((region, slot), new);
        new
    }

    fn value(&mut self, source: Resolved, converts: &mut Vec<Convert>) -> u32 {
        match source {
            Resolved::Constant(cell) => self.constant(cell),
            Resolved::Cell { location: Location { region, slot, bit, .. }, not } => {
                let from = self.cell(region, slot);
                if bit.is_none() && !not {
                    return from;
                }
                let to = self.push(0);
                converts.push(Convert { from, to, shift: bit.unwrap_or(0), flip: not });
                to
            }
        }
    }
}

/// Exponent mask of a real port.
pub(crate) fn exponent(port: &Port) -> Option<u64> {
    match port.ty {
        Type::F64 => Some(0x7ff0_0000_0000_0000),
        Type::F32 => Some(0x7f80_0000),
        _ => None,
    }
}

/// A lane's name as the source of its records: `lane.main`.
pub fn lane_source(lane: &Lane) -> String {
    format!("lane.{}", lane.name)
}
