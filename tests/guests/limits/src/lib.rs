//! Nothing of its own: its tests run every guest that `cargo xtask guests` built.
