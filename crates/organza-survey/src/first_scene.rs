//! Data files → the text of a scene that shows them.
//!
//! The text is made twice: first with a camera that is placed by itself, so that the place is found as for every scene; then with
//! the numbers of that place, light that comes from beside it, and the ground below what it sees.

mod look;
mod point_colors;

use crate::data_file::DataFile;
use crate::lamps::lamps;
use crate::number::{color, list, rounded, significant};
use crate::preset::{Preset, Wish};
use convert::ColorMap;
use look::{Object, all_stand, check_material, drawn_steps, material_remarks, objects, takes_preset};
use organza::scene::{
    DEFAULT_AZIMUTH, FoundCamera, LoadOptions, ROOT_KEY, Recipe, Scene, UpAxis, name_in_memory, parse, relative_path,
    root_for,
};
use organza::{Context, Error, InMemory, SourceData, printable};
use splat_core::glam::DVec3;
use splat_core::text::counted;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Vertical angle of view, degrees: nearer to what a person sees of a thing before them than a wide lens.
const FOV_Y: f64 = 30.0;
/// From where a body is seen that was scanned, degrees: its face, which looks along −Z once it stands.
const BEFORE_A_FACE: f64 = 150.0;
/// What is behind everything: dark, and bright for what is dark itself.
const DARK: [f32; 3] = [0.03, 0.033, 0.04];
const BRIGHT: [f32; 3] = [0.4, 0.43, 0.47];
/// Mean luminance below which what is seen is dark.
const IS_DARK: f64 = 0.04;
/// Half side of the ground over the size of what stands on it, and steps along it.
const GROUND: f64 = 4.0;
const GROUND_STEPS: f64 = 320.0;
const GROUND_COLOR: [f32; 3] = [0.32, 0.32, 0.33];

/// Width of a slab over the step of a volume: slabs as wide as a voxel show as a weave on flat surfaces.
const SLAB_WIDTH: f64 = 0.5;
/// Largest step over the least up to which it is that of the least one, whichever way the volume is seen.
const MOST_STEPS: f64 = 16.0;

/// A scene that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Its text, TOML.
    pub text: String,
    /// Where its camera is.
    pub found: FoundCamera,
    /// What was decided that a user may want otherwise, one sentence each.
    pub remarks: Vec<String>,
}

/// Writes a first scene of data, as the text of `scene_file`, which paths are relative to. `in_memory` has what is in no file, `files` are those that
/// were read.
///
/// # Errors
/// [`Error::Input`] for a name that a scene cannot write, or data that cannot be seen; as [`organza::render`] for what cannot be read.
pub fn first_scene(
    data: &[DataFile],
    scene_file: &Path,
    wish: &Wish,
    in_memory: &InMemory,
    context: Context<'_>,
) -> Result<Written, Error> {
    let folder = folder_of(scene_file)?;
    let paths: Vec<String> = data.iter().map(|d| written_path(&d.path, &folder)).collect::<Result<_, _>>()?;
    let on_disk = data.iter().map(|d| d.path.as_path()).filter(|path| name_in_memory(path).is_none());
    let tables = wish.labels.iter().map(|labels| labels.path.as_path());
    let root = root_for(scene_file, on_disk.chain(tables))?;
    let root = root.map(|root| text_of(&root)).transpose()?;
    if wish.preset.is_some() && !data.iter().any(|file| takes_preset(file, wish)) {
        if wish.preset.as_ref().is_some_and(Preset::is_labels) {
            check_labels(data, wish)?;
        }
        let is_look = wish.color_by.is_some() && wish.preset.as_ref().and_then(Preset::map).is_none();
        if is_look {
            let names: Vec<&str> = ColorMap::names().collect();
            let message = "--preset names the look of a volume, and --color-by needs a colour map";
            return Err(Error::usage(message, format!("name one of {}", names.join(", "))));
        }
        let message =
            "--preset is for volumes, and as a colour map for points and meshes by a column, and no file is drawn so";
        return Err(Error::usage(message, "leave it out; in a scene `color` of an object is the colour of a mesh"));
    }
    let table = wish.labels.as_ref().map(|labels| written_path(&labels.path, &folder)).transpose()?;
    let objects = objects(data, &paths, table.as_deref(), wish);
    if objects.iter().all(|object| object.labels().is_none()) {
        check_labels(data, wish)?;
    }
    check_material(data, &objects, wish)?;
    let azimuth = wish.azimuth.unwrap_or_else(|| default_azimuth(data));
    let head = |camera: &str| {
        let root =
            root.as_ref().map(|root| format!("{ROOT_KEY} = {}     # data may lie in this folder\n", quoted(root)));
        format!("version = 1\n{}\n[camera]\n{camera}", root.unwrap_or_default())
    };
    let mut camera = format!("auto = true\nazimuth = {azimuth:?}\nfit = {:?}\nfov_y = {FOV_Y:?}\n", wish.fill);
    if let Some(elevation) = wish.elevation {
        let _ = writeln!(camera, "elevation = {elevation:?}");
    }
    let _ = writeln!(camera, "size = {:?}", wish.size);
    let drawn = render_text(data, wish, objects.iter().all(|object| object.labels().is_some()));
    let seen: String = objects.iter().map(Object::material).chain(objects.iter().map(Object::text)).collect();
    let first = head(&camera) + &seen + &drawn;
    let load = LoadOptions { turntable: wish.turntable, in_memory: in_memory.clone(), ..LoadOptions::default() };
    let scene = parse(scene_file, first.as_bytes(), &load)?;
    let found = organza::fitted(&scene, context)?.1;
    let found = found.ok_or_else(|| Error::Internal("a camera that was to be placed has no place".into()))?;
    let camera = camera_text(&found, azimuth);
    let mut text =
        format!("# A first scene, written by `organza init`. Every key: docs/scene.md of Organza.\n{}", head(&camera));
    let is_dark = wish.material.is_none() && data.iter().filter_map(DataFile::luminance).any(|l| l < IS_DARK);
    // Clear matter shows what is behind it.
    let is_clear = wish.material.is_some_and(Recipe::is_clear);
    let background = if is_dark || is_clear { BRIGHT } else { DARK };
    let _ = write!(
        text,
        "\n[background]\ncolor = {}\n\n{}",
        color(background),
        lamps(&found.camera, wish.turntable.is_some())
    );
    text += &seen;
    if wish.ground {
        text += &ground(&found, is_clear);
    }
    text += &drawn;
    Ok(Written {
        text,
        found,
        remarks: up_remarks(data, wish)
            .chain(degree_remarks(data))
            .chain(label_remarks(data, &objects))
            .chain(column_remarks(data, wish))
            .chain(material_remarks(data, wish))
            .collect(),
    })
}

/// What is said of the axis that points up, of each file that says nothing of it.
fn up_remarks<'a>(data: &'a [DataFile], wish: &'a Wish) -> impl Iterator<Item = String> + 'a {
    let stand = all_stand(data);
    let remark = move |file: &DataFile| {
        let by = match file.stands.filter(|_| stand) {
            Some(UpAxis::MinusY) => {
                "-y does, as its points lie before a depth camera at the origin: --up y turns it".to_owned()
            }
            Some(axis) => format!("{} does, along which it stands: --up y turns it", axis.name()),
            None => "y does: --up z turns it".to_owned(),
        };
        format!("{}: nothing in it says which axis points up, so {by}", printable(&file.path))
    };
    let unsaid = |file: &&DataFile| file.stated_up.is_none() && wish.up.is_none();
    data.iter().filter(unsaid).map(remark)
}

/// Refuses a table of labels, and the look of such, for files none of which is a volume of labels.
fn check_labels(data: &[DataFile], wish: &Wish) -> Result<(), Error> {
    let is_look = wish.preset.as_ref().is_some_and(Preset::is_labels);
    let option = match &wish.labels {
        Some(labels) => format!("--labels {}", printable(&labels.path)),
        None if is_look => "--preset labels".to_owned(),
        None => return Ok(()),
    };
    let reason = |file: &DataFile| {
        let SourceData::Grid(grid) = &file.data else {
            let column = file.column.as_ref()?;
            return Some(format!("; {}: `{}` has other numbers, or too many", printable(&file.path), column.name));
        };
        let reason = look::stated_labels(grid, wish)?.err().unwrap_or_else(|| look::AS_IT_IS.to_owned());
        Some(format!("; {}: {reason}", printable(&file.path)))
    };
    let reasons: String = data.iter().filter_map(reason).collect();
    let hint = if is_look {
        "labels are whole numbers, 0 is nothing; leave the option out"
    } else {
        "labels are whole numbers, all of which the table has; 0 is nothing. without a table --preset labels draws all numbers"
    };
    Err(Error::usage(format!("{option}: no file is a volume of labels{reasons}"), hint))
}

/// Reports which volumes of whole numbers are drawn as surfaces of labels, and which could be but are not.
fn label_remarks<'a>(data: &'a [DataFile], objects: &'a [Object]) -> impl Iterator<Item = String> + 'a {
    data.iter().zip(objects).filter_map(|(file, object)| {
        let path = printable(&file.path);
        if let Some(doubt) = object.doubt() {
            return Some(format!("{path}: {doubt}"));
        }
        let labels = counted(object.labels()? as u64, "label");
        Some(format!("{path}: whole numbers that look like {labels}: each region has its surface and its colour; --preset mri draws amounts"))
    })
}

/// Reports which column of a file a mesh has its colours from without having been asked for, and which ones it could have them from.
fn column_remarks<'a>(data: &'a [DataFile], wish: &'a Wish) -> impl Iterator<Item = String> + 'a {
    /// Columns that are named.
    const NAMED: usize = 12;
    let is_free = |file: &&DataFile| wish.color_by.is_none() && wish.material.is_none() && !file.is_colored();
    let is_mesh = |file: &&DataFile| matches!(file.data, SourceData::Mesh(_)) && !file.columns.is_empty();
    data.iter().filter(is_free).filter(is_mesh).map(|file| {
        let shown = file.column.as_ref();
        let others = file.columns.iter().filter(|name| shown.is_none_or(|shown| shown.name != **name));
        let others: Vec<&str> = others.map(String::as_str).collect();
        let further = others.len().saturating_sub(NAMED);
        let mut list = others[..others.len().min(NAMED)].join(", ");
        if further > 0 {
            let _ = write!(list, " and {further} more");
        }
        let choose = match others.len() {
            0 => String::new(),
            _ => format!("; --color-by chooses another column: {list}"),
        };
        let path = printable(&file.path);
        match shown {
            Some(shown) if shown.is_constant() => {
                format!(
                    "{path}: `{}` is {} throughout, so the surface has one colour{choose}",
                    shown.name, shown.range[0]
                )
            }
            Some(shown) => format!("{path}: its colours are those of `{}`{choose}", shown.name),
            None => format!("{path}: it has no colours of its own; --color-by colours it by a column: {list}"),
        }
    })
}

/// What is said of files whose points are drawn in metres.
fn degree_remarks(data: &[DataFile]) -> impl Iterator<Item = String> + '_ {
    let said = "x and y look like degrees beside heights in metres, and are drawn as metres; without `degrees` a scene keeps them";
    data.iter().filter(|file| file.degrees).map(move |file| format!("{}: {said}", printable(&file.path)))
}

/// How it is drawn, where that is not as everything is: volumes alone by sheets, whose smooth edges need no more than one sample a pixel. Labels are
/// surfaces.
fn render_text(data: &[DataFile], wish: &Wish, are_labels: bool) -> String {
    let steps_of = |d: &DataFile| if let SourceData::Grid(grid) = &d.data { Some(drawn_steps(grid)) } else { None };
    let steps: Option<Vec<[f64; 2]>> = data.iter().map(steps_of).collect();
    let is_cloud = wish.preset.as_ref().is_some_and(Preset::is_cloud);
    let Some(steps) = steps.filter(|_| !is_cloud && !wish.ground && !are_labels) else { return String::new() };
    let mut text =
        "\n[render]\ntechnique = \"sheets\"     # sharp; \"points\" is softer and quicker\nantialias = 1\n".to_owned();
    let least = steps.iter().fold(f64::INFINITY, |least, [step, _]| least.min(*step));
    let mut sheets = String::new();
    if steps.iter().all(|[_, most]| *most <= MOST_STEPS * least) {
        let width = significant(SLAB_WIDTH * least, 3);
        let _ = writeln!(
            sheets,
            "slab_width = {width}     # half a voxel: wider ones take less time, and show on flat surfaces"
        );
    }
    if !sheets.is_empty() {
        text += &format!("\n[render.sheets]\n{sheets}");
    }
    text
}

/// Scanned bodies look away from where everything else is seen.
fn default_azimuth(data: &[DataFile]) -> f64 {
    let is_body = |d: &DataFile| matches!(d.data, SourceData::Grid(_)) && d.stated_up == Some(splat_core::UpAxis::Z);
    if data.iter().all(is_body) { BEFORE_A_FACE } else { DEFAULT_AZIMUTH }
}

fn camera_text(found: &FoundCamera, azimuth: f64) -> String {
    let FoundCamera { camera, target, elevation, bounds } = found;
    let unit = 1e-4 * bounds.diagonal().max(1e-300).max(camera.position.distance(*target) * 0.1);
    let [width, height] = camera.size;
    let mut text = format!(
        "# All is seen from an azimuth of {}° and {}° above; `auto = true` in the place of the next two lines finds that anew.\n\
         position = {}\ntarget = {}\n",
        rounded(azimuth, 0.1),
        rounded(elevation.to_degrees(), 0.1),
        list(camera.position.to_array(), unit),
        list(target.to_array(), unit),
    );
    if elevation.to_degrees().abs() > 80.0 {
        let _ = writeln!(text, "up = {}", list(camera.axes[1].to_array(), 1e-6));
    }
    let _ = writeln!(text, "fov_y = {FOV_Y:?}\nsize = [{width}, {height}]");
    text
}

/// The ground below what a scene shows, and the camera that sees it, as TOML: the tables `camera` and `object`.
///
/// # Errors
/// As [`organza::fitted`]; the camera of the scene is one that sees everything.
pub fn ground_of(scene: &Scene, context: Context<'_>) -> Result<String, Error> {
    let found = organza::fitted(scene, context)?.1;
    let found = found.ok_or_else(|| Error::usage("the camera of the scene has a place", "set `camera.auto`"))?;
    Ok(format!("[camera]\n{}{}", camera_text(&found, 0.0), ground(&found, false)))
}

/// A plane below all that is seen, which may be seen through what is clear.
fn ground(found: &FoundCamera, is_below_clear: bool) -> String {
    let technique = if is_below_clear {
        "# Of discs, which bent and mirrored rays meet.\n"
    } else {
        "technique = \"sheets\"     # lit in every pixel, so that shadows on it are sharp\n"
    };
    let bounds = found.bounds;
    let size = bounds.diagonal();
    let half = GROUND * size;
    let unit = 1e-4 * size;
    let center = DVec3::new(bounds.center().x, bounds.min.y, bounds.center().z);
    // Along the picture, so that its far side is a level horizon.
    let right = found.camera.axes[0];
    format!(
        "\n[[object]]\nname = \"ground\"\n\
         rectangle = {{ center = {}, u = {}, v = {}, spacing = {} }}\ncolor = {}\n\
         {technique}\
         casts_shadow = false     # nothing lies below it: the cells of shadow maps are left to what stands on it\n",
        list(center.to_array(), unit),
        list((right * half).to_array(), unit),
        list((DVec3::Y.cross(right) * half).to_array(), unit),
        rounded(2.0 * half / GROUND_STEPS, 1e-3 * 2.0 * half / GROUND_STEPS),
        color(GROUND_COLOR),
    )
}

/// The folder of a scene file, as the system knows it.
fn folder_of(scene_file: &Path) -> Result<PathBuf, Error> {
    let folder = Path::new(".").join(scene_file.parent().unwrap_or(Path::new("")));
    folder.canonicalize().map_err(|e| Error::io(&folder, "cannot find the folder", e))
}

/// A data file as a scene in `folder` names it.
fn written_path(path: &Path, folder: &Path) -> Result<String, Error> {
    if name_in_memory(path).is_some() {
        return text_of(path);
    }
    let real = path.canonicalize().map_err(|e| Error::io(path, "cannot find", e))?;
    text_of(&relative_path(folder, &real).unwrap_or(real))
}

fn text_of(path: &Path) -> Result<String, Error> {
    path.to_str().map(str::to_owned).ok_or_else(|| {
        let message = "this name is no UTF-8, in which scenes are written";
        Error::input(printable(path), message, "give the file another name, or a link to it")
    })
}

/// A text in TOML's quotes, which are JSON's but for one character.
pub(crate) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Grid;
    use splat_core::glam::DMat3;

    #[test]
    fn volumes_have_slabs_of_half_a_voxel_unless_their_steps_are_too_unlike() {
        let file = |steps: DVec3| {
            let grid =
                Grid { origin: DVec3::ZERO, axes: DMat3::from_diagonal(steps), dims: [2; 3], values: vec![0.0; 8] };
            DataFile {
                path: "a.nrrd".into(),
                data: SourceData::Grid(grid.into()),
                stated_up: None,
                stands: None,
                degrees: false,
                array: None,
                nodata: None,
                array_error: None,
                value_outside: None,
                column: None,
                columns: Vec::new(),
            }
        };
        let text = |files: &[DataFile]| render_text(files, &Wish::default(), false);
        assert!(text(&[file(DVec3::new(0.7, 0.7, 2.5))]).contains("\nslab_width = 0.35 "));
        assert!(text(&[file(DVec3::splat(4.0)), file(DVec3::ONE)]).contains("\nslab_width = 0.5 "));
        for unlike in [vec![file(DVec3::new(0.1, 0.1, 2.5))], vec![file(DVec3::ONE), file(DVec3::splat(20.0))]] {
            assert!(text(&unlike).contains("sheets") && !text(&unlike).contains("slab_width"));
        }
        assert_eq!(render_text(&[file(DVec3::ONE)], &Wish::default(), true), "");
        assert_eq!(render_text(&[file(DVec3::ONE)], &Wish { ground: true, ..Wish::default() }, false), "");
    }
}
