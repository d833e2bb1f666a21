//! A device class of a user's own WIT package, built with the SDK, that nothing but this test knows: the host reads its
//! ports from the component and moves every value unchanged, on both call paths.

mod support;

use latchwork_block::{Class, Port};
use support::class::Leaf;
use support::shipped::test_component;
use support::strategy::Cells;
use support::twins::{Twins, argument_leaves, first_scan, leaves, next, patient, templates};

/// `inputs.echo`: what `outputs` repeats.
const INPUTS: u64 = 0;
const SETTINGS: u64 = 1;
const RETAINED: u64 = 2;

fn twins() -> Twins {
    Twins::new(templates(&test_component("everything")), &patient()).unwrap()
}

/// Index of a port's value cell.
fn cell(ports: &[Port], path: &str) -> usize {
    let at = ports.iter().position(|p| p.path == path).unwrap_or_else(|| panic!("no port {path}"));
    leaves(&ports[..at]).len()
}

/// Cells that all groups have in common: everything before `executions`.
fn common(class: &Class) -> usize {
    cell(&class.outputs, "executions")
}

/// Legal settings that the block does not refuse.
fn settings(class: &Class, cells: &mut Cells) -> Vec<u64> {
    let mut settings = cells.of(&leaves(&class.settings));
    settings[cell(&class.settings, "a")] %= 255;
    settings
}

/// Random inputs with `echo`, and random commands.
fn arguments(class: &Class, cells: &mut Cells, echo: u64) -> Vec<u64> {
    let mut arguments = cells.of(&argument_leaves(class));
    arguments[0] = echo;
    arguments
}

#[test]
fn its_ports_are_read_from_the_component() {
    let twins = twins();
    let class = twins.class();
    assert_eq!(class.name, "test:everything/kitchen-sink@1.2.0");
    let mut seen = String::new();
    for (group, ports) in [("inputs", &class.inputs), ("settings", &class.settings)] {
        for p in ports {
            let signal = if p.signal { " + quality" } else { "" };
            seen += &format!("{group}.{}: {}{signal}  {}\n", p.path, p.ty, p.doc.as_deref().unwrap_or("-"));
        }
    }
    seen += &format!("commands: {:?}\nclass: {:?}\n", class.commands, class.doc);
    insta::assert_snapshot!(seen);
    assert_eq!(class.commands, class.alarms);
    assert_eq!(class.flag_doc("alarms", "trip").as_deref(), Some("The trip bit."));
}

#[test]
fn inputs_and_commands_come_back() {
    let mut twins = twins();
    let (mut cells, mut scan) = (Cells::new(11), first_scan());
    let (common, executions) = (common(twins.class()), cell(&twins.class().outputs, "executions"));
    let (elapsed, first) = (cell(&twins.class().outputs, "elapsed"), cell(&twins.class().outputs, "first"));
    let mut sum = 0u64;
    for n in 1..=500 {
        let arguments = arguments(twins.class(), &mut cells, INPUTS);
        let scan = next(&mut scan, &mut cells);
        sum = sum.wrapping_add(scan.elapsed);
        let outputs = twins.execute(scan, &arguments).unwrap();
        assert_eq!(outputs[..common], arguments[1..=common], "execution {n}");
        assert_eq!(outputs.last(), arguments.last(), "the alarms repeat the commands");
        assert_eq!((outputs[executions], outputs[elapsed], outputs[first]), (n, sum, u64::from(n == 1)));
    }
}

#[test]
fn settings_arrive_or_are_refused() {
    let mut twins = twins();
    let (mut cells, mut scan) = (Cells::new(12), first_scan());
    let (common, a) = (common(twins.class()), cell(&twins.class().settings, "a"));
    let mut given = twins.defaults().unwrap().expect("it has defaults");
    let text: Vec<String> = {
        let mut next = given.iter();
        let ports = twins.class().settings.iter();
        ports.map(|p| format!("{} = {}", p.path, p.ty.format(*next.next().unwrap()))).collect()
    };
    insta::assert_snapshot!(text.join("\n"));
    for _ in 0..200 {
        assert_eq!(twins.configure(&given), Ok(Ok(())));
        let mut refused = settings(twins.class(), &mut cells);
        refused[a] = 255;
        assert_eq!(twins.configure(&refused), Ok(Err("a is 255; expected 0 to 254".into())));
        let arguments = arguments(twins.class(), &mut cells, SETTINGS);
        let outputs = twins.execute(next(&mut scan, &mut cells), &arguments).unwrap();
        assert_eq!(outputs[..common], given[..], "the settings accepted last are in force");
        given = settings(twins.class(), &mut cells);
    }
}

#[test]
fn its_state_moves_to_another_instance() {
    let mut twins = twins();
    let (mut cells, mut scan) = (Cells::new(13), first_scan());
    let (common, executions) = (common(twins.class()), cell(&twins.class().outputs, "executions"));
    let retained = leaves(&twins.class().retained);
    assert_eq!(retained.last(), Some(&Leaf::Flags(13)), "flags are retained, too");
    let mut before = arguments(twins.class(), &mut cells, INPUTS);
    twins.execute(next(&mut scan, &mut cells), &before).unwrap();
    for n in 2..=200 {
        let state = twins.save().unwrap().expect("it retains");
        assert_eq!(state[..common], before[1..=common]);
        assert_eq!(state.last(), before.last());
        twins.renew();
        twins.restore(&state).unwrap();
        assert_eq!(twins.save(), Ok(Some(state)));
        let arguments = arguments(twins.class(), &mut cells, RETAINED);
        let outputs = twins.execute(next(&mut scan, &mut cells), &arguments).unwrap();
        assert_eq!(outputs[..common], before[1..=common]);
        assert_eq!(outputs[executions], n);
        before = arguments;
    }
}
