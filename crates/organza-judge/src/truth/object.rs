//! An object in the path tracer's form: a density or a mesh in the world.

use super::medium::{MediumBody, medium};
use convert::SplatParams;
use field::{MpuParams, Solid};
use glam::Vec3;
use organza::scene::{Scene, SceneMaterial, SceneObject, Source};
use organza::{Error, RenderOptions, SourceData, printable};
use read::{Loaded as FileData, ReadParams, Textures};
use reference::{Density, Dielectric, Liberty, Medium, Surface, SurfaceKind, SurfaceMaterial};
use splat_core::{DAabb, Grid, Mesh, RadianceImage, RawPoints, ScalarField, Shading, Similarity, optics};
use std::path::Path;
use std::sync::Arc;

/// Steps of the truth to one step of the splats.
pub(super) const FINER: f64 = 0.5;
/// The same for solids of several, whose edges are cut off within a step.
const FINER_EDGES: f64 = 0.25;
/// Lattice points on which a solid is looked for, at most: parts of measured data may be finer than the whole can be.
const MOST_POINTS: f64 = 2e8;
/// An object of the scene, with what the tracer borrows.
pub(super) enum Body {
    /// A medium.
    Medium(MediumBody),
    /// A surface.
    Surface(Mesh, SurfaceMaterial),
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
    if object.field.is_some() {
        return no("surfaces that show a field are not path-traced");
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
        Source::Extract(_) => return no("what a light sees first is not path-traced: it is points of a shadow map"),
        Source::Isosurface(_) | Source::LevelSet(_) | Source::Slice(_) => {
            return no("surfaces of measured fields are not path-traced");
        }
        Source::Implicit(_) | Source::Combined(_) if !object.clip.is_empty() => {
            return no("open surfaces are not path-traced");
        }
        Source::Combined(_) => combined(scene, object, options)?,
        Source::Mesh(path) => match read(scene, path, 0, None, options)? {
            FileData::Mesh(mesh) if !mesh.opacity.is_empty() => {
                return no("meshes whose vertices have opacities are not path-traced");
            }
            FileData::Mesh(mesh) => mesh,
            FileData::Grid(_) => return no("surfaces of labels are not path-traced"),
            _ => {
                return Err(Error::wrong_kind(
                    path,
                    "a mesh with faces",
                    "use `points = ` or `volume = ` for this file",
                ));
            }
        },
        Source::Implicit(i) => mesh_of(&i.field()?, i.bounds, i.spacing * FINER, object)?,
        Source::Rectangle(r) => Mesh::rectangle(r.center, r.u, r.v),
        Source::Medium(_) | Source::Volume(_) | Source::Density(_) | Source::Cloud(_) => {
            return medium(scene, object, options).map(|body| Ok(Body::Medium(body)));
        }
    };
    let mesh = match &object.source {
        Source::Mesh(_) => convert::lidded_mesh(mesh.into(), &object.clip).mesh,
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
        body.density().map(Some)
    }

    /// The medium of this density for the tracer, if it is one.
    pub(super) fn medium<'a>(&'a self, whole: &'a Density<'a>) -> Option<Medium<'a>> {
        let Self::Medium(body) = self else { return None };
        Some(body.seen(whole))
    }

    /// The surface for the tracer, if it is one.
    pub(super) fn surface(&self) -> Option<Surface<'_>> {
        let Self::Surface(mesh, material) = self else { return None };
        Some(Surface { mesh, material: *material })
    }
}

/// The surface of a field with steps so wide.
fn mesh_of(field: &dyn ScalarField, bounds: DAabb, step: f64, object: &SceneObject) -> Result<Mesh, Error> {
    let params = SplatParams { object_name: object.name.clone(), ..SplatParams::default() };
    Ok(convert::field_to_mesh(field, bounds, step, &params, None)?)
}

/// The surface of a solid of several, by steps finer than those of its splats.
fn combined(scene: &Scene, object: &SceneObject, options: &RenderOptions) -> Result<Mesh, Error> {
    let solid = solid(scene, &object.source, object, options)?;
    let step = object.spacing.map_or(solid.step, |spacing| spacing / object.transform.scale);
    let least = libm::cbrt(solid.bounds.size().element_product() / MOST_POINTS);
    mesh_of(solid.field.as_ref(), solid.bounds, (step * FINER_EDGES).max(least), object)
}

/// The solid of a field, by the field itself, or of several.
fn solid(scene: &Scene, source: &Source, object: &SceneObject, options: &RenderOptions) -> Result<Solid, Error> {
    let refused = |e| Error::from_core("a solid", e);
    match source {
        Source::Implicit(i) => {
            let field = Arc::new(i.field()?);
            let walls = Vec::new();
            Ok(Solid { field, walls, bounds: i.bounds, step: i.spacing }.closed())
        }
        Source::Isosurface(i) => match read(scene, &i.path, i.frame, object.array.as_ref(), options)? {
            FileData::Grid(grid) => {
                let grid = convert::gaps_outside(&grid, i.level as f32, i.inside).unwrap_or(grid);
                Solid::of_volume(grid.into(), i.interpolation, i.level, i.inside).map_err(refused)
            }
            _ => Err(Error::wrong_kind(&i.path, "a volume", "use `mesh = ` or `points = ` for this file")),
        },
        Source::LevelSet(l) => {
            let points = match read(scene, &l.path, 0, None, options)? {
                FileData::Points(points) => points,
                FileData::Mesh(mesh) => RawPoints::of_vertices(&mesh),
                _ => {
                    return Err(Error::wrong_kind(
                        &l.path,
                        "points",
                        "use `volume = ` or `isosurface = ` for this file",
                    ));
                }
            };
            let params = MpuParams { object_name: object.name.clone(), tolerance: l.tolerance, ..MpuParams::default() };
            let (field, _) = convert::points_to_field(&points, &params, None)?;
            let bounds = field.bounds();
            Ok(Solid::of_points(Arc::new(field), bounds))
        }
        Source::Combined(source) => {
            let parts =
                source.parts.iter().map(|part| solid(scene, part, object, options)).collect::<Result<_, _>>()?;
            Solid::combined(source.combination, parts).map_err(refused)
        }
        _ => Err(Error::Internal("a solid is of a source that has no field".into())),
    }
}

/// Ambient radiance reaches splats unshadowed, so to the eye it is emission.
pub(super) fn ambient(scene: &Scene, material: &SceneMaterial, reflectance: [f64; 3]) -> [f64; 3] {
    let m = &material.material;
    std::array::from_fn(|c| f64::from(m.emission[c]) + f64::from(scene.ambient[c] * m.ambient) * reflectance[c])
}

/// Shadows as the object asks for; scattering colours above 1 become a gain, which the rest is divided by.
pub(super) fn liberty(object: &SceneObject, shading: Shading, brightest: f64) -> Liberty {
    let brightest = if shading == Shading::Unlit { 1.0 } else { brightest };
    Liberty {
        casts_shadow: object.casts_shadow,
        shadow_coefficient: f64::from(object.shadow_coefficient),
        gain: brightest.max(1.0),
    }
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
        let eta = m.index_inside().map(f64::from);
        let absorption = m.absorption_inside.map(f64::from);
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

/// The data of a source; of a series of volumes that of one frame.
pub(super) fn read(
    scene: &Scene,
    path: &Path,
    frame: u64,
    array: Option<&String>,
    options: &RenderOptions,
) -> Result<FileData, Error> {
    let is_mesh = |object: &SceneObject| matches!(&object.source, Source::Mesh(mesh) if mesh == path);
    let surfaces = scene.objects.iter().any(is_mesh);
    let array = array.cloned();
    let params = ReadParams { frame, array, surfaces, textures: Textures::Divided, ..options.read_params() };
    match scene.in_memory.get(path) {
        Some(SourceData::Mesh(mesh)) => {
            let turned = read::mesh_in_memory(&printable(path), Mesh::clone(mesh), &params);
            return turned.map(|(mesh, _)| FileData::Mesh(mesh)).map_err(|e| Error::from_read(path, &e));
        }
        Some(SourceData::Painted(mesh, painting)) => {
            let divided = painting
                .divided(mesh, 0.0, &params, None)
                .and_then(|(mesh, _)| read::mesh_in_memory(&printable(path), mesh, &params));
            return divided.map(|(mesh, _)| FileData::Mesh(mesh)).map_err(|e| Error::from_read(path, &e));
        }
        Some(SourceData::Points(points)) => return Ok(FileData::Points(RawPoints::clone(points))),
        Some(SourceData::Grid(grid)) => return Ok(FileData::Grid(Grid::clone(grid))),
        Some(SourceData::Image(image)) => return Ok(FileData::Image(RadianceImage::clone(image))),
        None => {}
    }
    read::file(path, &params, None).map(|read| read.0).map_err(|e| Error::from_read(path, &e))
}

/// Moves a mesh into the world; without normals it gets smooth ones between sharp edges, as its splats do.
fn place(mesh: &mut Mesh, t: &Similarity) {
    splat_core::part_at_creases(mesh);
    splat_core::smooth(mesh);
    mesh.origin = t.apply(mesh.origin);
    let turn = t.rotation.as_quat();
    let scale = t.scale as f32;
    mesh.position.iter_mut().for_each(|p: &mut Vec3| *p = turn * (*p * scale));
    mesh.normal.iter_mut().for_each(|n| *n = turn * *n);
}
