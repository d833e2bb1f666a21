//! Where every value of a function stands in the canonical ABI: computed once, followed in every call.
//!
//! A cell holds exactly the bits of a flat value (see `latchwork_image::Type`), so a flat argument is the cell itself.

use crate::interface::{Returns, Shape, Signature};
use latchwork_image::Type;
use wasmtime::ValType;

/// More flat parameters than this stand in memory.
const FLAT_PARAMS: usize = 16;

/// How one value stands in memory and what makes it legal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// One byte; anything but 0 is true.
    Bool,
    S8,
    U8,
    S16,
    U16,
    /// 32 bits of an integer or a real.
    W32,
    /// 64 bits.
    W64,
    /// Discriminant in 1, 2 or 4 bytes, below the number of cases.
    Enum8,
    Enum16,
    Enum32,
    /// Bits in 1, 2 or 4 bytes; excess bits mean nothing.
    Flags8,
    Flags16,
    Flags32,
}

/// One value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leaf {
    /// Offset from the beginning of the arguments or the result, bytes.
    pub(super) offset: u32,
    /// Number of cases of an enum, mask of flags.
    pub(super) limit: u32,
    /// How it stands there.
    pub(super) kind: Kind,
}

/// Core type of a flat value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Core {
    I32,
    I64,
    F32,
    F64,
}

impl Core {
    pub(super) fn is(self, ty: &ValType) -> bool {
        match self {
            Self::I32 => ty.is_i32(),
            Self::I64 => ty.is_i64(),
            Self::F32 => ty.is_f32(),
            Self::F64 => ty.is_f64(),
        }
    }
}

/// How the result comes back.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ResultPlan {
    /// There is none.
    Nothing,
    /// One flat value.
    Flat(Leaf),
    /// A pointer to the values.
    Memory {
        /// Bytes there.
        size: u32,
        /// Alignment of the pointer, a power of two.
        align: u32,
        /// All values.
        moves: Box<[Leaf]>,
        /// Those that can be illegal.
        checks: Box<[Leaf]>,
    },
    /// A pointer to `result<_, string>`.
    Refusal,
}

/// How to call one function.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// Arguments in order.
    pub(super) params: Box<[Leaf]>,
    /// Size and alignment of the arguments when they stand in memory.
    pub(super) spill: Option<(u32, u32)>,
    /// Result.
    pub(super) result: ResultPlan,
    /// Cells of the result.
    pub(super) results: usize,
    /// Parameters of the core function.
    pub(super) core_params: Vec<Core>,
    /// Result of the core function.
    pub(super) core_result: Option<Core>,
}

impl Plan {
    /// The plan of a function, by the rules of the canonical ABI.
    pub(super) fn new(signature: &Signature) -> Self {
        let (mut params, mut core_params) = (Vec::new(), Vec::new());
        let (size, align) = place(&mut signature.params.iter(), 0, &mut params);
        for param in &signature.params {
            param.each_leaf(&mut |ty| core_params.push(core(ty)));
        }
        let mut spill = None;
        if params.len() > FLAT_PARAMS {
            spill = Some((size, align));
            core_params = vec![Core::I32];
        }
        let (result, core_result) = result(&signature.returns);
        let params = params.into();
        Self { params, spill, result, results: signature.result_leaves(), core_params, core_result }
    }

    /// Something is read from or written to memory.
    pub(super) fn needs_memory(&self) -> bool {
        self.spill.is_some() || matches!(self.result, ResultPlan::Memory { .. } | ResultPlan::Refusal)
    }
}

fn result(returns: &Returns) -> (ResultPlan, Option<Core>) {
    let mut moves = Vec::new();
    let (size, align) = match returns {
        Returns::Nothing => return (ResultPlan::Nothing, None),
        Returns::Refusal => return (ResultPlan::Refusal, Some(Core::I32)),
        Returns::One(shape) => place(&mut [shape].into_iter(), 0, &mut moves),
        Returns::Two(a, b) => place(&mut [a, b].into_iter(), 0, &mut moves),
    };
    if let ([leaf], Returns::One(shape)) = (&moves[..], returns) {
        let mut flat = Core::I32;
        shape.each_leaf(&mut |ty| flat = core(ty));
        return (ResultPlan::Flat(*leaf), Some(flat));
    }
    let fallible = |l: &&Leaf| matches!(l.kind, Kind::Enum8 | Kind::Enum16 | Kind::Enum32);
    let checks = moves.iter().filter(fallible).copied().collect();
    (ResultPlan::Memory { size, align, moves: moves.into(), checks }, Some(Core::I32))
}

/// Places values one behind the other, each aligned; returns size and alignment of the whole.
fn place(shapes: &mut dyn Iterator<Item = &Shape>, base: u32, to: &mut Vec<Leaf>) -> (u32, u32) {
    let (mut offset, mut align) = (0u32, 1);
    for shape in shapes {
        let its = alignment(shape);
        offset = offset.next_multiple_of(its);
        align = align.max(its);
        offset += match shape {
            Shape::Leaf(ty) => {
                let leaf = leaf(ty, base + offset);
                to.push(leaf);
                leaf.kind.size()
            }
            Shape::Record(fields) => place(&mut fields.iter().map(|(_, s)| s), base + offset, to).0,
        };
    }
    (offset.next_multiple_of(align), align)
}

fn alignment(shape: &Shape) -> u32 {
    let mut align = 1;
    shape.each_leaf(&mut |ty| align = align.max(leaf(ty, 0).kind.size()));
    align
}

fn leaf(ty: &Type, offset: u32) -> Leaf {
    let (kind, limit) = match ty {
        Type::Bool => (Kind::Bool, 0),
        Type::S8 => (Kind::S8, 0),
        Type::U8 => (Kind::U8, 0),
        Type::S16 => (Kind::S16, 0),
        Type::U16 => (Kind::U16, 0),
        Type::S32 | Type::U32 | Type::F32 => (Kind::W32, 0),
        Type::S64 | Type::U64 | Type::F64 | Type::Duration => (Kind::W64, 0),
        Type::Enum(cases) => {
            let kind = match cases.len() {
                0..=0x100 => Kind::Enum8,
                0x101..=0x1_0000 => Kind::Enum16,
                _ => Kind::Enum32,
            };
            (kind, cases.len() as u32)
        }
        Type::Flags(names) => {
            let kind = match names.len() {
                0..=8 => Kind::Flags8,
                9..=16 => Kind::Flags16,
                _ => Kind::Flags32,
            };
            (kind, u32::MAX >> (32 - names.len().clamp(1, 32)))
        }
    };
    Leaf { offset, limit, kind }
}

fn core(ty: &Type) -> Core {
    match ty {
        Type::F32 => Core::F32,
        Type::F64 => Core::F64,
        Type::S64 | Type::U64 | Type::Duration => Core::I64,
        _ => Core::I32,
    }
}

impl Kind {
    /// Bytes, which is also the alignment.
    pub(super) fn size(self) -> u32 {
        match self {
            Self::Bool | Self::S8 | Self::U8 | Self::Enum8 | Self::Flags8 => 1,
            Self::S16 | Self::U16 | Self::Enum16 | Self::Flags16 => 2,
            Self::W32 | Self::Enum32 | Self::Flags32 => 4,
            Self::W64 => 8,
        }
    }
}

impl Leaf {
    /// The cell of the value in `bytes`, the memory of the arguments or the result. Legality is checked apart.
    #[inline]
    pub(super) fn load(&self, bytes: &[u8]) -> u64 {
        let at = self.offset as usize;
        let u8 = || bytes[at];
        let u16 = || u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let u32 = || u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let signed = |i: i32| u64::from(i.cast_unsigned());
        match self.kind {
            Kind::Bool => u64::from(u8() != 0),
            Kind::U8 | Kind::Enum8 => u8().into(),
            Kind::S8 => signed(u8().cast_signed().into()),
            Kind::U16 | Kind::Enum16 => u16().into(),
            Kind::S16 => signed(u16().cast_signed().into()),
            Kind::W32 | Kind::Enum32 => u32().into(),
            Kind::W64 => {
                let mut all = [0; 8];
                all.copy_from_slice(&bytes[at..at + 8]);
                u64::from_le_bytes(all)
            }
            Kind::Flags8 => (u32::from(u8()) & self.limit).into(),
            Kind::Flags16 => (u32::from(u16()) & self.limit).into(),
            Kind::Flags32 => (u32() & self.limit).into(),
        }
    }

    /// The cell of a flat value; integers in range of their core type are cut as the component API cuts them.
    pub(super) fn lift_flat(self, bits: u64) -> u64 {
        let low = bits as u32;
        let signed = |i: i32| u64::from(i.cast_unsigned());
        match self.kind {
            Kind::Bool => u64::from(low != 0),
            Kind::U8 => u64::from(low as u8),
            Kind::S8 => signed((low as i8).into()),
            Kind::U16 => u64::from(low as u16),
            Kind::S16 => signed((low as i16).into()),
            Kind::W32 | Kind::Enum8 | Kind::Enum16 | Kind::Enum32 => low.into(),
            Kind::W64 => bits,
            Kind::Flags8 | Kind::Flags16 | Kind::Flags32 => (low & self.limit).into(),
        }
    }

    /// Puts a cell's value into `bytes`.
    #[inline]
    pub(super) fn store(&self, cell: u64, bytes: &mut [u8]) {
        let (at, size) = (self.offset as usize, self.kind.size() as usize);
        bytes[at..at + size].copy_from_slice(&cell.to_le_bytes()[..size]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(n: usize) -> std::sync::Arc<[String]> {
        (0..n).map(|i| format!("n{i}")).collect()
    }

    fn record(types: &[Type]) -> Shape {
        Shape::Record(types.iter().map(|t| (t.to_string(), Shape::Leaf(t.clone()))).collect())
    }

    /// Offsets worked out by hand from the canonical ABI's rules of alignment.
    #[test]
    fn values_are_aligned_and_nested_records_padded() {
        let inner = record(&[Type::U8, Type::U32, Type::U8]);
        let outer = Shape::Record(vec![
            ("a".into(), Shape::Leaf(Type::Bool)),
            ("b".into(), inner),
            ("c".into(), Shape::Leaf(Type::U8)),
            ("d".into(), Shape::Leaf(Type::F64)),
            ("e".into(), Shape::Leaf(Type::Enum(names(257)))),
            ("f".into(), Shape::Leaf(Type::Flags(names(17)))),
        ]);
        let signature = Signature { params: vec![], returns: Returns::Two(outer, Shape::Leaf(Type::Flags(names(9)))) };
        let ResultPlan::Memory { size, align, moves, checks } = Plan::new(&signature).result else { panic!() };
        assert_eq!(moves.iter().map(|m| m.offset).collect::<Vec<_>>(), [0, 4, 8, 12, 16, 24, 32, 36, 40]);
        assert_eq!((size, align), (48, 8));
        assert_eq!(checks.len(), 1);
    }

    #[test]
    fn one_value_comes_back_flat_and_seventeen_arguments_stand_in_memory() {
        let one = Signature { params: vec![record(&vec![Type::U8; 16])], returns: Returns::One(record(&[Type::F32])) };
        let plan = Plan::new(&one);
        assert_eq!((plan.spill, plan.core_params.len(), plan.core_result), (None, 16, Some(Core::F32)));
        let many = Signature { params: vec![record(&vec![Type::U16; 17])], returns: Returns::Nothing };
        let plan = Plan::new(&many);
        assert_eq!((plan.spill, plan.core_params, plan.core_result), (Some((34, 2)), vec![Core::I32], None));
    }

    #[test]
    fn every_type_goes_to_memory_and_back() {
        for (ty, cell) in [
            (Type::Bool, 1),
            (Type::S8, 0xffff_ff80),
            (Type::U8, 0xfe),
            (Type::S16, 0xffff_8001),
            (Type::U16, 0xfffe),
            (Type::S32, 0x8000_0000),
            (Type::U64, u64::MAX - 1),
            (Type::F64, f64::NAN.to_bits() | 7),
            (Type::Enum(names(300)), 299),
            (Type::Flags(names(32)), 0xdead_beef),
            (Type::Flags(names(3)), 5),
        ] {
            let mut bytes = [0xaa; 16];
            let leaf = leaf(&ty, 8);
            leaf.store(cell, &mut bytes);
            assert_eq!(leaf.load(&bytes), cell, "{ty}");
            assert_eq!(leaf.lift_flat(cell), cell, "{ty}");
        }
        assert_eq!(leaf(&Type::Flags(names(3)), 0).load(&[0xff]), 7);
        assert_eq!(leaf(&Type::Bool, 0).load(&[0xfe]), 1);
    }
}
