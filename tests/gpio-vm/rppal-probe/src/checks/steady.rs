//! What a lane costs per edge.

use crate::alloc::count;
use crate::bench::{Lane, pin, pwm, same};
use crate::pi::{self, Pi};
use latchwork_io::direct::Role;

pub(crate) fn no_allocation(pi: &Pi) -> Result<(), String> {
    pi::pwm(0)?;
    pi.pull(17, false);
    let mut lane = Lane::open(vec![
        pin("door", 17, Role::Edge),
        pin("gate", 18, Role::Level),
        pin("slow", 22, Role::Level).with("debounce", latchwork_schema::Value::Duration(1_000_000)),
        pin("trip", 27, Role::Output),
        pwm("fan", 0, 0.0),
    ])?;
    let (mut seen, mut allocated) = (0, 0);
    for n in 0..500_u64 {
        pi.pull(17, n % 2 == 0);
        if !lane.wait(0) {
            return Err("no edge within 2 s".into());
        }
        let before = count();
        let mut trouble = false;
        while lane.direct.edges(0, &mut |_| seen += 1, &mut |_| trouble = true) {}
        for point in 0..3 {
            trouble |= lane.direct.level(point, &mut |_| {}).is_none();
        }
        let duty = (n % 7) as f64 / 7.0;
        lane.direct.write(&[n % 2, duty.to_bits()], &mut |_| trouble = true);
        allocated += count() - before;
        if trouble {
            return Err("something failed".into());
        }
    }
    same("edges", seen, 500)?;
    same("allocations", allocated, 0)
}
