//! Textures: PNG and JPEG images as linear colours between their texels.

use crate::check_sides;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
use splat_core::Reservation;
use splat_core::srgb::linear_from_srgb;
use std::io::Cursor;
use std::sync::{Arc, LazyLock};

/// What lies beyond the border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrap {
    Repeat,
    Clamp,
    Mirror,
}

/// An image that surfaces are painted with.
#[derive(Clone)]
pub(crate) struct Texture {
    size: [u32; 2],
    /// Colours and opacities, row by row from the top.
    texels: Arc<Texels>,
    wrap: [Wrap; 2],
    /// Whether texels are squares of one colour.
    is_nearest: bool,
}

/// Texels that several textures may share, with the memory that they take.
struct Texels {
    rgba: Rgba,
    _held: Reservation,
}

/// Colours and opacities of texels, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub enum Rgba {
    /// Bytes of sRGB and of opacity.
    Srgb(Vec<[u8; 4]>),
    /// Linear numbers.
    Linear(Vec<[f32; 4]>),
}

impl Rgba {
    /// Texels.
    fn len(&self) -> usize {
        match self {
            Self::Srgb(texels) => texels.len(),
            Self::Linear(texels) => texels.len(),
        }
    }

    /// Bytes that they take.
    fn bytes(&self) -> u64 {
        match self {
            Self::Srgb(texels) => size_of_val(texels.as_slice()) as u64,
            Self::Linear(texels) => size_of_val(texels.as_slice()) as u64,
        }
    }

    /// The first texel with a colour below 0, an opacity beyond 0 and 1, or a number that is not finite.
    fn wrong(&self) -> Option<usize> {
        let is_right = |[r, g, b, alpha]: &[f32; 4]| {
            [r, g, b].iter().all(|c| c.is_finite() && **c >= 0.0) && (0.0..=1.0).contains(alpha)
        };
        match self {
            Self::Srgb(_) => None,
            Self::Linear(texels) => texels.iter().position(|texel| !is_right(texel)),
        }
    }
}

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f64 / 255.0)));

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

    /// Decodes a PNG or JPEG image; `what` names it in messages.
    pub(crate) fn decode(content: &[u8], what: &str, reading: &Reading<'_>) -> Result<Self, ReadError> {
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
        let bytes = 4 * u64::from(width) * u64::from(height);
        let mut held = reading.params.memory.take(what, bytes.saturating_add(decoder.total_bytes()))?;
        let decoded = image::DynamicImage::from_decoder(decoder).map_err(|e| wrong(e.to_string()))?;
        let rgba = bytemuck::allocation::cast_vec(decoded.into_rgba8().into_raw());
        held.set(what, bytes)?;
        let texels = Arc::new(Texels { rgba: Rgba::Srgb(rgba), _held: held });
        Ok(Self { size: [width, height], texels, wrap: [Wrap::Repeat; 2], is_nearest: false })
    }

    /// The texture of texels in memory, `size` columns and rows of them.
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
        let texels = Arc::new(Texels { rgba, _held: held });
        Ok(Self { size, texels, wrap: [Wrap::Repeat; 2], is_nearest: false })
    }

    /// The same image with other rules of what lies beyond its border and between its texels.
    pub(crate) fn sampled(&self, wrap: [Wrap; 2], is_nearest: bool) -> Self {
        Self { wrap, is_nearest, ..self.clone() }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Linear colour and opacity at a place; (0, 0) is the upper left corner of the image, (1, 1) its lower right.
    ///
    /// Places up to the border have the colours within it: a vertex that lies on the border belongs to what it encloses, and
    /// not to the other side of the image, to which repetition would lead.
    pub(crate) fn at(&self, place: [f32; 2]) -> [f32; 4] {
        let wrap = [0, 1].map(|a| if (0.0..=1.0).contains(&place[a]) { Wrap::Clamp } else { self.wrap[a] });
        let [x, y] = [0, 1].map(|a| f64::from(place[a]) * f64::from(self.size[a]));
        if self.is_nearest {
            return self.texel([x, y].map(|c| c.floor() as i64), wrap);
        }
        // Colours are those of the middles of texels.
        let low = [x, y].map(|c| (c - 0.5).floor());
        let share = [x - 0.5 - low[0], y - 0.5 - low[1]].map(|s| s as f32);
        let [i, j] = low.map(|c| c as i64);
        let row = |j: i64| {
            let a = self.texel([i, j], wrap);
            let b = self.texel([i.saturating_add(1), j], wrap);
            std::array::from_fn::<f32, 4, _>(|c| a[c] + (b[c] - a[c]) * share[0])
        };
        let a = row(j);
        let b = row(j.saturating_add(1));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share[1])
    }

    fn texel(&self, at: [i64; 2], wrap: [Wrap; 2]) -> [f32; 4] {
        let [i, j] = [0, 1].map(|a| {
            let n = i64::from(self.size[a]);
            match wrap[a] {
                Wrap::Repeat => at[a].rem_euclid(n),
                Wrap::Clamp => at[a].clamp(0, n - 1),
                Wrap::Mirror => {
                    let there = at[a].rem_euclid(2 * n);
                    there.min(2 * n - 1 - there)
                }
            }
        });
        let rank = j as usize * self.size[0] as usize + i as usize;
        match &self.texels.rgba {
            Rgba::Linear(texels) => texels[rank],
            Rgba::Srgb(texels) => {
                let [r, g, b, alpha] = texels[rank];
                let linear: &[f32; 256] = &LINEAR;
                let [r, g, b] = [r, g, b].map(|c| linear[usize::from(c)]);
                [r, g, b, f32::from(alpha) / 255.0]
            }
        }
    }
}
