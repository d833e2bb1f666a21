//! State over many versions.

use super::{cells, config, record, ty};
use crate::Port;
use crate::upgrade::{Fate, Transfer, schema};
use latchwork_image::{Type, Value};
use proptest::prelude::*;
use std::collections::HashMap;

/// Least and greatest value of an integer type.
fn range(ty: &Type) -> Option<(i128, i128)> {
    Some(match ty {
        Type::U8 => (0, u8::MAX.into()),
        Type::U16 => (0, u16::MAX.into()),
        Type::U32 => (0, u32::MAX.into()),
        Type::U64 => (0, u64::MAX.into()),
        Type::S8 => (i8::MIN.into(), i8::MAX.into()),
        Type::S16 => (i16::MIN.into(), i16::MAX.into()),
        Type::S32 => (i32::MIN.into(), i32::MAX.into()),
        Type::S64 => (i64::MIN.into(), i64::MAX.into()),
        _ => return None,
    })
}

fn is_real(ty: &Type) -> bool {
    matches!(ty, Type::F32 | Type::F64)
}

/// What the model says of two types.
#[derive(Debug, PartialEq)]
enum Verdict {
    OtherKind,
    Exact,
    Lossy,
}

fn verdict(old: &Type, new: &Type) -> Verdict {
    let exact = |yes| if yes { Verdict::Exact } else { Verdict::Lossy };
    match (old, new) {
        (old, new) if old == new => Verdict::Exact,
        (Type::Duration, Type::U64) | (Type::U64, Type::Duration) => Verdict::Exact,
        (Type::Enum(a), Type::Enum(b)) | (Type::Flags(a), Type::Flags(b)) => exact(a.iter().all(|n| b.contains(n))),
        (old, new) => match (range(old), range(new)) {
            (Some(old), Some(new)) => exact(new.0 <= old.0 && old.1 <= new.1),
            (Some(_), None) if *new == Type::F32 => exact(matches!(old, Type::U8 | Type::S8 | Type::U16 | Type::S16)),
            (Some(_), None) if *new == Type::F64 => exact(!matches!(old, Type::U64 | Type::S64)),
            (Some(_), None) => Verdict::OtherKind,
            (None, new_range) if is_real(old) => match new_range {
                Some(_) => Verdict::Lossy,
                None if is_real(new) => exact(*new == Type::F64),
                None => Verdict::OtherKind,
            },
            _ => Verdict::OtherKind,
        },
    }
}

/// The value of `old` as one of `new`, by what a person reads; `start` where nothing is left.
fn carry(old: &Type, cell: u64, new: &Type, start: u64) -> u64 {
    let number = |value: i128| match range(new) {
        Some((least, greatest)) => new.cell_from_integer(value.clamp(least, greatest)),
        None => new.cell_from_integer(value),
    };
    match (old, old.value(cell)) {
        _ if old == new || *old == Type::Duration || *new == Type::Duration => cell,
        (_, Value::Integer(value)) => number(value.into()).expect("it is clamped"),
        (_, Value::Real(_)) => {
            let value = if *old == Type::F32 { f32::from_bits(cell as u32).into() } else { f64::from_bits(cell) };
            match new {
                Type::F64 => value.to_bits(),
                Type::F32 if value.is_finite() => {
                    u64::from((value.clamp(f32::MIN.into(), f32::MAX.into()) as f32).to_bits())
                }
                Type::F32 => u64::from((value as f32).to_bits()),
                _ => number(if value.is_nan() { 0 } else { value.trunc() as i128 }).expect("it is clamped"),
            }
        }
        (Type::Flags(_), Value::Text(set)) => {
            let Type::Flags(names) = new else { panic!("{old} → {new}") };
            let left: Vec<&str> = set.split('|').filter(|n| names.iter().any(|m| m == n)).collect();
            new.parse(&left.join("|")).expect("only known names are left")
        }
        (_, Value::Text(case)) => new.parse(&case).unwrap_or(start),
        other => panic!("{other:?} → {new}"),
    }
}

/// NaN survives as NaN; which of them is the processor's business.
fn same(ty: &Type, a: u64, b: u64) -> bool {
    let nan = |cell| matches!(ty.value(cell), Value::Real(r) if r.is_nan());
    a == b || nan(a) && nan(b)
}

fn is_exact(fate: &Fate) -> bool {
    matches!(fate, Fate::Carried | Fate::Converted { .. })
}

fn versions() -> impl Strategy<Value = Vec<(Vec<Port>, bool)>> {
    prop::collection::vec((record(), prop::bool::weighted(0.3)), 10)
}

proptest! {
    #![proptest_config(config())]

    /// Ten versions, fields added, removed, retyped and reordered: what is carried survives, what is new starts as the version
    /// starts, and nothing is lost without leave.
    #[test]
    fn a_state_survives_chains_of_upgrades(versions in versions(), seeds in prop::collection::vec(any::<u64>(), 80)) {
        let mut ports: Vec<Port> = Vec::new();
        let mut state: Vec<u64> = Vec::new();
        let mut model: HashMap<String, (Type, u64)> = HashMap::new();
        for ((version, lossy), seed) in versions.into_iter().zip(seeds.chunks(8)) {
            let transfer = Transfer::new(&ports, &version, lossy);
            let starts = cells(&version, seed);
            let mut next = starts.clone();
            transfer.apply(&state, &mut next);
            prop_assert_eq!(lossy && transfer.refused().count() > 0, false);
            let mut expected = HashMap::new();
            for (at, port) in version.iter().enumerate() {
                let (fate, start) = (&transfer.fields()[at].fate, starts[at]);
                let value = match model.get(&port.path) {
                    Some((ty, cell)) => match verdict(ty, &port.ty) {
                        Verdict::OtherKind => {
                            prop_assert_eq!(fate, &Fate::New);
                            start
                        }
                        Verdict::Exact => {
                            prop_assert_eq!(matches!(fate, Fate::Carried), *ty == port.ty);
                            prop_assert!(is_exact(fate));
                            carry(ty, *cell, &port.ty, start)
                        }
                        Verdict::Lossy => {
                            let Fate::Lossy { allowed, .. } = fate else { panic!("{fate:?}") };
                            prop_assert_eq!(*allowed, lossy);
                            if lossy { carry(ty, *cell, &port.ty, start) } else { start }
                        }
                    },
                    None => {
                        prop_assert_eq!(fate, &Fate::New);
                        start
                    }
                };
                prop_assert!(same(&port.ty, next[at], value), "{}: {:#x}, not {:#x}", port.path, next[at], value);
                expected.insert(port.path.clone(), (port.ty.clone(), value));
            }
            // Every field of the old version is either told of above or dropped.
            let dropped = transfer.fields()[version.len()..].iter().inspect(|f| assert_eq!(f.fate, Fate::Dropped)).count();
            let kept = |f: &crate::upgrade::Field| f.fate != Fate::New;
            prop_assert_eq!(transfer.fields()[..version.len()].iter().filter(|f| kept(f)).count() + dropped, ports.len());
            (ports, state, model) = (version, next, expected);
        }
    }

    /// What a wider type took gives back what it was.
    #[test]
    fn a_widened_value_comes_back(old in ty(), others in prop::collection::vec(ty(), 24), bits: u64) {
        let port = |ty: &Type| [Port { path: "x".into(), ty: ty.clone(), signal: false, doc: None }];
        for new in others {
            let there = Transfer::new(&port(&old), &port(&new), false);
            let back = Transfer::new(&port(&new), &port(&old), true);
            if !is_exact(&there.fields()[0].fate) {
                continue;
            }
            let value = super::cell(&old, bits);
            let (mut wide, mut result) = ([0], [!value]);
            there.apply(&[value], &mut wide);
            back.apply(&wide, &mut result);
            prop_assert!(same(&old, result[0], value), "{old} → {new}: {value:#x} → {:#x} → {:#x}", wide[0], result[0]);
        }
    }

    /// The schema tells versions apart exactly where their cells differ.
    #[test]
    fn equal_schemas_are_equal_records(a in record(), b in record()) {
        let same = a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (&a.path, &a.ty) == (&b.path, &b.ty));
        prop_assert_eq!(schema(&a) == schema(&b), same);
        prop_assert_eq!(schema(&a), schema(&a.clone()));
    }
}
