//! A guest that shows what reached it, for tests of interrupt lanes.
#![no_std]

#[derive(Default)]
struct Interlock {
    trip: bool,
    runs: u32,
    resets: u32,
}

#[latchwork_sdk::block("workshop:safety/interlock", wit = "wit")]
impl Interlock {
    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {
        assert!(!inputs.trap, "asked to trap");
        let Inputs { a, b, c, q, .. } = inputs;
        self.runs = self.runs.wrapping_add(1);
        let reset = commands.contains(Commands::RESET);
        self.resets = self.resets.wrapping_add(u32::from(reset));
        self.trip = a || self.trip && !reset;
        let mut status = Register::empty();
        status.set(Register::A, a);
        status.set(Register::B, b);
        status.set(Register::C, c);
        status.set(Register::TRIPPED, self.trip);
        Outputs {
            a,
            b,
            c,
            trip: self.trip,
            good: q.quality == Quality::Good,
            status,
            runs: self.runs,
            resets: self.resets,
            now: scan.now,
            elapsed: scan.elapsed,
        }
    }
}
