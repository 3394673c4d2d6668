//! `organza info`.

mod contents;

use super::args::InfoArguments;
use super::session::path_text;
use super::{console, memory};
use contents::{FileInfo, contents};
use organza::scene::{self, LoadOptions, Scene, Source};
use organza::{Error, escape_controls};
use serde_json::{Value, json};
use splat_core::LightShape;

/// Describes a scene (`.toml`, `.json`) or a data file.
pub(super) fn run(arguments: &InfoArguments) -> Result<(), Error> {
    let is_scene =
        arguments.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml") || e.eq_ignore_ascii_case("json"));
    let document = if is_scene {
        let options = LoadOptions { allow_path: arguments.allow_path, ..LoadOptions::default() };
        scene_document(&scene::load(&arguments.file, &options)?)
    } else {
        let info = contents(&arguments.file, memory::default_limit(), arguments.strict)?;
        info.mended.iter().for_each(|line| console::warn(line));
        file_document(&info)
    };
    if arguments.json {
        return console::out(&format!("{document:#}\n"));
    }
    let mut text = String::new();
    lines(&document, "", &mut text);
    console::out(&text)
}

fn scene_document(scene: &Scene) -> Value {
    let objects = scene.objects.iter().map(|o| {
        json!({
            "name": o.name,
            "source": source_name(&o.source),
            "path": source_path(&o.source),
            "up": o.up.axis.name(),
            "material": scene.materials[o.material].name,
            "visible": o.visible,
        })
    });
    let lights = scene.lights.iter().map(|l| {
        json!({
            "kind": light_name(&l.light.shape),
            "intensity": l.light.intensity,
            "points": l.samples,
            "shadow": l.shadow,
            "texture": l.slide.as_ref().map(|slide| path_text(&slide.path)),
        })
    });
    json!({
        "kind": "scene",
        "sha256": scene.sha256,
        "size": scene.camera.size,
        "objects": objects.collect::<Value>(),
        "lights": lights.collect::<Value>(),
        "materials": scene.materials.iter().skip(1).map(|m| m.name.as_str()).collect::<Vec<_>>(),
    })
}

fn source_name(source: &Source) -> &'static str {
    match source {
        Source::Mesh(_) => "mesh",
        Source::Points(_) => "points",
        Source::Volume(_) => "volume",
        Source::Implicit(_) => "implicit",
        Source::Isosurface(_) => "isosurface",
        Source::LevelSet(_) => "level_set",
        Source::Slice(_) => "slice",
        Source::Density(_) => "density",
        Source::Cloud(_) => "cloud",
        Source::Rectangle(_) => "rectangle",
        Source::Medium(_) => "medium",
    }
}

fn source_path(source: &Source) -> Option<String> {
    source.path().map(path_text)
}

fn light_name(shape: &LightShape) -> &'static str {
    match shape {
        LightShape::Directional { .. } => "directional",
        LightShape::Spot { .. } => "spot",
        LightShape::Sphere { .. } => "sphere",
        LightShape::Disk { .. } => "disk",
        LightShape::Rect { .. } => "rect",
        _ => "point",
    }
}

fn file_document(info: &FileInfo) -> Value {
    json!({
        "kind": info.kind,
        "bytes": info.bytes,
        "counts": info.counts.iter().map(|(name, n)| ((*name).to_owned(), json!(n))).collect::<Value>(),
        "attributes": info.attributes,
        "bounds": info.bounds.map(|b| [b.min.to_array(), b.max.to_array()]),
        "range": info.range,
        "not_used": info.unused,
        "remarks": info.remarks,
        "mended": info.mended,
        "up": info.up.name(),
    })
}

/// A document as indented lines; null and empty values are left out.
fn lines(value: &Value, indent: &str, text: &mut String) {
    let Value::Object(fields) = value else { return };
    for (key, value) in fields {
        match value {
            Value::Null => {}
            Value::Array(items) if items.is_empty() => {}
            Value::Object(_) => {
                *text += &format!("{indent}{key}:\n");
                lines(value, &format!("{indent}  "), text);
            }
            Value::Array(items) if items.iter().all(Value::is_object) => {
                for (i, item) in items.iter().enumerate() {
                    *text += &format!("{indent}{key} {i}:\n");
                    lines(item, &format!("{indent}  "), text);
                }
            }
            Value::String(s) => *text += &format!("{indent}{key}: {}\n", escape_controls(s)),
            other => *text += &format!("{indent}{key}: {other}\n"),
        }
    }
}
