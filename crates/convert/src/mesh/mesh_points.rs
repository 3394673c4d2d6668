//! Meshes become disc splats: Gunjee 2007, section 4, "Converting the polygonal models".
//!
//! Every triangle is split into pieces of at most h² (see `subdivide.rs`); each piece becomes one disc at its centroid
//! that stands for the piece's area a: K = τ₁·a for a translucent surface (τ₁ = −ln(1 − α) of one crossing), K = a for
//! an opaque one. The discs of an object have the same radius R = cutoff·0.8·h. So Σ a·norm/R²·profile is a quadrature
//! of ∫ norm/R²·profile dA = 1 over the surface: splitting finer or coarser leaves the transmittance alone.
//!
//! In a mesh with opacities of vertices, the opacity of a piece is α times their interpolated value at its centroid. A piece of opacity 1 is an
//! opaque disc. The optical depth follows from that product, without interpolation, so the opacity of the surface is that of its vertices.
//!
//! Deviation from the paper: it gives each piece the opacity of the surface, which multiplies where discs overlap.

use crate::ConvertError;
use crate::common::columns::{self, ColumnSet};
use crate::common::params::{Density, SplatParams};
use crate::mesh::borders::{Borders, open_edges};
use crate::mesh::pieces::Pieces;
use crate::mesh::subdivide::{self, Measure};
use crate::mesh::surface_colors::SurfaceColors;
use crate::splats::footprints::choose_by_place;
use rayon::prelude::*;
use splat_core::text::counted;
use splat_core::vertex_normals;
use splat_core::{
    Cloud, Mesh, Progress, SplatKind,
    glam::{DVec3, Vec3},
    optics,
};

/// Parameters of the conversion of a mesh to splats.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshParams {
    /// Attributes and limits.
    pub splat: SplatParams,
    /// Largest spacing h, world units. [`Density::Auto`] takes 1/400 of the diagonal or the mean triangle's √area,
    /// whichever is smaller, but not more than four million splats. With [`Density::Splats`] the count is met
    /// within some percent where the triangles are not finer.
    pub density: Density,
    /// Opacity α of one crossing, in \[0, 1\]; 1 makes the surface opaque, 0 leaves nothing. Opacities of the mesh's vertices are multiplied
    /// by it.
    pub opacity: f64,
}

impl Default for MeshParams {
    fn default() -> Self {
        Self { splat: SplatParams::default(), density: Density::Auto, opacity: 1.0 }
    }
}

impl MeshParams {
    /// Whether there is anything to show.
    pub(crate) fn shows(&self) -> bool {
        self.opacity > 0.0 || self.splat.keep_clear
    }
}

/// Columns of the splats of a mesh of some opacity, but for those that not all meshes need.
pub(crate) fn column_set(opacity: f64) -> ColumnSet {
    ColumnSet { normal: true, crossing_depth: opacity < 1.0, ..ColumnSet::default() }
}

/// The report of a mesh's conversion.
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
    /// Cutoff radius of every splat, but for opaque ones near a border, world units; 0 for an empty mesh.
    pub radius: f64,
    /// Whether normals came from the triangles because the mesh has none.
    pub normals_computed: bool,
}

impl MeshReport {
    /// Warns that triangles were dropped, in a sentence without a full stop.
    pub fn said(&self) -> Option<String> {
        (self.degenerate > 0).then(|| format!("{} without an area", counted(self.degenerate, "face")))
    }
}

/// Share of the diagonal that is the automatic spacing, and the automatic budget.
const AUTO_STEPS: f64 = 400.0;
const AUTO_SPLATS: f64 = 4e6;

/// The splats of a triangle that has several lie in its plane where a vertex normal leans further from it than this cosine: by
/// interpolated normals they would stand out of a coarse mesh as scales, with gaps between them.
const LEANING: f32 = 0.94;

/// Makes a new cloud from a mesh, see [`mesh_to_points_into`].
///
/// ```
/// use convert::{Density, MeshParams, mesh_to_points};
/// use splat_core::{Mesh, glam::Vec3};
/// let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
/// let params = MeshParams { density: Density::Spacing(0.1), opacity: 0.5, ..MeshParams::default() };
/// let (cloud, report) = mesh_to_points(&mesh, &params, None).unwrap();
/// let depth: f32 = cloud.cross_section.iter().sum();
/// assert!((depth - 0.5 * 2.0_f32.ln()).abs() < 1e-5);
/// assert_eq!(report.splats, 64);
/// ```
///
/// # Errors
/// As [`mesh_to_points_into`].
pub fn mesh_to_points(
    mesh: &Mesh,
    params: &MeshParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, MeshReport), ConvertError> {
    let mut cloud = Cloud::default();
    let report = mesh_to_points_into(mesh, params, &mut cloud, progress)?;
    Ok((cloud, report))
}

/// [`mesh_to_points`] with colours that lie between the vertices: each splat has the mean over its piece. Colours of the mesh's vertices are not
/// used.
///
/// ```
/// use convert::{MeshParams, SurfaceColors, painted_mesh_to_points};
/// use splat_core::{Mesh, glam::{Vec2, Vec3}};
/// /// Red grows from the first corner to the second.
/// struct Ramp;
/// impl SurfaceColors for Ramp {
///     fn fill(&self, _: usize, _: f64, weights: &mut dyn Iterator<Item = Vec2>, colors: &mut [[f32; 3]]) {
///         weights.zip(colors).for_each(|(w, color)| *color = [w.x, 0.0, 0.0]);
///     }
/// }
/// let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
/// let (cloud, _) = painted_mesh_to_points(&mesh, &Ramp, &MeshParams::default(), None).unwrap();
/// assert!(cloud.position.iter().zip(&cloud.color).all(|(p, color)| (p.x - color[0]).abs() < 1e-6));
/// ```
///
/// # Errors
/// As [`mesh_to_points_into`].
pub fn painted_mesh_to_points(
    mesh: &Mesh,
    colors: &dyn SurfaceColors,
    params: &MeshParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, MeshReport), ConvertError> {
    let mut cloud = Cloud::default();
    let report = to_points(mesh, Some(colors), params, &mut cloud, progress)?;
    Ok((cloud, report))
}

/// Replaces the content of `cloud` by the splats of a mesh; its memory is used again. The cloud's origin is the mesh's,
/// transformed, so a mesh far away gives the same offsets as one at 0.
///
/// Splats are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::Parameter`] and [`ConvertError::Input`] for what breaks a promise, [`ConvertError::Limit`] before
/// any memory is taken, and [`ConvertError::Cancelled`], after which the cloud is of no use.
pub fn mesh_to_points_into(
    mesh: &Mesh,
    params: &MeshParams,
    cloud: &mut Cloud,
    progress: Option<&Progress>,
) -> Result<MeshReport, ConvertError> {
    to_points(mesh, None, params, cloud, progress)
}

fn to_points(
    mesh: &Mesh,
    colors: Option<&dyn SurfaceColors>,
    params: &MeshParams,
    cloud: &mut Cloud,
    progress: Option<&Progress>,
) -> Result<MeshReport, ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let p = &params.splat;
    let plan = plan(mesh, params)?;
    let report = plan.report;
    cloud.origin = p.transform.apply(mesh.origin);
    let is_opaque = params.opacity >= 1.0 && mesh.opacity.is_empty();
    let kind = if is_opaque { SplatKind::Opaque } else { SplatKind::Surface };
    columns::size_columns(cloud, report.splats as usize, kind, plan.columns, p)?;
    progress.add_total(report.splats);
    if report.splats > 0 {
        let pieces = Pieces::new(mesh, params, &plan, colors);
        pieces.emit(cloud, progress)?;
        if mesh.opacity.is_empty() && plan.columns.crossing_depth {
            cloud.crossing_depth.fill(optics::optical_depth(params.opacity) as f32);
        }
        if !plan.borders.is_empty() {
            Borders::new(plan.borders.iter().map(|edge| pieces.place(edge))).clip(cloud);
        }
        choose_by_place(cloud, p)?;
    }
    Ok(report)
}

/// What is known before any splat is made.
#[derive(Default)]
pub(crate) struct Plan {
    pub(crate) measures: Vec<Measure>,
    /// First splat of every triangle, then the number of all; empty where there is none.
    pub(crate) starts: Vec<u64>,
    /// Normals of the vertices, in the mesh's space.
    pub(crate) normal: Vec<Vec3>,
    /// Edges where an opaque surface ends.
    borders: Vec<[u32; 2]>,
    pub(crate) columns: ColumnSet,
    pub(crate) report: MeshReport,
}

/// Checks everything and counts the splats.
pub(crate) fn plan(mesh: &Mesh, params: &MeshParams) -> Result<Plan, ConvertError> {
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
    if area == 0.0 || !params.shows() {
        return Ok(Plan { measures, report, ..Plan::default() });
    }
    let spacing = p.check_spacing(spacing(mesh, &measures, params, &report))?;
    let starts = starts(&measures, spacing / scale, p)?;
    report.spacing = spacing;
    report.radius = p.radius(spacing);
    report.splats = starts.last().copied().unwrap_or(0);
    report.normals_computed = mesh.normal.is_empty();
    let normal = if report.normals_computed { vertex_normals(mesh) } else { mesh.normal.clone() };
    // A disc ends where its image does. Translucent discs add up beyond a border to what they leave out before it.
    let has_opaque = mesh.opacity.is_empty() || mesh.opacity.contains(&1.0);
    let ends = params.opacity >= 1.0 && has_opaque && !p.shows_images();
    let borders = if ends { open_edges(mesh) } else { Vec::new() };
    let of_opacity = column_set(params.opacity);
    let columns = ColumnSet {
        tangent: !borders.is_empty() || p.shows_images(),
        crossing_depth: of_opacity.crossing_depth || !mesh.opacity.is_empty(),
        ..of_opacity
    };
    let mut plan = Plan { measures, starts, normal, borders, columns, report };
    let triangles = (0..mesh.triangles.len()).into_par_iter().with_min_len(4096);
    plan.columns.shading_normal = triangles.any(|i| plan.is_flat(mesh, i, plane(mesh, i)));
    Ok(plan)
}

impl Plan {
    /// Whether the splats of triangle `i` lie in its `plane`: it has several, and a corner's normal leans away.
    pub(crate) fn is_flat(&self, mesh: &Mesh, i: usize, plane: DVec3) -> bool {
        let normals = mesh.triangles[i].map(|v| self.normal[v as usize]);
        self.starts[i + 1] - self.starts[i] > 1 && leans(normals, plane.as_vec3())
    }
}

/// Whether a corner's normal leans away from a plane, on either side.
fn leans(normals: [Vec3; 3], plane: Vec3) -> bool {
    normals.iter().any(|n| n.dot(plane).abs() < LEANING * n.length())
}

/// Separates triangles larger than `least` (area, object units²) whose normals lean by more than 20° from their plane. Their new
/// vertices have the plane's normal, on the side of the old ones. This serves techniques that use a single normal for geometry
/// and for shading. A mesh without normals stays as it is.
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn flatten_leaning(mesh: &mut Mesh, least: f64) {
    if mesh.normal.is_empty() {
        return;
    }
    for i in 0..mesh.triangles.len() {
        let [ids, copies] = [mesh.triangles[i].map(|v| v as usize), [0, 1, 2].map(|k| mesh.position.len() + k)];
        let normals = ids.map(|v| mesh.normal[v]);
        let plane = plane(mesh, i).as_vec3();
        if !leans(normals, plane) || subdivide::measure(corners(mesh, &mesh.triangles[i])).area <= least {
            continue;
        }
        let side = if normals.iter().sum::<Vec3>().dot(plane) < 0.0 { -plane } else { plane };
        for v in ids {
            mesh.push_copy(v);
            mesh.normal.push(side);
        }
        mesh.triangles[i] = copies.map(|v| v as u32);
    }
}

/// Unit normal of triangle `i` by the right-hand rule, from the mesh itself: a sliver may collapse when its turned corners are
/// rounded. Any for one without area.
pub(crate) fn plane(mesh: &Mesh, i: usize) -> DVec3 {
    let v = corners(mesh, &mesh.triangles[i]);
    splat_core::robust_cross(v[1] - v[0], v[2] - v[0]).normalize_or(DVec3::Y)
}

/// The spacing in world units that the density asks for.
fn spacing(mesh: &Mesh, measures: &[Measure], params: &MeshParams, report: &MeshReport) -> f64 {
    let scale = params.splat.transform.scale;
    match params.density {
        Density::Spacing(h) => h,
        Density::Splats(n) => spacing_for(measures, n.max(1), report, scale),
        Density::Auto => auto_spacing(mesh, report.area, report.triangles - report.degenerate, &params.splat),
    }
}

/// The spacing of [`Density::Auto`] for so many triangles with an area, world units².
pub(crate) fn auto_spacing(mesh: &Mesh, area: f64, triangles: u64, splat: &SplatParams) -> f64 {
    let diagonal = f64::from(splat_core::Aabb::of_points(&mesh.position).diagonal()) * splat.transform.scale;
    let triangle = (area / triangles as f64).sqrt();
    let budget = (splat.most_splats() as f64 / 2.0).clamp(1.0, AUTO_SPLATS);
    (diagonal / AUTO_STEPS).min(triangle).max((area / budget).sqrt())
}

/// The spacing that gives about this many splats: whole pieces are up to four times too many at √(A/n), so the count is
/// corrected a few times. Triangles that are finer already stay as they are.
fn spacing_for(measures: &[Measure], splats: u64, report: &MeshReport, scale: f64) -> f64 {
    let first = (report.area / splats as f64).sqrt();
    let mut spacing = first;
    for _ in 0..5 {
        let h = spacing / scale;
        let estimate: f64 = measures.iter().map(|m| m.longest_sq.sqrt() / h).sum();
        // Needles whose length alone exceeds any sensible count are left for the limit to refuse.
        if splats > u64::from(u32::MAX) || estimate > 1e10 {
            break;
        }
        let count: u64 = measures.par_iter().with_min_len(4096).map(|m| subdivide::split(m, h).pieces()).sum();
        let ratio = count as f64 / splats as f64;
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
            if strips > p.most_splats() as f64 { strips as u64 } else { subdivide::split(m, spacing).pieces() }
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

pub(crate) fn corners(mesh: &Mesh, triangle: &[u32; 3]) -> [DVec3; 3] {
    triangle.map(|v| mesh.position[v as usize].as_dvec3())
}
