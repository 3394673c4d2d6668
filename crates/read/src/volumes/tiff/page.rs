//! Pages of a TIFF file: what the numbers of each are, and the numbers.

use crate::error::{Place, ReadError};
use crate::guarded::guarded;
use crate::reading::Reading;
use crate::stream::input::{self, Content};
use crate::volumes::slices::LISTED_COLORS;
use crate::volumes::voxels::Kind;
use splat_core::Reservation;
use splat_core::text::{counted, escaped};
use std::fmt;
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingSampleType, Limits};
use tiff::tags::{ByteOrder, CompressionMethod, PlanarConfiguration, SampleFormat, Tag};
use tiff::{ColorType, TiffError};

/// Most bytes of the numbers that describe a page, such as where its strips lie.
const MOST_OF_TAG: usize = 64 << 20;
/// Most bytes that a packed byte stands for: LZW repeats strings of up to 4096 bytes, deflate makes 1032 of one.
const MOST_PACKED: u64 = 4096;
/// Bytes of the shortest directory of a page, which has a width, a height, a meaning of its numbers, and where its numbers lie.
const LEAST_PAGE: u64 = 64;
/// Meanings of a number that is read as it is stored: white is 0, black is 0, a place in a list of colours.
const WHITE_IS_ZERO: u16 = 0;
const RED_GREEN_BLUE: u16 = 2;
const BLACK_IS_ZERO: u64 = 1;
const IN_PALETTE: u16 = 3;
/// Bits of `NewSubfileType`: a smaller copy of another page, and a mask.
const IS_COPY: u64 = 1 | 4;
/// Types of entries whose value is a whole number of two and of four bytes.
const SHORT: u64 = 3;
const LONG: u64 = 4;

const DAMAGED: &str = "the file is truncated or damaged; fetch it again, or save it anew";
const UNREAD: &str = "save it without compression, or with LZW, deflate or PackBits, and with 8, 16 or 32 bits, such as with Fiji (File > Save As > Tiff)";

/// What the numbers of a page are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    pub(super) size: [u32; 2],
    pub(super) kind: Kind,
    /// Bits of a number in the file; below 8 several share a byte.
    bits: u8,
    /// Numbers of a pixel.
    pub(super) numbers: u64,
    pub(super) is_color: bool,
    /// Whether each number of all pixels lies behind the other.
    is_planar: bool,
    /// Columns and rows of a tile, where the page has such.
    tile: Option<[u32; 2]>,
}

impl Shape {
    /// Bytes of the numbers, each in whole bytes.
    pub(super) fn bytes(&self) -> u64 {
        let [width, height] = self.size.map(u64::from);
        width.saturating_mul(height).saturating_mul(self.numbers * self.kind.size())
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size: [width, height], kind, numbers, .. } = self;
        let kind = format!("{kind:?}").to_lowercase();
        write!(f, "{width} x {height} pixels of {numbers} x {kind}")
    }
}

/// A page that is read.
pub(super) struct Page {
    /// Its rank in the file, from 0.
    pub(super) rank: usize,
    pub(super) shape: Shape,
}

/// The pages of a file.
pub(super) struct Pages {
    decoder: Decoder<Cursor<Vec<u8>>>,
    /// The memory of the file.
    _held: Reservation,
}

impl Pages {
    pub(super) fn open(content: Content) -> Result<Self, ReadError> {
        let (bytes, held) = content.into_parts();
        let mut limits = Limits::default();
        limits.ifd_value_size = MOST_OF_TAG.min(bytes.len());
        let decoder = guarded(|| Ok(Decoder::new(Cursor::new(bytes)))).map_err(|_| broken(0))?;
        let decoder = decoder.map_err(|e| refused(0, &e))?.with_limits(limits);
        Ok(Self { decoder, _held: held })
    }

    /// The pages that are slices: smaller copies and masks are left out, which a remark says.
    pub(super) fn list(&mut self, reading: &mut Reading<'_>) -> Result<Vec<Page>, ReadError> {
        let most = self.len() / LEAST_PAGE + 1;
        let mut pages = Vec::new();
        let mut left_out = 0;
        let mut rank = 0;
        loop {
            reading.go_on()?;
            if self.number(Tag::NewSubfileType).unwrap_or(0) & IS_COPY == 0 {
                let shape = self.shape(rank, reading)?;
                pages.push(Page { rank, shape });
            } else {
                left_out += 1;
            }
            if !self.decoder.more_images() {
                break;
            }
            rank += 1;
            if rank as u64 >= most {
                return Err(ReadError::input(
                    Place::File,
                    format!("at most {most} pages in so many bytes"),
                    "more",
                    DAMAGED,
                ));
            }
            let next = guarded(|| Ok(self.decoder.next_image())).map_err(|_| broken(rank))?;
            next.map_err(|e| refused(rank, &e))?;
        }
        if left_out > 0 {
            let left_out = counted(left_out, "page");
            reading.notes.not_used([format!("{left_out} of smaller copies or masks").as_bytes()]);
        }
        if pages.is_empty() {
            return Err(ReadError::input(
                Place::File,
                "pages that are slices",
                "smaller copies or masks alone",
                DAMAGED,
            ));
        }
        // Packed numbers are few bytes for many, but not for any number of them.
        let bytes: u64 = pages.iter().map(|page| page.shape.bytes()).fold(0, u64::saturating_add);
        input::check_ratio_of(bytes, self.len(), MOST_PACKED, "packed pages")?;
        Ok(pages)
    }

    /// Bytes of the file.
    pub(super) fn len(&mut self) -> u64 {
        self.decoder.inner().get_ref().len() as u64
    }

    pub(super) fn is_big_endian(&self) -> bool {
        self.decoder.byte_order() == ByteOrder::BigEndian
    }

    /// Bytes of the file.
    pub(super) fn part(&mut self, start: u64, length: u64) -> Result<&[u8], ReadError> {
        let range = start as usize..start.saturating_add(length) as usize;
        let part = self.decoder.inner().get_ref().get(range);
        part.ok_or_else(|| ReadError::input(Place::Byte(start), format!("{length} bytes of a page"), "fewer", DAMAGED))
    }

    /// A whole number that describes the page.
    pub(super) fn number(&mut self, tag: Tag) -> Option<u64> {
        self.decoder.find_tag_unsigned::<u64>(tag).ok().flatten()
    }

    /// A text that describes the page.
    pub(super) fn text(&mut self, page: usize, tag: Tag) -> Result<Option<String>, ReadError> {
        self.seek(page)?;
        match self.decoder.find_tag(tag) {
            Ok(value) => Ok(value.and_then(|value| value.into_string().ok())),
            Err(error) => Err(refused(page, &error)),
        }
    }

    /// A ratio that describes the page, as numerator and denominator.
    pub(super) fn ratio(&mut self, tag: Tag) -> Option<[f64; 2]> {
        let value = self.decoder.find_tag(tag).ok().flatten()?;
        let parts = value.into_u32_vec().ok()?;
        let &[over, under] = parts.as_slice() else { return None };
        Some([over, under].map(f64::from))
    }

    /// Where the numbers of a page begin that is not packed, lies in strips, and is described before its numbers.
    pub(super) fn plain_start(&mut self, page: usize) -> Option<u64> {
        self.seek(page).ok()?;
        let described = self.decoder.ifd_pointer()?.0;
        let packing = self.number(Tag::Compression).unwrap_or(1);
        if packing != u64::from(CompressionMethod::None.to_u16()) {
            return None;
        }
        let starts = self.decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets).ok().flatten()?;
        starts.first().copied().filter(|start| described < *start)
    }

    pub(super) fn seek(&mut self, page: usize) -> Result<(), ReadError> {
        let found = guarded(|| Ok(self.decoder.seek_to_image(page))).map_err(|_| broken(page))?;
        found.map_err(|e| refused(page, &e))
    }

    /// What the numbers of the current page are. Numbers that stand for white or for colours of a list are taken as they are stored.
    fn shape(&mut self, page: usize, reading: &mut Reading<'_>) -> Result<Shape, ReadError> {
        let meaning = self.number(Tag::PhotometricInterpretation).and_then(|meaning| u16::try_from(meaning).ok());
        let has_one_number = self.number(Tag::SamplesPerPixel).is_none_or(|numbers| numbers == 1);
        let is_grey_after_all = meaning == Some(RED_GREEN_BLUE) && has_one_number;
        let is_rewritten = matches!(meaning, Some(WHITE_IS_ZERO | IN_PALETTE)) || is_grey_after_all;
        if is_rewritten {
            match meaning {
                _ if is_grey_after_all => {
                    reading.notes.remark("called RGB, with one number a pixel: numbers are read as they are stored")
                }
                Some(IN_PALETTE) => reading.notes.remark(LISTED_COLORS),
                _ => reading.notes.remark("white is stored as 0: numbers are read as they are stored"),
            }
            self.rewrite(Tag::PhotometricInterpretation, BLACK_IS_ZERO);
            self.seek(page)?;
        }
        let found =
            guarded(|| Ok(self.decoder.colortype().and_then(|color| Ok((color, self.decoder.image_buffer_layout()?)))));
        let (color, layout) = found.map_err(|_| broken(page))?.map_err(|e| refused(page, &e))?;
        let (width, height) = self.decoder.dimensions().map_err(|e| refused(page, &e))?;
        let unread = |found: String| {
            let expected = "numbers, or colours as red, green and blue, of whole bytes";
            Err(ReadError::input(Place::File, expected, format!("{found} at page {}", page + 1), UNREAD))
        };
        let (bits, numbers, is_color) = match color {
            ColorType::Gray(bits) => (bits, 1, false),
            ColorType::Multiband { bit_depth, num_samples } => (bit_depth, num_samples, false),
            ColorType::RGB(bits) => (bits, 3, true),
            ColorType::RGBA(bits) => (bits, 4, true),
            other => return unread(format!("{other:?}")),
        };
        let few = bits < 8;
        let is_whole = match few {
            true => numbers == 1 && matches!(bits, 1 | 2 | 4) && layout.sample_format == SampleFormat::Uint,
            false => bits % 8 == 0,
        };
        let kind = match layout.sample_type {
            Some(DecodingSampleType::U8) => Kind::U8,
            Some(DecodingSampleType::U16) => Kind::U16,
            Some(DecodingSampleType::U32) => Kind::U32,
            Some(DecodingSampleType::U64) => Kind::U64,
            Some(DecodingSampleType::I8) => Kind::I8,
            Some(DecodingSampleType::I16) => Kind::I16,
            Some(DecodingSampleType::I32) => Kind::I32,
            Some(DecodingSampleType::I64) => Kind::I64,
            Some(DecodingSampleType::F32) => Kind::F32,
            Some(DecodingSampleType::F64) => Kind::F64,
            _ if layout.sample_format == SampleFormat::IEEEFP => {
                let found = format!("floats of {bits} bits at page {}", page + 1);
                let hint = "save it with floats of 32 bits, such as with Fiji (Image > Type > 32-bit) or in Python: \
                    tifffile.imwrite('FILE.tif', stack.astype('float32'))";
                return Err(ReadError::input(Place::File, "floats of 32 or 64 bits", found, hint));
            }
            _ => return unread(format!("{:?} of {bits} bits", layout.sample_format)),
        };
        if !is_whole {
            return unread(format!("numbers of {bits} bits"));
        }
        let planar = u64::from(PlanarConfiguration::Planar.to_u16());
        let is_planar = numbers > 1 && self.number(Tag::PlanarConfiguration) == Some(planar);
        let samples = self.number(Tag::SamplesPerPixel).unwrap_or(1);
        if samples > u64::from(numbers) {
            reading
                .notes
                .not_used([format!("{} beside colours", counted(samples - u64::from(numbers), "number")).as_bytes()]);
        }
        let shape = Shape {
            size: [width, height],
            kind,
            bits,
            numbers: numbers.into(),
            is_color,
            is_planar,
            tile: self.take_whole_tiles(page, [width, height])?,
        };
        if let Some([across, down]) = shape.tile {
            // The page's own bytes are held where it is decoded.
            let tile = Shape { size: [across, down], ..shape }.bytes();
            input::hold("a tile", tile, reading.params)?;
            input::check_ratio_of(tile, self.len(), MOST_PACKED, "packed tiles")?;
            if few && across % 8 != 0 {
                return unread(format!("tiles of {across} numbers of {bits} bits"));
            }
            if numbers > 1 && samples != u64::from(numbers) {
                return unread("tiles with numbers beside colours".to_owned());
            }
        }
        Ok(shape)
    }

    /// Rewrites a whole number that describes the current page; whether it is there and has room for it.
    fn rewrite(&mut self, tag: Tag, new: u64) -> bool {
        let Some(pointer) = self.decoder.ifd_pointer() else { return false };
        let is_big_endian = self.is_big_endian();
        let content = self.decoder.inner().get_mut();
        let number = |content: &[u8], at: usize, length: usize| -> Option<u64> {
            let bytes = content.get(at..at + length)?;
            let step = |n: u64, byte: &u8| n << 8 | u64::from(*byte);
            Some(if is_big_endian { bytes.iter().fold(0, step) } else { bytes.iter().rev().fold(0, step) })
        };
        // BigTIFF counts in eight bytes where TIFF does in two and four.
        let is_wide = number(content, 2, 2) == Some(43);
        let (head, entry, offset) = if is_wide { (8, 20, 12) } else { (2, 12, 8) };
        let start = pointer.0 as usize;
        let count = number(content, start, head).unwrap_or(0) as usize;
        let entries =
            (0..count).map_while(|i| start.checked_add(head + i * entry).filter(|at| at + entry <= content.len()));
        let sought = u64::from(tag.to_u16());
        let Some(at) = entries.into_iter().find(|at| number(content, *at, 2) == Some(sought)) else { return false };
        let length = match number(content, at + 2, 2) {
            Some(SHORT) => 2,
            Some(LONG) => 4,
            _ => return false,
        };
        if new >> (8 * length) != 0 {
            return false;
        }
        let value = &mut content[at + offset..at + offset + length];
        value.copy_from_slice(&new.to_le_bytes()[..length]);
        if is_big_endian {
            value.reverse();
        }
        true
    }

    /// Rewrites the size of the current page to whole tiles, if it has tiles: the decoder reads whole ones at once, and others row by row, which fails with
    /// LZW.
    fn take_whole_tiles(&mut self, page: usize, size: [u32; 2]) -> Result<Option<[u32; 2]>, ReadError> {
        let sides =
            [Tag::TileWidth, Tag::TileLength].map(|tag| self.number(tag).and_then(|side| u32::try_from(side).ok()));
        let [Some(across), Some(down)] = sides else { return Ok(None) };
        let whole = |size: u32, side: u32| u64::from(size.div_ceil(side.max(1))) * u64::from(side);
        let is_rewritten = self.rewrite(Tag::ImageWidth, whole(size[0], across))
            && self.rewrite(Tag::ImageLength, whole(size[1], down));
        if !is_rewritten {
            let found = format!("tiles of {across} x {down} for {} x {} pixels at page {}", size[0], size[1], page + 1);
            return Err(ReadError::input(Place::File, "tiles that fit the page", found, DAMAGED));
        }
        Ok(Some([across, down]))
    }

    /// The stored numbers of a page, row by row, of a planar one plane by plane.
    fn stored(&mut self, page: usize, shape: &Shape) -> Result<Vec<u8>, ReadError> {
        let mut stored = Vec::new();
        let Some(tile) = shape.tile else {
            let layout = self.decoder.image_buffer_layout().map_err(|e| refused(page, &e))?;
            input::reserve(&mut stored, layout.complete_len)?;
            stored.resize(layout.complete_len, 0);
            let read = guarded(|| Ok(self.decoder.read_image_bytes(&mut stored))).map_err(|_| broken(page))?;
            read.map_err(|e| refused(page, &e))?;
            return Ok(stored);
        };
        let planes = if shape.is_planar { shape.numbers as usize } else { 1 };
        let bits = usize::from(shape.bits) * if shape.is_planar { 1 } else { shape.numbers as usize };
        let row = |pixels: u32| (pixels as usize * bits).div_ceil(8);
        let [width, height] = shape.size;
        let plane = row(width) * height as usize;
        input::reserve(&mut stored, planes * plane)?;
        stored.resize(planes * plane, 0);
        let mut numbers = Vec::new();
        input::reserve(&mut numbers, row(tile[0]) * tile[1] as usize)?;
        numbers.resize(row(tile[0]) * tile[1] as usize, 0);
        let mut chunk = 0;
        for start in (0..planes).map(|n| n * plane) {
            for y in (0..height).step_by(tile[1] as usize) {
                for x in (0..width).step_by(tile[0] as usize) {
                    let read = guarded(|| Ok(self.decoder.read_chunk_bytes(chunk, &mut numbers)));
                    read.map_err(|_| broken(page))?.map_err(|e| refused(page, &e))?;
                    chunk += 1;
                    let length = row(tile[0].min(width - x));
                    let rows = (height - y).min(tile[1]) as usize;
                    for (line, from) in numbers.chunks_exact(row(tile[0])).take(rows).enumerate() {
                        let to = start + (y as usize + line) * row(width) + row(x);
                        stored[to..to + length].copy_from_slice(&from[..length]);
                    }
                }
            }
        }
        Ok(stored)
    }

    /// The numbers of a page, each in whole bytes in the order of this machine, those of a pixel side by side.
    pub(super) fn decode(&mut self, page: usize, shape: &Shape, numbers: &mut Vec<u8>) -> Result<(), ReadError> {
        self.seek(page)?;
        let stored = self.stored(page, shape)?;
        numbers.clear();
        let size = shape.kind.size() as usize;
        if shape.bits < 8 {
            let width = shape.size[0] as usize;
            let bits = usize::from(shape.bits);
            let in_byte = 8 / bits;
            let mask = (1u8 << bits) - 1;
            for row in stored.chunks_exact((width * bits).div_ceil(8)) {
                numbers.extend((0..width).map(|x| row[x / in_byte] >> (8 - bits * (x % in_byte + 1)) & mask));
            }
        } else if shape.is_planar {
            let plane = stored.len() / shape.numbers as usize;
            for at in (0..plane).step_by(size) {
                numbers
                    .extend((0..shape.numbers as usize).flat_map(|n| &stored[n * plane + at..n * plane + at + size]));
            }
        } else {
            *numbers = stored;
        }
        if numbers.len() as u64 != shape.bytes() {
            let found = format!("{} at page {}", numbers.len(), page + 1);
            return Err(ReadError::input(Place::File, format!("{} bytes of numbers", shape.bytes()), found, DAMAGED));
        }
        Ok(())
    }
}

/// The error of a page that the decoder refuses.
fn refused(page: usize, error: &TiffError) -> ReadError {
    let told = error.to_string();
    // The decoder's own name of the error says nothing of the file.
    let told = escaped(told.strip_prefix("unsupported error: ").unwrap_or(&told).as_bytes(), 160);
    let found = format!("{told} at page {}", page + 1);
    match error {
        TiffError::UnsupportedError(_) => ReadError::input(Place::File, "a page of a kind that is read", found, UNREAD),
        TiffError::LimitsExceeded => {
            let hint = "the file is damaged, or save it in strips of fewer rows";
            ReadError::limit("a page whose description and strips fit", found, hint)
        }
        _ => ReadError::input(Place::File, "a complete TIFF page", found, DAMAGED),
    }
}

/// The error of a page on which the decoder gives up.
fn broken(page: usize) -> ReadError {
    ReadError::input(
        Place::File,
        "a complete TIFF page",
        format!("sizes that do not fit at page {}", page + 1),
        DAMAGED,
    )
}
