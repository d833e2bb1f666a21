//! What the tests share.

pub(crate) mod bench;
pub(crate) mod line;
pub(crate) mod peer;
pub(crate) mod python;
