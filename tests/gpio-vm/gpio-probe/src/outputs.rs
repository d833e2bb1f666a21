//! Outputs of an interrupt lane.

use crate::bench::{Keys, Lane, number, point, text};
use crate::chip::Chip;
use crate::taken::{Taken, requests};
use crate::{Outcome, ensure};
use latchwork_io::direct::Role;
use latchwork_io::driver::PointConfig;
use latchwork_schema::Value::Bool;
use std::sync::atomic::{AtomicBool, Ordering};

fn output(line: usize, safe: bool, keys: Keys<'_>) -> (PointConfig, Role) {
    let keys: Vec<_> = [("line", number(line))].into_iter().chain(keys.iter().cloned()).collect();
    (point(&format!("out-{line}"), &keys, Some(safe)), Role::Output)
}

pub(crate) fn begin() -> Outcome {
    let chip = Chip::new("begin", 4, &[])?;
    // The pulls say the opposite, so every level seen was driven.
    [true, false, true, false].iter().enumerate().for_each(|(n, up)| chip.pull(n, *up));
    let initial = |level| [("initial", Bool(level))];
    let points = vec![
        output(0, false, &[]),
        output(1, true, &[]),
        output(2, true, &initial(false)),
        output(3, false, &initial(true)),
    ];
    let _lane = Lane::healthy(&chip, points)?;
    let shown: Vec<bool> = (0..4).map(|n| chip.value(n)).collect();
    ensure!(shown == [false, true, false, true], "at the request: {shown:?}");
    Ok(())
}

pub(crate) fn polarity() -> Outcome {
    let chip = Chip::new("polarity", 3, &[])?;
    let points = vec![
        output(0, false, &[("active-low", Bool(true))]),
        output(1, true, &[("active-low", Bool(true))]),
        output(2, false, &[("drive", text("open-drain")), ("bias", text("pull-up"))]),
    ];
    let mut lane = Lane::healthy(&chip, points)?;
    let shown: Vec<bool> = (0..2).map(|n| chip.value(n)).collect();
    ensure!(shown == [true, false], "active-low outputs begin with {shown:?}");
    lane.write(&[true, false, true]);
    let shown: Vec<bool> = (0..2).map(|n| chip.value(n)).collect();
    ensure!(shown == [false, true], "active-low outputs show {shown:?}");
    let listed = latchwork_io::gpio::list(Some("polarity"));
    let drive = listed.chips.first().and_then(|c| c.lines[2].drive);
    ensure!(drive == Some("open-drain"), "the drive is {drive:?}");
    Ok(())
}

pub(crate) fn only_changed() -> Outcome {
    let chip = Chip::new("changed", 4, &[])?;
    let before = requests();
    let mut lane = Lane::healthy(&chip, (0..4).map(|n| output(n, false, &[])).collect())?;
    // One request for all outputs, which is what makes one step possible.
    let taken = Taken::since(&before)?;
    lane.write(&[true, false, true, false]);
    ensure!(taken.levels(4) == 0b0101, "the lines show {:04b}", taken.levels(4));
    // Behind the driver's back: what it touches becomes visible.
    taken.set(0, false);
    taken.set(1, true);
    lane.write(&[true, false, false, true]);
    ensure!(taken.levels(4) == 0b1010, "other lines than the changed ones were touched: {:04b}", taken.levels(4));
    taken.set(2, true);
    lane.write(&[true, false, false, true]);
    ensure!(taken.levels(4) == 0b1110, "lines were touched without a change: {:04b}", taken.levels(4));
    Ok(())
}

pub(crate) fn one_step() -> Outcome {
    const WRITES: usize = 20_000;
    let chip = Chip::new("step", 8, &[])?;
    let before = requests();
    let mut lane = Lane::healthy(&chip, (0..8).map(|n| output(n, false, &[])).collect())?;
    let taken = Taken::since(&before)?;
    let end = AtomicBool::new(false);
    let torn = std::thread::scope(|scope| {
        let looking = scope.spawn(|| {
            let mut torn = 0;
            while !end.load(Ordering::Relaxed) {
                torn += u64::from(!matches!(taken.levels(8), 0 | 0xff));
            }
            torn
        });
        (0..WRITES).for_each(|n| lane.write(&[n % 2 == 0; 8]));
        end.store(true, Ordering::Relaxed);
        looking.join().unwrap_or(u64::MAX)
    });
    ensure!(torn == 0, "outputs were seen {torn} times when only some of them had changed");
    Ok(())
}

pub(crate) fn safe_on_drop() -> Outcome {
    let chip = Chip::new("drop", 3, &[])?;
    let before = requests();
    let mut lane = Lane::healthy(&chip, vec![output(0, false, &[]), output(1, true, &[]), output(2, true, &[])])?;
    let taken = Taken::since(&before)?;
    lane.write(&[true, false, true]);
    ensure!(taken.levels(3) == 0b101, "the lines show {:03b}", taken.levels(3));
    // Even what the driver believes to be safe already is written.
    taken.set(2, false);
    drop(lane);
    ensure!(taken.levels(3) == 0b110, "after the drop the lines show {:03b}", taken.levels(3));
    Ok(())
}

pub(crate) fn safe_on_panic() -> Outcome {
    let chip = Chip::new("panic", 2, &[])?;
    let before = requests();
    let mut lane = Lane::healthy(&chip, vec![output(0, false, &[]), output(1, true, &[])])?;
    let taken = Taken::since(&before)?;
    std::panic::set_hook(Box::new(|_| {}));
    let ended = std::thread::spawn(move || {
        lane.write(&[true, false]);
        panic!("a defect of the lane");
    });
    let ended = ended.join();
    let _ = std::panic::take_hook();
    ensure!(ended.is_err(), "the lane did not panic");
    ensure!(taken.levels(2) == 0b10, "after the panic the lines show {:02b}", taken.levels(2));
    Ok(())
}

pub(crate) fn many() -> Outcome {
    let chip = Chip::new("many", 100, &[])?;
    let mut lane =
        Lane::healthy(&chip, (0..100).map(|n| output(n, false, &[("active-low", Bool(n % 3 == 0))])).collect())?;
    let wanted: Vec<bool> = (0..100).map(|n| n % 7 < 3).collect();
    lane.write(&wanted);
    for (n, level) in wanted.iter().enumerate() {
        ensure!(chip.value(n) == (*level != (n % 3 == 0)), "line {n} shows {}", chip.value(n));
    }
    Ok(())
}
