//! The shadow: a candidate gets what the running block gets, and is compared with it.

use latchwork_block::{Instance, Limits};
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Request;
use latchwork_plant::swap::{Candidate, Shadow, Tolerance, Verdict};
use latchwork_tests_plant::{Rig, component_folders, engine};

const MS: u64 = 1_000_000;

/// A block of a component under a clock of 20 ms.
fn plant(component: &str, inputs: &str) -> Plant {
    let text = format!(
        "[lane.main]\nevery = \"10ms\"\n[block.clock]\ncomponent = \"multivibrator\"\nlane = \"main\"\n\
         inputs.run = true\nsettings.on-time = \"40ms\"\nsettings.off-time = \"40ms\"\n\
         [block.unit]\ncomponent = \"{component}\"\nlane = \"main\"\n{inputs}"
    );
    Rig::new(&text).plant(Time::Virtual)
}

/// An instance of a shipped component with these settings.
fn instance(component: &str, settings: &[u64]) -> Instance {
    let path = component_folders()[0].join(format!("{component}.wasm"));
    let component = engine().load_bytes(component, &std::fs::read(path).expect("a component")).expect("it loads");
    let class = component.class(None).expect("one class");
    let mut instance =
        component.template(&class).expect("it compiles").instantiate(&Limits::default()).expect("it starts");
    instance.configure(settings).expect("it lives").expect("it takes its settings");
    instance
}

/// A candidate for a block, for 50 executions.
fn candidate<'a>(plant: &Plant, block: usize, instance: Instance, settings: &[u64]) -> Candidate<'a> {
    let b = &plant.model.blocks[block];
    Candidate {
        block: b.name.clone(),
        index: block as u32,
        running: b.class.clone(),
        instance,
        settings: settings.to_vec(),
        own_settings: Vec::new(),
        lossy: false,
        executions: 50,
        tolerances: &[],
        real_time: false,
    }
}

/// Its shadow, under way.
fn start(plant: &mut Plant, candidate: Candidate<'_>) -> Shadow {
    let (shadow, request) = Shadow::start(candidate).expect("right tolerances");
    assert!(plant.supervisor.send(0, request).is_ok());
    shadow
}

fn shadow(plant: &mut Plant, block: usize, instance: Instance, settings: &[u64]) -> Shadow {
    let candidate = candidate(plant, block, instance, settings);
    start(plant, candidate)
}

/// Scans until the shadow ends, 100 at most.
fn run(plant: &mut Plant, from: u64, shadow: &mut Shadow) -> Verdict {
    for i in from..from + 100 {
        scan(plant, i);
        if let Some(verdict) = shadow.poll() {
            return verdict;
        }
    }
    panic!("it does not end: {:?}", shadow.report())
}

fn scan(plant: &mut Plant, i: u64) {
    plant.lanes[0].scan(i * 10 * MS, i * 10 * MS, || i * 10 * MS);
    plant.lanes[0].spare((i + 1) * 10 * MS, || i * 10 * MS);
}

const TIMER: &str = "inputs.in = \"clock.outputs.out\"\ninputs.pt = \"20ms\"\n";

#[test]
fn the_same_component_gives_the_same_from_the_state_that_it_takes_over() {
    let mut plant = plant("ctu", "inputs.cu = \"clock.outputs.out\"\ninputs.pv = 3\n");
    (0..33).for_each(|i| scan(&mut plant, i));
    let mut shadow = shadow(&mut plant, 1, instance("ctu", &[]), &[]);
    assert_eq!(run(&mut plant, 33, &mut shadow), Verdict::Same);
    let report = shadow.report();
    assert_eq!((report.executions, report.different, report.missed), (50, 0, 0));
    assert_eq!(report.deviations, []);
    assert_eq!(shadow.left(), 0);
}

#[test]
fn a_difference_is_told_with_its_first_time_its_count_its_worst_and_the_inputs_that_caused_it() {
    let mut plant = plant("ton", TIMER);
    (0..4).for_each(|i| scan(&mut plant, i));
    let mut shadow = shadow(&mut plant, 1, instance("tp", &[]), &[]);
    let verdict = run(&mut plant, 4, &mut shadow);
    assert!(matches!(&verdict, Verdict::Different(why) if why.contains("outputs.q")), "{verdict:?}");
    let report = shadow.report();
    assert_eq!(report.executions, 50, "it goes on to the end to tell everything");
    insta::assert_json_snapshot!(report);
}

#[test]
fn a_deviation_within_its_tolerance_is_none() {
    let tolerances = [Tolerance { tag: "unit.outputs.*".into(), within: 1e9 }];
    let mut plant = plant("ton", TIMER);
    let candidate = Candidate { tolerances: &tolerances, ..candidate(&plant, 1, instance("tp", &[]), &[]) };
    let mut shadow = start(&mut plant, candidate);
    run(&mut plant, 0, &mut shadow);
    let ports: Vec<_> = shadow.report().deviations.into_iter().map(|d| d.port).collect();
    assert_eq!(ports, ["outputs.q"], "a bool has no tolerance, a time has");
}

#[test]
fn a_tolerance_that_is_no_number_or_no_glob_is_refused() {
    for (tag, within, why) in [
        ("unit.outputs.q", f64::NAN, "the tolerance of unit.outputs.q is NaN"),
        ("unit.outputs.q", -1.0, "expected a number from 0 on"),
        ("unit.[", 1.0, "is not a glob of tags"),
    ] {
        let plant = plant("ton", TIMER);
        let tolerances = [Tolerance { tag: tag.into(), within }];
        let refused =
            Shadow::start(Candidate { tolerances: &tolerances, ..candidate(&plant, 1, instance("ton", &[]), &[]) });
        let error = refused.err().expect("it is refused").to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn settings_that_the_running_block_gets_meanwhile_reach_the_candidate() {
    let mut plant = plant("and", "");
    let settings = plant.supervisor.recipes[0].settings.clone();
    let mut shadow = shadow(&mut plant, 0, instance("multivibrator", &settings), &settings);
    (0..10).for_each(|i| scan(&mut plant, i));
    let cells: Box<[u64]> = settings.iter().map(|_| 70 * MS).collect();
    assert!(
        plant.supervisor.send(0, Request::Configure { block: 0, number: 1, version: 0, cells, waiting: None }).is_ok()
    );
    assert_eq!(run(&mut plant, 10, &mut shadow), Verdict::Same);
    assert_eq!(shadow.report().executions, 50);
}

const STRESS: &str = "inputs.fault = \"trap\"\ninputs.from = 20\n";

#[test]
fn a_fault_of_the_candidate_ends_it_and_is_told_with_its_inputs() {
    let mut plant = plant("stress", STRESS);
    let dead = &mut instance("stress", &[0, 0]);
    assert!(dead.configure(&[0, 1]).is_err(), "it traps when it is configured so");
    let dead = std::mem::replace(dead, instance("stress", &[0, 0]));
    let mut shadow = shadow(&mut plant, 1, dead, &[0, 0]);
    let verdict = run(&mut plant, 0, &mut shadow);
    assert!(matches!(&verdict, Verdict::Failed(why) if why.contains("the candidate failed")), "{verdict:?}");
    let fault = shadow.report().fault.expect("a fault");
    assert_eq!((fault.kind.as_str(), fault.at), ("trap", 0));
    assert!(fault.inputs.contains(&("inputs.from".into(), "20".into())), "{:?}", fault.inputs);
}

#[test]
fn a_fault_of_the_running_block_ends_it_and_says_so() {
    let mut plant = plant("stress", STRESS);
    let mut shadow = shadow(&mut plant, 1, instance("stress", &[0, 0]), &[0, 0]);
    let verdict = run(&mut plant, 0, &mut shadow);
    assert_eq!(verdict, Verdict::Failed("the running block has faulted meanwhile".into()));
}

#[test]
fn a_block_out_of_order_has_no_shadow() {
    let mut plant = plant("stress", "inputs.fault = \"trap\"\ninputs.from = 1\n");
    scan(&mut plant, 0);
    let mut shadow = shadow(&mut plant, 1, instance("stress", &[0, 0]), &[0, 0]);
    let verdict = run(&mut plant, 1, &mut shadow);
    assert!(matches!(&verdict, Verdict::Failed(why) if why.contains("out of order")), "{verdict:?}");
}

#[test]
fn executions_that_the_shadow_has_missed_make_it_worthless() {
    let mut plant = plant("ton", TIMER);
    let candidate = Candidate { executions: 5_000, ..candidate(&plant, 1, instance("ton", &[]), &[]) };
    let mut shadow = start(&mut plant, candidate);
    // Nobody polls meanwhile: there is room for some two thousand.
    (0..4_000).for_each(|i| scan(&mut plant, i));
    let verdict = run(&mut plant, 4_000, &mut shadow);
    let Verdict::Failed(why) = verdict else { panic!("{verdict:?}") };
    let report = shadow.report();
    assert!(report.missed > 1_000, "{report:?}");
    assert!(why.contains(&format!("missed {} executions", report.missed)), "{why}");
}

#[test]
fn by_the_machines_clock_it_runs_on_a_thread_of_its_own_and_times_both() {
    let mut plant = plant("ton", TIMER);
    let candidate = Candidate { executions: 500, real_time: true, ..candidate(&plant, 1, instance("ton", &[]), &[]) };
    let mut shadow = start(&mut plant, candidate);
    (0..510).for_each(|i| scan(&mut plant, i));
    let end = std::time::Instant::now() + std::time::Duration::from_secs(20);
    let verdict = loop {
        if let Some(verdict) = shadow.poll() {
            break verdict;
        }
        assert!(std::time::Instant::now() < end, "{:?}", shadow.report());
        std::thread::yield_now();
    };
    assert_eq!(verdict, Verdict::Same);
    let report = shadow.report();
    assert!(report.running_mean_ns > 0 && report.running_max_ns >= report.running_mean_ns, "{report:?}");
    assert!(report.candidate_mean_ns > 0 && report.candidate_max_ns >= report.candidate_mean_ns, "{report:?}");
}
