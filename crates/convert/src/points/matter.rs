//! Raw points become a medium: each stands for the matter of its Voronoi cell.
//!
//! Gunjee 2007 takes points with all attributes, extinction and size among them; simulations and samples of clouds give places. Point
//! i gets the volume Vᵢ of its cell ([`crate::points::cell_volume`]), the cross-section Kᵢ = σᵢ·Vᵢ and a kernel of the radius R = cutoff·0.8·Vᵢ^(1/3),
//! as a voxel of that volume has, so that kernels sum to about σ within the points. If the file states the reach of kernels,
//! R is that reach and K is unchanged: a wider kernel blurs, and takes no matter away. If it states masses, as of the equal particles of a
//! simulation, Kᵢ = κᵢ·mᵢ at any density of points, and σ is κ, an area a unit of mass.
//!
//! Points at one place share its volume, and points that become one have the sum of their cross-sections.

use crate::ConvertError;
use crate::common::columns::{self, CHUNK, ColumnSet};
use crate::common::convert_error::check_cancelled;
use crate::common::params::SplatParams;
use crate::points::place_order::{canonical_order, distinct_places};
use crate::points::point_cells::{cells_of, cut_outliers};
use crate::points::thin;
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::points::attributes::{
    EXTINCTION, FOOTPRINT, MASS, MATERIAL, RADIUS, SHADOW_COEFFICIENT, SMOOTHING_LENGTH, TANGENT, attribute, expected,
};
use splat_core::{Cloud, Column, Error, PointCell, Progress, RawPoints, SplatKind};

/// Parameters of the conversion of raw points to a medium.
#[derive(Debug, Clone, PartialEq)]
pub struct MatterParams {
    /// Attributes and limits; `color` is for points without one.
    pub splat: SplatParams,
    /// Whether splats keep the points' colours.
    pub colors: bool,
    /// Whether splats keep the points' values.
    pub values: bool,
    /// Extinction σ_t within the points, 1/world unit, ≥ 0; that of points with a column `extinction` is its numbers times this. Of points
    /// with a column `mass` it is their cross-section a unit of mass, world units².
    pub extinction: f64,
    /// Points of a cell of a lattice with this step become one splat, as in [`crate::thinned`]; units of the file, > 0.
    pub spacing: Option<f64>,
    /// Edge of the largest cube that a point stands for over the median edge: lone points do not become huge clouds. At least 1.
    pub largest_spacing: f64,
    /// Edge of the cube that a place without any neighbour stands for, world units.
    pub lone_spacing: f64,
}

impl Default for MatterParams {
    fn default() -> Self {
        Self {
            splat: SplatParams::default(),
            colors: true,
            values: false,
            extinction: 1.0,
            spacing: None,
            largest_spacing: 4.0,
            lone_spacing: 1.0,
        }
    }
}

/// The report of a conversion of raw points to a medium.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MatterReport {
    /// Points given.
    pub points: u64,
    /// Points that lie where an earlier one lies.
    pub duplicates: u64,
    /// Splats made: none of points without extinction.
    pub splats: u64,
    /// Points whose cell was cut to the largest; 0 if masses and reaches are stated, because no cells are computed
    /// then.
    pub lone: u64,
    /// Median edge of the cubes with the volumes of the cells, world units; 0 without points, and without cells.
    pub median_spacing: f64,
    /// Sum of the volumes, world units³; 0 without cells.
    pub volume: f64,
}

impl MatterReport {
    /// Warns that the cells of lone places were cut, in a sentence without a full stop.
    pub fn said(&self) -> Option<String> {
        let Self { lone, points, .. } = self;
        (*lone > 0).then(|| {
            format!("{lone} of {points} points lie so far from others that the matter they stand for was cut down")
        })
    }
}

/// Makes a cloud of medium splats of raw points.
///
/// Columns of the points (`RawPoints::columns`) add a number for each point: `radius`, the reach of its kernel in units of the file, or
/// `smoothing_length`, half of that, > 0; `extinction`, a factor of the parameter, ≥ 0; `mass`, which the parameter is multiplied by in the
/// place of a volume, ≥ 0; and `shadow_coefficient`, the share of a shadow that it receives, in \[0, 1\].
///
/// ```
/// use convert::{MatterParams, raw_to_matter};
/// use splat_core::RawPoints;
/// use splat_core::glam::Vec3;
/// let position = (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32)).collect();
/// let points = RawPoints { position, ..RawPoints::default() };
/// let (cloud, report) = raw_to_matter(&points, &MatterParams { extinction: 0.5, ..MatterParams::default() }, None).unwrap();
/// assert_eq!(cloud.len(), 1000);
/// assert!((report.volume / 1000.0 - 1.0).abs() < 0.05);
/// assert!((cloud.cross_section.iter().sum::<f32>() / 500.0 - 1.0).abs() < 0.05);
/// ```
///
/// Places are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::Parameter`], also for 3D Gaussians, [`ConvertError::Input`], [`ConvertError::Limit`] or [`ConvertError::Cancelled`].
pub fn raw_to_matter(
    points: &RawPoints,
    params: &MatterParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, MatterReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    check(points, params)?;
    let order = canonical_order(points);
    let (distinct, starts) = distinct_places(points, &order);
    check_cancelled(progress)?;
    let mut cells = if !points.cells.is_empty() {
        points.cells.clone()
    } else if params.spacing.is_none() && OfMatter::new(points).needs_no_cells() {
        vec![PointCell::default(); points.len()]
    } else {
        cells_of(&order, &distinct, &starts, progress)?
    };
    let scale = params.splat.transform.scale;
    let (median, lone) = cut_outliers(&mut cells, params.lone_spacing / scale, params.largest_spacing);
    let volume = order.iter().map(|i| cells[*i as usize].volume).sum::<f64>();
    let cloud = emit(points, params, &cells, &Merged::new(points, params, order))?;
    let report = MatterReport {
        points: points.len() as u64,
        duplicates: (points.len() - distinct.len()) as u64,
        splats: cloud.len() as u64,
        lone,
        median_spacing: median * scale,
        volume: volume * scale.powi(3),
    };
    Ok((cloud, report))
}

pub(crate) fn check(points: &RawPoints, params: &MatterParams) -> Result<(), ConvertError> {
    let p = &params.splat;
    p.check()?;
    if !points.gaussians.is_empty() {
        return Err(p.bad("as", "medium", "\"surface\": 3D Gaussians have shapes and opacities of their own"));
    }
    if !points.ready.cloud.is_empty() {
        return Err(p.bad("as", "medium", "\"surface\": splats of a file are what they are, media too"));
    }
    points.validate().and_then(|()| check_columns(points, true)).map_err(|e| p.input(e))?;
    if !(params.extinction.is_finite() && params.extinction >= 0.0) {
        return Err(p.bad("extinction", params.extinction, "a finite number ≥ 0"));
    }
    if params.largest_spacing.is_nan() || params.largest_spacing < 1.0 {
        return Err(p.bad("largest_spacing", params.largest_spacing, "a number ≥ 1"));
    }
    params.spacing.map_or(Ok(0.0), |spacing| p.check_spacing(spacing))?;
    p.check_spacing(params.lone_spacing).map(|_| ())
}

/// Refuses numbers that attributes cannot have: those of discs, or of matter.
pub(crate) fn check_columns(points: &RawPoints, matter: bool) -> Result<(), Error> {
    for Column { name, values } in &points.columns {
        let Some(attribute) = attribute(name, matter) else { continue };
        let wrong = values.iter().enumerate().find_map(|(i, v)| Some((i, *v, expected(attribute, *v)?)));
        if let Some((i, number, expected)) = wrong {
            return Err(Error::invalid("point", i, attribute, number, expected));
        }
    }
    Ok(())
}

/// What points say of their matter.
struct OfMatter<'a> {
    /// Numbers, and what they are multiplied by to be reaches.
    reach: Option<(&'a [f64], f64)>,
    extinction: Option<&'a [f64]>,
    mass: Option<&'a [f64]>,
    shadow_coefficient: Option<&'a [f64]>,
}

impl<'a> OfMatter<'a> {
    fn new(points: &'a RawPoints) -> Self {
        let column = |name| points.own_column(name);
        let smoothed = || column(SMOOTHING_LENGTH).map(|lengths| (lengths, 2.0));
        Self {
            reach: column(RADIUS).map(|radii| (radii, 1.0)).or_else(smoothed),
            extinction: column(EXTINCTION),
            mass: column(MASS),
            shadow_coefficient: column(SHADOW_COEFFICIENT),
        }
    }

    /// Whether masses and reaches say what volumes would.
    fn needs_no_cells(&self) -> bool {
        self.mass.is_some() && self.reach.is_some()
    }

    /// The reach of the kernel of point `i` in the unit of the file, where that is stated.
    fn reach(&self, i: usize) -> Option<f64> {
        self.reach.map(|(lengths, factor)| factor * lengths[i])
    }

    /// What the object's extinction is multiplied by to be the cross-section of point `i`, which stands for a volume of the world.
    fn amount(&self, i: usize, volume: f64) -> f64 {
        self.extinction.map_or(1.0, |factors| factors[i]) * self.mass.map_or(volume, |masses| masses[i])
    }

    /// Share of a shadow that point `i` receives.
    fn shadow_coefficient(&self, i: usize) -> f64 {
        self.shadow_coefficient.map_or(1.0, |shares| shares[i])
    }
}

/// What a medium makes no use of in the columns that its points have, one sentence without a full stop each.
pub(crate) fn unused_by_matter(points: &RawPoints) -> Vec<String> {
    let has = |name: &str| points.columns.iter().any(|c| c.name == name);
    let opacity =
        (!points.opacity.is_empty()).then(|| "a medium does not use `opacity`: it has an extinction".to_owned());
    let length = || format!("a medium does not use `{SMOOTHING_LENGTH}` beside `{RADIUS}`");
    let tangent = TANGENT.into_iter().find(|name| has(name));
    let tangent = tangent.map(|name| format!("a medium does not use `{name}`: its kernels are balls"));
    let ids = [FOOTPRINT, MATERIAL].into_iter().filter(|name| has(name));
    let ids: Vec<String> =
        ids.map(|name| format!("a medium does not use `{name}`: it has that of its object")).collect();
    opacity.into_iter().chain((has(RADIUS) && has(SMOOTHING_LENGTH)).then(length)).chain(tangent).chain(ids).collect()
}

/// How many splats a conversion makes.
pub(crate) fn count(points: &RawPoints, params: &MatterParams) -> usize {
    Merged::new(points, params, (0..points.len() as u32).collect()).len()
}

/// The points of every splat, of those that have extinction.
struct Merged {
    ids: Vec<u32>,
    /// Where the points of each splat begin, then the number of ids.
    starts: Vec<u32>,
}

impl Merged {
    /// One a point, in `order`, or by the cells of the lattice that makes points one.
    fn new(points: &RawPoints, params: &MatterParams, order: Vec<u32>) -> Self {
        let matter = OfMatter::new(points);
        // What f32 does not hold is none.
        let absorbs = |i: &u32| (params.extinction * matter.amount(*i as usize, 1.0)) as f32 > 0.0;
        let Some(spacing) = params.spacing else {
            let ids: Vec<u32> = order.into_iter().filter(absorbs).collect();
            let starts = (0..=ids.len() as u32).collect();
            return Self { ids, starts };
        };
        let mut ids: Vec<u32> = Vec::new();
        let mut starts: Vec<u32> = Vec::new();
        for cell in thin::cells(points, spacing).chunk_by(|a, b| a.0 == b.0) {
            let start = ids.len();
            ids.extend(cell.iter().map(|(_, i)| *i).filter(absorbs));
            starts.extend((ids.len() > start).then_some(start as u32));
        }
        starts.push(ids.len() as u32);
        Self { ids, starts }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn points_of(&self, splat: usize) -> &[u32] {
        &self.ids[self.starts[splat] as usize..self.starts[splat + 1] as usize]
    }
}

fn emit(
    points: &RawPoints,
    params: &MatterParams,
    cells: &[PointCell],
    merged: &Merged,
) -> Result<Cloud, ConvertError> {
    let p = &params.splat;
    let t = &params.splat.transform;
    let mut cloud = Cloud::new(t.apply(points.origin));
    columns::size_columns(&mut cloud, merged.len(), SplatKind::Medium, column_set(points, params), p)?;
    let matter = OfMatter::new(points);
    // By what the points of one splat are weighed.
    let amount = |i: usize| matter.amount(i, cells[i].volume * t.scale.powi(3));
    let reach = |i: usize| match matter.reach(i) {
        Some(stated) => stated * t.scale,
        None => p.radius(cells[i].spacing * t.scale),
    };
    let columns = (&mut cloud.position, &mut cloud.radius, &mut cloud.cross_section, &mut cloud.color);
    columns.into_par_iter().enumerate().with_min_len(CHUNK).for_each(
        |(splat, (position, radius, cross_section, color))| {
            let ids = merged.points_of(splat);
            let total: f64 = ids.iter().map(|i| amount(*i as usize)).sum();
            let volume: f64 = ids.iter().map(|i| cells[*i as usize].volume).sum();
            let mut place = DVec3::ZERO;
            let mut tint = DVec3::ZERO;
            let mut mean_reach = 0.0;
            for i in ids.iter().map(|i| *i as usize) {
                let share = amount(i) / total;
                let point_color = points.color.get(i).filter(|_| params.colors).unwrap_or(&p.color);
                place += share * points.position[i].as_dvec3();
                tint += share * Vec3::from_array(*point_color).as_dvec3();
                mean_reach += share * reach(i);
            }
            // The kernel of several is at least as wide as that of a voxel of theirs.
            let least = if ids.len() > 1 { p.radius(libm::cbrt(volume) * t.scale) } else { 0.0 };
            *position = (t.rotation * (place * t.scale)).as_vec3();
            *radius = mean_reach.max(least) as f32;
            *cross_section = (params.extinction * total) as f32;
            *color = tint.as_vec3().to_array();
        },
    );
    let mean = |splat: usize, term: &(dyn Fn(usize) -> f64 + Sync)| -> f64 {
        let ids = || merged.points_of(splat).iter().map(|i| *i as usize);
        let total: f64 = ids().map(amount).sum();
        ids().map(|i| amount(i) / total * term(i)).sum()
    };
    let coefficients = cloud.shadow_coefficient.par_iter_mut().enumerate().with_min_len(CHUNK);
    coefficients.for_each(|(splat, coefficient)| {
        *coefficient = mean(splat, &|i| matter.shadow_coefficient(i)).clamp(0.0, 1.0) as f32;
    });
    let values = cloud.value.par_iter_mut().enumerate().with_min_len(CHUNK);
    values.for_each(|(splat, value)| *value = mean(splat, &|i| points.value[i].into()) as f32);
    Ok(cloud)
}

/// Which columns the splats fill.
pub(crate) fn column_set(points: &RawPoints, params: &MatterParams) -> ColumnSet {
    ColumnSet {
        shadow_coefficient: points.own_column(SHADOW_COEFFICIENT).is_some(),
        value: params.values && !points.value.is_empty(),
        ..ColumnSet::default()
    }
}
