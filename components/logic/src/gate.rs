//! Bitwise Boolean functions of IEC 61131-3:2013 table 31 for BOOL: AND, OR. They have no state.

use crate::{Refusal, refusal};

/// The inputs a block has ports for.
const PORTS: usize = 8;

/// A function that the standard calls extensible: how many inputs it has is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gate {
    /// How many of the inputs count, from the first on; 1 to 8.
    pub inputs: u8,
}

impl Default for Gate {
    fn default() -> Self {
        Self { inputs: 2 }
    }
}

impl Gate {
    /// Refuses to count no input, or more than there are.
    pub fn check(&self) -> Result<(), Refusal> {
        let there = (1..=PORTS).contains(&usize::from(self.inputs));
        refusal::whole(there, "inputs", self.inputs.into(), "1 to 8")
    }

    /// `OUT := IN1 AND IN2 AND …`
    #[must_use]
    pub fn and(&self, inputs: [bool; PORTS]) -> bool {
        self.counting(&inputs).all(|input| input)
    }

    /// `OUT := IN1 OR IN2 OR …`
    #[must_use]
    pub fn or(&self, inputs: [bool; PORTS]) -> bool {
        self.counting(&inputs).any(|input| input)
    }

    fn counting<'a>(&self, inputs: &'a [bool; PORTS]) -> impl Iterator<Item = bool> + use<'a> {
        inputs.iter().copied().take(self.inputs.into())
    }
}
