//! Checks of the `gpio` driver against the kernel's own simulated chips (module gpio-sim).
//!
//! Runs as root where configfs is mounted and gpio-sim is loaded, best in a virtual machine of its own. Prints one line a
//! check, `ok NAME` or `FAILED NAME: why`, and at the end how many there were. The exit code is 1 when one has failed.

mod alloc;
mod bench;
mod chip;
mod edges;
mod outputs;
mod taken;
mod thread;
mod trouble;

use std::process::ExitCode;

/// What a check returns; the error says why it failed.
type Outcome = Result<(), String>;

/// Fails a check unless the condition holds.
macro_rules! ensure {
    ($condition:expr, $($why:tt)+) => {
        if !$condition {
            return Err(format!($($why)+));
        }
    };
}
pub(crate) use ensure;

/// A check by its name.
type Check = (&'static str, fn() -> Outcome);

const CHECKS: &[Check] = &[
    ("edges-of-several-lines", edges::several_lines),
    ("edges-in-bursts", edges::bursts),
    ("edges-of-both-kinds-or-one", edges::kinds),
    ("edges-active-low", edges::active_low),
    ("edges-wake-the-lane", edges::wake),
    ("edges-lost-are-counted", edges::lost),
    ("edges-lost-of-the-largest-buffer", edges::lost_largest),
    ("edges-of-a-storm-push-out-no-others", edges::storm),
    ("edges-merged-by-the-kernel-are-told", edges::merged),
    ("edges-debounced", edges::debounce),
    ("levels-and-bias", edges::levels),
    ("lines-by-name", edges::names),
    ("outputs-begin-safe", outputs::begin),
    ("outputs-polarity-and-drive", outputs::polarity),
    ("outputs-only-what-changed", outputs::only_changed),
    ("outputs-in-one-step", outputs::one_step),
    ("outputs-safe-on-drop", outputs::safe_on_drop),
    ("outputs-safe-on-panic", outputs::safe_on_panic),
    ("outputs-more-than-a-request-holds", outputs::many),
    ("trouble-line-held-by-another", trouble::held),
    ("trouble-wrong-lines", trouble::wrong_lines),
    ("trouble-chip-unplugged", trouble::unplugged),
    ("trouble-chip-of-outputs-alone-unplugged", trouble::outputs_alone),
    ("trouble-pauses-grow", trouble::pauses),
    ("trouble-chip-unplugged-while-waiting", trouble::unplugged_while_waiting),
    ("trouble-no-permission", trouble::no_permission),
    ("trouble-label-twice", trouble::label_twice),
    ("list-of-chips-and-holders", trouble::list),
    ("thread-reads-and-writes", thread::reads_and_writes),
    ("thread-stop-is-safe", thread::stop_is_safe),
    ("thread-chip-unplugged", thread::unplugged),
    ("thread-chip-of-outputs-alone-unplugged", thread::outputs_alone),
    ("thread-initial-until-the-lane-begins", thread::initial),
    ("no-allocation-in-a-lane", alloc::lane),
];

fn main() -> ExitCode {
    // The same program again, as a user without rights.
    if std::env::args().nth(1).as_deref() == Some("as-a-user") {
        return trouble::as_a_user();
    }
    let only: Vec<String> = std::env::args().skip(1).collect();
    let (mut count, mut failed) = (0, 0);
    for (name, check) in CHECKS.iter().filter(|(n, _)| only.is_empty() || only.iter().any(|o| n.contains(o.as_str()))) {
        count += 1;
        let panicked = |_| Err("it panicked, see above".to_owned());
        match std::panic::catch_unwind(check).unwrap_or_else(panicked) {
            Ok(()) => println!("ok {name}"),
            Err(why) => {
                failed += 1;
                println!("FAILED {name}: {why}");
            }
        }
    }
    println!("{count} checks, {failed} failed");
    ExitCode::from(u8::from(failed > 0))
}
