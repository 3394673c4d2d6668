//! `organza extract`: the surface that a light of a scene sees first, straight from its shadow map (Gunjee 2007, Figure 15 a).

use super::args::ExtractArguments;
use super::bar::with_bar;
use super::console;
use super::convert::{as_splats, check_name, refuse_of_pictures};
use super::given::given;
use super::session::{parse_scene, path_text, processor_only, render_options};
use organza::output::{Target, Targets};
use organza::{Error, printable};
use organza_judge::seen::Seen;
use serde_json::json;
use splat_core::glam::{DVec3, Vec3};
use std::fmt::Write as _;

/// Finds the surface and writes it as points with normals, which `points` of a scene reads. An output that is in the way is told before
/// anything is read.
pub(super) fn run(arguments: &ExtractArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    refuse_of_pictures(&arguments.scene)?;
    let path = check_name(&arguments.output)?;
    Target::new(path, arguments.force)?;
    let (given, files) = given(&arguments.scene, None)?;
    let mut scene = parse_scene(&arguments.scene, &given, None, None)?;
    let seen = Seen::new(&scene, arguments.light, arguments.absorbance)?;
    let mut targets = Targets::default();
    targets.add_inputs(&scene.files());
    let target = targets.add(path, arguments.force)?;
    as_splats(&mut scene);
    let options = render_options(&arguments.scene);
    let (count, said) = with_bar(|progress| {
        let mut loaded = organza::load(&scene, &options, progress, &files)?;
        let said = (std::mem::take(&mut loaded.warnings), std::mem::take(&mut loaded.notes));
        let points = seen.points(&scene, loaded, &options, progress)?;
        target.write(&ply(&points))?;
        progress.finish();
        Ok((points.len(), said))
    })?;
    said.0.iter().for_each(|warning| console::warn(warning));
    said.1.iter().for_each(|note| console::remark(note));
    if arguments.scene.common.json {
        let document =
            json!({ "output": path_text(target.path()), "points": count, "absorbance": arguments.absorbance });
        return console::out(&format!("{document:#}\n"));
    }
    let path = printable(target.path());
    console::out(&format!("wrote {path} ({count} points); draw it: organza render {path} -o picture.png\n"))
}

/// Places in f64, for what lies far from the origin.
fn ply(points: &[(DVec3, Vec3)]) -> Vec<u8> {
    let mut head = "ply\nformat binary_little_endian 1.0\n".to_owned();
    let _ = writeln!(head, "comment what a light of a scene sees first\nelement vertex {}", points.len());
    for (kind, names) in [("double", ["x", "y", "z"].as_slice()), ("float", &["nx", "ny", "nz"])] {
        names.iter().for_each(|name| head += &format!("property {kind} {name}\n"));
    }
    let mut file = (head + "end_header\n").into_bytes();
    for (at, normal) in points {
        file.extend(at.to_array().iter().flat_map(|v| v.to_le_bytes()));
        file.extend(normal.to_array().iter().flat_map(|v| v.to_le_bytes()));
    }
    file
}
