//! One object as the path tracer takes it: a density or a mesh in the world.

use crate::load::object::{cloud_shape, field, refuse, wrong_kind};
use crate::scene::{MediumShape, Scene, SceneMaterial, SceneObject, Source};
use crate::{Error, RenderOptions};
use convert::read::{Loaded as FileData, ReadLimits};
use convert::{ExpressionField, SplatParams};
use glam::{DMat3, DQuat, DVec3, Vec3};
use reference::{Density, Lattice, Medium, Surface, SurfaceKind, SurfaceMaterial};
use splat_core::{Grid, Mesh, ScalarField, Shading, Similarity, optics};
use std::path::Path;

/// Steps of the truth to one step of the splats.
const FINER: f64 = 0.5;
/// Edges of the cells that bound a field's values, along the longest side of its box.
const MAJORANT_CELLS: f64 = 32.0;
/// What the largest sample is multiplied by where a field gives no bound.
const GUESS: f64 = 1.5;

/// An object of the scene, with what the tracer borrows.
pub(super) enum Body {
    /// A medium.
    Medium(MediumBody),
    /// A surface.
    Surface(Mesh, SurfaceMaterial),
}

/// A density with its optical properties.
pub(super) struct MediumBody {
    shape: Shape,
    /// Per channel, where the density is 1.
    extinction: [f64; 3],
    albedo: [f64; 3],
    asymmetry: f64,
    emission: [f64; 3],
}

/// A density in the world.
enum Shape {
    Box([DVec3; 2]),
    Ball { center: DVec3, radius: f64 },
    Grid(Grid),
    Field { field: Placed, bounds: [DVec3; 2], majorant: f64 },
}

/// The object, or why it has no physical form.
pub(super) fn body(
    scene: &Scene,
    object: &SceneObject,
    options: &RenderOptions,
) -> Result<Result<Body, String>, Error> {
    let no = |reason: &str| Ok(Err(reason.to_owned()));
    if !object.casts_shadow || object.shadow_coefficient != 1.0 {
        return no("its shadows are turned off or scaled");
    }
    let material = &scene.materials[object.material];
    if object.color.unwrap_or(material.color).iter().any(|c| *c > 1.0) && material.material.shading != Shading::Unlit {
        return no("a colour above 1 scatters more light than arrives");
    }
    let mesh = match &object.source {
        Source::Points(_) => return no("raw points have nothing between them"),
        Source::Volume(_) => return no("classified volumes are not path-traced"),
        Source::Mesh(path) => file(path, options)?,
        Source::Implicit(i) => {
            let field = field(&i.expression, object)?;
            let params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
            convert::field_to_mesh(&field, i.bounds, i.spacing * FINER, &params).map_err(|e| refuse(&e))?
        }
        Source::Rectangle(r) => rectangle(r.center, r.u, r.v),
        Source::Density(_) | Source::Cloud(_) | Source::Medium(_) => {
            if material.material.shading == Shading::Phong {
                return no("a medium shaded by its gradient is no scattering medium");
            }
            return Ok(match shape(object)? {
                Ok((shape, extinction)) => Ok(medium(scene, object, shape, extinction)),
                Err(reason) => Err(reason),
            });
        }
    };
    if material.material.shading == Shading::Phase {
        return no("a surface that scatters by a phase function reflects nothing");
    }
    Ok(Ok(surface(scene, object, mesh)))
}

impl Body {
    /// The medium for the tracer, if it is one.
    pub(super) fn medium(&self) -> Result<Option<Medium<'_>>, splat_core::Error> {
        let Self::Medium(body) = self else { return Ok(None) };
        let density = match &body.shape {
            Shape::Box(bounds) => Density::Box(*bounds),
            Shape::Ball { center, radius } => Density::Ball { center: *center, radius: *radius },
            Shape::Grid(grid) => Density::Grid(Lattice::new(grid)?),
            Shape::Field { field, bounds, majorant } => Density::Field { field, bounds: *bounds, majorant: *majorant },
        };
        let MediumBody { extinction, albedo, asymmetry, emission, .. } = *body;
        Ok(Some(Medium { extinction, albedo, asymmetry, emission, ..Medium::new(density, 1.0, 0.0) }))
    }

    /// The surface for the tracer, if it is one.
    pub(super) fn surface(&self) -> Option<Surface<'_>> {
        let Self::Surface(mesh, material) = self else { return None };
        Some(Surface { mesh, material: *material })
    }
}

/// Ambient radiance reaches splats unshadowed, so to the eye it is emission.
fn ambient(scene: &Scene, material: &SceneMaterial, reflectance: [f64; 3]) -> [f64; 3] {
    let m = &material.material;
    std::array::from_fn(|c| f64::from(m.emission[c]) + f64::from(scene.ambient[c] * m.ambient) * reflectance[c])
}

fn medium(scene: &Scene, object: &SceneObject, shape: Shape, extinction: f64) -> Body {
    let material = &scene.materials[object.material];
    let m = &material.material;
    let color = object.color.unwrap_or(material.color).map(f64::from);
    let albedo = color.map(|c| c * f64::from(m.single_scattering_albedo));
    let (albedo, emission) = if m.shading == Shading::Unlit {
        ([0.0; 3], std::array::from_fn(|c| f64::from(m.emission[c]) + color[c]))
    } else {
        (albedo, ambient(scene, material, albedo))
    };
    let extinction = m.extinction_rgb.map(|e| extinction * f64::from(e));
    Body::Medium(MediumBody { shape, extinction, albedo, asymmetry: f64::from(m.asymmetry), emission })
}

/// The density of a medium and the extinction where it is 1, or why there is none.
fn shape(object: &SceneObject) -> Result<Result<(Shape, f64), String>, Error> {
    let t = object.transform;
    let turned = t.rotation != DQuat::IDENTITY;
    Ok(match &object.source {
        Source::Medium(MediumShape::Ball { center, radius, extinction, .. }) => {
            Ok((Shape::Ball { center: t.apply(*center), radius: radius * t.scale }, *extinction))
        }
        Source::Cloud(cloud) => {
            let params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
            let grid = convert::procedural_cloud(&cloud_shape(cloud), cloud.spacing * FINER, &params);
            let mut grid = grid.map_err(|e| refuse(&e))?;
            grid.origin = t.apply(grid.origin);
            grid.axes = DMat3::from_quat(t.rotation) * grid.axes * t.scale;
            Ok((Shape::Grid(grid), 1.0))
        }
        _ if turned => Err("a rotated box of a medium is not path-traced".into()),
        Source::Medium(MediumShape::Box { min, max, extinction, .. }) => {
            Ok((Shape::Box([t.apply(*min), t.apply(*max)]), *extinction))
        }
        Source::Density(d) => {
            let field = Placed { field: field(&d.expression, object)?, transform: t };
            let bounds = d.bounds.map(|p| t.apply(p));
            let majorant = majorant(&field, bounds);
            Ok((Shape::Field { field, bounds, majorant }, d.extinction))
        }
        _ => Err("it is no medium".into()),
    })
}

/// A number that a field does not exceed in a box: the largest upper bound over balls around its cells, or where there is
/// none a guess from samples, which the tracer watches.
fn majorant(field: &Placed, [low, high]: [DVec3; 2]) -> f64 {
    let size = high - low;
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

fn surface(scene: &Scene, object: &SceneObject, mut mesh: Mesh) -> Body {
    let material = &scene.materials[object.material];
    let m = &material.material;
    place(&mut mesh, &object.transform);
    let tint = object.color.unwrap_or(material.color);
    if mesh.color.is_empty() || object.color.is_some() {
        mesh.color = vec![tint; mesh.position.len()];
    } else {
        mesh.color.iter_mut().for_each(|c| (0..3).for_each(|k| c[k] *= tint[k]));
    }
    let opacity = object.opacity.unwrap_or(material.opacity);
    let kind = if opacity < 1.0 {
        let tau = optics::optical_depth(opacity);
        let opacity = m.extinction_rgb.map(|e| -(-tau * f64::from(e)).exp_m1());
        SurfaceKind::Translucent { opacity, law: m.surface_opacity }
    } else {
        SurfaceKind::Opaque
    };
    let unlit = m.shading == Shading::Unlit;
    let diffuse = [if unlit { 0.0 } else { f64::from(m.diffuse) }; 3];
    let lit = ambient(scene, material, diffuse);
    let emission = m.emission.map(f64::from);
    let glow = if unlit { [1.0; 3] } else { std::array::from_fn(|c| lit[c] - emission[c]) };
    let material = SurfaceMaterial {
        kind,
        diffuse,
        transmission: f64::from(m.transmission),
        specular: if unlit { 0.0 } else { f64::from(m.specular) },
        shininess: f64::from(m.shininess),
        emission,
        glow,
        smooth: true,
    };
    Body::Surface(mesh, material)
}

fn file(path: &Path, options: &RenderOptions) -> Result<Mesh, Error> {
    let limits = ReadLimits { max_bytes: options.max_memory, drop_invalid: options.drop_invalid };
    match convert::read::file(path, &limits).map_err(|e| Error::from_read(path, &e))? {
        FileData::Mesh(mesh) => Ok(mesh),
        _ => Err(wrong_kind(path, "a mesh with faces", "use `points = ` or `volume = ` for this file")),
    }
}

fn rectangle(center: DVec3, u: DVec3, v: DVec3) -> Mesh {
    let corner = |s: f64, t: f64| (u * s + v * t).as_vec3();
    Mesh {
        origin: center,
        position: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// Moves a mesh into the world; without normals it gets smooth ones, as its splats do.
fn place(mesh: &mut Mesh, t: &Similarity) {
    if mesh.normal.is_empty() {
        mesh.normal = convert::vertex_normals(mesh);
    }
    mesh.origin = t.apply(mesh.origin);
    let (turn, scale) = (t.rotation.as_quat(), t.scale as f32);
    mesh.position.iter_mut().for_each(|p: &mut Vec3| *p = turn * (*p * scale));
    mesh.normal.iter_mut().for_each(|n| *n = turn * *n);
}

/// A field of an object's own space, in the world.
pub(super) struct Placed {
    field: ExpressionField,
    transform: Similarity,
}

impl Placed {
    fn local(&self, p: DVec3) -> DVec3 {
        self.transform.rotation.inverse() * (p - self.transform.translation) / self.transform.scale
    }
}

impl ScalarField for Placed {
    fn value(&self, p: DVec3) -> f64 {
        self.field.value(self.local(p))
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.transform.rotate(self.field.gradient(self.local(p))) / self.transform.scale
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let turn = DMat3::from_quat(self.transform.rotation);
        let scale = self.transform.scale * self.transform.scale;
        turn * self.field.hessian(self.local(p)) * turn.transpose() * (1.0 / scale)
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        self.field.bound(self.local(p), radius / self.transform.scale)
    }
}
