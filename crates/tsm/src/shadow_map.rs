//! A map, and what of it is there before its lists: opaque discs, sizes (Gunjee 2007, section 4.1, steps 1-3).

use crate::building::caster::Casters;
use crate::building::opaque::{DiscBatches, OpaqueDepth};
use crate::frame::Frame;
use crate::mapping::{Mapping, Table};
use crate::planning::cost::{Counts, Prediction};
use crate::planning::plan::Plan;
use crate::planning::survey::{CHUNK, Survey};
use crate::table::Lists;
use crate::{Deposits, Error, Params, Scene};
use rayon::prelude::*;
use splat_core::optics::AbsorbanceModel;
use splat_core::{Light, Progress, SplatKind};
use std::ops::Range;

/// Media, whose absorbance grows continuously, and surfaces, which are steps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matter<const C: usize> {
    pub(crate) media: Option<Lists<C>>,
    pub(crate) surfaces: Option<Lists<C>>,
}

/// Absorbance of one channel for all, or of three.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Absorbances {
    Mono(Matter<1>),
    Rgb(Matter<3>),
}

/// Transmittance from one light to any point.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowMap {
    pub(crate) frame: Frame,
    pub(crate) table: Table,
    /// Distance of the nearest opaque disc of each cell; empty without any.
    pub(crate) opaque: Vec<f32>,
    pub(crate) absorbances: Absorbances,
    /// Half width of a medium's entry along the ray, in the frame.
    pub(crate) ramp: f32,
    /// Receiver's cutoff radius → distance by which it is lifted, as a factor.
    pub(crate) bias: f32,
    /// In the paper's model light ends at this absorbance.
    pub(crate) dark_from: Option<f32>,
    prediction: Prediction,
    counts: Counts,
}

impl ShadowMap {
    /// Builds the map of one light. Splats are reported to `progress`, and work stops where that is cancelled.
    ///
    /// # Errors
    /// [`Error::Parameter`] for parameters out of range or a mapping that does not fit the light, [`Error::Limit`]
    /// for a map beyond [`Params::limits`], [`Error::Core`] for a light or splat that breaks a promise, and
    /// [`splat_core::Error::Cancelled`] in it.
    pub fn build(
        scene: &Scene<'_>,
        light: &Light,
        params: &Params,
        progress: Option<&Progress>,
    ) -> Result<Self, Error> {
        Deposits::new(scene, light, params, progress).map(Deposits::into_map)
    }

    /// 1 when all casters absorb every channel alike, else 3.
    pub fn channels(&self) -> usize {
        if matches!(self.absorbances, Absorbances::Mono(_)) { 1 } else { 3 }
    }

    /// The predicted cost of the build.
    pub fn prediction(&self) -> Prediction {
        self.prediction
    }

    /// The counts of the build.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The mapping from directions to cells.
    pub fn table(&self) -> &Table {
        &self.table
    }
}

/// A map without its lists.
pub(crate) fn head<M: Mapping>(casters: &Casters<'_>, survey: &Survey, plan: &Plan, mapping: &M) -> ShadowMap {
    let params = casters.params;
    let radius_over_spacing = params.footprints.layers()[0].cutoff * splat_core::Footprint::SIGMA_OVER_SPACING;
    let [columns, rows] = mapping.size().map(u64::from);
    ShadowMap {
        frame: plan.frame,
        table: plan.table.clone(),
        opaque: opaque_depths(casters, survey, plan, mapping),
        absorbances: Absorbances::Mono(Matter { media: None, surfaces: None }),
        ramp: 0.5 * plan.frame.length(survey.mean_medium_radius()) / radius_over_spacing,
        bias: params.bias / radius_over_spacing,
        dark_from: (params.absorbance == AbsorbanceModel::Paper).then(|| params.absorbance_limit()),
        prediction: plan.prediction,
        counts: Counts {
            casters: survey.casters,
            translucent: survey.kinds[SplatKind::Medium as usize] + survey.kinds[SplatKind::Surface as usize],
            cells: columns * rows,
            ..Counts::default()
        },
    }
}

impl ShadowMap {
    /// The map with its lists.
    pub(crate) fn with(mut self, absorbances: Absorbances) -> Self {
        self.absorbances = absorbances;
        self.count();
        self
    }

    fn count(&mut self) {
        fn add<const C: usize>(matter: &Matter<C>, counts: &mut Counts) {
            for lists in [&matter.media, &matter.surfaces].into_iter().flatten() {
                counts.entries += lists.entries();
                counts.kept += lists.kept();
                counts.bytes += lists.bytes();
            }
        }
        match &self.absorbances {
            Absorbances::Mono(m) => add(m, &mut self.counts),
            Absorbances::Rgb(m) => add(m, &mut self.counts),
        }
        self.counts.bytes += 4 * self.opaque.len() as u64;
        if let Table::Octahedral(m) = &self.table {
            self.counts.bytes += crate::mapping::Octahedral::bytes(m.size()[0]);
        }
    }
}

fn opaque_depths<M: Mapping>(casters: &Casters<'_>, survey: &Survey, plan: &Plan, mapping: &M) -> Vec<f32> {
    if survey.kinds[SplatKind::Opaque as usize] == 0 || casters.params.absorbance == AbsorbanceModel::Paper {
        return Vec::new();
    }
    let [columns, rows] = mapping.size();
    let depth = OpaqueDepth::new(columns as usize * rows as usize);
    let cloud = casters.cloud;
    (0..cloud.len().div_ceil(CHUNK)).into_par_iter().for_each_init(DiscBatches::default, |work, c| {
        let chunk = c * CHUNK..cloud.len().min((c + 1) * CHUNK);
        pulp::Arch::new().dispatch(OpaqueChunk { casters, plan, mapping, depth: &depth, chunk, work });
    });
    depth.into_distances()
}

/// Opaque discs of one chunk of splats, in the form that [`pulp`] compiles once per instruction set.
struct OpaqueChunk<'a, M: Mapping> {
    casters: &'a Casters<'a>,
    plan: &'a Plan,
    mapping: &'a M,
    depth: &'a OpaqueDepth,
    chunk: Range<usize>,
    work: &'a mut DiscBatches,
}

impl<M: Mapping> pulp::NullaryFnOnce for OpaqueChunk<'_, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let casters = self.casters;
        let is_wanted = |&i: &usize| casters.cloud.kind[i] == SplatKind::Opaque && casters.casts(i);
        let splats = self.chunk.filter(is_wanted).map(|i| i as u32);
        self.depth.add_all(self.mapping, casters, &self.plan.frame, splats, self.work);
    }
}
