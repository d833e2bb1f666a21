//! What an earlier run has left: states of alarms, retained commands, settings that operators wrote.

use super::{commands, settings};
use crate::assemble::Plant;
use crate::lane::Mode;
use crate::model::TagRef;
use latchwork_alarm::CodeKind;
use latchwork_block::Ticker;
use latchwork_record::{Draft, Kept, Kind};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Duration;

#[derive(Deserialize)]
struct Setting {
    value: String,
    file: String,
}

impl Plant {
    /// Takes over what was kept, before the run; call it once the epoch is set. What cannot be taken over is told by a record
    /// and begins anew.
    pub fn restore(&mut self, kept: &BTreeMap<String, String>) {
        let mut written: BTreeMap<usize, Vec<(usize, u64)>> = BTreeMap::new();
        for (name, value) in kept {
            if let Some(tag) = name.strip_prefix(commands::PREFIX) {
                self.restore_command(tag);
            } else if let Some(tag) = name.strip_prefix(settings::PREFIX) {
                if let Some((block, port, cell)) = self.kept_setting(tag, value) {
                    written.entry(block).or_default().push((port, cell));
                }
            } else {
                self.restore_alarm(name, value);
            }
        }
        for (block, ports) in written {
            self.restore_settings(block, &ports);
        }
    }

    fn restore_alarm(&mut self, name: &str, value: &str) {
        let restored = match self.annunciator.restore(name, value) {
            Ok(Some(restored)) => restored,
            Ok(None) => return,
            Err(error) => return self.lament(name, error.to_string()),
        };
        if restored.condition {
            let variable =
                self.model.variables.iter().find(|v| self.annunciator.find(v) == Some(restored.alarm)).map(|v| v.tag);
            if let Some(TagRef::Alarm { block, bit }) = variable {
                let (lane, place) = (self.model.blocks[block].lane, self.desk.places[block] as usize);
                self.lanes[lane].expect_alarms(place, 1 << bit);
            }
        }
        for (source, on) in self.annunciator.expected(restored) {
            self.lanes.iter_mut().for_each(|lane| lane.expect_condition(source, on));
        }
    }

    fn restore_command(&mut self, name: &str) {
        // A command that the plant no longer has is nobody's.
        let Ok((_, what @ TagRef::Command { block, bit })) = self.tag(name) else { return };
        let mut draft = Draft::new(0, Kind::Command, name, "restored");
        if self.command_kind(what) != CodeKind::CommandRetained {
            draft.transition = "forgotten".into();
            draft.text = "it was retained, and its rule says no longer that it is".into();
            let name = format!("{}{name}", commands::PREFIX);
            return self.tell(draft, vec![Kept { name, value: None }]);
        }
        draft.current = latchwork_image::Value::Boolean(true);
        self.tell(draft, Vec::new());
        self.desk.standing.insert((block, bit), true);
        if let Err(why) = self.send_command(block, bit, Mode::Level(true)) {
            self.lament(name, why);
        }
    }

    /// A setting that an operator wrote, if the plant file still says what it said then: a new value there counts.
    fn kept_setting(&mut self, name: &str, value: &str) -> Option<(usize, usize, u64)> {
        let Ok((id, TagRef::Setting { block, port })) = self.tag(name) else { return None };
        let ty = self.layout.tags.get(id).ty.clone();
        let kept: Setting = match serde_json::from_str(value) {
            Ok(kept) => kept,
            Err(error) => {
                self.lament(name, format!("the kept value cannot be read: {error}"));
                return None;
            }
        };
        let of_file = self.desk.of_file[self.layout.settings[block][port]];
        if ty.format(of_file) != kept.file {
            let mut draft = Draft::new(0, Kind::Setting, name, "replaced");
            (draft.previous, draft.current) = (latchwork_image::Value::Text(kept.value), ty.value(of_file));
            draft.text = "the plant file has a new value, which counts".into();
            let name = format!("{}{name}", settings::PREFIX);
            self.tell(draft, vec![Kept { name, value: None }]);
            return None;
        }
        match ty.parse(&kept.value) {
            Ok(cell) => Some((block, port, cell)),
            Err(error) => {
                self.lament(name, error.to_string());
                None
            }
        }
    }

    fn restore_settings(&mut self, block: usize, ports: &[(usize, u64)]) {
        let _ticker = Ticker::start(&self.engine, Duration::from_nanos(self.tick));
        let mut cells: Vec<_> = self.layout.settings[block].iter().map(|at| self.desk.cells[*at]).collect();
        ports.iter().for_each(|(port, cell)| cells[*port] = *cell);
        let (lane, place) = (self.model.blocks[block].lane, self.desk.places[block] as usize);
        let name = self.model.blocks[block].name.clone();
        let instance = self.lanes[lane].blocks_mut()[place].instance.as_mut();
        let refused = match instance.map(|i| i.configure(&cells)) {
            Some(Ok(Ok(()))) => {
                for (port, cell) in ports {
                    let tag = TagRef::Setting { block, port: *port };
                    let mut draft = Draft::new(0, Kind::Setting, self.model.tag_name(tag), "restored");
                    draft.current = self.model.tag_type(tag).value(*cell);
                    self.tell(draft, Vec::new());
                }
                return self.take_settings(block, &cells, 0);
            }
            Some(Ok(Err(sentence))) => sentence,
            Some(Err(fault)) => fault.to_string(),
            None => "the block is out of order".into(),
        };
        // It has the plant file's settings, unless it failed: then it is made anew with those.
        let recipe = &self.supervisor.recipes[block];
        if let Ok(instance) = recipe.make() {
            self.lanes[lane].blocks_mut()[place].instance = Some(instance);
        }
        self.lament(
            &name,
            format!("it refuses the settings of the last run: {refused}; those of the plant file count"),
        );
    }

    fn lament(&mut self, source: &str, why: String) {
        let mut draft = Draft::new(0, Kind::Fault, source, "not-restored");
        (draft.priority, draft.text) = (128, why);
        self.tell(draft, Vec::new());
    }
}
