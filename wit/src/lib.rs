//! The WIT packages of Latchwork as text, for everything that must find them wherever it is built.
//!
//! The `.wit` files beside this crate are the source; other languages' tools read them as files. Rust code reads them
//! from here, so that a block's author needs nothing but the SDK as a dependency. This crate knows no parser and no
//! meaning: only names and texts.
#![no_std]

/// One WIT package: its name and its files.
#[derive(Clone, Copy, Debug)]
pub struct Package {
    /// Name and version, `latchwork:block@0.1.0`.
    pub name: &'static str,
    /// Each file's path below `wit/`, and its text.
    pub files: &'static [(&'static str, &'static str)],
}

/// Types every device class shares, and the log.
pub const BLOCK: Package = Package {
    name: "latchwork:block@0.1.0",
    files: &[
        ("block/log.wit", include_str!("../block/log.wit")),
        ("block/types.wit", include_str!("../block/types.wit")),
    ],
};

/// The device classes shipped with Latchwork, one file each.
pub const DEVICE: Package = Package {
    name: "latchwork:device@0.1.0",
    files: &[
        ("device/alarm-unit.wit", include_str!("../device/alarm-unit.wit")),
        ("device/analog-alarm.wit", include_str!("../device/analog-alarm.wit")),
        ("device/analog-input.wit", include_str!("../device/analog-input.wit")),
        ("device/analog-output.wit", include_str!("../device/analog-output.wit")),
        ("device/analog-veracity.wit", include_str!("../device/analog-veracity.wit")),
        ("device/and.wit", include_str!("../device/and.wit")),
        ("device/bounds-check.wit", include_str!("../device/bounds-check.wit")),
        ("device/ctd.wit", include_str!("../device/ctd.wit")),
        ("device/ctu.wit", include_str!("../device/ctu.wit")),
        ("device/ctud.wit", include_str!("../device/ctud.wit")),
        ("device/digital-alarm.wit", include_str!("../device/digital-alarm.wit")),
        ("device/digital-input.wit", include_str!("../device/digital-input.wit")),
        ("device/digital-output.wit", include_str!("../device/digital-output.wit")),
        ("device/digital-veracity.wit", include_str!("../device/digital-veracity.wit")),
        ("device/f-trig.wit", include_str!("../device/f-trig.wit")),
        ("device/motor.wit", include_str!("../device/motor.wit")),
        ("device/multivibrator.wit", include_str!("../device/multivibrator.wit")),
        ("device/on-off.wit", include_str!("../device/on-off.wit")),
        ("device/or.wit", include_str!("../device/or.wit")),
        ("device/pco.wit", include_str!("../device/pco.wit")),
        ("device/r-trig.wit", include_str!("../device/r-trig.wit")),
        ("device/rs.wit", include_str!("../device/rs.wit")),
        ("device/scale.wit", include_str!("../device/scale.wit")),
        ("device/sr.wit", include_str!("../device/sr.wit")),
        ("device/stress.wit", include_str!("../device/stress.wit")),
        ("device/tank-model.wit", include_str!("../device/tank-model.wit")),
        ("device/tof.wit", include_str!("../device/tof.wit")),
        ("device/ton.wit", include_str!("../device/ton.wit")),
        ("device/tp.wit", include_str!("../device/tp.wit")),
    ],
};

/// Records, and what a logger of them exports.
pub const JOURNAL: Package = Package {
    name: "latchwork:journal@0.1.0",
    files: &[
        ("journal/logger.wit", include_str!("../journal/logger.wit")),
        ("journal/sink.wit", include_str!("../journal/sink.wit")),
        ("journal/types.wit", include_str!("../journal/types.wit")),
    ],
};

/// All packages, each after those it uses.
pub const PACKAGES: &[Package] = &[BLOCK, DEVICE, JOURNAL];
