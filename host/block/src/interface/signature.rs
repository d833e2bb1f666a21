//! The functions of a device class with their parameters and results, as both call paths see them.

use super::{ClassInterface, Shape};
use latchwork_image::Type;

/// A function of a device class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
    /// One execution.
    Execute,
    /// New settings.
    Configure,
    /// The block's own settings.
    Defaults,
    /// State out.
    Save,
    /// State in.
    Restore,
}

impl Function {
    /// All, in the order of their numbers.
    pub(crate) const ALL: [Self; 5] = [Self::Execute, Self::Configure, Self::Defaults, Self::Save, Self::Restore];

    /// Its name in the interface.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Execute => "execute",
            Self::Configure => "configure",
            Self::Defaults => "defaults",
            Self::Save => "save",
            Self::Restore => "restore",
        }
    }
}

/// What a function returns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Returns {
    /// Nothing.
    Nothing,
    /// A record or flags.
    One(Shape),
    /// A tuple of a record and flags.
    Two(Shape, Shape),
    /// `result<_, string>`
    Refusal,
}

/// Parameters and result of a function.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signature {
    pub(crate) params: Vec<Shape>,
    pub(crate) returns: Returns,
}

impl Signature {
    /// The signature of a function, `None` if the class does not have it.
    pub(crate) fn of(class: &ClassInterface, function: Function) -> Option<Self> {
        Some(match function {
            Function::Execute => {
                let mut params = vec![scan()];
                params.extend(class.inputs.clone());
                params.extend(class.commands.clone());
                let returns = match (class.outputs.clone(), class.alarms.clone()) {
                    (Some(outputs), Some(alarms)) => Returns::Two(outputs, alarms),
                    (Some(one), None) | (None, Some(one)) => Returns::One(one),
                    (None, None) => Returns::Nothing,
                };
                Self { params, returns }
            }
            Function::Configure => Self { params: vec![class.settings.clone()?], returns: Returns::Refusal },
            Function::Defaults if !class.defaults => return None,
            Function::Defaults => Self { params: Vec::new(), returns: Returns::One(class.settings.clone()?) },
            Function::Save => Self { params: Vec::new(), returns: Returns::One(class.retained.clone()?) },
            Function::Restore => Self { params: vec![class.retained.clone()?], returns: Returns::Nothing },
        })
    }

    /// Flat values of the parameters.
    pub(crate) fn argument_leaves(&self) -> usize {
        self.params.iter().map(Shape::leaves).sum()
    }

    /// Flat values of the result; a refusal has none.
    pub(crate) fn result_leaves(&self) -> usize {
        match &self.returns {
            Returns::Nothing | Returns::Refusal => 0,
            Returns::One(shape) => shape.leaves(),
            Returns::Two(a, b) => a.leaves() + b.leaves(),
        }
    }
}

/// `latchwork:block/types.scan`
pub(super) fn scan() -> Shape {
    let leaf = |name: &str, ty| (name.to_string(), Shape::Leaf(ty));
    Shape::Record(vec![leaf("now", Type::U64), leaf("elapsed", Type::U64), leaf("first", Type::Bool)])
}

/// Bytes that results and strings may have the host copy in one call. The component API counts names of fields, too, so
/// the sum grows with the interface; what is left for strings is the same on both paths.
pub(crate) fn fuel(class: &ClassInterface) -> usize {
    const STRINGS: usize = 64 << 10;
    const PER_VALUE: usize = 128;
    fn cost(shape: &Shape) -> usize {
        match shape {
            Shape::Leaf(Type::Enum(names) | Type::Flags(names)) => {
                PER_VALUE + names.iter().map(String::len).sum::<usize>()
            }
            Shape::Leaf(_) => PER_VALUE,
            Shape::Record(fields) => fields.iter().map(|(n, s)| PER_VALUE + n.len() + cost(s)).sum(),
        }
    }
    let of = |function| match Signature::of(class, function).map(|s| s.returns) {
        Some(Returns::One(shape)) => cost(&shape),
        Some(Returns::Two(a, b)) => PER_VALUE + cost(&a) + cost(&b),
        _ => PER_VALUE,
    };
    STRINGS + Function::ALL.into_iter().map(of).max().unwrap_or(0)
}
