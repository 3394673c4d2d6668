//! Depth of what is translucent: where along a ray its light is absorbed.
//!
//! A ray meets splats one by one, yet a medium absorbs everywhere between them. A medium splat stands for a cell as thick
//! as the spacing h of its lattice, so the part of its optical depth τ before a depth grows linearly from half a cell before
//! its centre to half a cell behind. The optical depth C along the ray is taken as linear between knots, which are ends of
//! cells. A surface is a step at its depth.
//!
//! A ray meets splats up to their radius beside it. Where a medium's face is slanted by g = dz/dρ these lie nearer and
//! farther than the face, and the sum of τ rises over the kernel's width m times g, as that of a blurred face would. So each
//! splat has a second weight a = τ·n (`narrow`, [`narrowing`]), whose sums over a lattice have no width but a cell's own.
//! Neither sum is wrong where a medium goes on: there they agree. A piece between two knots lasts until Σa and Στ agree
//! within [`AGREED`], which they do not in the midst of a face, and then
//!
//! - the first of a medium begins where its mean depth by a, μ, has it: at 2μ less its end, as C is linear;
//! - the last two are one, which ends at 2μ less its beginning;
//! - one alone has the mean μ and the variance of its a, so it is 2√(3·variance) long.
//!
//! For a homogeneous slab that is exact along the axes of its lattice, and within a tenth of h at 45°.
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

/// How far Σa and Στ of a piece may be apart, as a share of Στ. Less follows faces that are more slanted, more leaves
/// shorter pieces where the extinction bends: at 0.1 the first depth of a smooth cloud suffers more than a slab's gains.
const AGREED: f32 = 0.15;
/// Cells after which a piece ends all the same: beside a medium, where kernels alone are met, the sums never agree.
const MOST_CELLS: f32 = 10.0;
/// Share of Στ below which Σa says nothing about where a piece lies.
const TELLING: f32 = 0.5;

/// Numbers that a device keeps of a profile.
#[cfg(feature = "gpu")]
pub(crate) const WORDS: usize = 21;

/// n = n₀ + n₁·s of a footprint, s = ρ²/R²: τ·n of a lattice of splats has, along a ray through cells of `cell`·R, the sum of
/// τ, and the mean of ρ² that the cells themselves have, (`cell`·R)²/6. `mean` and `square` are those of s and s² over the
/// footprint.
#[cfg(feature = "raster")]
pub(crate) fn narrowing(mean: f64, square: f64, cell: f64) -> [f32; 2] {
    let slope = (cell * cell / 6.0 - mean) / (square - mean * mean);
    [(1.0 - slope * mean) as f32, slope as f32]
}

/// One splat on the ray of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthFragment {
    /// View depth.
    pub depth: f32,
    /// How thick the splat is along the ray, 0 for a surface.
    pub thickness: f32,
    /// What its optical depth is multiplied with for where it counts; 1 where a ray meets no splats beside it.
    pub narrow: f32,
    /// Optical depth of all splats before it.
    pub before: f32,
    /// Optical depth of all splats with it.
    pub after: f32,
}

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
    medium: Medium,
}

/// What of a medium is no piece yet. Nothing of it has any optical depth where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Medium {
    /// Depth of its first splat, from which moments are counted.
    origin: f32,
    /// Depth at which the current cell ends.
    end: f32,
    /// Depth at which the piece that is held back ends.
    held_end: f32,
    /// The last piece, held back for what follows may belong to it.
    held: Sums,
    /// Since that piece, up to `end`.
    now: Sums,
    /// Behind `end`.
    next: Sums,
}

/// Sums over parts of splats.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    tau: f32,
    /// Σa, and its first two moments in depth less `origin`.
    weight: f32,
    moment: f32,
    square: f32,
}

impl Sums {
    /// A part of optical depth `tau` that is `length` thick around `middle`.
    fn add(&mut self, tau: f32, narrow: f32, middle: f32, length: f32) {
        let weight = tau * narrow;
        self.tau += tau;
        self.weight += weight;
        self.moment += weight * middle;
        self.square += weight * (middle * middle + length * length * (1.0 / 12.0));
    }

    fn join(&mut self, other: Self) {
        self.tau += other.tau;
        self.weight += other.weight;
        self.moment += other.moment;
        self.square += other.square;
    }

    /// Mean depth, less `origin`, where the weights tell one.
    fn mean(&self) -> Option<f32> {
        (self.weight > TELLING * self.tau).then(|| self.moment / self.weight)
    }
}

impl Default for DepthProfile {
    fn default() -> Self {
        Self {
            first: f32::INFINITY,
            median: f32::INFINITY,
            mean: 0.0,
            m2: 0.0,
            knot: [f32::NEG_INFINITY, 0.0],
            medium: Medium::default(),
        }
    }
}

impl DepthProfile {
    /// Adds a splat. One nearer than those before counts at its place within the current piece: slices are not sorted
    /// inside.
    pub fn add(&mut self, splat: &DepthFragment) {
        let DepthFragment { depth, thickness, narrow, before, after } = *splat;
        if thickness <= 0.0 {
            self.close(before, depth);
            self.piece([depth, before]);
            self.piece([depth, after]);
            return;
        }
        let begin = depth - 0.5 * thickness;
        if self.is_open() && begin >= self.medium.end + thickness {
            self.close(before, f32::INFINITY);
        }
        if !self.is_open() {
            self.medium = Medium { origin: depth, end: depth + 0.5 * thickness, ..Medium::default() };
        }
        // The gap was less than a cell.
        if begin >= self.medium.end {
            self.cell(thickness, before);
        }
        let medium = &mut self.medium;
        let tau = after - before;
        let middle = depth - medium.origin;
        let share = ((medium.end - begin) / thickness).clamp(0.0, 1.0);
        let rest = 1.0 - share;
        medium.now.add(tau * share, narrow, middle - 0.5 * rest * thickness, share * thickness);
        medium.next.add(tau * rest, narrow, middle + 0.5 * share * thickness, rest * thickness);
    }

    fn is_open(&self) -> bool {
        self.medium.held.tau + self.medium.now.tau + self.medium.next.tau > 0.0
    }

    /// Ends the current cell of a medium, and the piece where its sums agree; `total` is the optical depth so far.
    fn cell(&mut self, thickness: f32, total: f32) {
        let Medium { origin, end, held_end, held, now, next } = self.medium;
        let begin = if held.tau > 0.0 { held_end } else { origin - 0.5 * thickness };
        let agree = (now.weight - now.tau).abs() <= AGREED * now.tau;
        if now.tau > 0.0 && (agree || end - begin >= MOST_CELLS * thickness) {
            let behind = now.tau + next.tau;
            if held.tau > 0.0 {
                self.piece([held_end, (total - behind).max(self.knot[1])]);
            } else {
                let twice = now.mean().map_or(begin, |mean| origin + (2.0 * mean - (end - origin)));
                self.knot[0] = self.knot[0].max(twice.max(begin).min(end));
            }
            self.medium.held = now;
            self.medium.held_end = end;
            self.medium.now = Sums::default();
        }
        self.medium.now.join(next);
        self.medium.next = Sums::default();
        self.medium.end = end + thickness;
    }

    /// First, median, mean and standard deviation of the depth at which light is absorbed, +∞ where undefined; `total` is
    /// the optical depth of all splats, `solid` the depth of an opaque surface behind them.
    pub fn depths(mut self, total: f32, solid: Option<f32>) -> [f32; 4] {
        self.close(total, solid.unwrap_or(f32::INFINITY));
        if let Some(depth) = solid {
            self.piece([depth, total]);
            self.piece([depth, f32::INFINITY]);
        }
        let absorbed = -libm::expm1f(-self.knot[1]);
        if absorbed <= 0.0 {
            return [f32::INFINITY; 4];
        }
        [self.first, self.median, self.mean, (self.m2 / absorbed).max(0.0).sqrt()]
    }

    /// The profile whose first, median, mean and standard deviation are known, such as those of an average of hits; `total` is
    /// the optical depth of all. What its curve is between them is forgotten.
    pub fn of_depths(first: f32, median: f32, mean: f32, sigma: f32, total: f32) -> Self {
        let absorbed = -libm::expm1f(-total);
        if !(absorbed > 0.0 && mean.is_finite()) {
            return Self::default();
        }
        // No later than anything that may lie behind it.
        let last = [first, median].into_iter().filter(|d| d.is_finite()).fold(mean, f32::max);
        Self { first, median, mean, m2: sigma * sigma * absorbed, knot: [last, total], medium: Medium::default() }
    }

    /// Goes on with the profile of what lies behind, whose total is `optical_depth`; `before` is that of all so far. Mean and
    /// deviation are exact. Where the first depth, or the median, is reached in it depends on the curve of what it hides; between
    /// its known depths that is taken as linear.
    pub fn append(&mut self, behind: &Self, before: f32, optical_depth: f32) {
        self.close(before, f32::INFINITY);
        if before <= 0.0 {
            *self = *behind;
            return;
        }
        let mut behind = *behind;
        behind.close(optical_depth, f32::INFINITY);
        let total = before + behind.knot[1];
        if behind.knot[1] <= 0.0 {
            return;
        }
        if self.first == f32::INFINITY && total >= FIRST {
            self.first = behind.depth_at(FIRST - before);
        }
        if self.median == f32::INFINITY && total >= MEDIAN {
            self.median = behind.depth_at(MEDIAN - before);
        }
        let transmittance = libm::expf(-before);
        let share = transmittance * -libm::expm1f(-behind.knot[1]);
        let step = behind.mean - self.mean;
        let so_far = -libm::expm1f(-before);
        self.mean += step * (share / (so_far + share)).min(1.0);
        self.m2 += transmittance * behind.m2 + step * step * so_far * share / (so_far + share);
        self.knot = [self.knot[0].max(behind.knot[0]), total];
    }

    /// Where the optical depth of a closed profile reaches a level, linear between the depths that it knows.
    fn depth_at(&self, level: f32) -> f32 {
        let deviation = libm::sqrtf((self.m2 / -libm::expm1f(-self.knot[1])).max(0.0));
        let begin = (self.mean - libm::sqrtf(3.0) * deviation).min(self.first);
        let known = [[begin, 0.0], [self.first, FIRST], [self.median, MEDIAN], self.knot];
        let mut last = known[0];
        for [depth, optical] in known.into_iter().skip(1).filter(|k| k[0].is_finite()) {
            if level <= optical {
                let share = ((level - last[1]) / (optical - last[1]).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
                return last[0] + (depth - last[0]).max(0.0) * share;
            }
            last = [depth.max(last[0]), optical];
        }
        last[0]
    }

    /// As a device keeps it: the largest number stands for infinity.
    #[cfg(feature = "gpu")]
    pub(crate) fn words(&self) -> [f32; WORDS] {
        let Medium { origin, end, held_end, held, now, next } = self.medium;
        let [z, c] = self.knot;
        let mut words = [0.0; WORDS];
        words[..9].copy_from_slice(&[self.first, self.median, self.mean, self.m2, z, c, origin, end, held_end]);
        for (to, sums) in words[9..].chunks_exact_mut(4).zip([held, now, next]) {
            to.copy_from_slice(&[sums.tau, sums.weight, sums.moment, sums.square]);
        }
        words.map(|v| v.clamp(f32::MIN, f32::MAX))
    }

    /// From what a device kept.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_words(words: [f32; WORDS]) -> Self {
        let far = |v: f32| if v.abs() < f32::MAX { v } else { v.signum() * f32::INFINITY };
        let [first, median, mean, m2, z, c, origin, end, held_end, ..] = words;
        let sums = |k: usize| Sums { tau: words[k], weight: words[k + 1], moment: words[k + 2], square: words[k + 3] };
        let medium = Medium { origin, end, held_end, held: sums(9), now: sums(13), next: sums(17) };
        Self { first: far(first), median: far(median), mean, m2, knot: [far(z), c], medium }
    }

    /// Ends the medium so far, whose optical depth is `total`, not behind `limit`.
    fn close(&mut self, total: f32, limit: f32) {
        if !self.is_open() {
            return;
        }
        let Medium { origin, end, held_end, held, mut now, next } = std::mem::take(&mut self.medium);
        now.join(next);
        now.join(held);
        // No cell reaches beyond these, whatever a few odd weights say.
        let first_half = end - origin;
        let (least, most) = if held.tau > 0.0 {
            (self.knot[0], end + (end - held_end))
        } else {
            (origin - first_half, end + 2.0 * first_half)
        };
        let (begin, to) = match now.mean() {
            Some(mean) if held.tau > 0.0 => (least, origin + (2.0 * mean - (least - origin))),
            Some(mean) => {
                let half = (3.0 * (now.square / now.weight - mean * mean).max(0.0)).sqrt();
                (origin + (mean - half), origin + (mean + half))
            }
            None => (least, end),
        };
        self.knot[0] = self.knot[0].max(begin.max(least).min(limit));
        let to = to.min(most);
        self.piece([to.min(limit), total]);
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
        let share = libm::expf(-c) * -libm::expm1f(-delta);
        let (mean, variance) = if length > 0.0 { moments(delta) } else { (0.0, 0.0) };
        let absorbed = -libm::expm1f(-to[1]);
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
    let fall = -libm::expm1f(-delta);
    let rest = 1.0 - fall;
    (1.0 / delta - rest / fall, 1.0 / square - rest / (fall * fall))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(depth: f32, thickness: f32, depths: [f32; 2]) -> DepthFragment {
        let [before, after] = depths;
        DepthFragment { depth, thickness, narrow: 1.0, before, after }
    }

    /// Splats at `depths`, all of optical depth `tau` and thickness `thickness`.
    fn profile(depths: &[f32], thickness: f32, tau: f32) -> (DepthProfile, f32) {
        let mut profile = DepthProfile::default();
        for (i, depth) in depths.iter().enumerate() {
            profile.add(&at(*depth, thickness, [i as f32 * tau, (i + 1) as f32 * tau]));
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
        let m = 1.0 / tau - 1.0 / tau.exp_m1();
        let e = tau.exp();
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
        let near = 0.25f32;
        let far = 1.5f32;
        let (profile, total) = {
            let mut p = DepthProfile::default();
            p.add(&at(3.0, 0.0, [0.0, near]));
            p.add(&at(4.0, 0.0, [near, near + far]));
            (p, near + far)
        };
        let a = -(-f64::from(near)).exp_m1();
        let b = (-f64::from(near)).exp() - (-f64::from(total)).exp();
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
        two.add(&at(1.0, 0.2, [0.0, 0.5]));
        two.add(&at(5.0, 0.2, [0.5, 1.0]));
        let [_, median, ..] = two.depths(1.0, None);
        assert!((median - (4.9 + 0.2 * (std::f32::consts::LN_2 - 0.5) / 0.5)).abs() < 1e-6, "{median}");
        let mut cut = DepthProfile::default();
        cut.add(&at(1.0, 0.2, [0.0, 3.0]));
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
        let below = moments(SERIES * (1.0 - 1e-6));
        let above = moments(SERIES);
        assert!((below.0 - above.0).abs() < 1e-6 && (below.1 - above.1).abs() < 1e-6, "{below:?} {above:?}");
    }
}
