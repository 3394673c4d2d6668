//! Which voxels are splatted: those that the transfer function may show, and their neighbours that shape them.
//!
//! What a sheet holds is a mean of the voxels whose kernels reach there. Where all of these lie within one interval of values
//! that has no extinction, so does the mean, and nothing is seen. So a voxel is not needed where all that have a share in any place
//! that it shapes are inside one such interval: an erosion of a set of voxels by a neighbourhood ([`Near`]), done on 64 voxels at once.

use super::lattice::Lattice;
use super::lattice::near::Near;
use super::value_range::ValueRange;
use rayon::prelude::*;
use splat_core::TransferFunction;

/// Voxels of a segment: neighbours in a row that are taken together.
pub(crate) const SEGMENT: usize = 8;

/// Intervals without extinction that are told apart; voxels in further ones count as shown.
const MOST_INTERVALS: usize = 8;

/// Two voxels beside each other in a row, as far as they belong to a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct VoxelPair {
    /// Voxels of the set before the first.
    pub(crate) rank: usize,
    pub(crate) has_first: bool,
    pub(crate) has_second: bool,
}

/// Where a voxel lies: its numbers along the axes of the lattice with its rim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct VoxelPlace {
    pub(crate) i: usize,
    pub(crate) j: usize,
    pub(crate) k: usize,
}

/// A set of voxels, a bit each; the bits behind the last voxel of a row are of no meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Voxels {
    dims: [usize; 3],
    /// Words of 64 voxels in a row.
    words: usize,
    bits: Vec<u64>,
}

impl Voxels {
    /// The voxels of `lattice` whose kernels may matter, `hidden` being intervals of values that nothing is seen of, and `near` the voxels that have a
    /// share in anything that one of them shapes.
    pub(crate) fn needed(lattice: &Lattice<'_>, hidden: &[ValueRange], near: &Near) -> Self {
        let dims = lattice.dims;
        let words = dims[0].div_ceil(64);
        let mut needed = Self { dims, words, bits: vec![!0; words * dims[1] * dims[2]] };
        for interval in hidden.iter().take(MOST_INTERVALS) {
            let mut inside = Self::within(lattice, *interval);
            inside.erode(near);
            needed.bits.iter_mut().zip(&inside.bits).for_each(|(needed, hidden)| *needed &= !hidden);
        }
        needed
    }

    /// Bytes that finding them takes: three sets, and two with a word before and behind each row.
    pub(crate) fn bytes(dims: [usize; 3]) -> u64 {
        let [nx, ny, nz] = dims;
        8 * (5 * nx.div_ceil(64) as u64 + 4) * ny as u64 * nz as u64
    }

    /// Bytes that they take.
    pub(crate) fn held(&self) -> u64 {
        8 * self.bits.len() as u64
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

    /// Voxel i of a row and the next one, with the `ranks` of [`Voxels::ranks`]. It is not the last one.
    #[inline(always)]
    pub(crate) fn pair(&self, ranks: &[u64], i: usize, j: usize, k: usize) -> VoxelPair {
        let word_index = (k * self.dims[1] + j) * self.words + i / 64;
        let word = self.bits[word_index];
        let bit = i % 64;
        let next = if bit == 63 { self.bits[word_index + 1] << 1 } else { 0 };
        let pair = word >> bit | next;
        VoxelPair {
            rank: ranks[word_index] as usize + (word & ((1 << bit) - 1)).count_ones() as usize,
            has_first: pair & 1 != 0,
            has_second: pair & 2 != 0,
        }
    }

    /// The voxel of the set before which there are `rank` others, with the `ranks` of [`Voxels::ranks`].
    pub(crate) fn nth(&self, ranks: &[u64], rank: usize) -> VoxelPlace {
        let word_index = ranks.partition_point(|before| *before <= rank as u64) - 1;
        let mut word = self.bits[word_index] & self.inside(word_index);
        for _ in ranks[word_index]..rank as u64 {
            word &= word - 1;
        }
        let row = word_index / self.words;
        let i = word_index % self.words * 64 + word.trailing_zeros() as usize;
        VoxelPlace { i, j: row % self.dims[1], k: row / self.dims[1] }
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

    fn within(lattice: &Lattice<'_>, values: ValueRange) -> Self {
        let ValueRange { least: low, greatest: high } = values;
        let dims = lattice.dims;
        let words = dims[0].div_ceil(64);
        let mut bits = vec![0u64; words * dims[1] * dims[2]];
        let rows = bits.par_chunks_mut(words).enumerate().with_min_len(256);
        rows.for_each_init(Vec::new, |values: &mut Vec<f32>, (row, bits)| {
            let [j, k] = [row % dims[1], row / dims[1]];
            let inside = lattice.rim[0]..dims[0] - lattice.rim[0];
            if lattice.inside(inside.clone(), j, k).is_none() {
                lattice.row(j, k, values);
                let words = bits.iter_mut().zip(values.chunks(64));
                words.for_each(|(word, values)| *word = bits_within(values, low, high));
                return;
            }
            for (w, word) in bits.iter_mut().enumerate() {
                let first = 64 * w;
                if let Some(values) = lattice.inside(first..first + 64, j, k) {
                    *word = bits_within(values, low, high);
                    continue;
                }
                let range = first..(first + 64).min(dims[0]);
                let [from, to] = [inside.start, inside.end].map(|i| i.clamp(range.start, range.end));
                let mut values = [0.0; 64];
                if let Some(inside) = lattice.inside(from..to, j, k) {
                    values[from - first..to - first].copy_from_slice(inside);
                }
                (first..from).chain(to..range.end).for_each(|i| values[i - first] = lattice.value(i, j, k));
                // Places behind the row count as within, as those outside of the lattice do.
                *word = bits_within(&values[..range.len()], low, high);
            }
        });
        Self { dims, words, bits }
    }

    /// Leaves those whose whole neighbourhood, as far as the lattice goes, is in the set.
    fn erode(&mut self, near: &Near) {
        if near.rows.is_empty() { self.erode_block(near.block) } else { self.erode_rows(near) }
    }

    /// Run by run, those of one length after the other: what begins a run that is longer by one begins this run, and one voxel more is in the set.
    fn erode_rows(&mut self, near: &Near) {
        // What a block leaves needs no closer look.
        let mut sure = self.clone();
        sure.erode_block(near.block);
        let [_, ny, nz] = self.dims.map(|n| n as isize);
        let words = self.words;
        let pad = near.block[0] / 32 + 1;
        // Ones before and behind each row.
        let stride = words + 2 * pad;
        let mut padded = vec![!0u64; stride * self.dims[1] * self.dims[2]];
        for (to, from) in padded.chunks_exact_mut(stride).zip(self.bits.chunks_exact(words)) {
            to[pad..pad + words].copy_from_slice(from);
        }
        let mut begins = padded.clone();
        self.bits.fill(!0);
        let longest = near.rows.iter().map(|run| run.length).max().unwrap_or(0);
        for length in 1..=longest {
            if length > 1 {
                let rows = begins.par_chunks_exact_mut(stride).zip(padded.par_chunks_exact(stride)).with_min_len(256);
                rows.for_each(|(begins, padded)| {
                    (0..stride - pad).for_each(|w| begins[w] &= behind(&padded[w..], length as isize - 1));
                });
            }
            let begins = &begins;
            let runs: Vec<_> = near.rows.iter().filter(|run| run.length == length).collect();
            let rows = self.bits.par_chunks_exact_mut(words).zip(sure.bits.par_chunks_exact(words)).enumerate();
            rows.with_min_len(256).for_each(|(row, (out, sure))| {
                let j = row as isize % ny;
                let k = row as isize / ny;
                for w in (0..words).filter(|w| sure[*w] != !0) {
                    for run in &runs {
                        let j = j + run.j;
                        let k = k + run.k;
                        if out[w] == 0 {
                            break;
                        }
                        if (0..ny).contains(&j) && (0..nz).contains(&k) {
                            let row = &begins[(k * ny + j) as usize * stride..][..stride];
                            out[w] &= behind(&row[w..], 64 * pad as isize + run.first);
                        }
                    }
                }
            });
        }
    }

    fn erode_block(&mut self, reach: [usize; 3]) {
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
        let plane = words * ny;
        let old = self.bits.clone();
        let along = |bits: &mut Vec<u64>, old: &[u64], stride: usize, n: usize, reach: usize| {
            bits.par_chunks_mut(words).enumerate().with_min_len(256).for_each(|(row, out)| {
                let place = row * words / stride % n;
                let here = row * words;
                for other in place.saturating_sub(reach)..=(place + reach).min(n - 1) {
                    let from = &old[here + other * stride - place * stride..][..words];
                    out.iter_mut().zip(from).for_each(|(out, from)| *out &= from);
                }
            });
        };
        along(&mut self.bits, &old, words, ny, reach[1]);
        let old = self.bits.clone();
        along(&mut self.bits, &old, plane, nz, reach[2]);
    }
}

/// Which of up to 64 values lie within two others, a bit each.
#[inline(always)]
fn bits_within(values: &[f32], low: f32, high: f32) -> u64 {
    let mut is = [1u8; 64];
    // Places behind the values count as within, as those outside of the lattice do.
    is.iter_mut().zip(values).for_each(|(is, v)| *is = u8::from((*v >= low) & (*v <= high)));
    // The lowest bits of eight bytes, beside each other.
    let bits = |eight: &[u8; 8]| u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
    is.as_chunks().0.iter().rev().fold(0, |word, eight| word << 8 | bits(eight))
}

/// The word that begins `step` bits behind the beginning of a row.
#[inline(always)]
fn behind(row: &[u64], step: isize) -> u64 {
    let word = step as usize / 64;
    let bit = step as usize % 64;
    row[word] >> bit | row[word + 1] << 1 << (63 - bit)
}

/// Word `w` of a row moved by `step` bits to higher places, ones from outside.
fn shifted(row: &[u64], w: usize, step: isize) -> u64 {
    let first = 64 * w as isize - step;
    let word = first.div_euclid(64);
    let bit = first.rem_euclid(64);
    let word_at = |word: isize| usize::try_from(word).ok().and_then(|w| row.get(w)).copied().unwrap_or(!0);
    if bit == 0 { word_at(word) } else { word_at(word) >> bit | word_at(word + 1) << (64 - bit) }
}

/// Maximal intervals of values at which there is no extinction, ascending.
pub(crate) fn without_extinction(transfer: &TransferFunction) -> Vec<ValueRange> {
    let points = transfer.points();
    let mut out: Vec<ValueRange> = Vec::new();
    for (i, p) in points.iter().enumerate().filter(|(_, p)| p.extinction == 0.0) {
        let least = if i == 0 { f32::NEG_INFINITY } else { p.value };
        let greatest = if i + 1 == points.len() { f32::INFINITY } else { p.value };
        match out.last_mut().filter(|_| i > 0 && points[i - 1].extinction == 0.0) {
            Some(last) => last.greatest = greatest,
            None => out.push(ValueRange { least, greatest }),
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
        let range = |least: f32, greatest: f32| ValueRange { least, greatest };
        assert_eq!(without_extinction(&tf), [range(-inf, 1.0), range(3.0, 3.0), range(5.0, inf)]);
        assert!(without_extinction(&transfer(&[(0.0, 1.0)])).is_empty());
        assert_eq!(without_extinction(&transfer(&[(0.0, 0.0)])), [range(-inf, inf)]);
    }

    /// The definition, voxel by voxel.
    #[test]
    fn needed_voxels_are_those_of_the_definition() {
        let tf = transfer(&[(0.25, 0.0), (0.3, 1.0), (0.35, 0.0), (0.995, 0.0), (1.0, 1.0)]);
        let dims = [70, 13, 15];
        let steps = DMat3::from_cols(DVec3::X, DVec3::new(0.4, 0.9, 0.0), DVec3::Z);
        let [nx, ny, nz] = dims;
        // Few that are shown, in much of two intervals that are not.
        let value = |i: usize| match rng::unit_f32(7, 0, i as u64, 0) {
            shown if shown < 0.001 => 0.3 + 50.0 * shown,
            _ if i < 1500 => 0.1,
            _ => 0.7,
        };
        let values = (0..nx * ny * nz).map(value).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values };
        let value = |[i, j, k]: [usize; 3]| grid.values[(k * ny + j) * nx + i];
        // A ball along a way.
        let directions = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.6, -0.64, 0.48)];
        let reach = |n: DVec3| 1.3 * n.length() + 1.5 * n.dot(DVec3::new(0.5, -0.3, 0.8)).abs();
        let slanted = Near::within(&steps, &directions, reach);
        let is_slanted = |d: DVec3| directions.iter().all(|n| n.dot(steps * d).abs() <= reach(*n));
        let is_block = |d: DVec3| d.x.abs() <= 2.0 && d.y.abs() <= 1.0 && d.z.abs() <= 3.0;
        type IsNear<'a> = &'a dyn Fn(DVec3) -> bool;
        let cases: [(Near, IsNear<'_>); 2] = [(Near::block([2, 1, 3]), &is_block), (slanted, &is_slanted)];
        let lattice = Lattice::new(&grid, Packing::Cartesian, [0; 3]);
        for (near, is_near) in cases {
            let voxels_between = |first: [usize; 3], end: [usize; 3]| {
                let range = move |a: usize| first[a]..end[a].min(dims[a]);
                range(2).flat_map(move |k| range(1).flat_map(move |j| range(0).map(move |i| [i, j, k])))
            };
            let is_hidden = |c: [usize; 3]| {
                let apart = |v: [usize; 3]| DVec3::from_array([0, 1, 2].map(|a| v[a] as f64 - c[a] as f64));
                let around =
                    || voxels_between(c.map(|n| n.saturating_sub(4)), c.map(|n| n + 5)).filter(|v| is_near(apart(*v)));
                let within = |range: ValueRange| around().all(|v| (range.least..=range.greatest).contains(&value(v)));
                without_extinction(&tf).into_iter().any(within)
            };
            let found = Voxels::needed(&lattice, &without_extinction(&tf), &near);
            let mut count = 0;
            for c in voxels_between([0; 3], dims) {
                let [i, j, k] = c;
                assert_eq!(found.has(i, j, k), !is_hidden(c), "{c:?}");
                count += u64::from(!is_hidden(c));
            }
            assert_eq!(found.count(), count);
            let ranks = found.ranks();
            let in_order = voxels_between([0; 3], dims).filter(|[i, j, k]| found.has(*i, *j, *k));
            for (rank, [i, j, k]) in in_order.enumerate() {
                assert_eq!(found.nth(&ranks, rank), VoxelPlace { i, j, k });
            }
            assert!(count > 0 && count < (nx * ny * nz) as u64, "{count}");
        }
    }
}
