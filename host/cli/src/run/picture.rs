//! What a display shows of a plant: lanes, points, outputs, alarms; read from the image like any other reader.

use latchwork_image::{Quality, TagId, Type, View};
use latchwork_plant::assemble::Plant;
use latchwork_plant::lane::LaneState;
use latchwork_plant::layout::STATE;
use latchwork_plant::model::{Statistic, TagRef};

/// One value with its name.
pub(crate) struct Cell {
    /// Tag.
    pub(crate) tag: String,
    /// Text of the value.
    pub(crate) value: String,
    /// Quality.
    pub(crate) quality: Quality,
}

/// One lane's figures.
pub(crate) struct LaneRow {
    /// Name.
    pub(crate) name: String,
    /// State.
    pub(crate) state: LaneState,
    /// Values in the order of [`Statistic::ALL`].
    pub(crate) figures: Vec<u64>,
}

struct Tag {
    name: String,
    ty: Type,
}

/// A reader of everything a display shows.
pub(crate) struct Picture {
    /// Name of the plant.
    pub(crate) plant: String,
    lanes: Vec<String>,
    values: Vec<Tag>,
    alarms: Vec<String>,
    view: View,
    states: Vec<latchwork_image::RegionReader>,
}

impl Picture {
    /// Points of drivers and outputs of blocks as values, alarms, figures of lanes.
    pub(crate) fn new(plant: &Plant) -> Self {
        let id = |what: TagRef| plant.layout.ids[&what];
        let mut ids: Vec<TagId> = Vec::new();
        for lane in 0..plant.model.lanes.len() {
            ids.extend(Statistic::ALL.map(|statistic| id(TagRef::Lane { lane, statistic })));
        }
        let mut values = Vec::new();
        let mut value = |what: TagRef| {
            ids.push(id(what));
            let tag = plant.layout.tags.get(id(what));
            values.push(Tag { name: tag.name.clone(), ty: tag.ty.clone() });
        };
        for (driver, d) in plant.model.drivers.iter().enumerate() {
            (0..d.config.points.len()).for_each(|point| value(TagRef::Point { driver, point }));
        }
        for (block, b) in plant.model.blocks.iter().enumerate() {
            (0..b.class.outputs.len()).for_each(|port| value(TagRef::Output { block, port }));
        }
        let mut alarms = Vec::new();
        for (block, b) in plant.model.blocks.iter().enumerate() {
            for (bit, alarm) in b.class.alarms.iter().enumerate() {
                ids.push(id(TagRef::Alarm { block, bit: bit as u8 }));
                alarms.push(format!("{}.alarms.{alarm}", b.name));
            }
        }
        Self {
            plant: plant.model.name.clone(),
            lanes: plant.model.lanes.iter().map(|l| l.name.clone()).collect(),
            values,
            alarms,
            view: plant.view(&ids),
            states: plant.regions[..plant.model.lanes.len()].to_vec(),
        }
    }

    /// Takes a new snapshot.
    pub(crate) fn refresh(&mut self) {
        self.view.refresh();
    }

    /// Figures of each lane.
    pub(crate) fn lanes(&self) -> Vec<LaneRow> {
        let per_lane = Statistic::ALL.len();
        let row = |(index, name): (usize, &String)| LaneRow {
            name: name.clone(),
            state: LaneState::from_cell(self.states[index].cell(STATE)),
            figures: (0..per_lane).map(|n| self.view.cell(index * per_lane + n)).collect(),
        };
        self.lanes.iter().enumerate().map(row).collect()
    }

    /// Points and outputs.
    pub(crate) fn values(&self) -> impl Iterator<Item = Cell> + '_ {
        let first = self.lanes.len() * Statistic::ALL.len();
        self.values.iter().enumerate().map(move |(n, tag)| Cell {
            tag: tag.name.clone(),
            value: tag.ty.format(self.view.cell(first + n)),
            quality: self.view.quality(first + n),
        })
    }

    /// Names of the alarms that are on.
    pub(crate) fn alarms(&self) -> impl Iterator<Item = &str> {
        let first = self.lanes.len() * Statistic::ALL.len() + self.values.len();
        let on = move |(n, _): &(usize, &String)| self.view.cell(first + n) == 1;
        self.alarms.iter().enumerate().filter(on).map(|(_, name)| name.as_str())
    }
}
