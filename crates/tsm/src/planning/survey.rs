//! A survey of the casters, before any work: bounds, kinds, channels, sizes.

use crate::building::caster::Casters;
use crate::building::lanes::{LANES, Lane};
use glam::Vec3;
use rayon::prelude::*;
use splat_core::{Aabb, SplatKind, glam};
use std::ops::Range;

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
                let splats = c * CHUNK..n.min((c + 1) * CHUNK);
                pulp::Arch::new().dispatch(FirstLook { casters, splats })
            })
            .collect();
        parts.into_iter().fold(Self::EMPTY, Self::join)
    }

    /// Whether a translucent caster absorbs channels differently.
    fn is_coloured(casters: &Casters<'_>, i: usize) -> bool {
        let e = casters.extinction(i).rgb;
        casters.cloud.kind[i] != SplatKind::Opaque && casters.casts(i) && (e[0] != e[1] || e[1] != e[2])
    }

    fn join(mut self, other: Self) -> Self {
        self.casters += other.casters;
        (0..3).for_each(|k| self.kinds[k] += other.kinds[k]);
        self.bounds = self.bounds.union(other.bounds);
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

/// Place and size of [`LANES`] splats; a splat that throws no shadow has a negative radius.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) position: [Lane; 3],
    /// Radius of the part that throws the shadow, world units.
    pub(crate) radius: Lane,
    kind: Lane<u8>,
}

impl Block {
    #[inline(always)]
    pub(crate) fn new(casters: &Casters<'_>, splats: Range<usize>) -> Self {
        let cloud = casters.cloud;
        let nought = [0.0; LANES];
        let mut area = nought;
        let mut is_caster = [false; LANES];
        let mut block = Self { position: [nought; 3], radius: nought, kind: [0; LANES] };
        // Column by column and without indices, which compilers make vector instructions of.
        let [x, y, z] = &mut block.position;
        for (((p, x), y), z) in cloud.position[splats.clone()].iter().zip(x).zip(y).zip(z) {
            (*x, *y, *z) = (p.x, p.y, p.z);
        }
        block.radius.iter_mut().zip(&cloud.radius[splats.clone()]).for_each(|(to, from)| *to = *from);
        block.kind.iter_mut().zip(&cloud.kind[splats.clone()]).for_each(|(to, from)| *to = *from as u8);
        area.iter_mut().zip(&cloud.cross_section[splats.clone()]).for_each(|(to, from)| *to = *from);
        (0..LANES).for_each(|l| is_caster[l] = area[l] > 0.0);
        if casters.may_spare {
            splats.clone().zip(&mut is_caster).for_each(|(i, is_caster)| *is_caster = casters.casts(i));
        }
        if casters.has_opaque_discs() {
            for l in 0..LANES {
                let disc = casters.shadow_radius_of_area(area[l]);
                block.radius[l] = if block.kind[l] == SplatKind::Opaque as u8 { disc } else { block.radius[l] };
            }
        }
        if !cloud.tangent.is_empty() {
            // That of a medium is how far it is seen as a Gaussian; its shadow is that of a ball.
            let splats = block.radius.iter_mut().zip(&block.kind).zip(&cloud.tangent[splats]);
            for ((radius, _), tangent) in splats.filter(|((_, kind), _)| **kind != SplatKind::Medium as u8) {
                *radius = radius.max(tangent.length());
            }
        }
        (0..LANES).for_each(|l| block.radius[l] = if is_caster[l] { block.radius[l] } else { -1.0 });
        block
    }
}

/// The first look at one chunk of splats, in the form that [`pulp`] compiles once per instruction set.
struct FirstLook<'a> {
    casters: &'a Casters<'a>,
    splats: Range<usize>,
}

impl pulp::NullaryFnOnce for FirstLook<'_> {
    type Output = Survey;

    #[inline(always)]
    fn call(self) -> Survey {
        let mut survey = Survey::EMPTY;
        let mut low = [[f32::INFINITY; LANES]; 3];
        let mut high = [[f32::NEG_INFINITY; LANES]; 3];
        let mut most = [0.0; LANES];
        let mut media = [0.0f64; LANES];
        let mut kinds = [[0u16; LANES]; 3];
        for begin in self.splats.clone().step_by(LANES) {
            let splats = begin..self.splats.end.min(begin + LANES);
            let block = Block::new(self.casters, splats.clone());
            for l in 0..LANES {
                let is_caster = block.radius[l] >= 0.0;
                most[l] = greater(most[l], block.radius[l]);
                for k in 0..3 {
                    kinds[k][l] += u16::from(is_caster & (block.kind[l] == k as u8));
                    let p = block.position[k][l];
                    low[k][l] = if is_caster { lesser(low[k][l], p) } else { low[k][l] };
                    high[k][l] = if is_caster { greater(high[k][l], p) } else { high[k][l] };
                }
            }
            for (i, l) in splats.zip(0..LANES) {
                // A kernel has its radius, whatever its tangent.
                let is_medium = (block.radius[l] >= 0.0) & (block.kind[l] == SplatKind::Medium as u8);
                media[l] += f64::from(if is_medium { self.casters.cloud.radius[i] } else { 0.0 });
            }
        }
        if self.casters.may_colour {
            survey.coloured = self.splats.clone().any(|i| Survey::is_coloured(self.casters, i));
        }
        survey.kinds = kinds.map(|lane| lane.into_iter().map(u64::from).sum());
        survey.casters = survey.kinds.iter().sum();
        survey.bounds = Aabb { min: Vec3::from_array(low.map(least)), max: Vec3::from_array(high.map(greatest)) };
        survey.max_radius = greatest(most);
        survey.medium_radius_sum = media.iter().sum();
        survey
    }
}

/// Two instructions where `min` and `max` take more to treat NaN.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
pub(crate) fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

pub(crate) fn least(lane: Lane) -> f32 {
    lane.into_iter().fold(f32::INFINITY, lesser)
}

pub(crate) fn greatest(lane: Lane) -> f32 {
    lane.into_iter().fold(f32::NEG_INFINITY, greater)
}
