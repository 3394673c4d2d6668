//! The pieces of a mesh's triangles, written into the columns of a cloud.

use crate::common::columns::{self, CHUNK};
use crate::common::convert_error::check_cancelled;
use crate::mesh::mesh_points::{Plan, plane};
use crate::mesh::subdivide::{self, Run, Split};
use crate::mesh::surface_colors::SurfaceColors;
use crate::{ConvertError, MeshParams};
use rayon::prelude::*;
use splat_core::{
    Cloud, Mesh, Progress, SplatKind,
    glam::{DQuat, Vec2, Vec3, Vec3Swizzles},
    optics,
};
use std::ops::Range;

/// Most pieces along an edge whose weights are tabulated; beyond, rows are long enough to be written one by one.
const TABULATED: u32 = 32;

/// Everything that the pieces are made from.
pub(crate) struct Pieces<'a> {
    mesh: &'a Mesh,
    plan: &'a Plan,
    /// Colours of parts of triangles; `None` where those of vertices are interpolated.
    colors: Option<&'a dyn SurfaceColors>,
    /// Vertices relative to the cloud's origin.
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    /// Spacing in the mesh's units.
    spacing: f64,
    /// Factor from a share of the mesh's area to K; to an area where vertices have opacities.
    depth: f64,
    /// Opacity of one crossing where that of the vertices is 1.
    opacity: f64,
    radius: f32,
    color: [f32; 3],
    rotation: DQuat,
    /// For k pieces along an edge, the weights of corners 1 and 2 of all k² pieces, in the order of the runs.
    weights: Vec<Vec<[f32; 2]>>,
}

/// The columns that one task writes.
struct Target<'a> {
    position: &'a mut [Vec3],
    normal: &'a mut [Vec3],
    /// Empty where no triangle has normals that lean from it.
    shading_normal: &'a mut [Vec3],
    cross_section: &'a mut [f32],
    color: &'a mut [[f32; 3]],
    /// Empty for a mesh without opacities.
    opacity: &'a mut [f32],
}

/// Least optical depth of one crossing where vertices take all opacity away: none to the eye, and yet the layer of a surface.
const CLEAR: f64 = 1e-30;

impl<'a> Pieces<'a> {
    pub(crate) fn new(
        mesh: &'a Mesh,
        params: &MeshParams,
        plan: &'a Plan,
        colors: Option<&'a dyn SurfaceColors>,
    ) -> Self {
        let t = &params.splat.transform;
        let place = |v: &Vec3| (t.rotation * (v.as_dvec3() * t.scale)).as_vec3();
        let turn = |n: &Vec3| columns::unit_or_zero(t.rotate(n.as_dvec3()).as_vec3());
        let is_even = params.opacity < 1.0 && mesh.opacity.is_empty();
        let tau = if is_even { optics::optical_depth(params.opacity) } else { 1.0 };
        Self {
            mesh,
            plan,
            colors,
            position: mesh.position.par_iter().with_min_len(CHUNK).map(place).collect(),
            normal: plan.normal.par_iter().with_min_len(CHUNK).map(turn).collect(),
            spacing: plan.report.spacing / t.scale,
            depth: tau * t.scale * t.scale,
            opacity: params.opacity,
            radius: plan.report.radius as f32,
            color: params.splat.color,
            rotation: t.rotation,
            weights: (0..=TABULATED).map(weights).collect(),
        }
    }

    /// An edge relative to the cloud's origin.
    pub(crate) fn place(&self, edge: &[u32; 2]) -> [Vec3; 2] {
        edge.map(|v| self.position[v as usize])
    }

    /// Fills the columns in tasks of [`CHUNK`] splats, wherever triangles begin: one huge triangle is shared too.
    pub(crate) fn emit(&self, cloud: &mut Cloud, progress: &Progress) -> Result<(), ConvertError> {
        let columns = (cloud.position.par_chunks_mut(CHUNK), cloud.normal.par_chunks_mut(CHUNK));
        let rest = (cloud.cross_section.par_chunks_mut(CHUNK), cloud.color.par_chunks_mut(CHUNK));
        let mut shading: Vec<&mut [Vec3]> = cloud.shading_normal.chunks_mut(CHUNK).collect();
        shading.resize_with(cloud.radius.len().div_ceil(CHUNK), Default::default);
        let has_opacity = !self.mesh.opacity.is_empty();
        let opacities = if has_opacity { &mut cloud.crossing_depth[..] } else { &mut [] };
        let mut opacities: Vec<&mut [f32]> = opacities.chunks_mut(CHUNK).collect();
        opacities.resize_with(cloud.radius.len().div_ceil(CHUNK), Default::default);
        (columns.0, columns.1, shading, rest.0, rest.1, opacities, cloud.radius.par_chunks_mut(CHUNK))
            .into_par_iter()
            .enumerate()
            .for_each(|(chunk, (position, normal, shading_normal, cross_section, color, opacity, radius))| {
                if progress.tick(radius.len() as u64).is_err() {
                    return;
                }
                radius.fill(self.radius);
                if self.mesh.color.is_empty() && self.colors.is_none() {
                    color.fill(self.color);
                }
                let target = Target { position, normal, shading_normal, cross_section, color, opacity };
                pulp::Arch::new().dispatch(Fill { pieces: self, first: (chunk * CHUNK) as u64, target });
            });
        if has_opacity {
            self.fade(cloud);
        }
        check_cancelled(progress)
    }

    /// Turns areas and opacities of vertices, which the columns hold so far, into K and optical depths of one crossing.
    fn fade(&self, cloud: &mut Cloud) {
        let least = if self.opacity > 0.0 { CLEAR } else { 0.0 };
        let depths = cloud.cross_section.par_iter_mut().zip(cloud.crossing_depth.par_iter_mut());
        depths.zip(cloud.kind.par_iter_mut()).with_min_len(CHUNK).for_each(|((cross_section, crossing), kind)| {
            let opacity = self.opacity * f64::from(*crossing);
            if opacity < 1.0 {
                let depth = optics::optical_depth(opacity).max(least);
                *cross_section = (depth * f64::from(*cross_section)) as f32;
                *crossing = depth as f32;
            } else {
                *kind = SplatKind::Opaque;
                *crossing = 0.0;
            }
        });
    }
}

/// The splats from number `first` on, in the form that [`pulp`] compiles once per instruction set.
struct Fill<'a> {
    pieces: &'a Pieces<'a>,
    first: u64,
    target: Target<'a>,
}

impl pulp::NullaryFnOnce for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pieces, first, mut target } = self;
        let mut triangle = pieces.plan.starts.partition_point(|&s| s <= first) - 1;
        let mut skip = first - pieces.plan.starts[triangle];
        let mut written = 0;
        while written < target.position.len() {
            let left = (pieces.plan.starts[triangle + 1] - pieces.plan.starts[triangle] - skip) as usize;
            let end = target.position.len().min(written + left);
            if end > written {
                let split = subdivide::split(&pieces.plan.measures[triangle], pieces.spacing);
                let corner = Corners::new(pieces, triangle);
                match split {
                    Split::Congruent(k) if k <= TABULATED => {
                        let weights = &pieces.weights[k as usize][skip as usize..][..end - written];
                        let share = 1.0 / f64::from(k * k);
                        corner.write_table(weights, share, written..end, &mut target);
                    }
                    split => corner.write_runs(&split, skip, written..end, &mut target),
                }
            }
            (written, skip) = (end, 0);
            triangle += 1;
        }
    }
}

/// Weights of corners 1 and 2 of k² congruent pieces.
fn weights(k: u32) -> Vec<[f32; 2]> {
    let split = if k == 0 { Split::None } else { Split::Congruent(k) };
    let runs = (0..split.runs()).map(|i| split.run(i));
    let piece = |run: &Run, j: u32| run.start.as_vec3() + run.step.as_vec3() * j as f32;
    runs.flat_map(|run| (0..run.count).map(move |j| piece(&run, j)).map(|w| [w.y, w.z])).collect()
}

/// One triangle as affine functions of its barycentric weights.
struct Corners<'a> {
    /// Its rank, with the colours of its parts.
    painted: Option<(usize, &'a dyn SurfaceColors)>,
    position: [Vec3; 3],
    normal: [Vec3; 3],
    color: Option<[Vec3; 3]>,
    opacity: Option<[f32; 3]>,
    /// Normal of the plane, on the side of the vertex normals.
    plane: Vec3,
    /// Whether its discs lie in the plane, since normals lean.
    is_flat: bool,
    /// K of the whole triangle.
    depth: f64,
}

impl<'a> Corners<'a> {
    fn new(pieces: &Pieces<'a>, triangle: usize) -> Self {
        let ids = pieces.mesh.triangles[triangle].map(|v| v as usize);
        let position = ids.map(|v| pieces.position[v]);
        let face = plane(pieces.mesh, triangle);
        let plane = (pieces.rotation * face).as_vec3();
        let normal = ids.map(|v| if pieces.normal[v] == Vec3::ZERO { plane } else { pieces.normal[v] });
        let is_flat = pieces.plan.is_flat(pieces.mesh, triangle, face);
        let plane = if normal.iter().sum::<Vec3>().dot(plane) < 0.0 { -plane } else { plane };
        let is_colored = !pieces.mesh.color.is_empty() && pieces.colors.is_none();
        let color = is_colored.then(|| ids.map(|v| Vec3::from(pieces.mesh.color[v])));
        let opacity = (!pieces.mesh.opacity.is_empty()).then(|| ids.map(|v| pieces.mesh.opacity[v]));
        Self {
            painted: pieces.colors.map(|colors| (triangle, colors)),
            position,
            normal,
            color,
            opacity,
            plane,
            is_flat,
            depth: pieces.depth * pieces.plan.measures[triangle].area,
        }
    }

    /// Writes pieces of one share of the area, given by their weights of corners 1 and 2.
    #[inline(always)]
    fn write_table(&self, weights: &[[f32; 2]], share: f64, range: Range<usize>, target: &mut Target<'_>) {
        let edges = |v: &[Vec3; 3]| (v[0], v[1] - v[0], v[2] - v[0]);
        let (from, e1, e2) = edges(&self.position);
        for (p, w) in target.position[range.clone()].iter_mut().zip(weights) {
            *p = from + e1 * w[0] + e2 * w[1];
        }
        let (from, e1, e2) = edges(&self.normal);
        for (n, w) in self.normals(range.clone(), target).iter_mut().zip(weights) {
            *n = self.unit(from + e1 * w[0] + e2 * w[1]);
        }
        if let Some(color) = &self.color {
            let (from, e1, e2) = edges(color);
            for (c, w) in target.color[range.clone()].iter_mut().zip(weights) {
                *c = (from + e1 * w[0] + e2 * w[1]).max(Vec3::ZERO).to_array();
            }
        }
        if let Some((triangle, colors)) = self.painted {
            let mut places = weights.iter().map(|w| Vec2::from(*w));
            colors.fill(triangle, share, &mut places, &mut target.color[range.clone()]);
        }
        if let Some([a, b, c]) = self.opacity {
            for (opacity, w) in target.opacity[range.clone()].iter_mut().zip(weights) {
                *opacity = (a + (b - a) * w[0] + (c - a) * w[1]).clamp(0.0, 1.0);
            }
        }
        target.cross_section[range].fill((self.depth * share) as f32);
    }

    /// Where interpolated normals go.
    #[inline(always)]
    fn normals<'t>(&self, range: Range<usize>, target: &'t mut Target<'_>) -> &'t mut [Vec3] {
        if self.is_flat {
            target.normal[range.clone()].fill(self.plane);
            return &mut target.shading_normal[range];
        }
        if !target.shading_normal.is_empty() {
            target.shading_normal[range.clone()].fill(Vec3::ZERO);
        }
        &mut target.normal[range]
    }

    /// Opposite vertex normals cancel on the way from one to the other.
    #[inline(always)]
    fn unit(&self, sum: Vec3) -> Vec3 {
        let length_sq = sum.length_squared();
        if length_sq > 1e-6 { sum * (1.0 / length_sq.sqrt()) } else { self.plane }
    }

    /// Writes the pieces of a split from piece `skip` on.
    #[inline(always)]
    fn write_runs(&self, split: &Split, mut skip: u64, range: Range<usize>, target: &mut Target<'_>) {
        let mut written = range.start;
        for i in 0..split.runs() {
            let run = split.run(i);
            if skip >= u64::from(run.count) {
                skip -= u64::from(run.count);
                continue;
            }
            let end = range.end.min(written + (u64::from(run.count) - skip) as usize);
            self.write_run(&run, skip as f32, written..end, target);
            (written, skip) = (end, 0);
            if written == range.end {
                break;
            }
        }
    }

    /// Writes the pieces of a run from piece `skip` on.
    #[inline(always)]
    fn write_run(&self, run: &Run, skip: f32, range: Range<usize>, target: &mut Target<'_>) {
        let start = run.start.as_vec3();
        let step = run.step.as_vec3();
        let line = |v: &[Vec3; 3]| {
            let e1 = v[1] - v[0];
            let e2 = v[2] - v[0];
            (v[0] + e1 * start.y + e2 * start.z, e1 * step.y + e2 * step.z)
        };
        let (from, along) = line(&self.position);
        for (j, p) in target.position[range.clone()].iter_mut().enumerate() {
            *p = from + along * (j as f32 + skip);
        }
        let (from, along) = line(&self.normal);
        for (j, n) in self.normals(range.clone(), target).iter_mut().enumerate() {
            *n = self.unit(from + along * (j as f32 + skip));
        }
        if let Some(color) = &self.color {
            let (from, along) = line(color);
            for (j, c) in target.color[range.clone()].iter_mut().enumerate() {
                *c = (from + along * (j as f32 + skip)).max(Vec3::ZERO).to_array();
            }
        }
        if let Some((triangle, colors)) = self.painted {
            let place = |j: usize| (start + step * (j as f32 + skip)).yz();
            let mut places = (0..range.len()).map(place);
            colors.fill(triangle, run.share, &mut places, &mut target.color[range.clone()]);
        }
        if let Some([a, b, c]) = self.opacity {
            let from = a + (b - a) * start.y + (c - a) * start.z;
            let along = (b - a) * step.y + (c - a) * step.z;
            for (j, opacity) in target.opacity[range.clone()].iter_mut().enumerate() {
                *opacity = (from + along * (j as f32 + skip)).clamp(0.0, 1.0);
            }
        }
        target.cross_section[range].fill((self.depth * run.share) as f32);
    }
}
