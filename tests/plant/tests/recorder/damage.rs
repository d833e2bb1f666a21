//! Recordings that are damaged, or none.

use super::*;

#[test]
fn a_torn_or_damaged_file_costs_what_is_torn_and_no_more() {
    let (_folder, path) = recorded();
    let file = std::fs::read_dir(&path)
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .find(|p| p.extension().is_some_and(|e| e == "latchrec"))
        .expect("a file of segments");
    let whole = std::fs::read(&file).expect("it can be read");
    let all = executions(&Recording::open(&path).expect("whole"), "count");
    for length in [whole.len() - 1, whole.len() - 100, whole.len() / 2] {
        std::fs::write(&file, &whole[..length]).expect("written");
        let recording = Recording::open(&path).expect("the rest is a recording");
        assert_eq!(recording.damage.len(), 1, "{:?}", recording.damage);
        assert!(recording.damage[0].contains("torn at byte"), "{:?}", recording.damage);
        let replayed = again(&recording, "count", &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        assert!(replayed.executions <= all);
    }
    // A bit of a segment in the middle: its executions are gone until the next state.
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 4;
    std::fs::write(&file, damaged).expect("written");
    let recording = Recording::open(&path).expect("the rest is a recording");
    assert!(recording.damage[0].contains("its checksum is wrong"), "{:?}", recording.damage);
    let replayed = again(&recording, "count", &Options::default());
    assert!(replayed.equal() && replayed.executions > 100, "{replayed:#?}");
    let left: u64 = ["count", "unit"].iter().map(|block| executions(&recording, block)).sum();
    assert!(left < 2 * all, "{left}");
}

/// CRC-32 as the format has it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)))
}

/// A chunk whose checksum is right, whatever is in it.
fn chunk(kind: u8, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).expect("short");
    [&[kind][..], &length.to_le_bytes(), &crc32(payload).to_le_bytes(), payload].concat()
}

/// The chunks of a file: kind and payload.
fn chunks(file: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let (mut rest, mut chunks) = (&file[12..], Vec::new());
    while let Some((kind, after)) = rest.split_first() {
        let length = u32::from_le_bytes(after[..4].try_into().expect("four")) as usize;
        chunks.push((*kind, after[8..8 + length].to_vec()));
        rest = &after[8 + length..];
    }
    chunks
}

#[test]
fn a_segment_that_contradicts_itself_is_refused_with_file_and_place_and_holds_nothing_up() {
    let (_folder, recording) = counter(&Counter::new(1), "300ms");
    let mut file = latchwork_testbed::replay::header();
    let whole = chunks(&recording.to_bytes());
    // The component and the first segment are right.
    whole[..2].iter().for_each(|(kind, payload)| file.extend(chunk(*kind, payload)));
    let place = file.len();
    let head = &recording.blocks(1).next().expect("a block").1[1].head;
    let endless = [vec![3], vec![0xff; 9], vec![1]].concat();
    let with = |executions, missed| Head { executions, missed, ..head.clone() };
    let cases: Vec<(&str, Head, &[u8])> = vec![
        ("it has more executions than it says", with(3, 0), &endless),
        ("it says that it has more executions than a segment may have", with(u64::MAX, 0), &endless),
        ("it has more executions than it says", with(1 << 16, 0), &endless),
        ("it has fewer executions than it says", with(1, 0), &[]),
        ("it misses other executions than it says", with(0, 7), &[]),
        ("nothing is repeated", with(5, 0), &[3, 0]),
        ("a number does not end", with(5, 0), &[3, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1]),
        ("a fault of a kind that there is not", with(1, 0), &[8, 200]),
        ("its time goes back", with(2, 0), &[64, 40, 64, 59]),
        ("a cell that the class does not have", with(1, 0), &[16, 1, 99, 0]),
        ("a cell of more than eight bytes", with(1, 0), &[16, 1, 0, 0xff]),
        ("it ends in the middle", with(1, 0), &[16, 1, 0]),
        ("its number is the last that there is", Head { number: u64::MAX, ..with(0, 0) }, &[]),
        ("a block with more cells than a class has", Head { cells: [usize::MAX, 1], ..with(0, 0) }, &[]),
    ];
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("x.latchrec");
    for (sentence, head, events) in cases {
        let head = serde_json::to_vec(&head).expect("a head");
        let length = u32::try_from(head.len()).expect("short").to_le_bytes();
        let bytes = [&file[..], &chunk(2, &[&length[..], &head, events].concat())].concat();
        std::fs::write(&path, bytes).expect("written");
        let recording = Recording::open(&path).expect("the first segment is right");
        let told = format!("{}: the chunk at byte {place} is left out: {sentence}", path.display());
        assert_eq!(recording.damage, [told]);
        assert!(again(&recording, "n", &Options::default()).equal());
    }
}

#[test]
fn no_damage_under_a_right_checksum_makes_a_replay_panic_or_hang() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Trap(31)), "100ms");
    let whole = chunks(&recording.to_bytes());
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("x.latchrec");
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    let mut random = 1u64;
    let (mut refused, mut replayed) = (0, 0);
    for _ in 0..300 {
        let mut file = latchwork_testbed::replay::header();
        for (kind, payload) in &whole {
            let mut payload = payload.clone();
            // One byte of every segment on average; components stay as they are.
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            if *kind == 2 && random >> 20 & 1 == 1 {
                let at = (random >> 33) as usize % payload.len();
                payload[at] ^= 1 << (random >> 24 & 7);
            }
            file.extend(chunk(*kind, &payload));
        }
        std::fs::write(&path, file).expect("written");
        let recording = match Recording::open(&path) {
            Ok(recording) => recording,
            Err(error) => {
                assert!(error.to_string().contains("the chunk at byte"), "{error}");
                continue;
            }
        };
        let place = format!("{}: the chunk at byte ", path.display());
        assert!(recording.damage.iter().all(|d| d.starts_with(&place)), "{:#?}", recording.damage);
        refused += recording.damage.len();
        for run in recording.runs() {
            for (block, _) in recording.blocks(run) {
                let options = Options::default();
                match replay(&recording, &engine, run, block, &options) {
                    Ok(told) => replayed += told.executions,
                    Err(error) => assert!(error.to_string().contains(&format!("`{block}`")), "{error}"),
                }
                let _ = export(&recording, &engine, run, block, &options);
            }
        }
    }
    assert!(refused > 100 && replayed > 1000, "{refused} segments refused, {replayed} executions replayed");
}

#[test]
fn no_damage_makes_a_replay_panic() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let whole = recording.to_bytes();
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("x.latchrec");
    let mut random = 1u64;
    for _ in 0..60 {
        let mut bytes = whole.clone();
        for _ in 0..4 {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (random >> 33) as usize % bytes.len();
            bytes[at] ^= 1 << (random & 7);
        }
        std::fs::write(&file, bytes).expect("written");
        if let Ok(recording) = Recording::open(&file) {
            for (block, _) in recording.blocks(1) {
                let _ = replay(&recording, &engine(), 1, block, &Options::default());
            }
        }
    }
}

#[test]
fn what_is_no_recording_is_refused_with_a_sentence() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("plant.toml");
    std::fs::write(&file, "[plant]\n").expect("written");
    let error = Recording::open(&file).expect_err("it is none").to_string();
    assert!(error.contains("is no recording: it does not begin with LATCHREC"), "{error}");
    let empty = TempDir::new().expect("a folder");
    let error = Recording::open(empty.path()).expect_err("it is empty").to_string();
    assert!(error.contains("holds no recorded block"), "{error}");
    std::fs::write(&file, b"LATCHREC\x09\0\0\0").expect("written");
    let error = Recording::open(&file).expect_err("another version").to_string();
    assert!(error.contains("has version 9 of the format"), "{error}");
}
