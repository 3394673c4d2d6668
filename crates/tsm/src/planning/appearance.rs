//! The appearance of the casters from the light, before any work: the directions that a table has to cover, and
//! angular sizes.

use crate::building::caster::Casters;
use crate::building::deposit::{BENT, Band, CLOSE, FINE, RAYS, WIDE};
use crate::building::lanes::{LANES, Lane};
use crate::building::shares::{HALF_WIDTH, cells_along};
use crate::frame::Frame;
use crate::planning::survey::{Block, CHUNK, greater, greatest, least, lesser};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use splat_core::{SplatKind, glam};
use std::f64::consts::PI;
use std::ops::Range;

/// Angles at which a table has to look, and how large casters appear: angles and tangents as they are, lengths as shares of
/// the frame's extent, so that nothing depends on the unit of length.
#[derive(Debug, Clone)]
pub(crate) struct Appearance {
    apparent: Apparent,
    /// What a size of 1 is on the table.
    unit: f64,
    /// Casters by apparent spacing.
    spacing: Sizes,
    /// Translucent casters by apparent cutoff radius.
    radius: Sizes,
    /// Of these the media, and the surfaces by the radius of a ball that covers as much as their disc at its slant.
    medium: Sizes,
    slanted: Sizes,
    /// Opaque casters by apparent radius of their dilated disc.
    disc: Sizes,
    /// Bounds on the plane of a planar table, footprints included.
    pub(crate) window: [Vec2; 2],
    /// Least and greatest z/distance.
    pub(crate) cosine: [f32; 2],
    /// Which of 1024 sectors of azimuth hold casters; empty unless asked for.
    pub(crate) sectors: Vec<bool>,
}

/// Half width of the usual kernel's closed form over its radius.
const HALF_OF_RADIUS: f64 = 0.262 * HALF_WIDTH as f64;
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

/// What casters leave in a table.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Entries {
    /// Entries, by the closed form or by rays.
    pub(crate) entries: f64,
    /// Rays of cells that sample.
    pub(crate) rays: f64,
}

impl Entries {
    /// No more entries than this number, and as many fewer rays.
    fn within(self, most: f64) -> Self {
        let share = if self.entries > most { most / self.entries } else { 1.0 };
        Self { entries: share * self.entries, rays: share * self.rays }
    }

    fn add(&mut self, other: Self, times: f64) {
        self.entries += times * other.entries;
        self.rays += times * other.rays;
    }
}

/// How many casters are of which size: weights at sizes a quarter octave apart. A caster counts at the two sizes about its
/// own, in proportion, so that what follows does not jump where a size passes one of them; in integers, so that the order
/// of summing does not matter.
#[derive(Debug, Clone)]
struct Sizes(Vec<u64>);

impl Sizes {
    const COUNT: usize = 1024;
    /// Bits of an f32 below the exponent and two bits of the mantissa: four sizes an octave, and linear between them.
    const SHIFT: u32 = 21;
    const WHOLE: u64 = 1 << Self::SHIFT;

    fn new() -> Self {
        Self(vec![0; Self::COUNT])
    }

    fn add(&mut self, size: f32, every: u64) {
        let bits = size.max(0.0).to_bits();
        let below = (bits >> Self::SHIFT) as usize;
        let part = u64::from(bits) % Self::WHOLE;
        self.0[below] += every * (Self::WHOLE - part);
        self.0[below + 1] += every * part;
    }

    fn join(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(to, from)| *to += from);
    }

    /// Sizes and numbers of casters.
    fn sizes_and_counts(&self) -> impl Iterator<Item = (f64, f64)> {
        let used = self.0.iter().enumerate().filter(|(_, weight)| **weight > 0);
        used.map(|(k, weight)| (Self::size(k), *weight as f64 / Self::WHOLE as f64))
    }

    fn size(k: usize) -> f64 {
        f64::from(f32::from_bits((k as u32) << Self::SHIFT)).min(f64::from(f32::MAX))
    }

    fn count(&self) -> u64 {
        self.0.iter().sum::<u64>() / Self::WHOLE
    }

    /// Size that half of the casters are below, between those where weights sum to less and to more; `None` without any.
    fn median(&self) -> Option<f64> {
        let total: u64 = self.0.iter().sum();
        let mut before = None;
        let mut sum = 0;
        for (k, &weight) in self.0.iter().enumerate().filter(|(_, weight)| **weight > 0) {
            // The middle of this weight, so that a caster between two sizes is where it is.
            let at = (2 * sum + weight, Self::size(k));
            sum += weight;
            if at.0 < total {
                before = Some(at);
                continue;
            }
            let Some((low, below)) = before else { return Some(at.1) };
            return Some(below + (at.1 - below) * ((total - low) as f64 / (at.0 - low) as f64));
        }
        before.map(|(_, size)| size)
    }
}

impl Appearance {
    fn empty(frame: &Frame, apparent: Apparent) -> Self {
        let sectors = apparent == Apparent::AngleAndSectors;
        Self {
            apparent,
            unit: if apparent == Apparent::Length { f64::from(frame.extent()) } else { 1.0 },
            spacing: Sizes::new(),
            radius: Sizes::new(),
            medium: Sizes::new(),
            slanted: Sizes::new(),
            disc: Sizes::new(),
            window: [Vec2::INFINITY, Vec2::NEG_INFINITY],
            cosine: [1.0, -1.0],
            sectors: vec![false; if sectors { SECTORS } else { 0 }],
        }
    }

    /// Looks at every caster from the light.
    pub(crate) fn new(casters: &Casters<'_>, frame: &Frame, apparent: Apparent) -> Self {
        let n = casters.cloud.len();
        // Few large parts: each carries three histograms.
        let part = CHUNK.max(n.div_ceil(64));
        let parts: Vec<Self> = (0..n.div_ceil(part.max(1)))
            .into_par_iter()
            .map(|c| {
                let splats = c * part..n.min((c + 1) * part);
                let look = Self::empty(frame, apparent);
                pulp::Arch::new().dispatch(SecondLook { casters, frame, splats, look })
            })
            .collect();
        parts.into_iter().fold(Self::empty(frame, apparent), Self::join)
    }

    /// Counts a splat, given the apparent size of a world unit and of its radius, for `every`; `slant` is the cosine of light to the normal of a surface.
    fn count(
        &mut self,
        casters: &Casters<'_>,
        i: usize,
        unit: f32,
        radius: f32,
        slant: impl FnOnce() -> f32,
        every: u64,
    ) {
        let cloud = casters.cloud;
        let spacing = if cloud.kind[i] == SplatKind::Opaque {
            self.disc.add(radius, every);
            cloud.cross_section[i].sqrt() * unit
        } else {
            self.radius.add(radius, every);
            if cloud.kind[i] == SplatKind::Surface {
                self.slanted.add(radius * slant().sqrt(), every);
            } else {
                self.medium.add(radius, every);
            }
            cloud.radius[i] / (casters.kernel(i).cutoff * 0.8) * unit
        };
        self.spacing.add(spacing, every);
    }

    /// Marks the sectors of azimuth that a splat spans, given its place and its angular radius.
    fn mark_sectors(&mut self, p: Vec3, reach: f32) {
        let cosine = p.z / p.length();
        let sin = (1.0 - cosine * cosine).max(0.0).sqrt();
        let turn = |angle: f64| angle / std::f64::consts::TAU * SECTORS as f64;
        let centre = turn(libm::atan2(f64::from(p.y + 0.0), f64::from(p.x)));
        let half = if sin > 2.0 * reach { turn(1.2 * f64::from(reach / sin)) + 1.0 } else { SECTORS as f64 };
        let first = (centre - half).floor() as i64;
        let count = ((2.0 * half) as i64 + 2).min(SECTORS as i64);
        (first..first + count).for_each(|s| self.sectors[s.rem_euclid(SECTORS as i64) as usize] = true);
    }

    fn join(mut self, other: Self) -> Self {
        self.spacing.join(&other.spacing);
        self.radius.join(&other.radius);
        self.medium.join(&other.medium);
        self.slanted.join(&other.slanted);
        self.disc.join(&other.disc);
        self.window = [self.window[0].min(other.window[0]), self.window[1].max(other.window[1])];
        self.cosine = [self.cosine[0].min(other.cosine[0]), self.cosine[1].max(other.cosine[1])];
        self.sectors.iter_mut().zip(other.sectors).for_each(|(a, b)| *a |= b);
        self
    }

    /// Spacing on the table that half of the casters are below; `None` without casters.
    pub(crate) fn median_spacing(&self) -> Option<f64> {
        self.spacing.median().map(|size| size * self.unit)
    }

    /// Entries that translucent casters make in a table of `cells` cells of side `cell` (angle, tangent or length), where rays begin to sample
    /// footprints of media at `wide`.
    pub(crate) fn entries(&self, cell: f64, cells: f64, wide: Band) -> Entries {
        let parallel = self.apparent == Apparent::Length;
        let by_band = |size, band| {
            // Casters near the light are swept over the whole table.
            let is_swept = !parallel && size > f64::from(CLOSE[0]);
            let made = entries_of(size, cell / self.unit, band, parallel).within(cells);
            Entries { rays: if is_swept { made.rays + cells } else { made.rays }, ..made }
        };
        let mut sum = Entries::default();
        self.medium.sizes_and_counts().for_each(|(size, count)| sum.add(by_band(size, wide), count));
        self.slanted.sizes_and_counts().for_each(|(size, count)| sum.add(by_band(size, WIDE), count));
        sum
    }

    /// Cells that casters of all kinds overlap: what work goes by. Larger cells are fewer.
    pub(crate) fn covered(&self, cell: f64, cells: f64) -> f64 {
        let kernel = |size: f64| cells_along(HALF_OF_RADIUS * size * self.unit / cell).powi(2).min(cells);
        let disc = |size: f64| (1.0 + 1.8 * size * self.unit / cell).powi(2).min(cells);
        let kernels = self.radius.sizes_and_counts().map(|(size, count)| count * kernel(size)).sum::<f64>();
        kernels + self.disc.sizes_and_counts().map(|(size, count)| count * disc(size)).sum::<f64>()
    }

    /// Casters that have a place.
    pub(crate) fn casters(&self) -> u64 {
        self.spacing.count()
    }
}

/// Entries of a kernel of this apparent radius in cells of this side, by the ways that [`crate::building::deposit`] takes: in a band
/// between two, both leave their entries.
fn entries_of(radius: f64, cell: f64, wide: Band, parallel: bool) -> Entries {
    let [wide, bent] = [wide, BENT].map(|band| band.map(f64::from));
    let across = radius / cell;
    let bend = if parallel { 0.0 } else { radius * across };
    let mut made = Entries::default();
    if across > wide[0] {
        let wide = PI * across * across;
        made.entries += wide;
        made.rays += wide;
    }
    if across < wide[1] && bend > bent[0] {
        // Two numbers of rays, but for the smallest.
        let sets = if across > 0.5 { 2.0 } else { 1.0 };
        let cells = (1.0 + across).powi(2);
        made.entries += sets * cells;
        let along_cell = (f64::from(RAYS) / across).clamp(1.0, f64::from(FINE));
        made.rays += sets * cells * along_cell * along_cell;
    }
    if across < wide[1] && bend < bent[1] {
        made.entries += cells_along(HALF_OF_RADIUS * across).powi(2);
    }
    made
}

/// The second look at one part of the splats, in the form that [`pulp`] compiles once per instruction set.
struct SecondLook<'a> {
    casters: &'a Casters<'a>,
    frame: &'a Frame,
    splats: Range<usize>,
    look: Appearance,
}

/// [`LANES`] splats as seen from the light.
struct Seen {
    position: [Lane; 3],
    /// Distance that apparent sizes are relative to, and radius over it; 0 for what has no place.
    far: Lane,
    radius: Lane,
    /// What the table has to hold: along two axes of a plane, or once the cosine.
    span: [[Lane; 2]; 2],
}

impl Seen {
    #[inline(always)]
    fn new(block: &Block, frame: &Frame, apparent: Apparent) -> Self {
        let nought = [0.0; LANES];
        let mut seen = Self { position: block.position, far: nought, radius: nought, span: [[nought; 2]; 2] };
        let [x, y, z] = &mut seen.position;
        for l in 0..LANES {
            let p = frame.position(Vec3::new(x[l], y[l], z[l]));
            (x[l], y[l], z[l]) = (p.x, p.y, p.z);
            seen.radius[l] = frame.length(block.radius[l]);
        }
        for l in 0..LANES {
            let p = Vec3::new(x[l], y[l], z[l]);
            let distance = p.length();
            let far = match apparent {
                Apparent::Angle | Apparent::AngleAndSectors => distance,
                Apparent::Tangent => p.z,
                Apparent::Length => frame.extent(),
            };
            let is_seen = (far > 0.0) & (block.radius[l] >= 0.0);
            let radius = seen.radius[l] / far;
            let q = if apparent == Apparent::Length { p.truncate() } else { p.truncate() / p.z };
            // Seen at the tangent t, a ball spans about radius·(1 + t²)/z across the plane z = 1.
            let stretch = 1.0 + q.length_squared();
            let is_flat = matches!(apparent, Apparent::Tangent | Apparent::Length);
            let middle = if is_flat { [q.x, q.y] } else { [p.z / distance; 2] };
            let reach = match apparent {
                Apparent::Length => seen.radius[l],
                Apparent::Tangent => radius * stretch,
                Apparent::Angle | Apparent::AngleAndSectors => radius,
            };
            for k in 0..2 {
                seen.span[k][0][l] = if is_seen { middle[k] - reach } else { f32::INFINITY };
                seen.span[k][1][l] = if is_seen { middle[k] + reach } else { f32::NEG_INFINITY };
            }
            seen.far[l] = if is_seen { far } else { 0.0 };
            seen.radius[l] = radius;
        }
        seen
    }
}

impl pulp::NullaryFnOnce for SecondLook<'_> {
    type Output = Appearance;

    #[inline(always)]
    fn call(self) -> Appearance {
        let Self { casters, frame, splats, mut look } = self;
        let apparent = look.apparent;
        let every = if casters.cloud.len() < MANY { 1 } else { SAMPLE };
        let mut low = [[f32::INFINITY; LANES]; 2];
        let mut high = [[f32::NEG_INFINITY; LANES]; 2];
        let unit = frame.length(1.0);
        for begin in splats.clone().step_by(LANES) {
            let ids = begin..splats.end.min(begin + LANES);
            let seen = Seen::new(&Block::new(casters, ids.clone()), frame, apparent);
            for l in 0..LANES {
                for k in 0..2 {
                    low[k][l] = lesser(low[k][l], seen.span[k][0][l]);
                    high[k][l] = greater(high[k][l], seen.span[k][1][l]);
                }
            }
            for (l, i) in ids.enumerate().filter(|(l, _)| seen.far[*l] > 0.0) {
                if i.is_multiple_of(every) {
                    let slant = || {
                        let normal = frame.turn(casters.cloud.normal_of(i));
                        let from_light = Vec3::from_array([0, 1, 2].map(|axis| seen.position[axis][l]));
                        let direction = if apparent == Apparent::Length { Vec3::Z } else { from_light.normalize() };
                        // A disc that is an ellipse has its longer semi-axis for a radius.
                        let tangent = casters.cloud.tangent_of(i).length();
                        let across = casters.cloud.radius[i];
                        let narrow = if tangent > 0.0 { tangent.min(across) / tangent.max(across) } else { 1.0 };
                        narrow * normal.dot(direction).abs()
                    };
                    look.count(casters, i, unit / seen.far[l], seen.radius[l], slant, every as u64);
                }
                if !look.sectors.is_empty() {
                    look.mark_sectors(Vec3::from_array([0, 1, 2].map(|k| seen.position[k][l])), seen.radius[l]);
                }
            }
        }
        let low = low.map(least);
        let high = high.map(greatest);
        if matches!(apparent, Apparent::Tangent | Apparent::Length) {
            look.window = [Vec2::from_array(low), Vec2::from_array(high)];
        } else {
            look.cosine = [lesser(1.0, low[0]), greater(-1.0, high[0])];
        }
        look
    }
}
