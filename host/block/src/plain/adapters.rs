//! Recognises the small modules that the component tools put around a main module.
//!
//! A module's imports need its memory, and its memory exists only after it was instantiated. So the tools let it import
//! from a *shim*, whose functions call through a table; a *fixup* fills the table with the lowered imports afterwards; a
//! *starter* runs the module's `_initialize`. Only modules of exactly these shapes are recognised.

use super::outline::unreadable;
use std::collections::HashMap;
use wasmparser::{
    ConstExpr, ElementItems, ElementKind, ExternalKind, FunctionBody, Operator, Parser, Payload, TypeRef,
};

/// The exports of a shim.
pub(super) struct Shim<'a> {
    /// Slot of the table that each function calls.
    pub(super) slots: HashMap<&'a str, u32>,
    /// Name of the table.
    pub(super) table: &'a str,
}

/// What a fixup or starter does.
pub(super) enum Helper<'a> {
    /// Fills the imported table, from slot 0 on, with imported functions.
    Fixup {
        /// The table's import.
        table: (&'a str, &'a str),
        /// The functions' imports.
        functions: Vec<(&'a str, &'a str)>,
    },
    /// Calls an imported function when it is instantiated.
    Starter((&'a str, &'a str)),
}

/// Reads a shim; `None` if the module is none.
pub(super) fn shim(module: &[u8]) -> Result<Option<Shim<'_>>, String> {
    let (mut exports, mut table, mut tables, mut slots) = (Vec::new(), None, 0, Vec::new());
    for payload in Parser::new(0).parse_all(module) {
        match payload.map_err(unreadable)? {
            Payload::Version { .. }
            | Payload::TypeSection(_)
            | Payload::FunctionSection(_)
            | Payload::CodeSectionStart { .. }
            | Payload::CustomSection(_)
            | Payload::End(_) => {}
            Payload::TableSection(section) => tables += section.count(),
            Payload::ExportSection(section) => {
                for export in section {
                    let export = export.map_err(unreadable)?;
                    match export.kind {
                        ExternalKind::Func => exports.push((export.name, export.index)),
                        ExternalKind::Table => table = Some(export.name),
                        _ => return Ok(None),
                    }
                }
            }
            Payload::CodeSectionEntry(body) => match slot(&body)? {
                Some(slot) => slots.push(slot),
                None => return Ok(None),
            },
            _ => return Ok(None),
        }
    }
    let (1, Some(table)) = (tables, table) else { return Ok(None) };
    let slots: Option<_> = exports.into_iter().map(|(n, f)| Some((n, *slots.get(f as usize)?))).collect();
    Ok(slots.map(|slots| Shim { slots, table }))
}

/// The slot that a body calls with its own arguments, if that is all it does.
fn slot(body: &FunctionBody<'_>) -> Result<Option<u32>, String> {
    if body.get_locals_reader().map_err(unreadable)?.get_count() != 0 {
        return Ok(None);
    }
    let (mut args, mut slot, mut called, mut ended) = (0, None, false, false);
    for operator in body.get_operators_reader().map_err(unreadable)? {
        match operator.map_err(unreadable)? {
            Operator::LocalGet { local_index } if local_index == args && slot.is_none() => args += 1,
            Operator::I32Const { value } if slot.is_none() => slot = Some(value.cast_unsigned()),
            Operator::CallIndirect { table_index: 0, .. } if slot.is_some() && !called => called = true,
            Operator::End if called && !ended => ended = true,
            _ => return Ok(None),
        }
    }
    Ok(slot.filter(|_| ended))
}

/// Reads a fixup or a starter; `None` if the module is neither.
pub(super) fn helper(module: &[u8]) -> Result<Option<Helper<'_>>, String> {
    let (mut functions, mut tables, mut segments, mut start) = (Vec::new(), Vec::new(), Vec::new(), None);
    for payload in Parser::new(0).parse_all(module) {
        match payload.map_err(unreadable)? {
            Payload::Version { .. } | Payload::TypeSection(_) | Payload::CustomSection(_) | Payload::End(_) => {}
            Payload::StartSection { func, .. } => start = Some(func),
            Payload::ImportSection(section) => {
                for import in section.into_imports() {
                    let import = import.map_err(unreadable)?;
                    match import.ty {
                        TypeRef::Func(_) => functions.push((import.module, import.name)),
                        TypeRef::Table(_) => tables.push((import.module, import.name)),
                        _ => return Ok(None),
                    }
                }
            }
            Payload::ElementSection(section) => {
                for element in section {
                    let element = element.map_err(unreadable)?;
                    match (element.kind, element.items) {
                        (
                            ElementKind::Active { table_index: None | Some(0), offset_expr },
                            ElementItems::Functions(indices),
                        ) if is_zero(&offset_expr)? => {
                            segments.push(indices.into_iter().collect::<Result<Vec<_>, _>>().map_err(unreadable)?);
                        }
                        _ => return Ok(None),
                    }
                }
            }
            _ => return Ok(None),
        }
    }
    Ok(match (&tables[..], &segments[..], start) {
        ([table], [segment], None) => {
            let filled: Option<_> = segment.iter().map(|f| functions.get(*f as usize).copied()).collect();
            filled.map(|functions| Helper::Fixup { table: *table, functions })
        }
        ([], [], Some(start)) if functions.len() == 1 && start == 0 => Some(Helper::Starter(functions[0])),
        _ => None,
    })
}

fn is_zero(offset: &ConstExpr<'_>) -> Result<bool, String> {
    let mut operators = offset.get_operators_reader();
    let first = operators.read().map_err(unreadable)?;
    let second = operators.read().map_err(unreadable)?;
    Ok(matches!((first, second), (Operator::I32Const { value: 0 }, Operator::End)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn module(text: &str) -> Vec<u8> {
        wat::parse_str(text).expect("a module")
    }

    #[test]
    fn a_shim_only_hands_its_arguments_on() {
        let text = |body: &str| {
            module(&format!(
                r#"(module (type $t (func (param i32 i32)))
                    (table (export "$imports") 2 funcref)
                    (func (export "0") (type $t) local.get 0 local.get 1 i32.const 1 call_indirect (type $t))
                    (func (export "1") (type $t) {body}))"#
            ))
        };
        let good = text("local.get 0 local.get 1 i32.const 0 call_indirect (type $t)");
        let shim = shim(&good).unwrap().expect("a shim");
        assert_eq!((shim.slots["0"], shim.slots["1"], shim.table), (1, 0, "$imports"));
        for bad in [
            "local.get 1 local.get 0 i32.const 0 call_indirect (type $t)",
            "unreachable",
            "local.get 0 local.get 1 i32.const 0 i32.const 1 i32.add call_indirect (type $t)",
            "local.get 0 local.get 1 i32.const 0 call_indirect (type $t) nop",
            "(local i32) local.get 0 local.get 1 i32.const 0 call_indirect (type $t)",
            "",
        ] {
            assert!(super::shim(&text(bad)).unwrap().is_none(), "{bad}");
        }
    }

    #[test]
    fn fixups_and_starters_do_nothing_else() {
        let fixup = module(
            r#"(module (import "" "0" (func)) (import "" "1" (func)) (import "" "t" (table 2 funcref))
                (elem (i32.const 0) func 1 0))"#,
        );
        match helper(&fixup).unwrap() {
            Some(Helper::Fixup { table, functions }) => {
                assert_eq!(table, ("", "t"));
                assert_eq!(functions, [("", "1"), ("", "0")]);
            }
            _ => panic!("no fixup"),
        }
        let starter = module(r#"(module (import "" "" (func)) (start 0))"#);
        assert!(matches!(helper(&starter).unwrap(), Some(Helper::Starter(("", "")))));
        for bad in [
            r#"(module (import "" "0" (func)) (import "" "t" (table 2 funcref)) (elem (i32.const 1) func 0))"#,
            r#"(module (import "" "0" (func)) (import "" "t" (table 2 funcref)) (elem (i32.const 0) func 0) (start 0))"#,
            r#"(module (import "" "0" (func)) (import "" "1" (func)) (start 1))"#,
            r#"(module (func) (start 0))"#,
            r#"(module (import "" "m" (memory 1)))"#,
            "(module)",
        ] {
            assert!(helper(&module(bad)).unwrap().is_none(), "{bad}");
        }
    }
}
