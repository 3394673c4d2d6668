//! How the numbers of a field are stored, and reading them one after the other.

/// How the numbers of a field are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stored {
    Single,
    Double,
    /// Whole numbers above `least`, in as few bits as the largest difference takes; times `scale`, plus `offset`.
    Integer {
        least: i64,
        difference: u64,
        scale: f64,
        offset: f64,
    },
}

impl Stored {
    /// Bits of a number.
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::Single => 32,
            Self::Double => 64,
            Self::Integer { difference, .. } => u64::BITS - difference.leading_zeros(),
        }
    }
}

/// The numbers of a field.
pub(super) struct Numbers<'a> {
    stored: Stored,
    bytes: &'a [u8],
    /// Bit that comes next.
    at: usize,
}

impl<'a> Numbers<'a> {
    pub(super) fn new(stored: Stored, bytes: &'a [u8]) -> Self {
        Self { stored, bytes, at: 0 }
    }

    /// The next number, `None` beyond the end or for one above the largest.
    pub(super) fn next(&mut self) -> Option<f64> {
        let bits = self.stored.bits() as usize;
        let byte = self.at / 8;
        let shift = self.at % 8;
        let needed = (shift + bits).div_ceil(8);
        let found = self.bytes.get(byte..byte + needed)?;
        let mut window = [0; 16];
        window[..needed].copy_from_slice(found);
        let raw = (u128::from_le_bytes(window) >> shift) as u64;
        let raw = if bits < 64 { raw & ((1 << bits) - 1) } else { raw };
        self.at += bits;
        Some(match self.stored {
            Stored::Single => f64::from(f32::from_bits(raw as u32)),
            Stored::Double => f64::from_bits(raw),
            Stored::Integer { least, difference, scale, offset } => {
                let whole = (raw <= difference).then(|| least.wrapping_add_unsigned(raw))?;
                whole as f64 * scale + offset
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_take_the_bits_of_their_range_across_bytes() {
        let stored = Stored::Integer { least: -3, difference: 1000, scale: 0.5, offset: 10.0 };
        assert_eq!(stored.bits(), 10);
        let raws = [0u64, 1000, 513, 7, 999];
        let packed = raws.iter().rev().fold(0u128, |bits, raw| bits << 10 | u128::from(*raw)).to_le_bytes();
        let mut numbers = Numbers::new(stored, &packed[..7]);
        for raw in raws {
            assert_eq!(numbers.next(), Some((raw as f64 - 3.0) * 0.5 + 10.0));
        }
        assert_eq!(numbers.next(), None);
        assert_eq!(Numbers::new(stored, &[0xff, 0xff]).next(), None);
        let constant = Stored::Integer { least: 7, difference: 0, scale: 1.0, offset: 0.0 };
        assert_eq!((constant.bits(), Numbers::new(constant, &[]).next()), (0, Some(7.0)));
    }

    #[test]
    fn numbers_of_64_bits_are_read_at_any_bit() {
        let full_range = Stored::Integer { least: i64::MIN, difference: u64::MAX, scale: 1.0, offset: 0.0 };
        assert_eq!(Numbers::new(full_range, &5u64.to_le_bytes()).next(), Some(i64::MIN as f64 + 5.0));
        let wide = Stored::Integer { least: 0, difference: u64::MAX >> 1, scale: 1.0, offset: 0.0 };
        let packed = (u128::from(u64::MAX >> 1) << 63 | 9).to_le_bytes();
        let mut numbers = Numbers::new(wide, &packed);
        assert_eq!([numbers.next(), numbers.next()], [Some(9.0), Some((u64::MAX >> 1) as f64)]);
        assert_eq!(Numbers::new(Stored::Double, &1.5f64.to_le_bytes()).next(), Some(1.5));
        assert_eq!(Numbers::new(Stored::Single, &(-2f32).to_le_bytes()).next(), Some(-2.0));
    }
}
