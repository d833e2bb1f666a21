//! GPIO lines through the character device of Linux: any board, any chip the kernel drives.
//!
//! | file | owns |
//! |---|---|
//! | `keys` | the keys of a driver and of a point, as users write them; checks of all points together |
//! | `settings` | what the keys of one point ask of the kernel |
//! | `chip` | finding a chip by path, name or label; why it cannot be had, in words that help |
//! | `port` | the lines of one part of the plant: opening, reading, writing, losing and finding them again |
//! | `open` | which lines share a request, and what to do when the kernel refuses one of them |
//! | `group` | one request of the kernel: its lines, its one-step write, its safe values on every way out |
//! | `health` | what is reported, and when it is not |
//! | `direct` | the part in an interrupt lane |
//! | `session` | the part on the I/O thread |
//! | `list` | chips, lines and who holds them, for people |

mod chip;
mod direct;
mod group;
mod health;
mod keys;
mod list;
mod open;
mod port;
mod session;
mod settings;
#[cfg(test)]
mod tests;

pub(crate) use chip::errno;
pub(crate) use keys::GPIO;
pub use list::{ChipInfo, LineInfo, Listing, Unreadable, list};
