//! The text of a scene with changes in it, and with its comments.

use crate::state::Source;
use organza::Error;
use organza::scene::{self, Override, PATH_KEYS, ROOT_KEY};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// The text of a scene with these changes as values: TOML keeps its comments, JSON has its keys in order of the alphabet.
pub(crate) fn changed(source: &Source, overrides: &[Override]) -> Result<String, Error> {
    let text = String::from_utf8_lossy(&source.text);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    if source.is_json() { changed_json(text, overrides) } else { changed_toml(text, overrides) }
}

fn changed_toml(text: &str, overrides: &[Override]) -> Result<String, Error> {
    let mut document: DocumentMut = text.parse().map_err(|e| internal(&format!("its text: {e}")))?;
    for change in overrides {
        expand_auto(&mut document);
        let Some(value) = change.toml() else {
            remove_in_table(document.as_table_mut(), change.path()).ok_or_else(|| internal(change.flag()))?;
            continue;
        };
        let value: Value = value.parse().map_err(|e| internal(&format!("the value of a change: {e}")))?;
        set_in_table(document.as_table_mut(), change.path(), value).ok_or_else(|| internal(change.flag()))?;
    }
    Ok(document.to_string())
}

/// The same text with absolute paths: a browser saves it in a folder of its own. `data` are the files that its scene names.
pub(crate) fn anywhere(source: &Source, text: &str, data: &[PathBuf]) -> Result<String, Error> {
    let root = scene::folder_above(data.iter().map(PathBuf::as_path));
    let root = root.as_deref().and_then(Path::to_str);
    let folder = source.file.parent().unwrap_or(Path::new(""));
    if source.is_json() {
        let mut document: Json = serde_json::from_str(text).map_err(|e| internal(&format!("its text: {e}")))?;
        if let Some(root) = root {
            document[ROOT_KEY] = root.into();
        }
        name_in_json(&mut document, Names::Other, folder);
        return Ok(format!("{document:#}\n"));
    }
    let mut document: DocumentMut = text.parse().map_err(|e| internal(&format!("its text: {e}")))?;
    let table = document.as_table_mut();
    name_in_table(table, folder);
    if let Some(root) = root {
        set_in_table(table, &[ROOT_KEY.to_owned()], root.into()).ok_or_else(|| internal(ROOT_KEY))?;
    }
    Ok(format!("# As `organza view` showed it: its paths are absolute.\n{document}"))
}

/// What a text names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Names {
    File,
    Other,
}

impl Names {
    fn by(key: &str) -> Self {
        // The folder of data is named once for all.
        if PATH_KEYS.contains(&key) { Self::File } else { Self::Other }
    }
}

/// The absolute path of a file or folder that a scene in `folder` names; `None` for data in memory.
fn absolute(folder: &Path, text: &str) -> Option<String> {
    if scene::name_in_memory(text.as_ref()).is_some() {
        return None;
    }
    let path = std::path::absolute(folder.join(text)).ok()?;
    // Of a link the name counts, whose ending is that of the format; the way to it does not.
    let real =
        path.parent().zip(path.file_name()).and_then(|(above, name)| Some(above.canonicalize().ok()?.join(name)));
    real.unwrap_or(path).to_str().map(str::to_owned)
}

fn name_in_table(table: &mut dyn TableLike, folder: &Path) {
    for (key, item) in table.iter_mut() {
        let names = Names::by(key.get());
        match item {
            Item::Table(table) => name_in_table(table, folder),
            Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|table| name_in_table(table, folder)),
            Item::Value(value) => name_in_value(value, names, folder),
            Item::None => {}
        }
    }
}

fn name_in_value(value: &mut Value, names: Names, folder: &Path) {
    match value {
        Value::String(text) if names == Names::File => {
            if let Some(path) = absolute(folder, text.value()) {
                let decor = text.decor().clone();
                *value = path.into();
                *value.decor_mut() = decor;
            }
        }
        Value::InlineTable(table) => name_in_table(table, folder),
        Value::Array(list) => list.iter_mut().for_each(|item| name_in_value(item, Names::Other, folder)),
        _ => {}
    }
}

fn name_in_json(value: &mut Json, names: Names, folder: &Path) {
    match value {
        Json::String(text) if names == Names::File => {
            if let Some(path) = absolute(folder, text) {
                *text = path;
            }
        }
        Json::Object(table) => {
            table.iter_mut().for_each(|(key, value)| name_in_json(value, Names::by(key), folder));
        }
        Json::Array(list) => list.iter_mut().for_each(|item| name_in_json(item, Names::Other, folder)),
        _ => {}
    }
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

/// Takes away what is at the end of a path of keys; nothing where there is nothing.
fn remove_in_table(table: &mut dyn TableLike, path: &[String]) -> Option<()> {
    let (key, rest) = path.split_first()?;
    if rest.is_empty() {
        return table.remove(key).map(drop);
    }
    match table.get_mut(key)? {
        Item::Table(table) => remove_in_table(table, rest),
        Item::ArrayOfTables(tables) => {
            let (key, rest) = rest.split_first()?;
            let names = tables.iter().map(|table| table.get("name").and_then(Item::as_str));
            let rank = rank_of(names, key)?;
            let table = tables.get_mut(rank)?;
            if !rest.is_empty() {
                return remove_in_table(table, rest);
            }
            tables.remove(rank);
            Some(())
        }
        Item::Value(found) => remove_in_value(found, rest),
        Item::None => None,
    }
}

fn remove_in_value(found: &mut Value, path: &[String]) -> Option<()> {
    let (key, rest) = path.split_first()?;
    match found {
        Value::InlineTable(table) if rest.is_empty() => table.remove(key).map(drop),
        Value::InlineTable(table) => remove_in_value(table.get_mut(key)?, rest),
        Value::Array(list) => {
            let name = |item: &Value| item.as_inline_table()?.get("name")?.as_str().map(str::to_owned);
            let names: Vec<Option<String>> = list.iter().map(name).collect();
            let rank = rank_of(names.iter().map(Option::as_deref), key).filter(|rank| *rank < list.len())?;
            if rest.is_empty() {
                list.remove(rank);
                return Some(());
            }
            remove_in_value(list.get_mut(rank)?, rest)
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
        let Some(value) = change.toml() else {
            remove_in_json(&mut document, change.path()).ok_or_else(|| internal(change.flag()))?;
            continue;
        };
        let value: Value = value.parse().map_err(|e| internal(&format!("the value of a change: {e}")))?;
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

fn remove_in_json(found: &mut Json, path: &[String]) -> Option<()> {
    let (key, rest) = path.split_first()?;
    match found {
        Json::Object(table) if rest.is_empty() => table.remove(key).map(drop),
        Json::Object(table) => remove_in_json(table.get_mut(key)?, rest),
        Json::Array(list) => {
            let names = list.iter().map(|item| item.get("name")?.as_str());
            let rank = rank_of(names, key).filter(|rank| *rank < list.len())?;
            if rest.is_empty() {
                list.remove(rank);
                return Some(());
            }
            remove_in_json(list.get_mut(rank)?, rest)
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
            "object.b.rectangle.spacing=0.2",
            "object.0.visible=true",
            "object.0.visible=",
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
    fn paths_lead_from_anywhere_to_the_same_files() {
        let place = tempfile::tempdir().unwrap();
        let place = place.path().canonicalize().unwrap();
        let scenes = place.join("a/scenes");
        let data = place.join("a/data");
        for folder in [&scenes, &data] {
            std::fs::create_dir_all(folder).unwrap();
        }
        let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        std::fs::write(data.join("b.obj"), mesh).unwrap();
        std::fs::write(scenes.join("mesh"), mesh).unwrap();
        let toml = format!(
            "{HEAD}{CAMERA}[[object]]\nname = \"mesh\" # kept\nmesh = \"../data/b.obj\" # a triangle\n\
             [[object]]\nname = \"inner\"\nvisible = false\nvolume = \"none.nrrd\"\n\
             transfer = [{{ value = 0, color = [1, 1, 1], extinction = 1 }}]\n"
        );
        let json = r#"{ "version": 1, "camera": "auto", "object": [{ "name": "mesh", "mesh": "../data/b.obj" }] }"#;
        for (file, text) in [("s.toml", toml.as_str()), ("s.json", json)] {
            let source = source(scenes.join(file).to_str().unwrap(), text);
            let before = source.scene(Vec::new()).unwrap();
            let moved = anywhere(&source, text, &before.files()[1..]).unwrap();
            // Far from there, and without a way to the data but by its name.
            let away = place.join("b/c/d/away").with_extension(file.rsplit('.').next().unwrap());
            std::fs::create_dir_all(away.parent().unwrap()).unwrap();
            let after = scene::parse(&away, moved.as_bytes(), &scene::LoadOptions::default()).unwrap();
            let path = |scene: &scene::Scene| scene.objects[0].source.path().unwrap().canonicalize().unwrap();
            assert_eq!(path(&after), path(&before), "{moved}");
            assert_eq!(after.objects[0].source.path().unwrap(), data.join("b.obj"));
            assert_eq!(after.objects[0].name, "mesh");
            assert!(file == "s.json" || (moved.contains("# a triangle") && moved.contains("# kept")), "{moved}");
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
