//! A bit for each lattice point, at or above the isovalue, and the crossed lattice edges.

use rayon::prelude::*;
use splat_core::Grid;

/// Lattice points of a word.
const WORD: usize = 64;
/// The exponent of what is not finite.
const NOT_FINITE: u32 = 0x7f80_0000;

/// Bits of all rows, lowest x lowest; bits beyond a row are 0.
pub(super) struct Signs {
    pub(super) dims: [usize; 3],
    /// Words of a row.
    pub(super) words: usize,
    bits: Vec<u64>,
}

/// The smallest f32 that is not below `v`: f32 values compare with it as with `v`.
fn at_least(v: f64) -> f32 {
    let near = v as f32;
    if f64::from(near) < v { near.next_up() } else { near }
}

/// Bits of up to 64 values, and whether all are finite.
fn pack(values: &[f32], threshold: f32) -> (u64, bool) {
    let mut above = [0u8; WORD];
    let mut broken = 0u32;
    for (a, v) in above.iter_mut().zip(values) {
        *a = u8::from(*v >= threshold);
        broken |= u32::from(v.to_bits() & NOT_FINITE == NOT_FINITE);
    }
    let mut bits = 0;
    for (i, eight) in above.as_chunks::<8>().0.iter().enumerate() {
        // The product gathers the lowest bit of every byte in the highest byte.
        bits |= (u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
    }
    (bits, broken == 0)
}

impl Signs {
    /// `None` if a value is not finite.
    pub(super) fn new(grid: &Grid, isovalue: f64) -> Option<Self> {
        let [nx, ny, nz] = grid.dims;
        let words = nx.div_ceil(WORD);
        let threshold = at_least(isovalue);
        let mut bits = vec![0u64; words * ny * nz];
        let finite = bits
            .par_chunks_mut(words * ny)
            .zip(grid.values.par_chunks(nx * ny))
            .map(|(bits, values)| {
                let mut finite = true;
                for (bits, row) in bits.chunks_mut(words).zip(values.chunks(nx)) {
                    for (word, values) in bits.iter_mut().zip(row.chunks(WORD)) {
                        let packed = pack(values, threshold);
                        *word = packed.0;
                        finite &= packed.1;
                    }
                }
                finite
            })
            .reduce(|| true, |a, b| a && b);
        finite.then_some(Self { dims: grid.dims, words, bits })
    }

    pub(super) fn row(&self, j: usize, k: usize) -> &[u64] {
        &self.bits[(k * self.dims[1] + j) * self.words..][..self.words]
    }

    /// Word `w` of a row moved by one: bit i is the sign of point i + 1.
    pub(super) fn ahead(row: &[u64], w: usize) -> u64 {
        row[w] >> 1 | row.get(w + 1).map_or(0, |next| next << (WORD - 1))
    }

    /// One bit for each cell of word `w`.
    pub(super) fn cells(&self, w: usize) -> u64 {
        let cells = self.dims[0] - 1 - (w * WORD).min(self.dims[0] - 1);
        if cells >= WORD { u64::MAX } else { (1 << cells) - 1 }
    }

    /// Edges along `axis` from the points of word `w` of row (j, k) whose ends differ.
    pub(super) fn crossed(&self, axis: usize, j: usize, k: usize, w: usize) -> u64 {
        let row = self.row(j, k);
        match axis {
            0 => (row[w] ^ Self::ahead(row, w)) & self.cells(w),
            1 if j + 1 < self.dims[1] => row[w] ^ self.row(j + 1, k)[w],
            2 if k + 1 < self.dims[2] => row[w] ^ self.row(j, k + 1)[w],
            _ => 0,
        }
    }

    /// Calls `visit` with the case of each cell of row (j, k) that the surface crosses, along x.
    pub(super) fn crossed_cells(&self, j: usize, k: usize, mut visit: impl FnMut(u8)) {
        let rows = [self.row(j, k), self.row(j + 1, k), self.row(j, k + 1), self.row(j + 1, k + 1)];
        for w in 0..self.words {
            let here = rows.map(|r| r[w]);
            let ahead = rows.map(|r| Self::ahead(r, w));
            let any = (0..4).fold(0, |a, r| a | here[r] | ahead[r]);
            let every = (0..4).fold(u64::MAX, |a, r| a & here[r] & ahead[r]);
            let mut crossed = any & !every & self.cells(w);
            while crossed != 0 {
                let i = crossed.trailing_zeros();
                crossed &= crossed - 1;
                visit((0..4).fold(0, |case, r| {
                    case | ((here[r] >> i & 1) as u8) << (2 * r) | ((ahead[r] >> i & 1) as u8) << (2 * r + 1)
                }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_comparisons() {
        let values: Vec<f32> = (0..50).map(|i| ((i * 37) % 11) as f32).collect();
        let (bits, finite) = pack(&values, 5.0);
        assert!(finite && (0..64).all(|i| (bits >> i & 1 == 1) == values.get(i).is_some_and(|v| *v >= 5.0)));
        assert!(!pack(&[1.0, f32::NAN], 0.0).1 && !pack(&[f32::NEG_INFINITY], 0.0).1);
        assert!(at_least(0.1) >= 0.1 && f64::from(at_least(0.1).next_down()) < 0.1 && at_least(0.5) == 0.5);
    }
}
