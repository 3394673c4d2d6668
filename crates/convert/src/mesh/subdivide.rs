//! Subdivision of a triangle to the density of splats (Gunjee 2007, section 4), in closed form.
//!
//! | symbol | meaning |
//! |---|---|
//! | h | spacing: a piece is at most h² in area |
//! | A, L | area and longest edge of the triangle |
//! | k | pieces along an edge: k = ⌈√A/h⌉, k² congruent pieces |
//!
//! A triangle with L² ≤ 5A is split into k² pieces congruent to it. A longer one would give slivers whose centroids say
//! little about where their area lies. It is cut at the foot of its altitude into two right triangles; each is cut
//! into strips across its longer leg, each strip into pieces as high as wide, so every piece is within √5·h of
//! its centroid.
//!
//! Pieces come in *runs*: rows of equal pieces whose centroids lie on a line at equal steps, so that attributes are
//! linear along a run. Deviation from the paper: it splits recursively until the test holds; the closed form gives the
//! same areas without intermediate triangles. The altitude cut is ours.

use splat_core::glam::DVec3;
use splat_core::robust_cross;

/// Largest L²/A that is split into congruent pieces; the right isosceles triangle has 4.
const WELL_SHAPED: f64 = 5.0;

/// A triangle whose area is at most this share of its longest edge squared has no normal worth keeping.
const DEGENERATE: f64 = 1.0 / (1u64 << 40) as f64;

/// Area and squared edge lengths of a triangle, f64.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measure {
    /// Area; 0 for a degenerate triangle.
    pub(crate) area: f64,
    /// The vertex opposite to the longest edge.
    pub(crate) apex: usize,
    /// Squared length of the longest edge.
    pub(crate) longest_sq: f64,
    /// Where the altitude meets the longest edge, as a share of it counted from the vertex after the apex.
    foot: f64,
}

/// Measures a triangle.
pub(crate) fn measure(v: [DVec3; 3]) -> Measure {
    let edge_sq = [0, 1, 2].map(|i| (v[(i + 2) % 3] - v[(i + 1) % 3]).length_squared());
    let apex = (0..3).fold(0, |a, i| if edge_sq[i] > edge_sq[a] { i } else { a });
    let p = v[(apex + 1) % 3];
    let q = v[(apex + 2) % 3];
    let area = 0.5 * robust_cross(q - p, v[apex] - p).length();
    let longest_sq = edge_sq[apex];
    if area <= DEGENERATE * longest_sq {
        return Measure { area: 0.0, apex, longest_sq, foot: 0.0 };
    }
    let foot = ((v[apex] - p).dot(q - p) / longest_sq).clamp(0.0, 1.0);
    Measure { area, apex, longest_sq, foot }
}

/// A right triangle in barycentric weights: right angle, end of the long leg, end of the short leg.
#[derive(Debug, Clone, Copy)]
struct Half {
    corner: DVec3,
    long: DVec3,
    short: DVec3,
    /// Share of the whole triangle's area.
    share: f64,
    strips: u32,
    /// Length of the short leg over h.
    height: f64,
}

/// How one triangle is split.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Split {
    /// Degenerate: no piece.
    None,
    /// k² pieces.
    Congruent(u32),
    /// Strips across the long legs of two right triangles.
    Strips([HalfSplit; 2]),
}

/// One half of a strip split.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HalfSplit(Half);

/// A row of equal pieces: piece j has its centroid at barycentric weights `start + j·step`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) start: DVec3,
    pub(crate) step: DVec3,
    pub(crate) count: u32,
    /// Area of one piece as a share of the triangle's.
    pub(crate) share: f64,
}

/// More pieces than this in one direction are never made; the budget refuses such triangles before.
const MOST_STEPS: f64 = 4e9;

/// Chooses the split of a triangle for pieces of at most `spacing`² area.
pub(crate) fn split(m: &Measure, spacing: f64) -> Split {
    if m.area == 0.0 {
        return Split::None;
    }
    let k = (m.area.sqrt() / spacing).ceil().clamp(1.0, MOST_STEPS) as u32;
    if m.longest_sq <= WELL_SHAPED * m.area || m.longest_sq <= WELL_SHAPED * spacing * spacing {
        return Split::Congruent(k);
    }
    let length = m.longest_sq.sqrt();
    let height = 2.0 * m.area / length;
    // A stub shorter than half a spacing is not worth pieces of its own; any foot tiles.
    let stub = 0.5 * spacing / length;
    let foot = if m.foot < stub {
        0.0
    } else if m.foot > 1.0 - stub {
        1.0
    } else {
        m.foot
    };
    let unit = |i: usize| DVec3::AXES[i % 3];
    let p = unit(m.apex + 1);
    let q = unit(m.apex + 2);
    let apex = unit(m.apex);
    let corner = p * (1.0 - foot) + q * foot;
    let half = |end: DVec3, share: f64| {
        let base = share * length;
        let (long, short, longer, shorter) =
            if base >= height { (end, apex, base, height) } else { (apex, end, height, base) };
        let strips = if share > 0.0 { (longer / spacing).ceil().clamp(1.0, MOST_STEPS) as u32 } else { 0 };
        HalfSplit(Half { corner, long, short, share, strips, height: shorter / spacing })
    };
    Split::Strips([half(p, foot), half(q, 1.0 - foot)])
}

impl Split {
    /// Number of runs.
    pub(crate) fn runs(&self) -> u32 {
        match self {
            Self::None => 0,
            Self::Congruent(k) => 2 * k - 1,
            Self::Strips(halves) => halves[0].0.strips + halves[1].0.strips,
        }
    }

    /// Number of pieces.
    pub(crate) fn pieces(&self) -> u64 {
        match self {
            Self::None => 0,
            Self::Congruent(k) => u64::from(*k) * u64::from(*k),
            Self::Strips(halves) => {
                halves.iter().map(|h| (0..h.0.strips).map(|i| u64::from(h.0.pieces(i))).sum::<u64>()).sum()
            }
        }
    }

    /// Run `i` of `runs()`.
    pub(crate) fn run(&self, i: u32) -> Run {
        match self {
            Self::None => Run { start: DVec3::ZERO, step: DVec3::ZERO, count: 0, share: 0.0 },
            Self::Congruent(k) => congruent_run(*k, i),
            Self::Strips([a, b]) if i < a.0.strips => a.0.run(i),
            Self::Strips([a, b]) => b.0.run(i - a.0.strips),
        }
    }
}

/// Row i/2 of k: upright pieces for even i, upside-down ones for odd i.
fn congruent_run(k: u32, i: u32) -> Run {
    let row = f64::from(i / 2);
    let k_f = f64::from(k);
    let (count, third) = if i.is_multiple_of(2) { (k - i / 2, 1.0 / 3.0) } else { (k - 1 - i / 2, 2.0 / 3.0) };
    // Weights of corner 0 are what the other two leave, so they sum to 1.
    let w1 = third / k_f;
    let w2 = (row + third) / k_f;
    Run {
        start: DVec3::new(1.0 - w1 - w2, w1, w2),
        step: DVec3::new(-1.0 / k_f, 1.0 / k_f, 0.0),
        count,
        share: 1.0 / (k_f * k_f),
    }
}

impl Half {
    /// Pieces of strip `i`.
    fn pieces(&self, i: u32) -> u32 {
        let middle = 1.0 - (f64::from(i) + 0.5) / f64::from(self.strips);
        (self.height * middle).ceil().clamp(1.0, MOST_STEPS) as u32
    }

    fn run(&self, i: u32) -> Run {
        let n = f64::from(self.strips);
        let x0 = f64::from(i) / n;
        let x1 = f64::from(i + 1) / n;
        // The strip is a trapezoid whose parallel sides are 1 − x0 and 1 − x1 short legs long.
        let side0 = 1.0 - x0;
        let side1 = 1.0 - x1;
        let x = x0 + (x1 - x0) * (side0 + 2.0 * side1) / (3.0 * (side0 + side1));
        let count = self.pieces(i);
        let rise = (1.0 - x) / f64::from(count);
        let up = (self.short - self.corner) * rise;
        Run {
            start: self.corner + (self.long - self.corner) * x + up * 0.5,
            step: up,
            count,
            share: self.share * (side0 + side1) / n / f64::from(count),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles() -> Vec<[DVec3; 3]> {
        let p = DVec3::new;
        vec![
            [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.5, 0.8, 0.1)],
            [p(0.0, 0.0, 0.0), p(10.0, 0.0, 0.0), p(0.1, 0.3, 0.2)],
            [p(3.0, 0.0, 0.0), p(0.0, 0.001, 0.0), p(-3.0, 0.0, 0.0)],
            [p(0.0, 0.0, 0.0), p(0.0, 7.0, 0.0), p(0.0, 7.0, 0.5)],
            [p(0.0, 0.0, 0.0), p(1e-3, 0.0, 0.0), p(0.0, 1e-3, 0.0)],
        ]
    }

    /// Pieces tile: their areas and their first moments are those of the triangle, none is larger than h².
    #[test]
    fn pieces_keep_area_and_centroid_and_respect_the_spacing() {
        for v in triangles() {
            let m = measure(v);
            for spacing in [0.05, 0.3, 2.0, 50.0] {
                let split = split(&m, spacing);
                let mut area = 0.0;
                let mut moment = DVec3::ZERO;
                let mut count = 0u64;
                for run in (0..split.runs()).map(|i| split.run(i)) {
                    assert!(run.share * m.area <= spacing * spacing * (1.0 + 1e-12));
                    for j in 0..run.count {
                        let w = run.start + run.step * f64::from(j);
                        assert!(w.min_element() > 0.0 && (w.x + w.y + w.z - 1.0).abs() < 1e-12, "{w}");
                        area += run.share;
                        moment += w * run.share;
                    }
                    count += u64::from(run.count);
                }
                assert_eq!(count, split.pieces());
                assert!((area - 1.0).abs() < 1e-9, "area {area}");
                assert!((moment - DVec3::splat(1.0 / 3.0)).length() < 1e-9, "moment {moment}");
            }
        }
    }

    #[test]
    fn cv02_sliver_areas_are_exact() {
        // Isosceles sliver with legs 1 and base 1e-4: area = 0.25·1e-4·√(4 − 1e-8).
        let half = 0.5e-4_f64;
        let v =
            [DVec3::new(-half, 0.0, 0.0), DVec3::new(half, 0.0, 0.0), DVec3::new(0.0, (1.0 - half * half).sqrt(), 0.0)];
        let exact = 0.25e-4 * (4.0 - 1e-8_f64).sqrt();
        assert!((measure(v).area / exact - 1.0).abs() < 1e-12);
    }

    #[test]
    fn cv01_degenerate_triangles_have_no_pieces() {
        let p = DVec3::new(0.3, 0.1, -4.0);
        for v in [[p, p, p], [p, p + DVec3::X, p + DVec3::X], [p, p + DVec3::X, p + DVec3::X * 2.0]] {
            assert!(matches!(split(&measure(v), 0.1), Split::None));
        }
    }
}
