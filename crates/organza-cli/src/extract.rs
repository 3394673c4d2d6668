//! `organza extract`: the surface that a light of a scene sees first, straight from its shadow map (Gunjee 2007, Figure 15 a).

use super::args::ExtractArguments;
use super::console;
use super::console::bar::with_bar;
use super::convert::begin;
use super::session::{path_text, render_options};
use organza::scene::{ExtractSource, MOST_ABSORBANCE, Scene};
use organza::{Context, Error, printable};
use serde_json::json;
use splat_core::RawPoints;
use std::fmt::Write as _;

/// Finds the surface and writes it as points with normals, which `points` of a scene reads.
pub(super) fn run(arguments: &ExtractArguments) -> Result<(), Error> {
    let (scene, files, target) = begin(&arguments.scene, &arguments.output, arguments.force)?;
    let source = source(arguments, &scene)?;
    let options = render_options(&arguments.scene);
    let points = with_bar(|progress| {
        let points = organza::seen(&scene, &source, Context { files: &files, options: &options, progress })?;
        target.write(&ply(&points))?;
        progress.finish();
        Ok(points)
    })?;
    files.mended().iter().for_each(|warning| console::warn(warning));
    files.notes().iter().for_each(|note| console::remark(note));
    let count = points.len();
    if arguments.scene.common.json {
        let document =
            json!({ "output": path_text(target.path()), "points": count, "absorbance": arguments.absorbance });
        return console::out(&format!("{document:#}\n"));
    }
    let path = printable(target.path());
    let argument = console::argument(target.path());
    console::out(&format!("wrote {path} ({count} points); draw it: organza render {argument} -o picture.png\n"))
}

/// What a light of the scene sees of all its objects.
fn source(arguments: &ExtractArguments, scene: &Scene) -> Result<ExtractSource, Error> {
    let ExtractArguments { light, absorbance, .. } = *arguments;
    if !(absorbance > 0.0 && absorbance <= MOST_ABSORBANCE) {
        let message = format!("--absorbance: expected a number above 0, at most {MOST_ABSORBANCE}, found {absorbance}");
        return Err(Error::usage(message, ""));
    }
    if light >= scene.lights.len() {
        let message = format!("--light: expected a light below {}, found {light}", scene.lights.len());
        return Err(Error::usage(message, "lights are counted from 0, in the order of the scene"));
    }
    Ok(ExtractSource { light, absorbance, objects: Vec::new(), written: None, points: None })
}

/// Places in f64, for what lies far from the origin.
fn ply(points: &RawPoints) -> Vec<u8> {
    let mut head = "ply\nformat binary_little_endian 1.0\n".to_owned();
    let _ = writeln!(head, "comment what a light of a scene sees first\nelement vertex {}", points.len());
    for (kind, names) in [("double", ["x", "y", "z"].as_slice()), ("float", &["nx", "ny", "nz"])] {
        names.iter().for_each(|name| head += &format!("property {kind} {name}\n"));
    }
    let mut file = (head + "end_header\n").into_bytes();
    for (at, normal) in points.position.iter().zip(&points.normal) {
        let at = points.origin + at.as_dvec3();
        file.extend(at.to_array().iter().flat_map(|v| v.to_le_bytes()));
        file.extend(normal.to_array().iter().flat_map(|v| v.to_le_bytes()));
    }
    file
}
