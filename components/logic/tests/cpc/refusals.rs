//! Every refusal of settings: what the user reads. The defaults are accepted.

use latchwork_logic::cpc::{
    AnalogAlarmSettings, AnalogInputSettings, AnalogOutputSettings, OnOffSettings, PcoSettings, Thresholds,
};

macro_rules! refused {
    ($type:ty: $({ $($field:ident = $value:expr),* } => $text:literal)*) => {{
        assert_eq!(<$type>::default().check(), Ok(()), "the defaults are accepted");
        $(
            let settings = { let mut s = <$type>::default(); $(s.$field = $value;)* s };
            assert_eq!(settings.check().expect_err("refused").to_string(), $text);
        )*
    }};
}

#[test]
fn analog_input() {
    refused!(AnalogInputSettings:
        { raw_low = f64::NAN } => "raw-low NaN must be a finite number"
        { raw_high = 0.0 } => "raw-high 0 must be above raw-low 0"
        { high = 0.0 } => "high 0 must be different from low 0"
        { low = f64::INFINITY } => "low inf must be a finite number"
        { margin = -1.0 } => "margin -1 must be a finite number, 0 or more"
        { deadband = f64::NAN } => "deadband NaN must be a finite number, 0 or more"
        { forced_value = f64::NAN } => "forced-value NaN must be a finite number"
    );
}

#[test]
fn analog_output() {
    refused!(AnalogOutputSettings:
        { raw_low = 40_000.0 } => "raw-high 32767 must be above raw-low 40000"
        { high = 0.0 } => "high 0 must be different from low 0"
        { rate_limit = -0.5 } => "rate-limit -0.5 must be a finite number, 0 or more"
        { start = f64::NAN } => "start NaN must be a finite number"
        { forced_value = f64::INFINITY } => "forced-value inf must be a finite number"
    );
    let current = AnalogOutputSettings { low: 4.0, high: 20.0, ..AnalogOutputSettings::default() };
    assert_eq!(current.check(), Ok(()), "the defaults of start and forced-value do for a range that excludes 0");
}

#[test]
fn analog_alarm() {
    let limits = |ll, l, h, hh| Thresholds { hh, h, l, ll };
    refused!(AnalogAlarmSettings:
        { limits = limits(10.0, 20.0, 80.0, 70.0) } => "hh 70 must be above h 80"
        { limits = limits(10.0, 20.0, 20.0, 90.0) } => "h 20 must be above l 20"
        { limits = limits(30.0, 20.0, 80.0, 90.0) } => "l 20 must be above ll 30"
        { limits = limits(10.0, f64::NAN, 80.0, 90.0) } => "l NaN must be a finite number"
        { hysteresis = -1.0 } => "hysteresis -1 must be a finite number, 0 or more"
        { hysteresis = 60.5 } => "hysteresis 60.5 must be at most the distance of the lower and the upper limits, 60"
        { used = Thresholds { hh: true, ll: true, ..Thresholds::default() }, hysteresis = 81.0 }
            => "hysteresis 81 must be at most the distance of the lower and the upper limits, 80"
    );
    let used = Thresholds { hh: true, h: true, ..Thresholds::default() };
    let limits = limits(f64::NAN, 900.0, 80.0, 90.0);
    let high_only = AnalogAlarmSettings { used, limits, hysteresis: 1e6, ..AnalogAlarmSettings::default() };
    assert_eq!(high_only.check(), Ok(()), "limits that are not used may be anything");
}

#[test]
fn on_off_and_pco() {
    refused!(OnOffSettings:
        { feedback_timeout = 0 } => "feedback-timeout 0 ns must be longer than 0, as in \"500ms\""
    );
    refused!(PcoSettings:
        { start_mode = 0 } => "start-mode 0 must be 1 to 8"
        { start_mode = 9 } => "start-mode 9 must be 1 to 8"
    );
}
