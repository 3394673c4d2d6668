//! Textures: PNG and JPEG images as linear colours between their texels, or averaged over squares of texels.

use super::mip_maps::{Level, MipMaps, Weight};
use super::rgba::Rgba;
use crate::check_sides;
use crate::error::{Place, ReadError};
use crate::reading::{Reading, Textures};
use crate::stream::input;
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
use splat_core::Reservation;
use std::io::Cursor;
use std::sync::Arc;

/// What lies beyond the border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrap {
    Repeat,
    Clamp,
    Mirror,
}

/// An image that surfaces are painted with.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Texture {
    /// Its texels, which several textures may share.
    texels: Arc<Texels>,
    wrap: [Wrap; 2],
    /// Whether texels are squares of one colour.
    is_nearest: bool,
}

/// An image in one or all of its sizes, with the memory that it takes while its file is read.
#[derive(Debug)]
struct Texels {
    mip_maps: MipMaps,
    _held: Option<Reservation>,
}

/// The sizes that were made of an image by a weight.
pub(crate) struct MadeSizes {
    image: Arc<Texels>,
    weight: Weight,
    sizes: Arc<Texels>,
}

/// Two images are equal if their texels are.
impl PartialEq for Texels {
    fn eq(&self, other: &Self) -> bool {
        self.mip_maps == other.mip_maps
    }
}

/// Bytes of a texel of the smaller sizes, four numbers of light.
const BYTES_OF_A_MEAN: u64 = 16;

/// Kinds of images that are not read, by bytes at an offset.
const UNREAD: [(usize, &[u8], &str); 7] = [
    (0, b"\xabKTX ", "KTX2"),
    (8, b"WEBP", "WebP"),
    (4, b"ftypavif", "AVIF"),
    (0, b"DDS ", "DDS"),
    (0, b"BM", "BMP"),
    (0, b"II*\0", "TIFF"),
    (0, b"MM\0*", "TIFF"),
];

impl Texture {
    /// Whether an image is of a kind that is known and not read, so that its surfaces have their colours without it; a remark says so.
    pub(crate) fn is_left_out(content: &[u8], what: &str, reading: &mut Reading<'_>) -> bool {
        let has = |at: usize, mark: &[u8]| content.get(at..).is_some_and(|rest| rest.starts_with(mark));
        let Some((.., kind)) = UNREAD.iter().find(|(at, mark, _)| has(*at, mark)) else { return false };
        let remark =
            format!("{what} is {kind}, which is not read: surfaces are drawn without it; save it as PNG or JPEG");
        reading.notes.remark(remark);
        true
    }

    /// Decodes a PNG or JPEG image; `what` names it in messages. With [`Textures::Undecoded`] only its header is read: the texture has a size and no texels.
    pub(crate) fn decode(content: &[u8], what: &str, reading: &mut Reading<'_>) -> Result<Self, ReadError> {
        reading.go_on()?;
        let wrong = |found: String| {
            let hint = "save the texture anew as PNG or JPEG";
            ReadError::input(Place::File, format!("a whole PNG or JPEG image as {what}"), found, hint)
        };
        let format = match image::guess_format(content) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
            Ok(other) => return Err(wrong(format!("{other:?}"))),
            Err(_) => return Err(wrong("another format".to_owned())),
        };
        let mut reader = ImageReader::with_format(Cursor::new(content), format);
        let mut limits = Limits::default();
        limits.max_alloc = Some(reading.params.memory.left());
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(|e| wrong(e.to_string()))?;
        let (width, height) = decoder.dimensions();
        check_sides([width, height])?;
        // A damaged size is not made room for.
        let stored = content.len() as u64;
        if format == ImageFormat::Png {
            let row = u64::from(width) * u64::from(decoder.original_color_type().bits_per_pixel());
            input::check_deflated(row.div_ceil(8) * u64::from(height), stored, "an image")?;
        } else {
            input::check_packed(decoder.total_bytes(), stored, "an image")?;
        }
        if reading.params.textures == Textures::Undecoded {
            let opacities = if decoder.color_type().has_alpha() { " with opacities" } else { "" };
            let shown = format!("{what} is a texture of {width} x {height} texels{opacities}");
            reading.notes.remark(shown);
            return Ok(Self::of_level(Level::undecoded(width, height), None));
        }
        let bytes = 4 * u64::from(width) * u64::from(height);
        let mut held = reading.params.memory.take(what, bytes.saturating_add(decoder.total_bytes()))?;
        let decoded = image::DynamicImage::from_decoder(decoder).map_err(|e| wrong(e.to_string()))?;
        let rgba = bytemuck::allocation::cast_vec(decoded.into_rgba8().into_raw());
        held.set(what, bytes)?;
        Ok(Self::of_level(Level::new(width, height, Rgba::Srgb(rgba)), Some(held)))
    }

    fn of_level(level: Level, held: Option<Reservation>) -> Self {
        let texels = Arc::new(Texels { mip_maps: MipMaps::of_level(level), _held: held });
        Self { texels, wrap: [Wrap::Repeat; 2], is_nearest: false }
    }

    /// Makes the smaller sizes of a texture by a weight, so that [`Self::averaged`] reads them. Textures of one image share them where the weight is the
    /// same; `known` has those that were made.
    pub(crate) fn with_mip_maps(
        &self,
        weight: Weight,
        known: &mut Vec<MadeSizes>,
        reading: &Reading<'_>,
    ) -> Result<Self, ReadError> {
        reading.go_on()?;
        let is_known = |made: &&MadeSizes| Arc::ptr_eq(&made.image, &self.texels) && made.weight == weight;
        let sizes = match known.iter().find(is_known) {
            Some(made) => made.sizes.clone(),
            None => {
                let first = self.texels.mip_maps.first().clone();
                // All smaller sizes together have a third of its texels, and a line of them where only one side is left to be halved.
                let [columns, rows] = first.size().map(u64::from);
                let texels = columns * rows / 3 + columns + rows;
                let held = reading.params.memory.take("the sizes of a texture", BYTES_OF_A_MEAN * texels)?;
                let sizes = Arc::new(Texels { mip_maps: MipMaps::new(first, weight), _held: Some(held) });
                known.push(MadeSizes { image: self.texels.clone(), weight, sizes: sizes.clone() });
                sizes
            }
        };
        Ok(Self { texels: sizes, ..self.clone() })
    }

    /// The textures without the memory that reading held for them: whoever keeps them accounts [`Self::bytes_of`].
    pub(crate) fn released(textures: &[Self]) -> Vec<Self> {
        let mut known: Vec<(Arc<Texels>, Arc<Texels>)> = Vec::new();
        let mut released = |texture: &Self| {
            let found = known.iter().find(|(image, _)| Arc::ptr_eq(image, &texture.texels));
            let texels = found.map_or_else(
                || Arc::new(Texels { mip_maps: texture.texels.mip_maps.clone(), _held: None }),
                |(_, texels)| texels.clone(),
            );
            known.push((texture.texels.clone(), texels.clone()));
            Self { texels, ..texture.clone() }
        };
        textures.iter().map(&mut released).collect()
    }

    /// Bytes of these textures; an image that several share counts once.
    pub(crate) fn bytes_of(textures: &[Self]) -> u64 {
        let is_first = |(i, texture): &(usize, &Self)| {
            !textures[..*i].iter().any(|earlier| Arc::ptr_eq(&earlier.texels, &texture.texels))
        };
        textures.iter().enumerate().filter(is_first).map(|(_, texture)| texture.texels.mip_maps.bytes()).sum()
    }

    /// Hands its texels and the rules of its sampling to `take`.
    pub(crate) fn digest(&self, take: &mut dyn FnMut(&[u8])) {
        let first = self.texels.mip_maps.first();
        take(format!("{:?} {:?} {}", first.size(), self.wrap, self.is_nearest).as_bytes());
        first.digest(take);
    }

    /// Whether a texel is not opaque.
    pub(crate) fn has_alpha(&self) -> bool {
        self.texels.mip_maps.first().has_alpha()
    }

    /// The texture of texels in memory, `size` columns and rows of them.
    #[cfg(feature = "ply")]
    pub(crate) fn of_texels(size: [u32; 2], rgba: Rgba, reading: &Reading<'_>) -> Result<Self, ReadError> {
        check_sides(size)?;
        let expected = u64::from(size[0]) * u64::from(size[1]);
        let found = rgba.len() as u64;
        if found != expected {
            let hint = "the size is that of another image";
            return Err(ReadError::input(Place::File, format!("{expected} texels"), found.to_string(), hint));
        }
        if let Some(texel) = rgba.wrong() {
            let row = texel as u64 / u64::from(size[0]);
            let column = texel as u64 % u64::from(size[0]);
            let expected = "finite colours from 0 on and opacities from 0 to 1";
            let hint = "colours of a display are bytes (uint8), and linear ones numbers with a point";
            return Err(ReadError::input(Place::File, expected, format!("others in row {row}, column {column}"), hint));
        }
        let held = reading.params.memory.take("the texture", rgba.bytes())?;
        Ok(Self::of_level(Level::new(size[0], size[1], rgba), Some(held)))
    }

    /// The same image with other rules of what lies beyond its border and between its texels.
    pub(crate) fn sampled(&self, wrap: [Wrap; 2], is_nearest: bool) -> Self {
        Self { wrap, is_nearest, ..self.clone() }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.texels.mip_maps.first().size()
    }

    /// Its texels in full size.
    #[cfg(feature = "ply")]
    pub(crate) fn rgba(&self) -> &Rgba {
        self.texels.mip_maps.first().rgba()
    }

    /// Linear colour and opacity at a place; (0, 0) is the upper left corner of the image, (1, 1) its lower right.
    ///
    /// Places up to the border have the colours within it: a vertex that lies on the border belongs to what it encloses, and
    /// not to the other side of the image, to which repetition would lead.
    pub(crate) fn at(&self, place: [f32; 2]) -> [f32; 4] {
        self.at_wrapped(place, self.wrap_of(&[place]))
    }

    /// The same with the rules of [`Self::wrap_of`] for what the place is part of.
    pub(crate) fn at_wrapped(&self, place: [f32; 2], wrap: [Wrap; 2]) -> [f32; 4] {
        if !self.is_nearest {
            return self.between(0, place, wrap);
        }
        let first = self.texels.mip_maps.first();
        let [x, y] = [0, 1].map(|a| f64::from(place[a]) * f64::from(first.size()[a]));
        self.texel(first, [x, y].map(|c| c.floor() as i64), wrap)
    }

    /// The same averaged over a square whose sides are `width` texels: between the two sizes of the image whose texels are next to it (trilinear).
    pub(crate) fn averaged(&self, place: [f32; 2], width: f32, wrap: [Wrap; 2]) -> [f32; 4] {
        let levels = self.texels.mip_maps.levels();
        let last = levels.len() - 1;
        // A width that is no number is that of a texel.
        let level = libm::log2f(width.max(1.0)).min(last as f32);
        if level <= 0.0 {
            return self.at_wrapped(place, wrap);
        }
        let low = level.floor();
        let share = level - low;
        let fine = self.between(low as usize, place, wrap);
        if share <= 0.0 {
            return fine;
        }
        let coarse = self.between((low as usize + 1).min(last), place, wrap);
        if fine == coarse {
            return fine;
        }
        // Both are means, whose opacities are weights.
        self.texels.mip_maps.mean(1, [(1.0 - share, fine), (share, coarse)].into_iter())
    }

    /// The rules beyond the border for what lies between places: where all are within the border, what it encloses has no other side.
    pub(crate) fn wrap_of(&self, places: &[[f32; 2]]) -> [Wrap; 2] {
        let is_within = |a: usize| places.iter().all(|place| (0.0..=1.0).contains(&place[a]));
        [0, 1].map(|a| if is_within(a) { Wrap::Clamp } else { self.wrap[a] })
    }

    /// Bilinear colour of one size of the image.
    fn between(&self, rank: usize, place: [f32; 2], wrap: [Wrap; 2]) -> [f32; 4] {
        let level = &self.texels.mip_maps.levels()[rank];
        let [x, y] = [0, 1].map(|a| f64::from(place[a]) * f64::from(level.size()[a]));
        // Colours are those of the middles of texels.
        let low = [x, y].map(|c| (c - 0.5).floor());
        let share = [x - 0.5 - low[0], y - 0.5 - low[1]].map(|s| s as f32);
        let [i, j] = low.map(|c| c as i64);
        let right = i.saturating_add(1);
        let below = j.saturating_add(1);
        let [a, b, c, d] = [[i, j], [right, j], [i, below], [right, below]].map(|at| self.texel(level, at, wrap));
        if [a, b, c, d].iter().any(|texel| texel[3] != a[3]) {
            let [across, down] = share;
            let shares = [(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down, across * down];
            return self.texels.mip_maps.mean(rank, shares.into_iter().zip([a, b, c, d]));
        }
        let mix = |a: [f32; 4], b: [f32; 4], share: f32| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share);
        mix(mix(a, b, share[0]), mix(c, d, share[0]), share[1])
    }

    fn texel(&self, level: &Level, at: [i64; 2], wrap: [Wrap; 2]) -> [f32; 4] {
        let [i, j] = [0, 1].map(|a| {
            let n = i64::from(level.size()[a]);
            match wrap[a] {
                Wrap::Repeat => at[a].rem_euclid(n),
                Wrap::Clamp => at[a].clamp(0, n - 1),
                Wrap::Mirror => {
                    let there = at[a].rem_euclid(2 * n);
                    there.min(2 * n - 1 - there)
                }
            }
        });
        level.linear(i as u32, j as u32)
    }
}
