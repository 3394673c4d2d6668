//! A classified volume as a field of extinction: v(p) trilinear between lattice points, then colour and extinction by the
//! transfer function (post-classification).
//!
//! The value at a lattice point stands for its cell: constant in the outer half cells, nothing beyond.

use glam::{DMat3, DVec3};
use splat_core::{DAabb, Grid, ScalarField, Similarity, TransferFunction};

/// The extinction of a volume in the world, 1/world unit, as a field: a [`Density::Field`](crate::Density::Field) of a medium
/// whose own extinction is 1.
///
/// ```
/// use reference::Classified;
/// use splat_core::glam::{DMat3, DVec3};
/// use splat_core::{Grid, ScalarField, Similarity, TransferFunction, TransferPoint};
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [2, 1, 1], values: vec![0.0, 1.0] };
/// let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
/// let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(1.0, 4.0)]).unwrap();
/// let volume = Classified::new(grid, transfer, &Similarity::default());
/// assert_eq!(volume.value(DVec3::new(0.5, 0.0, 0.0)), 2.0);
/// assert_eq!((volume.most(), volume.bounds().max.x), (4.0, 1.5));
/// ```
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

    /// Value at a place in units of the lattice; `None` outside.
    fn trilinear(&self, q: DVec3) -> Option<f64> {
        let last = self.last();
        if q.cmplt(DVec3::splat(-0.5)).any() || q.cmpgt(last + 0.5).any() {
            return None;
        }
        let q = q.max(DVec3::ZERO).min(last);
        let base = q.floor();
        let part = q - base;
        let at = |dx: isize, dy: isize, dz: isize| {
            f64::from(self.grid.at_clamped(base.x as isize + dx, base.y as isize + dy, base.z as isize + dz))
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let line = |dy, dz| mix(at(0, dy, dz), at(1, dy, dz), part.x);
        let plane = |dz| mix(line(0, dz), line(1, dz), part.y);
        Some(mix(plane(0), plane(1), part.z))
    }

    /// Colour by the transfer function, linear Rec.709; black outside.
    pub fn color(&self, p: DVec3) -> [f64; 3] {
        self.trilinear(self.index(p)).map_or([0.0; 3], |v| self.transfer.at(v as f32).color.map(f64::from))
    }

    /// Largest number in a colour of the transfer function.
    pub fn brightest(&self) -> f64 {
        self.transfer.points().iter().flat_map(|p| p.color).fold(0.0, |most, c| most.max(f64::from(c)))
    }

    /// Largest extinction of the transfer function, 1/world unit: a majorant of the field.
    pub fn most(&self) -> f64 {
        self.transfer.points().iter().fold(0.0, |most, p| most.max(f64::from(p.extinction)))
    }

    /// A box outside which there is nothing, world units.
    pub fn bounds(&self) -> DAabb {
        let voxels = DAabb::new(DVec3::splat(-0.5), self.last() + 0.5);
        DAabb::of_points(voxels.corners().map(|corner| self.grid.origin + self.grid.axes * corner))
    }

    /// Least and largest extinction of the values between two.
    fn range(&self, low: f32, high: f32) -> (f64, f64) {
        let between = self.transfer.points().iter().filter(|p| p.value > low && p.value < high).map(|p| p.extinction);
        let ends = [low, high].map(|v| self.transfer.at(v).extinction);
        let fold = |(least, most): (f32, f32), e: f32| (least.min(e), most.max(e));
        let (least, most) = ends.into_iter().chain(between).fold((f32::INFINITY, 0.0), fold);
        // Between two control points the tracer rounds in f32 too.
        (f64::from(least) * (1.0 - 1e-6), f64::from(most) * (1.0 + 1e-6))
    }
}

impl ScalarField for Classified {
    fn value(&self, p: DVec3) -> f64 {
        self.trilinear(self.index(p)).map_or(0.0, |v| f64::from(self.transfer.at(v as f32).extinction))
    }

    /// Not used: a density is not shaded by its gradient.
    fn gradient(&self, _p: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    fn hessian(&self, _p: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let rows = self.index_from_world.transpose();
        let reach = radius * DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        let (q, last) = (self.index(p), self.last());
        let (low, high) = (q - reach, q + reach);
        let half = DVec3::splat(0.5);
        if high.cmplt(-half).any() || low.cmpgt(last + half).any() {
            return Some((0.0, 0.0));
        }
        let cells = |a: usize| {
            let clamp = |v: f64| v.clamp(0.0, last[a]) as usize;
            clamp((low[a] - 1e-6).floor())..=clamp((high[a] + 1e-6).ceil())
        };
        let [nx, ny, _] = self.grid.dims;
        let row = |j: usize, k: usize| (k * ny + j) * nx;
        let x = cells(0);
        let values = cells(2)
            .flat_map(|k| cells(1).map(move |j| (j, k)))
            .flat_map(|(j, k)| &self.grid.values[row(j, k) + x.start()..=row(j, k) + x.end()]);
        let (least, most) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        let (least, most) = self.range(least, most);
        let inside = low.cmpge(-half).all() && high.cmple(last + half).all();
        Some((if inside { least } else { 0.0 }, most))
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
            let own = v.transfer.at(v.grid.at_clamped(i, j, k)).extinction;
            let found = v.value(v.grid.position(i as usize, j as usize, k as usize));
            assert!((found - f64::from(own)).abs() < 1e-4, "{found} and {own}");
        }
        let DAabb { min: low, max: high } = v.bounds();
        assert_eq!((v.value(low - 0.01), v.value(high + 0.01)), (0.0, 0.0));
        assert_eq!((v.most(), v.brightest()), (9.0, 1.5));
    }

    #[test]
    fn bounds_hold_for_every_point_of_a_ball() {
        let v = volume();
        let DAabb { min: low, max: high } = v.bounds();
        for i in 0..400 {
            let u = |k| rng::unit(7, 1, i, k);
            let p = low + (high - low) * DVec3::new(u(0), u(1), u(2));
            let radius = 0.3 * u(3);
            let (least, most) = v.bound(p, radius).unwrap();
            for s in 0..40 {
                let d = |k| rng::unit(8, i, s, k) - 0.5;
                let q = p + DVec3::new(d(0), d(1), d(2)).normalize() * radius * rng::unit(9, i, s, 0);
                assert!((least..=most).contains(&v.value(q)), "{} not in {least} to {most}", v.value(q));
            }
        }
    }
}
