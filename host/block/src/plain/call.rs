//! One call on the plain path.
//!
//! Every check is the component API's: alignment and bounds of pointers, cases of enums; excess flag bits are dropped, any
//! non-zero byte is true, strings must be UTF-8. Results reach the cells only when nothing can fail any more.

use super::bind::{Bound, BoundFunction};
use super::plan::{Kind, Leaf, ResultPlan};
use crate::Scan;
use crate::instance::Returned;
use crate::interface::Function;
use crate::state::State;
use std::mem::MaybeUninit;
use wasmtime::component::Val;
use wasmtime::{Func, Memory, Result, Store, ValRaw, bail, ensure, format_err};

/// Most arguments of a core function: 16 flat values.
const ARGS: usize = 16;

/// Arguments of a call, and after it its result.
struct Slots([MaybeUninit<ValRaw>; ARGS]);

impl Slots {
    #[inline]
    fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; ARGS])
    }

    #[inline]
    fn set(&mut self, index: usize, cell: u64) {
        self.0[index].write(ValRaw::u64(cell));
    }

    /// Calls `function`.
    ///
    /// # Safety
    /// As many slots are set as the function has parameters, at least one if it has a result.
    #[inline]
    unsafe fn call(&mut self, function: &Func, store: &mut Store<State>) -> Result<()> {
        let slots = std::ptr::slice_from_raw_parts_mut(self.0.as_mut_ptr().cast::<ValRaw>(), ARGS);
        // SAFETY: `bind` checked that the function belongs to an instance of this store and has the core signature of the
        // plan, which has at most `ARGS` parameters and one result, all numbers; a number may have any bits.
        unsafe { function.call_unchecked(store, slots) }
    }

    /// The result, the first slot.
    ///
    /// # Safety
    /// A function with a result was called.
    #[inline]
    unsafe fn result(&self) -> ValRaw {
        // SAFETY: as promised by the caller.
        unsafe { self.0[0].assume_init() }
    }
}

impl Bound {
    /// See [`crate::Instance::execute`].
    #[inline]
    pub(crate) fn execute(
        &mut self,
        store: &mut Store<State>,
        scan: Scan,
        ins: &[u32],
        out: u32,
        cells: &mut [u64],
    ) -> Result<()> {
        let plan = &*self.plan;
        assert_eq!(ins.len() + 3, plan.params.len(), "one index per argument cell");
        let out = out as usize..out as usize + plan.results;
        assert!(out.end <= cells.len(), "cells for all outputs");
        if self.elaborate {
            return self.execute_elaborate(store, scan, ins, out, cells);
        }
        let mut slots = Slots::new();
        slots.set(0, scan.now);
        slots.set(1, scan.elapsed);
        slots.set(2, u64::from(scan.first));
        for (slot, cell) in slots.0[3..].iter_mut().zip(ins) {
            slot.write(ValRaw::u64(cells[*cell as usize]));
        }
        // SAFETY: all parameters are set; the first slot always.
        unsafe { slots.call(&self.execute, store)? };
        match &plan.result {
            ResultPlan::Memory { size, align, moves, checks } => {
                // SAFETY: the function has a result, the pointer.
                let pointer = unsafe { slots.result() }.get_u32();
                let bytes = result_bytes(self.memory.as_ref(), store, pointer, *size, *align)?;
                check(checks, bytes)?;
                for (cell, leaf) in cells[out].iter_mut().zip(moves) {
                    *cell = leaf.load(bytes);
                }
            }
            ResultPlan::Flat(leaf) => {
                // SAFETY: the function has a result, the value.
                cells[out.start] = flat(*leaf, unsafe { slots.result() })?;
            }
            ResultPlan::Nothing | ResultPlan::Refusal => {}
        }
        Ok(())
    }

    /// An execution with arguments in memory or with cleaning up.
    fn execute_elaborate(
        &mut self,
        store: &mut Store<State>,
        scan: Scan,
        ins: &[u32],
        out: std::ops::Range<usize>,
        cells: &mut [u64],
    ) -> Result<()> {
        let rest = &mut *self.rest;
        let Some(execute) = &rest.functions[Function::Execute as usize] else { bail!("there is no execute") };
        let times = [scan.now, scan.elapsed, u64::from(scan.first)];
        let values = times.into_iter().chain(ins.iter().map(|i| cells[*i as usize]));
        execute.call(store, values, &mut rest.scratch)?;
        cells[out].copy_from_slice(&rest.scratch);
        Ok(())
    }

    /// Any function but `execute`; the cells of its result are left in `to`.
    pub(crate) fn call(
        &mut self,
        store: &mut Store<State>,
        function: Function,
        args: &[u64],
        to: &mut [u64],
    ) -> Result<Returned> {
        let Some(f) = &self.rest.functions[function as usize] else { return Ok(Returned::Absent) };
        assert_eq!(to.len(), f.plan.results, "one cell per cell of the result");
        let refusal = f.call(store, args.iter().copied(), to)?;
        Ok(refusal.and_then(std::result::Result::err).map_or(Returned::Done, Returned::Refused))
    }
}

impl BoundFunction {
    /// Calls a function with any plan. The cells of the result are left in `to`, a refusal is returned.
    fn call(
        &self,
        store: &mut Store<State>,
        values: impl Iterator<Item = u64>,
        to: &mut [u64],
    ) -> Result<Option<std::result::Result<(), String>>> {
        let plan = &*self.plan;
        let mut slots = Slots::new();
        slots.set(0, 0);
        match plan.spill {
            None => {
                let mut set = 0;
                for (index, value) in values.enumerate().take(plan.params.len()) {
                    slots.set(index, value);
                    set += 1;
                }
                assert_eq!(set, plan.params.len(), "one value per argument");
            }
            Some((size, align)) => {
                let pointer = self.room(store, size, align)?;
                let Some(bytes) = self.memory.and_then(|m| slice_mut(m.data_mut(&mut *store), pointer, size)) else {
                    bail!("realloc return: beyond end of memory")
                };
                for (leaf, value) in plan.params.iter().zip(values) {
                    leaf.store(value, bytes);
                }
                slots.set(0, pointer.into());
            }
        }
        // SAFETY: all parameters are set; the first slot always.
        unsafe { slots.call(&self.function, store)? };
        if plan.core_result.is_none() {
            return self.clean_up(store, slots).map(|()| None);
        }
        // SAFETY: the function has a result.
        let result = unsafe { slots.result() };
        let mut refusal = None;
        match &plan.result {
            ResultPlan::Nothing => {}
            ResultPlan::Flat(leaf) => to[0] = flat(*leaf, result)?,
            ResultPlan::Memory { size, align, moves, checks } => {
                let bytes = result_bytes(self.memory.as_ref(), store, result.get_u32(), *size, *align)?;
                check(checks, bytes)?;
                for (cell, leaf) in to.iter_mut().zip(moves) {
                    *cell = leaf.load(bytes);
                }
            }
            ResultPlan::Refusal => {
                refusal = Some(self.refusal(store, result.get_u32())?);
            }
        }
        self.clean_up(store, slots)?;
        Ok(refusal)
    }

    /// Asks the block for room in its memory.
    fn room(&self, store: &mut Store<State>, size: u32, align: u32) -> Result<u32> {
        let Some(realloc) = &self.realloc else { bail!("there is no allocator") };
        let mut slots = Slots::new();
        for (index, value) in [0, 0, align, size].into_iter().enumerate() {
            slots.set(index, value.into());
        }
        store.data_mut().may_leave = false;
        // SAFETY: `bind` checked that an allocator has four parameters and a result; all four are set.
        let pointer = unsafe {
            slots.call(realloc, store)?;
            slots.result()
        };
        store.data_mut().may_leave = true;
        let pointer = pointer.get_u32();
        ensure!(pointer & (align - 1) == 0, "realloc return: result not aligned");
        Ok(pointer)
    }

    /// Tells the block that its result was read.
    fn clean_up(&self, store: &mut Store<State>, mut slots: Slots) -> Result<()> {
        let Some(post_return) = &self.post_return else { return Ok(()) };
        store.data_mut().may_leave = false;
        // SAFETY: its only parameter, if any, is the result, which stands in the first slot; `bind` checked this.
        unsafe { slots.call(post_return, store)? };
        store.data_mut().may_leave = true;
        Ok(())
    }

    /// Reads a `result<_, string>`: discriminant, pointer, length.
    fn refusal(&self, store: &Store<State>, pointer: u32) -> Result<std::result::Result<(), String>> {
        let bytes = result_bytes(self.memory.as_ref(), store, pointer, 12, 4)?;
        match bytes[0] {
            0 => return Ok(Ok(())),
            1 => {}
            other => bail!("discriminant {other} out of range [0..2)"),
        }
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let memory = self.memory.map(|m| m.data(store)).unwrap_or_default();
        let text = slice(memory, word(4), word(8))
            .ok_or_else(|| format_err!("string pointer/length out of bounds of memory"))?;
        // The component API counts the value itself, too.
        ensure!(text.len() + size_of::<Val>() <= store.data().fuel, "a sentence of {} bytes", text.len());
        Ok(Err(std::str::from_utf8(text)?.to_string()))
    }
}

/// The memory that a result pointer names. The memory is looked up in every call: it moves when it grows.
#[inline]
fn result_bytes<'a>(
    memory: Option<&Memory>,
    store: &'a Store<State>,
    pointer: u32,
    size: u32,
    align: u32,
) -> Result<&'a [u8]> {
    if pointer & (align - 1) != 0 {
        bail!("return pointer not aligned");
    }
    let memory = memory.map(|m| m.data(store)).unwrap_or_default();
    match slice(memory, pointer, size) {
        Some(bytes) => Ok(bytes),
        None => bail!("pointer out of bounds of memory"),
    }
}

/// `size` bytes from `pointer` on.
#[inline]
pub(super) fn slice(memory: &[u8], pointer: u32, size: u32) -> Option<&[u8]> {
    memory.get(pointer as usize..)?.get(..size as usize)
}

fn slice_mut(memory: &mut [u8], pointer: u32, size: u32) -> Option<&mut [u8]> {
    memory.get_mut(pointer as usize..)?.get_mut(..size as usize)
}

/// Checks all enums of a result before any cell is written.
#[inline]
fn check(checks: &[Leaf], bytes: &[u8]) -> Result<()> {
    for leaf in checks {
        case(*leaf, leaf.load(bytes))?;
    }
    Ok(())
}

#[inline]
fn case(leaf: Leaf, discriminant: u64) -> Result<()> {
    if discriminant >= leaf.limit.into() {
        bail!("discriminant {discriminant} out of range [0..{})", leaf.limit);
    }
    Ok(())
}

/// The cell of a result that is one flat value.
fn flat(leaf: Leaf, value: ValRaw) -> Result<u64> {
    // 32-bit results leave the upper half of their slot undefined.
    let bits = if leaf.kind == Kind::W64 { value.get_u64() } else { value.get_u32().into() };
    if matches!(leaf.kind, Kind::Enum8 | Kind::Enum16 | Kind::Enum32) {
        case(leaf, bits)?;
    }
    Ok(leaf.lift_flat(bits))
}
