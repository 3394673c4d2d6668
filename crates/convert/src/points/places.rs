//! What is known about each distinct place of raw points: normal, area and spacing, from its neighbours.

use crate::common::convert_error::check_cancelled;
use crate::points::cell_ellipse::ellipse;
use crate::points::discs::DiscShape;
use crate::points::neighbours::{MAX_NEIGHBOURS, MAX_WAITING, Nearest, Tree, WIDTH, Waiting};
use crate::points::orient::{self, Orientation};
use crate::points::tangent_plane::{Offset, fit_normals};
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
    /// 0 for a guess, else 1.
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

#[cfg(feature = "cache")]
impl Place {
    /// Whether a place of finite points can be so.
    pub(crate) fn is_valid(&self) -> bool {
        let is_length = |length: f64| length.is_finite() && length >= 0.0;
        let lengths = [self.area, self.spacing, f64::from(self.across)];
        (self.normal.is_normalized() || self.normal == Vec3::ZERO)
            && self.plane <= 1
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

/// The places of points in Morton order; and their neighbours where normals are to be propagated.
pub(crate) fn places(
    distinct: &[Vec3],
    params: &SurfelParams,
    progress: &Progress,
) -> Result<(Vec<Place>, Neighbours), ConvertError> {
    progress.add_total(distinct.len() as u64);
    let keep_neighbours = params.orientation == Orientation::Propagate;
    let tree = Tree::new(distinct);
    let mut places = vec![Place::default(); distinct.len()];
    let kept: Vec<Vec<u32>> = places
        .par_chunks_mut(LEAVES * WIDTH)
        .enumerate()
        .map(|(c, out)| {
            if progress.tick(out.len() as u64).is_err() {
                return Vec::new();
            }
            let task = Task { tree: &tree, distinct, params, first: c * LEAVES, keep_neighbours, out };
            pulp::Arch::new().dispatch(task)
        })
        .collect();
    check_cancelled(progress)?;
    let of_each = params.neighbours.min(distinct.len().saturating_sub(1));
    Ok((places, Neighbours { ids: kept.concat(), of_each }))
}

/// The places of some leaves, in the form that [`pulp`] compiles once per instruction set.
struct Task<'a> {
    tree: &'a Tree,
    distinct: &'a [Vec3],
    params: &'a SurfelParams,
    /// First leaf.
    first: usize,
    keep_neighbours: bool,
    out: &'a mut [Place],
}

impl pulp::NullaryFnOnce for Task<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn call(self) -> Vec<u32> {
        let mut kept = Vec::new();
        let mut nearest = Nearest::default();
        let mut stack = [Waiting::default(); MAX_WAITING];
        let mut offsets = [[[0.0; WIDTH]; 3]; MAX_NEIGHBOURS];
        let count = self.params.neighbours.min(self.distinct.len() - 1);
        for (l, out) in self.out.chunks_mut(WIDTH).enumerate() {
            let leaf = self.first + l;
            self.tree.nearest(leaf, self.params.neighbours, &mut nearest, &mut stack);
            let points = self.tree.points_of(leaf);
            for (j, offset) in offsets[..count].iter_mut().enumerate() {
                for slot in 0..WIDTH {
                    // Lanes without a point are those of the first again.
                    let at = self.distinct[if slot < out.len() { points.start + slot } else { points.start }];
                    let to = self.distinct[nearest.id(j, slot) as usize] - at;
                    (offset[0][slot], offset[1][slot], offset[2][slot]) = (to.x, to.y, to.z);
                }
            }
            leaf_places(&offsets[..count], self.params, out);
            if self.keep_neighbours {
                kept.extend(
                    (0..out.len())
                        .flat_map(|slot| (0..count).map(move |j| (j, slot)))
                        .map(|(j, slot)| nearest.id(j, slot)),
                );
            }
        }
        kept
    }
}

/// The places of a leaf whose points have neighbours at `offsets`, from near to far.
#[inline(always)]
fn leaf_places(offsets: &[Offset], params: &SurfelParams, out: &mut [Place]) {
    let Some(farthest) = offsets.last() else {
        let spacing = params.lone_spacing / params.splat.transform.scale;
        let normal = orient::guess(params.orientation, DVec3::ZERO).as_vec3();
        out.fill(Place { normal, plane: 0, area: spacing * spacing, spacing, ..Place::default() });
        return;
    };
    let planes = fit_normals(offsets);
    let mut normals = [DVec3::ZERO; WIDTH];
    for i in 0..WIDTH {
        let line = || DVec3::new(farthest[0][i].into(), farthest[1][i].into(), farthest[2][i].into());
        normals[i] = planes[i].unwrap_or_else(|| orient::guess(params.orientation, line()));
    }
    let lines = voronoi_sides(offsets, &normals);
    let cells = lines.cells();
    for (i, out) in out.iter_mut().enumerate() {
        let (area, root) = (cells.area[i], cells.area[i].sqrt());
        let spacing = (std::f64::consts::SQRT_2 * cells.reach[i]).clamp(root, 2.0 * root);
        let normal = normals[i].as_vec3();
        let plane = planes[i].is_some().into();
        let (long, across) = match params.shape {
            DiscShape::Round => (Vec3::ZERO, 0.0),
            DiscShape::Elliptical => {
                let (long, across) = ellipse(&lines, &cells, i, spacing);
                (long.as_vec3(), across as f32)
            }
        };
        *out = Place { normal, plane, area, spacing, long, across };
    }
}
