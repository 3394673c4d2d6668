//! One object as the path tracer takes it: a density or a mesh in the world.

use convert::read::{Loaded as FileData, ReadParams};
use convert::{Clip, ExpressionField, SplatParams};
use glam::{DMat3, DQuat, DVec3, Vec3};
use organza::scene::{Scene, SceneMaterial, SceneObject, Source, VolumeSource};
use organza::{Error, RenderOptions, expression_field, printable};
use reference::{
    Classified, ColorAt, Density, Dielectric, Lattice, Liberty, Medium, Placed, Surface, SurfaceKind, SurfaceMaterial,
    TurnedBox,
};
use splat_core::{DAabb, Grid, Mesh, ScalarField, Shading, Similarity, optics};
use std::path::Path;
use std::sync::Arc;

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
    /// What it is cut to, world space.
    clips: Vec<Clip>,
    /// Per channel, where the density is 1.
    extinction: [f64; 3],
    albedo: [f64; 3],
    asymmetry: f64,
    emission: [f64; 3],
    glow: [f64; 3],
    color: Option<Box<dyn Fn(DVec3) -> [f64; 3] + Send + Sync>>,
    liberty: Liberty,
}

/// A density in the world.
enum Shape {
    Box(DAabb),
    Ball { center: DVec3, radius: f64 },
    Grid(Grid),
    Field { field: Placed<ExpressionField>, bounds: DAabb, majorant: f64 },
    Turned { field: TurnedBox, bounds: DAabb },
    Volume(Arc<Classified>),
}

/// The object, or why it has no physical form.
pub(super) fn body(
    scene: &Scene,
    object: &SceneObject,
    options: &RenderOptions,
) -> Result<Result<Body, String>, Error> {
    let no = |reason: &str| Ok(Err(reason.to_owned()));
    let material = &scene.materials[object.material];
    let shading = material.material.shading;
    if material.material.bounds_matter() && object.opacity.unwrap_or(material.opacity) > 0.0 {
        return no("surfaces that bound matter and have an opacity of their own are not path-traced");
    }
    let mesh = match &object.source {
        Source::Points(_) => {
            return no(
                "raw points have no truth by nature: they are samples of a surface that nobody knows, and what lies \
                       between them is the technique's own guess",
            );
        }
        Source::Matter(_) => {
            return no("points that are a medium are not path-traced: nobody knows what lies between them");
        }
        Source::Isosurface(_) | Source::LevelSet(_) | Source::Slice(_) => {
            return no("surfaces of measured fields are not path-traced");
        }
        Source::Implicit(_) if !object.clip.is_empty() => return no("open surfaces are not path-traced"),
        Source::Mesh(path) => match read(path, 0, options)? {
            FileData::Mesh(mesh) => mesh,
            _ => {
                return Err(Error::wrong_kind(
                    path,
                    "a mesh with faces",
                    "use `points = ` or `volume = ` for this file",
                ));
            }
        },
        Source::Implicit(i) => {
            let field = expression_field(&i.expression, object)?;
            let params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
            convert::field_to_mesh(&field, i.bounds, i.spacing * FINER, &params, None)?
        }
        Source::Rectangle(r) => Mesh::rectangle(r.center, r.u, r.v),
        Source::Medium(_) => return medium(scene, object, options).map(Ok),
        Source::Volume(_) | Source::Density(_) | Source::Cloud(_) => {
            // Without lights nothing is shaded by its gradient.
            if shading == Shading::Phong && !scene.lights.is_empty() {
                return no("a medium shaded by its gradient is no scattering medium; `shading = \"phase\"` is one");
            }
            return medium(scene, object, options).map(Ok);
        }
    };
    let mesh = match &object.source {
        Source::Mesh(_) => convert::lidded_mesh(mesh.into(), &object.clip).0,
        _ => convert::clipped_mesh(mesh.into(), &object.clip),
    };
    let mesh = Arc::unwrap_or_clone(mesh);
    if shading == Shading::Phase {
        return no("a surface that scatters by a phase function reflects nothing");
    }
    Ok(Ok(surface(scene, object, mesh)))
}

impl Body {
    /// The density of a medium before it is cut.
    pub(super) fn density(&self) -> Result<Option<Density<'_>>, splat_core::Error> {
        let Self::Medium(body) = self else { return Ok(None) };
        Ok(Some(match &body.shape {
            Shape::Box(bounds) => Density::Box(*bounds),
            Shape::Ball { center, radius } => Density::Ball { center: *center, radius: *radius },
            Shape::Grid(grid) => Density::Grid(Lattice::new(grid)?),
            Shape::Field { field, bounds, majorant } => Density::Field { field, bounds: *bounds, majorant: *majorant },
            Shape::Turned { field, bounds } => Density::Inside { field, bounds: *bounds },
            Shape::Volume(v) => Density::Field { field: &**v, bounds: v.bounds(), majorant: v.most() },
        }))
    }

    /// The medium of this density for the tracer, if it is one.
    pub(super) fn medium<'a>(&'a self, whole: &'a Density<'a>) -> Option<Medium<'a>> {
        let Self::Medium(body) = self else { return None };
        let density = if body.clips.is_empty() { *whole } else { Density::Cut { of: whole, clips: &body.clips } };
        let MediumBody { extinction, albedo, asymmetry, emission, glow, liberty, .. } = *body;
        let color = body.color.as_ref().map(|c| &**c as ColorAt<'_>);
        Some(Medium { density, extinction, albedo, asymmetry, emission, glow, color, liberty })
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

/// Shadows as the object asks for; scattering colours above 1 become a gain, which the rest is divided by.
fn liberty(object: &SceneObject, shading: Shading, brightest: f64) -> Liberty {
    let brightest = if shading == Shading::Unlit { 1.0 } else { brightest };
    Liberty {
        casts_shadow: object.casts_shadow,
        shadow_coefficient: f64::from(object.shadow_coefficient),
        gain: brightest.max(1.0),
    }
}

fn medium(scene: &Scene, object: &SceneObject, options: &RenderOptions) -> Result<Body, Error> {
    let material = &scene.materials[object.material];
    let m = &material.material;
    let ((shape, extinction), clips) = (shape(object, options)?, world_clips(object));
    let asymmetry = f64::from(m.asymmetry);
    let per_channel = m.extinction_rgb.map(|e| extinction * f64::from(e));
    let unlit = m.shading == Shading::Unlit;
    let own = m.emission.map(f64::from);
    let albedo = if unlit { 0.0 } else { f64::from(m.single_scattering_albedo) };
    if let Shape::Volume(volume) = &shape {
        // Colour by place; ambient radiance follows it.
        let liberty = liberty(object, m.shading, volume.brightest());
        let lit = ambient(scene, material, [albedo; 3]);
        let per_color = if unlit { [1.0; 3] } else { std::array::from_fn(|c| lit[c] - own[c]) };
        let (source, gain) = (Arc::clone(volume), liberty.gain);
        let color = Some(Box::new(move |p: DVec3| source.color(p).map(|c| c / gain)) as Box<_>);
        let glow = per_color.map(|g| g * gain);
        let (albedo, emission) = ([albedo; 3], own);
        let extinction = per_channel;
        let body = MediumBody { shape, clips, extinction, albedo, asymmetry, emission, glow, color, liberty };
        return Ok(Body::Medium(body));
    }
    let color = object.color.unwrap_or(material.color).map(f64::from);
    let liberty = liberty(object, m.shading, color.into_iter().fold(0.0, f64::max));
    let scattered = color.map(|c| c * albedo);
    let emission = if unlit { std::array::from_fn(|c| own[c] + color[c]) } else { ambient(scene, material, scattered) };
    let albedo = scattered.map(|s| s / liberty.gain);
    let (glow, color) = ([0.0; 3], None);
    let extinction = per_channel;
    Ok(Body::Medium(MediumBody { shape, clips, extinction, albedo, asymmetry, emission, glow, color, liberty }))
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

/// The density of a medium and the extinction where it is 1.
fn shape(object: &SceneObject, options: &RenderOptions) -> Result<(Shape, f64), Error> {
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
            let params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
            let mut grid = convert::procedural_cloud(&cloud.shape(), cloud.spacing * FINER, &params, None)?;
            grid.origin = t.apply(grid.origin);
            grid.axes = DMat3::from_quat(t.rotation) * grid.axes * t.scale;
            (Shape::Grid(grid), 1.0)
        }
        Source::Density(d) => {
            let field = Placed::new(expression_field(&d.expression, object)?, t, d.bounds);
            let bounds = DAabb::of_points(d.bounds.corners().map(|p| t.apply(p)));
            let majorant = majorant(&field, bounds);
            (Shape::Field { field, bounds, majorant }, d.extinction)
        }
        Source::Volume(VolumeSource { path, frame, transfer }) => {
            let FileData::Grid(grid) = read(path, *frame, options)? else {
                return Err(Error::wrong_kind(path, "a volume", "use `mesh = ` or `points = ` for this file"));
            };
            grid.validate().map_err(|e| Error::input(printable(path), e.to_string(), ""))?;
            (Shape::Volume(Arc::new(Classified::new(grid, transfer.clone(), &t))), 1.0)
        }
        _ => return Err(Error::Internal("a surface is no medium".into())),
    })
}

/// A number that a field does not exceed in a box: the largest upper bound over balls around its cells, or where there is
/// none a guess from samples, which the tracer watches.
fn majorant(field: &Placed<ExpressionField>, bounds: DAabb) -> f64 {
    let (low, size) = (bounds.min, bounds.size());
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
    }
    let brightest = mesh.color.iter().flatten().fold(0.0, |most, c| f32::max(most, *c));
    let mut liberty = liberty(object, m.shading, f64::from(brightest));
    // Shadows are those of opacity, and glass has none.
    liberty.casts_shadow &= !m.bounds_matter();
    let scale = liberty.gain.recip();
    mesh.color.iter_mut().for_each(|c| *c = c.map(|v| (f64::from(v) * scale) as f32));
    let opacity = object.opacity.unwrap_or(material.opacity);
    let kind = if m.bounds_matter() {
        let (eta, absorption) = (m.index.map(f64::from), m.absorption_inside.map(f64::from));
        SurfaceKind::Dielectric(Dielectric { eta, absorption })
    } else if opacity < 1.0 {
        let tau = optics::optical_depth(opacity);
        let opacity = m.extinction_rgb.map(|e| -libm::expm1(-tau * f64::from(e)));
        SurfaceKind::Translucent { opacity, law: m.surface_opacity }
    } else {
        SurfaceKind::Opaque
    };
    let unlit = m.shading == Shading::Unlit;
    let diffuse = [if unlit { 0.0 } else { f64::from(m.diffuse) }; 3];
    let lit = ambient(scene, material, diffuse);
    let emission = m.emission.map(f64::from);
    let per_color = if unlit { [1.0; 3] } else { std::array::from_fn(|c| lit[c] - emission[c]) };
    let material = SurfaceMaterial {
        kind,
        diffuse,
        transmission: f64::from(m.transmission),
        // Not of the colour, so it has no part in the gain.
        specular: if unlit { 0.0 } else { f64::from(m.specular) * scale },
        shininess: f64::from(m.shininess),
        emission,
        glow: per_color.map(|g| g * liberty.gain),
        smooth: true,
        liberty,
    };
    Body::Surface(mesh, material)
}

/// The data of a file; of a series of volumes that of one frame.
fn read(path: &Path, frame: u64, options: &RenderOptions) -> Result<FileData, Error> {
    let params = ReadParams { frame, ..options.read_params() };
    convert::read::file(path, &params, None).map(|read| read.0).map_err(|e| Error::from_read(path, &e))
}

/// Moves a mesh into the world; without normals it gets smooth ones between sharp edges, as its splats do.
fn place(mesh: &mut Mesh, t: &Similarity) {
    convert::part_at_creases(mesh);
    if mesh.normal.is_empty() {
        mesh.normal = convert::vertex_normals(mesh);
    }
    mesh.origin = t.apply(mesh.origin);
    let (turn, scale) = (t.rotation.as_quat(), t.scale as f32);
    mesh.position.iter_mut().for_each(|p: &mut Vec3| *p = turn * (*p * scale));
    mesh.normal.iter_mut().for_each(|n| *n = turn * *n);
}
