//! Everything that a map's build leaves before its lists are sorted and summed: by the processor, or by a device.

use crate::building::caster::Casters;
use crate::building::darkness::Darkness;
use crate::building::deposit::{Deposit, Ends, Scratch, WIDE};
use crate::building::media::Target;
use crate::mapping::{Mapping, with_mapping};
use crate::planning::lit::{ROUND_COUNT, Rounds};
use crate::planning::plan::{Plan, plan, predict};
use crate::planning::survey::{CHUNK, Survey};
use crate::shadow_map::{Absorbances, Matter, head};
use crate::table::{Lists, Parted, Ranges};
use crate::{Error, Params, Prediction, Resolution, Scene, ShadowMap};
use rayon::prelude::*;
use splat_core::{Light, Limits, Progress, SplatKind};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// The deposits of one light's map, parted by cells: all of the map but its lists (Gunjee 2007, section 4.1, steps 1-2).
///
/// [`Deposits::into_map`] makes the lists here; with feature `gpu` a device can, with the same bits.
#[derive(Debug, Clone)]
pub struct Deposits {
    /// The map, without lists.
    pub(crate) map: ShadowMap,
    pub(crate) parts: Parts,
    pub(crate) ranges: Ranges,
    /// Absorbance at which lists stop.
    pub(crate) limit: f32,
}

/// Entries of media and of surfaces, each chunk of splats by itself.
pub(crate) type Parted2<const C: usize> = [Vec<Parted<C>>; 2];

/// Entries with one absorbance for all channels, or with three.
#[derive(Debug, Clone)]
pub(crate) enum Parts {
    Mono(Parted2<1>),
    Rgb(Parted2<3>),
}

impl Deposits {
    /// Looks at the casters, chooses the table and deposits their absorbance; the arguments are those of
    /// [`ShadowMap::build`].
    ///
    /// # Errors
    /// Those of [`ShadowMap::build`].
    pub fn new(scene: &Scene<'_>, light: &Light, params: &Params, progress: Option<&Progress>) -> Result<Self, Error> {
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        params.validate()?;
        light.validate(0)?;
        let casters = Casters::new(scene, params);
        let survey = Survey::new(&casters);
        let mut room = params.limits;
        let mut refused = None;
        loop {
            let plan = match plan(&casters, &survey, light, &room) {
                Ok(plan) => plan,
                Err(error) => return Err(refused.unwrap_or(error)),
            };
            progress.add_total(scene.cloud.len() as u64);
            match with_mapping!(&plan.table, m => Self::with_mapping(&casters, &survey, &plan, m, progress)) {
                // Casters that are not spread evenly make more entries than were predicted.
                Err(error @ Error::Limit(_)) if params.resolution == Resolution::Auto => refused = Some(error),
                made => return made,
            }
            room = Limits { max_bytes: room.max_bytes / 2, max_elements: room.max_elements / 2 };
        }
    }

    /// Predicts the cost of [`Deposits::new`] from a survey of the casters.
    ///
    /// # Errors
    /// Those of [`ShadowMap::build`].
    pub fn predict(scene: &Scene<'_>, light: &Light, params: &Params) -> Result<Prediction, Error> {
        params.validate()?;
        light.validate(0)?;
        let casters = Casters::new(scene, params);
        predict(&casters, &Survey::new(&casters), light, &params.limits)
    }

    fn with_mapping<M: Mapping>(
        casters: &Casters<'_>,
        survey: &Survey,
        plan: &Plan,
        mapping: &M,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let map = head(casters, survey, plan, mapping);
        let [columns, rows] = mapping.size();
        let ranges = Ranges::new(columns as usize * rows as usize, plan.prediction.entries);
        let parts = if survey.coloured {
            Parts::Rgb(deposit_all(casters, plan, mapping, &map.opaque, ranges, progress)?)
        } else {
            Parts::Mono(deposit_all(casters, plan, mapping, &map.opaque, ranges, progress)?)
        };
        Ok(Self { map, parts, ranges, limit: casters.params.absorbance_limit() })
    }

    /// Entries of media and of surfaces.
    pub fn entries(&self) -> [u64; 2] {
        match &self.parts {
            Parts::Mono(parts) => entries(parts),
            Parts::Rgb(parts) => entries(parts),
        }
    }

    /// 1 when all casters absorb every channel alike, else 3.
    pub fn channels(&self) -> usize {
        if matches!(self.parts, Parts::Mono(_)) { 1 } else { 3 }
    }

    /// The map, its lists sorted and summed by the processor.
    pub fn into_map(self) -> ShadowMap {
        let Self { map, parts, ranges, limit } = self;
        match parts {
            Parts::Mono(parts) => map.with(Absorbances::Mono(lists(&parts, ranges, limit))),
            Parts::Rgb(parts) => map.with(Absorbances::Rgb(lists(&parts, ranges, limit))),
        }
    }
}

fn entries<const C: usize>(parts: &Parted2<C>) -> [u64; 2] {
    parts.each_ref().map(|parted| parted.iter().map(|p| p.len() as u64).sum())
}

fn lists<const C: usize>(parts: &Parted2<C>, ranges: Ranges, limit: f32) -> Matter<C> {
    let [media, surfaces] =
        [0, 1].map(|kind| (entries(parts)[kind] > 0).then(|| Lists::new(&parts[kind], ranges, limit)));
    Matter { media, surfaces }
}

/// Media and surfaces of chunks, parted by cells.
type ChunksOf<const C: usize> = Vec<(Parted<C>, Parted<C>)>;

/// What all chunks of a table share while it is filled.
struct Filling<'a, M: Mapping> {
    casters: &'a Casters<'a>,
    plan: &'a Plan,
    mapping: &'a M,
    ranges: Ranges,
    progress: &'a Progress,
    /// Entries so far: held to the limit while they are made, for predictions may be half of them.
    made: AtomicU64,
}

pub(crate) fn deposit_all<M: Mapping, const C: usize>(
    casters: &Casters<'_>,
    plan: &Plan,
    mapping: &M,
    opaque: &[f32],
    ranges: Ranges,
    progress: &Progress,
) -> Result<Parted2<C>, Error> {
    let filling = Filling { casters, plan, mapping, ranges, progress, made: AtomicU64::new(0) };
    let chunks: ChunksOf<C> = match &plan.lit.rounds {
        Some(rounds) => filling.by_rounds(rounds, opaque)?,
        None => filling.fill_all(Ends::opaque(opaque), |splats| splats)?,
    };
    let (media, surfaces) = chunks.into_iter().unzip();
    Ok([media, surfaces])
}

impl<M: Mapping> Filling<'_, M> {
    /// Entries of all splats, chunk by chunk, of those that `select` leaves of each.
    fn fill_all<const C: usize, I: Iterator<Item = usize> + Clone>(
        &self,
        ends: Ends<'_>,
        select: impl Fn(Range<usize>) -> I + Sync,
    ) -> Result<ChunksOf<C>, Error> {
        let n = self.casters.cloud.len();
        let chunks = (0..n.div_ceil(CHUNK)).into_par_iter();
        chunks
            // Boxed: rayon moves what it makes here through a frame for each halving, and its 69 KB in each overflowed stacks without optimisation.
            .map_init(Box::<Scratch<C>>::default, |scratch, c| {
                self.fill(scratch, ends, select(c * CHUNK..n.min((c + 1) * CHUNK)))
            })
            .collect()
    }

    /// Entries of some splats.
    fn fill<const C: usize>(
        &self,
        scratch: &mut Scratch<C>,
        ends: Ends<'_>,
        splats: impl Iterator<Item = usize> + Clone,
    ) -> Result<(Parted<C>, Parted<C>), Error> {
        let Self { casters, plan, mapping, progress, .. } = *self;
        progress.tick(splats.clone().count() as u64)?;
        scratch.media.clear();
        scratch.surfaces.clear();
        let deposit = Deposit { mapping, ends, wide: plan.lit.wide(), scratch };
        pulp::Arch::new().dispatch(FillChunk { casters, plan, deposit, splats });
        let more = (scratch.media.len + scratch.surfaces.len) as u64;
        check_entries::<C>(self.made.fetch_add(more, Ordering::Relaxed) + more, &casters.params.limits)?;
        Ok((Parted::new(&scratch.media, self.ranges), Parted::new(&scratch.surfaces, self.ranges)))
    }

    /// Entries of all splats, of those first that seem to be lit.
    fn by_rounds<const C: usize>(&self, rounds: &Rounds, opaque: &[f32]) -> Result<ChunksOf<C>, Error> {
        let round_of = rounds.of_splats(self.casters, &self.plan.frame);
        let mut dark = Darkness::<C>::new(self.ranges, opaque, self.casters.params.absorbance_limit());
        let mut chunks = ChunksOf::new();
        for round in 0..ROUND_COUNT {
            let ends = Ends { media: &dark.ends, surfaces: opaque };
            let made = self.fill_all(ends, |splats| splats.filter(|&splat| round_of[splat] == round))?;
            dark.add(&made);
            chunks.extend(made);
        }
        Ok(chunks)
    }
}

/// Holds the lists to what they may take.
pub(crate) fn check_entries<const C: usize>(entries: u64, limits: &Limits) -> Result<(), Error> {
    let most = limits.max_elements.min(u32::MAX.into());
    if entries > most {
        return Err(Error::limit("the set of lists", entries, most, "entries"));
    }
    let absorbance = size_of::<[f32; C]>() as u64;
    let needed = entries * (2 * absorbance + 12);
    if needed > limits.max_bytes {
        return Err(Error::limit("the set of lists", needed, limits.max_bytes, "bytes"));
    }
    Ok(())
}

/// The casters of one kind among some splats.
#[inline(always)]
pub(crate) fn select(casters: &Casters<'_>, splats: impl Iterator<Item = usize>, kind: SplatKind, ids: &mut Vec<u32>) {
    ids.clear();
    let casts = |&i: &usize| casters.cloud.kind[i] == kind && casters.casts(i);
    ids.extend(splats.filter(casts).map(|i| i as u32));
}

/// Deposits of one chunk of splats, in the form that [`pulp`] compiles once per instruction set.
struct FillChunk<'a, M: Mapping, I: Iterator<Item = usize> + Clone, const C: usize> {
    casters: &'a Casters<'a>,
    plan: &'a Plan,
    deposit: Deposit<'a, M, C>,
    splats: I,
}

impl<M: Mapping, I: Iterator<Item = usize> + Clone, const C: usize> pulp::NullaryFnOnce for FillChunk<'_, M, I, C> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let casters = self.casters;
        let Scratch { media, surfaces, media_batches, surface_batches, ids, .. } = &mut *self.deposit.scratch;
        let [medium_ids, surface_ids, others] = ids;
        let mut others = std::mem::take(others);
        others.clear();
        if casters.has_opaque_discs() {
            let frame = &self.plan.frame;
            let mapping = self.deposit.mapping;
            let Deposit { ends, wide, .. } = self.deposit;
            select(casters, self.splats.clone(), SplatKind::Medium, medium_ids);
            select(casters, self.splats.clone(), SplatKind::Surface, surface_ids);
            let mut target = Target { mapping, ends: ends.media, wide, entries: media };
            target.add_media(casters, frame, medium_ids, media_batches, &mut others);
            let mut target = Target { mapping, ends: ends.surfaces, wide: WIDE, entries: surfaces };
            target.add_surfaces(casters, frame, surface_ids, surface_batches, &mut others);
        } else {
            others.extend(self.splats.filter(|&i| casters.casts(i)).map(|i| i as u32));
        }
        for &i in &others {
            self.deposit.add(&casters.get(i as usize, &self.plan.frame, self.deposit.mapping.is_parallel()));
        }
        self.deposit.scratch.ids[2] = others;
    }
}
