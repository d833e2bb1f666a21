//! Messages for the plant's records (`latchwork:block/log`). A block that uses none of this imports nothing.

pub use crate::bindings::latchwork::block::log::Level;

/// Hands one message to the host, which limits how many and how long. In native tests it goes to standard error.
pub fn write(level: Level, message: &str) {
    #[cfg(target_arch = "wasm32")]
    crate::bindings::latchwork::block::log::write(level, message);
    #[cfg(not(target_arch = "wasm32"))]
    std::eprintln!("{level:?}: {message}");
}

/// Logs for the author of the block; arguments as of `format!`.
#[macro_export]
#[doc(hidden)]
macro_rules! __debug {
    ($($text:tt)*) => { $crate::log::write($crate::log::Level::Debug, &$crate::format!($($text)*)) };
}

/// Logs something worth knowing; arguments as of `format!`.
#[macro_export]
#[doc(hidden)]
macro_rules! __info {
    ($($text:tt)*) => { $crate::log::write($crate::log::Level::Info, &$crate::format!($($text)*)) };
}

/// Logs something that will need attention; arguments as of `format!`.
#[macro_export]
#[doc(hidden)]
macro_rules! __warn {
    ($($text:tt)*) => { $crate::log::write($crate::log::Level::Warning, &$crate::format!($($text)*)) };
}

/// Logs something that went wrong; arguments as of `format!`.
#[macro_export]
#[doc(hidden)]
macro_rules! __error {
    ($($text:tt)*) => { $crate::log::write($crate::log::Level::Error, &$crate::format!($($text)*)) };
}

pub use crate::{__debug as debug, __error as error, __info as info, __warn as warn};
