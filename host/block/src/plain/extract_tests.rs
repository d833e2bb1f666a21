//! What the plain path takes and what it leaves to the component path, and that both are told apart by structure.

use super::extract;
use crate::interface;

const LOG: &str = r#"
    (import "latchwork:block/log@0.1.0" (instance $log
        (type $l (enum "debug" "info" "warning" "error")) (export "level" (type $level (eq $l)))
        (export "write" (func (param "level" $level) (param "message" string)))))"#;

const SHIM: &str = r#"
    (core module $shim-module (type $t (func (param i32 i32 i32))) (table (export "$imports") 1 1 funcref)
        (func (export "0") (type $t) local.get 0 local.get 1 local.get 2 i32.const 0 call_indirect (type $t)))
    (core instance $shim (instantiate $shim-module))
    (core instance $main (instantiate $main-module (with "latchwork:block/log@0.1.0" (instance
        (export "write" (func $shim "0"))))))"#;

const FIXUP: &str = r#"
    (core func $write (canon lower (func $log "write") (memory (core memory $main "memory"))))
    (core module $fixup-module (import "" "0" (func (param i32 i32 i32))) (import "" "$imports" (table 1 1 funcref))
        (elem (i32.const 0) func 0))
    (core instance $fixup (instantiate $fixup-module (with "" (instance
        (export "0" (func $write)) (export "$imports" (table $shim "$imports"))))))"#;

const STARTER: &str = r#"
    (core module $starter-module (import "" "" (func)) (start 0))
    (core instance $starter (instantiate $starter-module (with "" (instance (export "" (func $main "init"))))))"#;

const LIFT: &str = r#"
    (func $execute (type $execute-type) (canon lift (core func $main "execute")))"#;

/// A component whose main module has these fields, with these parts after it.
fn component(main: &str, parts: &[&str]) -> Vec<u8> {
    let before = if parts.contains(&FIXUP) { LOG } else { "" };
    let text = format!(
        r#"(component {before}
            (core module $main-module {main}
                (memory (export "memory") 1) (func (export "init"))
                (func (export "execute") (param i64 i64 i32)))
            {}
            (instance $class (export "execute" (func $execute)))
            (export "test:block/class" (instance $class)))"#,
        parts.concat()
    );
    wat::parse_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

const TYPES: &str = r#"
    (type $s (record (field "now" u64) (field "elapsed" u64) (field "first" bool)))
    (export $scan "scan" (type $s))
    (type $execute-type (func (param "scan" $scan)))"#;
const ALONE: &str = "(core instance $main (instantiate $main-module))";
const IMPORT: &str = r#"(import "latchwork:block/log@0.1.0" "write" (func (param i32 i32 i32)))"#;

/// The name of the initialiser and the number of imports, or why not.
fn plain(bytes: &[u8]) -> Result<(Option<String>, usize), String> {
    let interface = interface::read(bytes).unwrap_or_else(|e| panic!("{e}"));
    extract(bytes, &interface.classes[0]).map(|e| (e.initialize, e.logs.len()))
}

#[test]
fn one_module_with_or_without_a_log_and_an_initialiser_is_plain() {
    assert_eq!(plain(&component("", &[TYPES, ALONE, LIFT])), Ok((None, 0)));
    assert_eq!(plain(&component("", &[TYPES, ALONE, STARTER, LIFT])), Ok((Some("init".into()), 0)));
    assert_eq!(plain(&component(IMPORT, &[TYPES, SHIM, FIXUP, LIFT])), Ok((None, 1)));
    assert_eq!(plain(&component(IMPORT, &[TYPES, SHIM, FIXUP, STARTER, LIFT])), Ok((Some("init".into()), 1)));
}

#[test]
fn everything_else_is_left_to_the_component_path_with_a_reason() {
    let starts_early = format!("{IMPORT} (func $early) (start $early)");
    let other_memory = FIXUP.replace(r#"$main "memory""#, r#"$other "memory""#);
    let other = r#"(core module $om (memory (export "memory") 1)) (core instance $other (instantiate $om))"#;
    let adapter = SHIM.replace(
        "(core instance $main",
        r#"(core module $am (func (export "write") (param i32 i32 i32))) (core instance $adapter (instantiate $am))
           (core instance $main"#,
    );
    let adapter = adapter.replace(r#"(func $shim "0")"#, r#"(func $adapter "write")"#);
    let busy = SHIM.replace("i32.const 0 call_indirect", "nop i32.const 0 call_indirect");
    let nested = r#"(component $n (core module $m) (core instance (instantiate $m))) (instance (instantiate $n))"#;
    let lifts_other = LIFT.replace("$main", "$other");
    let other_execute =
        r#"(core module $om (func (export "execute") (param i64 i64 i32))) (core instance $other (instantiate $om))"#;
    let utf16 = LIFT.replace(r#""execute"))"#, r#""execute") string-encoding=utf16)"#);
    for (bytes, reason) in [
        (component(&starts_early, &[TYPES, SHIM, FIXUP, LIFT]), "start function"),
        (component(IMPORT, &[TYPES, other, &adapter, FIXUP, LIFT]), "something else than the log"),
        (component(IMPORT, &[TYPES, &busy, FIXUP, LIFT]), "something else than the log"),
        (component("", &[TYPES, ALONE, other, LIFT]), "several core modules"),
        (component("", &[TYPES, ALONE, nested, LIFT]), "composed of several components"),
        (component("", &[TYPES, ALONE, other_execute, &lifts_other]), "several core modules"),
        (component("", &[TYPES, ALONE, &utf16]), "canonical option UTF16"),
    ] {
        let why = plain(&bytes).unwrap_err();
        assert!(why.contains(reason), "{why} (expected: {reason})");
    }
    // The log works on a memory that is not main's.
    let text = [TYPES, other, SHIM, &other_memory, LIFT].concat();
    let text = format!(
        r#"(component {LOG} (core module $main-module {IMPORT} (memory (export "memory") 1)
            (func (export "execute") (param i64 i64 i32))) {text}
            (instance $class (export "execute" (func $execute))) (export "test:block/class" (instance $class)))"#
    );
    let why = plain(&wat::parse_str(text).unwrap()).unwrap_err();
    assert!(why.contains("memory of another core module"), "{why}");
}
