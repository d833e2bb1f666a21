//! Commands to blocks: one-shot, toggle, retained.

use super::{Operator, Refused};
use crate::assemble::Plant;
use crate::lane::{LaneState, Mode, Request};
use crate::layout::STATE;
use crate::model::TagRef;
use latchwork_alarm::CodeKind;
use latchwork_image::Value;
use latchwork_record::{Kept, Kind};

/// Beginning of the names that retained commands are kept under.
pub(super) const PREFIX: &str = "command/";

impl Plant {
    /// The kind of a command: what its rule says, or one-shot.
    pub(super) fn command_kind(&self, tag: TagRef) -> CodeKind {
        let variable = self.model.variables.iter().find(|v| v.tag == tag);
        let rule = variable.and_then(|v| v.rule).map(|r| &self.model.alarm_rules[r]);
        rule.map_or(CodeKind::CommandOneShot, |r| r.code)
    }

    pub(super) fn command(
        &mut self,
        name: &str,
        on: Option<bool>,
        operator: &Operator,
        now: u64,
    ) -> Result<Vec<String>, Refused> {
        let (_, what) = self.tag(name)?;
        let TagRef::Command { block, bit } = what else {
            let message = format!("`{name}` is no command; those are BLOCK.commands.NAME");
            return Err(Refused::new("unknown", message));
        };
        self.lane_runs(self.model.blocks[block].lane)?;
        let kind = self.command_kind(what);
        let stood = self.desk.standing.get(&(block, bit)).copied().unwrap_or(false);
        let (mode, transition, now_on) = match (kind, on) {
            (CodeKind::CommandOneShot, None | Some(true)) => (Mode::OneShot, "given", true),
            (CodeKind::CommandOneShot, Some(false)) => {
                let message = format!("`{name}` is a one-shot command: it goes back by itself");
                return Err(Refused::new("value", message));
            }
            (_, on) => {
                let on = on.unwrap_or(!stood);
                (Mode::Level(on), if on { "on" } else { "off" }, on)
            }
        };
        self.send_command(block, bit, mode).map_err(|why| Refused::new("busy", why))?;
        let mut kept = Vec::new();
        if kind != CodeKind::CommandOneShot {
            self.desk.standing.insert((block, bit), now_on);
        }
        if kind == CodeKind::CommandRetained {
            let value = now_on.then(|| "true".to_owned());
            kept.push(Kept { name: format!("{PREFIX}{name}"), value });
        }
        let mut draft = Self::did(now, Kind::Command, name, transition, operator);
        (draft.previous, draft.current) = (Value::Boolean(stood), Value::Boolean(now_on));
        self.tell(draft, kept);
        Ok(vec![match mode {
            Mode::OneShot => format!("{name}: given for one execution"),
            Mode::Level(_) => format!("{name} is {transition}"),
        }])
    }

    /// Refuses what a lane that has stopped or faulted would never do.
    pub(crate) fn lane_runs(&self, lane: usize) -> Result<(), Refused> {
        let state = LaneState::from_cell(self.regions[lane].cell(STATE));
        if matches!(state, LaneState::Stopped | LaneState::Faulted) {
            let name = &self.model.lanes[lane].name;
            let message =
                format!("lane `{name}` has {}; it does nothing until the plant is started again", state.name());
            return Err(Refused::new("state", message));
        }
        Ok(())
    }

    /// Sends a command to the lane of its block.
    pub(super) fn send_command(&mut self, block: usize, bit: u8, mode: Mode) -> Result<(), String> {
        let (lane, place) = (self.model.blocks[block].lane, self.desk.places[block]);
        let sent = self.supervisor.send(lane, Request::Command { block: place, bit, mode });
        sent.map_err(|_| "the lane has not taken earlier commands; does it run?".to_owned())
    }

    /// A command of a stimulus: on is one shot, off takes it back; toggles and retained ones stand.
    pub(super) fn stimulate_command(&mut self, block: usize, bit: u8, set: bool) {
        let one_shot = self.command_kind(TagRef::Command { block, bit }) == CodeKind::CommandOneShot;
        let mode = if set && one_shot { Mode::OneShot } else { Mode::Level(set) };
        // A stimulus sends few commands; a lane that is too busy to take them has faulted.
        let _ = self.send_command(block, bit, mode);
    }
}
