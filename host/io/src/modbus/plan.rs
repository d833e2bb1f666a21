//! Which requests a cycle makes: as few as possible, none that a value stands across.

use super::point::{Place, Table};

/// One request: contiguous entries of one table and the points in them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Range {
    pub(super) table: Table,
    pub(super) start: u16,
    pub(super) count: u16,
    /// Numbers of the points, in the order of their addresses.
    pub(super) points: Vec<usize>,
}

impl Range {
    /// One past its last address.
    fn end(&self) -> u32 {
        u32::from(self.start) + u32::from(self.count)
    }

    /// In words.
    pub(super) fn name(&self) -> String {
        self.table.range(self.start, self.count)
    }
}

/// Groups points into contiguous ranges of at most `most(table)` entries. A gap is never bridged: what nobody named
/// may not exist in the device. A value is never split: its halves would come from two moments.
pub(super) fn group(points: impl IntoIterator<Item = (usize, Place)>, most: fn(Table) -> u16) -> Vec<Range> {
    let mut sorted: Vec<(usize, Place)> = points.into_iter().collect();
    sorted.sort_by_key(|(n, p)| (p.table, p.address, p.end(), *n));
    let mut ranges: Vec<Range> = Vec::new();
    for (n, place) in sorted {
        if let Some(last) = ranges.last_mut()
            && last.table == place.table
            && u32::from(place.address) <= last.end()
            && place.end().max(last.end()) - u32::from(last.start) <= u32::from(most(place.table))
        {
            last.count = (place.end().max(last.end()) - u32::from(last.start)) as u16;
            last.points.push(n);
            continue;
        }
        ranges.push(Range { table: place.table, start: place.address, count: place.coding.words(), points: vec![n] });
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::super::codec::{Coding, Words};
    use super::*;
    use proptest::prelude::*;

    fn at(table: Table, address: u16, coding: Coding) -> Place {
        Place { table, address, coding, words: Words::Big, real: false }
    }

    fn reads(places: &[Place]) -> Vec<Range> {
        group(places.iter().copied().enumerate(), Table::most_read)
    }

    #[test]
    fn neighbours_share_a_request_and_gaps_part_them() {
        use Table::*;
        let ranges = reads(&[
            at(HoldingRegister, 12, Coding::U16),
            at(HoldingRegister, 10, Coding::F32),
            at(HoldingRegister, 14, Coding::U16),
            at(Coil, 12, Coding::Bool),
            at(HoldingRegister, 11, Coding::U16),
        ]);
        let short: Vec<_> = ranges.iter().map(|r| (r.name(), r.points.clone())).collect();
        assert_eq!(
            short,
            [
                ("coil 12".into(), vec![3]),
                ("holding registers 10–12".into(), vec![1, 4, 0]),
                ("holding register 14".into(), vec![2])
            ]
        );
    }

    #[test]
    fn a_request_has_a_largest_size_and_no_value_stands_across() {
        let places: Vec<Place> = (0..100).map(|n| at(Table::InputRegister, 1 + 2 * n, Coding::F32)).collect();
        let sizes: Vec<_> = reads(&places).iter().map(|r| (r.start, r.count)).collect();
        assert_eq!(sizes, [(1, 124), (125, 76)]);
        let bits: Vec<Place> = (0..4001).map(|n| at(Table::Coil, n, Coding::Bool)).collect();
        assert_eq!(reads(&bits).iter().map(|r| r.count).collect::<Vec<_>>(), [2000, 2000, 1]);
    }

    fn places() -> impl Strategy<Value = Vec<Place>> {
        let place = (0..4usize, prop_oneof![0..300u16, 65200..=65532u16], 0..3usize).prop_map(|(t, address, c)| {
            let table = Table::ALL[t];
            let coding = if table.is_bits() { Coding::Bool } else { [Coding::U16, Coding::F32, Coding::F64][c] };
            at(table, address, coding)
        });
        prop::collection::vec(place, 0..400)
    }

    proptest! {
        #[test]
        fn every_point_is_read_whole_once_and_nothing_else(places in places()) {
            let ranges = reads(&places);
            let mut seen = vec![0; places.len()];
            for range in &ranges {
                prop_assert!(range.count > 0 && range.count <= range.table.most_read() && range.end() <= 65536);
                for n in &range.points {
                    seen[*n] += 1;
                    let p = places[*n];
                    prop_assert!(p.table == range.table && p.address >= range.start && p.end() <= range.end());
                }
                for entry in u32::from(range.start)..range.end() {
                    let wanted = |n: &usize| u32::from(places[*n].address) <= entry && entry < places[*n].end();
                    prop_assert!(range.points.iter().any(wanted), "{} is asked for by nobody", entry);
                }
            }
            prop_assert!(seen.iter().all(|s| *s == 1));
            // Two requests are only made where one would not do.
            for pair in ranges.windows(2) {
                let joined = pair[1].end().max(pair[0].end()) - u32::from(pair[0].start);
                let touching = pair[0].table == pair[1].table && u32::from(pair[1].start) <= pair[0].end();
                let first = places[pair[1].points[0]];
                let grown = first.end().max(pair[0].end()) - u32::from(pair[0].start);
                prop_assert!(!touching || grown > u32::from(pair[0].table.most_read()), "{joined}");
            }
        }
    }
}
