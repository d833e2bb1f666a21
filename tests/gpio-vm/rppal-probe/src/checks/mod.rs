//! The checks, by what they are about.

mod cycle;
mod edges;
mod losses;
mod pwm;
pub(crate) mod refusals;
mod registers;
mod steady;

use crate::Check;

/// Checks on a board that is whole; each leaves it so.
pub(crate) const ALL: &[Check] = &[
    ("a pin held by another program is refused with its name", refusals::held),
    ("a pin of a peripheral is refused", refusals::peripheral),
    ("a pin of another driver of the plant is refused until it is free", refusals::taken),
    ("levels come from the register, active-low resolved", registers::levels),
    ("outputs reach the register, unchanged ones are not written", registers::outputs),
    ("an output begins safe and is safe at the end, and stays an output", registers::safe),
    ("edges of several pins come once each with rising stamps", edges::several),
    ("rising or falling edges alone", edges::single),
    ("edges of an active-low pin", edges::active_low),
    ("debounce swallows what does not hold, for edges and level", edges::debounced),
    ("a full queue is told as a gap", losses::overflow),
    ("nothing is allocated per edge, level and write", steady::no_allocation),
    ("PWM begins safe, follows, holds its range, is safe at the end", pwm::duty),
    ("the driver on the I/O thread reads, writes, is safe at the stop", cycle::driver),
    // Last: the kernel never gives the number 0 again, and rppal begins its search there.
    ("a chip that goes away is told, and works when it is back", losses::unplugged),
];
