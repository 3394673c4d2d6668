//! Raw points become surfels: radius from the distances of distinct neighbours, normals from their covariance.
//!
//! Gunjee 2007 takes points with all attributes; scanners give positions. Each distinct position gets the normal of its
//! neighbours' plane, its Voronoi cell in that plane as area a (K = τ₁·a, or a when opaque) and the radius
//! R = cutoff·0.8·h with h = √2 times the cell's farthest corner, between √a and 2√a: on a square lattice that is the
//! lattice's spacing, among scattered points it bridges the gaps.
//!
//! Points may have an opacity each, which is multiplied by that of the surface. A point with the product 1 becomes an opaque disc, because
//! its τ₁ is infinite, beside the translucent discs of the others.
//!
//! Points may have sizes of their discs, and a tangent each, along which a disc is an ellipse. Without them ellipses may be as long and
//! wide as the cells ([`crate::points::cell_ellipse`]). K is unchanged: a wider disc blurs the surface and does not thicken it.
//!
//! Points that lie on no surface may be balls: discs on the ball about each, which has the radius that the point states.
//!
//! Points at one place share the area of that place, so duplicates neither darken it nor shrink radii to 0.

use crate::ConvertError;
#[cfg(feature = "cache")]
use crate::common::cache::Key;
use crate::common::columns::{self, CHUNK, ColumnSet};
use crate::common::convert_error::check_cancelled;
use crate::common::params::SplatParams;
use crate::points::discs::{Disc, DiscShape, DiscSize, Discs, ball_directions};
use crate::points::materials::materials_of;
use crate::points::matter::check_columns;
use crate::points::neighbours::MAX_NEIGHBOURS;
use crate::points::orient::{self, Orientation};
use crate::points::place_order::{canonical_order, distinct_places};
use crate::points::places::{Place, places};
use crate::splats::footprints::choose_footprints;
use crate::splats::{from_splats, gaussian_points};
use rayon::prelude::*;
use splat_core::RawPoints;
use splat_core::points::attributes::{FOOTPRINT, RADIUS, SHADOW_COEFFICIENT};
use splat_core::text::counted;
use splat_core::{
    Camera, Cloud, Progress, SplatKind,
    glam::{DVec3, Vec3},
    optics,
};

/// Parameters of the conversion of raw points to surfels.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfelParams {
    /// Attributes and limits; `color` is for points without one.
    pub splat: SplatParams,
    /// Whether surfels keep the points' colours.
    pub colors: bool,
    /// Opacity of one crossing, in \[0, 1\]; 1 makes the surface opaque. Opacities of points are multiplied by it.
    pub opacity: f64,
    /// Neighbours that normals and areas come from, 3 to 32.
    pub neighbours: usize,
    /// The side that computed normals point to. Normals of the input stay as they are.
    pub orientation: Orientation,
    /// Whether points at one place become one surfel.
    pub merge_duplicates: bool,
    /// Whether surfels keep the points' values.
    pub values: bool,
    /// Largest spacing over the median spacing: lone points do not become huge discs. At least 1.
    pub largest_spacing: f64,
    /// Spacing of a point without any neighbour, world units.
    pub lone_spacing: f64,
    /// The shape of discs whose points have neither a size nor a tangent.
    pub shape: DiscShape,
    /// The same diameter for all discs, round ones; `None` for the size that points state, or else the size that bridges the
    /// gaps between neighbours.
    pub size: Option<DiscSize>,
    /// The camera whose pixels `size` counts, in the world.
    pub camera: Option<Camera>,
}

impl Default for SurfelParams {
    fn default() -> Self {
        Self {
            splat: SplatParams::default(),
            colors: true,
            opacity: 1.0,
            neighbours: 10,
            orientation: Orientation::default(),
            merge_duplicates: false,
            values: false,
            largest_spacing: 4.0,
            lone_spacing: 1.0,
            shape: DiscShape::Round,
            size: None,
            camera: None,
        }
    }
}

/// The report of a conversion of raw points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfelReport {
    /// Points given.
    pub points: u64,
    /// Points that lie where an earlier one lies.
    pub duplicates: u64,
    /// Points that are shown: as one surfel each, or as a ball of several.
    pub shown: u64,
    /// Surfels made.
    pub splats: u64,
    /// Places whose neighbours lie on a line, so that the normal is a guess; none where neighbours are not asked.
    pub without_plane: u64,
    /// Places whose spacing was cut to the largest.
    pub lone: u64,
    /// Median spacing, world units; 0 without points, and where points have normals and discs one size, so that neighbours are not asked.
    pub median_spacing: f64,
    /// Sum of the areas, world units².
    pub area: f64,
}

impl SurfelReport {
    /// Warns that points at one place have each become a surfel, in a sentence without a full stop.
    pub fn said(&self) -> Option<String> {
        let lie = if self.duplicates == 1 { "lies" } else { "lie" };
        (self.duplicates > 0 && self.shown == self.points)
            .then(|| format!("{} {lie} where another one lies", counted(self.duplicates, "point")))
    }
}

/// Makes surfels of raw points. Columns of the points (`RawPoints::columns`) add a number for each point: `radius`, the length in units of the
/// file within which an opaque disc hides, > 0; `tx`, `ty` and `tz`, a semi-axis of a disc that is an ellipse, as long as it hides that way,
/// whose second one has that radius, and zero for a round disc; `shadow_coefficient`, the share of a shadow that it receives; and `footprint` and
/// `material`, places in [`SplatParams::footprints`] and [`SplatParams::materials`]. Points that are Gaussians become splats that are seen as
/// these, each one, also where several lie at one place; points that are splats stay what they are.
///
/// ```
/// use splat_core::RawPoints;
/// use convert::{SurfelParams, raw_to_surfels};
/// use splat_core::glam::Vec3;
/// let position = (0..100).map(|i| Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32)).collect();
/// let points = RawPoints { position, ..RawPoints::default() };
/// let (cloud, report) = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap();
/// assert!((report.median_spacing - 1.0).abs() < 1e-12);
/// assert!(cloud.normal.iter().all(|n| *n == Vec3::Y));
/// ```
///
/// Places are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::Parameter`], [`ConvertError::Input`], [`ConvertError::Limit`] or [`ConvertError::Cancelled`].
pub fn raw_to_surfels(
    points: &RawPoints,
    params: &SurfelParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, SurfelReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    check(points, params)?;
    if !points.gaussians.is_empty() {
        return gaussian_points::to_cloud(points, params).map(|cloud| {
            let n = points.len() as u64;
            (cloud, SurfelReport { points: n, shown: n, splats: n, ..SurfelReport::default() })
        });
    }
    if !points.ready.cloud.is_empty() {
        return from_splats::to_cloud(points, params).map(|cloud| {
            let n = points.len() as u64;
            (cloud, SurfelReport { points: n, shown: n, splats: n, ..SurfelReport::default() })
        });
    }
    let order = canonical_order(points);
    check_cancelled(progress)?;
    let (distinct, starts) = distinct_places(points, &order);
    let is_ball = params.shape == DiscShape::Balls;
    let has_normals = points.normal.len() == points.len()
        && points.normal.par_iter().with_min_len(CHUNK).all(|n| columns::unit_or_zero(*n) != Vec3::ZERO);
    let states_size = matches!(params.size, Some(DiscSize::World(_)));
    let mut places = if (has_normals || is_ball) && (states_size || is_ball && points.own_column(RADIUS).is_some()) {
        // The size tells the area too, so nothing of a place is asked for.
        progress.add_total(distinct.len() as u64);
        vec![Place { plane: Place::PLANE, ..Place::default() }; distinct.len()]
    } else {
        let turns = !(has_normals || is_ball);
        let orientation =
            if is_ball { Orientation::Propagate } else { known_orientation(&distinct, params, progress)? };
        let params = &SurfelParams { orientation, ..params.clone() };
        places_with_normals(&distinct, points.origin, params, turns, progress)?
    };
    let mut report = SurfelReport {
        points: points.len() as u64,
        duplicates: (points.len() - distinct.len()) as u64,
        without_plane: places.par_iter().with_min_len(CHUNK).filter(|p| p.plane == Place::LINE).count() as u64,
        ..SurfelReport::default()
    };
    cut_outliers(&mut places, params, &mut report);
    let cloud = emit(points, params, &Sorted { order, starts, places }, &mut report)?;
    Ok((cloud, report))
}

/// The share of points that lie on no surface: their ten neighbours lie about as far from the plane that fits them best as along it, as those of particles do
/// that fill space, or they lie along a curve, and no other points beside them. Told by some runs of points along a curve through all of them; 0 for fewer than
/// 33 places, and for points that no conversion takes.
///
/// ```
/// use splat_core::RawPoints;
/// use splat_core::glam::Vec3;
/// let at = |i: usize| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
/// let filled = RawPoints { position: (0..1000).map(at).collect(), ..RawPoints::default() };
/// let flat = RawPoints { position: (0..100).map(at).collect(), ..RawPoints::default() };
/// assert!(convert::scattered_share(&filled) > 0.5 && convert::scattered_share(&flat) == 0.0);
/// ```
pub fn scattered_share(points: &RawPoints) -> f64 {
    const FEW_PLACES: usize = 32;
    const RUNS: usize = 64;
    const RUN: usize = 1024;
    if points.validate().is_err() {
        return 0.0;
    }
    let (distinct, _) = distinct_places(points, &canonical_order(points));
    if distinct.len() < FEW_PLACES {
        return 0.0;
    }
    let starts = (0..distinct.len()).step_by(distinct.len().div_ceil(RUNS).max(RUN));
    let runs =
        starts.map(|start| &distinct[start..distinct.len().min(start + RUN)]).filter(|run| run.len() > FEW_PLACES);
    let params = SurfelParams::default();
    let around = SurfelParams { neighbours: MAX_NEIGHBOURS, ..SurfelParams::default() };
    let mut looked_at = 0;
    let mut scattered = 0;
    for run in runs {
        let Ok((near, _)) = places(run, &params, false, &Progress::new()) else { continue };
        let Ok((_, neighbours)) = places(run, &around, true, &Progress::new()) else { continue };
        looked_at += near.len();
        let is_scattered = |(place, of_place): (u32, &Place)| {
            of_place.plane == Place::SCATTERED || lies_on_curve(run, place, neighbours.around(place))
        };
        scattered += (0..).zip(&near).filter(|place| is_scattered(*place)).count();
    }
    scattered as f64 / looked_at.max(1) as f64
}

/// Whether a place and its nearest neighbours lie along a curve, and those farther away not beside it, as the next lines of a scan do.
fn lies_on_curve(places: &[Vec3], place: u32, around: &[u32]) -> bool {
    /// Nearest neighbours, and what is left beside the direction that they lie along: about 0.1 of their length.
    const NEAR: usize = 10;
    const BESIDE_NEAR: f64 = 0.01;
    /// The same of all neighbours, as the curve may bend: about 0.3.
    const BESIDE_ALL: f64 = 0.1;
    let at = places[place as usize].as_dvec3();
    let beside = |neighbours: &[u32]| {
        let offsets = || neighbours.iter().map(|other| places[*other as usize].as_dvec3() - at);
        let mean = offsets().sum::<DVec3>() / (neighbours.len() + 1) as f64;
        let centred = || offsets().chain([DVec3::ZERO]).map(|offset| offset - mean);
        let squares: DVec3 = centred().map(|offset| offset * offset).sum();
        let products: DVec3 =
            centred().map(|offset| DVec3::new(offset.y * offset.z, offset.z * offset.x, offset.x * offset.y)).sum();
        // Products of two eigenvalues of the covariance over the square of their sum: 0 on a line, 1/4 where two are alike.
        let minors = squares.y * squares.z + squares.z * squares.x + squares.x * squares.y - products.length_squared();
        minors / squares.element_sum().powi(2)
    };
    beside(&around[..around.len().min(NEAR)]) < BESIDE_NEAR && beside(around) < BESIDE_ALL
}

/// Places whose normals point to the side that is asked for, if `turns` says so; those that are kept of the same points, where something is.
fn places_with_normals(
    distinct: &[Vec3],
    origin: DVec3,
    params: &SurfelParams,
    turns: bool,
    progress: &Progress,
) -> Result<Vec<Place>, ConvertError> {
    let find = || {
        let keep_neighbours = turns && params.orientation == Orientation::Propagate;
        let (mut places, neighbours) = places(distinct, params, keep_neighbours, progress)?;
        if !turns {
            return Ok(places);
        }
        orient::orient(&mut places, distinct, origin, params.orientation, &neighbours, progress).map(|()| places)
    };
    #[cfg(feature = "cache")]
    if let Some(cache) = &params.splat.cache {
        let key = place_key(distinct, origin, params, turns);
        let what = format!("normals and areas of object '{}'", params.splat.object_name);
        return cache.get(&what, key, distinct.len(), Place::is_valid, find);
    }
    find()
}

/// All that places and their normals are made from.
#[cfg(feature = "cache")]
fn place_key(distinct: &[Vec3], origin: DVec3, params: &SurfelParams, turns: bool) -> Key {
    let (side, at) = match params.orientation {
        Orientation::Toward(d) | Orientation::Auto(d) => (0u64, d),
        Orientation::Viewpoint(eye) => (1, eye - origin),
        Orientation::Propagate => (2, DVec3::ZERO),
    };
    let lone = params.lone_spacing / params.splat.transform.scale;
    let numbers = [params.neighbours as u64, side, params.shape as u64];
    Key::new(if turns {
        "places, of surfaces or scattered"
    } else {
        "places with normals of any side, of surfaces or scattered"
    })
    .with(distinct)
    .with(&numbers)
    .with(&[at])
    .with(&[lone])
}

/// The orientation, where it depends on what the points enclose: told by some of them, which lie evenly among all.
fn known_orientation(
    distinct: &[Vec3],
    params: &SurfelParams,
    progress: &Progress,
) -> Result<Orientation, ConvertError> {
    /// Places that are enough to tell.
    const ENOUGH: usize = 1 << 16;
    let Orientation::Auto(up) = params.orientation else { return Ok(params.orientation) };
    let some: Vec<Vec3> = distinct.iter().step_by(distinct.len().div_ceil(ENOUGH).max(1)).copied().collect();
    let outwards = SurfelParams { orientation: Orientation::Propagate, ..params.clone() };
    let (mut places, neighbours) = places(&some, &outwards, true, progress)?;
    cut_outliers(&mut places, params, &mut SurfelReport::default());
    orient::orient(&mut places, &some, DVec3::ZERO, Orientation::Propagate, &neighbours, progress)?;
    Ok(if orient::encloses(&places) { Orientation::Propagate } else { Orientation::Toward(up) })
}

pub(crate) fn check(points: &RawPoints, params: &SurfelParams) -> Result<(), ConvertError> {
    let p = &params.splat;
    p.check()?;
    points.validate().and_then(|()| check_columns(points, false)).map_err(|e| p.input(e))?;
    p.check_count(count(points, params) as f64)?;
    if !(0.0..=1.0).contains(&params.opacity) {
        return Err(p.bad("opacity", params.opacity, "a number in [0, 1]"));
    }
    if !(3..=MAX_NEIGHBOURS).contains(&params.neighbours) {
        return Err(p.bad("neighbours", params.neighbours, "3 to 32"));
    }
    if params.largest_spacing.is_nan() || params.largest_spacing < 1.0 {
        return Err(p.bad("largest_spacing", params.largest_spacing, "a number ≥ 1"));
    }
    let expected_size = match (points.gaussians.is_empty(), points.ready.cloud.is_empty()) {
        (true, true) => None,
        (false, _) => Some("none: 3D Gaussians have sizes of their own"),
        (true, false) => Some("none: splats of a file have sizes of their own"),
    };
    if let (Some(size), Some(expected)) = (params.size, expected_size) {
        return Err(p.bad("size", size, expected));
    }
    if let (DiscShape::Elliptical | DiscShape::Balls, Some(expected)) = (params.shape, expected_size) {
        return Err(p.bad("discs", params.shape, expected));
    }
    if let Some(size) = params.size.filter(|size| !size.is_length()) {
        return Err(p.bad("size", size, "a diameter > 0"));
    }
    orient::check(params.orientation).map_err(|(found, expected)| p.bad("orientation", found, expected))?;
    p.check_spacing(params.lone_spacing).map(|_| ())
}

/// Cuts spacings to a multiple of the median; sets the sums of the report.
fn cut_outliers(places: &mut [Place], params: &SurfelParams, report: &mut SurfelReport) {
    if places.is_empty() {
        return;
    }
    let mut spacings: Vec<f64> = places.iter().map(|p| p.spacing).collect();
    let middle = spacings.len() / 2;
    let median = *spacings.select_nth_unstable_by(middle, f64::total_cmp).1;
    let largest = median * params.largest_spacing;
    for p in places.iter_mut().filter(|p| p.spacing > largest) {
        p.area = p.area.min(largest * largest);
        p.spacing = largest;
        report.lone += 1;
    }
    for p in places.iter_mut().filter(|p| f64::from(p.long.length()) > largest) {
        p.long *= (largest / f64::from(p.long.length())) as f32;
        p.across = p.across.min(largest as f32);
    }
    let scale = params.splat.transform.scale;
    report.median_spacing = median * scale;
    report.area = places.iter().map(|p| p.area).sum::<f64>() * scale * scale;
}

/// Points in canonical order and what is known about their places.
struct Sorted {
    order: Vec<u32>,
    starts: Vec<u32>,
    places: Vec<Place>,
}

/// The point and the place of a surfel.
#[derive(Debug, Clone, Copy)]
struct Origin {
    place: u32,
    point: u32,
    /// How many surfels share the place.
    sharers: u32,
    /// Which of the directions of a ball it lies in; 0 of a disc.
    direction: u32,
}

impl Sorted {
    /// Surfels in the order of places: of each point as many as a ball has discs, else one.
    fn surfels(&self, merge: bool, discs_of_each: usize) -> Vec<Origin> {
        let mut surfels = Vec::with_capacity(self.order.len() * discs_of_each);
        for (place, range) in self.starts.windows(2).enumerate() {
            let places = if merge { range[0]..range[0] + 1 } else { range[0]..range[1] };
            let sharers = places.len() as u32;
            for at in places {
                let origin = Origin { place: place as u32, point: self.order[at as usize], sharers, direction: 0 };
                surfels.extend((0..discs_of_each as u32).map(|direction| Origin { direction, ..origin }));
            }
        }
        surfels
    }
}

/// Surfels that points become.
pub(crate) fn count(points: &RawPoints, params: &SurfelParams) -> u64 {
    (points.len() * discs_of_each(points.len(), params)) as u64
}

fn discs_of_each(points: usize, params: &SurfelParams) -> usize {
    if params.shape == DiscShape::Balls { ball_directions(points).len() } else { 1 }
}

/// Which columns surfels fill.
pub(crate) fn column_set(points: &RawPoints, params: &SurfelParams) -> ColumnSet {
    if !points.gaussians.is_empty() {
        return gaussian_points::column_set(points, params);
    }
    if !points.ready.cloud.is_empty() {
        return from_splats::column_set(points);
    }
    ColumnSet {
        normal: true,
        tangent: Discs::new(points, params).are_elliptical() || shows_images(points, params),
        shadow_coefficient: points.own_column(SHADOW_COEFFICIENT).is_some(),
        value: params.values && !points.value.is_empty(),
        crossing_depth: !is_opaque(points, params),
        ..ColumnSet::default()
    }
}

/// Whether some discs may have images as footprints, which lie along a tangent.
fn shows_images(points: &RawPoints, params: &SurfelParams) -> bool {
    let by_column = points.own_column(FOOTPRINT).is_some();
    params.splat.footprints.as_ref().is_some_and(|choice| choice.has_images(by_column && choice.by_column))
}

/// Whether every disc is opaque.
fn is_opaque(points: &RawPoints, params: &SurfelParams) -> bool {
    params.opacity * f64::from(points.least_opacity()) >= 1.0
}

/// The optical depth of one crossing of a surface; `None` for an opaque one.
fn crossing_depth(opacity: f64) -> Option<f64> {
    (opacity < 1.0).then(|| optics::optical_depth(opacity))
}

fn emit(
    points: &RawPoints,
    params: &SurfelParams,
    sorted: &Sorted,
    report: &mut SurfelReport,
) -> Result<Cloud, ConvertError> {
    let t = &params.splat.transform;
    let directions = if params.shape == DiscShape::Balls { ball_directions(points.len()) } else { vec![Vec3::ZERO] };
    let surfels = sorted.surfels(params.merge_duplicates, directions.len());
    let of_surface = crossing_depth(params.opacity);
    let crossing = |point: u32| match points.opacity.get(point as usize) {
        Some(opacity) => crossing_depth(params.opacity * f64::from(*opacity)),
        None => of_surface,
    };
    report.splats = surfels.len() as u64;
    report.shown = (surfels.len() / directions.len()) as u64;
    let mut cloud = Cloud::new(t.apply(points.origin));
    let filled = column_set(points, params);
    let kind = if filled.crossing_depth { SplatKind::Surface } else { SplatKind::Opaque };
    columns::size_columns(&mut cloud, surfels.len(), kind, filled, &params.splat)?;
    let discs = Discs::new(points, params);
    let is_ball = params.shape == DiscShape::Balls;
    let median_spacing = report.median_spacing;
    // In the axes of the file.
    let normal_of = |surfel: &Origin| {
        if is_ball {
            return directions[surfel.direction as usize];
        }
        let given = points.normal.get(surfel.point as usize).map_or(Vec3::ZERO, |n| columns::unit_or_zero(*n));
        if given == Vec3::ZERO { sorted.places[surfel.place as usize].normal } else { given }
    };
    let ball_of = |point: u32| discs.discs_of_ball(discs.ball_radius(point as usize, median_spacing), directions.len());
    let disc_of = |surfel: &Origin| -> Disc {
        if is_ball {
            return ball_of(surfel.point).disc;
        }
        discs.disc(surfel.point as usize, &sorted.places[surfel.place as usize], normal_of(surfel))
    };
    let columns =
        (&mut cloud.position, &mut cloud.normal, &mut cloud.radius, &mut cloud.cross_section, &mut cloud.color);
    columns.into_par_iter().zip(&surfels).with_min_len(CHUNK).for_each(
        |((position, normal, radius, cross_section, color), surfel)| {
            let disc = disc_of(surfel);
            let i = surfel.point as usize;
            let turned = t.rotate(normal_of(surfel).as_dvec3());
            let middle = t.rotation * (points.position[i].as_dvec3() * t.scale);
            let from_middle = if is_ball { turned * ball_of(surfel.point).distance } else { DVec3::ZERO };
            *position = (middle + from_middle).as_vec3();
            *normal = turned.as_vec3();
            *radius = disc.radius as f32;
            *cross_section = (crossing(surfel.point).unwrap_or(1.0) * disc.area / f64::from(surfel.sharers)) as f32;
            *color = points.color.get(i).filter(|_| params.colors).copied().unwrap_or(params.splat.color);
        },
    );
    let tangents = cloud.tangent.par_iter_mut().zip(&surfels).with_min_len(CHUNK);
    tangents.for_each(|(tangent, surfel)| *tangent = disc_of(surfel).tangent.as_vec3());
    let optics = (&mut cloud.crossing_depth, &mut cloud.kind).into_par_iter().zip(&surfels).with_min_len(CHUNK);
    optics.for_each(|((depth, kind), surfel)| match crossing(surfel.point) {
        Some(tau) => *depth = tau as f32,
        None => (*depth, *kind) = (0.0, SplatKind::Opaque),
    });
    let shares = points.own_column(SHADOW_COEFFICIENT).unwrap_or_default();
    let coefficients = cloud.shadow_coefficient.par_iter_mut().zip(&surfels).with_min_len(CHUNK);
    coefficients.for_each(|(coefficient, s)| *coefficient = shares[s.point as usize] as f32);
    let values = cloud.value.par_iter_mut().zip(&surfels).with_min_len(CHUNK);
    values.for_each(|(v, s)| *v = points.value[s.point as usize]);
    if let Some(material_of) = materials_of(points, &params.splat)? {
        cloud
            .material
            .par_iter_mut()
            .zip(&surfels)
            .with_min_len(CHUNK)
            .for_each(|(id, s)| *id = material_of(s.point as usize).id);
    }
    let ids = points.own_column(FOOTPRINT);
    let stated = |k: usize| ids.map_or(0.0, |ids| ids[surfels[k].point as usize]);
    let place = |k: usize| points.position[surfels[k].point as usize];
    choose_footprints(&mut cloud, &params.splat, place, ids.map(|_| &stated as _))?;
    Ok(cloud)
}
