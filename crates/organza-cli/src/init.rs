//! `organza init`.

use super::args::InitArguments;
use super::console;
use super::given::{is_scene, wish, write_first};
use super::session::{path_text, reading_options, start_threads};
use organza::output::{Target, Targets};
use organza::{Error, Files, printable};
use serde_json::{Value, json};
use std::path::Path;

/// Writes a first scene of data files, to a file or to stdout. An output that is in the way is told before anything is read.
pub(super) fn run(arguments: &InitArguments) -> Result<(), Error> {
    if let Some(scene) = arguments.inputs.iter().find(|path| is_scene(path)) {
        return Err(Error::usage(format!("{} is a scene already", printable(scene)), "name data files"));
    }
    let wish = wish(&arguments.first, arguments.common.size, arguments.turntable)?;
    let mut targets = Targets::default();
    targets.add_inputs(&arguments.inputs);
    let target = arguments.output.as_deref().map(|path| check_name(path)).transpose()?;
    let target = target.map(|path| targets.add(path, arguments.force)).transpose()?;
    start_threads(arguments.common.threads)?;
    let options = reading_options(&arguments.common);
    let files = Files::default();
    let scene_file = target.as_ref().map_or(Path::new("scene.toml"), Target::path);
    let written = write_first(&arguments.inputs, scene_file, &wish, &files, &options)?;
    files.mended().iter().for_each(|line| console::warn(line));
    if let Some(target) = &target {
        target.write(written.text.as_bytes())?;
    }
    if arguments.common.json {
        let path = target.as_ref().map(|target| path_text(target.path()));
        let inputs: Value = arguments.inputs.iter().map(|path| path_text(path)).collect();
        return console::out(&format!("{:#}\n", json!({ "inputs": inputs, "scene": path, "text": written.text })));
    }
    match &target {
        Some(target) => {
            let path = printable(target.path());
            let argument = console::argument(target.path());
            console::out(&format!("wrote {path}; draw it: organza render {argument} -o picture.png\n"))
        }
        None => console::out(&written.text),
    }
}

/// A scene is TOML: another name would be read as something else.
fn check_name(path: &Path) -> Result<&Path, Error> {
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("toml") => Ok(path),
        _ => Err(Error::usage(format!("{}: expected a name that ends in .toml", printable(path)), "")),
    }
}
