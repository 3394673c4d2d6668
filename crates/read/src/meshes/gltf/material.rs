//! Materials: base colour, its texture, and what of them a mesh has no place for.

use super::accessor::{Buffers, fetch, missing};
use super::document::{Document, Image, Material, TextureOf};
use super::wrong;
use crate::error::{Fault, ReadError};
use crate::meshes::paint::{Alpha, Paint};
use crate::meshes::texture::{Texture, Wrap};
use crate::reading::Reading;
use crate::stream::beside::{self, Beside};
use splat_core::glam::{Mat2, Vec2};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What is said of blended materials whose faces are seen from one side alone.
const BACK_FACES: &str =
    "doubleSided is not set beside alphaMode BLEND: the backs of its faces are drawn too, as light crosses them";

const NEAREST: u32 = 9728;
const CLAMP: u32 = 33_071;
const MIRROR: u32 = 33_648;

/// Texture coordinates that a paint goes by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coordinates {
    /// Rank of the set in the file.
    pub(super) set: usize,
    offset: Vec2,
    turned: Mat2,
}

impl Coordinates {
    /// The place in the texture.
    pub(super) fn place(&self, coordinates: [f32; 2]) -> [f32; 2] {
        (self.turned * Vec2::from(coordinates) + self.offset).to_array()
    }
}

/// The paints of the materials that are used.
pub(super) struct Paints<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    beside: &'a Beside<'a>,
    pub(super) paints: Vec<Paint>,
    pub(super) textures: Vec<Texture>,
    /// Rank of the paint of a material, with the coordinates of its texture; that of no material among them.
    known: BTreeMap<Option<usize>, (u32, Option<Coordinates>)>,
    /// Ranks of textures; `None` for those that are not there.
    decoded: BTreeMap<usize, Option<usize>>,
    /// Images that were decoded, by where their bytes come from.
    images: BTreeMap<Origin<'a>, Option<Texture>>,
}

/// Where the bytes of an image come from, whatever refers to them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Origin<'a> {
    /// A buffer, the first byte and the length.
    Buffer(usize, usize, usize),
    /// Written into the description.
    Text(&'a str),
    File(PathBuf),
}

impl<'a> Paints<'a> {
    pub(super) fn new(document: &'a Document, buffers: &'a Buffers<'a>, beside: &'a Beside<'a>) -> Self {
        Self {
            document,
            buffers,
            beside,
            paints: Vec::new(),
            textures: Vec::new(),
            known: BTreeMap::new(),
            decoded: BTreeMap::new(),
            images: BTreeMap::new(),
        }
    }

    /// Rank of the paint of a material, which the same without its texture follows; and the coordinates of the texture.
    pub(super) fn paint_of(
        &mut self,
        material: Option<usize>,
        reading: &mut Reading<'_>,
    ) -> Result<(u32, Option<Coordinates>), ReadError> {
        if let Some(known) = self.known.get(&material) {
            return Ok(*known);
        }
        let materials = &self.document.materials;
        let none = Material::default();
        let stated = match material {
            Some(index) => materials.get(index).ok_or_else(|| missing("material", index, materials.len()))?,
            None => &none,
        };
        let base = &stated.pbr_metallic_roughness;
        let factor = base.base_color_factor.unwrap_or([1.0; 4]);
        if !factor.iter().all(|f| (0.0..=1.0).contains(f)) {
            let index = material.unwrap_or(0);
            return Err(wrong(format!("a baseColorFactor from 0 to 1 of material {index}"), format!("{factor:?}")));
        }
        let mut coordinates = None;
        let mut texture = None;
        if let Some(stated_texture) = &base.base_color_texture {
            texture = self.texture(stated_texture.index, reading)?;
            coordinates = texture.map(|_| coordinates_of(stated_texture)).transpose()?;
        }
        let alpha = match stated.alpha_mode.as_deref() {
            Some("MASK") => Alpha::Cut(stated.alpha_cutoff.unwrap_or(0.5) as f32),
            Some("BLEND") => {
                if !stated.double_sided {
                    reading.notes.remark(BACK_FACES);
                }
                Alpha::Blended
            }
            // Opacities of vertices without a material are meant; a material that is opaque overrules them.
            _ if material.is_none() => Alpha::Blended,
            _ => Alpha::Ignored,
        };
        name_unused(stated, reading);
        let rank = self.paints.len() as u32;
        let textured = Paint { factor: factor.map(|f| f as f32), texture, alpha };
        self.paints.extend([textured, Paint { texture: None, ..textured }]);
        self.known.insert(material, (rank, coordinates));
        Ok((rank, coordinates))
    }

    /// Rank of a texture; `None` where its image is not there, which a remark says.
    fn texture(&mut self, index: usize, reading: &mut Reading<'_>) -> Result<Option<usize>, ReadError> {
        if let Some(known) = self.decoded.get(&index) {
            return Ok(*known);
        }
        let textures = &self.document.textures;
        let texture = textures.get(index).ok_or_else(|| missing("texture", index, textures.len()))?;
        let found = match texture.source {
            Some(image) => self.image(image, reading)?,
            None => {
                reading.notes.remark(format!(
                    "texture {index} is in no format that is read: surfaces are drawn without it; save it as PNG or JPEG"
                ));
                None
            }
        };
        let rank = found.map(|image| {
            let sampler = texture.sampler.and_then(|s| self.document.samplers.get(s));
            let wrap = |mode: Option<u32>| match mode {
                Some(CLAMP) => Wrap::Clamp,
                Some(MIRROR) => Wrap::Mirror,
                _ => Wrap::Repeat,
            };
            let wraps = sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]);
            let is_nearest = sampler.is_some_and(|s| s.mag_filter == Some(NEAREST));
            self.textures.push(image.sampled(wraps, is_nearest));
            self.textures.len() - 1
        });
        self.decoded.insert(index, rank);
        Ok(rank)
    }

    /// The decoded image; `None` where its file is missing, which a remark says.
    fn image(&mut self, index: usize, reading: &mut Reading<'_>) -> Result<Option<Texture>, ReadError> {
        let images = &self.document.images;
        let image = images.get(index).ok_or_else(|| missing("image", index, images.len()))?;
        let what = format!("image {index}");
        let origin = self.origin(image);
        if let Some(known) = origin.as_ref().and_then(|origin| self.images.get(origin)) {
            return Ok(known.clone());
        }
        let decoded = match (&image.uri, image.buffer_view) {
            (_, Some(view)) => decoded(self.buffers.view(view)?, &what, reading)?,
            (Some(uri), None) => match fetch(uri, &what, self.beside, reading) {
                Ok(content) => decoded(&content, &what, reading)?,
                Err(error) if error.fault == Fault::FileSystem => {
                    reading.notes.remark(format!("{} ({}): the texture is left out", error.expected, error.found));
                    return Ok(None);
                }
                Err(error) => return Err(error),
            },
            (None, None) => return Err(wrong(format!("bytes of {what}"), "neither a uri nor a buffer view".into())),
        };
        if let Some(origin) = origin {
            self.images.insert(origin, decoded.clone());
        }
        Ok(decoded)
    }

    /// Where the bytes of an image come from; `None` where they are not there, which fetching them says.
    fn origin(&self, image: &'a Image) -> Option<Origin<'a>> {
        match (&image.uri, image.buffer_view) {
            (_, Some(view)) => {
                let view = self.document.buffer_views.get(view)?;
                Some(Origin::Buffer(view.buffer, view.byte_offset, view.byte_length))
            }
            (Some(uri), None) if uri.starts_with("data:") => Some(Origin::Text(uri)),
            (Some(uri), None) => self.beside.real(&beside::from_uri(uri)).map(Origin::File),
            (None, None) => None,
        }
    }
}

/// An image; `None` for one of a kind that is left out, which a remark says.
fn decoded(content: &[u8], what: &str, reading: &mut Reading<'_>) -> Result<Option<Texture>, ReadError> {
    if Texture::is_left_out(content, what, reading) {
        return Ok(None);
    }
    Texture::decode(content, what, reading).map(Some)
}

fn coordinates_of(stated: &TextureOf) -> Result<Coordinates, ReadError> {
    let Some(transform) = &stated.extensions.transform else {
        return Ok(Coordinates { set: stated.tex_coord, offset: Vec2::ZERO, turned: Mat2::IDENTITY });
    };
    let vector = |v: Option<[f64; 2]>, none: Vec2| v.map_or(none, |v| Vec2::from(v.map(|c| c as f32)));
    let [sin, cos] = [libm::sin(transform.rotation), libm::cos(transform.rotation)].map(|c| c as f32);
    let scale = vector(transform.scale, Vec2::ONE);
    let offset = vector(transform.offset, Vec2::ZERO);
    // The second coordinate points down.
    let turned = Mat2::from_cols(Vec2::new(cos, -sin) * scale.x, Vec2::new(sin, cos) * scale.y);
    if !(turned.is_finite() && offset.is_finite()) {
        return Err(wrong("a finite KHR_texture_transform".into(), "another one".into()));
    }
    Ok(Coordinates { set: transform.tex_coord.unwrap_or(stated.tex_coord), offset, turned })
}

/// Names what a material states beside its base colour.
fn name_unused(material: &Material, reading: &mut Reading<'_>) {
    let base = &material.pbr_metallic_roughness;
    let stated = [
        ("metallicFactor", base.metallic_factor.is_some()),
        ("roughnessFactor", base.roughness_factor.is_some()),
        ("metallicRoughnessTexture", base.metallic_roughness_texture.is_some()),
        ("normalTexture", material.normal_texture.is_some()),
        ("occlusionTexture", material.occlusion_texture.is_some()),
        ("emissiveTexture", material.emissive_texture.is_some()),
        ("emissiveFactor", material.emissive_factor.is_some_and(|e| e != [0.0; 3])),
    ];
    reading.notes.not_used(stated.iter().filter(|(_, is)| *is).map(|(name, _)| name.as_bytes()));
    reading.notes.not_used(material.extensions.keys().map(String::as_bytes));
}
