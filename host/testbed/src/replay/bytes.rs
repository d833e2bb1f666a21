//! Small numbers in few bytes, and what changed of a row of cells.

use super::Damaged;

/// Appends a number, 7 bits a byte, low ones first.
pub(super) fn put_number(to: &mut Vec<u8>, mut n: u64) {
    while n >= 0x80 {
        to.push(n as u8 | 0x80);
        n >>= 7;
    }
    to.push(n as u8);
}

/// Appends a difference: small ones of either sign in few bytes.
pub(super) fn put_difference(to: &mut Vec<u8>, from: u64, n: u64) {
    let d = n.wrapping_sub(from).cast_signed();
    put_number(to, ((d << 1) ^ (d >> 63)).cast_unsigned());
}

/// Appends what differs of two rows, and makes the first the second. What differs of a cell are the bytes between its first
/// and its last bit that do: a counter and a real that moves a little have few of them.
pub(super) fn put_cells(to: &mut Vec<u8>, old: &mut [u64], new: &[u64]) {
    let changed = || old.iter().zip(new).enumerate().filter(|(_, (a, b))| a != b);
    put_number(to, changed().count() as u64);
    let mut next = 0;
    for (at, (a, b)) in changed() {
        put_number(to, (at - next) as u64);
        next = at + 1;
        let bits = a ^ b;
        let low = bits.trailing_zeros() / 8;
        let count = 8 - bits.leading_zeros() / 8 - low;
        to.push((low << 4 | count) as u8);
        to.extend_from_slice(&(bits >> (8 * low)).to_le_bytes()[..count as usize]);
    }
    old.copy_from_slice(new);
}

/// Reads what was written so.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn byte(&mut self) -> Result<u8, Damaged> {
        let (first, rest) = self.0.split_first().ok_or(Damaged("it ends in the middle"))?;
        self.0 = rest;
        Ok(*first)
    }

    pub(super) fn take(&mut self, n: usize) -> Result<&'a [u8], Damaged> {
        let (taken, rest) = self.0.split_at_checked(n).ok_or(Damaged("it ends in the middle"))?;
        self.0 = rest;
        Ok(taken)
    }

    pub(super) fn number(&mut self) -> Result<u64, Damaged> {
        let mut n = 0u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            n |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(n);
            }
        }
        Err(Damaged("a number does not end"))
    }

    pub(super) fn difference(&mut self, from: u64) -> Result<u64, Damaged> {
        let n = self.number()?;
        Ok(from.wrapping_add((n >> 1) ^ (n & 1).wrapping_neg()))
    }

    pub(super) fn cells(&mut self, cells: &mut [u64]) -> Result<(), Damaged> {
        let mut next = 0;
        for _ in 0..self.number()? {
            let at = usize::try_from(self.number()?).ok().and_then(|gap| gap.checked_add(next));
            let cell = at.and_then(|at| cells.get_mut(at)).ok_or(Damaged("a cell that the class does not have"))?;
            next = at.unwrap_or(0) + 1;
            let head = self.byte()?;
            let (low, count) = (u32::from(head >> 4), usize::from(head & 15));
            if low as usize + count > 8 {
                return Err(Damaged("a cell of more than eight bytes"));
            }
            let mut bits = [0; 8];
            bits[..count].copy_from_slice(self.take(count)?);
            *cell ^= u64::from_le_bytes(bits).checked_shl(8 * low).unwrap_or(0);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_differences_and_cells_read_back(n: u64, from: u64, rows: Vec<[u64; 3]>, small: Vec<[u8; 3]>) {
            let mut bytes = Vec::new();
            put_number(&mut bytes, n);
            put_difference(&mut bytes, from, n);
            let rows: Vec<_> = rows.into_iter().chain(small.into_iter().map(|r| r.map(u64::from))).collect();
            let mut old = [0; 3];
            rows.iter().for_each(|row| put_cells(&mut bytes, &mut old, row));
            let mut read = Bytes(&bytes);
            prop_assert_eq!(read.number(), Ok(n));
            prop_assert_eq!(read.difference(from), Ok(n));
            let mut cells = [0; 3];
            for row in rows {
                read.cells(&mut cells).unwrap();
                prop_assert_eq!(cells, row);
            }
            prop_assert!(read.is_empty());
        }

        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>) {
            let mut read = Bytes(&bytes);
            while read.cells(&mut [0; 3]).is_ok() && !read.is_empty() {}
        }
    }
}
