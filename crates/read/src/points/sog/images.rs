//! Files of a SOG scene, from its archive or from the folder of its description, and the bytes of their pixels.

use crate::check_sides;
use crate::error::{Place, ReadError};
use crate::format::ZIP;
use crate::reading::Reading;
use crate::stream::beside::Beside;
use crate::stream::input::{self, Content};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use splat_core::Reservation;
use splat_core::text::escaped;
use std::io::{Cursor, Read};
use std::path::Path;
use zip::ZipArchive;

/// The description.
const DESCRIPTION: &str = "meta.json";

/// A name for messages.
pub(super) fn shown(name: &str) -> String {
    format!("'{}'", escaped(name.as_bytes(), 60))
}

/// Where the files are.
pub(super) enum Source<'a> {
    Archive {
        archive: ZipArchive<Cursor<&'a [u8]>>,
        /// The folder of the description within the archive, with a slash behind it.
        folder: String,
        /// Bytes of the archive.
        stored: u64,
    },
    Folder {
        /// The description itself.
        content: &'a [u8],
        beside: Beside<'a>,
        /// Bytes of the files that were read so far.
        stored: u64,
    },
}

/// The pixels of an image, row by row.
pub(super) struct Image {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    bytes: Vec<u8>,
    channels: usize,
    _held: Reservation,
}

impl Image {
    /// Red, green, blue and alpha of pixel `i`; an image without alpha has 255 there.
    pub(super) fn pixel(&self, i: usize) -> [u8; 4] {
        let pixel = &self.bytes[i * self.channels..][..self.channels];
        [pixel[0], pixel[1], pixel[2], pixel.get(3).copied().unwrap_or(u8::MAX)]
    }
}

fn damaged(found: String) -> ReadError {
    let hint = "the archive is truncated or damaged; fetch it again";
    ReadError::input(Place::File, "a ZIP archive with meta.json and images of SOG", found, hint)
}

impl<'a> Source<'a> {
    /// An archive, or the description at `place`.
    pub(super) fn new(content: &'a [u8], place: Option<&'a Path>, reading: &Reading<'_>) -> Result<Self, ReadError> {
        if !content.starts_with(ZIP) {
            return Ok(Self::Folder { content, beside: Beside::new(place), stored: content.len() as u64 });
        }
        // The directory of an archive becomes a list with a few hundred bytes an entry, of 46 at least.
        input::hold("the directory of the archive", 8 * content.len() as u64, reading.params)?;
        let archive = ZipArchive::new(Cursor::new(content)).map_err(|e| damaged(e.to_string()))?;
        let names = archive.file_names_raw().filter_map(|name| std::str::from_utf8(name).ok());
        let folders = names.filter_map(|name| name.strip_suffix(DESCRIPTION));
        let folder =
            folders.filter(|folder| folder.is_empty() || folder.ends_with('/')).min_by_key(|folder| folder.len());
        let folder = folder.map(str::to_owned).ok_or_else(|| damaged("an archive without meta.json".to_owned()))?;
        Ok(Self::Archive { archive, folder, stored: content.len() as u64 })
    }

    /// The text of the description.
    pub(super) fn description(&mut self, reading: &Reading<'_>) -> Result<Vec<u8>, ReadError> {
        if let Self::Folder { content, .. } = self {
            return Ok(content.to_vec());
        }
        Ok(self.file(DESCRIPTION, reading)?.into_parts().0)
    }

    /// The content of the file of this name.
    fn file(&mut self, name: &str, reading: &Reading<'_>) -> Result<Content, ReadError> {
        let what = shown(name);
        match self {
            Self::Folder { beside, stored, .. } => {
                let content = beside.open(name, "an image of SOG", reading.params)?.rest()?;
                *stored = stored.saturating_add(content.len() as u64);
                Ok(content)
            }
            Self::Archive { archive, folder, .. } => {
                let refused = |e: zip::result::ZipError| damaged(format!("{what}: {e}"));
                let path = [folder.as_bytes(), name.as_bytes()].concat();
                let index = archive.index_for_name_raw(&path);
                let index = index.ok_or_else(|| damaged(format!("an archive without {what}")))?;
                let mut file = archive.by_index(index).map_err(refused)?;
                let length = file.size();
                input::check_deflated(length, file.compressed_size(), "an archive")?;
                let held = reading.params.memory.take(&what, length)?;
                let mut bytes = Vec::new();
                input::reserve(&mut bytes, length as usize)?;
                // One byte more is asked for than there should be, to see the end.
                let ended = file.by_ref().take(length.saturating_add(1)).read_to_end(&mut bytes);
                ended.map_err(|e| damaged(format!("{what}: {e}")))?;
                if bytes.len() as u64 != length {
                    return Err(damaged(format!("{what} of {} bytes in the place of {length}", bytes.len())));
                }
                Ok(Content::new(bytes, held))
            }
        }
    }

    /// The image of this name, which has at least so many pixels.
    pub(super) fn image(&mut self, name: &str, least: usize, reading: &mut Reading<'_>) -> Result<Image, ReadError> {
        reading.go_on()?;
        let content = self.file(name, reading)?;
        let (Self::Archive { stored, .. } | Self::Folder { stored, .. }) = self;
        let what = shown(name);
        let wrong = |found: String| {
            let hint = "images of SOG are WebP without losses: write the scene anew, such as with SplatTransform";
            ReadError::input(Place::File, format!("{what} as a whole WebP or PNG image of 8 bits"), found, hint)
        };
        let format = match image::guess_format(&content) {
            Ok(format @ (ImageFormat::WebP | ImageFormat::Png)) => format,
            Ok(other) => return Err(wrong(format!("{other:?}"))),
            Err(_) => return Err(wrong("another format".to_owned())),
        };
        let mut reader = ImageReader::with_format(Cursor::new(&content[..]), format);
        let mut limits = Limits::default();
        limits.max_alloc = Some(reading.params.memory.left());
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(|e| wrong(e.to_string()))?;
        let (width, height) = decoder.dimensions();
        check_sides([width, height])?;
        let pixels = u64::from(width) * u64::from(height);
        if pixels < least as u64 {
            let expected = format!("{what} with a pixel for each of {least} Gaussians");
            let hint = "the file is damaged: write the scene anew, such as with SplatTransform";
            return Err(ReadError::input(Place::File, expected, format!("{width} x {height} pixels"), hint));
        }
        let channels = match decoder.color_type() {
            ColorType::Rgb8 => 3,
            ColorType::Rgba8 => 4,
            other => return Err(wrong(format!("pixels of {other:?}"))),
        };
        // An image of one colour takes next to nothing: the whole scene tells how much may come of it.
        input::check_packed(decoder.total_bytes(), *stored, "a SOG scene")?;
        // The decoder takes four bytes a pixel beside.
        let mut held = reading.params.memory.take(&what, decoder.total_bytes().saturating_add(4 * pixels))?;
        let mut bytes = Vec::new();
        input::reserve(&mut bytes, decoder.total_bytes() as usize)?;
        bytes.resize(decoder.total_bytes() as usize, 0);
        decoder.read_image(&mut bytes).map_err(|e| wrong(e.to_string()))?;
        held.set(&what, bytes.len() as u64)?;
        // The chunk of a WebP file that holds an image with losses.
        if format == ImageFormat::WebP && content.get(12..16) == Some(b"VP8 ") {
            let warning =
                format!("{what} was packed with losses, which changes every Gaussian: write the scene anew without");
            reading.notes.warnings.push(warning);
        }
        Ok(Image { size: [width, height], bytes, channels, _held: held })
    }
}
