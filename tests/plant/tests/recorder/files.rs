//! The ring in memory and the files.

use super::*;

/// A plant whose one recorded block has other outputs in every scan.
fn busy(limits: &str) -> String {
    format!(
        "[recorder]\nblocks = [\"t\"]\nkeyframe = \"1s\"\n{limits}\n[lane.main]\nevery = \"1ms\"\n[block.t]\n\
         component = \"ton\"\nlane = \"main\"\ninputs.in = true\ninputs.pt = \"10h\"\n"
    )
}

fn length(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry"));
    let segments = files.filter(|e| e.path().extension().is_some_and(|e| e == "latchrec"));
    segments.map(|e| e.metadata().expect("its length").len()).sum()
}

#[test]
fn files_never_take_more_than_their_room_and_keep_the_newest() {
    let folder = TempDir::new().expect("a folder");
    let duration = 600 * SECOND;
    run(Rig::new(&busy("spill = \"1MiB\"")).trace(None).plant(Time::Virtual), Some(folder.path()), "", duration);
    let kept = length(folder.path());
    assert!(kept <= 1 << 20, "{kept}");
    assert!(kept > 3 << 18, "room is used: {kept}");
    let recording = Recording::open(folder.path()).expect("a recording");
    let replayed = again(&recording, "t", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.to, duration - 1_000_000);
    assert!(replayed.from > 0, "the oldest are gone");
}

#[test]
fn the_ring_in_memory_never_takes_more_than_its_memory() {
    let mut plant = Rig::new(&busy("memory = \"64KiB\"")).trace(None).plant(Time::Virtual);
    let component = plant.model.blocks[0].component.bytes().len();
    let console = plant.console();
    let asked = std::thread::spawn(move || {
        let operator = Operator { user: "u".into(), origin: "cli".into(), reason: String::new() };
        let ask = |operation| console.ask(operator.clone(), operation, None, Duration::from_secs(60));
        let mut lengths = Vec::new();
        // Until the plant has ended.
        while let Ok(Answer::Recording(bytes)) = ask(Operation::Recording) {
            lengths.push(bytes.len());
        }
        lengths
    });
    let options = RunOptions { scans: Some(120_000), ..RunOptions::default() };
    run_virtual(plant, &options, &AtomicBool::new(false), &mut Watch::default());
    let lengths = asked.join().expect("it has not panicked");
    let most = (64 << 10) + component + 1000;
    assert!(lengths.iter().all(|n| *n <= most), "{lengths:?}");
    assert!(lengths.iter().any(|n| *n > most / 2), "the memory is used: {lengths:?}");
}

#[test]
fn each_run_into_the_same_folder_is_a_run_of_its_own() {
    let folder = TempDir::new().expect("a folder");
    for _ in 0..2 {
        run(Rig::new(PLANT).plant(Time::Virtual), Some(folder.path()), STIMULUS, SECOND);
    }
    let recording = Recording::open(folder.path()).expect("a recording");
    assert_eq!(recording.runs(), [1, 2]);
    let replayed = again(&recording, "count", &Options::default());
    assert!(replayed.equal());
    assert_eq!((replayed.run, replayed.executions), (2, 100));
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_at_the_start_and_none_without_a_recorder() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    assert!(Rig::new(PLANT).plant(Time::Virtual).record_into(&file).is_err());
    let without = PLANT.replacen("[recorder]\nblocks = [\"unit\", \"count\"]\nkeyframe = \"500ms\"\n", "", 1);
    assert!(Rig::new(&without).plant(Time::Virtual).record_into(&file).is_ok());
}
