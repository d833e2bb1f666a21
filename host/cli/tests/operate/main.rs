//! Operators at a running plant: real processes, a real socket, and records that say who did what.

mod commands;
mod support;
mod who;
