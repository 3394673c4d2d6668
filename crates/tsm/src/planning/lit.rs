//! Which casters light reaches: lists end where it is dark, so that what lies behind needs no entries.
//!
//! A look before any work sums the absorbance of media in a table of some 32 cells a side, in [`SLABS`] slabs of equal depth. What all nearer slabs of its
//! cell absorb tells how deep a caster lies in the dark. It is a mean over many cells of the map, so it decides nothing but the order: the
//! casters that seem to be lit are deposited first, and of the others those that the cells of the map do not hide
//! ([`crate::building::darkness`]).

use crate::building::caster::Casters;
use crate::building::deposit::{Band, WIDE, WIDE_WITHIN};
use crate::frame::Frame;
use crate::mapping::{Mapping, Table, with_mapping};
use crate::planning::survey::{CHUNK, Survey};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::optics::AbsorbanceModel;
use splat_core::shade::joint::THICK;
use splat_core::{Footprint, SplatKind};
use std::ops::Range;

/// Slabs of equal depth between the nearest and the farthest place that a caster may have.
const SLABS: usize = 64;
/// Cells along the longer side of the table that is looked at.
pub(crate) const LOOK_CELLS: f64 = 32.0;
/// Splats that are looked at for the thickness of media.
const LOOKED_AT: usize = 4096;
/// Media from which on the look may pay: fewer make a table in some milliseconds.
const MANY: u64 = 65_536;
/// The same of thick media, whose cells are finer.
const FEW: u64 = 4096;
/// Clouds of this size and more are looked at by a sample: one splat in so many tells of those about it, which neighbours in the list lie near.
const SAMPLED: usize = 1 << 18;
const SAMPLE: usize = 8;
/// Share of casters that seem to be lit above which the rest saves less than it costs.
const WORTH: f64 = 0.75;
/// Absorbance before a caster, over the visible limit, up to which it belongs to each round. The first is what seems to be lit, with room for cells
/// that lie below the mean.
const ROUNDS: [f64; 2] = [1.5, 6.0];
/// Rounds in which casters are deposited.
pub(crate) const ROUND_COUNT: u8 = ROUNDS.len() as u8 + 1;
/// Absorbance in fixed point: 2¹⁶ units an absorbance of 1, so that the order of summing does not matter.
const FIXED: f32 = 65_536.0;

/// What is known of lit casters before any work.
#[derive(Debug, Clone)]
pub(crate) struct Lit {
    /// Share of the casters that seem to be lit, in (0, 1].
    pub(crate) share: f64,
    /// Share of translucent casters that lie behind nothing opaque, and leave entries; in [0, 1].
    pub(crate) unhidden: f64,
    /// Rounds in which casters are deposited; `None` where nearly all are lit.
    pub(crate) rounds: Option<Rounds>,
    /// Whether light falls off within a spacing of most media, so that cells have to be fine.
    pub(crate) is_steep: bool,
}

impl Lit {
    /// All casters are lit.
    const EVERYWHERE: Self = Self { share: 1.0, unhidden: 1.0, rounds: None, is_steep: false };

    /// Looks at the translucent casters through a coarse table.
    pub(crate) fn new(casters: &Casters<'_>, survey: &Survey, frame: &Frame, coarse: Table) -> Self {
        let media = survey.kinds[SplatKind::Medium as usize];
        let surfaces = survey.kinds[SplatKind::Surface as usize];
        if media + surfaces == 0 || casters.params.absorbance == AbsorbanceModel::Paper {
            return Self::EVERYWHERE;
        }
        let slabs = Slabs::new(survey, frame, coarse);
        let unhidden = if survey.kinds[SplatKind::Opaque as usize] == 0 {
            1.0
        } else {
            let opaque = slabs.columns_of(casters, frame, |kind| kind == SplatKind::Opaque);
            slabs.columns_of(casters, frame, |kind| kind != SplatKind::Opaque).share_beside(&opaque)
        };
        if media == 0 {
            return Self { unhidden, ..Self::EVERYWHERE };
        }
        let is_steep = is_thick(casters);
        let many = if is_steep { FEW } else { MANY };
        if media < many {
            return Self { unhidden, is_steep, ..Self::EVERYWHERE };
        }
        let (rounds, dark) = Rounds::new(casters, frame, slabs);
        let share = survey.casters.saturating_sub(dark).max(1) as f64 / survey.casters as f64;
        if share < WORTH {
            Self { share, unhidden, rounds: Some(rounds), is_steep: true }
        } else if is_steep {
            Self { share, unhidden, is_steep, ..Self::EVERYWHERE }
        } else {
            Self { unhidden, ..Self::EVERYWHERE }
        }
    }

    /// Where rays begin to sample footprints of media.
    pub(crate) fn wide(&self) -> Band {
        if self.is_steep { WIDE_WITHIN } else { WIDE }
    }
}

/// Whether a spacing of most of the media that cast is optically thick, by a look at some at even distances in the list.
fn is_thick(casters: &Casters<'_>) -> bool {
    let cloud = casters.cloud;
    let is_medium = |i: &usize| cloud.kind[*i] == SplatKind::Medium && cloud.gaussian_of(*i).is_none();
    let looked_at = (0..cloud.len()).step_by(cloud.len().div_ceil(LOOKED_AT).max(1));
    let mut media = 0;
    let mut thick = 0;
    for i in looked_at.filter(|i| is_medium(i) && casters.casts(*i)) {
        let spacing = casters.kernel(i).deviation * cloud.radius[i] / Footprint::SIGMA_OVER_SPACING;
        let most = casters.extinction(i).rgb.into_iter().fold(0.0, f32::max);
        media += 1;
        thick += u32::from(cloud.cross_section[i] * most > THICK * spacing * spacing);
    }
    2 * thick > media
}

/// The cells of a coarse table, in slabs of equal depth.
#[derive(Debug, Clone)]
pub(crate) struct Slabs {
    coarse: Table,
    near: f32,
    /// Depth of a slab.
    depth: f32,
}

/// The round of each caster, by its place.
#[derive(Debug, Clone)]
pub(crate) struct Rounds {
    slabs: Slabs,
    /// Of each cell, slab by slab.
    round: Vec<u8>,
}

/// Casters by cell and slab: how many, and their absorbance.
struct Columns {
    count: Vec<u32>,
    absorbance: Vec<u64>,
}

impl Slabs {
    pub(crate) fn new(survey: &Survey, frame: &Frame, coarse: Table) -> Self {
        let across = frame.length(survey.bounds.diagonal()) + 2.0 * frame.length(survey.max_radius);
        let near = (frame.extent() - 1.01 * across).max(0.0);
        let depth = ((frame.extent() - near) / SLABS as f32).max(f32::MIN_POSITIVE);
        Self { coarse, near, depth }
    }

    /// The casters of some kinds.
    fn columns_of(&self, casters: &Casters<'_>, frame: &Frame, is_asked: impl Fn(SplatKind) -> bool + Sync) -> Columns {
        let n = casters.cloud.len();
        // Few large parts: each carries a table.
        let part = CHUNK.max(n.div_ceil(16));
        let parts: Vec<Columns> = (0..n.div_ceil(part))
            .into_par_iter()
            .map(|c| {
                let splats = c * part..n.min((c + 1) * part);
                with_mapping!(&self.coarse, m => self.columns(m, casters, frame, splats, &is_asked))
            })
            .collect();
        let none = || Columns { count: Vec::new(), absorbance: Vec::new() };
        parts.into_iter().reduce(Columns::join).unwrap_or_else(none)
    }

    fn columns<M: Mapping>(
        &self,
        coarse: &M,
        casters: &Casters<'_>,
        frame: &Frame,
        splats: Range<usize>,
        is_asked: impl Fn(SplatKind) -> bool,
    ) -> Columns {
        let cloud = casters.cloud;
        let [width, height] = coarse.size();
        let len = width as usize * height as usize * SLABS;
        let mut columns = Columns { count: vec![0; len], absorbance: vec![0; len] };
        let every = if cloud.len() < SAMPLED { 1 } else { SAMPLE };
        for i in splats.filter(|i| i.is_multiple_of(every)) {
            if !is_asked(cloud.kind[i]) || !casters.casts(i) {
                continue;
            }
            let position = frame.position(cloud.position[i]);
            let Some(slot) = self.slot(coarse, position) else { continue };
            let cell = slot / SLABS as u32;
            let area = if coarse.is_parallel() { 1.0 } else { position.length_squared() };
            let share = if cloud.kind[i] == SplatKind::Opaque {
                let direction = if coarse.is_parallel() { Vec3::Z } else { position.normalize_or(Vec3::Z) };
                frame.turn(cloud.normal_of(i)).dot(direction).abs()
            } else {
                let [red, green, blue] = casters.extinction(i).rgb;
                red.min(green).min(blue)
            };
            let absorbance =
                share * frame.area(cloud.cross_section[i]) * coarse.inverse_measure(cell % width, cell / width) / area;
            columns.count[slot as usize] += every as u32;
            // The cast saturates, and 2²⁹ of the greatest, eight times, fit 64 bits.
            columns.absorbance[slot as usize] += every as u64 * u64::from((absorbance * FIXED) as u32);
        }
        columns
    }

    /// Where a position of the light's frame is summed; `None` outside the table.
    #[inline(always)]
    fn slot<M: Mapping>(&self, coarse: &M, position: Vec3) -> Option<u32> {
        let place = coarse.locate(position)?;
        let [width, height] = coarse.size();
        let column = (place.at.x.max(0.0) as u32).min(width - 1);
        let row = (place.at.y.max(0.0) as u32).min(height - 1);
        let slab = (((place.distance - self.near) / self.depth).max(0.0) as u32).min(SLABS as u32 - 1);
        Some((row * width + column) * SLABS as u32 + slab)
    }
}

impl Rounds {
    /// The rounds of casters, and how many do not belong to the first.
    pub(crate) fn new(casters: &Casters<'_>, frame: &Frame, slabs: Slabs) -> (Self, u64) {
        let media = slabs.columns_of(casters, frame, |kind| kind == SplatKind::Medium);
        let unit = f64::from(casters.params.absorbance_limit()) * f64::from(FIXED);
        let limits = ROUNDS.map(|limit| (limit * unit) as u64);
        let mut rounds = Self { slabs, round: Vec::with_capacity(media.count.len()) };
        let mut dark = 0;
        for (counts, absorbances) in media.count.chunks(SLABS).zip(media.absorbance.chunks(SLABS)) {
            let mut before = 0;
            for (count, absorbance) in counts.iter().zip(absorbances) {
                let round = limits.iter().filter(|limit| before >= **limit).count();
                dark += if round > 0 { u64::from(*count) } else { 0 };
                before += absorbance;
                rounds.round.push(round as u8);
            }
        }
        (rounds, dark)
    }

    /// The round of each splat; the first for what is no medium.
    pub(crate) fn of_splats(&self, casters: &Casters<'_>, frame: &Frame) -> Vec<u8> {
        with_mapping!(&self.slabs.coarse, m => self.of_splats_in(m, casters, frame))
    }

    fn of_splats_in<M: Mapping>(&self, coarse: &M, casters: &Casters<'_>, frame: &Frame) -> Vec<u8> {
        let cloud = casters.cloud;
        let mut rounds = vec![0; cloud.len()];
        rounds.par_chunks_mut(CHUNK).enumerate().for_each(|(c, rounds)| {
            let splats = c * CHUNK..c * CHUNK + rounds.len();
            let kinds = &cloud.kind[splats.clone()];
            for ((round, position), kind) in rounds.iter_mut().zip(&cloud.position[splats]).zip(kinds) {
                if *kind != SplatKind::Medium {
                    continue;
                }
                if let Some(slot) = self.slabs.slot(coarse, frame.position(*position)) {
                    *round = self.round[slot as usize];
                }
            }
        });
        rounds
    }
}

impl Columns {
    /// The share of these casters that lie behind nothing opaque, where opaque discs lie anyhow in each cell and those of a slab evenly through it.
    fn share_beside(&self, opaque: &Self) -> f64 {
        let mut total = 0.0;
        let mut unhidden = 0.0;
        for first in (0..self.count.len()).step_by(SLABS) {
            let mut covered = 0.0;
            for slot in first..first + SLABS {
                let coverage = opaque.absorbance[slot] as f64 / f64::from(FIXED);
                let count = f64::from(self.count[slot]);
                total += count;
                unhidden += count * libm::exp(-covered - 0.5 * coverage);
                covered += coverage;
            }
        }
        if total > 0.0 { unhidden / total } else { 1.0 }
    }

    fn join(mut self, other: Self) -> Self {
        self.count.iter_mut().zip(other.count).for_each(|(to, from)| *to += from);
        self.absorbance.iter_mut().zip(other.absorbance).for_each(|(to, from)| *to += from);
        self
    }
}
