//! A guest whose save is slow or fails on demand, for tests of retained state.
#![no_std]

#[derive(Default)]
struct Keeper {
    state: Retained,
    inputs: Inputs,
}

#[latchwork_sdk::block("workshop:store/keeper", wit = "wit")]
impl Keeper {
    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        self.inputs = inputs;
        self.state.count = self.state.count.wrapping_add(u64::from(inputs.count));
        Outputs { count: self.state.count, first: scan.first, elapsed: scan.elapsed }
    }

    fn save(&self) -> Retained {
        assert!(!self.inputs.trap, "asked to trap");
        let mut x = self.state.count;
        for _ in 0..self.inputs.burn {
            x = core::hint::black_box(x.rotate_left(5) ^ 0x9e37_79b9);
        }
        // Of no use, but the loop must not be left out.
        core::hint::black_box(x);
        Retained { count: self.state.count, spent: self.state.count }
    }

    fn restore(&mut self, state: Retained) {
        // None that it has saved: a plant may stop or be swapped at any count.
        assert!(state.count != 13 || state.spent == 13, "a state that it does not take");
        self.state = state;
    }
}
