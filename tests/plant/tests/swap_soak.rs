//! Ten seconds of what `cargo xtask bench swap` does for minutes, by the machine's clock, without asking what time it took.

use latchwork_tests_plant::soak::Soak;
use std::time::Duration;

#[test]
fn blocks_that_are_swapped_without_end_lose_no_scan_no_count_and_no_record() {
    let soak = Soak {
        blocks: 60,
        quiet: Duration::from_millis(500),
        swapping: Duration::from_secs(10),
        every: 5_000_000,
        retain_ms: 500,
    };
    let told = soak.run();
    let wrong = told.wrong();
    assert!(wrong.is_empty(), "{:#?}", &wrong[..wrong.len().min(20)]);
    let count = |bad, back| told.swaps.iter().filter(|d| (d.bad, d.back) == (bad, back)).count();
    assert!(count(false, false) > 3 && told.steps > 1000, "{:?} {}", told.swaps.len(), told.steps);
    assert!(told.retained.writes > 1, "states were saved meanwhile: {:?}", told.retained);
}
