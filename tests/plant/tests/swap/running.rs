//! Swaps by the machine's clock, through the operators' console.

use super::*;

#[test]
fn placeholder() {}
