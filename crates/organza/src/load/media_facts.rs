//! Facts of media, from their unconverted data and from a few places of it: cheap, and known before anything is
//! converted.

use super::context::Context;
use super::light_statistics;
use super::loading::Loading;
use super::object_context::ObjectContext;
use crate::Error;
use crate::cost::extent::{SlantedBox, shown_length};
use crate::scene::{MatterSource, Scene, SceneLight, SceneObject, Source, SourceData, VolumeSource};
use crate::statistics::MediumFacts;
use convert::MediumBody;
use glam::{DMat3, DVec3};
use splat_core::{DAabb, Grid, RawPoints, ScalarField, Shading};

/// Places along each axis of a volume that are looked at: 13,824 take about two milliseconds.
const PLACES_OF_A_VOLUME: usize = 24;
/// The same of an expression or a procedural cloud, whose places take up to a microsecond and a half.
const PLACES_OF_A_FORMULA: usize = 12;
/// Cells along each axis of a box that points are counted in.
const CELLS_OF_POINTS: usize = 16;
/// Points that are looked at, of more every nth.
const FEW_POINTS: usize = 1 << 16;
/// Standard deviation of the place that receives light, over the diagonal of the medium: a lamp within it lights nothing infinitely.
const SPREAD: f64 = 0.25;

/// The facts of all media in view, in the order of the scene; in an animation those out of view, too.
///
/// # Errors
/// Those of reading their files.
pub(crate) fn media_facts(scene: &Scene, context: Context<'_>) -> Result<Vec<MediumFacts>, Error> {
    let loading = Loading { scene, context };
    let mut facts = Vec::new();
    for (id, object) in loading.visible().filter(|(_, object)| object.source.is_medium()) {
        let sampled = sampled(object, &loading.context(id, 0, 0)).map_err(|e| loading.named(object, e))?;
        facts.extend(sampled.and_then(|sampled| sampled.facts(scene, id)));
    }
    Ok(facts)
}

/// Whether a medium scatters the light of some lamp by a phase function: in light, volumes with Phong's shading reflect it by their gradients.
fn scatters(object: &SceneObject, scene: &Scene) -> bool {
    let is_lit = scene.lights.iter().any(|light| light.light.intensity.iter().any(|i| *i > 0.0));
    let material = &scene.materials[object.material].material;
    let has_gradients = matches!(object.source, Source::Volume(_) | Source::Density(_) | Source::Cloud(_));
    let by_phase = match material.shading {
        Shading::Phase => true,
        Shading::Phong => !has_gradients,
        Shading::Unlit => false,
    };
    is_lit && by_phase && material.single_scattering_albedo > 0.0
}

/// Extinction at places of a box that may be slanted.
struct Sampled {
    /// The corner and the edges of the box, before the object's transform.
    corner: DVec3,
    edges: DMat3,
    /// Distance between splats, world units.
    spacing: f64,
    /// Places along each edge.
    places: [usize; 3],
    /// Extinction of the places, 1/world unit, and the largest channel of their colour; the first edge fastest.
    extinctions: Vec<f64>,
    colors: Vec<f64>,
    is_lattice: bool,
}

impl Sampled {
    /// Looks at the middle of each part of a box. `look` returns extinction and colour at a place, before the object's transform.
    fn new(
        corner: DVec3,
        edges: DMat3,
        places: [usize; 3],
        spacing: f64,
        object: &SceneObject,
        look: impl Fn(DVec3) -> Seen,
    ) -> Self {
        let mut sampled =
            Self { corner, edges, spacing, places, extinctions: Vec::new(), colors: Vec::new(), is_lattice: true };
        for k in 0..places[2] {
            for j in 0..places[1] {
                for i in 0..places[0] {
                    let rank = DVec3::new(i as f64, j as f64, k as f64) + 0.5;
                    let count = DVec3::new(places[0] as f64, places[1] as f64, places[2] as f64);
                    let place = corner + edges * (rank / count);
                    let is_kept = object.clip.iter().all(|clip| clip.keeps(place));
                    let seen = if is_kept { look(place) } else { Seen::NOTHING };
                    sampled.extinctions.push(if seen.extinction.is_finite() { seen.extinction } else { 0.0 });
                    sampled.colors.push(seen.color);
                }
            }
        }
        sampled
    }

    /// The greatest optical depth of the lines along an edge.
    fn longest(&self, edge: usize, length: f64) -> f64 {
        let stride: usize = self.places[..edge].iter().product();
        let count = self.places[edge];
        let starts = (0..self.extinctions.len()).filter(|at| (at / stride).is_multiple_of(count));
        let of_line = |start: usize| (0..count).map(|step| self.extinctions[start + step * stride]).sum::<f64>();
        starts.map(of_line).fold(0.0, f64::max) * length / count as f64
    }

    /// Extinction in the part of the box that a place is in, given in parts of its edges.
    fn at(&self, place: DVec3) -> f64 {
        let cell = |axis: usize| ((place[axis] * self.places[axis] as f64) as usize).min(self.places[axis] - 1);
        self.extinctions[(cell(2) * self.places[1] + cell(1)) * self.places[0] + cell(0)]
    }

    /// The facts; `None` where there is nothing that takes light, or nothing is in view.
    fn facts(&self, scene: &Scene, id: usize) -> Option<MediumFacts> {
        let object = &scene.objects[id];
        let material = &scene.materials[object.material].material;
        let transform = object.transform;
        let edges = [self.edges.x_axis, self.edges.y_axis, self.edges.z_axis];
        let optical_depth = edges
            .iter()
            .enumerate()
            .map(|(rank, edge)| self.longest(rank, edge.length() * transform.scale))
            .fold(0.0, f64::max);
        let sum: f64 = self.extinctions.iter().sum();
        if sum <= 0.0 {
            return None;
        }
        let of_color = |(extinction, color): (&f64, &f64)| extinction * color;
        let colored: f64 = self.extinctions.iter().zip(&self.colors).map(of_color).sum();
        let albedo = (f64::from(material.single_scattering_albedo) * colored / sum).clamp(0.0, 1.0);
        let factor = f64::from(material.greatest_extinction());
        let occupied = self.extinctions.iter().filter(|e| **e > 0.0).count() as f64 / self.extinctions.len() as f64;
        let volume = self.edges.determinant().abs() * transform.scale.powi(3);
        let hull = SlantedBox::of(self.corner, self.edges, &transform);
        let bounds = DAabb::of_points(hull.corners());
        // An animation may bring it into view.
        if scene.frames.is_none() && !scene.camera.may_see_hull(&bounds.corners()) {
            return None;
        }
        let light = light_at(scene, &bounds);
        let cutoff = scene.render.sheets.transmittance_cutoff;
        let shown_length = shown_length(&hull, &scene.camera, cutoff, |place| factor * self.at(place));
        let greatest = self.extinctions.iter().copied().fold(0.0, f64::max);
        Some(MediumFacts {
            object: id,
            albedo: if scatters(object, scene) { albedo } else { 0.0 },
            asymmetry: f64::from(material.asymmetry),
            optical_depth: optical_depth * factor,
            spacing_optical_depth: greatest * factor * self.spacing,
            spacing: self.spacing,
            splats: (occupied * volume / self.spacing.powi(3)).max(1.0),
            bounds,
            shown_length,
            is_lattice: self.is_lattice,
            irradiance: light.irradiance,
            outside_share: light.outside_share,
        })
    }
}

/// What a place has.
struct Seen {
    /// 1/world unit.
    extinction: f64,
    /// The largest channel.
    color: f64,
}

impl Seen {
    const NOTHING: Self = Self { extinction: 0.0, color: 0.0 };
}

/// The largest channel of a colour.
fn brightest(color: [f32; 3]) -> f64 {
    f64::from(color.into_iter().fold(0.0, f32::max))
}

/// Looks at a few places of an object; `None` for what is no medium, and for what nothing is known of.
fn sampled(object: &SceneObject, context: &ObjectContext<'_>) -> Result<Option<Sampled>, Error> {
    let color = brightest(object.color.unwrap_or(context.scene.materials[object.material].color));
    let scale = object.transform.scale;
    let of_box = |bounds: &DAabb, spacing: f64, look: &dyn Fn(DVec3) -> f64| {
        let edges = DMat3::from_diagonal(bounds.max - bounds.min);
        let look = |place| Seen { extinction: look(place), color };
        Sampled::new(bounds.min, edges, [PLACES_OF_A_FORMULA; 3], spacing * scale, object, look)
    };
    Ok(match &object.source {
        Source::Medium(medium) => {
            let is_inside = |place: DVec3| match medium.body {
                MediumBody::Box(_) => true,
                MediumBody::Ball { center, radius } => place.distance_squared(center) <= radius * radius,
            };
            let look = |place| if is_inside(place) { medium.extinction } else { 0.0 };
            Some(of_box(&medium.body.bounds(), medium.spacing, &look))
        }
        Source::Density(density) => {
            let field = density.field()?;
            let look = |place| field.value(place).max(0.0) * density.extinction;
            Some(of_box(&density.bounds, density.spacing, &look))
        }
        Source::Cloud(cloud) => {
            let shape = cloud.shape();
            let boxes = shape.ellipsoids.iter().map(|e| DAabb::around(e.center, e.radii));
            let bounds = boxes.fold(DAabb::EMPTY, DAabb::union);
            let look = |place| shape.density(place) * cloud.extinction;
            (!bounds.is_empty()).then(|| of_box(&bounds, cloud.spacing, &look))
        }
        Source::Volume(source) => match context.read_frame(&source.path, source.frame)? {
            SourceData::Grid(grid) => Some(of_volume(&grid, source, object)),
            // Refused where it is read to be drawn.
            _ => None,
        },
        Source::Matter(source) => match context.read(&source.path)? {
            SourceData::Points(points) => of_points(&points, source, object, color),
            _ => None,
        },
        _ => None,
    })
}

/// Looks at every nth voxel.
fn of_volume(grid: &Grid, source: &VolumeSource, object: &SceneObject) -> Sampled {
    let places = grid.dims.map(|count| count.min(PLACES_OF_A_VOLUME));
    let counts = DVec3::new(grid.dims[0] as f64, grid.dims[1] as f64, grid.dims[2] as f64);
    let edges = grid.axes * DMat3::from_diagonal(counts);
    let corner = grid.origin - grid.axes * DVec3::splat(0.5);
    let place_in_grid = grid.axes.inverse();
    let look = |place: DVec3| {
        let at = (place_in_grid * (place - grid.origin)).round();
        let value = grid.at_clamped(at.x as isize, at.y as isize, at.z as isize);
        if value.is_nan() || object.nodata == Some(value) {
            return Seen::NOTHING;
        }
        let point = source.transfer.at(value);
        Seen { extinction: f64::from(point.extinction), color: brightest(point.color) }
    };
    let spacing = object.spacing.unwrap_or(grid.shortest_step() * object.transform.scale);
    Sampled::new(corner, edges, places, spacing, object, look)
}

/// Counts every nth point in cells of a box: the ones that have points are full of the medium.
fn of_points(points: &RawPoints, source: &MatterSource, object: &SceneObject, color: f64) -> Option<Sampled> {
    let step = points.len().div_ceil(FEW_POINTS).max(1);
    let looked_at = || points.position.iter().step_by(step).map(|place| points.origin + place.as_dvec3());
    let bounds = looked_at().fold(DAabb::EMPTY, |bounds, place| bounds.union(DAabb::new(place, place)));
    if bounds.is_empty() {
        return None;
    }
    let size = (bounds.max - bounds.min).max(DVec3::splat(f64::MIN_POSITIVE));
    let cell = |place: DVec3| {
        let at = (place - bounds.min) / size * CELLS_OF_POINTS as f64;
        let rank = |x: f64| (x as usize).min(CELLS_OF_POINTS - 1);
        (rank(at.z) * CELLS_OF_POINTS + rank(at.y)) * CELLS_OF_POINTS + rank(at.x)
    };
    let mut is_full = vec![false; CELLS_OF_POINTS.pow(3)];
    looked_at().for_each(|place| is_full[cell(place)] = true);
    let look = |place| Seen { extinction: if is_full[cell(place)] { source.extinction } else { 0.0 }, color };
    let occupied = is_full.iter().filter(|full| **full).count() as f64 / is_full.len() as f64;
    let volume = (size.x * size.y * size.z) * object.transform.scale.powi(3) * occupied;
    let spacing = libm::cbrt((volume / points.len() as f64).max(f64::MIN_POSITIVE));
    let sampled = Sampled::new(bounds.min, DMat3::from_diagonal(size), [CELLS_OF_POINTS; 3], spacing, object, look);
    Some(Sampled { is_lattice: false, ..sampled })
}

/// The light in the middle of a medium.
struct LightThere {
    irradiance: f64,
    outside_share: f64,
}

fn light_at(scene: &Scene, bounds: &DAabb) -> LightThere {
    let statistics = light_statistics(&scene.lights, &scene.render.effects);
    let mut arriving = [0.0; 3];
    let mut outside = [0.0; 3];
    for (light, known) in scene.lights.iter().zip(&statistics).filter(|(_, known)| known.is_on != Some(false)) {
        let SceneLight { light, .. } = light;
        let irradiance = light.irradiance(bounds.center(), SPREAD * bounds.diagonal()).irradiance;
        let is_outside = light.shape.place().is_none_or(|place| !bounds.contains(place));
        for channel in 0..3 {
            let received = f64::from(irradiance[channel]);
            arriving[channel] += received;
            outside[channel] += if is_outside && known.may_shadow() { received } else { 0.0 };
        }
    }
    let sum = |channels: [f64; 3]| channels.iter().sum::<f64>();
    LightThere {
        irradiance: arriving.into_iter().fold(0.0, f64::max),
        outside_share: if sum(arriving) > 0.0 { sum(outside) / sum(arriving) } else { 0.0 },
    }
}
