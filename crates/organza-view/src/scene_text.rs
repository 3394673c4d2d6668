//! The text of a scene with changes in it, and with its comments.

use crate::state::Source;
use organza::Error;
use organza::scene::{Override, printable};
use serde_json::Value as Json;
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// The text of a scene with these changes as values: TOML keeps its comments, JSON has its keys in order of the alphabet.
pub(crate) fn changed(source: &Source, overrides: &[Override]) -> Result<String, Error> {
    let text = String::from_utf8_lossy(&source.text);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    if source.is_json() { changed_json(text, overrides) } else { changed_toml(source, text, overrides) }
}

fn changed_toml(source: &Source, text: &str, overrides: &[Override]) -> Result<String, Error> {
    let mut document: DocumentMut = text.parse().map_err(|e| internal(&format!("its text: {e}")))?;
    for change in overrides {
        expand_auto(&mut document);
        let value: Value = change.toml().parse().map_err(|e| internal(&format!("the value of a change: {e}")))?;
        set_in_table(document.as_table_mut(), change.path(), value).ok_or_else(|| internal(change.flag()))?;
    }
    // The text is saved elsewhere, as a browser does.
    let folder = std::path::absolute(&source.file).ok();
    let folder = folder.as_deref().and_then(std::path::Path::parent).map_or_else(String::new, printable);
    Ok(format!("# As `organza view` showed it. Paths are relative to {folder}.\n{document}"))
}

fn internal(what: &str) -> Error {
    Error::Internal(format!("the scene cannot be written with a change in it: {what}"))
}

/// `camera = "auto"` is short for a table.
fn expand_auto(document: &mut DocumentMut) {
    if let Some(camera) = document.get_mut("camera").filter(|camera| camera.as_str() == Some("auto")) {
        let mut table = InlineTable::new();
        table.insert("auto", true.into());
        *camera = Item::Value(Value::InlineTable(table));
    }
}

/// Puts a value at the end of a path of keys; nothing where that leads through something else than tables and lists.
fn set_in_table(table: &mut dyn TableLike, path: &[String], value: Value) -> Option<()> {
    let (key, rest) = path.split_first()?;
    if !table.contains_key(key) {
        let missing = if rest.is_empty() { Item::Value(value.clone()) } else { Item::Table(Table::new()) };
        table.insert(key, missing);
    }
    set_in_item(table.get_mut(key)?, rest, value)
}

fn set_in_item(item: &mut Item, path: &[String], value: Value) -> Option<()> {
    let Some((key, rest)) = path.split_first() else {
        replace(item, value);
        return Some(());
    };
    match item {
        Item::Table(table) => set_in_table(table, path, value),
        Item::ArrayOfTables(tables) => {
            let names = tables.iter().map(|table| table.get("name").and_then(Item::as_str));
            let rank = rank_of(names, key)?;
            set_in_table(tables.get_mut(rank)?, rest, value)
        }
        Item::Value(found) => set_in_value(found, path, value),
        Item::None => None,
    }
}

fn set_in_value(found: &mut Value, path: &[String], value: Value) -> Option<()> {
    let Some((key, rest)) = path.split_first() else {
        let decor = found.decor().clone();
        *found = value;
        *found.decor_mut() = decor;
        return Some(());
    };
    match found {
        Value::InlineTable(table) => {
            if !table.contains_key(key) {
                table.insert(key, Value::InlineTable(InlineTable::new()));
            }
            set_in_value(table.get_mut(key)?, rest, value)
        }
        Value::Array(list) => {
            let name = |item: &Value| item.as_inline_table()?.get("name")?.as_str().map(str::to_owned);
            let names: Vec<Option<String>> = list.iter().map(name).collect();
            let rank = rank_of(names.iter().map(Option::as_deref), key)?;
            set_in_value(list.get_mut(rank)?, rest, value)
        }
        _ => None,
    }
}

/// The rank in a list that a key names, a number or a `name`.
fn rank_of<'n>(mut names: impl Iterator<Item = Option<&'n str>>, key: &str) -> Option<usize> {
    key.parse().ok().or_else(|| names.position(|name| name == Some(key)))
}

/// Puts a value in the place of an item; a table under a head stays one.
fn replace(item: &mut Item, value: Value) {
    match (&mut *item, value) {
        (Item::Table(before), Value::InlineTable(values)) => {
            let mut table = values.into_table();
            table.set_position(before.position());
            *table.decor_mut() = before.decor().clone();
            *item = Item::Table(table);
        }
        (Item::Value(before), mut value) => {
            *value.decor_mut() = before.decor().clone();
            *before = value;
        }
        (_, value) => *item = Item::Value(value),
    }
}

fn changed_json(text: &str, overrides: &[Override]) -> Result<String, Error> {
    let mut document: Json = serde_json::from_str(text).map_err(|e| internal(&format!("its text: {e}")))?;
    for change in overrides {
        if document.get("camera").and_then(Json::as_str) == Some("auto") {
            document["camera"] = serde_json::json!({ "auto": true });
        }
        let value: Value = change.toml().parse().map_err(|e| internal(&format!("the value of a change: {e}")))?;
        set_in_json(&mut document, change.path(), json(&value)).ok_or_else(|| internal(change.flag()))?;
    }
    Ok(format!("{document:#}\n"))
}

fn set_in_json(found: &mut Json, path: &[String], value: Json) -> Option<()> {
    let Some((key, rest)) = path.split_first() else {
        *found = value;
        return Some(());
    };
    match found {
        Json::Object(table) => {
            let entry = table.entry(key.as_str()).or_insert_with(|| Json::Object(serde_json::Map::new()));
            set_in_json(entry, rest, value)
        }
        Json::Array(list) => {
            let rank = rank_of(list.iter().map(|item| item.get("name")?.as_str()), key)?;
            set_in_json(list.get_mut(rank)?, rest, value)
        }
        _ => None,
    }
}

/// A value of TOML as one of JSON; scenes have no dates.
fn json(value: &Value) -> Json {
    match value {
        Value::String(text) => Json::from(text.value().as_str()),
        Value::Integer(number) => Json::from(*number.value()),
        Value::Float(number) => Json::from(*number.value()),
        Value::Boolean(is_so) => Json::from(*is_so.value()),
        Value::Datetime(time) => Json::from(time.value().to_string()),
        Value::Array(list) => list.iter().map(json).collect(),
        Value::InlineTable(table) => {
            Json::Object(table.iter().map(|(key, value)| (key.to_owned(), json(value))).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::Opening;
    use organza::RenderOptions;
    use organza::scene;

    const HEAD: &str = "version = 1 # the first\n";
    const OBJECTS: &str = "# two panes\n[[object]]\nname = \"a\" # glass\n\
        rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\nopacity = 0.5   # half\n\
        [[object]]\nname = \"b\"\nrectangle = { center = [0, 0, 1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\n";
    const CAMERA: &str = "# from the front\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n";

    fn source(file: &str, text: &str) -> Source {
        let Opening { file, text, load, .. } = Opening::of_text(file, text, RenderOptions::default());
        Source { file, text, load }
    }

    fn changes() -> Vec<Override> {
        let set = [
            "camera={ position = [0.1, 0, 4.5], target = [0, 0, 0], up = [0, 1, 0], fov_y = 35, size = [64, 48] }",
            "object.a.opacity=0.25",
            "object.1.visible=false",
            "render.exposure=1.5",
            "render.points={ exact = true }",
            "camera.size=[32, 24]",
        ];
        let mut changes: Vec<Override> = set.iter().map(|text| Override::parse(text).unwrap()).collect();
        changes.push(Override::of_effect("object.a=on").unwrap());
        changes
    }

    /// The scene of a text, without what differs by its bytes.
    fn scene_of(source: &Source, overrides: Vec<Override>) -> scene::Scene {
        scene::Scene { sha256: String::new(), ..source.scene(overrides).unwrap() }
    }

    #[test]
    fn the_text_is_that_of_the_changed_scene_and_has_its_comments() {
        for text in [
            format!("{HEAD}{CAMERA}{OBJECTS}"),
            format!("\u{feff}{HEAD}camera = \"auto\"\n{OBJECTS}"),
            format!(
                "{HEAD}{CAMERA}{OBJECTS}[render]\nexposure = 0.5 # stops\n[render.effects]\n\"object.b\" = \"auto\"\n"
            ),
            format!("{HEAD}render = {{ exposure = 2 }}\n{CAMERA}{OBJECTS}"),
        ] {
            let before = source("a.toml", &text);
            let after = source("a.toml", &changed(&before, &changes()).unwrap());
            assert_eq!(scene_of(&after, Vec::new()), scene_of(&before, changes()), "{text}");
            let written = String::from_utf8(after.text).unwrap();
            for comment in ["# the first", "# two panes", "# glass", "# half"] {
                assert!(written.contains(comment), "{comment}: {written}");
            }
        }
    }

    #[test]
    fn a_scene_in_json_stays_one() {
        let text = r#"{ "version": 1, "camera": "auto", "object": [
            { "name": "a", "rectangle": { "center": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "spacing": 0.1 } },
            { "name": "b", "rectangle": { "center": [0, 0, 1], "u": [1, 0, 0], "v": [0, 1, 0], "spacing": 0.1 } } ] }"#;
        let before = source("a.json", text);
        let after = source("a.json", &changed(&before, &changes()).unwrap());
        assert_eq!(scene_of(&after, Vec::new()), scene_of(&before, changes()));
    }
}
