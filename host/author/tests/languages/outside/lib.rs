//! Asks std for the time, and for the random numbers that its maps begin with.

mod class;

use class::*;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::SystemTime;

#[derive(Default)]
pub struct Block {}

impl Block {
    pub fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let (mut now, mut random) = (0, 0);
        if inputs.time {
            now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_nanos() as u64;
        }
        if inputs.random {
            random = RandomState::new().build_hasher().finish() as u32;
        }
        Outputs { now, random }
    }
}
