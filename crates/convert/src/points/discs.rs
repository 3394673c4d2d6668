//! Size and orientation of the discs of points: one size for all, the values of their file, or an estimate from their
//! neighbours.

use crate::points::places::Place;
use crate::{SplatParams, SurfelParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::points::attributes::{FOOTPRINT, MATERIAL, RADIUS, TANGENT};
use splat_core::{Camera, Footprint, RawPoints};

/// The shape of discs whose points state none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DiscShape {
    /// Round: as wide as the farthest gap.
    #[default]
    Round,
    /// As long and wide as the points' own cells: lines of a scan are not blurred along for the gaps between them.
    Elliptical,
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

    /// Whether some may be ellipses.
    pub(crate) fn are_elliptical(&self) -> bool {
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
