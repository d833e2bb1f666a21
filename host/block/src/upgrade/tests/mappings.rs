//! Cells of one version for another.

use super::{cells, config, ty};
use crate::upgrade::Mapping;
use crate::{Class, Port};
use latchwork_image::{Quality, Type};
use proptest::prelude::*;
use std::collections::HashMap;

/// Ports that differ from those of another version in everything a port can differ in.
fn ports() -> impl Strategy<Value = Vec<Port>> {
    let paths = prop::sample::subsequence(vec!["a", "b", "c.x", "c.y", "d", "e"], 0..=6).prop_shuffle();
    let kind = prop_oneof![
        2 => Just((Type::F64, false)),
        2 => Just((Type::F64, true)),
        1 => Just((Type::Bool, true)),
        1 => Just((Type::Bool, false)),
        1 => ty().prop_map(|ty| (ty, false)),
    ];
    (paths, prop::collection::vec(kind, 6)).prop_map(|(paths, kinds)| {
        let port = |(path, (ty, signal)): (&str, (Type, bool))| Port { path: path.into(), ty, signal, doc: None };
        paths.into_iter().zip(kinds).map(port).collect()
    })
}

/// Up to 32 names.
fn flags() -> impl Strategy<Value = Vec<String>> {
    let all: Vec<String> = (0..36).map(|i| format!("f{i}")).collect();
    prop_oneof![
        prop::sample::subsequence(all[..4].to_vec(), 0..=4).prop_shuffle(),
        prop::sample::subsequence(all, 0..=32).prop_shuffle(),
    ]
}

fn class() -> impl Strategy<Value = Class> {
    (ports(), ports(), flags(), flags()).prop_map(|(inputs, outputs, commands, alarms)| Class {
        name: "acme:line/thing@1.0.0".into(),
        doc: None,
        inputs,
        outputs,
        settings: Vec::new(),
        retained: Vec::new(),
        commands,
        alarms,
        flag_docs: HashMap::new(),
    })
}

/// Values with qualities by name and type, flags by name: what the cells mean.
#[derive(Debug, Default, PartialEq)]
struct Meaning {
    ports: HashMap<(String, Type), (u64, Option<u64>)>,
    flags: HashMap<String, bool>,
}

impl Meaning {
    fn of(ports: &[Port], flags: &[String], cells: &[u64]) -> Self {
        let mut cells = cells.iter().copied();
        let mut next = || cells.next().expect("a cell for everything");
        let mut meaning = Self::default();
        for port in ports {
            let value = next();
            meaning.ports.insert((port.path.clone(), port.ty.clone()), (value, port.signal.then(&mut next)));
        }
        if !flags.is_empty() {
            let word = next();
            meaning.flags = flags.iter().enumerate().map(|(bit, name)| (name.clone(), word >> bit & 1 == 1)).collect();
        }
        meaning
    }

    /// The same in another version, which had `before` in its cells.
    fn carried(&self, ports: &[Port], flags: &[String], before: impl Fn(&Port) -> u64) -> Self {
        let mut meaning = Self::default();
        for port in ports {
            let key = (port.path.clone(), port.ty.clone());
            let (value, quality) = match self.ports.get(&key) {
                Some((value, quality)) => (*value, quality.unwrap_or(Quality::Good.cell())),
                None => (before(port), Quality::Bad.cell()),
            };
            meaning.ports.insert(key, (value, port.signal.then_some(quality)));
        }
        meaning.flags = flags.iter().map(|f| (f.clone(), self.flags.get(f).copied().unwrap_or(false))).collect();
        meaning
    }
}

/// Random cells of ports and a word of flags.
fn random(ports: &[Port], flags: &[String], seed: &[u64]) -> Vec<u64> {
    let mut all = Vec::new();
    for ((port, value), quality) in ports.iter().zip(cells(ports, seed)).zip(seed.iter().rev()) {
        all.push(value);
        all.extend(port.signal.then_some(quality % 3));
    }
    if !flags.is_empty() {
        all.push(seed[0] & (u64::MAX >> (64 - flags.len())));
    }
    all
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn arguments_and_results_go_by_name(
        laid_out in class(),
        executed in class(),
        seed in prop::collection::vec(any::<u64>(), 12),
    ) {
        let mapping = Mapping::new(&laid_out, &executed);
        let given = random(&laid_out.inputs, &laid_out.commands, &seed);
        prop_assert_eq!(given.len(), laid_out.argument_cells());
        let mut cells = vec![0x55; executed.argument_cells()];
        mapping.arguments(&given, &mut cells);
        let meaning = Meaning::of(&laid_out.inputs, &laid_out.commands, &given);
        prop_assert_eq!(
            Meaning::of(&executed.inputs, &executed.commands, &cells),
            meaning.carried(&executed.inputs, &executed.commands, |_| 0)
        );

        let given = random(&executed.outputs, &executed.alarms, &seed);
        let mut cells = vec![0x55; laid_out.output_cells()];
        mapping.results(&given, &mut cells);
        let meaning = Meaning::of(&executed.outputs, &executed.alarms, &given);
        prop_assert_eq!(
            Meaning::of(&laid_out.outputs, &laid_out.alarms, &cells),
            meaning.carried(&laid_out.outputs, &laid_out.alarms, |_| 0x55)
        );
    }

    /// Wherever the laid-out version's cells stand, the same comes of it, and nothing else is touched.
    #[test]
    fn cells_may_stand_anywhere(
        laid_out in class(),
        executed in class(),
        seed in prop::collection::vec(any::<u64>(), 12),
        places in Just((0..64u32).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let mapping = Mapping::new(&laid_out, &executed);
        let (ins, outs) = (laid_out.argument_cells(), laid_out.output_cells());
        let (ins, outs) = (&places[..ins], &places[ins..ins + outs]);
        let placed = mapping.clone().placed(ins, outs);
        let mut lane: Vec<u64> = (0..64).map(|i| seed[i % 12].rotate_left(i as u32)).collect();
        let gather = |lane: &[u64], at: &[u32]| at.iter().map(|at| lane[*at as usize]).collect::<Vec<_>>();

        let mut cells = [vec![0x55; executed.argument_cells()], vec![0x55; executed.argument_cells()]];
        mapping.arguments(&gather(&lane, ins), &mut cells[0]);
        placed.arguments(&lane, &mut cells[1]);
        prop_assert_eq!(&cells[0], &cells[1]);

        let given = random(&executed.outputs, &executed.alarms, &seed);
        let (mut expected, before) = (gather(&lane, outs), lane.clone());
        mapping.results(&given, &mut expected);
        placed.results(&given, &mut lane);
        prop_assert_eq!(gather(&lane, outs), expected);
        let others = (0..64u32).filter(|at| !outs.contains(at)).collect::<Vec<_>>();
        prop_assert_eq!(gather(&lane, &others), gather(&before, &others));
    }

    /// A class that has what two versions have: each of them finds all its own in it, and the first one everything where it was.
    #[test]
    fn a_union_has_what_both_have(one in class(), other in class()) {
        let both = one.with(&other);
        prop_assert_eq!(&both.inputs[..one.inputs.len()], &one.inputs[..]);
        prop_assert_eq!(&both.outputs[..one.outputs.len()], &one.outputs[..]);
        prop_assert_eq!(&both.commands[..one.commands.len()], &one.commands[..]);
        prop_assert_eq!(&both.alarms[..one.alarms.len()], &one.alarms[..]);
        for (ports, others, before) in
            [(&both.inputs, &other.inputs, &one.inputs), (&both.outputs, &other.outputs, &one.outputs)]
        {
            for port in others {
                let found: Vec<_> = ports.iter().filter(|p| p.path == port.path).collect();
                prop_assert_eq!(found.len(), 1);
                prop_assert!(found[0] == port || before.contains(found[0]));
            }
        }
        let again = both.with(&other);
        prop_assert_eq!((again.inputs.len(), again.alarms.len()), (both.inputs.len(), both.alarms.len()));
    }

    /// Versions with the same ports, however documented, are recognised; then everything is copied as it is.
    #[test]
    fn identity_is_recognised(class in class(), other in class(), seed in prop::collection::vec(any::<u64>(), 12)) {
        let mut twin = class.clone();
        twin.name = "acme:line/thing@1.7.0".into();
        twin.inputs.iter_mut().for_each(|p| p.doc = Some("another sentence".into()));
        let mapping = Mapping::new(&class, &twin);
        prop_assert!(mapping.is_identity());
        let given = random(&class.inputs, &class.commands, &seed);
        let mut cells = vec![0x55; given.len()];
        mapping.arguments(&given, &mut cells);
        prop_assert_eq!(&cells, &given);
        let same = (&class.inputs, &class.outputs, &class.commands, &class.alarms)
            == (&other.inputs, &other.outputs, &other.commands, &other.alarms);
        prop_assert_eq!(Mapping::new(&class, &other).is_identity(), same);
    }
}
