//! `rppal`: the pins of a Raspberry Pi through its memory-mapped registers.
//!
//! Levels and outputs cost one access to a register instead of a call of the kernel. What registers cannot do goes
//! another way: edges and debouncing come from the kernel's character device, one request per line, because rppal's own
//! interrupts hide their descriptor, and its asynchronous ones lose edges; PWM goes through the kernel's sysfs.
//! On any other board than a Raspberry Pi the kind `gpio` does the same through the kernel alone.
//!
//! | file | owns |
//! |---|---|
//! | `keys` | the keys of a driver and of a point, as users write them |
//! | `place` | what a point is; checks of all points together |
//! | `board` | finding the board and taking a pin; what stands in the way, in words |
//! | `pin` | an input, an output: registers, or a line of the kernel where it must be |
//! | `line` | a line of the kernel: edges with their stamps, debounced levels |
//! | `pwm` | a PWM channel |
//! | `points` | all points of a lane or a driver: open, read, write, safe at the end; what is reported, and when not |
//! | `driver` | the part on the I/O thread |

mod board;
mod driver;
mod keys;
mod line;
mod pin;
mod place;
mod points;
mod pwm;
#[cfg(test)]
mod tests;

pub(crate) use keys::RPPAL;
