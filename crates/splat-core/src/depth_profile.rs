//! Depth of what is translucent: where along a ray its light is absorbed.
//!
//! A ray meets splats one by one, yet a medium absorbs everywhere between them. A medium splat stands for a cell as thick
//! as the spacing h of its lattice, so the optical depth C before depth z is taken as linear between knots
//! (z_g, S + τ_g/2), S the sum before the splats at z_g and τ_g theirs, and it begins and ends half a cell outside. For
//! a homogeneous slab that is exact. A surface is a step at its depth.
//!
//! The absorbed part has the density e^−C·dC. On a piece of length l where C grows by δ its share is e^−C(1 − e^−δ), its
//! mean lies l·m(δ) behind the piece's beginning, and its variance is l²·v(δ):
//!
//! m = 1/δ − 1/(e^δ − 1), v = 1/δ² − e^δ/(e^δ − 1)²

/// Optical depth at which opacity passes 1/255: −ln(1 − 1/255).
const FIRST: f32 = 0.003_929_279_4;
/// Optical depth at which half of the light is gone.
const MEDIAN: f32 = std::f32::consts::LN_2;
/// Growth of optical depth below which m and v are taken from their series, which err by less than 1e-7 there.
const SERIES: f32 = 0.5;

/// Numbers that a device keeps of a profile.
#[cfg(feature = "gpu")]
pub(crate) const WORDS: usize = 9;

/// Absorption along the ray of one pixel so far, front to back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthProfile {
    first: f32,
    median: f32,
    mean: f32,
    /// Σ share·(depth − mean)².
    m2: f32,
    /// The last knot: its depth, and the optical depth before it.
    knot: [f32; 2],
    /// Depth of the splats since, half of their thickness, and the optical depth before them.
    open: Option<Open>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Open {
    depth: f32,
    half: f32,
    before: f32,
}

impl Default for DepthProfile {
    fn default() -> Self {
        Self {
            first: f32::INFINITY,
            median: f32::INFINITY,
            mean: 0.0,
            m2: 0.0,
            knot: [f32::NEG_INFINITY, 0.0],
            open: None,
        }
    }
}

impl DepthProfile {
    /// Adds a splat at view depth `depth` that is `thickness` thick, 0 for a surface; `before` and `after` are the optical
    /// depths of all splats without and with it. A splat nearer than the one before counts as lying beside it: slices are
    /// not sorted inside.
    pub fn add(&mut self, depth: f32, thickness: f32, [before, after]: [f32; 2]) {
        if thickness <= 0.0 {
            self.close(before, depth);
            self.piece([depth, before]);
            self.piece([depth, after]);
            return;
        }
        match self.open {
            Some(open) if depth <= open.depth => {}
            Some(open) if depth - open.depth <= open.half + 0.5 * thickness => {
                self.piece([open.depth, 0.5 * (open.before + before)]);
                self.open = Some(Open { depth, half: 0.5 * thickness, before });
            }
            _ => {
                self.close(before, f32::INFINITY);
                self.knot = [(depth - 0.5 * thickness).max(self.knot[0]), before];
                self.open = Some(Open { depth, half: 0.5 * thickness, before });
            }
        }
    }

    /// First, median, mean and standard deviation of the depth at which light is absorbed, +∞ where undefined; `total` is
    /// the optical depth of all splats, `solid` the depth of an opaque surface behind them.
    pub fn depths(mut self, total: f32, solid: Option<f32>) -> [f32; 4] {
        self.close(total, solid.unwrap_or(f32::INFINITY));
        if let Some(depth) = solid {
            self.piece([depth, total]);
            self.piece([depth, f32::INFINITY]);
        }
        let absorbed = -(-self.knot[1]).exp_m1();
        if absorbed <= 0.0 {
            return [f32::INFINITY; 4];
        }
        [self.first, self.median, self.mean, (self.m2 / absorbed).max(0.0).sqrt()]
    }

    /// As a device keeps it: the largest number stands for infinity, no half thickness for no open splats.
    #[cfg(feature = "gpu")]
    pub(crate) fn words(&self) -> [f32; WORDS] {
        let open = self.open.map_or([0.0; 3], |open| [open.depth, open.half, open.before]);
        let [z, c] = self.knot;
        let all = [self.first, self.median, self.mean, self.m2, z, c, open[0], open[1], open[2]];
        all.map(|v| v.clamp(f32::MIN, f32::MAX))
    }

    /// From what a device kept.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_words([first, median, mean, m2, z, c, depth, half, before]: [f32; WORDS]) -> Self {
        let far = |v: f32| if v.abs() < f32::MAX { v } else { v.signum() * f32::INFINITY };
        let open = (half > 0.0).then_some(Open { depth, half, before });
        Self { first: far(first), median: far(median), mean, m2, knot: [far(z), c], open }
    }

    /// Ends the medium so far, whose optical depth is `total`, not behind `limit`.
    fn close(&mut self, total: f32, limit: f32) {
        if let Some(open) = self.open.take() {
            self.piece([open.depth.min(limit), 0.5 * (open.before + total)]);
            self.piece([(open.depth + open.half).min(limit), total]);
        }
    }

    /// A piece from the last knot to the knot `to`.
    fn piece(&mut self, to: [f32; 2]) {
        let [z, c] = self.knot;
        // A surface inside a cell of a medium lies before the cell's end.
        let to = [to[0].max(z), to[1]];
        self.knot = to;
        let delta = to[1] - c;
        if delta <= 0.0 {
            return;
        }
        let length = if z.is_finite() { to[0] - z } else { 0.0 };
        let start = to[0] - length;
        let at = |level: f32| start + length * ((level - c) / delta).clamp(0.0, 1.0);
        if c < FIRST && FIRST <= to[1] {
            self.first = at(FIRST);
        }
        if c < MEDIAN && MEDIAN <= to[1] {
            self.median = at(MEDIAN);
        }
        let share = (-c).exp() * -(-delta).exp_m1();
        let (mean, variance) = if length > 0.0 { moments(delta) } else { (0.0, 0.0) };
        let absorbed = -(-to[1]).exp_m1();
        let step = start + length * mean - self.mean;
        self.mean += step * (share / absorbed).min(1.0);
        self.m2 += share * (step * (start + length * mean - self.mean) + length * length * variance);
    }
}

/// m(δ) and v(δ).
fn moments(delta: f32) -> (f32, f32) {
    let square = delta * delta;
    if delta < SERIES {
        let mean = 0.5 - delta * (1.0 / 12.0 - square * (1.0 / 720.0 - square / 30_240.0));
        return (mean, 1.0 / 12.0 - square * (1.0 / 240.0 - square / 6048.0));
    }
    let fall = -(-delta).exp_m1();
    let rest = 1.0 - fall;
    (1.0 / delta - rest / fall, 1.0 / square - rest / (fall * fall))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Splats at `depths`, all of optical depth `tau` and thickness `thickness`.
    fn profile(depths: &[f32], thickness: f32, tau: f32) -> (DepthProfile, f32) {
        let mut profile = DepthProfile::default();
        for (i, depth) in depths.iter().enumerate() {
            profile.add(*depth, thickness, [i as f32 * tau, (i + 1) as f32 * tau]);
        }
        (profile, depths.len() as f32 * tau)
    }

    fn close(found: [f32; 4], expected: [f64; 4], tolerance: f64) {
        for (f, e) in found.into_iter().zip(expected) {
            assert!((f64::from(f) - e).abs() < tolerance || f64::from(f) == e, "{found:?}, expected {expected:?}");
        }
    }

    /// Closed form of a homogeneous slab from `z` on, `length` thick, of optical depth `tau`.
    fn slab(z: f64, length: f64, tau: f64) -> [f64; 4] {
        let at = |level: f64| if level <= tau { z + length * level / tau } else { f64::INFINITY };
        let (m, e) = (1.0 / tau - 1.0 / tau.exp_m1(), tau.exp());
        let variance = 1.0 / (tau * tau) - e / (tau.exp_m1() * tau.exp_m1());
        [at(-(-1.0f64 / 255.0).ln_1p()), at(2f64.ln()), z + length * m, length * variance.sqrt()]
    }

    #[test]
    fn a_slab_has_its_closed_form_whatever_its_cells() {
        for n in [1, 3, 10, 64] {
            for tau in [0.001, 0.3, 1.0, 5.0] {
                let h = 0.5 / n as f32;
                let depths: Vec<f32> = (0..n).map(|i| 2.0 + h * (i as f32 + 0.5)).collect();
                let (profile, total) = profile(&depths, h, tau / n as f32);
                close(profile.depths(total, None), slab(2.0, 0.5, f64::from(tau)), 3e-6);
            }
        }
    }

    #[test]
    fn splats_beside_each_other_count_as_one_cell() {
        let (profile, total) = profile(&[1.0, 1.0, 1.0, 1.1, 1.1, 1.1], 0.1, 0.1);
        close(profile.depths(total, None), slab(0.95, 0.2, 0.6), 1e-6);
    }

    #[test]
    fn surfaces_are_steps() {
        let (near, far) = (0.25f32, 1.5f32);
        let (profile, total) = {
            let mut p = DepthProfile::default();
            p.add(3.0, 0.0, [0.0, near]);
            p.add(4.0, 0.0, [near, near + far]);
            (p, near + far)
        };
        let (a, b) = (-(-f64::from(near)).exp_m1(), (-f64::from(near)).exp() - (-f64::from(total)).exp());
        let mean = (3.0 * a + 4.0 * b) / (a + b);
        close(profile.depths(total, None), [3.0, 4.0, mean, (a * b).sqrt() / (a + b)], 1e-6);
        // With a wall behind, everything is absorbed.
        let c = (-f64::from(total)).exp();
        let mean = 3.0 * a + 4.0 * b + 6.0 * c;
        let sigma = (9.0 * a + 16.0 * b + 36.0 * c - mean * mean).sqrt();
        close(profile.depths(total, Some(6.0)), [3.0, 4.0, mean, sigma], 3e-6);
    }

    #[test]
    fn gaps_between_media_stay_empty_and_walls_cut_cells() {
        let mut two = DepthProfile::default();
        two.add(1.0, 0.2, [0.0, 0.5]);
        two.add(5.0, 0.2, [0.5, 1.0]);
        let [_, median, ..] = two.depths(1.0, None);
        assert!((median - (4.9 + 0.2 * (std::f32::consts::LN_2 - 0.5) / 0.5)).abs() < 1e-6, "{median}");
        let mut cut = DepthProfile::default();
        cut.add(1.0, 0.2, [0.0, 3.0]);
        let [first, median, mean, _] = cut.depths(3.0, Some(1.0));
        assert!(first >= 0.9 && median <= 1.0 && mean <= 1.0, "{first} {median} {mean}");
    }

    #[test]
    fn nothing_has_no_depth_and_a_wall_alone_has_its_own() {
        assert_eq!(DepthProfile::default().depths(0.0, None), [f32::INFINITY; 4]);
        assert_eq!(DepthProfile::default().depths(0.0, Some(7.5)), [7.5, 7.5, 7.5, 0.0]);
    }

    #[test]
    fn moments_do_not_jump_where_the_series_ends() {
        let (below, above) = (moments(SERIES * (1.0 - 1e-6)), moments(SERIES));
        assert!((below.0 - above.0).abs() < 1e-6 && (below.1 - above.1).abs() < 1e-6, "{below:?} {above:?}");
    }
}
