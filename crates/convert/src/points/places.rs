//! Estimates at each distinct place of raw points: normal, area and spacing, from its neighbours.

use crate::common::convert_error::check_cancelled;
use crate::points::cell_ellipse::ellipse;
use crate::points::discs::DiscShape;
use crate::points::neighbours::{MAX_NEIGHBOURS, MAX_WAITING, Nearest, Tree, WIDTH, Waiting};
use crate::points::orient;
use crate::points::tangent_plane::{Offset, fit_planes};
use crate::points::voronoi_cell::voronoi_sides;
use crate::{ConvertError, SurfelParams};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::{DVec3, Vec3};

/// Leaves of the tree per parallel task; fixed, so that results do not depend on the thread count.
const LEAVES: usize = 64;

/// One place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Place {
    pub(crate) normal: Vec3,
    /// Whether its neighbours lie on a plane: [`Place::LINE`], [`Place::PLANE`] or [`Place::SCATTERED`].
    pub(crate) plane: u32,
    /// Object units².
    pub(crate) area: f64,
    /// Object units.
    pub(crate) spacing: f64,
    /// The spacing along the way in which others lie farthest apart, object units; zero where that is `spacing` in all directions.
    pub(crate) long: Vec3,
    /// The one across it.
    pub(crate) across: f32,
}

impl Place {
    /// The normal is a guess: the neighbours lie on a line, or there are none.
    pub(crate) const LINE: u32 = 0;
    /// They lie near a plane.
    pub(crate) const PLANE: u32 = 1;
    /// They lie about as far from the plane as along it.
    pub(crate) const SCATTERED: u32 = 2;
}

#[cfg(feature = "cache")]
impl Place {
    /// Whether a place of finite points can be so.
    pub(crate) fn is_valid(&self) -> bool {
        let is_length = |length: f64| length.is_finite() && length >= 0.0;
        let lengths = [self.area, self.spacing, f64::from(self.across)];
        (self.normal.is_normalized() || self.normal == Vec3::ZERO)
            && self.plane <= Self::SCATTERED
            && lengths.into_iter().all(is_length)
            && self.long.is_finite()
    }
}

/// The neighbours of every place, as many of each.
#[derive(Debug, Default)]
pub(crate) struct Neighbours {
    /// From near to far, place by place.
    pub(crate) ids: Vec<u32>,
    pub(crate) of_each: usize,
}

impl Neighbours {
    /// The neighbours of one place.
    pub(crate) fn around(&self, place: u32) -> &[u32] {
        let first = place as usize * self.of_each;
        &self.ids[first..first + self.of_each]
    }
}

/// The places of points; and their neighbours where they are to be kept.
pub(crate) fn places(
    distinct: &[Vec3],
    params: &SurfelParams,
    keep_neighbours: bool,
    progress: &Progress,
) -> Result<(Vec<Place>, Neighbours), ConvertError> {
    progress.add_total(distinct.len() as u64);
    let tree = Tree::new(distinct, progress);
    let mut places = vec![Place::default(); distinct.len()];
    let of_each = params.neighbours.min(distinct.len().saturating_sub(1));
    let kept_of_each = if keep_neighbours { of_each } else { 0 };
    let mut ids = vec![0u32; kept_of_each * distinct.len()];
    let mut rest = &mut ids[..];
    let mut tasks = Vec::with_capacity(distinct.len().div_ceil(LEAVES * WIDTH));
    for (chunk, out) in places.chunks_mut(LEAVES * WIDTH).enumerate() {
        let (kept, behind) = std::mem::take(&mut rest).split_at_mut(kept_of_each * out.len());
        rest = behind;
        tasks.push(Task { tree: &tree, distinct, params, first: chunk * LEAVES, kept, out });
    }
    tasks.into_par_iter().for_each(|task| {
        if progress.tick(task.out.len() as u64).is_ok() {
            pulp::Arch::new().dispatch(task);
        }
    });
    check_cancelled(progress)?;
    Ok((tree.by_point(places, 1), Neighbours { ids: tree.by_point(ids, kept_of_each), of_each }))
}

/// The places of some leaves, in the form that [`pulp`] compiles once per instruction set.
struct Task<'a> {
    tree: &'a Tree,
    distinct: &'a [Vec3],
    params: &'a SurfelParams,
    /// First leaf.
    first: usize,
    /// The neighbours of each, as many of each; empty where none are kept.
    kept: &'a mut [u32],
    out: &'a mut [Place],
}

impl pulp::NullaryFnOnce for Task<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let mut nearest = Nearest::default();
        let mut stack = [Waiting::default(); MAX_WAITING];
        let mut offsets = [[[0.0; WIDTH]; 3]; MAX_NEIGHBOURS];
        let count = self.params.neighbours.min(self.distinct.len() - 1);
        let kept_of_each = self.kept.len() / self.out.len();
        for (l, out) in self.out.chunks_mut(WIDTH).enumerate() {
            let leaf = self.first + l;
            self.tree.nearest(leaf, self.params.neighbours, &mut nearest, &mut stack);
            let first = self.tree.slots_of(leaf).start;
            for (j, offset) in offsets[..count].iter_mut().enumerate() {
                for slot in 0..WIDTH {
                    // Lanes without a point are those of the first again.
                    let lane = if slot < out.len() { slot } else { 0 };
                    let at = self.distinct[self.tree.point(first + lane)];
                    let to = self.distinct[nearest.id(j, lane) as usize] - at;
                    (offset[0][slot], offset[1][slot], offset[2][slot]) = (to.x, to.y, to.z);
                }
            }
            leaf_places(&offsets[..count], self.params, out);
            if kept_of_each > 0 {
                for slot in 0..out.len() {
                    for j in 0..count {
                        self.kept[(l * WIDTH + slot) * count + j] = nearest.id(j, slot);
                    }
                }
            }
        }
    }
}

/// The places of a leaf whose points have neighbours at `offsets`, from near to far.
#[inline(always)]
fn leaf_places(offsets: &[Offset], params: &SurfelParams, out: &mut [Place]) {
    let Some(farthest) = offsets.last() else {
        let spacing = params.lone_spacing / params.splat.transform.scale;
        let normal = orient::guess(params.orientation, DVec3::ZERO).as_vec3();
        out.fill(Place { normal, plane: Place::LINE, area: spacing * spacing, spacing, ..Place::default() });
        return;
    };
    let planes = fit_planes(offsets);
    let mut normals = [DVec3::ZERO; WIDTH];
    for i in 0..WIDTH {
        let line = || DVec3::new(farthest[0][i].into(), farthest[1][i].into(), farthest[2][i].into());
        normals[i] = planes[i].map_or_else(|| orient::guess(params.orientation, line()), |plane| plane.normal);
    }
    let lines = voronoi_sides(offsets, &normals);
    let cells = lines.cells();
    for (i, out) in out.iter_mut().enumerate() {
        let area = cells.area[i];
        let root = area.sqrt();
        let spacing = (std::f64::consts::SQRT_2 * cells.reach[i]).clamp(root, 2.0 * root);
        let normal = normals[i].as_vec3();
        let plane = match planes[i] {
            None => Place::LINE,
            Some(plane) if plane.is_scattered => Place::SCATTERED,
            Some(_) => Place::PLANE,
        };
        let (long, across) = match params.shape {
            DiscShape::Round | DiscShape::Balls => (Vec3::ZERO, 0.0),
            DiscShape::Elliptical => {
                let (long, across) = ellipse(&lines, &cells, i, spacing);
                (long.as_vec3(), across as f32)
            }
        };
        *out = Place { normal, plane, area, spacing, long, across };
    }
}
