//! What a command is given: a scene, or data files of which a first scene is made in memory.

use super::args::{Axis, FirstArguments, SceneArguments};
use super::console;
use super::session::{check_backend, render_options, start_threads};
use organza::scene::{self, DEFAULT_FILL, DEFAULT_SIZE, Override, UpAxis, short};
use organza::{Context, Error, Files, InMemory, Progress, RenderOptions, SourceData, printable};
use organza_survey::{DataFile, NamedTable, Preset, Wish, Written, first_scene, material_named};
use read::is_foreign_json;
use splat_core::MemoryAccount;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Bytes of a file in which a scene says that it is one.
const BEGINNING: u64 = 4096;

/// A scene's text, read or made.
pub(super) struct Given {
    /// The scene's file; of data files one that is not there, in this folder.
    pub(super) file: PathBuf,
    /// Its text.
    pub(super) bytes: Vec<u8>,
    /// Whether it was made of data files.
    pub(super) is_made: bool,
}

/// Reads the scene, or the data files and makes a scene of them, for a turntable of so many frames; starts the threads. What was read
/// of data is in the files.
pub(super) fn given(arguments: &SceneArguments, turntable: Option<u32>) -> Result<(Given, Files), Error> {
    check_backend(arguments)?;
    start_threads(arguments.common.threads)?;
    let files = Files::default();
    if let Some(file) = scene_among(&arguments.inputs)? {
        refuse_wishes(&arguments.first)?;
        return Ok((Given { file: file.clone(), bytes: scene::read(file)?, is_made: false }, files));
    }
    let wish = wish(&arguments.first, arguments.common.size, turntable)?;
    let file = virtual_file(&arguments.inputs);
    let written = write_first(&arguments.inputs, &file, &wish, &files, &render_options(arguments))?;
    Ok((Given { file, bytes: written.text.into_bytes(), is_made: true }, files))
}

/// Options of a first scene that are values of a scene too, where that places its camera by itself.
pub(super) fn camera_overrides(first: &FirstArguments) -> Result<Vec<Override>, Error> {
    let options = [("azimuth", first.azimuth), ("elevation", first.elevation), ("fit", first.fit)];
    let some = options.into_iter().filter_map(|(name, value)| Some((name, value?)));
    let one = |(name, value): (&str, f64)| {
        Ok(Override::from_option(
            format!("--{name} {}", short(value)),
            &format!("camera.{name}"),
            &format!("{value:?}"),
        )?)
    };
    some.map(one).collect()
}

/// Reads data files and writes a first scene of them, as the text of `scene_file`.
pub(super) fn write_first(
    inputs: &[PathBuf],
    scene_file: &Path,
    wish: &Wish,
    files: &Files,
    options: &RenderOptions,
) -> Result<Written, Error> {
    let progress = Progress::new();
    let context = Context { files, options, progress: &progress };
    let read = inputs.iter().map(|path| DataFile::read(path, wish, context));
    let mut data = read.collect::<Result<Vec<_>, _>>()?;
    let takes_colors = |d: &DataFile| {
        matches!(d.data, SourceData::Points(_) | SourceData::Mesh(_) | SourceData::Painted(..)) || d.array.is_some()
    };
    if wish.color_by.is_some() && !data.iter().any(takes_colors) {
        if let Some(error) = data.iter_mut().find_map(|d| d.array_error.take()) {
            return Err(error);
        }
        let hint = "leave it out, or in a scene give the surface a `field`, the volume whose values it shows";
        return Err(Error::usage(
            "--color-by is for points, meshes and arrays of VTK volumes, and no file has such",
            hint,
        ));
    }
    let has_map =
        data.iter().any(|d| matches!(d.data, SourceData::Points(_) | SourceData::Mesh(_) | SourceData::Painted(..)));
    if (wish.color_range.is_some() || wish.is_logarithmic) && !has_map {
        let named = if wish.is_logarithmic { "--log" } else { "--color-range" };
        let message = format!("{named} is for the colours of points and meshes, and no file has such");
        return Err(Error::usage(message, "the `transfer` of a volume has its values: `organza init` writes it"));
    }
    let written = first_scene(&data, scene_file, wish, &InMemory::default(), context)?;
    written.remarks.iter().for_each(|remark| console::remark(remark));
    // The scene says what it uses of the files.
    files.forget_notes();
    Ok(written)
}

/// What the command line says of a first scene.
pub(super) fn wish(first: &FirstArguments, size: Option<[i64; 2]>, turntable: Option<u32>) -> Result<Wish, Error> {
    let check = |name: &str, value: Option<f64>, low: f64, high: f64| match value {
        Some(v) if !(low..=high).contains(&v) => {
            Err(Error::usage(format!("--{name} {}: expected a number from {low} to {high}", short(v)), ""))
        }
        _ => Ok(value),
    };
    if let Some(fit) = first.fit.filter(|fit| !(*fit > 0.0 && *fit <= 1.0)) {
        let message = format!("--fit {}: expected a number above 0, at most 1", short(fit));
        return Err(Error::usage(message, "the share of the picture's width or height that is filled"));
    }
    let side = |side: i64| u32::try_from(side).ok().filter(|s| (1..=65536).contains(s));
    let size = match size {
        None => DEFAULT_SIZE,
        Some([w, h]) => match (side(w), side(h)) {
            (Some(w), Some(h)) => [w, h],
            _ => {
                let bad = if side(w).is_none() { w } else { h };
                let message = format!("--size {w}x{h}: `size`: expected 1 to 65536 pixels a side, found {bad}");
                return Err(Error::usage(message, ""));
            }
        },
    };
    Ok(Wish {
        azimuth: check("azimuth", first.azimuth, -360.0, 360.0)?,
        elevation: check("elevation", first.elevation, -90.0, 90.0)?,
        fill: first.fit.unwrap_or(DEFAULT_FILL),
        turntable,
        size,
        preset: first.preset.as_deref().map(Preset::named).transpose()?,
        material: first.material.as_deref().map(material_named).transpose()?,
        color_by: first.color_by.clone(),
        color_range: first.color_range,
        is_logarithmic: first.log,
        labels: first.labels.as_deref().map(|path| NamedTable::read(path, &MemoryAccount::default())).transpose()?,
        up: first.up.map(|axis| match axis {
            Axis::Y => UpAxis::Y,
            Axis::Z => UpAxis::Z,
            Axis::MinusY => UpAxis::MinusY,
        }),
        ground: first.ground,
    })
}

/// The scene, if one is given; it stands alone.
fn scene_among(inputs: &[PathBuf]) -> Result<Option<&PathBuf>, Error> {
    let Some(scene) = inputs.iter().find(|path| is_scene(path)) else { return Ok(None) };
    if inputs.len() > 1 {
        let message = format!("{} is a scene, and {} files are given", printable(scene), inputs.len());
        return Err(Error::usage(message, "draw one scene, or data files without a scene"));
    }
    Ok(Some(scene))
}

/// Whether a file is a scene: by its extension, unless it is JSON of another program, or by a line `version = …` near its beginning.
pub(super) fn is_scene(path: &Path) -> bool {
    let has_extension = |name: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(name));
    if has_extension("toml") {
        return true;
    }
    // Asked before opening: opening a pipe waits for its writer.
    if !std::fs::metadata(path).is_ok_and(|meta| meta.is_file()) {
        return has_extension("json");
    }
    let mut beginning = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(BEGINNING).read_to_end(&mut beginning));
    if has_extension("json") {
        return !is_foreign_json(&beginning);
    }
    let is_version =
        |line: &[u8]| line.strip_prefix(b"version").is_some_and(|rest| rest.trim_ascii_start().starts_with(b"="));
    read.is_ok() && beginning.split(|b| *b == b'\n').any(is_version)
}

/// What is said of data files alone says nothing of a scene.
fn refuse_wishes(first: &FirstArguments) -> Result<(), Error> {
    let options = [
        ("--preset", first.preset.is_some()),
        ("--material", first.material.is_some()),
        ("--color-by", first.color_by.is_some()),
        ("--labels", first.labels.is_some()),
        ("--up", first.up.is_some()),
        ("--ground", first.ground),
    ];
    let named = options.into_iter().find(|(_, on)| *on);
    named.map_or(Ok(()), |(name, _)| {
        let hint = if name == "--material" {
            "name a `preset` in a table [material.NAME], or by --set"
        } else if name == "--labels" {
            "set `labels` of the object, such as --set object.NAME.labels=FILE"
        } else {
            "change the scene"
        };
        Err(Error::usage(format!("{name} is for data files, and a scene is given"), hint))
    })
}

/// The file that `organza init` would write in this folder.
fn virtual_file(inputs: &[PathBuf]) -> PathBuf {
    let name = inputs.first().and_then(|path| path.file_name()).unwrap_or("scene".as_ref());
    let stem = Path::new(name);
    let stem = if stem.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
        stem.with_extension("")
    } else {
        stem.to_owned()
    };
    stem.with_extension("toml")
}
