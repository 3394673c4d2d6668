//! Deposits: how much absorbance one translucent splat leaves in every cell it covers.
//!
//! A_c = K·g·f_c/(Ω_c·d²), Σ f_c = 1, so that Σ A_c·Ω_c·d² = K·g whatever the size of the cells
//!
//! | symbol | |
//! |---|---|
//! | K | cross-section of the splat |
//! | g | 1 for media, \|cos θ\| for a disc with one opacity at every angle, 1 for a thin slab |
//! | f_c | fraction of the footprint in cell c |
//! | Ω_c, d | solid angle of the cell, distance of the splat; for parallel light d = 1 and Ω is an area |
//!
//! Four ways to the fractions: a footprint of few cells overlaps them in closed form ([`crate::building::overlap`]); one of many
//! is sampled at the cells' rays; one that the derivatives of the table do not describe, being wide in angle or beside
//! a corner, at several rays a cell; and one near the light is swept ([`crate::building::sampling`]). Between two ways lies a
//! band in which both are taken in part, so that nothing jumps when a splat moves or grows. The paper (Gunjee 2007,
//! section 4.1) adds the full absorbance to every covered cell instead, so that its shadows darken with the size of
//! the table; `AbsorbanceModel::Paper` does that.

use crate::building::caster::Caster;
use crate::building::entries::Entries;
use crate::building::media::{MediaBatches, is_dark};
use crate::building::overlap::{Ellipse, Sink, Spread};
use crate::building::sampling::{NEAR, Sampled};
use crate::building::shares::{Axis, BLOCK, between};
use crate::building::surfaces::SurfaceBatches;
use crate::mapping::{Mapping, Ray};
use glam::{Vec2, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{SplatKind, glam};

/// Where a band begins and where it ends.
pub(crate) type Band = [f32; 2];
/// Half height or width of a footprint, in cells, from which on cells' rays sample it.
pub(crate) const WIDE: Band = [3.0, 4.0];
/// The same where media are thick or hide most of their splats: cells are half as wide as their spacing there, and the closed form takes a fifth of the time of rays.
pub(crate) const WIDE_WITHIN: Band = [5.0, 6.0];
/// The same at a corner of the table, where one ray a cell misses 3 % of a footprint of four cells, and a sixth of that of ten.
const AMPLE: Band = [7.0, 10.0];
/// Bend of a footprint, in cells, that the derivatives at its centre leave out: half extent times angular radius.
pub(crate) const BENT: Band = [0.3, 0.6];
/// Distance to a corner of the table, in half extents of the footprint.
const CLEAR: Band = [2.5, 3.5];
/// Half extent in cells below which a corner does not matter.
const SMALL: Band = [0.3, 0.5];
/// Angular radius from which on casters are swept over the whole table.
pub(crate) const CLOSE: Band = [0.3, NEAR];
/// Rays along a half extent where several rays a cell are taken: more than one a deviation of the kernel.
pub(crate) const RAYS: f32 = 4.0;
/// Most rays along a side of a cell.
pub(crate) const FINE: f32 = 8.0;

/// How far `x` has gone through a band, from 0 to 1.
#[inline(always)]
fn through(band: Band, x: f32) -> f32 {
    between((x - band[0]) * (1.0 / (band[1] - band[0])), 0.0, 1.0)
}

/// Whether a medium of this footprint and angular radius takes the closed form alone, away from edges between octants:
/// what [`Deposit::add`] would decide, without a branch.
#[inline(always)]
pub(crate) fn is_plain<M: Mapping>(mapping: &M, wide: Band, at: Vec2, spread: Spread, angle: f32) -> bool {
    let half = spread.half_extents();
    let [least, most] = [half.min_element(), half.max_element()];
    let is_small = (angle <= CLOSE[0]) & (least <= wide[0]) & (most * angle <= BENT[0]);
    let is_clear = (mapping.clearance(at, half) >= CLEAR[1]) | (least <= SMALL[0]);
    let is_whole = mapping.is_folded() | spread.is_within(mapping.size());
    is_small & is_clear & is_whole & !mapping.is_creased(at, half)
}

/// Distance along `ray` to the plane through `p` with normal `n`; `None` where the ray never meets it.
#[inline]
pub(crate) fn plane_distance(p: Vec3, n: Vec3, ray: &Ray) -> Option<f32> {
    let t = (p - ray.base).dot(n) / ray.direction.dot(n);
    (t > 0.0 && t.is_finite()).then_some(t)
}

/// Distance of the entry of a disc at `distance` on a cell's ray.
#[inline(always)]
pub(crate) fn distance_on_plane(p: Vec3, n: Vec3, distance: f32, ray: &Ray, parallel: bool) -> f32 {
    let t = (p - ray.base).dot(n) / ray.direction.dot(n);
    let on_plane = if (t > 0.0) & (t < f32::INFINITY) { t } else { distance };
    // Where the plane comes far nearer than the splat, it is no longer that splat's.
    if parallel | (on_plane > 0.5 * distance) { on_plane } else { 0.5 * distance }
}

/// Buffers of one worker, reused from chunk to chunk.
#[derive(Debug, Default)]
pub(crate) struct Scratch<const C: usize> {
    pub(crate) media: Entries<C>,
    pub(crate) surfaces: Entries<C>,
    pub(crate) media_batches: MediaBatches,
    pub(crate) surface_batches: SurfaceBatches,
    /// Splats of a chunk: media, surfaces, and those that go one by one.
    pub(crate) ids: [Vec<u32>; 3],
    sampled: Sampled,
    shares: Vec<(u32, f32)>,
}

/// Distances behind which cells take no entries; empty where there is no end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends<'a> {
    /// Of media: opaque discs, or where the cell is dark.
    pub(crate) media: &'a [f32],
    /// Of surfaces: opaque discs.
    pub(crate) surfaces: &'a [f32],
}

impl<'a> Ends<'a> {
    /// The distance of the nearest opaque disc of each cell.
    pub(crate) fn opaque(distances: &'a [f32]) -> Self {
        Self { media: distances, surfaces: distances }
    }
}

/// What a table holds while it is filled: where lists end, and the entries so far.
pub(crate) struct Deposit<'a, M: Mapping, const C: usize> {
    pub(crate) mapping: &'a M,
    pub(crate) ends: Ends<'a>,
    /// Where rays begin to sample footprints of media.
    pub(crate) wide: Band,
    pub(crate) scratch: &'a mut Scratch<C>,
}

impl<M: Mapping, const C: usize> Deposit<'_, M, C> {
    /// Adds one translucent caster (or any, in the paper's model).
    #[inline(always)]
    pub(crate) fn add(&mut self, caster: &Caster) {
        let parallel = self.mapping.is_parallel();
        let angle = if parallel { 0.0 } else { caster.radius / caster.distance };
        let close = self.weight(caster, through(CLOSE, angle));
        if close > 0.0 {
            self.sweep(caster, close);
        }
        if close == 1.0 {
            return;
        }
        let Some(at) = self.mapping.locate(caster.position).map(|place| place.at) else { return };
        let spread = Spread::new(caster, self.mapping.gradients(caster.position));
        let half = spread.half_extents();
        // Beside a fold more cells may belong to it than those about it.
        let is_about = caster.kind == SplatKind::Medium && close == 0.0 && !self.mapping.is_folded();
        let ends = self.ends.media;
        if is_about && !ends.is_empty() && is_dark(ends, self.mapping.size(), at, half + 1.0, caster.distance) {
            return;
        }
        let [least, most] = [half.min_element(), half.max_element()];
        let near = 1.0 - through(CLEAR, self.mapping.clearance(at, half));
        let corner = self.weight(caster, near * through(SMALL, least));
        let band = if caster.kind == SplatKind::Medium { self.wide } else { WIDE };
        let many = self.weight(caster, through(band, least));
        let wide = many - corner * (many - self.weight(caster, through(AMPLE, least)));
        let bent = self.weight(caster, through(BENT, most * angle)).max(corner) * (1.0 - many) + (many - wide);
        let mut rest = 1.0 - wide - bent;
        // Between two powers of two, both numbers of rays are taken in part; at a corner one ray a cell is not enough.
        let octave = if bent > 0.0 { libm::log2f(between(RAYS / least, 1.0, FINE)).max(corner) } else { 0.0 };
        let finer = self.weight(caster, octave.fract());
        let rays = 1 << octave as u32;
        for (weight, samples) in [(wide, 1), (bent * (1.0 - finer), rays), (bent * finer, 2 * rays)] {
            // A footprint that slips through between the rays overlaps cells all the same.
            if weight > 0.0 && !self.sample(caster, at, half, samples, (1.0 - close) * weight) {
                rest += weight;
            }
        }
        if rest > 0.0 {
            let spread = if self.mapping.is_folded() { spread } else { spread.within(self.mapping.size()) };
            let ellipse = Ellipse { at, spread, deviation: caster.kernel.deviation };
            self.overlap(caster, &ellipse, half, (1.0 - close) * rest);
        }
    }

    /// The weight of one of two ways; in the paper's model every cell gets the same, so only one way is taken.
    #[inline(always)]
    fn weight(&self, caster: &Caster, weight: f32) -> f32 {
        if caster.paper_absorbance.is_some() { weight.round() } else { weight }
    }

    #[inline(always)]
    fn overlap(&mut self, caster: &Caster, ellipse: &Ellipse, half: Vec2, weight: f32) {
        let area = if self.mapping.is_parallel() { 1.0 } else { caster.distance * caster.distance };
        let gain = match caster.kind {
            SplatKind::Medium => 1.0,
            _ => angle_gain(caster.position, caster.normal, caster.extinction.opacity, self.mapping.is_parallel()),
        };
        let total = weight * caster.cross_section * gain / area;
        if let Some(crease) = self.mapping.crease(ellipse.at, half) {
            self.overlap_creased(caster, ellipse, &crease, total);
            return;
        }
        let is_plain = caster.kind == SplatKind::Medium && caster.paper_absorbance.is_none();
        ellipse.overlap(&mut Put { deposit: self, caster, total, is_plain });
    }

    /// Entries of a medium in neighbouring cells of a row, at its own distance.
    #[inline(always)]
    fn put_row(&mut self, caster: &Caster, total: f32, first: u32, row: u32, used: usize, shares: &[f32; BLOCK]) {
        let [columns, _] = self.mapping.size();
        let cell = row * columns + first;
        let absorbances: [f32; BLOCK] =
            std::array::from_fn(|k| total * shares[k] * self.mapping.inverse_measure(first + k as u32, row));
        let media = &mut self.scratch.media;
        let ends = self.ends.media;
        let window = ends.get(cell as usize..).and_then(|from| from.first_chunk::<BLOCK>());
        let is_clear = window.is_some_and(|w| w.iter().fold(true, |is_clear, d| is_clear & (*d >= caster.distance)));
        if is_clear || ends.is_empty() {
            media.extend(cell, caster.distance, used, &absorbances, &caster.extinction.rgb);
            return;
        }
        for k in 0..used {
            if ends.get(cell as usize + k).is_none_or(|d| *d >= caster.distance) {
                media.push(cell + k as u32, caster.distance, absorbances[k], &caster.extinction.rgb);
            }
        }
    }

    #[inline(never)]
    fn overlap_creased(&mut self, caster: &Caster, ellipse: &Ellipse, crease: &crate::mapping::Crease, total: f32) {
        let mut shares = std::mem::take(&mut self.scratch.shares);
        shares.clear();
        let mut sum = 0.0;
        ellipse.overlap_creased(crease, |column, row, share| {
            sum += share;
            let Some(cell) = self.mapping.wrap(column, row) else { return };
            // Cells that the edge halves come from both sides.
            match shares.iter_mut().find(|(c, _)| *c == cell) {
                Some((_, s)) => *s += share,
                None => shares.push((cell, share)),
            }
        });
        if sum > 0.0 {
            for &(cell, share) in &shares {
                self.push(caster, cell, total / sum * share * self.inverse_measure(cell), caster.distance);
            }
        }
        self.scratch.shares = shares;
    }

    /// Whether any ray met the footprint.
    #[inline(never)]
    fn sample(&mut self, caster: &Caster, at: Vec2, half: Vec2, samples: u32, weight: f32) -> bool {
        let mut sampled = std::mem::take(&mut self.scratch.sampled);
        sampled.fill(self.mapping, caster, at, half, samples);
        let is_met = !sampled.cells.is_empty();
        self.put(caster, sampled, weight);
        is_met
    }

    /// A caster near or around the light: every cell, along half-rays.
    #[inline(never)]
    fn sweep(&mut self, caster: &Caster, weight: f32) {
        let mut sampled = std::mem::take(&mut self.scratch.sampled);
        sampled.sweep(self.mapping, caster);
        self.put(caster, sampled, weight);
    }

    fn put(&mut self, caster: &Caster, sampled: Sampled, weight: f32) {
        for &(cell, part, distance) in &sampled.cells {
            self.push(caster, cell, weight * sampled.scale * part, distance);
        }
        self.scratch.sampled = sampled;
    }

    fn inverse_measure(&self, cell: u32) -> f32 {
        let [columns, _] = self.mapping.size();
        self.mapping.inverse_measure(cell % columns, cell / columns)
    }

    #[inline]
    fn push(&mut self, caster: &Caster, cell: u32, absorbance: f32, distance: f32) {
        let mut distance = distance;
        let mut absorbance = absorbance;
        if let Some(paper) = caster.paper_absorbance {
            absorbance = paper;
            distance = caster.distance;
        } else if caster.kind != SplatKind::Medium {
            let ray = self.mapping.cell_ray(cell);
            let parallel = self.mapping.is_parallel();
            distance = distance_on_plane(caster.position, caster.normal, caster.distance, &ray, parallel);
        }
        let is_medium = caster.kind == SplatKind::Medium && caster.paper_absorbance.is_none();
        let ends = if is_medium { self.ends.media } else { self.ends.surfaces };
        if ends.get(cell as usize).is_some_and(|d| *d < distance) {
            return;
        }
        let list = if is_medium { &mut self.scratch.media } else { &mut self.scratch.surfaces };
        list.push(cell, distance, absorbance, &caster.extinction.rgb);
    }
}

/// g of a disc: the area that the light sees per area of the disc, times the growth of opacity at that angle.
#[inline(always)]
pub(crate) fn angle_gain(position: Vec3, normal: Vec3, opacity: SurfaceOpacity, parallel: bool) -> f32 {
    // Parallel light travels along the frame's z.
    let cosine = if parallel { normal.z.abs() } else { (position.dot(normal) / position.length()).abs() };
    cosine * opacity.optical_depth_factor(cosine)
}

/// Where the closed form goes.
struct Put<'a, 'b, M: Mapping, const C: usize> {
    deposit: &'a mut Deposit<'b, M, C>,
    caster: &'a Caster,
    total: f32,
    /// Whether all entries lie at the caster's distance.
    is_plain: bool,
}

impl<M: Mapping, const C: usize> Sink for Put<'_, '_, M, C> {
    #[inline(always)]
    fn row(&mut self, row: i32, first: i32, used: usize, shares: &[f32; BLOCK], _axes: [&Axis; 2]) {
        let mapping = self.deposit.mapping;
        let [columns, rows] = mapping.size().map(|n| n as i32);
        let is_inside = (0..rows).contains(&row) && first >= 0 && first + BLOCK as i32 <= columns;
        if is_inside && self.is_plain {
            self.deposit.put_row(self.caster, self.total, first as u32, row as u32, used, shares);
        } else {
            self.each(row, first, &shares[..used]);
        }
    }
}

impl<M: Mapping, const C: usize> Put<'_, '_, M, C> {
    #[inline(never)]
    fn each(&mut self, row: i32, first: i32, shares: &[f32]) {
        for (column, share) in (first..).zip(shares) {
            if let Some(cell) = self.deposit.mapping.wrap(column, row) {
                let absorbance = self.total * share * self.deposit.inverse_measure(cell);
                self.deposit.push(self.caster, cell, absorbance, self.caster.distance);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::building::caster::Casters;
    use crate::building::media::Target;
    use crate::frame::Frame;
    use crate::mapping::{Octahedral, Planar};
    use splat_core::glam::DVec3;
    use splat_core::{Cloud, Splat, rng};

    fn cloud(kind: SplatKind) -> Cloud {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..1000 {
            let number = |k| rng::unit_f32(21, 0, i, k);
            let position = Vec3::new(number(0) - 0.5, number(1) - 0.5, 0.2 + 0.6 * number(2));
            let normal = Vec3::new(number(3) - 0.5, number(4) - 0.5, number(5) - 0.5).normalize();
            let normal = if kind == SplatKind::Medium { Vec3::ZERO } else { normal };
            cloud.push(&Splat { position, radius: 0.005 + 0.06 * number(6), kind, normal, ..Splat::default() });
        }
        cloud
    }

    fn sorted(entries: &Entries<1>) -> Vec<[u32; 3]> {
        let entry = |i: usize| [entries.cell[i], entries.distance[i].to_bits(), entries.absorbance[i][0].to_bits()];
        let mut words: Vec<_> = (0..entries.len).map(entry).collect();
        words.sort_unstable();
        words
    }

    /// Checks entries of both ways, and returns how many splats went side by side.
    fn compare<M: Mapping>(mapping: &M, kind: SplatKind) -> usize {
        let cloud = cloud(kind);
        let params = Params::default();
        let casters = Casters::new(&crate::Scene::from(&cloud), &params);
        let frame = Frame::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], 1.0);
        let ids: Vec<u32> = (0..1000).collect();
        let mut others = Vec::new();
        let mut scratch = Scratch::<1>::default();
        let Scratch { media, surfaces, media_batches, surface_batches, .. } = &mut scratch;
        if kind == SplatKind::Medium {
            Target { mapping, ends: &[], wide: WIDE, entries: media }.add_media(
                &casters,
                &frame,
                &ids,
                media_batches,
                &mut others,
            );
        } else {
            Target { mapping, ends: &[], wide: WIDE, entries: surfaces }.add_surfaces(
                &casters,
                &frame,
                &ids,
                surface_batches,
                &mut others,
            );
        }
        let mut single = Scratch::<1>::default();
        for i in ids.iter().filter(|i| !others.contains(i)) {
            Deposit { mapping, ends: Ends::opaque(&[]), wide: WIDE, scratch: &mut single }.add(&casters.get(
                *i as usize,
                &frame,
                mapping.is_parallel(),
            ));
        }
        assert_eq!(sorted(&scratch.media), sorted(&single.media));
        assert_eq!(sorted(&scratch.surfaces), sorted(&single.surfaces));
        ids.len() - others.len()
    }

    #[test]
    fn splats_leave_the_same_bits_side_by_side_and_one_by_one() {
        let planar = |perspective| Planar { min: Vec2::NEG_ONE * 1.5, cell: 0.05, size: [60, 60], perspective };
        for kind in [SplatKind::Medium, SplatKind::Surface] {
            let plain = [
                compare(&Octahedral::new(48), kind),
                compare(&planar(true), kind),
                compare(&planar(false), kind),
                compare(&crate::mapping::PolarAzimuth::new(60, 40, crate::mapping::PolarRange::SPHERE), kind),
            ];
            assert!(plain.iter().all(|n| (200..=1000).contains(n)), "{plain:?} side by side");
        }
    }
}
