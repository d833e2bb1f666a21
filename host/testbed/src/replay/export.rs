//! Recorded time as a component test: the file that `latchwork test` runs.
//!
//! Where the executions lie on the grid of their lane, only those become steps at which something changed; at the machine's
//! clock they do not, and each is a step at its own time.

mod step;

use super::grounds::Grounds;
use super::player::Version;
use super::run::{nearest, segments_of, version_of};
use super::{Event, Options, Recording, ReplayError, Segment, Start};
use crate::constant::constant;
use latchwork_block::{Class, Engine, FaultKind, Port, Scan};
use latchwork_image::format_duration;
use std::fmt::Write;
use step::{Step, changes, input_changes};

/// A component test made of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// The test file.
    pub text: String,
    /// Name of the component it tests.
    pub component: String,
    /// Its SHA-256, hex.
    pub hash: String,
    /// Steps in it.
    pub steps: u64,
    /// Executions they stand for.
    pub executions: u64,
    /// What it leaves out, in sentences.
    pub notes: Vec<String>,
}

/// Most steps of one test: more is no test that anybody reads.
const STEPS: usize = 100_000;

/// Writes what was recorded of a block as a test of its component. What the component gives is what is expected: it is run,
/// as in a replay. The engine's ticker must run.
pub fn export(
    recording: &Recording,
    engine: &Engine,
    run: u64,
    block: &str,
    options: &Options,
) -> Result<Exported, ReplayError> {
    let segments = segments_of(recording, run, block)?;
    let segments = &segments[nearest(segments, options.from)..];
    let Some(first) = segments.first() else {
        return Err(ReplayError::Unknown { run, block: block.into(), hint: String::new() });
    };
    let version = version_of(recording, engine, first)?;
    let mut case = Case::new(&version, first)?;
    let mut notes = Vec::new();
    for (number, segment) in (first.head.number..).zip(segments) {
        if segment.head.number != number
            || segment.head.hash != first.head.hash
            || segment.head.cells != first.head.cells
            || segment.head.settings.len() != first.head.settings.len()
        {
            notes.push(format!(
                "it ends at {}: what follows was lost or is another version",
                format_duration(case.last)
            ));
            break;
        }
        if !case.segment(segment, options.to, &mut notes) {
            break;
        }
    }
    Ok(case.finish(notes))
}

/// Settings that changed, and why they were refused.
type Written = (Vec<(usize, u64)>, Option<String>);

struct Case<'a> {
    grounds: Grounds,
    class: std::sync::Arc<Class>,
    start: &'a Segment,
    /// Executions.
    steps: Vec<Step>,
    inputs: Vec<u64>,
    outputs: Option<Vec<u64>>,
    settings: Vec<u64>,
    /// Settings written before the next execution.
    pending: Option<Written>,
    restart: bool,
    last: u64,
    executions: u64,
    /// Plant time of the first execution that gave something else than was recorded, ns.
    astray: Option<u64>,
}

impl<'a> Case<'a> {
    fn new(version: &Version, start: &'a Segment) -> Result<Self, ReplayError> {
        let mut grounds = Grounds::new(version);
        let head = &start.head;
        let class = grounds.class();
        if !version.fits(head) {
            let (block, number, class) = (head.block.clone(), head.number, head.class.clone());
            return Err(ReplayError::Shape { block, number, class });
        }
        let state = if let Start::State(cells) = &head.start { cells.as_slice() } else { &[] };
        grounds.start(&head.settings, state);
        Ok(Self {
            grounds,
            inputs: vec![0; class.argument_cells()],
            class,
            start,
            steps: Vec::new(),
            outputs: None,
            settings: head.settings.clone(),
            pending: None,
            restart: false,
            last: 0,
            executions: 0,
            astray: None,
        })
    }

    /// False when the case ends here.
    fn segment(&mut self, segment: &Segment, to: u64, notes: &mut Vec<String>) -> bool {
        let mut events = segment.events();
        loop {
            match events.next_event() {
                Ok(None) => return true,
                Ok(Some(Event::Execution { scan, .. })) if scan.now > to => return false,
                Ok(Some(Event::Execution { scan, arguments, outputs })) => {
                    if outputs == Err(FaultKind::Budget) {
                        let at = format_duration(scan.now);
                        notes.push(format!("at {at} it exceeded its budget when it was recorded, and began anew"));
                    }
                    self.execute(scan, arguments, outputs);
                    if self.steps.len() >= STEPS {
                        notes.push(format!("it ends at {}: {STEPS} steps are enough", format_duration(scan.now)));
                        return false;
                    }
                }
                Ok(Some(Event::Settings { cells, taken })) => self.configure(cells, taken == Ok(true)),
                Ok(Some(Event::Restarted)) => {
                    self.grounds.start(&self.settings, &[]);
                    self.restart = true;
                }
                Ok(Some(Event::Missed(n))) => {
                    notes.push(format!("it ends at {}: {n} executions were missed there", format_duration(self.last)));
                    return false;
                }
                Err(damaged) => {
                    notes.push(format!(
                        "it ends at {}: the recording is damaged: {damaged}",
                        format_duration(self.last)
                    ));
                    return false;
                }
            }
        }
    }

    fn configure(&mut self, cells: &[u64], taken: bool) {
        let changed = changes(&self.settings, cells);
        let refused = self.grounds.configure(cells).and_then(Result::err);
        if taken {
            self.settings = cells.to_vec();
        }
        let (mut before, was_refused) = self.pending.take().unwrap_or_default();
        before.retain(|(i, _)| changed.iter().all(|(c, _)| c != i));
        before.extend(changed);
        self.pending = Some((before, refused.or(was_refused)));
    }

    fn execute(&mut self, scan: Scan, arguments: &[u64], recorded: Result<&[u64], FaultKind>) {
        let own = self.inputs.len() - usize::from(!self.class.commands.is_empty());
        let result = self.grounds.execute(scan, arguments);
        let (outputs, fault) = match result {
            Some(Ok(outputs)) => (Some(outputs.to_vec()), None),
            Some(Err(fault)) => (None, Some(fault.kind.name())),
            None => return,
        };
        self.executions += 1;
        let same = match recorded {
            Ok(recorded) => outputs.as_deref() == Some(recorded),
            Err(FaultKind::Budget) => true,
            Err(kind) => fault == Some(kind.name()),
        };
        if !same {
            self.astray.get_or_insert(scan.now);
        }
        let of_outputs = outputs.as_ref().map_or(0, |o| o.len() - usize::from(!self.class.alarms.is_empty()));
        let (changed, alarms) = match (&outputs, &self.outputs) {
            (Some(new), Some(old)) => (
                changes(&old[..of_outputs], &new[..of_outputs]),
                (new[of_outputs..] != old[of_outputs..]).then_some(new),
            ),
            (Some(new), None) => (new[..of_outputs].iter().copied().enumerate().collect(), Some(new)),
            (None, _) => (Vec::new(), None),
        };
        let (settings, refused) = self.pending.take().map_or((None, None), |(s, r)| (Some(s), r));
        self.steps.push(Step {
            scan,
            inputs: input_changes(&self.class.inputs, &self.inputs[..own], &arguments[..own]),
            commands: if own < arguments.len() { arguments[own] } else { 0 },
            settings,
            refused,
            restart: std::mem::take(&mut self.restart),
            outputs: changed,
            alarms: alarms.and_then(|a| a.get(of_outputs)).copied(),
            fault,
        });
        self.inputs.copy_from_slice(arguments);
        self.outputs = outputs;
        self.last = scan.now;
    }

    /// The period of the executions, if they have one: then steps without anything new are left out.
    fn grid(&self) -> Option<u64> {
        let first = self.steps.first()?.scan;
        let period =
            self.steps.get(1)?.scan.now.checked_sub(first.now).filter(|p| *p > 0 && *p <= 3_600_000_000_000)?;
        let even = |w: &[Step]| {
            w[1].restart || (w[1].scan.now.wrapping_sub(w[0].scan.now) == period && w[1].scan.elapsed == period)
        };
        self.steps.windows(2).all(even).then_some(period)
    }

    fn finish(self, mut notes: Vec<String>) -> Exported {
        let head = &self.start.head;
        if let Some(at) = self.astray {
            notes.push(format!(
                "from {} on it gives something else than was recorded: what {} remembers and does not retain is not in the \
                 state that it begins with; from its cold start on (--from 0s) it may be",
                format_duration(at),
                head.class
            ));
        }
        let (grid, class) = (self.grid(), &self.class);
        let mut text = String::new();
        let start = self.steps.first().map_or(0, |s| s.scan.now);
        let what = format!("{} from {} to {}", head.block, format_duration(start), format_duration(self.last));
        let _ = writeln!(
            text,
            "# Recorded: block {}, run {}, component {} {}.",
            head.block, head.run, head.component, head.hash
        );
        notes.iter().for_each(|note| {
            let _ = writeln!(text, "# {note}.");
        });
        let _ = writeln!(text, "component = {:?}\nclass = {:?}", head.component, head.class);
        let every = grid.map_or("0ms".into(), format_duration);
        let _ = writeln!(text, "every = {every:?}\nmemory = \"{}B\"\n\n[[case]]\nname = {what:?}", head.memory);
        let _ = writeln!(text, "start = {:?}", format_duration(start));
        if let Some(first) = self.steps.first() {
            let _ = writeln!(text, "first = {}\nelapsed = {:?}", first.scan.first, format_duration(first.scan.elapsed));
        }
        let plain = |ports: &[Port], cells: &[u64]| {
            let pairs = ports.iter().zip(cells).map(|(p, cell)| format!("{} = {}", p.path, constant(&p.ty, *cell)));
            pairs.collect::<Vec<_>>().join(", ")
        };
        if !class.settings.is_empty() {
            let _ = writeln!(text, "settings = {{ {} }}", plain(&class.settings, &head.settings));
        }
        if let Start::State(cells) = &head.start
            && !cells.is_empty()
        {
            let _ = writeln!(text, "state = {{ {} }}", plain(&class.retained, cells));
        }
        let (mut steps, count) = (0, self.steps.len());
        for (n, step) in self.steps.iter().enumerate() {
            if grid.is_some() && n > 0 && n + 1 < count && step.is_dull() {
                continue;
            }
            steps += 1;
            step.write(&mut text, class, start);
        }
        let (component, hash) = (head.component.clone(), head.hash.clone());
        Exported { text, component, hash, steps, executions: self.executions, notes }
    }
}
