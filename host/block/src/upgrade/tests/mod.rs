//! Properties of upgrades, each against a naive model that knows names and texts but no cells.

mod chains;
mod mappings;

use crate::Port;
use latchwork_image::Type;
use proptest::prelude::*;

/// As many cases everywhere; a failure prints its smallest case, which then becomes a test with a name.
fn config() -> ProptestConfig {
    ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() }
}

/// Some of six names in any order.
fn names() -> impl Strategy<Value = std::sync::Arc<[String]>> {
    let all: Vec<String> = ["off", "on", "auto", "hand", "fault", "test"].map(String::from).into();
    prop::sample::subsequence(all, 1..=6).prop_shuffle().prop_map(Into::into)
}

fn ty() -> impl Strategy<Value = Type> {
    use Type::{Bool, Duration, F32, F64, S8, S16, S32, S64, U8, U16, U32, U64};
    prop_oneof![
        3 => prop::sample::select(vec![Bool, U8, U16, U32, U64, S8, S16, S32, S64, F32, F64, Duration]),
        1 => names().prop_map(Type::Enum),
        1 => names().prop_map(Type::Flags),
    ]
}

/// A record of at most eight fields, in any order, of names that other records have, too.
fn record() -> impl Strategy<Value = Vec<Port>> {
    let all: Vec<&str> = vec!["starts", "hours", "mode", "set", "a.x", "a.y", "b", "c"];
    let paths = prop::sample::subsequence(all, 0..=8).prop_shuffle();
    (paths, prop::collection::vec(ty(), 8)).prop_map(|(paths, types)| {
        let port = |(path, ty): (&str, Type)| Port { path: path.into(), ty, signal: false, doc: None };
        paths.into_iter().zip(types).map(port).collect()
    })
}

/// Any bits as a legal cell of a type, often at an edge.
fn cell(ty: &Type, bits: u64) -> u64 {
    let edges =
        [0, 1, u64::MAX, 0x7f, 0x80, 0x7fff, 0x8000, 0x7fff_ffff, 0x8000_0000, 1 << 63, 0x7ff0 << 48, 0x7fef << 48];
    let bits = if bits.is_multiple_of(3) { edges[(bits / 3) as usize % edges.len()] } else { bits };
    let signed = |i: i32| u64::from(i.cast_unsigned());
    match ty {
        Type::Bool => bits & 1,
        Type::U8 => bits & 0xff,
        Type::U16 => bits & 0xffff,
        Type::U32 | Type::S32 | Type::F32 => bits & 0xffff_ffff,
        Type::S8 => signed((bits as i8).into()),
        Type::S16 => signed((bits as i16).into()),
        Type::U64 | Type::S64 | Type::F64 | Type::Duration => bits,
        Type::Enum(cases) => bits % cases.len() as u64,
        Type::Flags(names) => bits & ((1 << names.len()) - 1),
    }
}

fn cells(ports: &[Port], seed: &[u64]) -> Vec<u64> {
    ports.iter().zip(seed).map(|(port, bits)| cell(&port.ty, *bits)).collect()
}
