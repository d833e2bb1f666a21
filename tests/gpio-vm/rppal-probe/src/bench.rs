//! A lane's points on the bench.

use latchwork_image::Type;
use latchwork_io::direct::{Direct, Edge, Role};
use latchwork_io::driver::{DriverConfig, DriverKind, IoEvent, PointConfig};
use latchwork_schema::{Value, Values};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Longest time an edge may take from the pin to the descriptor.
const PATIENCE: Timespec = Timespec { tv_sec: 2, tv_nsec: 0 };

/// The kind under test.
pub(crate) fn kind() -> &'static DriverKind {
    latchwork_io::kinds::find("rppal").expect("the kind is there")
}

/// A point and what the lane does with it.
pub(crate) struct Point {
    pub(crate) config: PointConfig,
    pub(crate) role: Role,
}

/// A pin by its number.
pub(crate) fn pin(name: &str, pin: u8, role: Role) -> Point {
    new(name, "pin", pin, role, Type::Bool)
}

/// A PWM channel.
pub(crate) fn pwm(name: &str, channel: u8, safe: f64) -> Point {
    let mut point = new(name, "pwm", channel, Role::Output, Type::F64);
    point.config.safe = Some(safe.to_bits());
    point
}

fn new(name: &str, key: &str, number: u8, role: Role, ty: Type) -> Point {
    let mut values = Values::default();
    values.entries.insert(key.into(), (Value::Integer(number.into()), 0..0));
    let safe = (role == Role::Output).then_some(0);
    Point { config: PointConfig { name: name.into(), values, ty, safe }, role }
}

impl Point {
    pub(crate) fn with(mut self, key: &str, value: Value) -> Self {
        self.config.values.entries.insert(key.into(), (value, 0..0));
        self
    }

    pub(crate) fn text(self, key: &str, text: &str) -> Self {
        self.with(key, Value::Text(text.into()))
    }

    pub(crate) fn active_low(self) -> Self {
        self.with("active-low", Value::Bool(true))
    }

    pub(crate) fn safe(mut self, value: bool) -> Self {
        self.config.safe = Some(value.into());
        self
    }
}

pub(crate) fn config(points: Vec<Point>) -> (DriverConfig, Vec<Role>) {
    let roles = points.iter().map(|p| p.role).collect();
    let points = points.into_iter().map(|p| p.config).collect();
    (DriverConfig { name: "pi".into(), values: Values::default(), points }, roles)
}

/// Points in the hands of a lane, and what it was told.
pub(crate) struct Lane {
    pub(crate) direct: Box<dyn Direct>,
    pub(crate) told: Vec<String>,
}

impl Lane {
    /// Opens nothing yet.
    pub(crate) fn closed(points: Vec<Point>) -> Result<Self, String> {
        let (config, roles) = config(points);
        let problems = (kind().check)(&config);
        if !problems.is_empty() {
            return Err(format!("{problems:?}"));
        }
        let direct = (kind().direct.ok_or("the kind has no part for lanes")?)(config, roles)?;
        Ok(Self { direct, told: Vec::new() })
    }

    /// Opens all points, without trouble.
    pub(crate) fn open(points: Vec<Point>) -> Result<Self, String> {
        let mut lane = Self::closed(points)?;
        lane.try_open();
        if lane.direct.healthy() && lane.told.is_empty() { Ok(lane) } else { Err(format!("told: {:?}", lane.told)) }
    }

    /// Half a minute passes, in which the lane calls once a second: longer than any pause between two tries.
    pub(crate) fn try_open(&mut self) {
        let told = &mut self.told;
        for _ in 0..31 {
            self.direct.open(&mut |e| told.push(render(&e)));
        }
    }

    pub(crate) fn level(&mut self, point: usize) -> Option<bool> {
        let told = &mut self.told;
        self.direct.level(point, &mut |e| told.push(render(&e)))
    }

    pub(crate) fn write(&mut self, outputs: &[u64]) {
        let told = &mut self.told;
        self.direct.write(outputs, &mut |e| told.push(render(&e)));
    }

    /// Takes all edges of a point that wait.
    pub(crate) fn take(&mut self, point: usize, edges: &mut Vec<Edge>) {
        let told = &mut self.told;
        while self.direct.edges(point, &mut |e| edges.push(e), &mut |e| told.push(render(&e))) {}
    }

    /// Waits until a point has edges; false when none came in time.
    pub(crate) fn wait(&self, point: usize) -> bool {
        let Some(descriptor) = self.direct.descriptor(point) else { return false };
        poll(&mut [PollFd::new(&descriptor, PollFlags::IN)], Some(&PATIENCE)) == Ok(1)
    }

    /// Waits for edges of a point and takes them.
    pub(crate) fn next(&mut self, point: usize, edges: &mut Vec<Edge>) -> Result<(), String> {
        if !self.wait(point) {
            return Err(format!("point {point} gave no edge within 2 s; told: {:?}", self.told));
        }
        self.take(point, edges);
        Ok(())
    }
}

pub(crate) fn render(event: &IoEvent) -> String {
    format!("{} {}: {}", event.source, event.transition, event.text)
}

/// Fails unless both are the same.
pub(crate) fn same<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), String> {
    if found == expected { Ok(()) } else { Err(format!("{what}: found {found:?}, expected {expected:?}")) }
}

/// Fails unless one of what was told begins so and holds all of these.
pub(crate) fn told(told: &[String], begin: &str, parts: &[&str]) -> Result<(), String> {
    let fits = |t: &&String| t.starts_with(begin) && parts.iter().all(|p| t.contains(p));
    if told.iter().filter(fits).count() == 1 {
        return Ok(());
    }
    Err(format!("expected once \"{begin}…\" with {parts:?}, was told {told:?}"))
}
