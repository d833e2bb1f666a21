//! The canonical ABI of a class: how its values travel as core values, and where they lie in memory.
//!
//! Only what ports can be: no strings or lists but the refusal of `configure`. Rules are the component model's: at most 16
//! parameters travel as core values, more of them by a pointer; a result of one core value is returned, more by a pointer.

use crate::class::{Class, Kind, Ty};

/// Most parameters that travel as core values.
const MOST_PARAMETERS: usize = 16;

/// A core type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Core {
    I32,
    I64,
    F32,
    F64,
}

/// One value that is no record.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    /// Field names down to it, in kebab case: the first is the parameter or the part of the result.
    pub(crate) path: Vec<String>,
    pub(crate) ty: Ty,
    /// Bytes from the beginning.
    pub(crate) offset: usize,
}

impl Leaf {
    pub(crate) fn core(&self) -> Core {
        match self.ty {
            Ty::U64 | Ty::S64 => Core::I64,
            Ty::F32 => Core::F32,
            Ty::F64 => Core::F64,
            _ => Core::I32,
        }
    }
}

/// Values that travel together: the parameters of a function, or its result.
#[derive(Clone, Debug)]
pub(crate) struct Tuple {
    pub(crate) leaves: Vec<Leaf>,
    /// Bytes in memory.
    pub(crate) size: usize,
}

impl Tuple {
    /// Lays out named parts one after the other.
    pub(crate) fn new(class: &Class, parts: &[(&str, usize)]) -> Self {
        let mut leaves = Vec::new();
        let (mut end, mut align) = (0, 1);
        for (name, ty) in parts {
            let (size, own) = size_align(class, Ty::Named(*ty));
            let start = up(end, own);
            collect(class, Ty::Named(*ty), start, &mut vec![(*name).to_owned()], &mut leaves);
            (end, align) = (start + size, align.max(own));
        }
        Self { leaves, size: up(end, align) }
    }

    /// As parameters: by a pointer.
    pub(crate) fn spilled(&self) -> bool {
        self.leaves.len() > MOST_PARAMETERS
    }
}

fn up(offset: usize, align: usize) -> usize {
    offset.next_multiple_of(align)
}

fn collect(class: &Class, ty: Ty, offset: usize, path: &mut Vec<String>, leaves: &mut Vec<Leaf>) {
    if let Ty::Named(index) = ty
        && let Kind::Record(fields) = &class.types[index].kind
    {
        let mut end = offset;
        for field in fields {
            let (size, align) = size_align(class, field.ty);
            let start = up(end, align);
            path.push(field.name.clone());
            collect(class, field.ty, start, path, leaves);
            path.pop();
            end = start + size;
        }
    } else {
        leaves.push(Leaf { path: path.clone(), ty, offset });
    }
}

/// Bytes of a flags or enum type: 1, 2 or 4.
pub(crate) fn word(kind: &Kind) -> usize {
    match kind {
        Kind::Flags(flags) if flags.len() <= 8 => 1,
        Kind::Flags(flags) if flags.len() <= 16 => 2,
        Kind::Enum(cases) if cases.len() <= 1 << 8 => 1,
        Kind::Enum(cases) if cases.len() <= 1 << 16 => 2,
        _ => 4,
    }
}

/// Size and alignment in memory.
pub(crate) fn size_align(class: &Class, ty: Ty) -> (usize, usize) {
    let index = match ty {
        Ty::Bool | Ty::U8 | Ty::S8 => return (1, 1),
        Ty::U16 | Ty::S16 => return (2, 2),
        Ty::U32 | Ty::S32 | Ty::F32 => return (4, 4),
        Ty::U64 | Ty::S64 | Ty::F64 => return (8, 8),
        Ty::Named(index) => index,
    };
    match &class.types[index].kind {
        Kind::Record(fields) => {
            let (mut end, mut most) = (0, 1);
            for field in fields {
                let (size, align) = size_align(class, field.ty);
                (end, most) = (up(end, align) + size, most.max(align));
            }
            (up(end, most), most)
        }
        kind => (word(kind), word(kind)),
    }
}

/// All functions of a class.
#[derive(Clone, Debug)]
pub(crate) struct Abi {
    /// Parameters of `execute`.
    pub(crate) execute: Tuple,
    /// Result of `execute`.
    pub(crate) result: Tuple,
    /// Parameter of `configure`, result of `defaults`.
    pub(crate) settings: Option<Tuple>,
    /// Parameter of `restore`, result of `save`.
    pub(crate) retained: Option<Tuple>,
}

impl Abi {
    pub(crate) fn of(class: &Class) -> Self {
        Self {
            execute: Tuple::new(class, &class.execute_parameters()),
            result: Tuple::new(class, &class.execute_results()),
            settings: class.settings.map(|s| Tuple::new(class, &[("settings", s)])),
            retained: class.retained.map(|r| Tuple::new(class, &[("state", r)])),
        }
    }

    /// Bytes that the host asks for to pass parameters by pointer; `None` when all travel as core values.
    pub(crate) fn spill(&self) -> Option<usize> {
        let all = [Some(&self.execute), self.settings.as_ref(), self.retained.as_ref()];
        all.into_iter().flatten().filter(|t| t.spilled()).map(|t| t.size).max()
    }
}
