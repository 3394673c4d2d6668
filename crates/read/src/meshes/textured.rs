//! Meshes in memory with a texture, which becomes what that of a file does.

use super::mip_maps::Weight;
use super::paint::corners::{BYTES_PER_CORNER, Corner, NONE, painted, smooth};
use super::paint::{Alpha, Paint, Painting};
use super::places::first_at_place;
use super::ply::texture::Wedges;
use super::rgba::Rgba;
use super::texture::Texture;
use crate::error::{Place, ReadError};
use crate::reading::{Notes, Reading};
use crate::stream::input::{self, Stream};
use crate::{Loaded, ReadParams};
use splat_core::Mesh;
use splat_core::text::escaped_path;
use std::path::PathBuf;

/// The image that a mesh in memory is painted with. It repeats beyond its borders, and between the middles of its texels it is interpolated.
#[derive(Debug, Clone, PartialEq)]
pub enum TextureImage {
    /// A PNG or JPEG file.
    File(PathBuf),
    /// Texels.
    Texels {
        /// Columns and rows.
        size: [u32; 2],
        /// Their colours.
        rgba: Rgba,
    },
}

/// Places in a texture: (0, 0) is the lower left corner of the image, (1, 1) its upper right.
#[derive(Debug, Clone, PartialEq)]
pub enum TexturePlaces {
    /// One a vertex.
    Vertices(Vec<[f32; 2]>),
    /// One a corner of a triangle. Corners of a vertex at several places become several vertices.
    Corners(Vec<[[f32; 2]; 3]>),
}

/// The only paint of such a mesh: the texture, whose opacities are those of the surface.
const PAINT: Paint = Paint { factor: [1.0; 4], texture: Some(0), alpha: Alpha::Blended };

/// The painting of [`textured_in_memory`] in parts, from which [`painting_of_parts`] makes it again with the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct PaintingParts {
    /// Place in the texture, one a vertex: (0, 0) is the *upper* left corner of the image, (1, 1) its lower right.
    pub places: Vec<[f32; 2]>,
    /// Linear colour and opacity that the texture is multiplied by, one a vertex; empty for white.
    pub tint: Vec<[f32; 4]>,
    /// Columns and rows of the image.
    pub size: [u32; 2],
    /// Texels of the image in its full size.
    pub rgba: Rgba,
    /// Triangles of the mesh before any was divided along opacities.
    pub stated_triangles: u64,
}

/// Takes a painting of [`textured_in_memory`] apart; `None` for a painting of a file, which may have several materials.
pub fn parts_of_painting(painting: &Painting) -> Option<PaintingParts> {
    let [texture] = painting.textures.as_slice() else { return None };
    if painting.paints != [PAINT] {
        return None;
    }
    Some(PaintingParts {
        places: painting.place.clone(),
        tint: painting.tint.clone(),
        size: texture.size(),
        rgba: texture.rgba().clone(),
        stated_triangles: painting.stated_triangles,
    })
}

/// Makes a painting of the parts that [`parts_of_painting`] gave. `name` serves messages.
///
/// # Errors
/// [`ReadError`] for texels that [`textured_in_memory`] refuses, for places and tints of different counts, and for what takes more memory than `params`
/// allow.
pub fn painting_of_parts(name: &str, parts: PaintingParts, params: &ReadParams) -> Result<Painting, ReadError> {
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let reading = Reading::new(params, None);
    let PaintingParts { places, tint, size, rgba, stated_triangles } = parts;
    if !tint.is_empty() && tint.len() != places.len() {
        let expected = format!("a tint of each vertex, {}", places.len());
        return Err(ReadError::input(Place::File, expected, tint.len().to_string(), "").in_file(name));
    }
    let texture = Texture::of_texels(size, rgba, &reading).map_err(|e| e.in_file(name))?;
    let texture = texture.with_mip_maps(Weight::Opacity, &mut Vec::new(), &reading).map_err(|e| e.in_file(name))?;
    Ok(Painting {
        paints: vec![PAINT],
        textures: Texture::released(&[texture]),
        paint_of: vec![0; places.len()],
        tint,
        place: places,
        stated_triangles,
    })
}

/// Paints a mesh in memory with a texture, as [`ReadParams::textures`] has it for a file: the result is a [`Loaded::Mesh`] or [`Loaded::Painted`]. Colours and opacities of its vertices are multiplied by those of
/// the texture. Normals that are missing are smooth across vertices at one place. `name` serves messages.
///
/// # Errors
/// [`ReadError`] as [`crate::file()`] gives it: for an image that is no PNG or JPEG, or not there; for texels and places of another number than their image
/// or the mesh has, or that are not finite; and for what takes more memory than `params` allow.
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn textured_in_memory(
    name: &str,
    mesh: Mesh,
    places: &TexturePlaces,
    image: TextureImage,
    params: &ReadParams,
) -> Result<(Loaded, Notes), ReadError> {
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let mut reading = Reading::new(params, None);
    let texture = texture(name, image, &mut reading)?;
    let mesh = with_texture(mesh, places, texture, &mut reading).map_err(|e| e.in_file(name))?;
    let loaded = match reading.painting.take() {
        Some(painting) => Loaded::Painted(mesh, painting),
        None => Loaded::Mesh(mesh),
    };
    Ok((loaded, reading.finish(name)))
}

/// Gives a mesh in memory without normals, some of whose vertices lie at one place, the normals that it has where these are one: the seam of a closed surface is
/// no edge. A mesh without such vertices stays as it is. `name` serves messages.
///
/// # Errors
/// [`ReadError`] for what takes more memory than `params` allow.
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn smoothed_in_memory(name: &str, mut mesh: Mesh, params: &ReadParams) -> Result<Mesh, ReadError> {
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let reading = Reading::new(params, None);
    if !mesh.normal.is_empty() {
        return Ok(mesh);
    }
    let first = first_at_place(&mesh.position, &reading).map_err(|e| e.in_file(name))?;
    if first.iter().enumerate().all(|(v, first)| v as u32 == *first) {
        return Ok(mesh);
    }
    let mut corners: Vec<Corner> = first.into_iter().map(|v| [v, NONE, NONE, NONE]).collect();
    smooth(&mut mesh, &mut corners, &reading).map_err(|e| e.in_file(name))?;
    Ok(mesh)
}

fn texture(name: &str, image: TextureImage, reading: &mut Reading<'_>) -> Result<Texture, ReadError> {
    match image {
        TextureImage::Texels { size, rgba } => Texture::of_texels(size, rgba, reading).map_err(|e| e.in_file(name)),
        TextureImage::File(path) => {
            let content = Stream::open(&path, reading.params).and_then(Stream::rest);
            let decoded = content.and_then(|content| Texture::decode(&content, "the texture", reading));
            decoded.map_err(|e| e.in_file(&escaped_path(&path)))
        }
    }
}

fn with_texture(
    mut mesh: Mesh,
    places: &TexturePlaces,
    texture: Texture,
    reading: &mut Reading<'_>,
) -> Result<Mesh, ReadError> {
    let (found, expected, what) = match places {
        TexturePlaces::Vertices(places) => (places.len(), mesh.position.len(), "vertex"),
        TexturePlaces::Corners(places) => (places.len(), mesh.triangles.len(), "triangle"),
    };
    if found != expected {
        let expected = format!("texture coordinates of each {what}, {expected}");
        return Err(ReadError::input(Place::File, expected, found.to_string(), "give as many as the mesh has"));
    }
    input::hold("the corners", 3 * mesh.triangles.len() as u64 * BYTES_PER_CORNER, reading.params)?;
    let mut wedges = Wedges::default();
    let mut triangles = std::mem::take(&mut mesh.triangles);
    for (t, triangle) in triangles.iter_mut().enumerate() {
        for (k, v) in triangle.iter_mut().enumerate() {
            let place = match places {
                TexturePlaces::Vertices(places) => places[*v as usize],
                TexturePlaces::Corners(places) => places[t][k],
            };
            if !place.iter().all(|c| c.is_finite()) {
                let found = format!("{}, {} at corner {k} of face {t}", place[0], place[1]);
                let hint = "give each corner a place, or paint the mesh without a texture";
                return Err(ReadError::input(Place::File, "texture coordinates that are finite numbers", found, hint));
            }
            *v = wedges.corner(*v, place, 0, reading)?;
        }
    }
    let mut mesh = wedges.expanded(mesh);
    mesh.triangles = triangles;
    let (mut corners, places) = wedges.into_parts();
    // The seams of a texture are no edges of the surface, whose normals are smooth across them.
    let vertex_of: Vec<u32> = corners.iter().map(|corner| corner[0]).collect();
    for (corner, first) in corners.iter_mut().zip(first_at_place(&mesh.position, reading)?) {
        corner[0] = vertex_of[first as usize];
    }
    drop(vertex_of);
    painted(mesh, corners, &places, vec![PAINT], vec![texture], reading)
}
