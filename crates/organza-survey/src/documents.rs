//! Scenes and data files described as JSON: the documents of `organza info --json`, which programs read.

use crate::facts::Facts;
use crate::histogram::Histogram;
use organza::printable;
use organza::scene::{Combination, Scene, SceneObject, Source};
use serde_json::{Value, json};
use splat_core::{LightShape, UpAxis};
use std::path::Path;

/// What a scene states: its objects, lights and materials.
pub fn scene_json(scene: &Scene) -> Value {
    let objects = scene.objects.iter().map(|o| {
        json!({
            "name": o.name,
            "source": source_name(&o.source),
            "path": source_path(o),
            "up": o.up.axis.name(),
            "material": scene.materials[o.material].name,
            "materials": o.material_ids().map(|id| &scene.materials[id].name).collect::<Vec<_>>(),
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
        Source::Points(_) | Source::Matter(_) => "points",
        Source::Extract(_) => "extract",
        Source::Volume(_) => "volume",
        Source::Implicit(_) => "implicit",
        Source::Isosurface(_) => "isosurface",
        Source::LevelSet(_) => "level_set",
        Source::Combined(source) => match source.combination {
            Combination::Union => "union",
            Combination::Intersection => "intersection",
            Combination::Difference => "difference",
        },
        Source::Slice(_) => "slice",
        Source::Density(_) => "density",
        Source::Cloud(_) => "cloud",
        Source::Rectangle(_) => "rectangle",
        Source::Medium(_) => "medium",
    }
}

/// The file that it reads, or all of them.
fn source_path(object: &SceneObject) -> Option<String> {
    let paths: Vec<String> = object.paths().map(path_text).collect();
    (!paths.is_empty()).then(|| paths.join(", "))
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

/// What a data file holds.
pub fn facts_json(facts: &Facts) -> Value {
    let histogram = |h: &Histogram| json!({ "low": h.low, "high": h.high, "counts": h.counts });
    let faults = facts.faults.map(|f| {
        json!({
            "open_edges": f.open_edges,
            "holes": f.holes,
            "crowded_edges": f.crowded_edges,
            "duplicate_triangles": f.duplicates,
            "degenerate_triangles": f.degenerate,
            "isolated_vertices": f.isolated,
        })
    });
    let labels =
        facts.labels.iter().map(|label| json!({ "number": label.number, "name": label.name, "voxels": label.voxels }));
    json!({
        "kind": facts.kind,
        "format": facts.format,
        "bytes": facts.bytes,
        "counts": facts.counts.iter().map(|(name, n)| ((*name).to_owned(), json!(n))).collect::<Value>(),
        "attributes": facts.attributes,
        "bounds": facts.bounds.map(|b| [b.min.to_array(), b.max.to_array()]),
        "size": facts.bounds.map(|b| b.size().to_array()),
        "distance_from_origin_over_size": facts.far(),
        "unit": facts.unit,
        "spacing": facts.spacing,
        "duplicate_points": facts.duplicates,
        "steps": facts.steps.map(|steps| steps.map(|s| s.to_array())),
        "range": facts.range,
        "histogram": facts.histogram.as_ref().map(histogram),
        "quantiles": facts.quantiles.iter().map(|(share, value)| json!([share, value])).collect::<Value>(),
        "columns": facts.columns.iter().map(|(name, range)| (name.clone(), json!(range))).collect::<Value>(),
        "columns_of": facts.associations.iter().map(|(name, association)| (name.clone(), json!(association.name()))).collect::<Value>(),
        "labels": labels.collect::<Value>(),
        "faults": faults,
        "not_used": facts.unused,
        "remarks": facts.remarks,
        "mended": facts.mended,
        "warnings": facts.warnings,
        "up": facts.up.name(),
        "up_is_stated": facts.is_up_stated,
        "stands_along": facts.stands.map(UpAxis::name),
    })
}

/// A path as it is, or printable where it is no text.
fn path_text(path: &Path) -> String {
    path.to_str().map_or_else(|| printable(path), str::to_owned)
}
