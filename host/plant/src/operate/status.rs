//! How the plant is, at a glance.

use crate::assemble::Plant;
use crate::lane::LaneState;
use crate::layout::STATE;
use crate::model::{Statistic, TagRef};
use latchwork_image::{Quality, TagId};
use serde_json::{Map, Value, json};

impl Plant {
    pub(super) fn status(&self, now: u64) -> Value {
        let lanes: Vec<_> = self
            .model
            .lanes
            .iter()
            .enumerate()
            .map(|(index, lane)| {
                let ids: Vec<TagId> = Statistic::ALL
                    .iter()
                    .map(|s| self.layout.ids[&TagRef::Lane { lane: index, statistic: *s }])
                    .collect();
                let view = self.view(&ids);
                let mut row = Map::new();
                row.insert("name".into(), json!(lane.name));
                row.insert("kind".into(), json!(if lane.interrupt.is_some() { "interrupt" } else { "cyclic" }));
                row.insert("state".into(), json!(LaneState::from_cell(self.regions[index].cell(STATE)).name()));
                row.insert("every-ns".into(), json!(lane.every));
                for (at, statistic) in Statistic::ALL.iter().enumerate() {
                    let unit = if statistic.ty() == latchwork_image::Type::Duration { "-ns" } else { "" };
                    row.insert(format!("{}{unit}", statistic.name()), json!(view.cell(at)));
                }
                Value::Object(row)
            })
            .collect();
        let blocks: Vec<_> = self
            .model
            .blocks
            .iter()
            .enumerate()
            .map(|(index, block)| {
                let place = self.desk.places[index] as usize;
                let of_lane = &self.layout.lanes[block.lane].blocks[place];
                let quality = Quality::from_cell(self.regions[block.lane].cell(of_lane.quality));
                let mut row = json!({
                    "name": block.name,
                    "class": self.supervisor.recipes[index].template.class().name,
                    "lane": self.model.lanes[block.lane].name,
                    "path": format!("{:?}", self.supervisor.recipes[index].template.path()).to_lowercase(),
                    "quality": quality.name(),
                });
                if let Value::Object(row) = &mut row {
                    self.version_row(index, row);
                }
                row
            })
            .collect();
        let (listed, unacknowledged) = self.annunciator.counts();
        let mut status = json!({
            "plant": self.model.name,
            "sim": self.model.sim,
            "time-ns": now,
            "epoch-ns": self.router.epoch(),
            "lanes": lanes,
            "blocks": blocks,
            "alarms": { "listed": listed, "unacknowledged": unacknowledged },
            "forces": self.forced().len(),
            "staged": self.desk.staged.values().map(std::collections::BTreeMap::len).sum::<usize>(),
            "records": self.router.last_seq(),
        });
        if let Some(retained) = self.keeper.status() {
            status["retain"] = retained;
        }
        for (name, tell) in &self.desk.also {
            status[*name] = tell();
        }
        if let Some(sinks) = status.get_mut("sinks") {
            self.logger_rows(sinks);
        }
        status
    }
}
