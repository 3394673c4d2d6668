//! Work of the processor before a device deposits: the survey of casters, the choice of the table, the nearest opaque discs,
//! and the entries of casters that the closed form cannot treat.
//!
//! Nearly all translucent splats are plain (see `media.rs`): their footprint lies away from every edge of the table and is of
//! few cells. These casters are the device's. The others (bent over an edge between octants, of many cells, near the light),
//! and all of them in the paper's model, are the processor's, which hands on their entries.

use crate::building::caster::Casters;
use crate::building::deposit::{Deposit, Ends, Scratch};
use crate::building::deposits::{check_entries, select};
use crate::building::entries::Entries;
use crate::gpu::MOST_ENTRIES;
use crate::mapping::{Mapping, Table, with_mapping};
use crate::planning::plan::{Plan, plan};
use crate::planning::survey::{CHUNK, Survey};
use crate::shadow_map::head;
use crate::{Error, Params, Scene, ShadowMap};
use rayon::prelude::*;
use splat_core::optics::SurfaceOpacity;
use splat_core::{Light, Progress, SplatKind};
use std::ops::{Range, RangeInclusive};

/// Entries of a plain caster are fewer than this.
const MOST_OF_A_CASTER: u32 = 144;
/// Units that squares of single precision stand.
const UNITS: RangeInclusive<f64> = 1e-12..=1e12;

/// The casters of one light's map, made ready for a device to deposit them.
#[derive(Debug, Clone)]
pub struct Casting {
    /// The map, without lists.
    pub(super) map: ShadowMap,
    /// Ids of plain casters.
    pub(super) plain: Vec<u32>,
    pub(super) given: Given,
    pub(super) channels: u32,
    /// Whether there are discs, or materials that absorb channels differently.
    pub(super) has_planes: bool,
    /// Absorbance at which lists stop.
    pub(super) limit: f32,
    /// Share of the casters that are lit, by which entries were predicted.
    lit_share: f64,
    /// Materials, one for unknown ones, footprints.
    pub(super) tables: Vec<[f32; 4]>,
    pub(super) footprints: u32,
}

/// Entries that the processor made; those of surfaces lie in cells behind the table's.
#[derive(Debug, Clone, Default)]
pub(super) struct Given {
    pub(super) cells: Vec<u32>,
    pub(super) distances: Vec<f32>,
    /// One number a channel.
    pub(super) absorbances: Vec<f32>,
}

impl Given {
    fn add<const C: usize>(&mut self, entries: &Entries<C>, behind: u32) {
        self.cells.extend(entries.cell[..entries.len].iter().map(|cell| cell + behind));
        self.distances.extend_from_slice(&entries.distance[..entries.len]);
        self.absorbances.extend_from_slice(entries.absorbance[..entries.len].as_flattened());
    }

    fn append(&mut self, other: Self) {
        self.cells.extend(other.cells);
        self.distances.extend(other.distances);
        self.absorbances.extend(other.absorbances);
    }
}

impl Casting {
    /// Looks at the casters and chooses the table, as [`crate::Deposits::new`] with the same arguments does, and deposits what
    /// is not plain.
    ///
    /// # Errors
    /// Errors of [`crate::Deposits::new`]. [`Error::Processor`] for a table of polar angles, for a scene whose size
    /// overflows single precision when squared, and for too many casters to count.
    pub fn new(scene: &Scene<'_>, light: &Light, params: &Params, progress: Option<&Progress>) -> Result<Self, Error> {
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        params.validate()?;
        light.validate(0)?;
        let casters = Casters::new(scene, params);
        let survey = Survey::new(&casters);
        let plan = plan(&casters, &survey, light, &params.limits)?;
        let refused = |why| Err(Error::Processor { why });
        if matches!(plan.table, Table::PolarAzimuth(_)) {
            return refused("shadow maps of polar angles are the processor's");
        }
        if !UNITS.contains(&plan.frame.parts().2) {
            return refused("shadow maps of so large or small a scene are the processor's");
        }
        if scene.cloud.len() > (MOST_ENTRIES / MOST_OF_A_CASTER) as usize {
            return refused("shadow maps of so many splats are the processor's");
        }
        progress.add_total(scene.cloud.len() as u64);
        with_mapping!(&plan.table, m => if survey.coloured {
            Self::with_mapping::<_, 3>(&casters, &survey, &plan, m, progress)
        } else {
            Self::with_mapping::<_, 1>(&casters, &survey, &plan, m, progress)
        })
    }

    fn with_mapping<M: Mapping, const C: usize>(
        casters: &Casters<'_>,
        survey: &Survey,
        plan: &Plan,
        mapping: &M,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let map = head(casters, survey, plan, mapping);
        let cloud = casters.cloud;
        let opaque = &map.opaque[..];
        let chunks: Vec<(Vec<u32>, Given)> = (0..cloud.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Scratch::<C>::default, |scratch, c| {
                let chunk = c * CHUNK..cloud.len().min((c + 1) * CHUNK);
                progress.tick(chunk.len() as u64)?;
                scratch.media.clear();
                scratch.surfaces.clear();
                let deposit = Deposit { mapping, ends: Ends::opaque(opaque), wide: plan.lit.wide(), scratch };
                Ok(pulp::Arch::new().dispatch(PartChunk { casters, plan, deposit, chunk }))
            })
            .collect::<Result<_, Error>>()?;
        let mut plain = Vec::new();
        let mut given = Given::default();
        for (of_chunk, entries) in chunks {
            plain.extend(of_chunk);
            given.append(entries);
        }
        check_entries::<C>(given.cells.len() as u64, &casters.params.limits)?;
        let has_planes = C > 1 || survey.kinds[SplatKind::Surface as usize] > 0;
        let tables = tables(casters);
        let footprints = casters.kernels.len() as u32;
        let limit = casters.params.absorbance_limit();
        Ok(Self {
            map,
            plain,
            given,
            channels: C as u32,
            has_planes,
            limit,
            lit_share: plan.lit.share,
            tables,
            footprints,
        })
    }

    /// Casters that the device deposits.
    pub fn casters(&self) -> u64 {
        self.plain.len() as u64
    }

    /// Entries that the processor made.
    pub fn given(&self) -> u64 {
        self.given.cells.len() as u64
    }

    /// An upper bound of the entries; the device counts them.
    pub fn expected(&self) -> u32 {
        // A device deposits what is not lit too.
        let predicted = (1.5 / self.lit_share * self.map.prediction().entries).min(f64::from(MOST_ENTRIES)) as u64;
        (self.given() + 4 * self.casters()).max(predicted).clamp(1, MOST_ENTRIES.into()) as u32
    }

    /// 1 when all casters absorb every channel alike, else 3.
    pub fn channels(&self) -> u32 {
        self.channels
    }
}

/// Extinction and whether it is of a thin slab; deviations of footprints.
fn tables(casters: &Casters<'_>) -> Vec<[f32; 4]> {
    let unknown = crate::building::caster::Extinction::default();
    let materials = casters.extinctions.iter().chain(std::iter::once(&unknown)).map(|e| {
        let [r, g, b] = e.rgb;
        [r, g, b, f32::from(u8::from(e.opacity == SurfaceOpacity::ThinSlab))]
    });
    materials.chain(casters.kernels.iter().map(|kernel| [kernel.deviation, 0.0, 0.0, 0.0])).collect()
}

/// One chunk of splats, those that are plain parted from the others, whose entries are made, in the form that [`pulp`] compiles
/// once per instruction set.
struct PartChunk<'a, M: Mapping, const C: usize> {
    casters: &'a Casters<'a>,
    plan: &'a Plan,
    deposit: Deposit<'a, M, C>,
    chunk: Range<usize>,
}

impl<M: Mapping, const C: usize> pulp::NullaryFnOnce for PartChunk<'_, M, C> {
    type Output = (Vec<u32>, Given);

    #[inline(always)]
    fn call(mut self) -> (Vec<u32>, Given) {
        let casters = self.casters;
        let mapping = self.deposit.mapping;
        let frame = &self.plan.frame;
        let mut plain = Vec::new();
        let mut others = Vec::new();
        if casters.has_opaque_discs() {
            let Scratch { media_batches, surface_batches, ids: [ids, ..], .. } = &mut *self.deposit.scratch;
            select(casters, self.chunk.clone(), SplatKind::Medium, ids);
            media_batches.part(mapping, self.plan.lit.wide(), casters, frame, ids, &mut plain, &mut others);
            select(casters, self.chunk.clone(), SplatKind::Surface, ids);
            surface_batches.part(mapping, casters, frame, ids, &mut plain, &mut others);
        } else {
            others.extend(self.chunk.filter(|&i| casters.casts(i)).map(|i| i as u32));
        }
        for &i in &others {
            self.deposit.add(&casters.get(i as usize, frame, mapping.is_parallel()));
        }
        let [columns, rows] = mapping.size();
        let mut given = Given::default();
        let Scratch { media, surfaces, .. } = &*self.deposit.scratch;
        given.add(media, 0);
        given.add(surfaces, columns * rows);
        (plain, given)
    }
}
