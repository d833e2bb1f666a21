//! One version of a block that is given what was recorded, and how it compares with what was recorded.

use super::report::{FailedRun, Replayed, clock, named};
use super::{Comparer, Head, Tolerances};
use latchwork_block::upgrade::{Fate, Mapping, Transfer};
use latchwork_block::{Class, Component, Fault, FaultKind, Instance, Limits, LoadError, Scan, Template};
use sha2::{Digest, Sha256};
use std::sync::Arc;

/// Ticks of the engine that an execution may take: only what would never end is stopped, not what was slow.
const BUDGET: u64 = 100;

/// What was recorded, and what is executed.
#[derive(Clone)]
pub(super) struct Version {
    recorded: Arc<Class>,
    template: Template,
    limits: Limits,
    /// It is another component than the recorded one.
    other: bool,
}

impl Version {
    pub(super) fn same(component: &Component, class: Arc<Class>, head: &Head) -> Result<Self, LoadError> {
        let template = component.template(&class)?;
        Ok(Self { recorded: class, template, limits: limits(head), other: false })
    }

    /// Class that is executed.
    pub(super) fn class(&self) -> Arc<Class> {
        Arc::clone(self.template.class())
    }

    pub(super) fn instantiate(&self) -> Result<Instance, Fault> {
        self.template.instantiate(&self.limits)
    }

    /// The recorded cells are those of the recorded class.
    pub(super) fn fits(&self, head: &Head) -> bool {
        let class = &self.recorded;
        let state = match &head.start {
            super::Start::State(cells) => cells.is_empty() || cells.len() == class.retained.len(),
            _ => true,
        };
        head.cells == [class.argument_cells(), class.output_cells()]
            && head.settings.len() == class.settings.len()
            && state
    }

    pub(super) fn other(
        recorded: Arc<Class>,
        component: &Component,
        class: &Class,
        head: &Head,
    ) -> Result<Self, LoadError> {
        let template = component.template(class)?;
        Ok(Self { recorded, template, limits: limits(head), other: true })
    }
}

fn limits(head: &Head) -> Limits {
    Limits { memory: head.memory, budget_ticks: BUDGET, ..Limits::default() }
}

pub(super) struct Player {
    version: Version,
    instance: Option<Instance>,
    mapping: Mapping,
    state: Transfer,
    settings: Transfer,
    /// Recorded settings as they are now.
    recorded_settings: Vec<u64>,
    /// Argument cells of what is executed, then its output cells.
    cells: Vec<u64>,
    ins: Vec<u32>,
    comparer: Comparer,
    hashes: [Sha256; 2],
    told: Replayed,
}

impl Player {
    pub(super) fn new(version: Version, within: &Tolerances, block: &str, lossy: bool) -> Self {
        let (recorded, class) = (Arc::clone(&version.recorded), Arc::clone(version.template.class()));
        let arguments = class.argument_cells();
        let comparer = Comparer::new(&recorded, &class, |output| within.of(block, output));
        let state = Transfer::new(&recorded.retained, &class.retained, lossy);
        let settings = Transfer::new(&recorded.settings, &class.settings, lossy);
        let mut told = Replayed::default();
        for (what, fields) in [("retained field", &state), ("setting", &settings)] {
            for field in fields.refused() {
                let Fate::Lossy { from, to, .. } = &field.fate else { continue };
                told.note(format!(
                    "{what} `{}` would lose something from {from} to {to}: it keeps what the other component starts with; \
                     --allow-lossy clamps it",
                    field.name
                ));
            }
        }
        Self {
            instance: None,
            mapping: Mapping::new(&recorded, &class),
            state,
            settings,
            recorded_settings: Vec::new(),
            cells: vec![0; arguments + class.output_cells()],
            ins: (0..arguments as u32).collect(),
            comparer: if version.other { comparer } else { comparer.exact() },
            hashes: Default::default(),
            told,
            version,
        }
    }

    /// The recorded cells are those of the class.
    pub(super) fn fits(&self, head: &Head) -> bool {
        self.version.fits(head)
    }

    pub(super) fn lives(&self) -> bool {
        self.instance.is_some()
    }

    /// What comes until the next state or cold start cannot be replayed.
    pub(super) fn lose(&mut self) {
        self.instance = None;
    }

    /// The same of a segment that begins with these settings: a restart in it has them.
    pub(super) fn lose_with(&mut self, settings: &[u64]) {
        self.recorded_settings = settings.to_vec();
        self.lose();
    }

    /// A fresh instance with the settings that were last recorded.
    pub(super) fn restart(&mut self) {
        self.instance = None;
        let made = self.version.instantiate().and_then(|mut instance| {
            let settings = self.settings_of(&mut instance)?;
            match instance.configure(&settings)? {
                Ok(()) => Ok(Ok(instance)),
                Err(why) => Ok(Err(why)),
            }
        });
        match made {
            Ok(Ok(instance)) => self.instance = Some(instance),
            Ok(Err(why)) => self.told.note(format!("it refuses the recorded settings: {why}")),
            Err(fault) => self.fails(&fault, 0, Vec::new()),
        }
    }

    /// The recorded settings as what is executed has them; new ones are its defaults.
    fn settings_of(&self, instance: &mut Instance) -> Result<Vec<u64>, Fault> {
        if !self.version.other {
            return Ok(self.recorded_settings.clone());
        }
        let own = instance.defaults()?;
        let mut settings = own.unwrap_or_else(|| vec![0; instance.class().settings.len()]);
        self.settings.apply(&self.recorded_settings, &mut settings);
        Ok(settings)
    }

    pub(super) fn cold(&mut self, settings: &[u64]) {
        self.recorded_settings = settings.to_vec();
        self.restart();
    }

    pub(super) fn state(&mut self, settings: &[u64], state: &[u64]) {
        self.cold(settings);
        let Some(instance) = &mut self.instance else { return };
        if state.is_empty() || instance.class().retained.is_empty() {
            return;
        }
        let restored = instance.save().and_then(|own| {
            let mut own = own.unwrap_or_default();
            self.state.apply(state, &mut own);
            instance.restore(&own)
        });
        if let Err(fault) = restored {
            self.fails(&fault, 0, Vec::new());
        }
    }

    /// The state that was recorded on the way is the one that was reached.
    pub(super) fn check_state(&mut self, recorded: &[u64], at: u64) {
        let Some(instance) = self.instance.as_mut().filter(|_| !self.version.other) else { return };
        match instance.save() {
            Ok(Some(own)) if own != recorded => {
                self.told.different += 1;
                self.told.note(format!("before {} its state is another one than the recorded one", clock(at)));
            }
            Ok(_) => {}
            Err(fault) => self.fails(&fault, at, Vec::new()),
        }
    }

    pub(super) fn configure(&mut self, cells: &[u64], taken: Result<bool, FaultKind>) {
        let before = std::mem::replace(&mut self.recorded_settings, cells.to_vec());
        let Some(mut instance) = self.instance.take() else {
            if taken != Ok(true) {
                self.recorded_settings = before;
            }
            return;
        };
        let answer = self.settings_of(&mut instance).and_then(|settings| instance.configure(&settings));
        if taken != Ok(true) {
            self.recorded_settings = before;
        }
        match (answer, taken) {
            (_, Err(FaultKind::Budget)) => self.told.note(
                "once it took too long over settings when it was recorded: that depends on the machine and is left out"
                    .into(),
            ),
            (Ok(answer), Ok(taken)) => {
                if answer.is_ok() != taken {
                    self.told.different += 1;
                    let why = answer.err().map(|why| format!(": {why}")).unwrap_or_default();
                    let said =
                        if taken { "refuses settings that were taken" } else { "takes settings that were refused" };
                    self.told.note(format!("it {said}{why}"));
                }
                self.instance = Some(instance);
            }
            (Err(_), Err(_)) => {}
            (Ok(_), Err(_)) => {
                self.told.different += u64::from(!self.version.other);
                self.told.note("a recorded fault over settings did not happen again".into());
            }
            (Err(fault), Ok(_)) => self.fails(&fault, 0, Vec::new()),
        }
    }

    /// One execution; it is compared if it `counts`.
    pub(super) fn execute(&mut self, scan: Scan, arguments: &[u64], recorded: Result<&[u64], FaultKind>, counts: bool) {
        let own = self.ins.len();
        let Some(instance) = &mut self.instance else {
            self.told.skipped += u64::from(counts);
            return;
        };
        if recorded == Err(FaultKind::Budget) && !self.version.other {
            if counts {
                self.told.note(too_long(scan.now));
            }
            self.instance = None;
            return;
        }
        if self.version.other {
            self.mapping.arguments(arguments, &mut self.cells[..own]);
        } else {
            self.cells[..own].copy_from_slice(arguments);
        }
        let result = instance.execute(scan, &self.ins, own as u32, &mut self.cells);
        if instance.has_log() {
            instance.drain_log(|_, _| ());
        }
        if counts {
            if self.told.executions == 0 {
                self.told.from = scan.now;
            }
            self.told.to = scan.now;
            self.told.executions += 1;
        }
        let outputs = &self.cells[own..];
        let replayed = result.as_ref().map(|()| outputs).map_err(|fault| fault.kind);
        for (hash, outputs) in self.hashes.iter_mut().zip([recorded, replayed]) {
            if counts {
                add(hash, scan.now, outputs);
            }
        }
        match (result, recorded) {
            (Ok(()), Ok(recorded)) => {
                if counts && !self.comparer.compare(scan.now, arguments, recorded, outputs) {
                    self.told.different += 1;
                }
            }
            (Err(fault), Err(kind)) if fault.kind == kind || self.version.other => self.instance = None,
            (result, Err(kind)) => {
                self.instance = None;
                if !self.version.other {
                    self.told.different += u64::from(counts);
                } else if kind == FaultKind::Budget {
                    return self.told.note(too_long(scan.now));
                }
                let again = match result {
                    Ok(()) => "did not happen again".into(),
                    Err(fault) => format!("was another one now: {fault}"),
                };
                self.told.note(format!("the recorded fault ({}) at {} {again}", kind.name(), clock(scan.now)));
            }
            (Err(fault), Ok(_)) => {
                self.told.different += u64::from(counts);
                let inputs = named(&self.version.recorded, arguments);
                self.fails(&fault, scan.now, inputs);
            }
        }
    }

    fn fails(&mut self, fault: &Fault, at: u64, inputs: Vec<(String, String)>) {
        self.instance = None;
        let (kind, message) = (fault.kind.name().into(), fault.message.clone());
        self.told.fault.get_or_insert(FailedRun { kind, message, at, inputs });
    }

    /// Adds what was found.
    pub(super) fn tell(self, to: &mut Replayed) {
        let found = self.told;
        if found.executions > 0 {
            to.from = if to.executions == 0 { found.from } else { to.from.min(found.from) };
            to.to = to.to.max(found.to);
        }
        to.executions += found.executions;
        to.different += found.different;
        to.skipped += found.skipped;
        to.deviations.extend(self.comparer.deviations());
        to.fault = to.fault.take().or(found.fault);
        found.notes.into_iter().for_each(|note| to.note(note));
        let [recorded, replayed] = self.hashes.map(|h| h.finalize());
        // Of a block that was swapped meanwhile: one over those of its versions.
        for (hash, part) in [(&mut to.recorded, recorded), (&mut to.replayed, replayed)] {
            let part: String = part.iter().map(|b| format!("{b:02x}")).collect();
            *hash = if hash.is_empty() { part } else { super::hash_of(format!("{hash}{part}").as_bytes()) };
        }
    }
}

/// What is told of a recorded budget that was exceeded.
fn too_long(at: u64) -> String {
    let at = clock(at);
    format!(
        "at {at} it exceeded its budget when it was recorded: that depends on the machine, and the execution is left out"
    )
}

fn add(hash: &mut Sha256, now: u64, outputs: Result<&[u64], FaultKind>) {
    hash.update(now.to_le_bytes());
    // What faulted has no outputs; how it did is told apart.
    hash.update([outputs.err().map_or(1, |kind| 0x80 | kind.code())]);
    outputs.unwrap_or(&[]).iter().for_each(|cell| hash.update(cell.to_le_bytes()));
}
