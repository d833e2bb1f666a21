//! What an earlier run has retained, by name and type.

use super::{Member, SOURCE};
use crate::assemble::Plant;
use latchwork_block::upgrade::{Fate, Field, Transfer, read_schema};
use latchwork_block::{Port, Ticker};
use latchwork_record::{Draft, Kind, rfc3339};
use latchwork_retain::{FILES, Found, Retained, Saved};
use std::fmt::Write;
use std::time::Duration;

/// Priority of a record that nothing was left.
const LOST: u8 = 200;
/// Priority of a record that one of two files was damaged.
const DAMAGED: u8 = 100;

impl Plant {
    /// Gives the members their states, and returns those that this run goes on keeping.
    pub(super) fn take_over(&mut self, found: &Found, members: &[Member]) -> Retained {
        let _ticker = Ticker::start(&self.engine, Duration::from_nanos(self.tick));
        self.tell_damage(found);
        let (mut states, mut restored) = (Retained::default(), 0);
        for member in members {
            let Some(saved) = found.retained.blocks.get(&member.name) else { continue };
            states.blocks.insert(member.name.clone(), saved.clone());
            match self.hand_over(member, saved) {
                Ok(fields) => {
                    restored += 1;
                    self.tell_changes(member, &fields);
                }
                Err(why) => {
                    let saved = rfc3339(saved.wall);
                    self.lament(&member.name, format!("{why}; the block begins anew, its state was saved at {saved}"));
                }
            }
        }
        for (name, saved) in found.retained.blocks.iter().filter(|(name, _)| !states.blocks.contains_key(*name)) {
            let mut draft = Draft::new(0, Kind::Event, name, "forgotten");
            draft.text =
                format!("no block of this name retains its state any more; it was saved at {}", rfc3339(saved.wall));
            self.tell(draft, Vec::new());
        }
        if let Some(last) = states.blocks.values().map(|s| s.wall).max().filter(|_| restored > 0) {
            let blocks = if restored == 1 { "1 block goes".into() } else { format!("{restored} blocks go") };
            let mut draft = Draft::new(0, Kind::Event, SOURCE, "restored");
            draft.text = format!("{blocks} on with retained state, saved last at {}", rfc3339(last));
            self.tell(draft, Vec::new());
        }
        states
    }

    /// The new instance of a block gets its state, or is made anew.
    fn hand_over(&mut self, member: &Member, saved: &Saved) -> Result<Vec<Field>, String> {
        let (lane, place) = (self.model.blocks[member.block].lane, member.place as usize);
        let block = &mut self.lanes[lane].blocks_mut()[place];
        let Some(instance) = block.instance.as_mut() else { return Err("the block is out of order".into()) };
        let class = &self.model.blocks[member.block].class;
        let unversioned = |name: &str| name.split('@').next().unwrap_or_default().to_owned();
        if unversioned(&saved.version.class) != unversioned(&class.name) {
            let (was, is) = (&saved.version.class, &class.name);
            return Err(format!("its state is of class `{was}`, and it is of class `{is}`"));
        }
        let old = read_schema(&saved.version.schema).filter(|old| {
            old.len() == saved.cells.len() && old.iter().zip(&saved.cells).all(|(port, cell)| port.ty.holds(*cell))
        });
        let Some(old) = old else { return Err("its state does not have the fields that it should have".into()) };
        // A swap that was not saved in the plant file may have left a state of wider types: the values decide.
        let transfer = Transfer::new(&old, &class.retained, true);
        let lost: Vec<_> = lost(&transfer, &old, &saved.cells, &class.retained);
        if !lost.is_empty() {
            return Err(format!("its state would lose something: {}", lost.join(", ")));
        }
        if !transfer
            .fields()
            .iter()
            .any(|f| matches!(f.fate, Fate::Carried | Fate::Converted { .. } | Fate::Lossy { .. }))
        {
            return Err("none of the fields of its state is there any more".into());
        }
        // New fields take what the block starts with.
        let mut cells = vec![0; class.retained.len()];
        let done = instance.save_into(&mut cells).and_then(|_| {
            transfer.apply(&saved.cells, &mut cells);
            instance.restore(&cells)
        });
        match done {
            Ok(()) => {
                block.first = false;
                Ok(transfer.fields().to_vec())
            }
            Err(fault) => {
                if let Ok(instance) = self.supervisor.recipes[member.block].make() {
                    block.instance = Some(instance);
                }
                Err(format!("it does not take its state: {fault}"))
            }
        }
    }

    /// A record when not every field is what it was.
    fn tell_changes(&mut self, member: &Member, fields: &[Field]) {
        let changes: Vec<_> = fields.iter().filter_map(told).collect();
        if !changes.is_empty() {
            let mut draft = Draft::new(0, Kind::Event, &member.name, "restored");
            draft.text = format!("its state is of another version: {}", changes.join(", "));
            self.tell(draft, Vec::new());
        }
    }

    fn tell_damage(&mut self, found: &Found) {
        if found.damage.is_empty() {
            return;
        }
        let mut text = String::new();
        for (slot, damage) in &found.damage {
            // Writing to a String never fails.
            let _ = write!(text, "{}: {damage}; ", FILES[*slot]);
        }
        let mut draft = if found.lost() {
            text += "all blocks begin anew";
            for path in &found.set_aside {
                let _ = write!(text, "; the damaged file stands in {} now", path.display());
            }
            for why in &found.not_aside {
                let _ = write!(text, "; it could not be put aside, and is written over: {why}");
            }
            let mut draft = Draft::new(0, Kind::Fault, SOURCE, "not-restored");
            draft.priority = LOST;
            draft
        } else {
            text += "the other file counts";
            let mut draft = Draft::new(0, Kind::Io, SOURCE, "damaged");
            draft.priority = DAMAGED;
            draft
        };
        draft.text = text;
        self.tell(draft, Vec::new());
    }
}

/// Fields whose values would be others on the way back.
fn lost(transfer: &Transfer, old: &[Port], cells: &[u64], new: &[Port]) -> Vec<String> {
    let (mut there, mut back) = (vec![0; new.len()], cells.to_vec());
    transfer.apply(cells, &mut there);
    Transfer::new(new, old, true).apply(&there, &mut back);
    let differs = |f: &&Field| old.iter().position(|p| p.path == f.name).is_some_and(|at| cells[at] != back[at]);
    let lossy = transfer.fields().iter().filter(|f| matches!(f.fate, Fate::Lossy { .. }));
    lossy.filter(differs).filter_map(told).collect()
}

/// What becomes of a field, unless it simply stays.
fn told(field: &Field) -> Option<String> {
    let Field { name, ty, fate } = field;
    match fate {
        Fate::Carried => None,
        Fate::Converted { from, to } => Some(format!("{name} was {from} and is {to}")),
        Fate::Lossy { from, to, .. } => Some(format!("{name} was {from} and is {to}, which holds less")),
        Fate::New => Some(format!("{name} ({ty}) is new")),
        Fate::Dropped => Some(format!("{name} ({ty}) is gone")),
    }
}
