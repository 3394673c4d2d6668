//! A classified volume as a density: v(p) trilinear between lattice points, then colour and extinction by the transfer function
//! (post-classification), and −∇v/|∇v| by central differences over a step of the lattice on either side.
//!
//! The value at a lattice point stands for its cell: constant in the outer half cells, nothing beyond. Between the places where a ray
//! crosses planes of lattice points or values of control points its extinction is a cubic.

use crate::media::density::{clamped_cells, lattice_breaks};
use crate::ray::Ray;
use glam::{DMat3, DVec3};
use splat_core::{DAabb, Grid, Similarity, TransferFunction};

/// A volume in the world behind its transfer function: a [`Density::Volume`](crate::Density::Volume) of a medium whose own
/// extinction is 1.
///
/// ```
/// use reference::Classified;
/// use splat_core::glam::{DMat3, DVec3};
/// use splat_core::{Grid, Similarity, TransferFunction, TransferPoint};
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [2, 1, 1], values: vec![0.0, 1.0] };
/// let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
/// let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(1.0, 4.0)]).unwrap();
/// let volume = Classified::new(grid, transfer, &Similarity::default());
/// let middle = DVec3::new(0.5, 0.0, 0.0);
/// assert_eq!((volume.extinction(middle), volume.normal(middle)), (2.0, DVec3::NEG_X));
/// assert_eq!((volume.most(), volume.bounds().max.x), (4.0, 1.5));
/// ```
#[derive(Debug)]
pub struct Classified {
    grid: Grid,
    index_from_world: DMat3,
    transfer: TransferFunction,
}

impl Classified {
    /// The volume, moved into the world; `transfer` gives extinction in 1/world unit. `grid` is expected to be valid
    /// ([`Grid::validate`]).
    pub fn new(mut grid: Grid, transfer: TransferFunction, t: &Similarity) -> Self {
        grid.origin = t.apply(grid.origin);
        grid.axes = DMat3::from_quat(t.rotation) * grid.axes * t.scale;
        Self { index_from_world: grid.axes.inverse(), grid, transfer }
    }

    fn last(&self) -> DVec3 {
        DVec3::from_array(self.grid.dims.map(|n| (n - 1) as f64))
    }

    fn index(&self, p: DVec3) -> DVec3 {
        self.index_from_world * (p - self.grid.origin)
    }

    /// Place in units of the lattice, where there is something.
    fn inside(&self, p: DVec3) -> Option<DVec3> {
        let q = self.index(p);
        (q.cmpge(DVec3::splat(-0.5)).all() && q.cmple(self.last() + 0.5).all()).then_some(q)
    }

    /// Value at a place in units of the lattice, that of the nearest face outside.
    fn trilinear(&self, q: DVec3) -> f64 {
        let q = q.max(DVec3::ZERO).min(self.last());
        let base = q.floor();
        let part = q - base;
        let at = |dx: isize, dy: isize, dz: isize| {
            f64::from(self.grid.at_clamped(base.x as isize + dx, base.y as isize + dy, base.z as isize + dz))
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let line = |dy, dz| mix(at(0, dy, dz), at(1, dy, dz), part.x);
        let plane = |dz| mix(line(0, dz), line(1, dz), part.y);
        mix(plane(0), plane(1), part.z)
    }

    /// Red, green, blue and extinction of a value: linear between control points, in f64.
    fn class(&self, value: f64) -> [f64; 4] {
        let points = self.transfer.points();
        let upper = points.partition_point(|p| f64::from(p.value) <= value);
        let four = |i: usize| {
            let [red, green, blue] = points[i].color;
            let extinction = points[i].extinction;
            [red, green, blue, extinction].map(f64::from)
        };
        if upper == 0 || upper == points.len() {
            return four(upper.saturating_sub(1));
        }
        let [from, to] = [upper - 1, upper].map(|i| f64::from(points[i].value));
        let a = four(upper - 1);
        let b = four(upper);
        let t = (value - from) / (to - from);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }

    /// Extinction, 1/world unit; 0 outside.
    pub fn extinction(&self, p: DVec3) -> f64 {
        self.inside(p).map_or(0.0, |q| self.class(self.trilinear(q))[3])
    }

    /// Colour by the transfer function, linear Rec.709; black outside.
    pub fn color(&self, p: DVec3) -> [f64; 3] {
        self.inside(p).map_or([0.0; 3], |q| {
            let [red, green, blue, _] = self.class(self.trilinear(q));
            [red, green, blue]
        })
    }

    /// −∇v/|∇v|, world space: differences over a step of the lattice on either side, as far as there are lattice points. Zero where
    /// values do not differ.
    pub fn normal(&self, p: DVec3) -> DVec3 {
        let last = self.last();
        let q = self.index(p).max(DVec3::ZERO).min(last);
        let mut gradient = DVec3::ZERO;
        for axis in 0..3 {
            let mut before = q;
            let mut after = q;
            before[axis] = (q[axis] - 1.0).max(0.0);
            after[axis] = (q[axis] + 1.0).min(last[axis]);
            let apart = after[axis] - before[axis];
            if apart > 0.0 {
                gradient[axis] = (self.trilinear(after) - self.trilinear(before)) / apart;
            }
        }
        -(self.index_from_world.transpose() * gradient).normalize_or_zero()
    }

    /// Largest number in a colour of the transfer function.
    pub fn brightest(&self) -> f64 {
        self.transfer.points().iter().flat_map(|p| p.color).fold(0.0, |most, c| most.max(f64::from(c)))
    }

    /// Largest extinction of the transfer function, 1/world unit.
    pub fn most(&self) -> f64 {
        self.transfer.points().iter().fold(0.0, |most, p| most.max(f64::from(p.extinction)))
    }

    /// A box outside which there is nothing, world units.
    pub fn bounds(&self) -> DAabb {
        let voxels = DAabb::new(DVec3::splat(-0.5), self.last() + 0.5);
        DAabb::of_points(voxels.corners().map(|corner| self.grid.origin + self.grid.axes * corner))
    }

    pub(crate) fn dims(&self) -> [usize; 3] {
        self.grid.dims
    }

    /// Largest extinction of the values in a box of the world.
    pub(crate) fn upper(&self, bounds: &DAabb) -> f64 {
        let index_box = DAabb::of_points(bounds.corners().map(|c| self.index(c)));
        let Some(cells) = clamped_cells(&index_box, self.last()) else { return 0.0 };
        let mut low = f32::INFINITY;
        let mut high = f32::NEG_INFINITY;
        let [nx, ny, _] = self.grid.dims;
        let [x, y, z] = cells;
        for row in z.flat_map(|k| y.clone().map(move |j| (k * ny + j) * nx)) {
            for value in &self.grid.values[row + x.start()..=row + x.end()] {
                (low, high) = (low.min(*value), high.max(*value));
            }
        }
        // Rounding may leave the hull of the control points by an ulp.
        self.most_between([low, high].map(f64::from)) * (1.0 + 1e-12)
    }

    /// Largest extinction of values between two.
    fn most_between(&self, range: [f64; 2]) -> f64 {
        let [low, high] = range;
        let between = self.transfer.points().iter().filter(|p| (low..=high).contains(&f64::from(p.value)));
        let ends = self.class(low)[3].max(self.class(high)[3]);
        between.fold(ends, |most, p| most.max(f64::from(p.extinction)))
    }

    /// Least and greatest value of the cell of lattice points about a place in units of the lattice.
    fn ends_of_cell(&self, q: DVec3) -> [f64; 2] {
        let base = q.max(DVec3::ZERO).min(self.last()).floor().to_array().map(|v| v as isize);
        let corner = |c: isize| self.grid.at_clamped(base[0] + (c & 1), base[1] + (c >> 1 & 1), base[2] + (c >> 2));
        let join = |[low, high]: [f32; 2], v: f32| [low.min(v), high.max(v)];
        (0..8).map(corner).fold([f32::INFINITY, f32::NEG_INFINITY], join).map(f64::from)
    }

    /// Appends the distances in (t0, t1) where the extinction along the ray is not smooth, in no order. Between cells that nothing is in there are none.
    pub(crate) fn breaks(&self, ray: &Ray, t0: f64, t1: f64, out: &mut Vec<f64>) {
        let local = Ray { origin: self.index(ray.origin), direction: self.index_from_world * ray.direction };
        let mut planes = Vec::new();
        lattice_breaks(&local, self.last(), t0, t1, &mut planes);
        planes.sort_by(f64::total_cmp);
        let mut was_empty = false;
        for ends in planes.windows(2) {
            let width = ends[1] - ends[0];
            let [low, high] = self.ends_of_cell(local.at(ends[0] + 0.5 * width));
            let is_empty = self.most_between([low, high]) == 0.0;
            if !(is_empty && was_empty) {
                out.push(ends[0]);
            }
            was_empty = is_empty;
            let mut crossed = self
                .transfer
                .points()
                .iter()
                .map(|p| f64::from(p.value))
                .filter(|v| (low..=high).contains(v))
                .peekable();
            if is_empty || crossed.peek().is_none() {
                continue;
            }
            let values = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|s| self.trilinear(local.at(ends[0] + width * s)));
            let cubic = Cubic::through(values);
            out.extend(crossed.flat_map(|value| cubic.places_of(value)).map(|s| ends[0] + width * s));
        }
        out.extend(planes.last());
    }
}

/// A polynomial on \[0, 1\], by its coefficients of 1, s, s², s³.
struct Cubic([f64; 4]);

impl Cubic {
    /// Through its values at 0, 1/3, 2/3 and 1.
    fn through(values: [f64; 4]) -> Self {
        let [a, b, c, d] = values;
        // Newton's form: what is 0 stays 0 of values that are alike.
        let first = b - a;
        let second = c - 2.0 * b + a;
        let third = d - 3.0 * c + 3.0 * b - a;
        Self([a, 3.0 * first - 1.5 * second + third, 4.5 * (second - third), 4.5 * third])
    }

    fn at(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.0;
        a + s * (b + s * (c + s * d))
    }

    /// Where it turns, rising, between 0 and 1, with these.
    fn monotone(&self) -> Vec<f64> {
        let [_, b, c, d] = self.0;
        let root = (c * c - 3.0 * d * b).max(0.0).sqrt();
        // Of 3ds² + 2cs + b, without cancellation.
        let sum = -(c + root.copysign(c));
        let mut ends: Vec<f64> = [sum / (3.0 * d), b / sum].into_iter().filter(|s| *s > 0.0 && *s < 1.0).collect();
        ends.extend([0.0, 1.0]);
        ends.sort_by(f64::total_cmp);
        ends
    }

    /// Where it crosses a value.
    fn places_of(&self, value: f64) -> Vec<f64> {
        let above = |s: f64| self.at(s) > value;
        let crossed = |ends: &[f64]| {
            let mut a = ends[0];
            let mut b = ends[1];
            let at_a = above(a);
            if at_a == above(b) {
                return None;
            }
            loop {
                let middle = 0.5 * (a + b);
                if middle <= a || middle >= b || b - a < 1e-15 {
                    return Some(middle);
                }
                *(if above(middle) == at_a { &mut a } else { &mut b }) = middle;
            }
        };
        self.monotone().windows(2).filter_map(crossed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{TransferPoint, rng};

    fn volume() -> Classified {
        let point = |value, extinction| TransferPoint { value, color: [0.5, 1.5, 0.25], extinction };
        let transfer = TransferFunction::new(vec![point(0.2, 0.0), point(0.5, 9.0), point(0.8, 1.0)]).unwrap();
        let values = (0..6 * 5 * 4u64).map(|i| rng::unit_f32(3, 0, i, 0)).collect();
        let axes = DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.15));
        let grid = Grid { origin: DVec3::new(1.0, -2.0, 0.5), axes, dims: [6, 5, 4], values };
        let rotation = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.0, -0.3);
        let t = Similarity { rotation, scale: 2.0, translation: DVec3::new(0.3, 0.1, -4.0) };
        Classified::new(grid, transfer, &t)
    }

    #[test]
    fn lattice_points_have_their_own_extinction_and_nothing_lies_outside() {
        let v = volume();
        for (i, j, k) in [(0, 0, 0), (3, 2, 1), (5, 4, 3)] {
            let expected = v.transfer.at(v.grid.at_clamped(i, j, k)).extinction;
            let found = v.extinction(v.grid.position(i as usize, j as usize, k as usize));
            assert!((found - f64::from(expected)).abs() < 1e-4, "{found} and {expected}");
        }
        let DAabb { min: low, max: high } = v.bounds();
        assert_eq!((v.extinction(low - 0.01), v.extinction(high + 0.01)), (0.0, 0.0));
        assert_eq!((v.most(), v.brightest()), (9.0, 1.5));
    }

    #[test]
    fn bounds_hold_for_every_point_of_a_box() {
        let v = volume();
        let DAabb { min: low, max: high } = v.bounds();
        for i in 0..400 {
            let u = |k| rng::unit(7, 1, i, k);
            let middle = low + (high - low) * DVec3::new(u(0), u(1), u(2));
            let within = DAabb::around(middle, DVec3::splat(0.3 * u(3)));
            let most = v.upper(&within);
            for s in 0..40 {
                let d = |k| rng::unit(8, i, s, k);
                let p = within.min + within.size() * DVec3::new(d(0), d(1), d(2));
                assert!(v.extinction(p) <= most, "{} above {most}", v.extinction(p));
            }
        }
    }

    #[test]
    fn rays_are_cut_where_something_is_and_nowhere_else() {
        // Of 64 cells along x those about 20 and 21 hold something.
        let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
        let transfer = TransferFunction::new(vec![point(0.5, 0.0), point(1.0, 4.0)]).unwrap();
        let values = (0..64 * 4).map(|i| if matches!(i % 64, 20 | 21) { 1.0 } else { 0.0 }).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [64, 2, 2], values };
        let volume = Classified::new(grid, transfer, &Similarity::default());
        let ray = Ray { origin: DVec3::new(-9.0, 0.25, 0.25), direction: DVec3::X };
        let mut cuts = Vec::new();
        volume.breaks(&ray, 0.0, f64::INFINITY, &mut cuts);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let expected = [-0.5, 19.0, 19.5, 20.0, 21.0, 21.5, 22.0, 63.5].map(|x| x + 9.0);
        assert!(cuts.len() == 8 && cuts.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{cuts:?}");
    }

    #[test]
    fn cubics_cross_values_where_they_do() {
        // (s − 0.2)(s − 0.5)(s − 0.9), and a straight line.
        let f = |s: f64| (s - 0.2) * (s - 0.5) * (s - 0.9);
        for (f, places) in
            [(&f as &dyn Fn(f64) -> f64, vec![0.2, 0.5, 0.9]), (&|s| 0.7 - s, vec![0.7]), (&|_| 1.0, vec![])]
        {
            let found = Cubic::through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(f)).places_of(0.0);
            assert_eq!(found.len(), places.len(), "{found:?}");
            assert!(found.iter().zip(&places).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?}");
        }
    }
}
