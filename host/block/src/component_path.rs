//! The component path: calls through wasmtime's component API, with values built by the interface's shapes.
//!
//! It takes any component and is the measure for the plain path: what it accepts, refuses and returns is right.

use crate::instance::Returned;
use crate::interface::{ClassInterface, Function, Returns, Shape, Signature};
use crate::log::{Level, cut};
use crate::state::State;
use crate::{Scan, log};
use latchwork_image::Type;
use wasmtime::component::{Component, ComponentExportIndex, Func, InstancePre, Linker, Val, WasmStr};
use wasmtime::{Result, Store, StoreContextMut, bail, format_err};

/// A compiled component with the functions of one class.
pub(crate) struct Code {
    pre: InstancePre<State>,
    functions: [Option<(ComponentExportIndex, Signature)>; 5],
}

impl Code {
    /// Links a compiled component for one class.
    pub(crate) fn new(component: &Component, class: &ClassInterface, imports: &[String]) -> Result<Self> {
        let mut linker = Linker::new(component.engine());
        for import in imports {
            linker.instance(import)?.func_wrap("write", write)?;
        }
        let pre = linker.instantiate_pre(component)?;
        let (_, interface) = component
            .get_export(None, &class.class.name)
            .ok_or_else(|| format_err!("the exported interface is missing"))?;
        let mut functions = [const { None }; 5];
        for function in Function::ALL {
            if let Some(signature) = Signature::of(class, function) {
                let (_, index) = component
                    .get_export(Some(&interface), function.name())
                    .ok_or_else(|| format_err!("the function {} is missing", function.name()))?;
                functions[function as usize] = Some((index, signature));
            }
        }
        Ok(Self { pre, functions })
    }
}

/// `latchwork:block/log.write`
fn write(mut store: StoreContextMut<'_, State>, (level, message): (Level, WasmStr)) -> Result<()> {
    if store.data_mut().log.admit() {
        let mut buffer = [0; log::LENGTH];
        let length = {
            let text = message.to_str(&store)?;
            let text = cut(&text);
            buffer[..text.len()].copy_from_slice(text.as_bytes());
            text.len()
        };
        store.data_mut().log.push(level, std::str::from_utf8(&buffer[..length])?);
    }
    Ok(())
}

/// A function of one instance with room for its arguments.
struct BoundFunction {
    function: Func,
    signature: Signature,
    args: Vec<Val>,
}

/// An instance with the functions of its class.
pub(crate) struct Bound {
    functions: [Option<BoundFunction>; 5],
    /// Cells of the last result.
    scratch: Vec<u64>,
}

impl Bound {
    /// Instantiates the component in a store.
    pub(crate) fn new(code: &Code, store: &mut Store<State>) -> Result<Self> {
        let instance = code.pre.instantiate(&mut *store)?;
        let mut functions = [const { None }; 5];
        for (to, from) in functions.iter_mut().zip(&code.functions) {
            if let Some((index, signature)) = from {
                let function =
                    instance.get_func(&mut *store, index).ok_or_else(|| format_err!("a function is missing"))?;
                let args = signature.params.iter().map(zero).collect();
                *to = Some(BoundFunction { function, signature: signature.clone(), args });
            }
        }
        Ok(Self { functions, scratch: Vec::new() })
    }

    /// See [`crate::Instance::execute`].
    pub(crate) fn execute(
        &mut self,
        store: &mut Store<State>,
        scan: Scan,
        ins: &[u32],
        out: u32,
        cells: &mut [u64],
    ) -> Result<()> {
        let Some(f) = &mut self.functions[Function::Execute as usize] else { bail!("execute is missing") };
        let (args, results) = (f.signature.argument_leaves() - 3, f.signature.result_leaves());
        assert_eq!(ins.len(), args, "one index per argument cell");
        let out = out as usize..out as usize + results;
        assert!(out.end <= cells.len(), "cells for all outputs");
        let times = [scan.now, scan.elapsed, u64::from(scan.first)];
        let mut values = times.into_iter().chain(ins.iter().map(|i| cells[*i as usize]));
        f.call(store, &mut values, &mut self.scratch)?;
        cells[out].copy_from_slice(&self.scratch);
        Ok(())
    }

    /// Any other function; the cells of its result are left in `to`.
    pub(crate) fn call(
        &mut self,
        store: &mut Store<State>,
        function: Function,
        args: &[u64],
        to: &mut [u64],
    ) -> Result<Returned> {
        let Some(f) = &mut self.functions[function as usize] else { return Ok(Returned::Absent) };
        let refusal = f.call(store, &mut args.iter().copied(), &mut self.scratch)?;
        if let Some(Err(sentence)) = refusal {
            return Ok(Returned::Refused(sentence));
        }
        to.copy_from_slice(&self.scratch);
        Ok(Returned::Done)
    }
}

impl BoundFunction {
    /// Calls the function and leaves the cells of its result in `to`; a refusal is returned.
    fn call(
        &mut self,
        store: &mut Store<State>,
        values: &mut dyn Iterator<Item = u64>,
        to: &mut Vec<u64>,
    ) -> Result<Option<std::result::Result<(), String>>> {
        for (shape, arg) in self.signature.params.iter().zip(&mut self.args) {
            set(shape, arg, values)?;
        }
        to.clear();
        let mut result = [Val::Bool(false)];
        let results = if self.signature.returns == Returns::Nothing { &mut [][..] } else { &mut result[..] };
        self.function.call(&mut *store, &self.args, results)?;
        let [result] = result;
        match (&self.signature.returns, result) {
            (Returns::Nothing, _) => {}
            (Returns::One(shape), value) => get(shape, &value, to)?,
            (Returns::Two(a, b), Val::Tuple(values)) => {
                let [first, second] = &values[..] else { bail!("a tuple of another length") };
                get(a, first, to)?;
                get(b, second, to)?;
            }
            (Returns::Refusal, Val::Result(Ok(_))) => return Ok(Some(Ok(()))),
            (Returns::Refusal, Val::Result(Err(Some(sentence)))) => {
                let Val::String(sentence) = *sentence else { bail!("no sentence") };
                return Ok(Some(Err(sentence)));
            }
            (_, other) => bail!("unexpected result {other:?}"),
        }
        Ok(None)
    }
}

/// A value of a shape to be filled by `set`.
fn zero(shape: &Shape) -> Val {
    match shape {
        Shape::Record(fields) => Val::Record(fields.iter().map(|(n, s)| (n.clone(), zero(s))).collect()),
        Shape::Leaf(ty) => match ty {
            Type::Bool => Val::Bool(false),
            Type::U8 => Val::U8(0),
            Type::U16 => Val::U16(0),
            Type::U32 => Val::U32(0),
            Type::U64 | Type::Duration => Val::U64(0),
            Type::S8 => Val::S8(0),
            Type::S16 => Val::S16(0),
            Type::S32 => Val::S32(0),
            Type::S64 => Val::S64(0),
            Type::F32 => Val::Float32(0.0),
            Type::F64 => Val::Float64(0.0),
            Type::Enum(_) => Val::Enum(String::new()),
            Type::Flags(_) => Val::Flags(Vec::new()),
        },
    }
}

/// Sets a value to the next cells.
fn set(shape: &Shape, value: &mut Val, cells: &mut dyn Iterator<Item = u64>) -> Result<()> {
    match (shape, value) {
        (Shape::Record(fields), Val::Record(values)) => {
            for ((_, shape), (_, value)) in fields.iter().zip(values) {
                set(shape, value, cells)?;
            }
        }
        (Shape::Leaf(ty), value) => {
            let Some(cell) = cells.next() else { bail!("too few cells") };
            *value = match ty {
                Type::Bool => Val::Bool(cell != 0),
                Type::U8 => Val::U8(cell as u8),
                Type::U16 => Val::U16(cell as u16),
                Type::U32 => Val::U32(cell as u32),
                Type::U64 | Type::Duration => Val::U64(cell),
                Type::S8 => Val::S8(cell as i8),
                Type::S16 => Val::S16(cell as i16),
                Type::S32 => Val::S32(cell as i32),
                Type::S64 => Val::S64(cell.cast_signed()),
                Type::F32 => Val::Float32(f32::from_bits(cell as u32)),
                Type::F64 => Val::Float64(f64::from_bits(cell)),
                Type::Enum(cases) => {
                    let case = usize::try_from(cell).ok().and_then(|i| cases.get(i));
                    Val::Enum(
                        case.ok_or_else(|| format_err!("an argument cell holds {cell}, which is no case of {ty}"))?
                            .clone(),
                    )
                }
                Type::Flags(names) => Val::Flags(
                    names.iter().enumerate().filter(|(i, _)| cell >> i & 1 == 1).map(|(_, n)| n.clone()).collect(),
                ),
            };
        }
        (_, other) => bail!("unexpected argument {other:?}"),
    }
    Ok(())
}

/// Appends the cells of a value.
fn get(shape: &Shape, value: &Val, to: &mut Vec<u64>) -> Result<()> {
    let signed = |i: i32| u64::from(i.cast_unsigned());
    to.push(match (shape, value) {
        (Shape::Record(fields), Val::Record(values)) => {
            for ((_, shape), (_, value)) in fields.iter().zip(values) {
                get(shape, value, to)?;
            }
            return Ok(());
        }
        (_, Val::Bool(b)) => u64::from(*b),
        (_, Val::U8(n)) => u64::from(*n),
        (_, Val::U16(n)) => u64::from(*n),
        (_, Val::U32(n)) => u64::from(*n),
        (_, Val::U64(n)) => *n,
        (_, Val::S8(n)) => signed((*n).into()),
        (_, Val::S16(n)) => signed((*n).into()),
        (_, Val::S32(n)) => signed(*n),
        (_, Val::S64(n)) => n.cast_unsigned(),
        (_, Val::Float32(x)) => u64::from(x.to_bits()),
        (_, Val::Float64(x)) => x.to_bits(),
        (Shape::Leaf(Type::Enum(cases)), Val::Enum(case)) => {
            cases.iter().position(|c| c == case).ok_or_else(|| format_err!("unknown case {case}"))? as u64
        }
        (Shape::Leaf(Type::Flags(names)), Val::Flags(set)) => set
            .iter()
            .filter_map(|flag| names.iter().position(|n| n == flag))
            .fold(0, |bits, position| bits | 1 << position),
        (_, other) => bail!("unexpected result {other:?}"),
    });
    Ok(())
}
