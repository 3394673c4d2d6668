//! Which voxels are splatted: those that the transfer function may show, and their neighbours that shape them.
//!
//! What a sheet holds is a mean of the voxels whose kernels reach there. Where all of these lie within one interval of values
//! that has no extinction, so does the mean, and nothing is seen. So a point is hidden exactly where its neighbourhood is
//! inside one such interval, and a voxel is needed where a point of its neighbourhood is not hidden. Both are erosions of
//! sets of voxels by a box, done on 64 voxels at once.

use crate::lattice::Lattice;
use rayon::prelude::*;
use splat_core::TransferFunction;

/// Intervals without extinction that are told apart; voxels in further ones count as shown.
const MOST_INTERVALS: usize = 8;

/// A set of voxels, a bit each; the bits behind the last voxel of a row are of no meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Voxels {
    dims: [usize; 3],
    /// Words of 64 voxels in a row.
    words: usize,
    bits: Vec<u64>,
}

impl Voxels {
    /// The voxels of `lattice` whose kernels may matter, each reaching `reach` steps along the axes.
    pub(crate) fn needed(lattice: &Lattice<'_>, transfer: &TransferFunction, reach: [usize; 3]) -> Self {
        let mut hidden: Option<Self> = None;
        for interval in without_extinction(transfer).into_iter().take(MOST_INTERVALS) {
            let mut inside = Self::within(lattice, interval);
            inside.erode(reach);
            match &mut hidden {
                None => hidden = Some(inside),
                Some(hidden) => hidden.bits.iter_mut().zip(&inside.bits).for_each(|(h, i)| *h |= i),
            }
        }
        let Some(mut hidden) = hidden else {
            let (dims, words) = (lattice.dims, lattice.dims[0].div_ceil(64));
            return Self { dims, words, bits: vec![!0; words * dims[1] * dims[2]] };
        };
        hidden.erode(reach);
        hidden.bits.iter_mut().for_each(|word| *word = !*word);
        hidden
    }

    /// Bytes that finding them takes.
    pub(crate) fn bytes(dims: [usize; 3]) -> u64 {
        4 * 8 * dims[0].div_ceil(64) as u64 * dims[1] as u64 * dims[2] as u64
    }

    /// Voxels 8·`eighth` to 8·`eighth` + 7 of a row, a bit each.
    #[inline(always)]
    pub(crate) fn eight(&self, eighth: usize, j: usize, k: usize) -> u8 {
        let word = self.bits[(k * self.dims[1] + j) * self.words + eighth / 8];
        let inside = (self.dims[0] - 8 * eighth).min(8);
        (word >> (eighth % 8 * 8)) as u8 & (0xff >> (8 - inside))
    }

    /// Voxels along each axis, with the rim.
    pub(crate) fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Whether a voxel is one of them.
    #[inline(always)]
    pub(crate) fn has(&self, i: usize, j: usize, k: usize) -> bool {
        self.bits[(k * self.dims[1] + j) * self.words + i / 64] >> (i % 64) & 1 != 0
    }

    /// How many there are before each word of 64.
    pub(crate) fn ranks(&self) -> Vec<u64> {
        let mut before = 0;
        let rank = |(w, word): (usize, &u64)| {
            let rank = before;
            before += u64::from((word & self.inside(w)).count_ones());
            rank
        };
        self.bits.iter().enumerate().map(rank).collect()
    }

    /// How many there are before voxel i of a row, and, a bit each, whether it and the next one are of them. It is not the last one.
    #[inline(always)]
    pub(crate) fn pair(&self, ranks: &[u64], i: usize, j: usize, k: usize) -> (usize, u64) {
        let at = (k * self.dims[1] + j) * self.words + i / 64;
        let (word, bit) = (self.bits[at], i % 64);
        let next = if bit == 63 { self.bits[at + 1] << 1 } else { 0 };
        (ranks[at] as usize + (word & ((1 << bit) - 1)).count_ones() as usize, (word >> bit | next) & 3)
    }

    /// The bits of a word that are voxels.
    fn inside(&self, word: usize) -> u64 {
        let last = self.dims[0] % 64;
        if last == 0 || word % self.words + 1 < self.words { !0 } else { (1 << last) - 1 }
    }

    /// How many there are.
    pub(crate) fn count(&self) -> u64 {
        let word = |(w, word): (usize, &u64)| u64::from((word & self.inside(w)).count_ones());
        self.bits.par_iter().enumerate().with_min_len(1 << 14).map(word).sum()
    }

    fn within(lattice: &Lattice<'_>, [low, high]: [f32; 2]) -> Self {
        let (dims, words) = (lattice.dims, lattice.dims[0].div_ceil(64));
        let mut bits = vec![0u64; words * dims[1] * dims[2]];
        let rows = bits.par_chunks_mut(words).enumerate().with_min_len(256);
        rows.for_each_init(Vec::new, |values: &mut Vec<f32>, (row, bits)| {
            lattice.row(row % dims[1], row / dims[1], values);
            for (word, values) in bits.iter_mut().zip(values.chunks(64)) {
                *word = (values.iter().rev()).fold(0, |w, v| w << 1 | u64::from((*v >= low) & (*v <= high)));
                // What lies outside hides nothing.
                *word |= (!0u64).checked_shl(values.len() as u32).unwrap_or(0);
            }
        });
        Self { dims, words, bits }
    }

    /// Leaves those whose whole neighbourhood, as far as the lattice goes, is in the set.
    fn erode(&mut self, reach: [usize; 3]) {
        let words = self.words;
        self.bits.par_chunks_mut(words).with_min_len(256).for_each_init(Vec::new, |old: &mut Vec<u64>, row| {
            old.clear();
            old.extend_from_slice(row);
            for (w, word) in row.iter_mut().enumerate() {
                for step in 1..=reach[0].min(64 * words) {
                    *word &= shifted(old, w, step as isize) & shifted(old, w, -(step as isize));
                }
            }
        });
        let [_, ny, nz] = self.dims;
        let (plane, old) = (words * ny, self.bits.clone());
        let along = |bits: &mut Vec<u64>, old: &[u64], stride: usize, n: usize, reach: usize| {
            bits.par_chunks_mut(words).enumerate().with_min_len(256).for_each(|(row, out)| {
                let (at, here) = (row * words / stride % n, row * words);
                for other in at.saturating_sub(reach)..=(at + reach).min(n - 1) {
                    let from = &old[here + other * stride - at * stride..][..words];
                    out.iter_mut().zip(from).for_each(|(out, from)| *out &= from);
                }
            });
        };
        along(&mut self.bits, &old, words, ny, reach[1]);
        let old = self.bits.clone();
        along(&mut self.bits, &old, plane, nz, reach[2]);
    }
}

/// Word `w` of a row moved by `step` bits to higher places, ones from outside.
fn shifted(row: &[u64], w: usize, step: isize) -> u64 {
    let first = 64 * w as isize - step;
    let (word, bit) = (first.div_euclid(64), first.rem_euclid(64));
    let at = |word: isize| usize::try_from(word).ok().and_then(|w| row.get(w)).copied().unwrap_or(!0);
    if bit == 0 { at(word) } else { at(word) >> bit | at(word + 1) << (64 - bit) }
}

/// Maximal intervals of values at which there is no extinction, ascending.
pub(crate) fn without_extinction(transfer: &TransferFunction) -> Vec<[f32; 2]> {
    let points = transfer.points();
    let mut out: Vec<[f32; 2]> = Vec::new();
    for (i, p) in points.iter().enumerate().filter(|(_, p)| p.extinction == 0.0) {
        let low = if i == 0 { f32::NEG_INFINITY } else { p.value };
        let high = if i + 1 == points.len() { f32::INFINITY } else { p.value };
        match out.last_mut().filter(|_| i > 0 && points[i - 1].extinction == 0.0) {
            Some(last) => last[1] = high,
            None => out.push([low, high]),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};
    use splat_core::{Grid, Packing, TransferPoint, rng};

    fn transfer(points: &[(f32, f32)]) -> TransferFunction {
        let point = |&(value, extinction): &(f32, f32)| TransferPoint { value, color: [1.0; 3], extinction };
        TransferFunction::new(points.iter().map(point).collect()).unwrap()
    }

    #[test]
    fn intervals_without_extinction_are_maximal() {
        let tf = transfer(&[(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 0.0), (4.0, 2.0), (5.0, 0.0)]);
        let inf = f32::INFINITY;
        assert_eq!(without_extinction(&tf), [[-inf, 1.0], [3.0, 3.0], [5.0, inf]]);
        assert!(without_extinction(&transfer(&[(0.0, 1.0)])).is_empty());
        assert_eq!(without_extinction(&transfer(&[(0.0, 0.0)])), [[-inf, inf]]);
    }

    /// The definition, voxel by voxel.
    #[test]
    fn needed_voxels_are_those_of_the_definition() {
        let tf = transfer(&[(0.25, 0.0), (0.3, 1.0), (0.35, 0.0), (0.995, 0.0), (1.0, 1.0)]);
        let (dims, reach) = ([70, 9, 11], [2usize, 1, 3]);
        let [nx, ny, nz] = dims;
        // Few that are shown, in much of two intervals that are not.
        let value = |i: usize| match rng::unit_f32(7, 0, i as u64, 0) {
            shown if shown < 0.001 => 0.3 + 50.0 * shown,
            _ if i < 1500 => 0.1,
            _ => 0.7,
        };
        let values = (0..nx * ny * nz).map(value).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values };
        let around = |c: [usize; 3]| {
            let range = move |a: usize| c[a].saturating_sub(reach[a])..=(c[a] + reach[a]).min(dims[a] - 1);
            range(2).flat_map(move |k| range(1).flat_map(move |j| range(0).map(move |i| [i, j, k])))
        };
        let value = |[i, j, k]: [usize; 3]| grid.values[(k * ny + j) * nx + i];
        let hidden = |c: [usize; 3]| {
            let within = |[low, high]: [f32; 2]| around(c).all(|v| (low..=high).contains(&value(v)));
            without_extinction(&tf).into_iter().any(within)
        };
        let found =
            Voxels::needed(&Lattice { grid: &grid, packing: Packing::Cartesian, rim: [0; 3], dims }, &tf, reach);
        let mut count = 0;
        for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
            let expected = around([i, j, k]).any(|c| !hidden(c));
            assert_eq!(found.eight(i / 8, j, k) >> (i % 8) & 1 == 1, expected, "{i} {j} {k}");
            count += u64::from(expected);
        }
        assert_eq!(found.count(), count);
        assert!(count > 0 && count < (nx * ny * nz) as u64, "{count}");
    }
}
