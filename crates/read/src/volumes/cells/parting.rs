//! Cells that samples miss, parted exactly between voxels.
//!
//! A layer that is thinner than the distance of samples has one of them by chance or none at all. So every voxel that such a cell
//! touches is computed anew: all cells in it are cut along its sides into tetrahedra, over each of which a linear field has the integral of its mean value. The
//! integral over those voxels is exact, also of cells far thinner than a voxel.

use super::resample::{Body, Knot, Tetrahedron, volume};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::{DVec3, USizeVec3};
use std::ops::Range;

/// Pieces that are cut in a part of the volume, at most: beyond that samples have to do. Voxels that are looked at count as a share of one.
const MOST_PIECES: u64 = 1 << 23;
const VOXELS_OF_A_PIECE: u64 = 32;

/// The rank of a voxel that no thin cell touches.
const NONE: u32 = u32::MAX;

/// Planes of voxels, in voxels along each axis.
pub(super) struct Planes {
    pub(super) dims: USizeVec3,
    /// Which of them along z.
    pub(super) along_z: Range<usize>,
}

/// What cells put into a voxel, whose volume is 1.
#[derive(Clone, Copy, Default)]
struct Share {
    /// The volume of what has a value, and the integral of it.
    filled: f64,
    sum: f64,
    /// The volume of what has none.
    gap: f64,
}

/// The voxels of some planes that are computed exactly.
pub(super) struct Parting {
    planes: Planes,
    /// Rank of each voxel among the shares.
    ranks: Vec<u32>,
    shares: Vec<Share>,
    pieces: u64,
}

/// The voxels from the first to the last that a tetrahedron touches.
struct Touched {
    first: USizeVec3,
    last: USizeVec3,
}

impl Parting {
    /// Without any voxel.
    pub(super) fn new(planes: Planes, reading: &Reading<'_>) -> Result<Self, ReadError> {
        let count = planes.dims.x * planes.dims.y * planes.along_z.len();
        input::hold("the ranks of voxels", (count * size_of::<u32>()) as u64, reading.params)?;
        let mut ranks = Vec::new();
        input::reserve(&mut ranks, count)?;
        ranks.resize(count, NONE);
        Ok(Self { planes, ranks, shares: Vec::new(), pieces: 0 })
    }

    /// Has every voxel that a cell may touch computed exactly; `corner` gives its points in voxels.
    pub(super) fn mark(&mut self, body: &Body<'_>, corner: &impl Fn(u32) -> Knot) {
        body.part(corner, |tetrahedron| {
            let Some(touched) = self.touched(tetrahedron) else { return };
            let mut next = self.shares.len() as u32;
            for row in self.rows(&touched) {
                for rank in self.ranks[row].iter_mut().filter(|rank| **rank == NONE) {
                    *rank = next;
                    next += 1;
                }
            }
            self.shares.resize(next as usize, Share::default());
        });
    }

    /// Whether no voxel is marked.
    pub(super) fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }

    /// Bytes of what the marked voxels take.
    pub(super) fn bytes(&self) -> u64 {
        size_of_val(self.shares.as_slice()) as u64
    }

    /// Puts a cell into the voxels that are marked.
    pub(super) fn fill(&mut self, body: &Body<'_>, corner: &impl Fn(u32) -> Knot) {
        body.part(corner, |tetrahedron| self.cut(tetrahedron));
    }

    /// Whether all cells were parted.
    pub(super) fn is_whole(&self) -> bool {
        self.pieces <= MOST_PIECES
    }

    /// The marked voxels by their rank in the planes, each with its mean above the value outside.
    pub(super) fn means(&self) -> impl Iterator<Item = (usize, f64)> {
        let marked = self.ranks.iter().enumerate().filter(|(_, rank)| **rank != NONE);
        marked.map(|(voxel, rank)| (voxel, self.shares[*rank as usize].mean()))
    }

    /// The voxels around a tetrahedron; `None` of one beside the planes.
    fn touched(&self, tetrahedron: &Tetrahedron) -> Option<Touched> {
        let corner = tetrahedron[0].place;
        let (low, high) = tetrahedron.iter().fold((corner, corner), |(l, h), k| (l.min(k.place), h.max(k.place)));
        let Planes { dims, along_z } = &self.planes;
        let most = DVec3::new((dims.x - 1) as f64, (dims.y - 1) as f64, (dims.z - 1) as f64);
        let first = low.floor().clamp(DVec3::ZERO, most);
        let last = (high.ceil() - 1.0).clamp(first, most);
        let whole = |place: DVec3| USizeVec3::new(place.x as usize, place.y as usize, place.z as usize);
        let mut first = whole(first);
        let mut last = whole(last);
        if last.z < along_z.start || first.z >= along_z.end {
            return None;
        }
        first.z = first.z.max(along_z.start);
        last.z = last.z.min(along_z.end - 1);
        Some(Touched { first, last })
    }

    /// The rows of voxels, as ranges among those of the planes.
    fn rows(&self, touched: &Touched) -> impl Iterator<Item = Range<usize>> + use<> {
        let Touched { first, last } = *touched;
        let USizeVec3 { x: nx, y: ny, .. } = self.planes.dims;
        let start = self.planes.along_z.start;
        (first.z..=last.z).flat_map(move |k| {
            (first.y..=last.y).map(move |j| {
                let row = nx * (j + ny * (k - start));
                row + first.x..row + last.x + 1
            })
        })
    }

    /// Cuts a tetrahedron until each piece lies in one voxel.
    fn cut(&mut self, tetrahedron: &Tetrahedron) {
        if !self.is_whole() {
            return;
        }
        let Some(touched) = self.touched(tetrahedron) else { return };
        let across = touched.last - touched.first;
        let sizes = across + USizeVec3::ONE;
        self.pieces += 1 + (sizes.x * sizes.y * sizes.z) as u64 / VOXELS_OF_A_PIECE;
        if self.rows(&touched).all(|row| self.ranks[row].iter().all(|rank| *rank == NONE)) {
            return;
        }
        // Along z it may reach beyond the planes, where it is cut off.
        let reach = |high: f64, last: usize| high > (last + 1) as f64;
        let [low, high] = [f64::min, f64::max].map(|of| tetrahedron.iter().map(|k| k.place.z).reduce(of).unwrap_or(0.0));
        let cut_off = if reach(high, touched.last.z) && touched.last.z + 1 < self.planes.dims.z {
            Some((2, touched.last.z + 1))
        } else if low < touched.first.z as f64 && touched.first.z > 0 {
            Some((2, touched.first.z))
        } else {
            None
        };
        let longest = [across.x, across.y, across.z].into_iter().enumerate().max_by_key(|(_, n)| *n);
        let halved = longest.filter(|(_, n)| *n > 0).map(|(axis, n)| (axis, touched.first[axis] + n.div_ceil(2)));
        match cut_off.or(halved) {
            Some((axis, plane)) => parted(tetrahedron, axis, plane as f64, &mut |piece| self.cut(piece)),
            None => self.put(tetrahedron, touched.first),
        }
    }

    fn put(&mut self, tetrahedron: &Tetrahedron, voxel: USizeVec3) {
        let USizeVec3 { x: nx, y: ny, .. } = self.planes.dims;
        let rank = self.ranks[voxel.x + nx * (voxel.y + ny * (voxel.z - self.planes.along_z.start))];
        let Some(share) = self.shares.get_mut(rank as usize) else { return };
        let size = volume(tetrahedron).abs() / 6.0;
        let value = tetrahedron.iter().map(|knot| 0.25 * knot.value).sum::<f64>();
        if value.is_nan() {
            share.gap += size;
        } else {
            share.filled += size;
            share.sum += size * value;
        }
    }
}

impl Share {
    /// The mean over the voxel of what has a value, 0 where nothing is; where cells lie on each other their mean.
    fn mean(&self) -> f64 {
        /// Gaps up to this volume are the rounding of a border.
        const LEAST: f64 = 1e-9;
        let Self { filled, sum, gap } = *self;
        match (filled > LEAST, gap > LEAST) {
            (false, true) => f64::NAN,
            (_, false) => sum / filled.max(1.0),
            (true, true) => sum / ((filled + gap).max(1.0) - gap),
        }
    }
}

/// Gives the pieces of a tetrahedron on both sides of a plane across an axis to `take`.
fn parted(tetrahedron: &Tetrahedron, axis: usize, plane: f64, take: &mut impl FnMut(&Tetrahedron)) {
    let mut corners = *tetrahedron;
    corners.sort_by(|a, b| b.place[axis].total_cmp(&a.place[axis]));
    let [a, b, c, d] = corners;
    let between = |above: Knot, below: Knot| {
        let share = (plane - below.place[axis]) / (above.place[axis] - below.place[axis]);
        let mut place = below.place + share * (above.place - below.place);
        place[axis] = plane;
        Knot { place, value: (1.0 - share) * below.value + share * above.value }
    };
    // Three corners at each end, of which each hangs together with one at the other.
    let mut prism = |[x, y, z]: [Knot; 3], [u, v, w]: [Knot; 3]| {
        for piece in [[x, y, z, w], [x, y, v, w], [x, u, v, w]] {
            if volume(&piece) != 0.0 {
                take(&piece);
            }
        }
    };
    match corners.iter().filter(|corner| corner.place[axis] > plane).count() {
        1 => {
            let [x, y, z] = [between(a, b), between(a, c), between(a, d)];
            prism([x, y, z], [b, c, d]);
            take(&[a, x, y, z]);
        }
        2 => {
            let [p, q, r, s] = [between(a, c), between(a, d), between(b, c), between(b, d)];
            prism([a, p, q], [b, r, s]);
            prism([c, p, r], [d, q, s]);
        }
        3 => {
            let [x, y, z] = [between(a, d), between(b, d), between(c, d)];
            prism([x, y, z], [a, b, c]);
            take(&[d, x, y, z]);
        }
        _ => take(tetrahedron),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knot(place: DVec3) -> Knot {
        Knot { place, value: 1.0 + place.dot(DVec3::new(2.0, -1.0, 0.5)) }
    }

    /// Corners on the plane, too.
    #[test]
    fn pieces_have_the_volume_and_the_integral_of_the_whole() {
        let corners = [
            DVec3::new(0.2, 0.1, 0.3),
            DVec3::new(3.4, 0.0, 1.0),
            DVec3::new(0.5, 2.9, 1.0),
            DVec3::new(1.0, 1.2, 4.1),
        ];
        for turn in 0..4 {
            let tetrahedron: Tetrahedron = std::array::from_fn(|i| knot(corners[(i + turn) % 4]));
            for (axis, plane) in [(0, 1.0), (0, 2.0), (1, 1.0), (2, 1.0), (2, 2.0), (0, 0.5), (1, 1.2)] {
                let integral = |t: &Tetrahedron| volume(t).abs() * t.iter().map(|k| k.value).sum::<f64>();
                let mut size = 0.0;
                let mut sum = 0.0;
                parted(&tetrahedron, axis, plane, &mut |piece| {
                    size += volume(piece).abs();
                    sum += integral(piece);
                    let sides = piece.iter().map(|k| k.place[axis] - plane);
                    assert!(sides.clone().all(|side| side <= 0.0) || sides.clone().all(|side| side >= 0.0));
                });
                assert!((size - volume(&tetrahedron).abs()).abs() < 1e-12 * size, "{axis} {plane}: {size}");
                assert!((sum - integral(&tetrahedron)).abs() < 1e-12 * sum.abs(), "{axis} {plane}: {sum}");
            }
        }
    }
}
