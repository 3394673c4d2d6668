//! A medium of the scene as the path tracer takes it: its density in the world, and what it does with light.

use super::object::{FINER, ambient, liberty, read};
use convert::{ClassifiedGrid, SplatParams};
use field::ExpressionField;
use glam::{DMat3, DQuat, DVec3};
use organza::scene::{Scene, SceneObject, Source, VolumeSource};
use organza::{Error, RenderOptions, printable};
use read::Loaded as FileData;
use reference::{Classified, ColorAt, Density, Facets, Lattice, Liberty, Medium, Placed, TurnedBox};
use splat_core::{Clip, DAabb, Grid, ScalarField, Shading};
use std::sync::Arc;

/// Edges of the cells that bound a field's values, along the longest side of its box.
const MAJORANT_CELLS: f64 = 32.0;
/// What the largest sample is multiplied by where a field gives no bound.
const GUESS: f64 = 1.5;

/// A density with its optical properties.
pub(super) struct MediumBody {
    shape: Shape,
    /// What it is cut to, world space.
    clips: Vec<Clip>,
    /// Per channel, where the density is 1.
    extinction: [f64; 3],
    albedo: [f64; 3],
    asymmetry: f64,
    emission: [f64; 3],
    glow: [f64; 3],
    color: Box<dyn Fn(DVec3) -> [f64; 3] + Send + Sync>,
    mirrors: Option<Mirrors>,
    liberty: Liberty,
}

/// A unit normal by place in the world.
type Normal = Box<dyn Fn(DVec3) -> DVec3 + Send + Sync>;

/// How it reflects about its gradient.
struct Mirrors {
    normal: Normal,
    diffuse: f64,
    transmission: f64,
    specular: f64,
    shininess: f64,
    glow: [f64; 3],
}

/// A density in the world.
enum Shape {
    Box(DAabb),
    Ball { center: DVec3, radius: f64 },
    Grid(Grid),
    Field { field: Arc<Placed<ExpressionField>>, bounds: DAabb, majorant: f64 },
    Turned { field: TurnedBox, bounds: DAabb },
    Volume(Arc<Classified>),
}

impl MediumBody {
    /// The density before it is cut.
    pub(super) fn density(&self) -> Result<Density<'_>, splat_core::Error> {
        Ok(match &self.shape {
            Shape::Box(bounds) => Density::Box(*bounds),
            Shape::Ball { center, radius } => Density::Ball { center: *center, radius: *radius },
            Shape::Grid(grid) => Density::Grid(Lattice::new(grid)?),
            Shape::Field { field, bounds, majorant } => {
                Density::Field { field: &**field, bounds: *bounds, majorant: *majorant }
            }
            Shape::Turned { field, bounds } => Density::Inside { field, bounds: *bounds },
            Shape::Volume(volume) => Density::Volume(volume),
        })
    }

    /// For the tracer, of this density.
    pub(super) fn seen<'a>(&'a self, whole: &'a Density<'a>) -> Medium<'a> {
        let density = if self.clips.is_empty() { *whole } else { Density::Cut { whole, clips: &self.clips } };
        let MediumBody { extinction, albedo, asymmetry, emission, glow, liberty, .. } = *self;
        let color = Some(&*self.color as ColorAt<'_>);
        let facets = self.mirrors.as_ref().map(|m| {
            let Mirrors { diffuse, transmission, specular, shininess, glow, .. } = *m;
            Facets { normal: &*m.normal, diffuse, transmission, specular, shininess, glow }
        });
        Medium { density, extinction, albedo, asymmetry, emission, glow, color, facets, liberty }
    }
}

/// The medium that an object is.
pub(super) fn medium(scene: &Scene, object: &SceneObject, options: &RenderOptions) -> Result<MediumBody, Error> {
    let material = &scene.materials[object.material];
    let m = &material.material;
    let constant = object.color.unwrap_or(material.color);
    // Light that is reflected, or a layer of normals: what gives splats and sheets their gradients.
    let reflects = m.shading == Shading::Phong && (!scene.lights.is_empty() || scene.render.layers.set().normal);
    let (shape, extinction) = shape(scene, object, reflects.then_some(constant), options)?;
    let constant = constant.map(f64::from);
    let (color, brightest): (Box<dyn Fn(DVec3) -> [f64; 3] + Send + Sync>, f64) = match &shape {
        Shape::Volume(volume) => {
            let source = Arc::clone(volume);
            let brightest = volume.brightest();
            (Box::new(move |p| source.color(p)), brightest)
        }
        _ => (Box::new(move |_| constant), constant.into_iter().fold(0.0, f64::max)),
    };
    let liberty = liberty(object, m.shading, brightest);
    let gain = liberty.gain;
    let is_unlit = m.shading == Shading::Unlit;
    let emission = m.emission.map(f64::from);
    // What is given off per unit of colour where this share of light is scattered or reflected.
    let glow = |reflectance: f64| {
        let lit = ambient(scene, material, [reflectance; 3]);
        std::array::from_fn(|c| gain * if is_unlit { 1.0 } else { lit[c] - emission[c] })
    };
    let albedo = if is_unlit { 0.0 } else { f64::from(m.single_scattering_albedo) };
    let normal: Option<Normal> = match &shape {
        Shape::Volume(volume) if reflects => {
            let volume = Arc::clone(volume);
            Some(Box::new(move |p| volume.normal(p)))
        }
        Shape::Field { field, .. } if reflects => {
            let field = Arc::clone(field);
            Some(Box::new(move |p| -field.gradient(p).normalize_or_zero()))
        }
        _ => None,
    };
    let mirrors = normal.map(|normal| Mirrors {
        normal,
        diffuse: f64::from(m.diffuse),
        transmission: f64::from(m.transmission),
        // Not of the colour, so it has no part in the gain.
        specular: f64::from(m.specular) / gain,
        shininess: f64::from(m.shininess),
        glow: glow(f64::from(m.diffuse)),
    });
    Ok(MediumBody {
        shape,
        clips: world_clips(object),
        extinction: m.extinction_rgb.map(|e| extinction * f64::from(e)),
        albedo: [albedo; 3],
        asymmetry: f64::from(m.asymmetry),
        emission,
        glow: glow(albedo),
        color: Box::new(move |p| color(p).map(|c| c / gain)),
        mirrors,
        liberty,
    })
}

/// What an object is cut to, in the world.
fn world_clips(object: &SceneObject) -> Vec<Clip> {
    let t = &object.transform;
    let to_world = |(normal, offset): (DVec3, f64)| {
        let normal = t.rotate(normal);
        Clip::HalfSpace { normal, offset: offset * t.scale + normal.dot(t.translation) }
    };
    object.clip.iter().flat_map(Clip::half_spaces).map(to_world).collect()
}

/// The density of a medium and the extinction where it is 1; a cloud that reflects about its gradient in this colour.
fn shape(
    scene: &Scene,
    object: &SceneObject,
    reflects: Option<[f32; 3]>,
    options: &RenderOptions,
) -> Result<(Shape, f64), Error> {
    let t = object.transform;
    Ok(match &object.source {
        Source::Medium(medium) => {
            let shape = match medium.body {
                convert::MediumBody::Ball { center, radius } => {
                    Shape::Ball { center: t.apply(center), radius: radius * t.scale }
                }
                convert::MediumBody::Box(own) => {
                    let bounds = DAabb::of_points(own.corners().map(|p| t.apply(p)));
                    if t.rotation == DQuat::IDENTITY {
                        Shape::Box(bounds)
                    } else {
                        Shape::Turned { field: TurnedBox::new(own, t), bounds }
                    }
                }
            };
            (shape, medium.extinction)
        }
        Source::Cloud(cloud) => {
            let mut params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
            let mut grid = convert::procedural_cloud(&cloud.shape(), cloud.spacing * FINER, &params, None)?;
            if let Some(color) = reflects {
                params.color = color;
                let transfer = convert::extinction_as_it_is(cloud.shape().extinction, &params)?;
                return Ok((Shape::Volume(Arc::new(Classified::new(grid, transfer, &t))), 1.0));
            }
            grid.origin = t.apply(grid.origin);
            grid.axes = DMat3::from_quat(t.rotation) * grid.axes * t.scale;
            (Shape::Grid(grid), 1.0)
        }
        Source::Density(d) => {
            let field = Placed::new(d.field()?, t, d.bounds);
            let bounds = DAabb::of_points(d.bounds.corners().map(|p| t.apply(p)));
            let majorant = majorant(&field, bounds);
            (Shape::Field { field: Arc::new(field), bounds, majorant }, d.extinction)
        }
        Source::Volume(VolumeSource { path, frame, transfer, .. }) => {
            let FileData::Grid(grid) = read(scene, path, *frame, object.array.as_ref(), options)? else {
                return Err(Error::wrong_kind(path, "a volume", "use `mesh = ` or `points = ` for this file"));
            };
            let gapless = convert::transparent_gaps(&grid, transfer);
            let ClassifiedGrid { grid, transfer } =
                gapless.unwrap_or_else(|| ClassifiedGrid { grid, transfer: transfer.clone() });
            grid.validate().map_err(|e| Error::input(printable(path), e.to_string(), ""))?;
            (Shape::Volume(Arc::new(Classified::new(grid, transfer, &t))), 1.0)
        }
        _ => return Err(Error::Internal("a surface is no medium".into())),
    })
}

/// A number that a field does not exceed in a box: the largest upper bound over balls around its cells, or where there is
/// none a guess from samples, which the tracer watches.
fn majorant(field: &Placed<ExpressionField>, bounds: DAabb) -> f64 {
    let low = bounds.min;
    let size = bounds.size();
    let cell = size.max_element() / MAJORANT_CELLS;
    let count = (size / cell).ceil().max(DVec3::ONE);
    let step = size / count;
    let [nx, ny, nz] = count.to_array().map(|n| n as u64);
    let cells = || {
        (0..nx * ny * nz).map(|k| {
            let index = DVec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / (nx * ny)) as f64);
            low + step * (index + 0.5)
        })
    };
    let bounded = cells()
        .try_fold(0.0f64, |most, middle| field.bound(middle, 0.5 * step.length()).map(|(_, high)| most.max(high)));
    bounded.unwrap_or_else(|| {
        let corners = |middle: DVec3| (0..27).map(move |k: i32| middle + 0.5 * step * offset(k));
        GUESS * cells().flat_map(corners).map(|p| field.value(p)).fold(0.0, f64::max)
    })
}

/// Corners, middles of edges and faces, and the centre of the cube from −1 to 1.
fn offset(k: i32) -> DVec3 {
    DVec3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) - 1.0
}
