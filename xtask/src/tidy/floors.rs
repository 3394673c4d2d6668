//! The floors of the orchestrator: no module of `organza` names one of its own floor or of a higher one.

use crate::repo::Repo;
use crate::source::{code_only, line_of};

/// Where the modules lie.
const HOUSE: &str = "crates/organza/src/";

/// The modules of each floor, from the ground up.
const FLOORS: [&[&str]; 16] = [
    &["error", "form", "pass", "stage"],
    &["statistics"],
    &["cost"],
    &["options"],
    &["load"],
    &["brightness"],
    &["memory", "shadows"],
    &["plan"],
    &["frame"],
    &["technique"],
    &["choose"],
    &["warnings", "ranges"],
    &["predict"],
    &["draw", "prepare"],
    &["render"],
    &["lib"],
];

/// Finds modules that have no floor, and names of modules that do not lie below.
pub(crate) fn upward(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    let lib = repo.rust().find(|(path, _)| *path == format!("{HOUSE}lib.rs")).map(|(_, text)| code_only(text));
    let exports = lib.as_deref().map(exports).unwrap_or_default();
    for (path, text) in repo.rust().filter(|(path, _)| path.starts_with(HOUSE)) {
        let module = module_of(path);
        let Some(floor) = floor(module) else {
            found.push(format!("{path}: module {module} has no floor in the list of xtask/src/tidy/floors.rs"));
            continue;
        };
        let code = code_only(text);
        let product = &code[..code.find("#[cfg(test)]\nmod ").unwrap_or(code.len())];
        for (at, _) in product.match_indices("crate::") {
            let after = &product[at + "crate::".len()..];
            // A module and something that the root exports may have one name: then it is the module.
            let export = |name: &str| exports.iter().find(|(export, _)| *export == name && self::floor(name).is_none());
            let home = |name| export(name).map_or(name, |(_, module)| *module);
            let names = names(after).into_iter().map(home).filter(|name| *name != module);
            for name in names.filter(|name| self::floor(name).is_some_and(|other| other >= floor)) {
                found
                    .push(format!("{path}:{}: {module} names {name}, which does not lie below it", line_of(&code, at)));
            }
        }
    }
    found
}

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|modules| modules.contains(&module))
}

/// What the crate exports at its root, each with the module that it is from.
fn exports(lib: &str) -> Vec<(&str, &str)> {
    let mut exports = Vec::new();
    for (at, _) in lib.match_indices("pub use ") {
        let (module, rest) = lib[at + "pub use ".len()..].split_once("::").unwrap_or_default();
        exports.extend(names(rest).into_iter().map(|name| (name, module)));
    }
    exports
}

/// The module of the house that a file belongs to.
fn module_of(path: &str) -> &str {
    let inside = path.strip_prefix(HOUSE).unwrap_or(path);
    inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs")
}

/// The first names behind `crate::`, of one path or of a group.
fn names(after: &str) -> Vec<&str> {
    let name = |text: &'_ str| text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let Some(group) = after.strip_prefix('{') else { return vec![&after[..name(after)]] };
    let mut depth = 0;
    let mut names = Vec::new();
    let mut begins = true;
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => begins = true,
            c if begins && !c.is_whitespace() => {
                names.push(&group[at..at + name(&group[at..])]);
                begins = false;
            }
            _ => {}
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_from_above_is_found_in_paths_and_groups() {
        let found = |path: &str, text: &str| upward(&Repo::in_memory(&[(path, text)]));
        let load = "crates/organza/src/load/own.rs";
        assert!(found(load, "use crate::form::Form;\nuse crate::{Error, pass};\n").is_empty());
        assert!(found(load, "use crate::load::files::Files;\n").is_empty());
        for up in ["use crate::frame::Frame;\n", "use crate::{\n    Error,\n    plan::{Plan, PlannedPass},\n};\n"] {
            let said = found(load, up);
            assert!(said.len() == 1 && said[0].contains("load names"), "{said:?}");
        }
        // Within a floor nothing is named either.
        assert_eq!(found("crates/organza/src/draw.rs", "fn f() { crate::prepare::load(); }\n").len(), 1);
    }

    #[test]
    fn what_the_root_exports_belongs_to_its_module() {
        let lib = ("crates/organza/src/lib.rs", "pub use error::Error;\npub use render::{Render, render};\n");
        let found = |text: &str| upward(&Repo::in_memory(&[lib, ("crates/organza/src/plan.rs", text)]));
        assert!(found("use crate::Error;\n").is_empty());
        assert_eq!(found("use crate::{Error, Render};\n").len(), 1);
    }

    #[test]
    fn a_module_without_a_floor_is_found() {
        let said = upward(&Repo::in_memory(&[("crates/organza/src/attic/box.rs", "")]));
        assert!(said.len() == 1 && said[0].contains("attic has no floor"), "{said:?}");
    }
}
