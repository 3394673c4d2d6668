//! All roots of a scalar field along a ray, isolated by interval bounds.
//!
//! A segment whose ball cannot hold a zero by `ScalarField::bound` is dropped; others are halved until they are
//! `resolution` of the whole long. Neighbouring leaves that the bound cannot clear are a cluster. A leaf whose ends differ
//! in sign holds a root, refined to neighbouring numbers (Illinois steps, with bisection). A cluster of one change of sign
//! along which the slope keeps its sign is a simple root; any other is counted as unresolved: a tangent contact, two roots
//! closer than the resolution, or a loose bound. Exclusion is a proof, so outside clusters nothing is ever missed (Moore,
//! Interval Analysis, 1966); within a cluster the slope is looked at, at the ends of its leaves.

use crate::ray::Ray;
use splat_core::ScalarField;

/// How finely roots are told apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootParams {
    /// Roots closer than this share of the segment may not be told apart, in (0, 1); rounded to a power of two.
    pub resolution: f64,
    /// Where the field knows no bound: equal steps in which a change of sign is looked for.
    pub steps: u32,
}

impl Default for RootParams {
    fn default() -> Self {
        Self { resolution: 1.0 / 65536.0, steps: 4096 }
    }
}

/// The crossings of one segment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Crossings {
    /// Distances along the ray, rising.
    pub roots: Vec<f64>,
    /// Clusters of leaves that hold something else than one simple root, or nothing.
    pub unresolved: u32,
    /// Whether the field's bound covered the whole segment.
    pub proven: bool,
}

/// Where the field changes sign along the ray between distances `t0` < `t1`, both finite.
pub fn crossings(field: &dyn ScalarField, ray: &Ray, t0: f64, t1: f64, params: &RootParams) -> Crossings {
    let found = Crossings { proven: true, ..Crossings::default() };
    let mut search = Search { field, ray, found, cluster: None };
    let depth = (-params.resolution.clamp(1e-12, 0.5).log2()).ceil() as u32;
    let value = |t: f64| field.value(ray.at(t));
    if !(t0 < t1 && t0.is_finite() && t1.is_finite()) {
        return search.found;
    }
    if field.bound(ray.at(t0 + (t1 - t0) * 0.5), (t1 - t0) * 0.5).is_none() {
        search.march(t0, t1, params.steps.max(1));
    } else {
        search.halve([t0, t1], [value(t0), value(t1)], depth, params);
        search.close();
    }
    search.found
}

struct Search<'a> {
    field: &'a dyn ScalarField,
    ray: &'a Ray,
    found: Crossings,
    cluster: Option<Cluster>,
}

/// Neighbouring leaves that may hold roots.
struct Cluster {
    end: f64,
    /// Sign of the slope at its first end.
    rising: bool,
    monotone: bool,
    changes: u32,
}

/// One sign for zero, so that a root on a shared end belongs to one leaf.
fn positive(v: f64) -> bool {
    v >= 0.0
}

impl Search<'_> {
    fn value(&self, t: f64) -> f64 {
        self.field.value(self.ray.at(t))
    }

    fn halve(&mut self, t: [f64; 2], v: [f64; 2], depth: u32, params: &RootParams) {
        let middle = t[0] + (t[1] - t[0]) * 0.5;
        // Half an ulp more than half the length, so that rounding leaves no gap.
        let reach = (t[1] - t[0]) * (0.5 + f64::EPSILON) + middle.abs() * f64::EPSILON;
        let clear = match self.field.bound(self.ray.at(middle), reach) {
            Some((low, high)) => low > 0.0 || high < 0.0,
            None => return self.march(t[0], t[1], (params.steps >> 6).max(2)),
        };
        if clear {
            return;
        }
        if depth == 0 {
            return self.leaf(t, v);
        }
        let at_middle = self.value(middle);
        self.halve([t[0], middle], [v[0], at_middle], depth - 1, params);
        self.halve([middle, t[1]], [at_middle, v[1]], depth - 1, params);
    }

    fn leaf(&mut self, t: [f64; 2], v: [f64; 2]) {
        let rising = |t: f64| positive(self.field.gradient(self.ray.at(t)).dot(self.ray.direction));
        if self.cluster.as_ref().is_none_or(|c| c.end < t[0]) {
            let first = Cluster { end: t[0], rising: rising(t[0]), monotone: true, changes: 0 };
            self.close();
            self.cluster = Some(first);
        }
        let rises = rising(t[1]);
        let changes = positive(v[0]) != positive(v[1]);
        if let Some(c) = &mut self.cluster {
            c.end = t[1];
            c.monotone &= rises == c.rising;
            c.changes += u32::from(changes);
        }
        if changes {
            let root = self.refine(t, v);
            self.found.roots.push(root);
        }
    }

    /// Judges the cluster that has ended.
    fn close(&mut self) {
        if self.cluster.take().is_some_and(|c| c.changes != 1 || !c.monotone) {
            self.found.unresolved += 1;
        }
    }

    fn march(&mut self, t0: f64, t1: f64, steps: u32) {
        self.found.proven = false;
        let at = |i: u32| t0 + (t1 - t0) * (f64::from(i) / f64::from(steps));
        let mut before = self.value(t0);
        for i in 0..steps {
            let after = self.value(at(i + 1));
            if positive(before) != positive(after) {
                let root = self.refine([at(i), at(i + 1)], [before, after]);
                self.found.roots.push(root);
            }
            before = after;
        }
    }

    /// The place of the change of sign, to neighbouring numbers.
    fn refine(&self, t: [f64; 2], v: [f64; 2]) -> f64 {
        let [mut a, mut b] = t;
        let [mut va, mut vb] = v;
        let rising = positive(vb);
        for step in 0..200 {
            let middle = a + (b - a) * 0.5;
            if middle <= a || middle >= b {
                break;
            }
            // Every third step halves, so that the bracket shrinks for any field.
            let secant = b - (b - a) * (vb / (vb - va));
            let t = if step % 3 < 2 && secant > a && secant < b { secant } else { middle };
            let v = self.value(t);
            if v == 0.0 {
                return t;
            }
            if positive(v) == rising {
                (b, vb, va) = (t, v, va * 0.5);
            } else {
                (a, va, vb) = (t, v, vb * 0.5);
            }
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// Product of (x − r) over the roots; `bound` by interval products.
    struct Comb(Vec<f64>);

    impl ScalarField for Comb {
        fn value(&self, p: DVec3) -> f64 {
            self.0.iter().map(|r| p.x - r).product()
        }
        fn gradient(&self, p: DVec3) -> DVec3 {
            let without =
                |i: usize| self.0.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, r)| p.x - r).product::<f64>();
            DVec3::X * (0..self.0.len()).map(without).sum::<f64>()
        }
        fn hessian(&self, _: DVec3) -> DMat3 {
            DMat3::ZERO
        }
        fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
            let factor = |r: &f64| (p.x - r - radius, p.x - r + radius);
            Some(self.0.iter().map(factor).fold((1.0, 1.0), |a, b| {
                let ends = [a.0 * b.0, a.0 * b.1, a.1 * b.0, a.1 * b.1];
                (ends.into_iter().fold(f64::INFINITY, f64::min), ends.into_iter().fold(f64::NEG_INFINITY, f64::max))
            }))
        }
    }

    const RAY: Ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };

    #[test]
    fn every_root_is_found_to_the_last_digit() {
        let roots = vec![0.1, 0.1001, 0.4, 1.0 / 3.0, 0.9, 0.90003];
        let found = crossings(&Comb(roots.clone()), &RAY, 0.0, 1.0, &RootParams::default());
        let mut sorted = roots;
        sorted.sort_by(f64::total_cmp);
        assert_eq!(found.roots.len(), sorted.len(), "{found:?}");
        assert!(found.proven);
        for (a, b) in found.roots.iter().zip(&sorted) {
            assert!((a - b).abs() < 1e-15, "{a} is not {b}");
        }
    }

    #[test]
    fn a_tangent_contact_is_reported_and_not_invented() {
        let found = crossings(&Comb(vec![0.3, 0.3]), &RAY, 0.0, 1.0, &RootParams::default());
        assert!(found.roots.is_empty() && found.unresolved > 0, "{found:?}");
    }

    #[test]
    fn a_root_on_a_division_counts_once() {
        for root in [0.5, 0.25, 0.75] {
            let found = crossings(&Comb(vec![root]), &RAY, 0.0, 1.0, &RootParams::default());
            assert_eq!(found.roots, [root]);
        }
    }

    #[test]
    fn a_closer_pair_than_the_resolution_is_unresolved() {
        let found = crossings(&Comb(vec![0.3, 0.3 + 1e-9]), &RAY, 0.0, 1.0, &RootParams::default());
        assert!(found.roots.is_empty() && found.unresolved > 0, "{found:?}");
        let finer = RootParams { resolution: 1e-11, ..RootParams::default() };
        assert_eq!(crossings(&Comb(vec![0.3, 0.3 + 1e-9]), &RAY, 0.0, 1.0, &finer).roots.len(), 2);
    }
}
