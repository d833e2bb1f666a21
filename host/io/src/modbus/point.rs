//! What a point is, and what may be wrong with it.

use super::codec::{Coding, Words, narrowed, widened};
use crate::driver::{DriverConfig, PointConfig, PointShape, Problem};
use latchwork_image::Type;
use latchwork_schema::Values;

/// One past the last address.
const ADDRESSES: u32 = 65536;

/// The four tables of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Table {
    DiscreteInput,
    Coil,
    InputRegister,
    HoldingRegister,
}

impl Table {
    pub(super) const ALL: [Self; 4] = [Self::DiscreteInput, Self::Coil, Self::InputRegister, Self::HoldingRegister];

    /// Its key.
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::DiscreteInput => "discrete-input",
            Self::Coil => "coil",
            Self::InputRegister => "input-register",
            Self::HoldingRegister => "holding-register",
        }
    }

    /// Its entries are bits, not registers.
    pub(super) fn is_bits(self) -> bool {
        matches!(self, Self::DiscreteInput | Self::Coil)
    }

    /// It can be written.
    pub(super) fn is_writable(self) -> bool {
        matches!(self, Self::Coil | Self::HoldingRegister)
    }

    /// Most entries one request reads.
    pub(super) fn most_read(self) -> u16 {
        if self.is_bits() { 2000 } else { 125 }
    }

    /// Most entries one request writes.
    pub(super) fn most_written(self) -> u16 {
        if self.is_bits() { 1968 } else { 123 }
    }

    /// A range of it in words: `input registers 10–13`, `coil 3`.
    pub(super) fn range(self, start: u16, count: u16) -> String {
        let name = match self {
            Self::DiscreteInput => "discrete input",
            Self::Coil => "coil",
            Self::InputRegister => "input register",
            Self::HoldingRegister => "holding register",
        };
        match count {
            0 | 1 => format!("{name} {start}"),
            _ => format!("{name}s {start}–{}", u32::from(start) + u32::from(count) - 1),
        }
    }
}

/// Where a point stands and how it is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) table: Table,
    pub(super) address: u16,
    pub(super) coding: Coding,
    pub(super) words: Words,
    /// The tag is an f64.
    pub(super) real: bool,
}

impl Place {
    /// Type of the tag.
    fn ty(&self) -> Type {
        if self.real { Type::F64 } else { self.coding.ty() }
    }

    /// The cell that the registers hold.
    pub(super) fn decode(&self, registers: &[u16]) -> u64 {
        let cell = self.coding.decode(registers, self.words);
        if self.real { widened(self.coding, cell) } else { cell }
    }

    /// Writes the registers for a cell.
    pub(super) fn encode(&self, cell: u64, into: &mut [u16]) {
        let cell = if self.real { narrowed(self.coding, cell) } else { cell };
        self.coding.encode(cell, self.words, into);
    }

    /// One past its last address.
    pub(super) fn end(&self) -> u32 {
        u32::from(self.address) + u32::from(self.coding.words())
    }

    /// Reads the keys of a point. Every problem with them is told at once.
    pub(super) fn of(values: &Values) -> Result<Self, Vec<Problem>> {
        let named: Vec<(Table, i64)> =
            Table::ALL.into_iter().filter_map(|t| values.integer(t.key()).map(|a| (t, a))).collect();
        let (table, address) = match named[..] {
            [(table, address)] => (table, u16::try_from(address).unwrap_or(u16::MAX)),
            [] => {
                return Err(vec![problem(
                    "",
                    "the point names no table of the device",
                    "name one of discrete-input, coil, input-register, holding-register, as in { coil = 0 }",
                )]);
            }
            [_, (second, _), ..] => {
                let keys: Vec<String> = named.iter().map(|(t, _)| format!("`{}`", t.key())).collect();
                return Err(vec![problem(
                    second.key(),
                    &format!("the point names {} tables: {}", keys.len(), keys.join(", ")),
                    "keep the one it stands in; a value that stands in two places needs two points",
                )]);
            }
        };
        let mut problems = Vec::new();
        let coding = coding(table, values, &mut problems);
        let words = if values.text("words") == Some("little") { Words::Little } else { Words::Big };
        if values.has("words") && coding.words() == 1 {
            problems.push(problem(
                "words",
                &format!("type {} takes one {}, so there is no order of words", coding.ty(), entry(table)),
                "take `words` away, or choose a type of more than one register: u32, s32, f32, f64",
            ));
        }
        let real = values.bool("real") == Some(true);
        if real && coding.ty() == Type::Bool {
            problems.push(problem(
                "real",
                "a bool is no number",
                "take `real` away, or choose a type of registers: u16, s16, u32, s32, f32, f64",
            ));
        }
        let place = Self { table, address, coding, words, real };
        if place.end() > ADDRESSES {
            problems.push(problem(
                table.key(),
                &format!(
                    "type {} at address {address} takes {} registers and would end at {}; the last address is 65535",
                    coding.ty(),
                    coding.words(),
                    place.end() - 1
                ),
                "lower the address or choose a smaller type",
            ));
        }
        if problems.is_empty() { Ok(place) } else { Err(problems) }
    }
}

fn entry(table: Table) -> &'static str {
    if table.is_bits() { "bit" } else { "register" }
}

fn problem(key: &str, message: &str, help: &str) -> Problem {
    Problem { point: None, key: key.into(), message: message.into(), help: Some(help.into()) }
}

fn coding(table: Table, values: &Values, problems: &mut Vec<Problem>) -> Coding {
    let ty = values.text("type");
    if table.is_bits() {
        if let Some(other) = ty.filter(|t| *t != "bool") {
            problems.push(problem(
                "type",
                &format!("`{}` is one bit, it cannot hold type \"{other}\"", table.key()),
                "take `type` away or write type = \"bool\"; numbers stand in input-register or holding-register",
            ));
        }
        if values.has("bit") {
            problems.push(problem(
                "bit",
                &format!("`{}` is one bit already", table.key()),
                "take `bit` away; it chooses a bit of a register",
            ));
        }
        return Coding::Bool;
    }
    if let Some(bit) = values.integer("bit") {
        if let Some(other) = ty.filter(|t| *t != "bool") {
            problems.push(problem(
                "bit",
                &format!("a bit of a register is a bool, not \"{other}\""),
                "take `bit` away to read the whole register, or write type = \"bool\"",
            ));
        }
        return Coding::Bit(u8::try_from(bit).unwrap_or(0));
    }
    match ty {
        Some("bool") => Coding::Bool,
        Some("s16") => Coding::S16,
        Some("u32") => Coding::U32,
        Some("s32") => Coding::S32,
        Some("f32") => Coding::F32,
        Some("f64") => Coding::F64,
        _ => Coding::U16,
    }
}

/// Shape of a point for the plant.
pub(super) fn point(values: &Values) -> Result<PointShape, Vec<Problem>> {
    let place = Place::of(values)?;
    // One bit of a register cannot be written without the other fifteen.
    let writable = place.table.is_writable() && !matches!(place.coding, Coding::Bit(_));
    Ok(PointShape { ty: place.ty(), writable, readable: true })
}

/// What is wrong with the points taken together.
pub(super) fn check_points(config: &DriverConfig) -> Vec<Problem> {
    let outputs = config.points.iter().filter(|p| p.safe.is_some());
    let mut written: Vec<(&PointConfig, Place)> =
        outputs.filter_map(|p| Place::of(&p.values).ok().map(|place| (p, place))).collect();
    let mut problems: Vec<Problem> = written.iter().filter_map(|(p, place)| not_writable(p, place)).collect();
    // Stable: of two points that clash, the later one of the file is told.
    written.sort_by_key(|(_, place)| (place.table, place.address));
    for pair in written.windows(2) {
        let [(a, first), (b, second)] = pair else { continue };
        if first.table == second.table && u32::from(second.address) < first.end() {
            let range = first.table.range(first.address, first.coding.words());
            problems.push(Problem {
                point: Some(b.name.clone()),
                key: second.table.key().into(),
                message: format!("`{}` writes {range} too: one address, one writer", a.name),
                help: Some(format!("choose another address for `{}` or remove one of the two points", b.name)),
            });
        }
    }
    problems
}

fn not_writable(point: &PointConfig, place: &Place) -> Option<Problem> {
    let (key, message, help) = if !place.table.is_writable() {
        let instead = if place.table.is_bits() { "coil" } else { "holding-register" };
        (
            place.table.key(),
            format!("`{}` is an output, but a point of `{}` can only be read", point.name, place.table.key()),
            format!("use `{instead}`, or take `from` away to read it"),
        )
    } else if matches!(place.coding, Coding::Bit(_)) {
        (
            "bit",
            format!("`{}` is an output, but one bit of a register cannot be written without the others", point.name),
            "write the whole register from one u16, or use a coil".to_owned(),
        )
    } else {
        return None;
    };
    Some(Problem { point: Some(point.name.clone()), key: key.into(), message, help: Some(help) })
}
