//! Checks of footprints: the list of a scene, whose images are read here, and what objects choose of it.

use crate::at::At;
use crate::footprint::raw::{NumberOr, RawChoice, RawChosen, RawFootprint, RawImages};
use crate::paths::Paths;
use crate::source::in_memory::SourceData;
use crate::{Error, LoadOptions, Source, printable, shown};
use convert::FootprintChoice;
use read::{Fault, Loaded, ReadError, ReadParams, file};
use splat_core::{Exceeded, Footprint, FootprintImage, FootprintStack};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most footprints.
const MOST: usize = 256;
/// Longest side of an image, pixels.
const LONGEST_SIDE: u32 = 4096;
/// Names of images in a folder.
const ENDINGS: [&str; 2] = ["png", "exr"];

/// The footprints of a scene, and the files of those that are images.
#[derive(Default)]
pub(crate) struct Footprints {
    pub(crate) stack: FootprintStack,
    pub(crate) files: Vec<PathBuf>,
}

/// Reads the images of a list of footprints.
pub(crate) fn check_footprints(
    at: &At<'_>,
    raw: Option<&[RawFootprint]>,
    paths: &Paths,
    options: &LoadOptions,
) -> Result<Footprints, Error> {
    let Some(raw) = raw else { return Ok(Footprints::default()) };
    let mut layers = Vec::new();
    let mut images = Vec::new();
    let mut files = Vec::new();
    for (i, footprint) in raw.iter().enumerate() {
        let at = at.index(i);
        match footprint {
            NumberOr::Number(cutoff) => {
                layers.push(check_cutoff(&at, *cutoff)?);
                images.push(None);
            }
            NumberOr::Table(raw) => {
                let layer = check_cutoff(&at.key("cutoff"), raw.cutoff.unwrap_or(3.0))?;
                for (path, place) in check_paths(&at, raw, paths)? {
                    layers.push(layer);
                    images.push(Some(read_image(&place, &path, options)?));
                    files.push(path);
                }
            }
        }
        if layers.len() > MOST {
            let message = format!("expected 1 to {MOST} footprints, found {} up to here", layers.len());
            return Err(at.error(message, "leave some out"));
        }
    }
    let stack = FootprintStack::new(layers);
    let mut stack = stack.map_err(|_| at.error("expected 1 to 256 footprints, found 0", "leave `footprints` out"))?;
    for (id, image) in images.into_iter().enumerate() {
        if let Some(image) = image {
            stack = stack.with_image(id, image);
        }
    }
    Ok(Footprints { stack, files })
}

fn check_cutoff(at: &At<'_>, cutoff: f64) -> Result<Footprint, Error> {
    if (1.0..=8.0).contains(&cutoff) {
        return Ok(Footprint { cutoff: cutoff as f32 });
    }
    Err(at.error(format!("expected a number from 1 to 8, found {}", crate::short(cutoff)), ""))
}

/// The files that a table names, and where it does.
fn check_paths<'a>(at: &At<'a>, raw: &RawImages, paths: &Paths) -> Result<Vec<(PathBuf, At<'a>)>, Error> {
    match (&raw.image, &raw.images) {
        (Some(image), None) => {
            let at = at.key("image");
            Ok(vec![(paths.resolve(&at, image)?, at)])
        }
        (None, Some(folder)) => {
            let at = at.key("images");
            let listed = images_in(&paths.resolve(&at, folder)?)
                .map_err(|e| at.error(format!("\"{}\" cannot be listed: {e}", shown(folder)), "name a folder"))?;
            if listed.is_empty() {
                let message =
                    format!("expected a folder with PNG or OpenEXR images, found none in \"{}\"", shown(folder));
                return Err(at.error(message, "their names end in .png or .exr"));
            }
            let of_root = listed.iter().map(|name| paths.resolve(&at, &format!("{folder}/{name}")));
            of_root.map(|path| Ok((path?, at.clone()))).collect()
        }
        _ => {
            let found = if raw.image.is_some() { "both" } else { "none" };
            Err(at.error(
                format!("expected one of `image` and `images`, found {found}"),
                "such as { image = \"leaf.png\" }",
            ))
        }
    }
}

/// Names of the images in a folder, sorted.
fn images_in(folder: &Path) -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name();
        let is_image =
            Path::new(&name).extension().is_some_and(|e| ENDINGS.iter().any(|end| e.eq_ignore_ascii_case(end)));
        if let (true, Some(name)) = (is_image, name.to_str()) {
            names.push(name.to_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// An image that takes more memory than there may be; the reader says first how many bytes.
fn too_large(error: &ReadError, limit: u64) -> Error {
    let needed = error.found.split(' ').next().and_then(|bytes| bytes.parse().ok()).unwrap_or(u64::MAX);
    let what = format!("the image of a footprint {}", error.file).into();
    Error::Limit(Exceeded { what, needed, limit: Some(limit), unit: "bytes", hint: error.hint.into() })
}

/// The coverage of a place by an image, of a file or in memory; all three channels of an image in memory say it.
fn read_image(at: &At<'_>, path: &Path, options: &LoadOptions) -> Result<Arc<FootprintImage>, Error> {
    let memory = &options.memory;
    let refuse = |found: String, hint: &str| {
        Err(at.error(format!("expected an image of coverage, {} has {found}", printable(path)), hint))
    };
    let image = match options.in_memory.get(path) {
        Some(SourceData::Image(image)) => image.clone(),
        Some(_) => return refuse("something else".into(), "name an image"),
        None => {
            let params = ReadParams { is_coverage: true, memory: memory.clone(), ..ReadParams::default() };
            let (loaded, _) = file(path, &params, None).map_err(|e| match e.fault {
                Fault::Limit => too_large(&e, memory.limit()),
                _ => at.error(format!("{}{}: expected {}, found {}", e.file, e.place, e.expected, e.found), e.hint),
            })?;
            match loaded {
                Loaded::Image(image) => Arc::new(image),
                _ => return refuse("something else".into(), "name a PNG or OpenEXR image"),
            }
        }
    };
    // While means are taken of it.
    let _held = memory.take(&printable(path), image.bytes()).map_err(Error::Limit)?;
    let [width, height] = image.size;
    if width.max(height) > LONGEST_SIDE {
        let found = format!("{width} x {height} pixels");
        return refuse(found, "make it smaller: of more than 128 pixels a side means are taken");
    }
    let coverage: Vec<f32> = image.pixels.iter().map(|pixel| pixel[0]).collect();
    if let Some(k) = coverage.iter().position(|c| !(0.0..=1.0).contains(c)) {
        let x = k as u32 % width;
        let y = k as u32 / width;
        return refuse(
            format!("{} at pixel ({x}, {y})", coverage[k]),
            "a share from 0 to 1 is how much of a place is covered",
        );
    }
    match FootprintImage::new(image.size, &coverage) {
        Ok(image) => Ok(Arc::new(image)),
        Err(_) => refuse("no pixel above 0".into(), "what is covered is its alpha, or how bright it is without one"),
    }
}

/// What an object chooses; `of_material` is what its material says, where it does.
pub(crate) fn check_choice(
    at: &At<'_>,
    raw: Option<&RawChoice>,
    of_material: Option<u8>,
    stack: &FootprintStack,
    source: &Source,
) -> Result<FootprintChoice, Error> {
    let at_key = at.key("footprint");
    let plain = RawChosen { of: None, seed: None, turn: None };
    let (stated, chosen) = match raw {
        None => (None, &plain),
        Some(NumberOr::Number(id)) => (Some(vec![check_footprint(&at_key, *id, stack)?]), &plain),
        Some(NumberOr::Table(chosen)) => {
            let at_of = at_key.key("of");
            let ids = chosen.of.as_ref().map(|listed| {
                let ids =
                    listed.iter().enumerate().map(|(i, id)| check_footprint(&at_of.index(i), f64::from(*id), stack));
                ids.collect::<Result<Vec<u8>, Error>>()
            });
            (ids.transpose()?, chosen)
        }
    };
    if stated.as_ref().is_some_and(|ids| ids.is_empty() || ids.len() > MOST) {
        return Err(at_key.key("of").error(format!("`of`: expected 1 to {MOST} footprints"), "such as [1, 2]"));
    }
    let by_column = stated.is_none() && matches!(source, Source::Points(_));
    let ids = stated.unwrap_or_else(|| vec![of_material.unwrap_or(0)]);
    let shows_images =
        if by_column { stack.has_images() } else { ids.iter().any(|id| stack.image(usize::from(*id)).is_some()) };
    let turn = at_key.number("turn", chosen.turn.unwrap_or(0.0), 0.0..=180.0)?.to_radians();
    if chosen.turn.is_some() && !shows_images {
        return Err(at_key.key("turn").error("`turn` belongs to footprints that are images", "`of` names none"));
    }
    if chosen.seed.is_some() && ids.len() == 1 && turn == 0.0 {
        let message = "`seed` is of what is chosen by chance, and there is one footprint and no turn";
        return Err(at_key.key("seed").error(message, "give more in `of`, or a `turn`"));
    }
    if source.is_medium() && ids.iter().any(|id| stack.image(usize::from(*id)).is_some()) {
        let message = "a medium has no image as a footprint: it lies in the plane of a disc";
        return Err(at_key.error(message, "name a formula of `footprints`"));
    }
    Ok(FootprintChoice { stack: stack.clone(), ids, by_column, seed: chosen.seed.unwrap_or(0).into(), turn })
}

/// A footprint by its index.
pub(crate) fn check_footprint(at: &At<'_>, id: f64, stack: &FootprintStack) -> Result<u8, Error> {
    let count = stack.layers().len();
    if id.fract() == 0.0 && (0.0..count as f64).contains(&id) {
        return Ok(id as u8);
    }
    let message = format!("`footprint`: expected an index below {count}, found {id}");
    Err(at.error(message, "`footprints` lists them, counted from 0"))
}
