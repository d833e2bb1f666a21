//! Tests of the UNICOS CPC objects, at virtual time: a table per object whose rows name the rule, then properties that hold
//! on any input, then the refusals.
//!
//! A table is read from top to bottom with one object. Inputs and commands are words; those not named are false. What is
//! expected is words too, `!word` for what must not be.

// A row of a table is a line.
#[rustfmt::skip]
mod analog_alarm;
#[rustfmt::skip]
mod analog_io;
#[rustfmt::skip]
mod digital_alarm;
#[rustfmt::skip]
mod digital_io;
#[rustfmt::skip]
mod on_off;
#[rustfmt::skip]
mod pco;
mod properties;
mod refusals;

/// A millisecond in ns.
const MS: u64 = 1_000_000;

/// One row of a table: rule, ms since the last execution, inputs, commands, what must come out.
type Row<'a> = (&'a str, u64, &'a str, &'a str, &'a str);

/// A struct of flags from words.
macro_rules! from_words {
    ($words:expr, $into:expr; $($name:literal => $($place:ident).+),* $(,)?) => {{
        let mut all = $into;
        for word in $words.split_whitespace() {
            match word {
                $($name => all.$($place).+ = true,)*
                unknown => panic!("no such word: {unknown}"),
            }
        }
        all
    }};
}
/// The flags of a struct with their names.
macro_rules! to_words {
    ($from:expr; $($name:ident)*) => { vec![$((stringify!($name), $from.$name)),*] };
}
pub(crate) use {from_words, to_words};

/// Compares what came out with what a row expects.
#[track_caller]
fn expect(rule: &str, expected: &str, got: &[(&str, bool)]) {
    for word in expected.split_whitespace() {
        let (name, wanted) = word.strip_prefix('!').map_or((word, true), |name| (name, false));
        let found = got.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("no such word: {name}")).1;
        let set: Vec<&str> = got.iter().filter(|(_, on)| *on).map(|(n, _)| *n).collect();
        assert_eq!(found, wanted, "{rule}: `{name}` among {set:?}");
    }
}
