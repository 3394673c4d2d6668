//! LZF (M. Lehmann's LibLZF), a byte-wise compression: runs of literal bytes, and copies of bytes that came before.
//!
//! A control byte c < 32 begins c + 1 literal bytes. Else its upper three bits are the length of a copy minus 2, where 7
//! means that a byte follows which adds to it; its lower five bits and one byte more are the distance minus 1.

/// Most bytes that one byte can stand for: three bytes copy 7 + 255 + 2.
pub(super) const MAX_RATIO: u64 = 88;

/// Appends exactly `length` bytes to the empty `out`, which has the room; `Err` is the byte where that fails.
pub(super) fn unpack(packed: &[u8], out: &mut Vec<u8>, length: usize) -> Result<(), usize> {
    let mut at = 0;
    while let Some(&control) = packed.get(at) {
        let begin = at;
        let control = usize::from(control);
        at += 1;
        if control < 32 {
            let literals = packed.get(at..at + control + 1).filter(|l| l.len() <= length - out.len());
            out.extend_from_slice(literals.ok_or(begin)?);
            at += control + 1;
            continue;
        }
        let mut next = || {
            at += 1;
            packed.get(at - 1).map(|b| usize::from(*b)).ok_or(begin)
        };
        let more = if control >> 5 == 7 { next()? } else { 0 };
        let count = (control >> 5) + more + 2;
        let distance = ((control & 31) << 8) + next()? + 1;
        let from = out.len().checked_sub(distance).ok_or(begin)?;
        if count > length - out.len() {
            return Err(begin);
        }
        // A copy may run into itself: bytes come one by one.
        (from..from + count).for_each(|i| out.push(out[i]));
    }
    if out.len() == length { Ok(()) } else { Err(at) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &[u8], length: usize) -> Result<Vec<u8>, usize> {
        let mut out = Vec::with_capacity(length);
        unpack(packed, &mut out, length).map(|()| out)
    }

    #[test]
    fn literals_copies_and_copies_into_themselves() {
        assert_eq!(unpacked(&[2, b'a', b'b', b'c'], 3), Ok(b"abc".to_vec()));
        // Three bytes from three before; then ten from one before.
        assert_eq!(unpacked(&[2, b'a', b'b', b'c', 1 << 5, 2], 6), Ok(b"abcabc".to_vec()));
        assert_eq!(unpacked(&[0, b'x', 7 << 5, 1, 0], 11), Ok(b"xxxxxxxxxxx".to_vec()));
        let most = unpacked(&[0, b'x', 7 << 5, 255, 0], 265);
        assert_eq!(most, Ok(vec![b'x'; 265]));
    }

    #[test]
    fn what_ends_early_reaches_back_too_far_or_gives_another_length_is_refused() {
        assert_eq!(unpacked(&[2, b'a', b'b'], 3), Err(0));
        assert_eq!(unpacked(&[0, b'a', 1 << 5, 1], 4), Err(2));
        assert_eq!(unpacked(&[0, b'a', 1 << 5], 4), Err(2));
        assert_eq!(unpacked(&[0, b'a', 7 << 5, 3], 4), Err(2));
        assert_eq!(unpacked(&[0, b'a', 1 << 5, 0], 3), Err(2));
        assert_eq!(unpacked(&[0, b'a', 1 << 5, 0], 5), Err(4));
        assert_eq!(unpacked(&[1, b'a', b'b'], 1), Err(0));
    }
}
