//! Translucent discs side by side: as media ([`crate::building::media`]), but each entry lies where its cell's ray meets the disc's
//! plane.

use crate::building::caster::Casters;
use crate::building::deposit::{WIDE, angle_gain, distance_on_plane};
use crate::building::discs::Discs;
use crate::building::entries::Cells;
use crate::building::lanes::{Columns, LANES, Lane, Queue, Queues, batches};
use crate::building::media::{AT, DISTANCE, FOOTPRINT, RGB, TOTAL, Target, plain_footprint};
use crate::building::overlap::Spread;
use crate::frame::Frame;
use crate::mapping::{Mapping, Ray};
use glam::Vec3;
use splat_core::glam;

/// Columns beyond those of a footprint: position and unit normal.
const POSITION: usize = FOOTPRINT;
const NORMAL: usize = POSITION + 3;
const SURFACE: usize = NORMAL + 3;

/// Surfaces of one worker on their way to entries.
#[derive(Debug, Default)]
pub(crate) struct SurfaceBatches {
    discs: Discs,
    footprints: Columns<SURFACE>,
    queues: Queues<SURFACE>,
}

#[cfg(feature = "gpu")]
impl SurfaceBatches {
    /// Parts surfaces that are plain from those that take another way; those that cover no cell are neither.
    #[inline(always)]
    pub(crate) fn part<M: Mapping>(
        &mut self,
        mapping: &M,
        casters: &Casters<'_>,
        frame: &Frame,
        ids: &[u32],
        plain: &mut Vec<u32>,
        others: &mut Vec<u32>,
    ) {
        for batch in batches(ids) {
            self.discs.load(casters, batch, frame, false);
            fill(&mut self.footprints, mapping, &self.discs, &deviations(casters, batch));
            self.footprints.part(batch, plain, others);
        }
    }
}

impl<M: Mapping, const C: usize> Target<'_, M, C> {
    /// Adds surfaces; those that are not plain go to `others`.
    #[inline(always)]
    pub(crate) fn add_surfaces(
        &mut self,
        casters: &Casters<'_>,
        frame: &Frame,
        ids: &[u32],
        work: &mut SurfaceBatches,
        others: &mut Vec<u32>,
    ) {
        let parallel = self.mapping.is_parallel();
        let SurfaceBatches { discs, footprints, queues } = work;
        for batch in batches(ids) {
            discs.load(casters, batch, frame, false);
            fill(footprints, self.mapping, discs, &deviations(casters, batch));
            for (l, &id) in batch.iter().enumerate() {
                let i = id as usize;
                let extinction = casters.extinction(i);
                let gain = angle_gain(discs.position(l), discs.normal(l), extinction.opacity, parallel);
                let distance = footprints.column[DISTANCE][l];
                let area = if parallel { 1.0 } else { distance * distance };
                footprints.set(TOTAL, l, [frame.area(casters.cloud.cross_section[i]) * gain / area]);
                footprints.set(RGB, l, extinction.rgb);
            }
            queues.push(footprints, batch, others);
            for queue in queues.ready(batch.is_empty()) {
                self.overlap(queue);
                queue.advance();
            }
        }
    }
}

#[inline(always)]
fn deviations(casters: &Casters<'_>, ids: &[u32]) -> Lane {
    let mut deviation = [1.0; LANES];
    deviation.iter_mut().zip(ids).for_each(|(to, id)| *to = casters.kernel(*id as usize).deviation);
    deviation
}

/// Footprints of discs on the table, but for the totals.
#[inline(always)]
fn fill<M: Mapping>(footprints: &mut Columns<SURFACE>, mapping: &M, discs: &Discs, deviation: &Lane) {
    let parallel = mapping.is_parallel();
    for l in 0..LANES {
        let position = discs.position(l);
        let view = mapping.view(position);
        let distance = view.place.distance;
        let spread = Spread::of_disc(discs.axes(l), view.gradients);
        let angle = if parallel { 0.0 } else { discs.radius(l) / distance };
        let (shape, side) = plain_footprint(mapping, WIDE, &view, spread, angle, deviation[l]);
        footprints.set(AT, l, shape);
        footprints.set(DISTANCE, l, [distance]);
        footprints.set(POSITION, l, position.to_array());
        footprints.set(NORMAL, l, discs.normal(l).to_array());
        footprints.side[l] = side;
    }
}

/// Distances of the entries of discs at `distance`, on their planes.
#[inline(always)]
pub(crate) fn plane_distances<M: Mapping, const F: usize>(
    mapping: &M,
    queue: &Queue<F>,
    cells: &Cells,
    distance: &Lane,
) -> Lane {
    let parallel = mapping.is_parallel();
    let width = mapping.size()[0];
    let read = |first: usize, l: usize| Vec3::from_array([0, 1, 2].map(|k| queue.column(first + k)[l]));
    let mut directions = [[0.0; LANES]; 3];
    let mut bases = [[0.0; LANES]; 3];
    let mut on_plane = [0.0; LANES];
    for l in (0..LANES).filter(|&l| cells.is_kept[l]) {
        let ray = mapping.ray_of(cells.cell[l] % width, cells.cell[l] / width);
        let base = ray.base.to_array();
        let direction = ray.direction.to_array();
        (0..3).for_each(|k| (bases[k][l], directions[k][l]) = (base[k], direction[k]));
    }
    for l in 0..LANES {
        let vector = |from: &[Lane; 3]| Vec3::new(from[0][l], from[1][l], from[2][l]);
        let ray = Ray { base: vector(&bases), direction: vector(&directions) };
        on_plane[l] = distance_on_plane(read(POSITION, l), read(NORMAL, l), distance[l], &ray, parallel);
    }
    on_plane
}
