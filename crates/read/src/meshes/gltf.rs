//! glTF 2.0, `.gltf` and `.glb` → the 3D Gaussians of its default scene, else its meshes as one, else its points.
//!
//! Nodes are applied in f64. Triangles, strips and fans are read; base colours of materials, their textures and the colours
//! of vertices become colours of vertices (see `paint.rs`). Files that it names are opened in its own folder and below.
//! JSON is parsed by serde; what it speaks of is checked by ourselves: the crate `gltf` slices buffers by what the file
//! says and panics where that is not so.

mod accessor;
mod container;
mod document;
mod gaussians;
mod material;
mod nodes;
mod primitive;

use super::paint::Paint;
use super::tubes::Tubes;
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::points::origin;
use crate::reading::Reading;
use crate::stream::beside::Beside;
use crate::stream::input;
use accessor::{Buffers, missing};
use document::{Document, Primitive};
use material::Paints;
use nodes::Instance;
use primitive::{LINE_STRIP, LINES, POINTS, Surface};
use splat_core::glam::Vec3;
use splat_core::text::escaped;
use splat_core::{Mesh, RawPoints};
use std::path::Path;

const HINT: &str = "the file is damaged, or was written wrongly; try a glTF validator";

/// Extensions that may be required: those that are read, those that change neither shapes nor base colours, and kinds of images, without
/// which surfaces have the factors of their colours.
const UNDERSTOOD: [&str; 28] = [
    gaussians::EXTENSIONS[0],
    gaussians::EXTENSIONS[1],
    gaussians::EXTENSIONS[2],
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "KHR_texture_transform",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_xmp_json_ld",
    "EXT_lights_image_based",
    "EXT_lights_ies",
];

/// Extensions of which more is to be said than that they are not read.
const DRACO: &str = "KHR_draco_mesh_compression";
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
const SPLATS: &str = "KHR_gaussian_splatting";
const SPLATS_HINT: &str = "save its Gaussians as PLY or SPZ, such as with SuperSplat, or without this extension";

fn wrong(expected: String, found: String) -> ReadError {
    ReadError::input(Place::File, expected, found, HINT)
}

/// Reads a file that lies at `place`, if it is no part of memory.
pub(crate) fn read(content: &[u8], place: Option<&Path>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let (document, binary) = container::open(content, reading.params)?;
    check_required(&document)?;
    let beside = Beside::new(place);
    let buffers = Buffers::load(&document, binary, &beside, reading)?;
    let instances = nodes::instances(&document)?;
    name_unused(&document, &instances, reading);
    let instances = nodes::with_copies(instances, &buffers, reading)?;
    let primitives = primitives(&document, &instances)?;
    let (splats, primitives): (Vec<_>, Vec<_>) = primitives.into_iter().partition(|(p, _)| gaussians::is_one(p));
    if !splats.is_empty() {
        if !primitives.is_empty() {
            let warning = "its meshes are not drawn beside its 3D Gaussians: save them as a file of their own";
            reading.notes.warnings.push(warning.to_owned());
        }
        return gaussians::read(&splats, &buffers, reading).map(Loaded::Points);
    }
    // An empty scene is an empty mesh.
    let is_mesh = primitives.is_empty() || primitives.iter().any(|(p, _)| p.mode != Some(POINTS));
    // Many nodes may show one mesh: together they are refused before the first is read.
    let vertices = primitives.iter().fold(0u64, |n, (p, _)| n.saturating_add(primitive::vertices_of(p, &buffers)));
    input::hold("the vertices", vertices.saturating_mul(primitive::BYTES_PER_VERTEX), reading.params)?;
    let mut paints = Paints::new(&document, &buffers, &beside);
    let mut surface = Surface::default();
    let has_faces = primitives.iter().any(|(p, _)| !matches!(p.mode, Some(POINTS | LINES..=LINE_STRIP)));
    for (primitive, instance) in primitives {
        reading.go_on()?;
        match primitive.mode {
            Some(LINES..=LINE_STRIP) if has_faces => reading.notes.not_used([&b"lines"[..]]),
            Some(POINTS) if is_mesh => reading.notes.not_used([&b"points"[..]]),
            _ => surface.add(primitive, &instance.scene_from_mesh, &buffers, &mut paints, reading)?,
        }
    }
    surface.painting.paints = paints.paints;
    surface.painting.textures = paints.textures;
    loaded(surface, is_mesh, reading)
}

fn loaded(surface: Surface, is_mesh: bool, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let Surface { position, normal, triangles, lines, painting, is_tinted } = surface;
    let (origin, position) = origin::relative(&position, Place::File, |i| format!("vertex {i}"))?;
    let of_lines = || lines.iter().enumerate().map(|(rank, line)| (rank as u32, line.as_slice()));
    if let Some(tubes) = Tubes::around(&position, of_lines(), reading)? {
        let is_painted = is_tinted || painting.paints.iter().any(|paint| paint.factor != [1.0; 4]);
        let color = if is_painted { painting.bare_colors() } else { Vec::new() };
        let vertices = Mesh { origin, color: tubes.of_vertices(&color), ..Mesh::default() };
        return Ok(Loaded::Mesh(tubes.into_mesh(vertices, reading)));
    }
    let mesh = Mesh { origin, position, normal, triangles, ..Mesh::default() };
    // All white is no colour.
    let is_painted = is_tinted || !painting.paints.iter().all(Paint::is_none);
    let mesh = if is_painted { painting.paint(mesh, reading)? } else { mesh };
    if is_mesh {
        return Ok(Loaded::Mesh(mesh));
    }
    let Mesh { origin, position, normal, color, opacity, .. } = mesh;
    let normal = if normal.iter().all(|n| *n == Vec3::ZERO) { Vec::new() } else { normal };
    Ok(Loaded::Points(RawPoints { origin, position, normal, color, opacity, ..RawPoints::default() }))
}

/// Refuses extensions without which the file is not what it shows.
fn check_required(document: &Document) -> Result<(), ReadError> {
    let Some(name) = document.extensions_required.iter().find(|name| !UNDERSTOOD.contains(&name.as_str())) else {
        return Ok(());
    };
    let hint = match name.as_str() {
        other if other.starts_with(SPLATS) => SPLATS_HINT,
        DRACO => "import it into Blender, and export it as glTF with Compression switched off",
        other if MESHOPT.contains(&other) => {
            "export it without mesh compression: gltfpack without -c and -cc, gltf-transform with --compress false"
        }
        _ => "export it without this extension",
    };
    let found = format!("{}, which the file requires", escaped(name.as_bytes(), 60));
    Err(ReadError::input(Place::File, "glTF 2.0 without extensions that are not read", found, hint))
}

/// The primitives of the scene, each with where it is.
fn primitives<'a>(
    document: &'a Document,
    instances: &'a [Instance<'a>],
) -> Result<Vec<(&'a Primitive, &'a Instance<'a>)>, ReadError> {
    let mut placed = Vec::new();
    for instance in instances {
        let meshes = &document.meshes;
        let mesh = meshes.get(instance.mesh).ok_or_else(|| missing("mesh", instance.mesh, meshes.len()))?;
        placed.extend(mesh.primitives.iter().map(|primitive| (primitive, instance)));
    }
    Ok(placed)
}

/// Names what the scene has beside meshes and their base colours.
fn name_unused(document: &Document, instances: &[Instance<'_>], reading: &mut Reading<'_>) {
    let nodes = &document.nodes;
    let meshes = instances.iter().filter_map(|i| document.meshes.get(i.mesh));
    let has_targets = meshes.flat_map(|m| &m.primitives).any(|p| !p.targets.is_empty());
    let stated = [
        ("animations", !document.animations.is_empty()),
        ("cameras", nodes.iter().any(|n| n.camera.is_some())),
        ("skins", instances.iter().any(|i| i.node.skin.is_some())),
        ("morph targets", has_targets),
        ("other scenes", document.scenes.len() > 1),
    ];
    reading.notes.not_used(stated.iter().filter(|(_, is)| *is).map(|(name, _)| name.as_bytes()));
    reading.notes.not_used(nodes.iter().flat_map(|n| n.extensions.others.keys()).map(String::as_bytes));
    let primitives = instances.iter().filter_map(|i| document.meshes.get(i.mesh)).flat_map(|m| &m.primitives);
    reading.notes.not_used(primitives.flat_map(|p| p.extensions.others.keys()).map(String::as_bytes));
    if instances.is_empty() {
        reading.notes.remark("the default scene has no mesh");
    }
}
