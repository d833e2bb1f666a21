//! The counters of IEC 61131-3:2013 table 45: CTU, CTD, CTUD.
//!
//! The count inputs are edge-triggered (`R_EDGE`, so an input that is true in the first execution counts), and their edges
//! are consumed also while reset or load hold the counter. Values stop at the limits of the type; they never wrap.
//!
//! The fields are the state that survives a restart.

use crate::RTrig;

/// Up counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ctu {
    /// Current value.
    pub cv: i32,
    /// Edge detection of CU.
    pub cu: RTrig,
}

impl Ctu {
    /// One execution; returns Q, `cv >= pv`. Reset wins over counting.
    pub fn execute(&mut self, cu: bool, r: bool, pv: i32) -> bool {
        let up = self.cu.execute(cu);
        if r {
            self.cv = 0;
        } else if up {
            self.cv = self.cv.saturating_add(1);
        }
        self.cv >= pv
    }
}

/// Down counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ctd {
    /// Current value.
    pub cv: i32,
    /// Edge detection of CD.
    pub cd: RTrig,
}

impl Ctd {
    /// One execution; returns Q, `cv <= 0`. Load wins over counting.
    pub fn execute(&mut self, cd: bool, ld: bool, pv: i32) -> bool {
        let down = self.cd.execute(cd);
        if ld {
            self.cv = pv;
        } else if down {
            self.cv = self.cv.saturating_sub(1);
        }
        self.cv <= 0
    }
}

/// Up-down counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ctud {
    /// Current value.
    pub cv: i32,
    /// Edge detection of CU.
    pub cu: RTrig,
    /// Edge detection of CD.
    pub cd: RTrig,
}

impl Ctud {
    /// One execution; returns QU, `cv >= pv`, and QD, `cv <= 0`. Reset wins over load, load over counting; edges on both
    /// count inputs in one execution cancel each other.
    pub fn execute(&mut self, cu: bool, cd: bool, r: bool, ld: bool, pv: i32) -> (bool, bool) {
        let (up, down) = (self.cu.execute(cu), self.cd.execute(cd));
        self.cv = match (r, ld, up, down) {
            (true, ..) => 0,
            (_, true, ..) => pv,
            (.., true, false) => self.cv.saturating_add(1),
            (.., false, true) => self.cv.saturating_sub(1),
            _ => self.cv,
        };
        (self.cv >= pv, self.cv <= 0)
    }
}
