//! One execution of an interrupt lane.

use super::super::{Lane, LaneState, Moment};
use super::{Arrival, Cause};
use latchwork_image::{Type, Value};
use latchwork_record::{Datum, Entry, Kind};

impl Lane {
    /// Executes the lane for what has happened, at plant time `start`; `clock` tells how long it took.
    pub fn activate(&mut self, arrival: Arrival, start: u64, clock: impl Fn() -> u64) -> LaneState {
        if self.begin_activation(arrival, start, &clock) { self.end_activation(clock()) } else { self.state }
    }

    /// The first half: inputs latched, blocks executed, outputs at the lines, records made. The region is not published.
    pub fn begin_activation(&mut self, arrival: Arrival, start: u64, clock: &dyn Fn() -> u64) -> bool {
        let due = match arrival.cause {
            Cause::Edge { .. } => arrival.time,
            // A tick is due when the other lane is done, but nobody measures a reaction to it.
            Cause::Tick => start,
        };
        if !self.begin(Moment { due, start, stamp: arrival.time }, clock) {
            return false;
        }
        let mut edge = None;
        if let (Cause::Edge { input, level }, Some(interrupt)) = (arrival.cause, &mut self.parts.interrupt) {
            interrupt.edges[input as usize].level = level;
            edge = Some((interrupt.edges[input as usize].cell, interrupt.arrivals.source(input), level));
        }
        self.latch(start);
        if let Some((cell, _, level)) = edge {
            // The level that was just read of an input with one edge may be a younger one.
            self.parts.cells[cell as usize] = u64::from(level);
        }
        self.force_served();
        self.run(arrival.time, start, clock);
        // An edge is what the field did: it is recorded as it was, forced or not.
        if let Some((_, source, level)) = edge {
            let transition = if level { "rising" } else { "falling" };
            let entry = Entry::new(arrival.time, Kind::Event, source, transition);
            self.parts.recorder.push(entry.change(Datum::Boolean(!level), Datum::Boolean(level)));
        }
        // An execution that no edge started may be the one that shows the blocks what a poll would have seen.
        self.record_watched(start);
        self.report_all(arrival.time);
        true
    }

    /// The second half, at plant time `end`: the region published. A fault of the lane makes its lines safe at once.
    pub fn end_activation(&mut self, end: u64) -> LaneState {
        let late = self.parts.interrupt.as_mut().map_or(0, |i| i.arrivals.take_late());
        if late > 0 {
            let entry = Entry::new(self.moment.stamp, Kind::Lost, self.parts.source, "late").priority(100);
            let count = Datum::Integer(i64::try_from(late).unwrap_or(i64::MAX));
            self.parts.recorder.push(entry.change(Datum::None, count).text(format_args!(
                "{late} scans of the lane it runs with have ended without an execution: it is too busy"
            )));
        }
        self.finish(end);
        if self.state != LaneState::Running {
            self.write_points(end);
        }
        self.state
    }

    /// Polls the inputs at plant time `now`, due at `due`, and begins an execution if one has changed; false without one.
    pub fn begin_poll(&mut self, due: u64, now: u64, clock: &dyn Fn() -> u64) -> bool {
        if matches!(self.state, LaneState::Stopped | LaneState::Faulted) {
            return false;
        }
        self.parts.forces.update();
        let levels = self.latch(now);
        self.force_served();
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return false };
        if interrupt.watched.iter().all(|w| w.last == Some(w.read(&parts.cells))) {
            if levels {
                self.show();
            }
            return false;
        }
        if !self.begin(Moment { due, start: now, stamp: now }, clock) {
            return false;
        }
        self.run(now, now, clock);
        self.record_watched(now);
        self.report_all(now);
        true
    }

    /// Shows the other lanes the levels that no edge brings, at plant time `now`, without an execution. For a lane that
    /// [has such levels](Self::has_levels) and may rest for hours.
    pub fn refresh(&mut self, now: u64) {
        if self.state == LaneState::Running {
            self.parts.forces.update();
            let levels = self.read_levels(now);
            self.force_served();
            if levels {
                self.show();
            }
        }
    }

    /// Publishes the cells as they are; outputs are those of the last execution.
    fn show(&mut self) {
        // The region's time is that of the last execution: nothing of it is younger.
        self.parts.publish(self.moment.stamp);
    }

    /// The lane's view of the plant: foreign regions, levels of its own lines. True when a level differs from the last one.
    fn latch(&mut self, now: u64) -> bool {
        self.parts.import();
        self.read_levels(now)
    }

    fn read_levels(&mut self, now: u64) -> bool {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return false };
        let recorder = &mut parts.recorder;
        interrupt.read_levels(&mut parts.cells, now, recorder)
    }

    /// One event for each watched input whose value has changed since the last reading.
    fn record_watched(&mut self, now: u64) {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return };
        for watched in &mut interrupt.watched {
            let now_is = watched.read(&parts.cells);
            let Some((last, _)) = watched.last.replace(now_is).filter(|last| last.0 != now_is.0) else { continue };
            let transition = match (&watched.ty, now_is.0) {
                (Type::Bool, 0) => "falling",
                (Type::Bool, _) => "rising",
                _ => "changed",
            };
            let entry = Entry::new(now, Kind::Event, watched.source, transition);
            parts.recorder.push(entry.change(datum(&watched.ty, last), datum(&watched.ty, now_is.0)));
        }
    }

    fn force_served(&mut self) {
        let parts = &mut self.parts;
        if parts.forces.any()
            && let Some(interrupt) = &parts.interrupt
        {
            parts.forces.apply(&mut parts.cells, interrupt.served.start, interrupt.served.end);
        }
    }

    /// Blocks in order, then at once the outputs.
    #[inline]
    fn run(&mut self, stamp: u64, start: u64, clock: &dyn Fn() -> u64) {
        for index in 0..self.parts.blocks.len() {
            self.step(index, stamp, clock);
            if self.state != LaneState::Running {
                break;
            }
        }
        self.write_points(start);
    }

    fn report_all(&mut self, stamp: u64) {
        for index in 0..self.parts.blocks.len() {
            self.report(index, stamp);
        }
    }
}

fn datum(ty: &Type, cell: u64) -> Datum {
    if *ty == Type::Duration {
        return Datum::Integer(i64::try_from(cell).unwrap_or(i64::MAX));
    }
    // No other type of a point is shown as a text, so nothing here allocates.
    match ty.value(cell) {
        Value::Boolean(b) => Datum::Boolean(b),
        Value::Integer(i) => Datum::Integer(i64::try_from(i).unwrap_or(i64::MAX)),
        Value::Real(r) => Datum::Real(r),
        Value::None | Value::Text(_) => Datum::None,
    }
}
