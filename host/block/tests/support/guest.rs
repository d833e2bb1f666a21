//! The core module behind a generated class, as WebAssembly text.
//!
//! A guest mixes every bit it receives (parameters, settings, state, how often the host called `cabi_realloc` and the
//! post-returns) into one word and derives every result from that word. A host that drops, swaps or mangles anything
//! gives other outputs. Each guest can also misbehave from a given execution on, see [`Evil`].

use super::class::{CLASS, Flat, Leaf, Signature, Spec, Ty};
use super::evil::{Evil, When};
use std::fmt::Write;

// Where things stand in the guest's only page of memory.
const LOG_TEXT: u32 = 1024;
const REFUSAL: u32 = 1100;
/// Result of every function; the next 4 KiB are its own.
pub const RESULT: u32 = 4096;
/// Parameters of the call under way, 8 bytes each.
const PARAMS: u32 = 8192;
const SETTINGS: u32 = 12288;
const STATE: u32 = 16384;
/// Parameters on the heap: reused in a circle so that memory never runs out.
const HEAP: u32 = 32768;
const PAGE: u32 = 65536;

/// What the guest says in its log.
pub const LOG_LINE: &str = "übung: level as counted";
/// Why the guest refuses settings.
pub const REFUSAL_LINE: &str = "these settings do not suit me: 20 °C is too much";

/// The core module as text.
pub fn wat(spec: &Spec, evil: Evil, when: When) -> String {
    let mut w = String::from("(module\n");
    if spec.log || evil.logs() {
        w += "(import \"latchwork:block/log@0.1.0\" \"write\" (func $log (param i32 i32 i32)))\n";
    }
    for _ in 0..evil.memories() {
        w += "(memory 1)\n";
    }
    let (pages, when) = (evil.pages(), when.0);
    let (text, refusal) = (escape(LOG_LINE), escape(REFUSAL_LINE));
    writeln!(
        w,
        r#"(memory $m (export "memory") {pages})
(data (memory $m) (i32.const {LOG_TEXT}) "{text}")
(data (memory $m) (i32.const {REFUSAL}) "{refusal}")
(global $heap (mut i32) (i32.const {HEAP}))
(global $h (mut i64) (i64.const 0))
(global $count (mut i64) (i64.const 0))
(global $posts (mut i64) (i64.const 0))
(global $reallocs (mut i64) (i64.const 0))
(func $mix (param i64)
  (global.set $h (i64.mul (i64.xor (i64.rotl (global.get $h) (i64.const 23)) (local.get 0))
    (i64.const 0x9e3779b97f4a7c15)))
  (global.set $h (i64.xor (global.get $h) (i64.shr_u (global.get $h) (i64.const 29)))))
(func $due (result i32) (i64.gt_u (global.get $count) (i64.const {when})))
(func $due-next (result i32) (i64.ge_u (global.get $count) (i64.const {when})))
{}"#,
        evil.globals()
    )
    .unwrap();
    writeln!(
        w,
        r#"(func $realloc (export "cabi_realloc") (param $old i32) (param $size i32) (param $align i32) (param $new i32)
  (result i32) (local $p i32)
  (global.set $reallocs (i64.add (global.get $reallocs) (i64.const 1)))
  {}
  (local.set $p (i32.and (i32.add (global.get $heap) (i32.sub (local.get $align) (i32.const 1)))
    (i32.sub (i32.const 0) (local.get $align))))
  (if (i32.gt_u (i32.add (local.get $p) (local.get $new)) (i32.const {PAGE}))
    (then (local.set $p (i32.const {HEAP}))))
  (global.set $heap (i32.add (local.get $p) (local.get $new)))
  (local.get $p))"#,
        evil.in_realloc()
    )
    .unwrap();
    execute(&mut w, spec, evil);
    if !spec.settings.is_empty() {
        configure(&mut w, spec, evil);
        if spec.defaults {
            let result = Ty::Record(spec.settings.clone());
            let sig = Signature { params: vec![], result: Some(result) };
            function(&mut w, spec, evil, "defaults", &sig, "", |j, leaf| {
                format!("(i64.const {})", leaf.normal(0x0123_4567_89ab_cdefu64.rotate_left(5 * j)).cast_signed())
            });
        }
    }
    if !spec.retained.is_empty() {
        let state = || Ty::Record(spec.retained.clone());
        let save = Signature { params: vec![], result: Some(state()) };
        function(&mut w, spec, evil, "save", &save, evil.in_save(), |j, _| cell(STATE, j));
        let restore = Signature { params: vec![state()], result: None };
        let body = copy(STATE, spec.retained_leaves().len());
        function(&mut w, spec, evil, "restore", &restore, &body, |_, _| String::new());
    }
    w += evil.start();
    w += ")\n";
    w
}

fn execute(w: &mut String, spec: &Spec, evil: Evil) {
    let sig = spec.execute();
    let mut body = String::from("(global.set $h (i64.const 0x517cc1b727220a95))\n");
    let mut mix = |value: &str| writeln!(body, "(call $mix {value})").unwrap();
    if spec.retained.is_empty() {
        mix("(global.get $count)");
        mix("(global.get $posts)");
        mix("(global.get $reallocs)");
    }
    for j in 0..spec.retained_leaves().len() as u32 {
        mix(&cell(STATE, j));
    }
    for j in 0..spec.setting_leaves().len() as u32 {
        mix(&cell(SETTINGS, j));
    }
    let params: Vec<Leaf> = sig.params.iter().flat_map(Ty::leaves).collect();
    for j in 0..params.len() as u32 {
        mix(&cell(PARAMS, j));
    }
    for (j, leaf) in spec.retained_leaves().into_iter().enumerate() {
        let value = normal(leaf, &derived(j as u32 + 100));
        writeln!(body, "(i64.store (i32.const {}) {value})", STATE + 8 * j as u32).unwrap();
    }
    if spec.log {
        writeln!(
            body,
            "(call $log (i32.wrap_i64 (i64.and (global.get $h) (i64.const 3))) (i32.const {LOG_TEXT}) (i32.const {}))",
            LOG_LINE.len()
        )
        .unwrap();
    }
    body += "(global.set $count (i64.add (global.get $count) (i64.const 1)))\n";
    body += &evil.in_execute();
    function(w, spec, evil, "execute", &sig, &body, |j, leaf| {
        let value = derived(j);
        // A real goes through unchanged now and then: NaN payloads must survive.
        let same = params.iter().rposition(|p| *p == leaf).filter(|_| matches!(leaf, Leaf::F32 | Leaf::F64));
        match same {
            Some(k) => format!(
                "(select {} {value} (i32.wrap_i64 (i64.and (global.get $h) (i64.const 1))))",
                cell(PARAMS, k as u32)
            ),
            None => normal(leaf, &value),
        }
    });
}

fn configure(w: &mut String, spec: &Spec, evil: Evil) {
    let leaves = spec.setting_leaves().len();
    let params = [Ty::Record(spec.settings.clone())];
    let mut body = String::from("(global.set $h (i64.const 1))\n");
    for j in 0..leaves as u32 {
        writeln!(body, "(call $mix {})", cell(PARAMS, j)).unwrap();
    }
    let (refuses, text, length) = match evil {
        Evil::RefuseLong(n) => ("(i32.const 1)", PAGE, n as usize),
        _ if spec.refuses => ("(i64.eqz (i64.and (global.get $h) (i64.const 3)))", REFUSAL, REFUSAL_LINE.len()),
        _ => ("(i32.const 0)", REFUSAL, REFUSAL_LINE.len()),
    };
    writeln!(
        body,
        "(i32.store8 (i32.const {RESULT}) {refuses})\n(i32.store (i32.const {}) (i32.const {text}))\n\
         (i32.store (i32.const {}) (i32.const {}))\n(if (i32.eqz {refuses}) (then {}))",
        RESULT + 4,
        RESULT + 8,
        length,
        copy(SETTINGS, leaves)
    )
    .unwrap();
    writeln!(
        w,
        "(func (export \"{CLASS}#configure\") {} (result i32)\n{}{body}{})",
        parameters(&params),
        prologue(&params),
        evil.answer()
    )
    .unwrap();
    post(w, spec, "configure", Flat::I32, "");
}

/// One exported function: parameters into their cells, `body`, then each result leaf from `value`.
fn function(
    w: &mut String,
    spec: &Spec,
    evil: Evil,
    name: &str,
    sig: &Signature,
    body: &str,
    value: impl Fn(u32, Leaf) -> String,
) {
    let mut leaves = Vec::new();
    let (size, _) = sig.result.as_ref().map_or((0, 1), |r| r.layout(RESULT, &mut leaves));
    let flat = match leaves[..] {
        [] => None,
        [(leaf, _)] => Some(leaf.flat()),
        _ => Some(Flat::I32),
    };
    let result = flat.map(|f| format!("(result {})", f.name())).unwrap_or_default();
    let _ = writeln!(
        w,
        "(func (export \"{CLASS}#{name}\") {} {result}\n{}{body}",
        parameters(&sig.params),
        prologue(&sig.params)
    );
    let hurt = name == "execute";
    match leaves[..] {
        [] => {}
        [(leaf, _)] => {
            let good = from_i64(leaf.flat(), &value(0, leaf));
            *w += &if hurt { evil.flat_result(leaf, &good) } else { good };
        }
        _ => {
            for (j, (leaf, at)) in leaves.iter().enumerate() {
                *w += &store(*leaf, *at, &value(j as u32, *leaf));
            }
            if hurt {
                *w += &evil.in_memory(&leaves);
                *w += &evil.pointer(size);
            } else {
                write!(w, "(i32.const {RESULT})").unwrap();
            }
        }
    }
    *w += ")\n";
    if let Some(flat) = flat {
        post(w, spec, name, flat, if hurt { evil.in_post() } else { "" });
    }
}

fn post(w: &mut String, spec: &Spec, name: &str, flat: Flat, body: &str) {
    if spec.post_return {
        let _ = writeln!(
            w,
            "(func (export \"cabi_post_{CLASS}#{name}\") (param {})\n\
             (global.set $posts (i64.add (global.get $posts) (i64.const 1)))\n{body})",
            flat.name()
        );
    }
}

/// More flat parameters than this go through memory.
const MAX_FLAT: usize = 16;

fn parameters(tys: &[Ty]) -> String {
    let leaves: Vec<Leaf> = tys.iter().flat_map(Ty::leaves).collect();
    if leaves.len() > MAX_FLAT {
        return "(param i32)".into();
    }
    leaves.iter().map(|l| format!("(param {})", l.flat().name())).collect()
}

/// Copies the parameters, as bits, into their cells.
fn prologue(tys: &[Ty]) -> String {
    let mut leaves = Vec::new();
    Ty::Record(tys.to_vec()).layout(0, &mut leaves);
    let spilled = leaves.len() > MAX_FLAT;
    let mut out = String::new();
    for (j, (leaf, at)) in leaves.iter().enumerate() {
        let value = if spilled {
            let load = match leaf {
                Leaf::S8 => "i32.load8_s",
                Leaf::S16 => "i32.load16_s",
                l if l.size() == 1 => "i32.load8_u",
                l if l.size() == 2 => "i32.load16_u",
                l if l.size() == 4 => "i32.load",
                _ => "i64.load",
            };
            let value = format!("({load} offset={at} (local.get 0))");
            if leaf.size() == 8 { value } else { format!("(i64.extend_i32_u {value})") }
        } else {
            match leaf.flat() {
                Flat::I32 => format!("(i64.extend_i32_u (local.get {j}))"),
                Flat::I64 => format!("(local.get {j})"),
                Flat::F32 => format!("(i64.extend_i32_u (i32.reinterpret_f32 (local.get {j})))"),
                Flat::F64 => format!("(i64.reinterpret_f64 (local.get {j}))"),
            }
        };
        writeln!(out, "(i64.store (i32.const {}) {value})", PARAMS + 8 * j as u32).unwrap();
    }
    out
}

fn cell(base: u32, j: u32) -> String {
    format!("(i64.load (i32.const {}))", base + 8 * j)
}

fn copy(to: u32, n: usize) -> String {
    format!("(memory.copy (i32.const {to}) (i32.const {PARAMS}) (i32.const {}))\n", 8 * n)
}

/// A word of result number `j`, from the mixed word.
fn derived(j: u32) -> String {
    let odd = 0xd6e8_feb8_6659_fd93u64.wrapping_mul(2 * u64::from(j) + 1);
    format!("(i64.rotl (i64.mul (global.get $h) (i64.const {})) (i64.const {}))", odd.cast_signed(), 7 * j % 64)
}

/// `Leaf::normal` in WebAssembly: an i64 whose bits are a legal cell.
fn normal(leaf: Leaf, value: &str) -> String {
    let and = |mask: u64| format!("(i64.and {value} (i64.const {mask}))");
    let signed = |op: &str| format!("(i64.extend_i32_u ({op} (i32.wrap_i64 {value})))");
    match leaf {
        Leaf::Bool => and(1),
        Leaf::U8 => and(0xff),
        Leaf::U16 => and(0xffff),
        Leaf::U32 | Leaf::S32 | Leaf::F32 => and(0xffff_ffff),
        Leaf::S8 => signed("i32.extend8_s"),
        Leaf::S16 => signed("i32.extend16_s"),
        Leaf::U64 | Leaf::S64 | Leaf::F64 => value.into(),
        Leaf::Enum(n) => format!("(i64.rem_u {value} (i64.const {n}))"),
        Leaf::Flags(n) => and((1 << n) - 1),
    }
}

fn from_i64(flat: Flat, value: &str) -> String {
    match flat {
        Flat::I32 => format!("(i32.wrap_i64 {value})"),
        Flat::I64 => value.into(),
        Flat::F32 => format!("(f32.reinterpret_i32 (i32.wrap_i64 {value}))"),
        Flat::F64 => format!("(f64.reinterpret_i64 {value})"),
    }
}

/// Stores an i64's low bits as `leaf`.
pub fn store(leaf: Leaf, at: u32, value: &str) -> String {
    match leaf.size() {
        1 => format!("(i64.store8 (i32.const {at}) {value})\n"),
        2 => format!("(i64.store16 (i32.const {at}) {value})\n"),
        4 => format!("(i64.store32 (i32.const {at}) {value})\n"),
        _ => format!("(i64.store (i32.const {at}) {value})\n"),
    }
}

fn escape(text: &str) -> String {
    text.bytes().map(|b| format!("\\{b:02x}")).collect()
}
