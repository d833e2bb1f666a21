//! Alarm unit, row "alarm unit": the 15-bit word 0..32767 is scaled to 0..60; and the scale class's documentation.

use latchwork_logic::{Quality, Scale};

#[test]
fn the_15_bit_word_becomes_0_to_60() {
    for (raw, value) in [(0, 0.0), (32_767, 60.0), (16_384, 30.000_915_555_284_28), (5_461, 9.999_694_814_905_24)] {
        let (out, out_of_range) = Scale::default().execute(raw);
        assert!((out.value - value).abs() < 1e-12, "word {raw}: {} instead of {value}", out.value);
        assert_eq!((out.quality, out_of_range), (Quality::Good, false));
    }
}

#[test]
fn the_ends_are_exact_also_where_rounding_would_miss_them() {
    for (low, high) in [(0.1, 0.7), (-273.15, 1e17), (f64::MIN, f64::MAX), (1e-300, 3e300)] {
        let scale = Scale { raw_low: 4_000, raw_high: 20_000, low, high };
        assert_eq!((scale.execute(4_000).0.value, scale.execute(20_000).0.value), (low, high));
    }
}

#[test]
fn a_word_out_of_range_is_extrapolated_and_bad() {
    let scale = Scale { raw_low: 1_000, raw_high: 2_000, low: 0.0, high: 10.0 };
    for (raw, value) in [(0, -10.0), (999, -0.01), (2_001, 10.01), (3_000, 20.0)] {
        let (out, out_of_range) = scale.execute(raw);
        assert!((out.value - value).abs() < 1e-9, "word {raw}: {}", out.value);
        assert_eq!((out.quality, out_of_range), (Quality::Bad, true));
    }
}

#[test]
fn an_inverted_transmitter_falls() {
    let scale = Scale { low: 100.0, high: 0.0, ..Scale::default() };
    assert_eq!((scale.execute(0).0.value, scale.execute(32_767).0.value), (100.0, 0.0));
    assert!(scale.execute(10_000).0.value > scale.execute(10_001).0.value);
}
