//! From an extracted module to an instance whose functions may be called unchecked: every core signature is checked here.

use super::extract::{Extract, Lifted};
use super::plan::{Core, Plan};
use crate::interface::{ClassInterface, Function, Signature};
use crate::log::Level;
use crate::state::State;
use std::sync::Arc;
use wasmtime::{
    Caller, Func, Instance, InstancePre, Linker, Memory, Module, Result, Store, Trap, bail, ensure, format_err,
};

/// A compiled core module with the functions of one class.
pub(crate) struct Code {
    pre: InstancePre<State>,
    initialize: Option<String>,
    log_memory: Option<String>,
    functions: [Option<(Lifted, Arc<Plan>)>; 5],
}

impl Code {
    /// Links a compiled module.
    pub(crate) fn new(module: &Module, extract: &Extract<'_>, class: &ClassInterface) -> Result<Self> {
        let mut linker = Linker::new(module.engine());
        linker.allow_shadowing(true);
        for (module, name) in &extract.logs {
            linker.func_wrap(module, name, write)?;
        }
        let mut functions = [const { None }; 5];
        for function in Function::ALL {
            if let (Some(lifted), Some(signature)) =
                (&extract.functions[function as usize], Signature::of(class, function))
            {
                functions[function as usize] = Some((lifted.clone(), Arc::new(Plan::new(&signature))));
            }
        }
        Ok(Self {
            pre: linker.instantiate_pre(module)?,
            initialize: extract.initialize.clone(),
            log_memory: extract.log_memory.clone(),
            functions,
        })
    }
}

/// `latchwork:block/log.write`, lowered: level, pointer and length of the message. The checks and their order are the
/// component API's.
fn write(mut caller: Caller<'_, State>, level: u32, pointer: u32, length: u32) -> Result<()> {
    let state = caller.data_mut();
    if !state.may_leave {
        return Err(Trap::CannotLeaveComponent.into());
    }
    let (fuel, memory) = (state.fuel, state.memory);
    let level = Level::from_discriminant(level).ok_or_else(|| format_err!("unexpected discriminant: {level}"))?;
    let Some(memory) = memory else { bail!("a message before there is a memory") };
    let (bytes, state) = memory.data_and_store_mut(&mut caller);
    let message = super::call::slice(bytes, pointer, length)
        .ok_or_else(|| format_err!("string pointer/length out of bounds of memory"))?;
    ensure!(message.len() <= fuel, "a message of {length} bytes");
    if state.log.admit() {
        state.log.push(level, std::str::from_utf8(message)?);
    }
    Ok(())
}

/// A function of one instance.
pub(super) struct BoundFunction {
    pub(super) plan: Arc<Plan>,
    pub(super) function: Func,
    pub(super) memory: Option<Memory>,
    pub(super) realloc: Option<Func>,
    pub(super) post_return: Option<Func>,
}

/// An instance with the functions of its class. What every execution touches comes first, the rest stands apart.
pub(crate) struct Bound {
    /// `execute`.
    pub(super) execute: Func,
    /// The memory of its result.
    pub(super) memory: Option<Memory>,
    pub(super) plan: Arc<Plan>,
    /// `execute` needs more than a call: room for arguments, or cleaning up.
    pub(super) elaborate: bool,
    pub(super) rest: Box<Rest>,
}

/// What a plain execution does not touch.
pub(super) struct Rest {
    pub(super) functions: [Option<BoundFunction>; 5],
    /// Result of an execution that cleans up afterwards.
    pub(super) scratch: Box<[u64]>,
}

impl Bound {
    /// Instantiates the module in a store.
    pub(crate) fn new(code: &Code, store: &mut Store<State>) -> Result<Self> {
        let instance = code.pre.instantiate(&mut *store)?;
        if let Some(name) = &code.log_memory {
            store.data_mut().memory = Some(memory(&instance, store, name)?);
        }
        if let Some(name) = &code.initialize {
            instance.get_typed_func::<(), ()>(&mut *store, name)?.call(&mut *store, ())?;
        }
        let mut functions = [const { None }; 5];
        for (to, from) in functions.iter_mut().zip(&code.functions) {
            if let Some((lifted, plan)) = from {
                *to = Some(bind(&instance, store, lifted, plan)?);
            }
        }
        let Some(execute) = &functions[Function::Execute as usize] else { bail!("there is no execute") };
        Ok(Self {
            execute: execute.function,
            memory: execute.memory,
            plan: Arc::clone(&execute.plan),
            elaborate: execute.plan.spill.is_some() || execute.post_return.is_some(),
            rest: Box::new(Rest { scratch: vec![0; execute.plan.results].into(), functions }),
        })
    }
}

fn bind(instance: &Instance, store: &mut Store<State>, lifted: &Lifted, plan: &Arc<Plan>) -> Result<BoundFunction> {
    let function = typed(instance, store, &lifted.export, &plan.core_params, plan.core_result)?;
    let pages = match &lifted.memory {
        Some(name) => Some(memory(instance, store, name)?),
        None => None,
    };
    let realloc = match &lifted.realloc {
        Some(name) => Some(typed(instance, store, name, &[Core::I32; 4], Some(Core::I32))?),
        None => None,
    };
    let post_return = match &lifted.post_return {
        Some(name) => Some(typed(instance, store, name, plan.core_result.as_slice(), None)?),
        None => None,
    };
    ensure!(!plan.needs_memory() || pages.is_some(), "{} names no memory", lifted.export);
    ensure!(plan.spill.is_none() || realloc.is_some(), "{} names no allocator", lifted.export);
    Ok(BoundFunction { plan: Arc::clone(plan), function, memory: pages, realloc, post_return })
}

/// An export with exactly this core signature.
fn typed(
    instance: &Instance,
    store: &mut Store<State>,
    name: &str,
    params: &[Core],
    result: Option<Core>,
) -> Result<Func> {
    let function = instance.get_func(&mut *store, name).ok_or_else(|| format_err!("there is no function {name}"))?;
    let ty = function.ty(&*store);
    let same = ty.params().len() == params.len()
        && ty.params().zip(params).all(|(ty, core)| core.is(&ty))
        && ty.results().len() == result.iter().count()
        && ty.results().zip(&result).all(|(ty, core)| core.is(&ty));
    ensure!(same, "{name} has the core signature {ty}");
    Ok(function)
}

fn memory(instance: &Instance, store: &mut Store<State>, name: &str) -> Result<Memory> {
    let memory = instance.get_memory(&mut *store, name).ok_or_else(|| format_err!("there is no memory {name}"))?;
    ensure!(!memory.ty(&*store).is_64(), "the memory {name} is a 64-bit one");
    Ok(memory)
}
