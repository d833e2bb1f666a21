//! Every refusal of settings: what the user reads. The defaults are accepted.

use latchwork_logic::{
    AlarmUnitSettings, AnalogSettings, BoundsSettings, Gate, MultivibratorSettings, Refusal, Scale, TankSettings,
};

fn text(result: Result<(), Refusal>) -> String {
    result.expect_err("refused").to_string()
}

macro_rules! refused {
    ($type:ty: $({ $($field:ident = $value:expr),* } => $text:literal)*) => {{
        assert_eq!(<$type>::default().check(), Ok(()), "the defaults are accepted");
        $(
            let settings = { let mut s = <$type>::default(); $(s.$field = $value;)* s };
            assert_eq!(text(settings.check()), $text);
        )*
    }};
}

#[test]
fn bounds_limits_the_wrong_way_round_or_a_negative_hysteresis() {
    refused!(BoundsSettings:
        { low_limit = 50.0, high_limit = 10.0 } => "low-limit 50 must be below high-limit 10"
        { low_limit = 50.0 } => "low-limit 50 must be below high-limit 50"
        { low_limit = f64::NAN } => "low-limit NaN must be a finite number"
        { high_limit = f64::INFINITY } => "high-limit inf must be a finite number"
        { hysteresis = -0.5 } => "hysteresis -0.5 must be a finite number, 0 or more"
        { hysteresis = f64::NAN } => "hysteresis NaN must be a finite number, 0 or more"
    );
}

#[test]
fn analog_veracity_step_and_average() {
    refused!(AnalogSettings:
        { max_step = 0.0 } => "max-step 0 must be a finite number above 0"
        { max_step = -1.5 } => "max-step -1.5 must be a finite number above 0"
        { max_step = f64::NAN } => "max-step NaN must be a finite number above 0"
        { max_step = f64::INFINITY } => "max-step inf must be a finite number above 0"
        { average = 0 } => "average 0 must be 1 to 16 samples"
        { average = 17 } => "average 17 must be 1 to 16 samples"
    );
    assert_eq!(AnalogSettings { average: 16, ..AnalogSettings::default() }.check(), Ok(()));
}

#[test]
fn gate_without_inputs_or_with_more_than_there_are() {
    refused!(Gate:
        { inputs = 0 } => "inputs 0 must be 1 to 8"
        { inputs = 9 } => "inputs 9 must be 1 to 8"
    );
}

#[test]
fn multivibrator_times_of_zero() {
    refused!(MultivibratorSettings:
        { on_time = 0 } => "on-time 0 ns must be longer than 0, as in \"500ms\""
        { off_time = 0 } => "off-time 0 ns must be longer than 0, as in \"500ms\""
    );
}

#[test]
fn scale_words_the_wrong_way_round_and_values_that_are_no_numbers() {
    refused!(Scale:
        { raw_low = 9, raw_high = 9 } => "raw-high 9 must be above raw-low 9"
        { raw_low = 900, raw_high = 9 } => "raw-high 9 must be above raw-low 900"
        { low = f64::NAN } => "low NaN must be a finite number"
        { high = f64::NEG_INFINITY } => "high -inf must be a finite number"
    );
    assert_eq!(Scale { low: 60.0, high: 0.0, ..Scale::default() }.check(), Ok(()), "an inverted transmitter");
}

#[test]
fn tank_dimensions_flows_and_start() {
    refused!(TankSettings:
        { height = 0.0 } => "height 0 must be a finite number above 0"
        { area = f64::NAN } => "area NaN must be a finite number above 0"
        { inflow = -1.0 } => "inflow -1 must be a finite number, 0 or more"
        { outflow = -1.0 } => "outflow -1 must be a finite number, 0 or more"
        { leak = f64::INFINITY } => "leak inf must be a finite number, 0 or more"
        { start = -0.1 } => "start -0.1 must be a finite number, 0 or more"
        { start = 6.5 } => "start 6.5 must be at most height 6"
    );
}

#[test]
fn alarm_unit_its_own_and_those_of_its_parts() {
    let scaled = |low, high| Scale { low, high, ..Scale::default() };
    refused!(AlarmUnitSettings:
        { pulse = 0 } => "pulse 0 ns must be longer than 0, as in \"500ms\""
        { scale = scaled(f64::NAN, 60.0) } => "scale-low NaN must be a finite number"
        { scale = scaled(0.0, f64::INFINITY) } => "scale-high inf must be a finite number"
        { scale = scaled(60.0, 60.0) } => "scale-high 60 must be different from scale-low 60"
        { bounds = BoundsSettings { low_limit: 60.0, ..BoundsSettings::default() } }
            => "low-limit 60 must be below high-limit 50"
        { analog = AnalogSettings { average: 0, ..AnalogSettings::default() } } => "average 0 must be 1 to 16 samples"
        { blink = MultivibratorSettings { on_time: 0, off_time: 1 } }
            => "on-time 0 ns must be longer than 0, as in \"500ms\""
    );
}
