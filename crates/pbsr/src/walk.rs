//! One step of the Brownian motion on an implicit surface (Tanaka 2012, Eqs. 2 and 3), and the way back onto it.
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

use crate::implicit::ImplicitSurface;
use crate::stream::Stream;
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
        let square = gradient.length_squared();
        let dw = stream.normal3() * self.step;
        let tangential = dw - gradient * (gradient.dot(dw) / square);
        // Tr(H·P) = Tr H − n·H·n.
        let h: DMat3 = self.surface.field.hessian(x);
        let trace = (h.x_axis.x + h.y_axis.y + h.z_axis.z - gradient.dot(h * gradient) / square) / scale;
        let drift = gradient * (-0.5 * self.step * self.step / square * trace);
        let to = self.reflect(x + tangential + drift);
        let to = self.project(to)?;
        let near = (to - x).length() <= 4.0 * self.step;
        let same_sheet = self.gradient(to).is_none_or(|(g, _)| g.dot(gradient) > 0.0);
        (to.is_finite() && near && same_sheet && self.surface.contains(to)).then_some(to)
    }

    /// Mirrored at the faces of the box.
    fn reflect(&self, p: DVec3) -> DVec3 {
        let (low, high) = (self.surface.bounds.min, self.surface.bounds.max);
        let p = DVec3::select(p.cmplt(low), 2.0 * low - p, p);
        DVec3::select(p.cmpgt(high), 2.0 * high - p, p)
    }

    /// ∇f over its largest component, and that component; `None` where the gradient vanishes or is not finite.
    fn gradient(&self, p: DVec3) -> Option<(DVec3, f64)> {
        let g = self.surface.field.gradient(p);
        let scale = g.abs().max_element();
        (scale > 0.0 && scale.is_finite() && g.is_finite()).then(|| (g / scale, scale))
    }

    /// The place on the surface next to `p` along the gradient, within 10⁻⁷ trust radii; `None` when there is none within
    /// the trust radius, or the gradient vanishes.
    pub fn project(&self, p: DVec3) -> Option<DVec3> {
        let mut x = p;
        let (mut last, mut multiplicity) = (f64::INFINITY, 1.0);
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
        let (mut low, mut high) = (-self.trust, self.trust);
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
