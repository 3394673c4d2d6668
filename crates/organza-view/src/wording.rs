//! Errors in the words of the page, because its users type no command line.

use crate::picture::Facts;
use crate::state::GivenFile;
use organza::scene::Scene;
use organza::{Error, printable};

/// What is found wrong, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Said {
    pub(crate) message: String,
    /// May be empty.
    pub(crate) hint: String,
}

/// Words of a command line or a scene file, and those of the page.
const WORDS: [(&str, &str); 13] = [
    ("`organza explain` lists the effects of a scene by name", "the panel Effects lists them"),
    ("use a smaller camera.size or render.antialias", "choose a smaller size"),
    (
        "use fewer lights or samples of lights, a larger spacing, a smaller image, or a larger --max-memory",
        "choose a smaller size or hide objects, or start the view again with a larger --max-memory",
    ),
    ("raise the memory limit (--max-memory)", "start the view again with a larger --max-memory"),
    ("a smaller image", "a smaller size"),
    ("or a larger --max-memory", "or start the view again with a larger --max-memory"),
    ("a larger --max-memory makes", "starting the view again with a larger --max-memory makes"),
    ("write PATH=VALUE, such as --set render.points.exact=true", ""),
    ("`size`: expected", "expected"),
    ("`exposure`: expected", "expected"),
    ("`opacity`: expected", "expected"),
    ("`intensity`: expected", "expected"),
    ("`irradiance`: expected", "expected"),
];

/// An error in the words of the page.
pub(crate) fn said(error: &Error) -> Said {
    Said { message: sentence(&error.to_string()), hint: sentence(error.hint()) }
}

/// A sentence in the words of the page.
pub(crate) fn sentence(text: &str) -> String {
    let text = without_option(text);
    WORDS.iter().fold(text, |text, (before, after)| text.replace(before, after))
}

/// A message about an option, about what the page calls it.
fn without_option(text: &str) -> String {
    let named = |name: String, rest: &str| format!("{name}: {rest}");
    if let Some((name, rest)) = text.strip_prefix("--effect ").and_then(|text| text.split_once(": ")) {
        let name = name.rsplit_once('=').map_or(name, |(name, _)| name);
        return named(format!("effect {name}"), rest);
    }
    let Some((path, rest)) = text.strip_prefix("--set ").and_then(|text| text.split_once('=')) else {
        return text.to_owned();
    };
    let Some((value, rest)) = rest.split_once(": ") else { return text.to_owned() };
    match path.split('.').collect::<Vec<_>>()[..] {
        ["camera", "size"] => named(format!("size {}", value.trim_matches(['[', ']']).replace(", ", " × ")), rest),
        ["camera"] => named("this view".to_owned(), rest),
        ["render", "exposure"] => named("exposure".to_owned(), rest),
        ["render", "layers"] => named("layer".to_owned(), rest),
        ["object", name, "transfer"] => named(format!("curve of {name}"), rest),
        [list @ ("object" | "light"), name, key] => named(format!("{key} of {list} {name}"), rest),
        _ => named(path.to_owned(), rest),
    }
}

/// The names of data files in a scene that is made of them, and those that the person gave them.
#[derive(Debug, Default)]
pub(crate) struct GivenNames(Vec<GivenName>);

#[derive(Debug)]
struct GivenName {
    in_scene: String,
    given: String,
}

impl GivenNames {
    /// Of the files that a scene reads those that were given by another name.
    pub(crate) fn new(scene: &Scene, inputs: &[GivenFile]) -> Self {
        let files = scene.files();
        let name = |given: &GivenFile| {
            let real = given.path.canonicalize().ok()?;
            let in_scene = files.iter().find(|file| file.canonicalize().is_ok_and(|file| file == real))?;
            Some(GivenName { in_scene: printable(in_scene), given: given.name.clone() })
        };
        let mut names: Vec<_> = inputs.iter().filter_map(name).filter(|name| name.in_scene != name.given).collect();
        // A long name may end with a short one.
        names.sort_by_key(|name| std::cmp::Reverse(name.in_scene.len()));
        Self(names)
    }

    /// A text that calls files as the person does.
    pub(crate) fn in_text(&self, text: &str) -> String {
        self.0.iter().fold(text.to_owned(), |text, name| text.replace(&name.in_scene, &name.given))
    }

    /// The facts about a picture, which call files as the person does.
    pub(crate) fn in_facts(&self, facts: &Facts) -> Facts {
        let texts = |texts: &[String]| texts.iter().map(|text| self.in_text(text)).collect();
        Facts { warnings: texts(&facts.warnings), notes: texts(&facts.notes), ..facts.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_called_as_the_page_calls_them() {
        for (before, after) in [
            (
                "--set camera.size=[0, 4]: `size`: expected 1 to 65536 pixels, found 0",
                "size 0 × 4: expected 1 to 65536 pixels, found 0",
            ),
            ("--set object.fog.opacity=0.5: a medium has none", "opacity of object fog: a medium has none"),
            ("--set light.0.shadow=true: no", "shadow of light 0: no"),
            ("--set render.exposure=1e9: `exposure`: expected less", "exposure: expected less"),
            ("--effect shadow.moon=off: no light", "effect shadow.moon: no light"),
            ("--set camera={ position = [0, 0, 0] }: the eye is in the target", "this view: the eye is in the target"),
            ("a.ply: no points", "a.ply: no points"),
            ("--set", "--set"),
        ] {
            assert_eq!(sentence(before), after);
        }
    }

    #[test]
    fn hints_say_what_a_page_can_do() {
        let hint = "use fewer lights or samples of lights, a larger spacing, a smaller image, or a larger --max-memory";
        assert_eq!(
            sentence(hint),
            "choose a smaller size or hide objects, or start the view again with a larger --max-memory"
        );
    }
}
