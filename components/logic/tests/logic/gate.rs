//! IEC 61131-3:2013 table 31: AND and OR with any number of inputs.

use latchwork_logic::Gate;

/// The inputs whose bits are set, `in1` the lowest.
fn inputs(bits: u8) -> [bool; 8] {
    std::array::from_fn(|i| bits >> i & 1 == 1)
}

#[test]
fn and_or_truth_table_of_two() {
    for (bits, and, or) in [(0b00, false, false), (0b01, false, true), (0b10, false, true), (0b11, true, true)] {
        let gate = Gate::default();
        assert_eq!((gate.and(inputs(bits)), gate.or(inputs(bits))), (and, or), "{bits:02b}");
    }
}

#[test]
fn any_number_of_inputs_and_those_beyond_it_do_not_count() {
    for number in 1..=8 {
        let (gate, counting) = (Gate { inputs: number }, u8::MAX >> (8 - number));
        for bits in 0..=u8::MAX {
            assert_eq!(gate.and(inputs(bits)), bits & counting == counting, "AND of {number}: {bits:08b}");
            assert_eq!(gate.or(inputs(bits)), bits & counting != 0, "OR of {number}: {bits:08b}");
        }
    }
}
