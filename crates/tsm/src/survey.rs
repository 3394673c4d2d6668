//! What the casters look like, before any work: bounds, kinds, channels, angular sizes.

use crate::caster::Casters;
use crate::frame::Frame;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use splat_core::{Aabb, SplatKind, glam};

/// Splats per parallel task; fixed, so that sums do not depend on the thread count.
pub(crate) const CHUNK: usize = 4096;

/// First look: everything that does not depend on the light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Survey {
    pub(crate) casters: u64,
    /// Casters of each [`SplatKind`].
    pub(crate) kinds: [u64; 3],
    pub(crate) bounds: Aabb,
    pub(crate) max_radius: f32,
    /// Sum of the cutoff radii of media, world units.
    medium_radius_sum: f64,
    /// Whether materials absorb channels differently.
    pub(crate) coloured: bool,
}

impl Survey {
    const EMPTY: Self = Self {
        casters: 0,
        kinds: [0; 3],
        bounds: Aabb::EMPTY,
        max_radius: 0.0,
        medium_radius_sum: 0.0,
        coloured: false,
    };

    /// Looks at every splat.
    pub(crate) fn new(casters: &Casters<'_>) -> Self {
        let n = casters.cloud.len();
        let parts: Vec<Self> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|c| {
                let mut part = Self::EMPTY;
                (c * CHUNK..n.min((c + 1) * CHUNK)).filter(|&i| casters.casts(i)).for_each(|i| part.add(casters, i));
                part
            })
            .collect();
        parts.into_iter().fold(Self::EMPTY, Self::join)
    }

    fn add(&mut self, casters: &Casters<'_>, i: usize) {
        let cloud = casters.cloud;
        let kind = cloud.kind[i];
        let p = cloud.position[i];
        self.casters += 1;
        self.kinds[kind as usize] += 1;
        self.bounds = Aabb { min: self.bounds.min.min(p), max: self.bounds.max.max(p) };
        let radius = casters.shadow_radius(i).max(cloud.tangent_of(i).length());
        self.max_radius = self.max_radius.max(radius);
        if kind == SplatKind::Medium {
            self.medium_radius_sum += f64::from(cloud.radius[i]);
        }
        if kind != SplatKind::Opaque {
            let e = casters.extinction(i).rgb;
            self.coloured |= e[0] != e[1] || e[1] != e[2];
        }
    }

    fn join(mut self, other: Self) -> Self {
        self.casters += other.casters;
        (0..3).for_each(|k| self.kinds[k] += other.kinds[k]);
        self.bounds = Aabb { min: self.bounds.min.min(other.bounds.min), max: self.bounds.max.max(other.bounds.max) };
        self.max_radius = self.max_radius.max(other.max_radius);
        self.medium_radius_sum += other.medium_radius_sum;
        self.coloured |= other.coloured;
        self
    }

    /// Mean cutoff radius of media, world units; 0 without media.
    pub(crate) fn mean_medium_radius(&self) -> f32 {
        (self.medium_radius_sum / self.kinds[SplatKind::Medium as usize].max(1) as f64) as f32
    }
}

/// Angles at which a table has to look, and how large casters appear: quarter-octave histograms, integers, so that the
/// order of summing does not matter.
#[derive(Debug, Clone)]
pub(crate) struct Appearance {
    /// Casters by apparent spacing.
    spacing: Vec<u64>,
    /// Translucent casters by apparent cutoff radius.
    radius: Vec<u64>,
    /// Opaque casters by apparent radius of their dilated disc.
    disc: Vec<u64>,
    /// Bounds on the plane of a planar table, footprints included.
    pub(crate) window: [Vec2; 2],
    /// Least and greatest z/distance.
    pub(crate) cosine: [f32; 2],
    /// Which of 1024 sectors of azimuth hold casters; empty unless asked for.
    pub(crate) sectors: Vec<bool>,
}

const BINS: usize = 1024;
/// Clouds of this size and more are counted by a sample; their window is that of all.
const MANY: usize = 1 << 18;
/// One splat in so many is counted then.
const SAMPLE: usize = 8;
pub(crate) const SECTORS: usize = 1024;

/// How a second look measures apparent size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Apparent {
    /// By angle, from the light.
    Angle,
    /// By angle, and sectors of azimuth too.
    AngleAndSectors,
    /// By tangent, on the plane z = 1; casters beside or behind the light have no place.
    Tangent,
    /// By length, for parallel light.
    Length,
}

/// Exponent and two bits of the mantissa: four bins an octave, monotone.
fn bin(x: f32) -> usize {
    ((x.max(0.0).to_bits() >> 21) as usize).min(BINS - 1)
}

fn bin_value(bin: usize) -> f64 {
    f64::from(f32::from_bits(((bin as u32) << 21) | 1 << 20))
}

impl Appearance {
    fn empty(sectors: bool) -> Self {
        Self {
            spacing: vec![0; BINS],
            radius: vec![0; BINS],
            disc: vec![0; BINS],
            window: [Vec2::INFINITY, Vec2::NEG_INFINITY],
            cosine: [1.0, -1.0],
            sectors: vec![false; if sectors { SECTORS } else { 0 }],
        }
    }

    /// Looks at every caster from the light.
    pub(crate) fn new(casters: &Casters<'_>, frame: &Frame, apparent: Apparent) -> Self {
        let sectors = apparent == Apparent::AngleAndSectors;
        let n = casters.cloud.len();
        let every = if n < MANY { 1 } else { SAMPLE };
        // Few large parts: each carries three histograms.
        let part = CHUNK.max(n.div_ceil(64));
        let parts: Vec<Self> = (0..n.div_ceil(part.max(1)))
            .into_par_iter()
            .map(|c| {
                let mut look = Self::empty(sectors);
                for i in (c * part..n.min((c + 1) * part)).filter(|&i| casters.casts(i)) {
                    look.add(casters, i, frame, apparent, every);
                }
                look
            })
            .collect();
        parts.into_iter().fold(Self::empty(sectors), Self::join)
    }

    fn add(&mut self, casters: &Casters<'_>, i: usize, frame: &Frame, apparent: Apparent, every: usize) {
        let cloud = casters.cloud;
        let p = frame.position(cloud.position[i]);
        let far = match apparent {
            Apparent::Angle | Apparent::AngleAndSectors => p.length(),
            Apparent::Tangent => p.z,
            Apparent::Length => 1.0,
        };
        if far <= 0.0 {
            return;
        }
        let tangent = cloud.tangent.get(i).map_or(0.0, |t| t.length());
        let radius = frame.length(casters.shadow_radius(i).max(tangent));
        if i.is_multiple_of(every) {
            self.count(casters, i, [frame.length(1.0) / far, radius / far], every as u64);
        }
        if matches!(apparent, Apparent::Tangent | Apparent::Length) {
            self.widen_window(p, radius, apparent);
        } else {
            self.widen_angles(p, radius / far);
        }
    }

    /// Counts a splat, given the apparent size of a world unit and of its radius, for `every`.
    fn count(&mut self, casters: &Casters<'_>, i: usize, [unit, radius]: [f32; 2], every: u64) {
        let cloud = casters.cloud;
        let spacing = if cloud.kind[i] == SplatKind::Opaque {
            self.disc[bin(radius)] += every;
            cloud.cross_section[i].sqrt() * unit
        } else {
            self.radius[bin(radius)] += every;
            cloud.radius[i] / (casters.kernel(i).cutoff * 0.8) * unit
        };
        self.spacing[bin(spacing)] += every;
    }

    fn widen_window(&mut self, p: Vec3, radius: f32, apparent: Apparent) {
        let (q, reach) = if apparent == Apparent::Length {
            (p.truncate(), radius)
        } else {
            // Seen at the tangent t, a ball spans about radius·(1 + t²)/z across the plane z = 1.
            let q = p.truncate() / p.z;
            (q, radius / p.z * (1.0 + q.length_squared()))
        };
        self.window = [self.window[0].min(q - reach), self.window[1].max(q + reach)];
    }

    fn widen_angles(&mut self, p: Vec3, reach: f32) {
        let cosine = p.z / p.length();
        self.cosine = [self.cosine[0].min(cosine - reach), self.cosine[1].max(cosine + reach)];
        if self.sectors.is_empty() {
            return;
        }
        let sin = (1.0 - cosine * cosine).max(0.0).sqrt();
        let turn = |angle: f64| angle / std::f64::consts::TAU * SECTORS as f64;
        let centre = turn(f64::from(p.y + 0.0).atan2(f64::from(p.x)));
        let half = if sin > 2.0 * reach { turn(1.2 * f64::from(reach / sin)) + 1.0 } else { SECTORS as f64 };
        let first = (centre - half).floor() as i64;
        let count = ((2.0 * half) as i64 + 2).min(SECTORS as i64);
        (first..first + count).for_each(|s| self.sectors[s.rem_euclid(SECTORS as i64) as usize] = true);
    }

    fn join(mut self, other: Self) -> Self {
        (0..BINS).for_each(|b| self.spacing[b] += other.spacing[b]);
        (0..BINS).for_each(|b| self.radius[b] += other.radius[b]);
        (0..BINS).for_each(|b| self.disc[b] += other.disc[b]);
        self.window = [self.window[0].min(other.window[0]), self.window[1].max(other.window[1])];
        self.cosine = [self.cosine[0].min(other.cosine[0]), self.cosine[1].max(other.cosine[1])];
        self.sectors.iter_mut().zip(other.sectors).for_each(|(a, b)| *a |= b);
        self
    }

    /// Apparent spacing that half of the casters are below; `None` without casters.
    pub(crate) fn median_spacing(&self) -> Option<f64> {
        let total: u64 = self.spacing.iter().sum();
        let mut seen = 0;
        let found = self.spacing.iter().position(|&count| {
            seen += count;
            2 * seen >= total && total > 0
        });
        found.map(bin_value)
    }

    /// Entries that translucent casters make in a table of `cells` cells of side `cell` (angle, tangent or length): a
    /// kernel of radius r overlaps (1 + 1.8 r/cell)² cells on average, and no more than there are.
    pub(crate) fn entries(&self, cell: f64, cells: f64) -> f64 {
        overlaps(&self.radius, cell, cells)
    }

    /// Cells that casters of all kinds overlap.
    pub(crate) fn covered(&self, cell: f64, cells: f64) -> f64 {
        self.entries(cell, cells) + overlaps(&self.disc, cell, cells)
    }

    /// Casters that have a place.
    pub(crate) fn casters(&self) -> u64 {
        self.spacing.iter().sum()
    }
}

fn overlaps(histogram: &[u64], cell: f64, cells: f64) -> f64 {
    let overlap = |b: usize| (1.0 + 1.8 * bin_value(b) / cell).powi(2).min(cells);
    histogram.iter().enumerate().filter(|(_, n)| **n > 0).map(|(b, n)| *n as f64 * overlap(b)).sum()
}
