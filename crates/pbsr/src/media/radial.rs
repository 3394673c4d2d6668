//! Points distributed as a footprint's kernel, from uniform ones by a table: products and sums alone, so that a device gives the
//! same bits.
//!
//! A uniform point p of the unit ball (disc), found by rejection from the cube (square), has uniform |p|³ (|p|²) and a direction
//! that does not depend on it. So p·h(|p|²) is distributed as the kernel where h moves each radius to the one with the same
//! share of the kernel inside.
//!
//! The footprint is the sum over n ≥ 3 of e^(−q)·qⁿ/n!·(1 − s)ⁿ, and (1 − ρ²)ⁿ is the projection of the ball's
//! (1 − r²)^(n−½)·n!/(√π·Γ(n+½)), for every direction of the ray (Abel's transform). At r = sin θ both are powers of cos θ, so
//! their shares are sums of smooth functions of θ, by Simpson's rule.
//!
//! h is tabled over t = 1 − |p|² in 16 cells an octave, for the kernel's rim is a power of t; each cell is a cubic.

use splat_core::Footprint;

/// Octaves of t: below the smallest that a float of 1 − |p|² takes there is none.
const OCTAVES: usize = 24;
/// Bits of a float below its cell's.
const BELOW: u32 = 19;
/// Cells of a table, and one for t = 1.
const CELLS: usize = (OCTAVES << (23 - BELOW)) + 1;
/// Steps of the integral over θ from the centre to the rim.
const STEPS: usize = 2048;

/// The shape that is filled with points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// The kernel in space, whose projection is the footprint.
    Ball,
    /// The footprint on the plane.
    Disc,
}

/// h as cubics, lowest power first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Radial {
    cells: Vec<[f32; 4]>,
}

impl Radial {
    pub(crate) fn new(footprint: &Footprint, shape: Shape) -> Self {
        let shares = Shares::new(footprint, shape);
        let begin = |cell: usize| f64::from(f32::from_bits(((cell as u32) << BELOW) + ((127 - OCTAVES as u32) << 23)));
        let cells = (0..CELLS - 1).map(|c| cubic(begin(c), begin(c + 1), |t| shares.stretch(t)));
        Self { cells: cells.chain([[shares.stretch(1.0) as f32, 0.0, 0.0, 0.0]]).collect() }
    }

    /// h(|p|²), for |p|² < 1.
    #[inline(always)]
    pub(crate) fn stretch(&self, square: f32) -> f32 {
        let bits = (1.0 - square).to_bits() - ((127 - OCTAVES as u32) << 23);
        let [a, b, c, d] = self.cells[(bits >> BELOW) as usize];
        let x = (bits & ((1 << BELOW) - 1)) as i32 as f32 * (1.0 / (1 << BELOW) as f32);
        ((d * x + c) * x + b) * x + a
    }

    pub(crate) fn bytes(&self) -> u64 {
        (self.cells.len() * size_of::<[f32; 4]>()) as u64
    }

    /// The cells one after the other.
    #[cfg(feature = "gpu")]
    pub(crate) fn cells(&self) -> &[[f32; 4]] {
        &self.cells
    }
}

/// The cubic over a cell through its ends and two points between, in the share of the cell.
fn cubic(begin: f64, end: f64, h: impl Fn(f64) -> f64) -> [f32; 4] {
    let [a, p, q, e] = [0.0, 1.0, 2.0, 3.0].map(|k| h(begin + (end - begin) * (k / 3.0)));
    // Newton's form at 0, 1/3, 2/3 and 1, then in powers.
    let d1 = p - a;
    let d2 = q - 2.0 * p + a;
    let d3 = e - 3.0 * q + 3.0 * p - a;
    let b = 3.0 * d1 - 1.5 * d2 + d3;
    let c = 4.5 * d2 - 4.5 * d3;
    [a, b, c, 4.5 * d3].map(|v| v as f32)
}

/// How much of a kernel lies inside and outside of each θ.
struct Shares {
    shape: Shape,
    /// Weight of each power of (1 − s).
    powers: Vec<f64>,
    /// Up to each step from the centre, and from each step on.
    inside: Vec<f64>,
    outside: Vec<f64>,
}

impl Shares {
    fn new(footprint: &Footprint, shape: Shape) -> Self {
        let q = f64::from(footprint.sharpness());
        // qⁿ/n! on the disc, qⁿ/Γ(n + ½) in the ball, up to a factor; the largest is near n = q ≤ 32.
        let offset = if shape == Shape::Ball { 0.5 } else { 0.0 };
        let mut weight = 1.0;
        let mut powers = Vec::new();
        while powers.len() < 4 || powers.len() as f64 <= q || weight > 1e-18 * powers[3] {
            powers.push(if powers.len() < 3 { 0.0 } else { weight });
            weight *= q / (powers.len() as f64 - offset);
        }
        let mut shares = Self { shape, powers, inside: Vec::new(), outside: Vec::new() };
        let step = std::f64::consts::FRAC_PI_2 / STEPS as f64;
        let of_step = |k: usize| shares.between(k as f64 * step, (k + 1) as f64 * step);
        let parts: Vec<f64> = (0..STEPS).map(of_step).collect();
        let sums = |parts: &mut dyn Iterator<Item = &f64>| {
            let mut sum = 0.0;
            let mut running: Vec<f64> = parts.map(|part| (sum, sum += part).0).collect();
            running.push(sum);
            running
        };
        let inside = sums(&mut parts.iter());
        let mut outside = sums(&mut parts.iter().rev());
        outside.reverse();
        (shares.inside, shares.outside) = (inside, outside);
        shares
    }

    /// What lies at θ, per angle.
    fn density(&self, theta: f64) -> f64 {
        let (sin, cos) = libm::sincos(theta);
        let at = cos * cos;
        let sum = self.powers.iter().rev().fold(0.0, |sum, weight| sum * at + weight);
        // cos^(2n−1)·sin²·cos in the ball, cos^(2n)·sin·cos on the disc.
        sum * match self.shape {
            Shape::Ball => sin * sin,
            Shape::Disc => sin * cos,
        }
    }

    /// Simpson's rule.
    fn between(&self, from: f64, to: f64) -> f64 {
        let middle = 0.5 * (from + to);
        (to - from) / 6.0 * (self.density(from) + 4.0 * self.density(middle) + self.density(to))
    }

    /// Radius over radius: what a uniform point with 1 − |p|² = t is multiplied with.
    fn stretch(&self, t: f64) -> f64 {
        let power = if self.shape == Shape::Ball { 1.5 } else { 1.0 };
        let square = 1.0 - t;
        if square < 1e-6 {
            // h is even and smooth there.
            return self.stretch(1.0 - 1e-6);
        }
        let total = self.inside[STEPS];
        // Whichever is smaller, and has its digits.
        let inside = libm::pow(square, power);
        let outside = -libm::expm1(power * libm::log1p(-t));
        let (goal, begins_before) = if inside < 0.5 {
            (inside * total, self.inside.partition_point(|sum| *sum <= inside * total))
        } else {
            (outside * total, self.outside.partition_point(|sum| *sum > outside * total))
        };
        let k = begins_before.saturating_sub(1).min(STEPS - 1);
        let [begin, end] = [k, k + 1].map(|k| k as f64 * (std::f64::consts::FRAC_PI_2 / STEPS as f64));
        let mut theta = 0.5 * (begin + end);
        // Newton's steps: the share is all but straight between.
        for _ in 0..6 {
            let rest = if inside < 0.5 {
                goal - self.inside[k] - self.between(begin, theta)
            } else {
                self.outside[k + 1] + self.between(theta, end) - goal
            };
            theta = (theta + rest / self.density(theta).max(f64::MIN_POSITIVE)).clamp(begin, end);
        }
        libm::sin(theta) / square.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the footprint outside of ρ² = s, by its closed form.
    fn outside(footprint: &Footprint, s: f64) -> f64 {
        let q = f64::from(footprint.sharpness());
        let tail = |y: f64| {
            let mut term = y.powi(4) / 24.0;
            let mut sum = 0.0;
            for m in 5..200 {
                sum += term;
                term *= y / f64::from(m);
            }
            sum
        };
        tail(q * (1.0 - s)) / tail(q)
    }

    #[test]
    fn a_disc_has_the_share_of_the_footprint_inside_each_radius() {
        for cutoff in [1.0, 2.0, 3.0, 5.0, 8.0] {
            let footprint = Footprint { cutoff };
            let radial = Radial::new(&footprint, Shape::Disc);
            for k in 80..4096u32 {
                let square = 1.0 - (k as f32 / 4096.0).powi(4);
                let h = f64::from(radial.stretch(square));
                let found = outside(&footprint, f64::from(square) * h * h);
                let t = 1.0 - f64::from(square);
                // A float of h has seven digits; the rim is a power of 1 - radius.
                assert!((found - t).abs() < 4e-6 * t.powf(0.7), "{cutoff} {square}: {found} for {t}");
            }
        }
    }

    #[test]
    fn a_ball_has_the_share_of_the_footprint_beside_each_ray() {
        for cutoff in [1.0, 3.0, 8.0] {
            let footprint = Footprint { cutoff };
            let radial = Radial::new(&footprint, Shape::Ball);
            for s in [1e-3, 0.01, 0.1, 0.3, 0.6, 0.9] {
                // Of a sphere of radius r the share √(1 − s/r²) lies farther than √s from a line through its middle.
                const N: u32 = 100_000;
                let share = |k: u32| {
                    let square = ((f64::from(k) + 0.5) / f64::from(N)).powf(2.0 / 3.0) as f32;
                    let radius2 = f64::from(square) * f64::from(radial.stretch(square)).powi(2);
                    (1.0 - s / radius2).max(0.0).sqrt()
                };
                let found = (0..N).map(share).sum::<f64>() / f64::from(N);
                let expected = outside(&footprint, s);
                assert!(
                    (found - expected).abs() < 2e-6 + 1e-4 * expected.min(1.0 - expected),
                    "{cutoff} {s}: {found}, {expected}"
                );
            }
        }
    }
}
