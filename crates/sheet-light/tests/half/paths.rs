//! Light in a homogeneous box, path by path: what the approximations of scattered light are held to.

use std::f64::consts::TAU;

/// A generator of its own (SplitMix64), so that the oracle shares nothing with what it judges.
struct Random(u64);

impl Random {
    /// In \[0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Cosine between the directions before and after scattering by Henyey and Greenstein.
    fn cosine(&mut self, g: f64) -> f64 {
        let u = self.unit();
        if g == 0.0 {
            return 2.0 * u - 1.0;
        }
        let root = (1.0 - g * g) / (1.0 + g * (2.0 * u - 1.0));
        (1.0 + g * g - root * root) / (2.0 * g)
    }
}

/// A box whose extents are optical depths, lit along its third axis, everywhere alike.
pub(crate) struct Block {
    /// Infinite for a slab.
    pub(crate) width: f64,
    pub(crate) depth: f64,
    pub(crate) albedo: f64,
    pub(crate) asymmetry: f64,
}

/// Shares of the light that leave to its own side, to the other, and by the sides.
pub(crate) fn trace(block: &Block, paths: u32, seed: u64) -> [f64; 3] {
    trace_with(block, (0.0, 1.0), paths, seed)
}

/// The same with a pane across the light at a depth, which lets a share through and absorbs the rest.
pub(crate) fn trace_with(block: &Block, pane: (f64, f64), paths: u32, seed: u64) -> [f64; 3] {
    let mut random = Random(seed);
    let mut counts = [0u32; 3];
    for _ in 0..paths {
        if let Some(side) = path(block, pane, &mut random) {
            counts[side] += 1;
        }
    }
    counts.map(|n| f64::from(n) / f64::from(paths))
}

fn path(block: &Block, (pane, passing): (f64, f64), random: &mut Random) -> Option<usize> {
    let is_slab = block.width.is_infinite();
    let start = |random: &mut Random| if is_slab { 0.0 } else { block.width * random.unit() };
    let mut p = [start(random), start(random), 0.0];
    let mut d = [0.0, 0.0, 1.0];
    loop {
        let way = -(1.0 - random.unit()).ln();
        let before = p[2];
        (0..3).for_each(|a| p[a] += way * d[a]);
        if passing < 1.0 && (before < pane) != (p[2] < pane) && random.unit() >= passing {
            return None;
        }
        if let Some(side) = left(block, p, d, is_slab) {
            return Some(side);
        }
        if random.unit() >= block.albedo {
            return None;
        }
        d = turned(d, random.cosine(block.asymmetry), TAU * random.unit());
    }
}

/// Where a block is looked at, along the normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Face {
    /// That the light falls on.
    Lit,
    Side,
    /// Where it comes out.
    Far,
}

/// Mean radiance of a face of a box along its normal under an irradiance of 1: of light that was scattered once, and of all else.
pub(crate) fn seen(block: &Block, face: Face, paths: u32, seed: u64) -> [f64; 2] {
    let mut random = Random(seed);
    let mut sums = [0.0; 2];
    for _ in 0..paths {
        let [u, v] = [block.width * random.unit(), block.width * random.unit()];
        let (mut p, mut d) = match face {
            Face::Lit => ([u, v, 0.0], [0.0, 0.0, 1.0]),
            Face::Side => ([0.0, u, block.depth * v / block.width], [1.0, 0.0, 0.0]),
            Face::Far => ([u, v, block.depth], [0.0, 0.0, -1.0]),
        };
        let mut weight = 1.0;
        for scattered in 0.. {
            let way = -(1.0 - random.unit()).ln();
            (0..3).for_each(|a| p[a] += way * d[a]);
            if left(block, p, d, false).is_some() || scattered > 100_000 {
                break;
            }
            weight *= block.albedo;
            // Backwards: light along +z that turns into −d.
            sums[scattered.min(1)] += weight * phase(-d[2], block.asymmetry) * (-p[2]).exp();
            d = turned(d, random.cosine(block.asymmetry), TAU * random.unit());
        }
    }
    sums.map(|sum| sum / f64::from(paths))
}

/// Henyey and Greenstein's phase function.
fn phase(cosine: f64, g: f64) -> f64 {
    let d = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (2.0 * TAU * d * d.sqrt())
}

/// The side by which a path that is at `p` has left.
fn left(block: &Block, p: [f64; 3], d: [f64; 3], is_slab: bool) -> Option<usize> {
    let high = [block.width, block.width, block.depth];
    let mut first = (f64::NEG_INFINITY, None);
    for a in (if is_slab { 2 } else { 0 })..3 {
        let beyond = if p[a] < 0.0 { -p[a] } else { p[a] - high[a] };
        if beyond > 0.0 {
            // The face that was crossed first lies farthest back.
            let back = beyond / d[a].abs();
            let side = if a < 2 { 2 } else { usize::from(p[a] > 0.0) };
            if back > first.0 {
                first = (back, Some(side));
            }
        }
    }
    first.1
}

fn turned([x, y, z]: [f64; 3], cosine: f64, angle: f64) -> [f64; 3] {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (s, c) = angle.sin_cos();
    let across = (x * x + y * y).sqrt();
    if across < 1e-9 {
        return [sine * c, sine * s, cosine * z.signum()];
    }
    [
        sine * (x * z * c - y * s) / across + x * cosine,
        sine * (y * z * c + x * s) / across + y * cosine,
        -sine * c * across + z * cosine,
    ]
}

#[test]
fn without_scattering_paths_fade_by_the_exponential_law() {
    let block = Block { width: f64::INFINITY, depth: 1.0, albedo: 0.0, asymmetry: 0.0 };
    let [back, through, _] = trace(&block, 100_000, 1);
    assert!(back == 0.0 && (through - (-1f64).exp()).abs() < 5e-3, "{through}");
}

#[test]
fn a_thick_slab_that_absorbs_nothing_lets_through_what_transport_theory_says() {
    // 4/3 over the optical depth and twice the extrapolation length, 1.42 (Milne); a beam has 5/4 of diffuse light's.
    let block = Block { width: f64::INFINITY, depth: 10.0, albedo: 1.0, asymmetry: 0.0 };
    let [back, through, _] = trace(&block, 100_000, 2);
    assert!((back + through - 1.0).abs() < 1e-12);
    assert!((through - (0.7104 + 1.0) / (10.0 + 1.4209)).abs() < 5e-3, "{through}");
}
