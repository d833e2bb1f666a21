//! One block on both call paths: every call goes to both and must do the same.

use super::class::Leaf;
use super::strategy::Cells;
use latchwork_block::{
    CallPath, Class, Engine, EngineOptions, Fault, FaultKind, Instance, Limits, Port, Scan, Template, Ticker,
};
use latchwork_image::Type;
use std::sync::LazyLock;
use std::time::Duration;

/// An engine that takes one path, or the best one, and whose epoch runs. Without a cache.
pub fn engine(path: Option<CallPath>) -> &'static Engine {
    static ENGINES: LazyLock<Vec<(Engine, Ticker)>> = LazyLock::new(|| {
        [None, Some(CallPath::Component), Some(CallPath::Plain)]
            .into_iter()
            .map(|force_path| {
                let engine = Engine::new(EngineOptions { cache: None, force_path }).unwrap();
                let ticker = Ticker::start(&engine, Duration::from_millis(5));
                (engine, ticker)
            })
            .collect()
    });
    let index = match path {
        None => 0,
        Some(CallPath::Component) => 1,
        Some(CallPath::Plain) => 2,
    };
    &ENGINES[index].0
}

/// Limits under which nothing but an endless loop meets its budget: on a busy machine 4 MiB page by page take long.
pub fn patient() -> Limits {
    Limits { memory: 1 << 20, budget_ticks: 2000, ..Limits::default() }
}

/// The templates of the only class of a component on the component path and on the plain path.
pub fn templates(bytes: &[u8]) -> [Template; 2] {
    [CallPath::Component, CallPath::Plain].map(|path| {
        let component = engine(Some(path)).load_bytes("twin", bytes).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        let class = component.class(None).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        let template = component.template(&class).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        assert_eq!(template.path(), path);
        template
    })
}

/// The leaves of ports: a signal's quality follows its value.
pub fn leaves(ports: &[Port]) -> Vec<Leaf> {
    let mut out = Vec::new();
    for port in ports {
        out.push(leaf(&port.ty));
        if port.signal {
            out.push(Leaf::Enum(3));
        }
    }
    out
}

pub fn leaf(ty: &Type) -> Leaf {
    match ty {
        Type::Bool => Leaf::Bool,
        Type::U8 => Leaf::U8,
        Type::U16 => Leaf::U16,
        Type::U32 => Leaf::U32,
        Type::U64 | Type::Duration => Leaf::U64,
        Type::S8 => Leaf::S8,
        Type::S16 => Leaf::S16,
        Type::S32 => Leaf::S32,
        Type::S64 => Leaf::S64,
        Type::F32 => Leaf::F32,
        Type::F64 => Leaf::F64,
        Type::Enum(cases) => Leaf::Enum(cases.len() as u16),
        Type::Flags(names) => Leaf::Flags(names.len() as u8),
    }
}

pub fn argument_leaves(class: &Class) -> Vec<Leaf> {
    let mut all = leaves(&class.inputs);
    if !class.commands.is_empty() {
        all.push(Leaf::Flags(class.commands.len() as u8));
    }
    all
}

pub fn result_leaves(class: &Class) -> Vec<Leaf> {
    let mut all = leaves(&class.outputs);
    if !class.alarms.is_empty() {
        all.push(Leaf::Flags(class.alarms.len() as u8));
    }
    all
}

/// The same block twice.
pub struct Twins {
    pub templates: [Template; 2],
    pub limits: Limits,
    pub instances: [Instance; 2],
    pub logs: u64,
    /// What the last fault said, component path and plain path.
    pub last_messages: [String; 2],
}

/// What both did, or how they differ.
pub type Same<T> = Result<T, FaultKind>;

impl Twins {
    /// Both instances, or the fault both made.
    pub fn new(templates: [Template; 2], limits: &Limits) -> Same<Self> {
        let [a, b] = &templates;
        let instances = match (a.instantiate(limits), b.instantiate(limits)) {
            (Ok(a), Ok(b)) => [a, b],
            (a, b) => return Err(same_fault("instantiate", [a.map(drop), b.map(drop)])),
        };
        Ok(Self { templates, limits: limits.clone(), instances, logs: 0, last_messages: Default::default() })
    }

    pub fn class(&self) -> &Class {
        self.templates[0].class()
    }

    /// Executes both on the same cells and returns the result cells.
    pub fn execute(&mut self, scan: Scan, arguments: &[u64]) -> Same<Vec<u64>> {
        // Arguments stand backwards behind the results, so that no index happens to be right by itself.
        let results = self.class().output_cells();
        let out = 3;
        let mut before = vec![0xdead_beef_dead_beef; out + results + 1];
        before.extend(arguments.iter().rev());
        let ins: Vec<u32> = (0..arguments.len()).map(|i| (before.len() - 1 - i) as u32).collect();
        let mut cells = [before.clone(), before.clone()];
        let did: Vec<Result<(), Fault>> = self
            .instances
            .iter_mut()
            .zip(&mut cells)
            .map(|(instance, cells)| instance.execute(scan, &ins, out as u32, cells))
            .collect();
        self.compare_logs();
        for cells in &cells {
            let after = out + results;
            assert_eq!(cells[..out], before[..out], "cells before the outputs were written");
            assert_eq!(cells[after..], before[after..], "cells behind the outputs were written");
        }
        let did: [Result<(), Fault>; 2] = did.try_into().unwrap();
        if did.iter().all(Result::is_ok) {
            assert_eq!(cells[0], cells[1], "the paths differ: component, plain");
            return Ok(cells[0][out..out + results].to_vec());
        }
        for (cells, path) in cells.iter().zip(["component", "plain"]) {
            assert_eq!(*cells, before, "{path}: a fault changed cells");
        }
        Err(self.faulted("execute", did))
    }

    pub fn configure(&mut self, settings: &[u64]) -> Same<Result<(), String>> {
        self.both("configure", |i| i.configure(settings))
    }

    pub fn defaults(&mut self) -> Same<Option<Vec<u64>>> {
        self.both("defaults", Instance::defaults)
    }

    pub fn save(&mut self) -> Same<Option<Vec<u64>>> {
        self.both("save", Instance::save)
    }

    pub fn restore(&mut self, state: &[u64]) -> Same<()> {
        self.both("restore", |i| i.restore(state))
    }

    /// Discards both and makes new ones.
    pub fn renew(&mut self) {
        let fresh = Self::new(self.templates.clone(), &self.limits).expect("it was instantiated before");
        self.instances = fresh.instances;
    }

    fn both<T: PartialEq + std::fmt::Debug>(
        &mut self,
        what: &str,
        call: impl Fn(&mut Instance) -> Result<T, Fault>,
    ) -> Same<T> {
        let [a, b] = &mut self.instances;
        let did = [call(a), call(b)];
        self.compare_logs();
        match did {
            [Ok(a), Ok(b)] => {
                assert_eq!(a, b, "{what}: the paths differ: component, plain");
                Ok(a)
            }
            [a, b] => Err(self.faulted(what, [a.map(drop), b.map(drop)])),
        }
    }

    /// After a fault neither goes on.
    fn faulted(&mut self, what: &str, did: [Result<(), Fault>; 2]) -> FaultKind {
        self.last_messages = did.each_ref().map(|d| d.as_ref().map_or_else(Fault::to_string, |()| String::new()));
        let kind = same_fault(what, did);
        let class = self.class();
        let (arguments, results) = (class.argument_cells(), class.output_cells());
        let settings = vec![0; class.settings.len()];
        let mut cells = vec![0; arguments + results];
        let ins: Vec<u32> = (0..arguments as u32).collect();
        let scan = Scan { now: 0, elapsed: 0, first: false };
        for instance in &mut self.instances {
            instance.execute(scan, &ins, arguments as u32, &mut cells).expect_err("execute after a fault");
            assert!(cells.iter().all(|c| *c == 0), "a discarded instance wrote cells");
            instance.configure(&settings).expect_err("configure after a fault");
        }
        kind
    }

    fn compare_logs(&mut self) {
        let [a, b] = &mut self.instances;
        assert_eq!(a.has_log(), b.has_log());
        let drain = |i: &mut Instance| {
            let mut lines = Vec::new();
            let dropped = i.drain_log(|level, text| lines.push((level, text.to_owned())));
            (lines, dropped)
        };
        let (a, b) = (drain(a), drain(b));
        assert_eq!(a, b, "the logs differ: component, plain");
        self.logs += a.0.len() as u64 + a.1;
    }
}

fn same_fault(what: &str, did: [Result<(), Fault>; 2]) -> FaultKind {
    match did {
        [Err(a), Err(b)] => {
            assert_eq!(a.kind, b.kind, "{what}: the paths differ: component {a}, plain {b}");
            a.kind
        }
        other => panic!("{what}: the paths differ: component, plain: {other:?}"),
    }
}

/// The next scan of a plant whose cycle varies.
pub fn next(scan: &mut Scan, cells: &mut Cells) -> Scan {
    let now = *scan;
    scan.elapsed = Leaf::U64.value(cells.bits()) % 10_000_000_000;
    scan.now = scan.now.saturating_add(scan.elapsed);
    scan.first = false;
    now
}

/// The scan after a cold start.
pub fn first_scan() -> Scan {
    Scan { now: 1_000_000_000, elapsed: 0, first: true }
}

/// Which call comes next: 0 configure, 1 defaults, 2 save and restore, everything else execute. A block is configured
/// first.
pub fn pick(bits: u64, step: u32) -> u64 {
    if step == 0 { 0 } else { bits % 12 }
}
