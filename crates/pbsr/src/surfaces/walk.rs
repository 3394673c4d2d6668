//! A step of the Brownian motion on an implicit surface (Tanaka 2012, Eqs. 2 and 3), and the way back onto it.
//!
//! x ← x + P·dw − dt·∇f/|∇f|²·Tr(H·P), P = 1 − n·nᵀ, n = ∇f/|∇f|, ⟨dw_i·dw_j⟩ = 2·δ_ij·dt
//!
//! Each step ends on the surface: Newton steps along the gradient, x ← x − m·f·∇f/|∇f|², none longer than the trust
//! radius. m is the multiplicity of the root: where a step is more than 0.4 of the one before, 1/(1 − ratio) is the
//! multiplicity, 2 on a double root, where plain steps only halve the distance. If that does not converge the root is
//! bracketed along the gradient and bisected. A step that ends nowhere, out of the surface's part of the box, on
//! another sheet (its gradient turned by more than 90°) or farther than four steps is not made: the walker stays, which
//! keeps the uniform density, as the reverse of each step is as likely as the step. At a face of the box the step is
//! reflected first.
//!
//! f and its derivatives are divided by the largest component of ∇f, so that no scale of f overflows.

use crate::stream::Stream;
use crate::surfaces::implicit::ImplicitSurface;
use glam::{DMat3, DVec3};
use splat_core::glam;

/// Newton steps before bisection.
const NEWTON: u32 = 16;

/// Distance to the surface that is good enough, in trust radii.
const TOLERANCE: f64 = 1e-7;

/// Walks on one surface.
#[derive(Clone, Copy)]
pub struct Walk<'a> {
    surface: ImplicitSurface<'a>,
    /// √(2dt): standard deviation of dw_i.
    step: f64,
    /// The longest Newton step.
    trust: f64,
}

impl<'a> Walk<'a> {
    /// Steps of standard deviation `step` = √(2dt) per axis, world units; the paper takes 10⁻³ to 10⁻² of an analytic
    /// surface's width, and 0.3 of a cell in volumes. Newton steps are at most 1/16 of the box.
    ///
    /// # Errors
    /// [`crate::Error`] for a surface that is not valid or a step that is not positive.
    pub fn new(surface: &ImplicitSurface<'a>, step: f64) -> Result<Self, crate::Error> {
        surface.validate()?;
        crate::params::positive(step, "step")?;
        let trust = surface.bounds.size().max_element() / 16.0;
        Ok(Self { surface: *surface, step, trust })
    }

    /// The next place of a walker at `x` on the surface, its random numbers from counter (seed, walker, number of the
    /// step); `None` when the step is refused and the walker stays.
    pub fn step(&self, x: DVec3, seed: u64, walker: u64, number: u64) -> Option<DVec3> {
        self.advance(x, &mut Stream::new(seed, crate::stream::Stage::Brownian, walker, number))
    }

    pub(crate) fn advance(&self, x: DVec3, stream: &mut Stream) -> Option<DVec3> {
        let (gradient, scale) = self.gradient(x)?;
        let to = self.euler(x, gradient, scale, stream.normal3() * self.step);
        let to = self.project(self.reflect(to))?;
        let near = (to - x).length() <= 4.0 * self.step;
        let same_sheet = self.gradient(to).is_none_or(|(g, _)| g.dot(gradient) > 0.0);
        (to.is_finite() && near && same_sheet && self.surface.contains(to)).then_some(to)
    }

    /// One step of Euler's method from `x`, where ∇f is `gradient` times `scale`: on the surface in the mean alone.
    fn euler(&self, x: DVec3, gradient: DVec3, scale: f64, dw: DVec3) -> DVec3 {
        let square = gradient.length_squared();
        let tangential = dw - gradient * (gradient.dot(dw) / square);
        // Tr(H·P) = Tr H − n·H·n.
        let h: DMat3 = self.surface.field.hessian(x);
        let trace = (h.x_axis.x + h.y_axis.y + h.z_axis.z - gradient.dot(h * gradient) / square) / scale;
        x + tangential + gradient * (-0.5 * self.step * self.step / square * trace)
    }

    /// Mirrored at the faces of the box.
    fn reflect(&self, p: DVec3) -> DVec3 {
        let low = self.surface.bounds.min;
        let high = self.surface.bounds.max;
        let p = DVec3::select(p.cmplt(low), 2.0 * low - p, p);
        DVec3::select(p.cmpgt(high), 2.0 * high - p, p)
    }

    /// ∇f over its largest component, and that component; `None` where the gradient vanishes or is not finite.
    fn gradient(&self, p: DVec3) -> Option<(DVec3, f64)> {
        let g = self.surface.field.gradient(p);
        let scale = g.abs().max_element();
        (scale > 0.0 && scale.is_finite() && g.is_finite()).then(|| (g / scale, scale))
    }

    /// The place on the surface next to `p` along the gradient, within 10⁻⁷ trust radii; `None` if no root lies within
    /// the trust radius, or the gradient vanishes.
    pub fn project(&self, p: DVec3) -> Option<DVec3> {
        let mut x = p;
        let mut last = f64::INFINITY;
        let mut multiplicity = 1.0;
        for _ in 0..NEWTON {
            let f = self.surface.value(x);
            if f == 0.0 {
                return Some(x);
            }
            let (gradient, scale) = self.gradient(x)?;
            let square = gradient.length_squared();
            let mut step = gradient * (-(f / scale) * multiplicity / square);
            let length = step.length();
            if length.is_nan() {
                return None;
            }
            if length > self.trust {
                step *= self.trust / length;
            }
            let ratio = length / last;
            if multiplicity == 1.0 && (0.4..1.0).contains(&ratio) && last <= self.trust {
                multiplicity = (1.0 / (1.0 - ratio)).round().clamp(1.0, 4.0);
            }
            last = length;
            x += step;
            if length <= TOLERANCE * self.trust {
                return Some(x);
            }
        }
        self.bisect(p)
    }

    /// A root along the gradient at `p`, between trust radii before and behind.
    fn bisect(&self, p: DVec3) -> Option<DVec3> {
        let (gradient, _) = self.gradient(p)?;
        let n = gradient.normalize();
        let at = |t: f64| self.surface.value(p + n * t);
        let mut low = -self.trust;
        let mut high = self.trust;
        let f_low = at(low);
        if !(f_low.is_finite() && at(high).is_finite()) || (f_low < 0.0) == (at(high) < 0.0) {
            return None;
        }
        while high - low > TOLERANCE * self.trust {
            let middle = 0.5 * (low + high);
            if (at(middle) < 0.0) == (f_low < 0.0) { low = middle } else { high = middle }
        }
        Some(p + n * (0.5 * (low + high)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{DAabb, ScalarField};

    /// A torus, whose curvatures change from place to place and in sign.
    struct Torus;

    impl Torus {
        /// The place at two angles, the tube 0.4 of 1.
        fn at(u: f64, v: f64) -> DVec3 {
            let r = 1.0 + 0.4 * v.cos();
            DVec3::new(r * u.cos(), r * u.sin(), 0.4 * v.sin())
        }
    }

    impl ScalarField for Torus {
        fn value(&self, p: DVec3) -> f64 {
            let ring = p.x.hypot(p.y) - 1.0;
            ring * ring + p.z * p.z - 0.16
        }
        fn gradient(&self, p: DVec3) -> DVec3 {
            let r = p.x.hypot(p.y);
            2.0 * DVec3::new(p.x * (r - 1.0) / r, p.y * (r - 1.0) / r, p.z)
        }
        fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
            None
        }
    }

    #[test]
    fn eq3_a_step_without_the_way_back_stays_on_the_surface_in_the_mean() {
        // By Itô the mean of f changes by ∇f·dx_S + dt·Tr(H·P), which is 0; with the other sign of dx_S by twice dt·Tr(H·P), scores
        // of standard errors.
        let bounds = DAabb { min: DVec3::splat(-2.0), max: DVec3::splat(2.0) };
        let surface = ImplicitSurface { field: &Torus, level: 0.0, bounds, inside: None };
        let step = 0.01;
        let n = 20_000;
        let walk = Walk::new(&surface, step).expect("a valid surface");
        for (u, v) in [(0.0, 0.0), (0.7, 1.0), (2.0, 2.2), (-1.0, 3.1), (3.0, -1.3)] {
            let x = Torus::at(u, v);
            let (gradient, scale) = walk.gradient(x).expect("a regular place");
            let mut stream = Stream::new(7, crate::stream::Stage::Brownian, 0, 0);
            let mut sums = [0.0; 2];
            for _ in 0..n {
                let f = Torus.value(walk.euler(x, gradient, scale, stream.normal3() * step));
                sums = [sums[0] + f, sums[1] + f * f];
            }
            let mean = sums[0] / f64::from(n);
            let error = ((sums[1] / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            // What is of second order in dt.
            let rest = 10.0 * step.powi(4);
            assert!(mean.abs() < 4.0 * error + rest, "({u}, {v}): {mean:e}, standard error {error:e}");
        }
    }
}
