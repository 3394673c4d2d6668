//! Size and orientation of the discs of points: one size for all, the values of their file, or an estimate from their
//! neighbours.

use crate::points::places::Place;
use crate::{SplatParams, SurfelParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::points::attributes::{FOOTPRINT, MATERIAL, RADIUS, TANGENT};
use splat_core::{Camera, Footprint, RawPoints};
use std::f64::consts::PI;

/// The shape of discs whose points state none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DiscShape {
    /// Round: as wide as the farthest gap.
    #[default]
    Round,
    /// As long and wide as the points' own cells: lines of a scan are not blurred along for the gaps between them.
    Elliptical,
    /// A ball of discs about each point, for points that lie on no surface.
    Balls,
}

/// Discs of all balls together, as long as that makes none of too few or of more than are seen.
const BALL_DISCS: usize = 400_000;
const DISCS_OF_BALL: [usize; 2] = [6, 512];
/// Radius of balls that state none, in median spacings: they touch some of their neighbours.
const BALL_RADIUS: f64 = 0.25;
/// Radius within which discs of a ball hide over the root of their area: on a Fibonacci lattice no place is farther from the nearest.
const BALL_COVER: f64 = 0.9;
/// Least distance of discs from the middle of their ball, over its radius.
const LEAST_DISTANCE: f64 = 0.4;

/// Directions from the middle of each of so many balls to its discs, spread evenly.
pub(crate) fn ball_directions(balls: usize) -> Vec<Vec3> {
    let [least, most] = DISCS_OF_BALL;
    let count = (BALL_DISCS / balls.max(1)).clamp(least, most);
    let golden_angle = PI * (3.0 - 5.0f64.sqrt());
    let direction = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let across = (1.0 - z * z).sqrt();
        let turn = golden_angle * k as f64;
        DVec3::new(across * libm::cos(turn), across * libm::sin(turn), z).as_vec3()
    };
    (0..count).map(direction).collect()
}

/// The diameter within which an opaque disc hides what is behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DiscSize {
    /// World units, > 0.
    World(f64),
    /// Pixels of the camera, > 0, whatever the distance: of a disc that faces it.
    Pixels(f64),
}

impl DiscSize {
    /// The diameter at a place in the world; `None` where it has none: at the eye itself, and in pixels without a camera.
    fn at(self, place: DVec3, camera: Option<&Camera>) -> Option<f64> {
        let diameter = match self {
            Self::World(diameter) => diameter,
            Self::Pixels(pixels) => {
                let camera = camera?;
                // Behind the eye, where nothing is seen, shadows are of discs as large as before it.
                let depth = if camera.is_orthographic() { 1.0 } else { camera.view_from_world(place).z.abs() };
                pixels * depth / camera.focal_px()
            }
        };
        (diameter > 0.0).then_some(diameter)
    }

    pub(crate) fn is_length(self) -> bool {
        let (Self::World(diameter) | Self::Pixels(diameter)) = self;
        diameter.is_finite() && diameter > 0.0
    }
}

/// One disc, world units.
pub(crate) struct Disc {
    /// Cutoff radius; of an ellipse its second semi-axis.
    pub(crate) radius: f64,
    /// First semi-axis, or zero for a round disc.
    pub(crate) tangent: DVec3,
    /// The area that it stands for.
    pub(crate) area: f64,
}

/// The discs of a ball, which are alike.
pub(crate) struct BallDiscs {
    pub(crate) disc: Disc,
    /// From the middle of the ball, world units.
    pub(crate) distance: f64,
}

/// What says how the discs of some points lie.
pub(crate) struct Discs<'a> {
    points: &'a RawPoints,
    params: &'a SurfelParams,
    radius: Option<&'a [f64]>,
    tangent: Option<[&'a [f64]; 3]>,
}

impl<'a> Discs<'a> {
    pub(crate) fn new(points: &'a RawPoints, params: &'a SurfelParams) -> Self {
        let stated = |name: &str| points.own_column(name).filter(|_| params.size.is_none());
        let [x, y, z] = TANGENT.map(stated);
        Self { points, params, radius: stated(RADIUS), tangent: x.zip(y).zip(z).map(|((x, y), z)| [x, y, z]) }
    }

    /// Radius of the ball about point `i`, world units; `median_spacing` in these, too.
    pub(crate) fn ball_radius(&self, i: usize, median_spacing: f64) -> f64 {
        let t = &self.params.splat.transform;
        let place = || t.apply(self.points.origin + self.points.position[i].as_dvec3());
        let by_size = self.params.size.and_then(|size| size.at(place(), self.params.camera.as_ref()));
        let stated = by_size.map(|diameter| 0.5 * diameter).or_else(|| Some(self.radius?[i] * t.scale));
        stated.unwrap_or(BALL_RADIUS * median_spacing)
    }

    /// The discs of a ball of this radius, `count` of them.
    pub(crate) fn discs_of_ball(&self, radius: f64, count: usize) -> BallDiscs {
        let area = 4.0 * PI * radius * radius / count as f64;
        let hides = BALL_COVER * area.sqrt();
        let disc = Disc { radius: hides / f64::from(Footprint::CORE), tangent: DVec3::ZERO, area };
        // The outline goes from middles of discs to their rims: it has the ball's area in the mean.
        let distance = (radius * radius - 0.5 * hides * hides).max(0.0).sqrt().max(LEAST_DISTANCE * radius);
        BallDiscs { disc, distance }
    }

    /// Whether some may be ellipses.
    pub(crate) fn are_elliptical(&self) -> bool {
        if self.params.shape == DiscShape::Balls {
            return false;
        }
        let by_cells = self.radius.is_none() && self.params.size.is_none();
        self.tangent.is_some() || by_cells && self.params.shape == DiscShape::Elliptical
    }

    /// The disc of point `i` across `normal`, a unit vector in the axes of the file.
    pub(crate) fn disc(&self, i: usize, known: &Place, normal: Vec3) -> Disc {
        let splat = &self.params.splat;
        let t = &splat.transform;
        let core = f64::from(Footprint::CORE);
        let place = || t.apply(self.points.origin + self.points.position[i].as_dvec3());
        if let Some(diameter) = self.params.size.and_then(|size| size.at(place(), self.params.camera.as_ref())) {
            let radius = 0.5 * diameter / core;
            return Disc { radius, tangent: DVec3::ZERO, area: (radius / splat.radius(1.0)).powi(2) };
        }
        let area = known.area * t.scale * t.scale;
        let radius = self.radius.map(|radii| radii[i] * t.scale / core);
        if let Some(tangent) = self.tangent {
            let stated = DVec3::from_array(tangent.map(|column| column[i])) * (t.scale / core);
            let radius = radius.unwrap_or_else(|| splat.radius(known.spacing * t.scale));
            return Disc { radius, tangent: t.rotate(in_plane(stated, normal)), area };
        }
        if let Some(radius) = radius {
            return Disc { radius, tangent: DVec3::ZERO, area };
        }
        let long = in_plane(known.long.as_dvec3(), normal);
        let (spacing, tangent) = if long == DVec3::ZERO {
            (known.spacing, DVec3::ZERO)
        } else {
            (f64::from(known.across), t.rotate(long * splat.radius(t.scale)))
        };
        Disc { radius: splat.radius(spacing * t.scale), tangent, area }
    }
}

/// The part of a vector that lies in the plane across `normal`; zero of one that stands on it.
fn in_plane(vector: DVec3, normal: Vec3) -> DVec3 {
    /// Share of its length below which nothing is left but rounding.
    const STANDS: f64 = 1e-6;
    let normal = normal.as_dvec3();
    let flat = vector - normal * normal.dot(vector);
    if flat.length() > STANDS * vector.length() { flat } else { DVec3::ZERO }
}

/// What surfels make no use of in the columns that their points have, one sentence without a full stop each.
pub(crate) fn unused_by_discs(
    points: &RawPoints,
    has_size: bool,
    shape: DiscShape,
    splat: &SplatParams,
) -> Vec<String> {
    let has = |name: &str| points.own_column(name).is_some();
    let mut said = Vec::new();
    let radius = has(RADIUS);
    let missing = TANGENT.into_iter().find(|name| !has(name));
    let tangent = TANGENT.into_iter().find(|name| has(name));
    if shape == DiscShape::Balls {
        said.extend(tangent.map(|name| format!("`{name}` is not used: balls are alike on all sides")));
        if !points.normal.is_empty() {
            said.push("normals are not used: balls have their own".to_owned());
        }
        if radius && has_size {
            said.push(format!("`{RADIUS}` is not used beside `point_size`"));
        }
        return said;
    }
    match (tangent, missing) {
        (Some(name), Some(missing)) => said.push(format!("`{name}` is not used: a tangent has `{missing}` too")),
        (Some(name), None) if has_size => said.push(format!("`{name}` is not used beside `point_size`")),
        _ => {}
    }
    if radius && has_size {
        said.push(format!("`{RADIUS}` is not used beside `point_size`"));
    }
    if has(FOOTPRINT) && splat.footprints.as_ref().is_some_and(|choice| !choice.by_column) {
        said.push(format!("`{FOOTPRINT}` of the file is not used: the object has one"));
    }
    if has(MATERIAL) && splat.materials.is_none() {
        said.push(format!("`{MATERIAL}` of the file is not used: the object has one, and no list `materials`"));
    }
    if (radius || tangent.is_some() && missing.is_none()) && shape == DiscShape::Elliptical {
        said.push("discs have the sizes of the file, and not those of their cells".to_owned());
    }
    said
}
