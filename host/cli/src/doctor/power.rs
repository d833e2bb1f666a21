//! A Raspberry Pi's supply and temperature, as its firmware reports them.

use super::finding::{Finding, Status};
use super::machine::Machine;
use super::needs::Needs;
use super::numbers::join;

/// Bits of the firmware's word; the same 16 places higher: since the start.
const CONDITIONS: [(u32, &str); 4] =
    [(0, "the voltage is too low"), (1, "the frequency is capped"), (2, "the CPU is throttled"), (3, "it is too warm")];

/// The firmware does not slow the processor down.
pub(super) fn supply(machine: &Machine, _: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "power-and-heat";
    const WHY: &str =
        "The firmware slows the processor down when the voltage drops or it is hot, whatever the governor says.";
    let Some(word) = word(machine) else { return Vec::new() };
    let set = |shift: u32| -> Vec<String> {
        CONDITIONS.iter().filter(|(bit, _)| word >> (bit + shift) & 1 == 1).map(|(_, what)| (*what).into()).collect()
    };
    let (now, before) = (set(0), set(16));
    let cold = "# a heat sink or fan, and air around the board".to_string();
    let volts = "# the supply made for this board, a short thick cable, no consumers on USB".to_string();
    let mend = |bits: u32| {
        let mut mend = Vec::new();
        // Under-voltage throttles, too: only its own bit tells the two apart.
        if bits & 0b0001 != 0 {
            mend.push(volts.clone());
        }
        if bits & 0b1000 != 0 || bits & 0b0001 == 0 {
            mend.push(cold.clone());
        }
        mend
    };
    let finding = if !now.is_empty() {
        Finding::wanting(Status::Bad, CHECK, WHY, format!("now {}", join(&now)), mend(word & 0xf))
    } else if !before.is_empty() {
        let found = format!("fine now, but since the start: {}", join(&before));
        Finding::wanting(Status::Note, CHECK, WHY, found, mend(word >> 16 & 0xf))
    } else {
        Finding::ok(CHECK, WHY, "never throttled since the start")
    };
    vec![finding]
}

/// The firmware's word; where it stands depends on the board.
fn word(machine: &Machine) -> Option<u32> {
    const PLATFORM: &str = "/sys/devices/platform";
    let socs = machine.list(PLATFORM).into_iter().filter(|n| n.starts_with("soc"));
    let mut firmwares = socs.flat_map(|soc| {
        let folder = format!("{PLATFORM}/{soc}");
        machine.list(&folder).into_iter().filter(|n| n.contains("firmware")).map(move |f| format!("{folder}/{f}"))
    });
    firmwares.find_map(|f| {
        let text = machine.text(&format!("{f}/get_throttled"))?;
        u32::from_str_radix(text.trim_start_matches("0x"), 16).ok()
    })
}
