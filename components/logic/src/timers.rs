//! The timers of IEC 61131-3:2013 table 46: TON, TOF, TP.
//!
//! Time is what `elapsed` adds up to, in ns. The execution that sees an edge is where a timer's time is 0: it cannot know
//! how long ago within the last scan the edge was. `pt` is read in every execution, so a change while running counts at
//! once; `et` never leaves 0 to `pt`. An input that is true in the first execution of all is a rising edge.
//!
//! The fields are the state that survives a restart.

/// On-delay: `q` follows the input going true after `pt`, and going false at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ton {
    /// The input in the last execution.
    pub input: bool,
    /// The input has been true for `pt` without a break.
    pub q: bool,
    /// Elapsed time, ns, 0 to `pt`.
    pub et: u64,
}

impl Ton {
    /// One execution, `elapsed` ns after the previous one; returns `q`. Once true it stays until the input falls, whatever
    /// happens to `pt`.
    pub fn execute(&mut self, elapsed: u64, input: bool, pt: u64) -> bool {
        if !(input && self.input) {
            (self.q, self.et) = (false, 0);
        } else if !self.q {
            self.et = self.et.saturating_add(elapsed);
        }
        self.et = self.et.min(pt);
        self.q = input && (self.q || self.et >= pt);
        self.input = input;
        self.q
    }
}

/// Off-delay: `q` follows the input going true at once, and going false after `pt`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tof {
    /// The input in the last execution.
    pub input: bool,
    /// The input is true, or fell less than `pt` ago.
    pub q: bool,
    /// Elapsed time since the input fell, ns, 0 to `pt`; stays at `pt` until the input rises.
    pub et: u64,
}

impl Tof {
    /// One execution, `elapsed` ns after the previous one; returns `q`.
    pub fn execute(&mut self, elapsed: u64, input: bool, pt: u64) -> bool {
        if input || self.input {
            self.et = 0;
        } else if self.q {
            self.et = self.et.saturating_add(elapsed);
        }
        self.et = self.et.min(pt);
        self.q = input || (self.q && self.et < pt);
        self.input = input;
        self.q
    }
}

/// Pulse: a rising edge of the input makes `q` true for `pt`, whatever the input does meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tp {
    /// The input in the last execution.
    pub input: bool,
    /// The pulse.
    pub q: bool,
    /// Elapsed time of the pulse, ns, 0 to `pt`; after it stays at `pt` until the input is false.
    pub et: u64,
}

impl Tp {
    /// One execution, `elapsed` ns after the previous one; returns `q`.
    ///
    /// An edge seen in the very execution that ends a pulse belongs to that pulse: it starts none. With `pt` 0 there is
    /// no pulse at all.
    pub fn execute(&mut self, elapsed: u64, input: bool, pt: u64) -> bool {
        if self.q {
            self.et = self.et.saturating_add(elapsed).min(pt);
            self.q = self.et < pt;
        } else if input && !self.input {
            (self.q, self.et) = (pt > 0, 0);
        }
        if !self.q && !input {
            self.et = 0;
        }
        self.et = self.et.min(pt);
        self.input = input;
        self.q
    }
}
