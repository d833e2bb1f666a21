//! The control logic of Latchwork's blocks: what they decide, without how they are called.
//!
//! It owns the state machines of the IEC 61131-3 standard blocks, of the alarm unit, of the UNICOS CPC objects ([`cpc`])
//! and of the tank model. It knows no WebAssembly, no WIT and no clock: time comes in as nanoseconds elapsed, so every
//! test runs at virtual time. The component crates beside it only translate between their device class and this.
//!
//! ```text
//! timers ──┬─► veracity (digital) ──┐
//! flip-flops ──────────────────────┬┤
//! scale ──► veracity (analogue) ──►│├─► alarm unit
//! bounds, multivibrator ───────────┘┘          counters, gate, tank: alone
//! ```
//!
//! Rules that hold everywhere:
//! - Nothing panics on any input: NaN, infinities, 0 and `u64::MAX` of time, settings that `check` would have refused.
//! - Time saturates, counters saturate; nothing wraps.
//! - State is plain data: what a block carries over a restart can be read and written field by field.
#![no_std]

mod alarm_unit;
mod bounds;
mod counters;
pub mod cpc;
mod flip_flops;
mod gate;
mod multivibrator;
mod number;
mod refusal;
mod scale;
mod signal;
mod tank;
mod timers;
mod veracity;

pub use alarm_unit::{
    AlarmUnit, AlarmUnitCommands, AlarmUnitInputs, AlarmUnitOutputs, AlarmUnitSettings, AlarmUnitState,
};
pub use bounds::{BoundsCheck, BoundsSettings};
pub use counters::{Ctd, Ctu, Ctud};
pub use flip_flops::{FTrig, RTrig, Rs, Sr};
pub use gate::Gate;
pub use multivibrator::{Multivibrator, MultivibratorSettings};
pub use refusal::Refusal;
pub use scale::Scale;
pub use signal::{Quality, Signal};
pub use tank::{Tank, TankInputs, TankOutputs, TankSettings};
pub use timers::{Tof, Ton, Tp};
pub use veracity::{AnalogSettings, AnalogState, AnalogVeracity, DigitalState, DigitalVeracity};
