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
const WORDS: [(&str, &str); 35] = [
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
    ("use --budget", "use a budget of"),
    ("a smaller --size", "a smaller `size`"),
    ("--turntable: ", ""),
    ("draw it with --frames", "draw its frames by the command"),
    ("leave the option out", "leave it out"),
    ("--preset labels", "`preset=\"labels\"`"),
    ("--preset mri", "`preset=\"mri\"`"),
    ("(--max-memory)", "(`max_memory`)"),
    ("(--merge-duplicates)", "(`merge_duplicates=True` makes them one)"),
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
    exposed(&text)
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
    match path {
        "camera.size" => format!("size: {}", rest.strip_prefix("`size`: ").unwrap_or(rest)),
        path => format!("{path}: {rest}"),
    }
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
