//! A density as a field of extinction that is never negative, with bounds that are computed once for each cell.
//!
//! Each particle is kept with probability value/bound and needs the bound of its cell, so bounds are kept in a table.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use splat_core::{DAabb, ScalarField, glam};
use std::sync::Arc;

/// Cells along each side of the box, unless the medium is the same everywhere in it.
const CELLS: u32 = 64;

/// A source of extinction.
#[derive(Clone)]
#[non_exhaustive]
pub enum Matter {
    /// A homogeneous box: all of it.
    Everywhere,
    /// A homogeneous ball.
    Ball {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
    },
    /// Where the field is 1, extinction is whole; negative values count as 0.
    Density(Arc<dyn ScalarField + Send>),
}

/// Extinction in a box, 1/unit of length, never negative, with a bound for each of its cells: what
/// [`FieldVolumeSampler`](crate::FieldVolumeSampler) thins particles by. A bound costs a look-up, a value what the field costs.
///
/// ```
/// use pbsr::{BoundedExtinction, Matter};
/// use splat_core::{DAabb, ScalarField, glam::DVec3};
/// let ball = Matter::Ball { center: DVec3::ZERO, radius: 1.0 };
/// let fog = BoundedExtinction::new(ball, 0.5, DAabb::new(DVec3::splat(-1.0), DVec3::ONE)).unwrap();
/// assert_eq!((fog.value(DVec3::X * 0.9), fog.value(DVec3::ONE)), (0.5, 0.0));
/// assert_eq!(fog.max(), 0.5);
/// ```
pub struct BoundedExtinction {
    matter: Matter,
    /// Where the density is 1.
    extinction: f64,
    bounds: DAabb,
    /// Cells along each side.
    cells: u32,
    /// Largest extinction in each cell, x fastest.
    most: Vec<f64>,
    /// Largest of all.
    max: f64,
}

impl BoundedExtinction {
    /// Bounds `matter` in a box that is not empty; `extinction`, ≥ 0, is that of density 1. `None` where a density has no finite bound.
    pub fn new(matter: Matter, extinction: f64, bounds: DAabb) -> Option<Self> {
        let cells = if matches!(matter, Matter::Everywhere) { 1 } else { CELLS };
        let n = cells as usize;
        let mut field = Self { matter, extinction, bounds, cells, most: Vec::new(), max: 0.0 };
        let side = bounds.size() / f64::from(cells);
        let radius = 0.5 * side.length() * (1.0 + 1e-12);
        let index = |c: usize| DVec3::new((c % n) as f64, (c / n % n) as f64, (c / (n * n)) as f64);
        let bound = |c: usize| field.bound_in(bounds.min + side * (index(c) + 0.5), radius);
        let most: Option<Vec<f64>> = (0..n.pow(3)).into_par_iter().with_min_len(256).map(bound).collect();
        field.most = most?;
        field.max = field.most.iter().copied().fold(0.0, f64::max);
        field.max.is_finite().then_some(field)
    }

    /// Upper bound of the extinction around a place.
    fn bound_in(&self, p: DVec3, radius: f64) -> Option<f64> {
        let density = match &self.matter {
            Matter::Everywhere => 1.0,
            Matter::Ball { center, radius: ball } => f64::from(u8::from((p - *center).length() - radius < *ball)),
            Matter::Density(field) => field.bound(p, radius)?.1.max(0.0),
        };
        Some(density * self.extinction)
    }

    /// The box.
    pub fn bounds(&self) -> DAabb {
        self.bounds
    }

    /// Cells along each side of the box, each with a bound.
    pub fn cells(&self) -> u32 {
        self.cells
    }

    /// No value exceeds this.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Bytes of the bounds.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.most.as_slice()) as u64
    }

    /// The cells that may have an extinction.
    pub fn occupied_cells(&self) -> impl Iterator<Item = DAabb> + '_ {
        let n = self.cells as usize;
        let side = self.bounds.size() / f64::from(self.cells);
        let index = move |c: usize| DVec3::new((c % n) as f64, (c / n % n) as f64, (c / (n * n)) as f64);
        let some = self.most.iter().enumerate().filter(|(_, most)| **most > 0.0);
        some.map(move |(c, _)| DAabb::around(self.bounds.min + side * (index(c) + 0.5), 0.5 * side))
    }
}

impl ScalarField for BoundedExtinction {
    fn value(&self, p: DVec3) -> f64 {
        let density = match &self.matter {
            Matter::Everywhere => 1.0,
            Matter::Ball { center, radius } => f64::from(u8::from((p - *center).length_squared() < radius * radius)),
            Matter::Density(field) => field.value(p),
        };
        (density * self.extinction).max(0.0)
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        match &self.matter {
            Matter::Density(field) if field.value(p) > 0.0 => field.gradient(p) * self.extinction,
            _ => DVec3::ZERO,
        }
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        match &self.matter {
            Matter::Density(field) if field.value(p) > 0.0 => field.hessian(p) * self.extinction,
            _ => DMat3::ZERO,
        }
    }

    /// The bound of a whole cell, if the ball lies around the middle of a cell.
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let side = self.bounds.size() / f64::from(self.cells);
        let at = ((p - self.bounds.min) / side).clamp(DVec3::ZERO, DVec3::splat(f64::from(self.cells - 1)));
        let index = at.floor();
        let off_middle = ((at - index - 0.5) * side).length();
        if radius + off_middle > 0.5 * side.length() * (1.0 + 1e-6) {
            return self.bound_in(p, radius).map(|most| (0.0, most));
        }
        let [i, j, k] = index.to_array().map(|v| v as usize);
        let n = self.cells as usize;
        Some((0.0, self.most[(k * n + j) * n + i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    /// exp(−x² − y²)·(1 + sin 9z) − 1/2, bounded term by term.
    struct Hill;

    impl ScalarField for Hill {
        fn value(&self, p: DVec3) -> f64 {
            libm::exp(-p.x * p.x - p.y * p.y) * (1.0 + libm::sin(9.0 * p.z)) - 0.5
        }

        fn gradient(&self, _: DVec3) -> DVec3 {
            DVec3::ZERO
        }

        fn hessian(&self, _: DVec3) -> DMat3 {
            DMat3::ZERO
        }

        fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
            let nearest = (p.truncate().length() - radius).max(0.0);
            let wave = (1.0 + libm::sin(9.0 * p.z) + 9.0 * radius).min(2.0);
            Some((-0.5, libm::exp(-nearest * nearest) * wave - 0.5))
        }
    }

    /// Without a bound.
    struct Pole;

    impl ScalarField for Pole {
        fn value(&self, p: DVec3) -> f64 {
            1.0 / p.x
        }

        fn gradient(&self, _: DVec3) -> DVec3 {
            DVec3::ZERO
        }

        fn hessian(&self, _: DVec3) -> DMat3 {
            DMat3::ZERO
        }

        fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
            None
        }
    }

    #[test]
    fn values_stay_below_the_bound_of_their_cell() {
        let field =
            BoundedExtinction::new(Matter::Density(Arc::new(Hill)), 3.0, DAabb::new(DVec3::splat(-1.0), DVec3::ONE))
                .unwrap();
        let radius = (2.0 / f64::from(CELLS)) * 0.75f64.sqrt();
        let mut positive = 0;
        for i in 0..10_000 {
            let p = DVec3::from_array([0, 1, 2].map(|a| rng::unit(1, 2, i, a) * 2.0 - 1.0));
            let cell = ((p + 1.0) * 32.0).floor() / 32.0 - 1.0 + 1.0 / 64.0;
            let (low, high) = field.bound(cell, radius).unwrap();
            let exact = field.bound_in(cell, radius).unwrap();
            assert!((exact..=exact + 1e-9).contains(&high), "looked up {high}, its own {exact}");
            let value = field.value(p);
            assert!(low <= value && value <= high && high <= field.max, "{p}: {value} in {low} … {high}");
            positive += u32::from(value > 0.0);
        }
        assert!((1000..9000).contains(&positive), "{positive}");
    }

    #[test]
    fn a_density_without_a_bound_is_none() {
        assert!(
            BoundedExtinction::new(Matter::Density(Arc::new(Pole)), 1.0, DAabb::new(DVec3::splat(-1.0), DVec3::ONE))
                .is_none()
        );
    }
}
