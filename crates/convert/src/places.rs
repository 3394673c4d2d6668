//! What is known about each distinct place of raw points: normal, area and spacing, from its neighbours.

use crate::convert_error::check_cancelled;
use crate::neighbours::{MAX_NEIGHBOURS, MAX_WAITING, Nearest, Tree, WIDTH, Waiting};
use crate::orient::{self, Orientation};
use crate::tangent_plane::{self, Cell, Polygon};
use crate::{ConvertError, SurfelParams};
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::{DVec3, Vec3};

/// Leaves of the tree per parallel task; fixed, so that results do not depend on the thread count.
const LEAVES: usize = 64;

/// One place.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Place {
    pub(crate) normal: DVec3,
    /// False for a guess.
    pub(crate) plane: bool,
    /// Object units².
    pub(crate) area: f64,
    /// Object units.
    pub(crate) spacing: f64,
}

/// The places of points in Morton order; and their neighbours by leaf of eight, where normals are to be propagated.
pub(crate) fn places(
    distinct: &[Vec3],
    params: &SurfelParams,
    progress: &Progress,
) -> Result<(Vec<Place>, Vec<Nearest>), ConvertError> {
    progress.add_total(distinct.len() as u64);
    let keep_neighbours = params.orientation == Orientation::Propagate;
    let tree = Tree::new(distinct);
    let mut places = vec![Place::default(); distinct.len()];
    let chunk = LEAVES * WIDTH;
    let kept: Vec<Vec<Nearest>> = places
        .par_chunks_mut(chunk)
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
    Ok((places, kept.concat()))
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
    type Output = Vec<Nearest>;

    #[inline(always)]
    fn call(self) -> Vec<Nearest> {
        let (mut kept, mut nearest, mut scratch) = (Vec::new(), Nearest::default(), Scratch::default());
        let mut stack = [Waiting::default(); MAX_WAITING];
        for (l, out) in self.out.chunks_mut(WIDTH).enumerate() {
            let leaf = self.first + l;
            self.tree.nearest(leaf, self.params.neighbours, &mut nearest, &mut stack);
            for (slot, (out, i)) in out.iter_mut().zip(self.tree.points_of(leaf)).enumerate() {
                *out = place(&nearest, slot, self.distinct, i, self.params, &mut scratch);
            }
            if self.keep_neighbours {
                kept.push(nearest);
            }
        }
        kept
    }
}

/// Memory of one task.
struct Scratch {
    /// The place itself, then its neighbours from near to far, relative to it.
    offsets: [DVec3; MAX_NEIGHBOURS + 1],
    polygons: [Polygon; 2],
}

impl Default for Scratch {
    fn default() -> Self {
        Self { offsets: [DVec3::ZERO; MAX_NEIGHBOURS + 1], polygons: [Polygon::default(); 2] }
    }
}

#[inline(always)]
fn place(
    nearest: &Nearest,
    slot: usize,
    distinct: &[Vec3],
    i: usize,
    params: &SurfelParams,
    scratch: &mut Scratch,
) -> Place {
    let Scratch { offsets, polygons } = scratch;
    let mut n = 1;
    for id in nearest.ids(slot) {
        offsets[n] = distinct[id as usize].as_dvec3() - distinct[i].as_dvec3();
        n += 1;
    }
    if n == 1 {
        let spacing = params.lone_spacing / params.splat.transform.scale;
        let normal = orient::guess(params.orientation, DVec3::ZERO);
        return Place { normal, plane: false, area: spacing * spacing, spacing };
    }
    let fitted = tangent_plane::fit_normal(&offsets[..n]);
    let normal = fitted.unwrap_or_else(|| orient::guess(params.orientation, offsets[n - 1]));
    let Cell { area, reach } = tangent_plane::voronoi_cell(&offsets[1..n], normal, polygons);
    let root = area.sqrt();
    let spacing = (std::f64::consts::SQRT_2 * reach).clamp(root, 2.0 * root);
    Place { normal, plane: fitted.is_some(), area, spacing }
}
