//! Cells that samples miss, parted exactly between voxels.
//!
//! A layer that is thinner than the distance of samples has one of them by chance or none at all. So every voxel that such a cell
//! touches is computed anew, exactly, from all cells in it. What a tetrahedron and a voxel share is what lies below the faces of the tetrahedron that look up,
//! less what lies below those that look down. A face is clipped to the column of a voxel; over the polygon that is left the field is integrated
//! up to the face or the voxel's top.

use super::resample::{Body, Knot, Tetrahedron, volume};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::{DMat3, DVec3, USizeVec3};
use std::ops::Range;

/// Faces in voxels that are integrated over in a part of the volume, at most: beyond that samples have to do. Voxels that are looked at count as a share of
/// one.
const MOST_PIECES: u64 = 1 << 26;
const VOXELS_OF_A_PIECE: u64 = 32;

/// Faces of a tetrahedron by ranks of its corners, wound outwards where its volume is positive.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
/// Corners of a triangle that is clipped at six planes, at most.
const MOST_CORNERS: usize = 9;

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
        body.part(corner, |tetrahedron| self.put(tetrahedron));
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

    /// Adds what a tetrahedron and each marked voxel share.
    fn put(&mut self, tetrahedron: &Tetrahedron) {
        if !self.is_whole() {
            return;
        }
        let Some(touched) = self.touched(tetrahedron) else { return };
        let sizes = touched.last - touched.first + USizeVec3::ONE;
        self.pieces += (sizes.x * sizes.y * sizes.z) as u64 / VOXELS_OF_A_PIECE;
        if self.rows(&touched).all(|row| self.ranks[row].iter().all(|rank| *rank == NONE)) {
            return;
        }
        let is_gap = tetrahedron.iter().any(|corner| corner.value.is_nan());
        let corners = tetrahedron.map(|corner| if is_gap { Knot { value: 0.0, ..corner } } else { corner });
        let Some(field) = Linear::through(&corners) else { return };
        for face in FACES {
            let [a, b, c] = face.map(|rank| corners[rank]);
            let polygon = if field.is_turned { Polygon::triangle(a, c, b) } else { Polygon::triangle(a, b, c) };
            for i in polygon.voxels(0, touched.first.x..touched.last.x + 1) {
                let strip = polygon.within(0, i as f64);
                for j in strip.voxels(1, touched.first.y..touched.last.y + 1) {
                    let column = strip.within(1, j as f64);
                    for k in touched.first.z..=touched.last.z {
                        self.put_below(&column, USizeVec3::new(i, j, k), &field, is_gap);
                    }
                }
            }
        }
    }

    /// Adds what of a voxel lies below a part of a face.
    fn put_below(&mut self, face: &Polygon, voxel: USizeVec3, field: &Linear, is_gap: bool) {
        let USizeVec3 { x: nx, y: ny, .. } = self.planes.dims;
        let rank = self.ranks[voxel.x + nx * (voxel.y + ny * (voxel.z - self.planes.along_z.start))];
        let Some(share) = self.shares.get_mut(rank as usize) else { return };
        self.pieces += 1;
        let floor = voxel.z as f64;
        let [size, sum] = field.below(face, floor);
        if is_gap {
            share.gap += size;
        } else {
            share.filled += size;
            share.sum += sum;
        }
    }
}

/// A field that is linear over a tetrahedron.
struct Linear {
    /// Its slope along z.
    slope: f64,
    /// Whether the tetrahedron is inside out.
    is_turned: bool,
}

impl Linear {
    /// `None` for corners without a volume.
    fn through(corners: &Tetrahedron) -> Option<Self> {
        let size = volume(corners);
        let [a, b, c, d] = corners.map(|corner| corner.place);
        let inverse = DMat3::from_cols(b - a, c - a, d - a).inverse();
        let [first, rest @ ..] = corners.map(|corner| corner.value);
        let slope = inverse.z_axis.dot(DVec3::from_array(rest) - first);
        (size != 0.0 && slope.is_finite()).then_some(Self { slope, is_turned: size < 0.0 })
    }

    /// The volume below a face within a layer of voxels that begins at a height, and the integral of the field over it; both negative for a face that
    /// looks down.
    fn below(&self, face: &Polygon, floor: f64) -> [f64; 2] {
        // One that lies in the top of the layer bounds it, and is not above it.
        let is_above = face.corners().iter().any(|corner| corner.place.z > floor + 1.0);
        let above = if is_above { face.clipped(2, floor + 1.0, 1.0) } else { Polygon { count: 0, ..*face } };
        let over_layer = above.sum(|at| [1.0, at.value + self.slope * (floor + 0.5 - at.place.z)]);
        let in_layer = face.within(2, floor).sum(|at| {
            let height = at.place.z - floor;
            [height, height * (at.value - 0.5 * self.slope * height)]
        });
        [over_layer[0] + in_layer[0], over_layer[1] + in_layer[1]]
    }
}

/// A part of a face.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [Knot; MOST_CORNERS],
    count: usize,
}

impl Polygon {
    fn triangle(a: Knot, b: Knot, c: Knot) -> Self {
        let mut corners = [a; MOST_CORNERS];
        corners[1] = b;
        corners[2] = c;
        Self { corners, count: 3 }
    }

    fn corners(&self) -> &[Knot] {
        &self.corners[..self.count]
    }

    /// Those of a range of voxels that it meets along an axis.
    fn voxels(&self, axis: usize, range: Range<usize>) -> Range<usize> {
        let places = self.corners().iter().map(|corner| corner.place[axis]);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let first = low.floor().max(range.start as f64) as usize;
        let end = high.ceil().max(0.0).min(range.end as f64) as usize;
        first..end
    }

    /// The part in the voxels from a plane on to the next one.
    fn within(&self, axis: usize, plane: f64) -> Self {
        self.clipped(axis, plane, 1.0).clipped(axis, plane + 1.0, -1.0)
    }

    /// The part above a plane across an axis, or below it where `side` is −1.
    fn clipped(&self, axis: usize, plane: f64, side: f64) -> Self {
        let corners = self.corners();
        let over = |corner: &Knot| side * (corner.place[axis] - plane);
        if corners.iter().all(|corner| over(corner) >= 0.0) {
            return *self;
        }
        let mut part = Self { count: 0, ..*self };
        for (i, corner) in corners.iter().enumerate() {
            let next = &corners[(i + 1) % corners.len()];
            let ends = [over(corner), over(next)];
            if ends[0] >= 0.0 {
                part.push(*corner);
            }
            if (ends[0] > 0.0 && ends[1] < 0.0) || (ends[0] < 0.0 && ends[1] > 0.0) {
                let share = ends[0] / (ends[0] - ends[1]);
                let mut place = corner.place + share * (next.place - corner.place);
                place[axis] = plane;
                part.push(Knot { place, value: corner.value + share * (next.value - corner.value) });
            }
        }
        part
    }

    /// A corner more; a polygon has no more than there is room for, as each plane adds one.
    fn push(&mut self, corner: Knot) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count += 1;
        }
    }

    /// The integrals over its projection along z of two quantities that are quadratic over it: the means at the middles of the edges of its triangles.
    fn sum(&self, quantities: impl Fn(Knot) -> [f64; 2]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        let Some((first, rest)) = self.corners().split_first() else { return sum };
        for pair in rest.windows(2) {
            let [u, v] = [pair[0], pair[1]].map(|corner| corner.place - first.place);
            let area = 0.5 * (u.x * v.y - u.y * v.x);
            for ends in [[*first, pair[0]], [pair[0], pair[1]], [pair[1], *first]] {
                let place = 0.5 * (ends[0].place + ends[1].place);
                let found = quantities(Knot { place, value: 0.5 * (ends[0].value + ends[1].value) });
                sum = [sum[0] + area / 3.0 * found[0], sum[1] + area / 3.0 * found[1]];
            }
        }
        sum
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

#[cfg(test)]
mod tests {
    use super::*;

    fn knot(place: DVec3) -> Knot {
        Knot { place, value: 1.0 + place.dot(DVec3::new(2.0, -1.0, 0.5)) }
    }

    /// Whichever way it is wound; corners lie on planes of voxels, too.
    #[test]
    fn what_voxels_share_with_a_tetrahedron_is_all_of_it() {
        let corners = [
            DVec3::new(0.2, 0.1, 0.3),
            DVec3::new(3.4, 0.0, 1.0),
            DVec3::new(0.5, 2.9, 1.0),
            DVec3::new(1.0, 1.2, 4.0),
        ];
        for order in [[0, 1, 2, 3], [1, 0, 2, 3]] {
            let tetrahedron: Tetrahedron = order.map(|i| knot(corners[i]));
            let params = crate::ReadParams::default();
            let planes = Planes { dims: USizeVec3::new(4, 3, 4), along_z: 0..4 };
            let mut parting = Parting::new(planes, &Reading::new(&params, None)).unwrap();
            parting.ranks.iter_mut().enumerate().for_each(|(voxel, rank)| *rank = voxel as u32);
            parting.shares.resize(48, Share::default());
            parting.put(&tetrahedron);
            let size = volume(&tetrahedron).abs() / 6.0;
            let mean = tetrahedron.iter().map(|corner| 0.25 * corner.value).sum::<f64>();
            let filled: f64 = parting.shares.iter().map(|share| share.filled).sum();
            let sum: f64 = parting.shares.iter().map(|share| share.sum).sum();
            assert!((filled - size).abs() < 1e-12 && (sum - size * mean).abs() < 1e-12, "{filled} {size} {sum}");
            // The voxel in its middle is full, and has the field of its own middle.
            let middle = &parting.shares[1 + 4 * (1 + 3)];
            assert!(parting.shares.iter().all(|share| (-1e-12..1.0 + 1e-12).contains(&share.filled)));
            assert!(middle.filled > 0.3, "{}", middle.filled);
        }
    }
}
