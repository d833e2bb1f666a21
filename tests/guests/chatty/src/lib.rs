//! Detects rising edges and talks about it at every level: the guest for the log.
#![no_std]

use latchwork_sdk::log::{debug, error, info, warn};

#[derive(Default)]
struct Chatty {
    m: bool,
    executions: u32,
}

#[latchwork_sdk::block("latchwork:device/r-trig")]
impl Chatty {
    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        self.executions = self.executions.wrapping_add(1);
        debug!("execution {} at {} ns", self.executions, scan.now);
        if scan.first {
            info!("cold start");
        }
        let q = inputs.clk && !self.m;
        if q {
            warn!("an edge in execution {}", self.executions);
        }
        if self.executions == 3 {
            error!("the third execution, umlauts and all: Störung");
        }
        self.m = inputs.clk;
        Outputs { q }
    }

    fn save(&self) -> Retained {
        info!("saved");
        Retained { m: self.m }
    }

    fn restore(&mut self, state: Retained) {
        info!("restored");
        self.m = state.m;
    }
}
