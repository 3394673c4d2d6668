//! The keys of the JSON Schema and of the guide.

use serde_json::Value;
use std::collections::BTreeSet;

/// Every key by its path: list items and named tables add nothing to it, kinds of lights do, as in `light.spot.outer`.
pub(crate) fn keys() -> BTreeSet<String> {
    let schema: Value = serde_json::from_str(&organza::scene::schema()).unwrap();
    let mut keys = BTreeSet::new();
    collect(&schema, &schema, "", &mut keys);
    keys
}

fn collect(root: &Value, node: &Value, path: &str, keys: &mut BTreeSet<String>) {
    if let Some(name) = node["$ref"].as_str() {
        let name = name.rsplit('/').next().unwrap();
        // Parts of solids are the same wherever they stand, within each other too.
        let is_part = name == "Part";
        if is_part && path.starts_with("object.part") {
            return;
        }
        let path = if is_part { "object.part" } else { path };
        return collect(root, &root["$defs"][name], path, keys);
    }
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    for (key, value) in node["properties"].as_object().into_iter().flatten() {
        if value["const"].is_string() {
            continue;
        }
        keys.insert(join(key));
        collect(root, value, &join(key), keys);
    }
    for kind in node["oneOf"].as_array().into_iter().flatten() {
        let name = kind["properties"]["kind"]["const"].as_str();
        collect(root, kind, &name.map_or_else(|| path.to_owned(), join), keys);
    }
    for other in node["anyOf"].as_array().into_iter().flatten().chain(node["allOf"].as_array().into_iter().flatten()) {
        collect(root, other, path, keys);
    }
    for inner in [&node["items"], &node["additionalProperties"]] {
        if inner.is_object() {
            collect(root, inner, path, keys);
        }
    }
}

/// A section of the guide.
pub(crate) struct Section {
    pub(crate) heading: String,
    /// Every name between backticks.
    pub(crate) words: BTreeSet<String>,
    /// Those in the first columns of its tables.
    pub(crate) first_column: BTreeSet<String>,
}

/// The sections of the guide; the first, without a heading, has the words of all.
pub(crate) fn sections() -> Vec<Section> {
    let mut sections = vec![Section { heading: String::new(), words: BTreeSet::new(), first_column: BTreeSet::new() }];
    let mut in_code = false;
    for line in super::scenes::guide().lines() {
        in_code ^= line.starts_with("```");
        if !in_code && line.starts_with('#') {
            sections.push(Section { heading: line.to_owned(), words: BTreeSet::new(), first_column: BTreeSet::new() });
        }
        if in_code {
            continue;
        }
        sections[0].words.extend(names(line));
        let section = sections.last_mut().unwrap();
        section.words.extend(names(line));
        if let Some(cell) = line.strip_prefix('|').and_then(|row| row.split('|').next()) {
            section.first_column.extend(names(cell));
        }
    }
    sections
}

/// The names between backticks, and those inside of what is between them.
fn names(text: &str) -> Vec<String> {
    let quoted = text.split('`').skip(1).step_by(2);
    let is_name = |w: &&str| !w.is_empty() && w.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    quoted
        .flat_map(|q| q.split(|c: char| !c.is_ascii_lowercase() && c != '_'))
        .filter(is_name)
        .map(str::to_owned)
        .collect()
}

/// Where the guide tells of the keys of a table.
pub(crate) fn heading(table: &str) -> &'static str {
    match table {
        "" => "",
        "camera" => "`[camera]`",
        "background" | "ambient" => "`[background]` and `[ambient]`",
        "object" => "## `[[object]]`",
        "footprints" | "object.footprint" => "## `footprints`",
        "object.transform" => "`transform`",
        "object.transfer" => "`transfer`",
        "object.isosurface" | "object.level_set" | "object.slice" => "### Surfaces of fields",
        "object.part" => "#### Solids from solids",
        "object.part.isosurface" | "object.part.level_set" => "### Surfaces of fields",
        "object.clip" => "### `clip`",
        "object.field" => "### Fields that surfaces show",
        "object.extract" => "### What a light sees",
        "object.color_by" | "object.point_size" => "### Raw points",
        "object.labels" => "### Labels",
        "material" | "material.medium" | "material.absorption" | "material.cauchy" | "material.bump" => {
            "`[material.NAME]`"
        }
        "render" => "## `[render]`",
        "render.points" => "`[render.points]`",
        "render.shadow" => "`[render.shadow]`",
        "render.particles" => "`[render.particles]`",
        "render.sheets" => "`[render.sheets]`",
        "render.surfels" => "`[render.surfels]`",
        "animation" | "animation.track" | "animation.track.keys" | "animation.track.stop" => "`[animation]`",
        _ if table.starts_with("light") => "`[[light]]`",
        _ if table.starts_with("object.") => "### Generated sources",
        _ => "no section",
    }
}

/// What stands in first columns beside keys: kinds of lights, tables.
pub(crate) fn is_value(name: &str) -> bool {
    [
        "point",
        "directional",
        "spot",
        "sphere",
        "disk",
        "rect",
        "implicit",
        "density",
        "cloud",
        "rectangle",
        "medium_box",
        "medium_ball",
        "isosurface",
        "level_set",
        "union",
        "intersection",
        "difference",
        "slice",
        "track",
        "ply",
        "obj",
        "stl",
    ]
    .contains(&name)
}
