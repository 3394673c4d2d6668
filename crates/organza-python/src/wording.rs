//! Errors, warnings and notes in the words of Python: its users type no options, and have no scene file.

use organza::Error;
use organza::scene::{self, keys_at};
use serde_json::Value;
use std::path::Path;

/// The file that the document of a scene made in Python stands for: it is in JSON, and is never there.
pub(crate) const MADE: &str = "scene.json";

/// How data in memory is named in a scene.
const MARK: &str = "memory:";

/// Words of a command line, and those of Python; longer ones come before those that they contain.
const WORDS: [(&str, &str); 64] = [
    ("move or strengthen a [[light]], or add [ambient]", "move or strengthen a light, or set ambient.color"),
    (
        "add a [[light]], a `color` in [ambient], or a material with `emission` or shading = \"unlit\"",
        "call `scene.light.sun()`, set ambient.color, or take a material with `emission` or shading=\"unlit\"",
    ),
    (" of that [[light]],", " of that [[light]]"),
    (" of that [[light]]", " of that light, or render.shadow.cells of all,"),
    (
        "technique = \"sheets\" with [render.sheets] slicing = \"half_vector\" and scattering = \"forward_and_back\"",
        "render.technique = \"sheets\", render.sheets.slicing = \"half_vector\" and render.sheets.scattering = \"forward_and_back\"",
    ),
    ("set camera = \"auto\"", "call `scene.camera.orbit()`"),
    ("scale = \"log\"", "log_scale = true"),
    (
        "transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, …]",
        "transfer=[{\"value\": 0, \"color\": [1, 1, 1], \"extinction\": 0}, …]",
    ),
    ("use `mesh = ` or `volume = ` for this file", "`scene.add` takes this file as what it is"),
    ("use `mesh = ` or `points = ` for this file", "`scene.add` takes this file as what it is"),
    ("use `points = ` or `volume = ` for this file", "`scene.add` takes this file as what it is"),
    (
        "use `volume = ` or `isosurface = ` for this file, whose values are amounts",
        "`scene.add_volume` and `scene.add_isosurface` show this file, whose values are amounts",
    ),
    ("use `volume = ` or `isosurface = ` for this file", "`scene.add` takes this file as what it is"),
    (
        "`mesh = ` draws the surface of each, `volume = ` takes them for amounts",
        "`scene.add_labels` draws the surface of each, `scene.add_volume` takes them for amounts",
    ),
    (
        "name the volume by `mesh`, which draws the surface of each label",
        "`scene.add_labels` draws the surface of each label",
    ),
    (
        "or give the object a `transfer` with colours of its own",
        "a colormap of matplotlib, or a list of colours, does too",
    ),
    ("name a volume of labels by `mesh`", "`scene.add_labels` takes a volume of labels"),
    (" in the [[object]] draws nothing there", " as a key of the object draws nothing there"),
    ("`[ambient]` stands for it", "ambient.color stands for it"),
    (
        "name it in a scene: [background] environment = \"FILE\"",
        "`scene.set(\"background.environment\", \"FILE\")` shows it",
    ),
    (
        "such as { normal = [0, 1, 0], point = [0, 0.5, 0] } or { box = [[-1, -1, -1], [1, 1, 1]] }",
        "such as {\"normal\": [0, 1, 0], \"point\": [0, 0.5, 0]} or {\"box\": [[-1, -1, -1], [1, 1, 1]]}",
    ),
    (
        "or say `auto = true` for a camera that sees all objects",
        "or call `scene.camera.orbit()`, which sees all objects",
    ),
    ("`array` of a scene or --color-by", "`array` or `color_by`"),
    ("--technique chooses one", "render.technique chooses one"),
    ("write PATH=VALUE, such as --set render.points.exact=true", ""),
    ("leave out `array`, or `--color-by`, which names it on the command line", "leave out `array`, or `color_by`"),
    (
        "`mesh = ` or `--preset labels` draws the surface of each label",
        "`scene.add_labels` draws the surface of each label",
    ),
    ("--color-by U:0 chooses one number", "`color_by=\"U:0\"` chooses one number"),
    ("use --technique particles, or no --checkpoint", "set render.technique to \"particles\""),
    ("name another --checkpoint, or use a smaller image", "use a smaller image"),
    ("name another --checkpoint, or remove this file to begin anew", "remove this file to begin anew"),
    ("--finer N doubles every end N times", "`finer=N` doubles every end N times"),
    ("; `--background COLOUR` takes the place of both", ""),
    ("leave out --sandbox if you trust the scene", "move the file into the folder of the scene"),
    ("use --budget ", "use budget_ms="),
    ("--max-rmse ", "max_rmse="),
    ("--max-flip ", "max_flip="),
    ("a smaller --size", "a smaller `size`"),
    ("--turntable: ", ""),
    ("the scene scene.json", "the scene"),
    ("draw it with --frames", "draw its frames by the command"),
    ("leave the option out", "leave it out"),
    ("--preset labels", "`preset=\"labels\"`"),
    ("--preset mri", "`preset=\"mri\"`"),
    ("(--max-memory)", "(`max_memory`)"),
    ("(--merge-duplicates)", "(`merge_duplicates=True` makes them one)"),
    (
        "only a program that hands its data over can name it so",
        "add the arrays of that name, or pickle the scene, which keeps them",
    ),
    ("discs = \"round\"", "`discs=\"round\"`"),
    ("--max-memory", "`max_memory`"),
    ("--drop-invalid", "`drop_invalid=True`"),
    ("--strict", "`strict=True`"),
    ("--quick", "`quick=True`"),
    ("--force", "`force=True`"),
    ("--transparent", "`transparent`"),
    ("--color-by", "`color_by`"),
    ("--preset", "`preset`"),
    ("--material", "`material`"),
    ("--up y", "`up=\"y\"`"),
    ("`--up z` of init", "`up=\"z\"`"),
    ("--up z", "`up=\"z\"`"),
    ("--backend cpu needs none", "Python needs none"),
    ("`organza info`", "`organza.info`"),
    ("`organza explain`", "`organza.explain`"),
    ("give it to `organza render`", "give it to `organza.render` or `Scene.load`"),
];

/// Keys of objects that have an argument of their own, and its name.
const ARGUMENTS: [(&str, &str); 8] = [
    ("color_by.column", "color_by"),
    ("color_by.map", "colormap"),
    ("color_by.range", "clim"),
    ("color_by.scale", "log_scale"),
    ("isosurface.level", "level"),
    ("slice.center", "center"),
    ("slice.normal", "normal"),
    ("point_size", "radius"),
];

/// A sentence in the words of Python.
pub(crate) fn sentence(text: &str) -> String {
    let text = without_mark(&without_option(text));
    let text = WORDS.iter().fold(text, |text, (before, after)| text.replace(before, after));
    assigned(&exposed(&text))
}

/// A sentence whose assignments in TOML are those of Python: `visible = false` becomes `visible=False`, and `render.seed = 3` becomes
/// `scene.set("render.seed", 3)`.
fn assigned(text: &str) -> String {
    const SIGN: &str = " = ";
    let mut made = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(SIGN) {
        let is_of_key = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let key = &before[before.trim_end_matches(is_of_key).len()..];
        let value = if key.starts_with(|c: char| c.is_ascii_lowercase()) { value_at(after) } else { None };
        let Some((value, length)) = value else {
            made = made + before + SIGN;
            rest = after;
            continue;
        };
        let sentence = &before[..before.len() - key.len()];
        if key.contains('.') {
            let verbs = ["set ", "use "].into_iter().find_map(|verb| sentence.strip_suffix(verb));
            made += &verbs.map_or(sentence.to_owned(), |start| format!("{start}call "));
            made += &format!("scene.set(\"{key}\", {})", literal(&value));
        } else {
            made += &format!("{sentence}{key}={}", literal(&value));
        }
        rest = &after[length..];
    }
    made + rest
}

/// The value in TOML that a text begins with, and its length in bytes.
fn value_at(text: &str) -> Option<(Value, usize)> {
    let mut depth = 0_usize;
    let mut is_quoted = false;
    let ends = |(_, c): &(usize, char)| {
        match c {
            '"' => is_quoted = !is_quoted,
            '[' | '{' if !is_quoted => depth += 1,
            ']' | '}' if !is_quoted => depth = depth.saturating_sub(1),
            _ => {}
        }
        let is_of_word = c.is_ascii_alphanumeric() || ['.', '+', '-', '_'].contains(c);
        depth == 0 && !is_quoted && !is_of_word
    };
    let (at, end) = text.char_indices().find(ends).unwrap_or((text.len(), ' '));
    // A closing quote or bracket belongs to the value; a full stop ends the sentence.
    let length = if ['"', ']', '}'].contains(&end) { at + 1 } else { text[..at].trim_end_matches('.').len() };
    let table: Value = toml::from_str(&format!("value = {}", &text[..length])).ok()?;
    Some((table.get("value")?.clone(), length))
}

/// A value as Python writes it.
fn literal(value: &Value) -> String {
    let list = |items: Vec<String>| items.join(", ");
    match value {
        Value::Bool(true) => "True".to_owned(),
        Value::Bool(false) => "False".to_owned(),
        Value::Array(items) => format!("[{}]", list(items.iter().map(literal).collect())),
        Value::Object(entries) => {
            format!(
                "{{{}}}",
                list(entries.iter().map(|(key, value)| format!("\"{key}\": {}", literal(value))).collect())
            )
        }
        other => other.to_string(),
    }
}

/// A document whose sentences are in the words of Python.
pub(crate) fn document(mut document: Value) -> Value {
    reword(&mut document);
    document
}

fn reword(value: &mut Value) {
    match value {
        Value::String(text) => *text = sentence(text),
        Value::Array(items) => items.iter_mut().for_each(reword),
        Value::Object(entries) => entries.values_mut().for_each(reword),
        _ => {}
    }
}

/// An error about a place in the document of a scene that was made in Python, with the object and the argument in its stead.
pub(crate) fn placed(error: Error, text: &str) -> Error {
    let made = Path::new(MADE);
    match error {
        Error::Scene(scene::Error::Scene { file, line, column, message, hint }) if file == made => {
            let keys = keys_at(made, text, line, column).unwrap_or_default();
            let key = keys.last().map_or("", String::as_str);
            // The argument is named before the sentence.
            let message = message.strip_prefix(&format!("`{key}`: ")).map_or(message.clone(), str::to_owned);
            let what = place(&keys);
            Error::Input { what: if what.is_empty() { "the scene".to_owned() } else { what }, message, hint }
        }
        Error::Input { what, message, hint } if what == MADE => {
            Error::Input { what: "the scene".to_owned(), message, hint }
        }
        other => other,
    }
}

/// An error about the text of a first scene, which is written from arguments and is no file: the argument stands for its place.
pub(crate) fn of_first_scene(error: Error, first: &Path) -> Error {
    match error {
        Error::Scene(scene::Error::Scene { file, message, hint, .. }) if file == first => {
            let argument = message.strip_prefix('`').and_then(|rest| rest.split_once("`: "));
            let argument = argument.map(|(key, rest)| (key.to_owned(), rest.to_owned()));
            let (what, message) = argument.unwrap_or_else(|| ("the first scene".to_owned(), message));
            Error::Input { what, message, hint }
        }
        other => other,
    }
}

/// The words of Python for the keys that lead to a value.
fn place(keys: &[String]) -> String {
    let [list, name, rest @ ..] = keys else { return keys.join(".") };
    let path = rest.join(".");
    let is_below = |key: &str| path == key || path.strip_prefix(key).is_some_and(|rest| rest.starts_with('.'));
    let argument = ARGUMENTS.iter().find(|(key, _)| list == "object" && is_below(key));
    let path = argument.map_or(path.as_str(), |(_, argument)| argument);
    match (list.as_str(), path) {
        ("object" | "light" | "material", "") => format!("{list} '{name}'"),
        ("object" | "light" | "material", path) => format!("{list} '{name}', {path}"),
        _ => keys.join("."),
    }
}

/// A message about an option, about the argument or the key that stands for it.
fn without_option(text: &str) -> String {
    if let Some((name, rest)) = text.strip_prefix("--effect ").and_then(|text| text.split_once(": ")) {
        let name = name.rsplit_once('=').map_or(name, |(name, _)| name);
        return format!("effects, '{name}': {rest}");
    }
    let Some((path, rest)) = text.strip_prefix("--set ").and_then(|text| text.split_once('=')) else {
        return text.to_owned();
    };
    let Some((_, rest)) = rest.split_once(": ") else { return text.to_owned() };
    // The name stands before the sentence already.
    let key = path.rsplit_once('.').map_or(path, |(_, key)| key);
    let rest = rest.strip_prefix(&format!("`{key}`: ")).unwrap_or(rest);
    let argument = if path == "camera.size" { "size" } else { path };
    format!("{argument}: {rest}")
}

/// A sentence that names data in memory by its object alone.
fn without_mark(text: &str) -> String {
    let mut made = String::with_capacity(text.len());
    for (i, part) in text.split(MARK).enumerate() {
        // "memory: " is a word, and a file may be called "./memory:a".
        let is_name = !part.is_empty() && !part.starts_with(char::is_whitespace) && !made.ends_with(['/', '.']);
        if i > 0 && !is_name {
            made += MARK;
        }
        made += part;
    }
    made
}

/// A sentence that names an exposure, by the key that sets it.
fn exposed(text: &str) -> String {
    let Some((before, stops)) = text.split_once("try --exposure ") else { return text.to_owned() };
    format!("{before}try scene.set(\"render.exposure\", {stops})")
}
