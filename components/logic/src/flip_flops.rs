//! Flip-flops and edge detection of IEC 61131-3:2013 tables 43 and 44: SR, RS, R_TRIG, F_TRIG.
//!
//! The fields are the state that survives a restart.

/// Flip-flop, set dominant: `Q1 := S1 OR (NOT R AND Q1)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sr {
    /// The state.
    pub q1: bool,
}

impl Sr {
    /// One execution; returns `q1`.
    pub fn execute(&mut self, s1: bool, r: bool) -> bool {
        self.q1 = s1 || (!r && self.q1);
        self.q1
    }
}

/// Flip-flop, reset dominant: `Q1 := NOT R1 AND (S OR Q1)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rs {
    /// The state.
    pub q1: bool,
}

impl Rs {
    /// One execution; returns `q1`.
    pub fn execute(&mut self, s: bool, r1: bool) -> bool {
        self.q1 = !r1 && (s || self.q1);
        self.q1
    }
}

/// Rising edge: `Q := CLK AND NOT M; M := CLK`. So a `clk` that is true in the first execution is an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RTrig {
    /// The standard's M: `clk` of the last execution.
    pub m: bool,
}

impl RTrig {
    /// One execution; true for exactly one execution per edge.
    pub fn execute(&mut self, clk: bool) -> bool {
        let q = clk && !self.m;
        self.m = clk;
        q
    }
}

/// Falling edge: `Q := NOT CLK AND NOT M; M := NOT CLK`. So a `clk` that is false in the first execution is an edge: the
/// standard's body says so, and blocks ported from elsewhere count on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FTrig {
    /// The standard's M: the negated `clk` of the last execution; false before the first.
    pub m: bool,
}

impl FTrig {
    /// One execution; true for exactly one execution per edge.
    pub fn execute(&mut self, clk: bool) -> bool {
        let q = !clk && !self.m;
        self.m = !clk;
        q
    }
}
