//! PWM, as far as plain files in place of the kernel's tell.

use crate::bench::{Lane, pwm, same, told};
use crate::pi::{self, Pi, get};
use latchwork_schema::{Constant, Value};

pub(crate) fn duty(_: &Pi) -> Result<(), String> {
    let channel = pi::pwm(1)?;
    let shown = |file: &str| get(channel.join(file));
    let frequency = || Value::Constant(Constant::Integer(25_000));
    let mut lane = Lane::open(vec![pwm("fan", 1, 0.75).with("frequency", frequency())])?;
    same("the period", shown("period")?.as_str(), "40000")?;
    same("it runs", shown("enable")?.as_str(), "1")?;
    same("the width at the beginning", shown("duty_cycle")?.as_str(), "30000")?;
    let cases =
        [(0.5, "20000"), (-1.0, "0"), (2.0, "40000"), (f64::NAN, "30000"), (f64::INFINITY, "40000"), (0.1, "4000")];
    for (duty, width) in cases {
        lane.write(&[f64::to_bits(duty)]);
        same(&format!("the width for {duty}"), shown("duty_cycle")?.as_str(), width)?;
    }
    drop(lane);
    same("the width at the end", shown("duty_cycle")?.as_str(), "30000")?;
    same("it runs on", shown("enable")?.as_str(), "1")?;
    let mut lane = Lane::closed(vec![pwm("pump", 3, 0.0)])?;
    lane.try_open();
    lane.try_open();
    same("events for a channel that is not there", lane.told.len(), 1)?;
    told(&lane.told, "pi.pump refused", &["no PWM channel 3"])
}
