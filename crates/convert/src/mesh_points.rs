//! Meshes become disc splats: Gunjee 2007, section 4, "Converting the polygonal models".
//!
//! Every triangle is split into pieces of at most h² (see `subdivide.rs`); each piece becomes one disc at its
//! centroid that stands for the piece's area a: K = τ₁·a for a translucent surface (τ₁ = −ln(1 − α) of one crossing),
//! K = a for an opaque one. All discs of an object have the radius R = cutoff·0.8·h. So Σ a·norm/R²·profile is a
//! quadrature of ∫ norm/R²·profile dA = 1 over the surface: splitting finer or coarser leaves the transmittance alone.
//!
//! Deviation from the paper: it gives each piece the opacity of the surface, which multiplies where discs overlap.

use crate::columns::{self, CHUNK, Wanted};
use crate::params::{Density, SplatParams};
use crate::subdivide::{self, Measure, Run};
use crate::{ConvertError, vertex_normals};
use rayon::prelude::*;
use splat_core::{
    Cloud, Mesh, SplatKind,
    glam::{DQuat, DVec3, Vec3},
    optics,
};

/// How a mesh becomes splats.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshParams {
    /// Attributes and limits.
    pub splat: SplatParams,
    /// Largest spacing h, world units. [`Density::Auto`] takes 1/400 of the diagonal or the mean triangle's √area,
    /// whichever is smaller, but not more than four million splats. With [`Density::Splats`] the count is met
    /// within some percent where the triangles are not finer.
    pub density: Density,
    /// Opacity α of one crossing, in \[0, 1\]; 1 makes the surface opaque, 0 leaves nothing.
    pub opacity: f64,
}

impl Default for MeshParams {
    fn default() -> Self {
        Self { splat: SplatParams::default(), density: Density::Auto, opacity: 1.0 }
    }
}

/// What the conversion of a mesh did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshReport {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Triangles without area, which became nothing.
    pub degenerate: u64,
    /// Splats made.
    pub splats: u64,
    /// Area of the mesh, world units².
    pub area: f64,
    /// Spacing h, world units; 0 for an empty mesh.
    pub spacing: f64,
    /// Cutoff radius of every splat, world units; 0 for an empty mesh.
    pub radius: f64,
    /// Whether normals came from the triangles because the mesh has none.
    pub normals_computed: bool,
}

/// Share of the diagonal that is the automatic spacing, and the automatic budget.
const AUTO_STEPS: f64 = 400.0;
const AUTO_SPLATS: f64 = 4e6;

/// Makes a new cloud from a mesh, see [`mesh_to_points_into`].
///
/// ```
/// use convert::{Density, MeshParams, mesh_to_points};
/// use splat_core::{Mesh, glam::Vec3};
/// let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
/// let params = MeshParams { density: Density::Spacing(0.1), opacity: 0.5, ..MeshParams::default() };
/// let (cloud, report) = mesh_to_points(&mesh, &params).unwrap();
/// let depth: f32 = cloud.cross_section.iter().sum();
/// assert!((depth - 0.5 * 2.0_f32.ln()).abs() < 1e-5);
/// assert_eq!(report.splats, 64);
/// ```
///
/// # Errors
/// As [`mesh_to_points_into`].
pub fn mesh_to_points(mesh: &Mesh, params: &MeshParams) -> Result<(Cloud, MeshReport), ConvertError> {
    let mut cloud = Cloud::default();
    let report = mesh_to_points_into(mesh, params, &mut cloud)?;
    Ok((cloud, report))
}

/// Replaces the content of `cloud` by the splats of a mesh; its memory is used again. The cloud's origin is the mesh's,
/// transformed, so a mesh far away gives the same offsets as one at 0.
///
/// # Errors
/// [`ConvertError::Parameter`] and [`ConvertError::Input`] for what breaks a promise, [`ConvertError::TooMany`] before
/// any memory is taken.
pub fn mesh_to_points_into(mesh: &Mesh, params: &MeshParams, cloud: &mut Cloud) -> Result<MeshReport, ConvertError> {
    let p = &params.splat;
    p.check()?;
    mesh.validate().map_err(|e| p.input(e))?;
    if !(0.0..=1.0).contains(&params.opacity) {
        return Err(p.bad("opacity", params.opacity, "a number in [0, 1]"));
    }
    let measures: Vec<Measure> =
        mesh.triangles.par_iter().with_min_len(4096).map(|t| subdivide::measure(corners(mesh, t))).collect();
    let scale = p.transform.scale;
    let area: f64 = measures.iter().map(|m| m.area).sum::<f64>() * scale * scale;
    let mut report = MeshReport {
        triangles: mesh.triangles.len() as u64,
        degenerate: measures.iter().filter(|m| m.area == 0.0).count() as u64,
        area,
        ..MeshReport::default()
    };
    cloud.origin = p.transform.apply(mesh.origin);
    if area == 0.0 || params.opacity == 0.0 {
        return columns::size_columns(cloud, 0, SplatKind::Surface, Wanted::default(), p).map(|()| report);
    }
    let spacing = p.check_spacing(spacing(mesh, &measures, params, &report))?;
    let starts = starts(&measures, spacing / scale, p)?;
    let splats = starts.last().copied().unwrap_or(0);
    report.spacing = spacing;
    report.radius = p.radius(spacing);
    report.splats = splats;
    report.normals_computed = mesh.normal.is_empty();
    let kind = if params.opacity < 1.0 { SplatKind::Surface } else { SplatKind::Opaque };
    columns::size_columns(cloud, splats as usize, kind, Wanted { normal: true, value: false }, p)?;
    Pieces::new(mesh, params, &measures, &starts, &report).emit(cloud);
    Ok(report)
}

/// The spacing in world units that the density asks for.
fn spacing(mesh: &Mesh, measures: &[Measure], params: &MeshParams, report: &MeshReport) -> f64 {
    let scale = params.splat.transform.scale;
    match params.density {
        Density::Spacing(h) => h,
        Density::Splats(n) => spacing_for(measures, n.max(1), report, scale),
        Density::Auto => {
            let diagonal = f64::from(splat_core::Aabb::of_points(&mesh.position).diagonal()) * scale;
            let triangle = (report.area / (report.triangles - report.degenerate) as f64).sqrt();
            let budget = (params.splat.max_splats as f64 / 2.0).clamp(1.0, AUTO_SPLATS);
            (diagonal / AUTO_STEPS).min(triangle).max((report.area / budget).sqrt())
        }
    }
}

/// The spacing that gives about `wanted` splats: whole pieces are up to four times too many at √(A/n), so the count is
/// corrected a few times. Triangles that are finer already stay as they are.
fn spacing_for(measures: &[Measure], wanted: u64, report: &MeshReport, scale: f64) -> f64 {
    let first = (report.area / wanted as f64).sqrt();
    let mut spacing = first;
    for _ in 0..5 {
        let h = spacing / scale;
        let estimate: f64 = measures.iter().map(|m| m.longest_sq.sqrt() / h).sum();
        // Needles whose length alone exceeds any sensible count are left for the limit to refuse.
        if wanted > u64::from(u32::MAX) || estimate > 1e10 {
            break;
        }
        let count: u64 = measures.par_iter().with_min_len(4096).map(|m| subdivide::split(m, h).pieces()).sum();
        let ratio = count as f64 / wanted as f64;
        if (0.97..=1.03).contains(&ratio) || count == report.triangles - report.degenerate {
            break;
        }
        spacing = (spacing * ratio.sqrt()).clamp(first, 2.0 * first);
    }
    spacing
}

/// First splat of every triangle, then the number of all; `spacing` in the mesh's units.
fn starts(measures: &[Measure], spacing: f64, p: &SplatParams) -> Result<Vec<u64>, ConvertError> {
    let least: f64 = measures.iter().map(|m| m.area).sum::<f64>() / (spacing * spacing);
    p.check_count(least)?;
    let counts: Vec<u64> = measures
        .par_iter()
        .with_min_len(4096)
        .map(|m| {
            // A strip count is a loop: a needle that would exceed the budget by its length alone is not walked.
            let strips = m.longest_sq.sqrt() / spacing;
            if strips > p.max_splats as f64 { strips as u64 } else { subdivide::split(m, spacing).pieces() }
        })
        .collect();
    p.check_count(counts.iter().map(|&n| n as f64).sum())?;
    let mut total = 0;
    let mut starts = Vec::with_capacity(counts.len() + 1);
    starts.push(0);
    starts.extend(counts.iter().map(|n| {
        total += n;
        total
    }));
    Ok(starts)
}

fn corners(mesh: &Mesh, triangle: &[u32; 3]) -> [DVec3; 3] {
    triangle.map(|v| mesh.position[v as usize].as_dvec3())
}

/// Everything that the pieces are made from.
struct Pieces<'a> {
    mesh: &'a Mesh,
    measures: &'a [Measure],
    starts: &'a [u64],
    /// Vertices relative to the cloud's origin.
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    /// Spacing in the mesh's units.
    spacing: f64,
    /// Factor from a share of the mesh's area to K.
    depth: f64,
    radius: f32,
    color: [f32; 3],
    rotation: DQuat,
}

/// The columns that one task writes.
struct Target<'a> {
    position: &'a mut [Vec3],
    normal: &'a mut [Vec3],
    cross_section: &'a mut [f32],
    color: &'a mut [[f32; 3]],
}

impl<'a> Pieces<'a> {
    fn new(
        mesh: &'a Mesh,
        params: &MeshParams,
        measures: &'a [Measure],
        starts: &'a [u64],
        report: &MeshReport,
    ) -> Self {
        let t = &params.splat.transform;
        let place = |v: &Vec3| (t.rotation * (v.as_dvec3() * t.scale)).as_vec3();
        let turn = |n: &Vec3| columns::unit_or_zero(t.rotate(n.as_dvec3()).as_vec3());
        let normal = if report.normals_computed { vertex_normals(mesh) } else { mesh.normal.clone() };
        let tau = if params.opacity < 1.0 { optics::optical_depth(params.opacity) } else { 1.0 };
        Self {
            mesh,
            measures,
            starts,
            position: mesh.position.par_iter().with_min_len(CHUNK).map(place).collect(),
            normal: normal.par_iter().with_min_len(CHUNK).map(turn).collect(),
            spacing: report.spacing / t.scale,
            depth: tau * t.scale * t.scale,
            radius: report.radius as f32,
            color: params.splat.color,
            rotation: t.rotation,
        }
    }

    /// Fills the columns in tasks of [`CHUNK`] splats, wherever triangles begin: one huge triangle is shared too.
    fn emit(&self, cloud: &mut Cloud) {
        let columns = (cloud.position.par_chunks_mut(CHUNK), cloud.normal.par_chunks_mut(CHUNK));
        let rest = (cloud.cross_section.par_chunks_mut(CHUNK), cloud.color.par_chunks_mut(CHUNK));
        (columns.0, columns.1, rest.0, rest.1, cloud.radius.par_chunks_mut(CHUNK))
            .into_par_iter()
            .enumerate()
            .for_each(|(chunk, (position, normal, cross_section, color, radius))| {
                radius.fill(self.radius);
                if self.mesh.color.is_empty() {
                    color.fill(self.color);
                }
                self.fill((chunk * CHUNK) as u64, &mut Target { position, normal, cross_section, color });
            });
    }

    /// Writes the splats from number `first` on.
    fn fill(&self, first: u64, target: &mut Target<'_>) {
        let mut triangle = self.starts.partition_point(|&s| s <= first) - 1;
        let mut skip = first - self.starts[triangle];
        let mut written = 0;
        while written < target.position.len() {
            let split = subdivide::split(&self.measures[triangle], self.spacing);
            let corner = Corners::new(self, triangle);
            for i in 0..split.runs() {
                let run = split.run(i);
                if skip >= u64::from(run.count) {
                    skip -= u64::from(run.count);
                    continue;
                }
                let end = target.position.len().min(written + (u64::from(run.count) - skip) as usize);
                corner.write(&run, skip as f32, written..end, target);
                (written, skip) = (end, 0);
                if written == target.position.len() {
                    break;
                }
            }
            triangle += 1;
        }
    }
}

/// One triangle as affine functions of its barycentric weights.
struct Corners {
    position: [Vec3; 3],
    normal: [Vec3; 3],
    color: Option<[Vec3; 3]>,
    /// Normal of the plane, where interpolated normals cancel.
    plane: Vec3,
    /// K of the whole triangle.
    depth: f64,
}

impl Corners {
    fn new(pieces: &Pieces<'_>, triangle: usize) -> Self {
        let ids = pieces.mesh.triangles[triangle].map(|v| v as usize);
        let position = ids.map(|v| pieces.position[v]);
        // From the mesh itself: a sliver may collapse when its turned corners are rounded.
        let v = corners(pieces.mesh, &pieces.mesh.triangles[triangle]);
        let plane = pieces.rotation * subdivide::robust_cross(v[1] - v[0], v[2] - v[0]).normalize_or(DVec3::Y);
        let plane = plane.as_vec3();
        let normal = ids.map(|v| if pieces.normal[v] == Vec3::ZERO { plane } else { pieces.normal[v] });
        let color = (!pieces.mesh.color.is_empty()).then(|| ids.map(|v| Vec3::from(pieces.mesh.color[v])));
        Self { position, normal, color, plane, depth: pieces.depth * pieces.measures[triangle].area }
    }

    /// Writes the pieces of a run from piece `skip` on into `range` of the columns.
    fn write(&self, run: &Run, skip: f32, range: std::ops::Range<usize>, target: &mut Target<'_>) {
        let (start, step) = (run.start.as_vec3(), run.step.as_vec3());
        let line = |v: &[Vec3; 3]| {
            let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
            (v[0] + e1 * start.y + e2 * start.z, e1 * step.y + e2 * step.z)
        };
        let (from, along) = line(&self.position);
        for (j, p) in target.position[range.clone()].iter_mut().enumerate() {
            *p = from + along * (j as f32 + skip);
        }
        let (from, along) = line(&self.normal);
        for (j, n) in target.normal[range.clone()].iter_mut().enumerate() {
            let sum = from + along * (j as f32 + skip);
            let length_sq = sum.length_squared();
            // Opposite vertex normals cancel on the way from one to the other.
            *n = if length_sq > 1e-6 { sum * (1.0 / length_sq.sqrt()) } else { self.plane };
        }
        if let Some(color) = &self.color {
            let (from, along) = line(color);
            for (j, c) in target.color[range.clone()].iter_mut().enumerate() {
                *c = (from + along * (j as f32 + skip)).max(Vec3::ZERO).to_array();
            }
        }
        target.cross_section[range].fill((self.depth * run.share) as f32);
    }
}

/// Splats that [`mesh_to_points`] makes at this spacing (world units), for estimates of memory and time.
pub fn predicted_splats(mesh: &Mesh, params: &MeshParams, spacing: f64) -> f64 {
    let h = spacing / params.splat.transform.scale;
    mesh.triangles.iter().map(|t| subdivide::estimate(&subdivide::measure(corners(mesh, t)), h)).sum()
}
