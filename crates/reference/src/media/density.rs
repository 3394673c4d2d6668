//! Densities: how much of a medium there is at a point, where along a ray the density is smooth, and how large it can
//! get inside a box.

use crate::media::classified::Classified;
use crate::ray::Ray;
use crate::surfaces::roots::{RootParams, crossings};
use glam::{DMat3, DVec3};
use splat_core::{Clip, DAabb, Error, Grid, ScalarField};
use std::ops::RangeInclusive;

/// Majorant cells along each axis of a density that is cut.
const CUT_DETAIL: usize = 8;

/// Relative density over space, ≥ 0; the medium multiplies it by its extinction.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub enum Density<'a> {
    /// 1 inside an axis-aligned box, 0 outside.
    Box(DAabb),
    /// 1 inside a ball.
    Ball {
        /// Centre, world units.
        center: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
    },
    /// A volume, see [`Lattice`].
    Grid(Lattice<'a>),
    /// The extinction of a volume behind its transfer function, see [`Classified`].
    Volume(&'a Classified),
    /// A field's value where it is positive, inside a box.
    Field {
        /// The field.
        field: &'a dyn ScalarField,
        /// Lowest and highest corner; 0 outside.
        bounds: DAabb,
        /// No value in the box exceeds this; the field's own `bound` makes it local.
        majorant: f64,
    },
    /// 1 where a field is negative, inside a box: the solid that an implicit surface encloses.
    Inside {
        /// The field.
        field: &'a dyn ScalarField,
        /// Lowest and highest corner; 0 outside.
        bounds: DAabb,
    },
    /// Any function, ≥ 0 inside a box.
    Function {
        /// The density.
        function: &'a (dyn Fn(DVec3) -> f64 + Sync),
        /// Lowest and highest corner; 0 outside.
        bounds: DAabb,
        /// No value in the box exceeds this.
        majorant: f64,
    },
    /// Another density where all of these regions keep it, 0 elsewhere.
    Cut {
        /// The whole.
        whole: &'a Density<'a>,
        /// The regions, world space.
        clips: &'a [Clip],
    },
}

/// A volume as a density: trilinear between lattice points, each of which stands in the middle of a cell; constant in
/// the outer half cells, 0 beyond. Its integral is Σ values · cell volume.
#[derive(Debug, Clone, Copy)]
pub struct Lattice<'a> {
    grid: &'a Grid,
    index_from_world: DMat3,
    last: DVec3,
}

impl<'a> Lattice<'a> {
    /// Checks a volume.
    ///
    /// # Errors
    /// As [`Grid::validate`], and [`Error::Invalid`] for a negative value.
    pub fn new(grid: &'a Grid) -> Result<Self, Error> {
        grid.validate()?;
        if let Some(i) = grid.values.iter().position(|v| *v < 0.0) {
            return Err(Error::invalid("voxel", i, "value", grid.values[i], "a density ≥ 0"));
        }
        let last = DVec3::from_array(grid.dims.map(|d| (d - 1) as f64));
        Ok(Self { grid, index_from_world: grid.axes.inverse(), last })
    }

    fn index(&self, p: DVec3) -> DVec3 {
        self.index_from_world * (p - self.grid.origin)
    }

    #[inline(always)]
    fn value(&self, p: DVec3) -> f64 {
        let q = self.index(p);
        let half = DVec3::splat(0.5);
        if q.cmplt(-half).any() || q.cmpgt(self.last + half).any() {
            return 0.0;
        }
        let q = q.max(DVec3::ZERO).min(self.last);
        let [nx, ny, nz] = self.grid.dims;
        // By way of i32, which converts in one instruction; a longer axis than that does not fit memory.
        let i = q.x as i32 as usize;
        let j = q.y as i32 as usize;
        let k = q.z as i32 as usize;
        let i = i.min(nx.saturating_sub(2));
        let j = j.min(ny.saturating_sub(2));
        let k = k.min(nz.saturating_sub(2));
        let fx = q.x - i as f64;
        let fy = q.y - j as f64;
        let fz = q.z - k as f64;
        let dx = usize::from(nx > 1);
        let dy = usize::from(ny > 1) * nx;
        let dz = usize::from(nz > 1) * nx * ny;
        let at = (k * ny + j) * nx + i;
        let v = &self.grid.values;
        // One check of bounds a pair of neighbours.
        let line = |b: usize| {
            let pair = &v[b..=b + dx];
            let a = f64::from(pair[0]);
            a + fx * (f64::from(pair[dx]) - a)
        };
        let plane = |b: usize| {
            let a = line(b);
            a + fy * (line(b + dy) - a)
        };
        let a = plane(at);
        // Rounding may leave the hull of the corners by an ulp below zero.
        (a + fz * (plane(at + dz) - a)).max(0.0)
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|c| {
            let side = |bit: usize, last: f64| if c >> bit & 1 == 1 { last + 0.5 } else { -0.5 };
            let q = DVec3::new(side(0, self.last.x), side(1, self.last.y), side(2, self.last.z));
            self.grid.origin + self.grid.axes * q
        })
    }

    fn upper(&self, bounds: &DAabb) -> f64 {
        let index_box = DAabb::of_points(bounds.corners().map(|c| self.index(c)));
        let Some([x, y, z]) = clamped_cells(&index_box, self.last) else { return 0.0 };
        let [nx, ny, _] = self.grid.dims;
        let rows = z.flat_map(|k| y.clone().map(move |j| (k * ny + j) * nx));
        rows.map(|row| self.grid.values[row + x.start()..=row + x.end()].iter().fold(0.0f32, |m, v| m.max(*v)))
            .fold(0.0, |m: f64, v| m.max(f64::from(v)))
    }

    fn breaks(&self, ray: &Ray, t0: f64, t1: f64, out: &mut Vec<f64>) {
        let local = Ray { origin: self.index(ray.origin), direction: self.index_from_world * ray.direction };
        lattice_breaks(&local, self.last, t0, t1, out);
    }
}

/// Lattice points that a box in units of the lattice has values of, by axis; `None` where it lies outside.
pub(crate) fn clamped_cells(bounds: &DAabb, last: DVec3) -> Option<[RangeInclusive<usize>; 3]> {
    let DAabb { min: low, max: high } = *bounds;
    // A guard of 2⁻²⁰ cells: the box may be computed in other roundings than the points in it.
    let guard = DVec3::splat(0.5 + 1.0 / 1_048_576.0);
    let range = |a: usize| {
        let clamp = |v: f64| v.clamp(0.0, last[a]) as usize;
        clamp((low[a] - 1e-6).floor())..=clamp((high[a] + 1e-6).ceil())
    };
    let is_outside = high.cmplt(-guard).any() || low.cmpgt(last + guard).any();
    (!is_outside).then(|| [0, 1, 2].map(range))
}

/// Appends the distances in (t0, t1) where a ray crosses planes of lattice points, or the faces half a cell beyond the outermost. The ray
/// is one in units of the lattice whose distances are those of the world.
pub(crate) fn lattice_breaks(local: &Ray, last: DVec3, t0: f64, t1: f64, out: &mut Vec<f64>) {
    let half = DVec3::splat(0.5);
    let Some((enter, leave)) = local.clip(&DAabb::new(-half, last + half), t0, t1) else { return };
    out.extend([enter, leave]);
    for a in 0..3 {
        let o = local.origin[a];
        let d = local.direction[a];
        if d == 0.0 {
            continue;
        }
        let p = o + enter * d;
        let q = o + leave * d;
        let first = p.min(q).ceil().max(0.0) as usize;
        let last = p.max(q).floor().min(last[a]);
        if last >= 0.0 {
            out.extend((first..=last as usize).map(|i| (i as f64 - o) / d));
        }
    }
}

impl Density<'_> {
    /// Density at a world position.
    #[inline]
    pub fn value(&self, p: DVec3) -> f64 {
        match self {
            Self::Grid(lattice) => lattice.value(p),
            Self::Volume(volume) => volume.extinction(p),
            Self::Box(bounds) => f64::from(bounds.contains(p)),
            Self::Ball { center, radius } => f64::from((p - center).length() <= *radius),
            Self::Field { field, bounds, .. } if bounds.contains(p) => field.value(p).max(0.0),
            Self::Inside { field, bounds } if bounds.contains(p) => f64::from(field.value(p) < 0.0),
            Self::Function { function, bounds, .. } if bounds.contains(p) => function(p).max(0.0),
            Self::Cut { whole, clips } if clips.iter().all(|clip| clip.keeps(p)) => whole.value(p),
            _ => 0.0,
        }
    }

    /// Where the density can be positive, along the world's axes.
    pub fn bounds(&self) -> DAabb {
        match self {
            Self::Box(b) => *b,
            Self::Field { bounds, .. } | Self::Inside { bounds, .. } | Self::Function { bounds, .. } => *bounds,
            Self::Ball { center, radius } => DAabb::around(*center, DVec3::splat(*radius)),
            Self::Grid(lattice) => DAabb::of_points(lattice.corners()),
            Self::Volume(volume) => volume.bounds(),
            Self::Cut { whole, .. } => whole.bounds(),
        }
    }

    /// A number that no density inside the box exceeds.
    pub fn upper(&self, bounds: &DAabb) -> f64 {
        let support = self.bounds();
        if bounds.max.cmplt(support.min).any() || bounds.min.cmpgt(support.max).any() {
            return 0.0;
        }
        let middle = bounds.min + bounds.size() * 0.5;
        let reach = bounds.diagonal() * 0.5 * (1.0 + 1e-9);
        match self {
            Self::Box(_) => 1.0,
            Self::Ball { center, radius } => {
                let nearest = center.clamp(bounds.min, bounds.max);
                f64::from((nearest - center).length() <= radius * (1.0 + 1e-9))
            }
            Self::Grid(lattice) => lattice.upper(bounds),
            Self::Volume(volume) => volume.upper(bounds),
            Self::Field { field, majorant, .. } => {
                field.bound(middle, reach).map_or(*majorant, |(_, high)| high.max(0.0).min(*majorant))
            }
            Self::Inside { field, .. } => f64::from(field.bound(middle, reach).is_none_or(|(low, _)| low < 0.0)),
            Self::Function { majorant, .. } => *majorant,
            Self::Cut { whole, clips } => {
                let may_be_kept = clips.iter().all(|clip| clip.may_keep(middle, reach));
                if may_be_kept { whole.upper(bounds) } else { 0.0 }
            }
        }
    }

    /// Whether the density is a polynomial of degree ≤ 3 between neighbouring [`Density::breaks`].
    pub(crate) fn is_piecewise_cubic(&self) -> bool {
        match self {
            Self::Cut { whole, .. } => whole.is_piecewise_cubic(),
            _ => !matches!(self, Self::Field { .. } | Self::Function { .. }),
        }
    }

    /// Appends the distances in (t0, t1) where the density along the ray is not smooth, in no order.
    pub(crate) fn breaks(&self, ray: &Ray, t0: f64, t1: f64, out: &mut Vec<f64>) {
        let mut push = |span: Option<(f64, f64)>| out.extend(span.into_iter().flat_map(|(a, b)| [a, b]));
        match self {
            Self::Box(bounds) => push(ray.clip(bounds, t0, t1)),
            Self::Ball { center, radius } => push(ray.clip_ball(*center, *radius, t0, t1)),
            Self::Field { bounds, .. } | Self::Function { bounds, .. } => push(ray.clip(bounds, t0, t1)),
            Self::Grid(lattice) => lattice.breaks(ray, t0, t1, out),
            Self::Volume(volume) => volume.breaks(ray, t0, t1, out),
            Self::Inside { field, bounds } => {
                if let Some((a, b)) = ray.clip(bounds, t0, t1) {
                    out.extend([a, b]);
                    out.extend(crossings(*field, ray, a, b, &RootParams::default()).roots);
                }
            }
            Self::Cut { whole, clips } => {
                whole.breaks(ray, t0, t1, out);
                // A ray along a border does not cross it: what is divided by 0 is not in the range.
                let planes = clips.iter().flat_map(Clip::half_spaces);
                let crossings = planes.map(|(n, offset)| (offset - n.dot(ray.origin)) / n.dot(ray.direction));
                out.extend(crossings.filter(|t| t0 < *t && *t < t1));
            }
        }
    }

    /// Suggested number of majorant cells along each axis of its bounds.
    pub(crate) fn detail(&self) -> [usize; 3] {
        match self {
            Self::Box(_) | Self::Function { .. } => [1; 3],
            Self::Ball { .. } => [8; 3],
            Self::Field { .. } | Self::Inside { .. } => [32; 3],
            Self::Grid(lattice) => majorant_cells(lattice.grid.dims),
            Self::Volume(volume) => majorant_cells(volume.dims()),
            Self::Cut { whole, .. } => whole.detail().map(|n| n.max(CUT_DETAIL)),
        }
    }

    pub(crate) fn validate(&self, index: usize) -> Result<(), Error> {
        let bounds = self.bounds();
        if !bounds.is_solid() {
            return Err(Error::invalid("medium", index, "bounds", bounds, "finite corners, the lowest first"));
        }
        match self {
            Self::Ball { radius, .. } if *radius <= 0.0 || radius.is_nan() => {
                Err(Error::invalid("medium", index, "radius", radius, "a number > 0"))
            }
            Self::Field { majorant, .. } | Self::Function { majorant, .. }
                if !(majorant.is_finite() && *majorant >= 0.0) =>
            {
                Err(Error::invalid("medium", index, "majorant", majorant, "a finite number ≥ 0"))
            }
            Self::Cut { whole, clips } => {
                clips.iter().try_for_each(Clip::validate).and_then(|()| whole.validate(index))
            }
            _ => Ok(()),
        }
    }
}

/// Four lattice points a cell.
fn majorant_cells(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|d| d.div_ceil(4).min(64))
}
