//! The wall about techniques: outside their table the orchestrator knows none of them by name.

use crate::repo::Repo;
use crate::source::{code_only, line_of};

/// Where the wall stands.
const HOUSE: &str = "crates/organza/src/";
/// What lies behind it: the table, and a folder for each technique.
const TABLE: &str = "crates/organza/src/technique";

/// Techniques as scenes name them.
const NAMES: [&str; 5] = ["Points", "Particles", "Sheets", "Surfels", "Reference"];

/// Crates that are each one technique's engine.
const ENGINES: [&str; 2] = ["deferred_blend", "sheet_light"];
/// What frames keep for each other has the type of the engine that made it: the one noun that passes the wall.
const KEPT: &str = "use deferred_blend::grouping::GroupsOfObjects;";

/// Finds names of techniques, and of their engines, in product code beside the table.
pub(crate) fn named(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in repo.rust().filter(|(path, _)| path.starts_with(HOUSE) && !path.starts_with(TABLE)) {
        let code = code_only(text);
        let product = &code[..code.find("#[cfg(test)]\nmod ").unwrap_or(code.len())];
        for name in NAMES {
            for (at, _) in product.match_indices(&format!("Technique::{name}")) {
                let line = line_of(&code, at);
                found.push(format!("{path}:{line}: a name of a technique: ask its row in technique.rs"));
            }
        }
        for engine in ENGINES {
            for (at, _) in product.match_indices(&format!("{engine}::")) {
                let line = line_of(&code, at);
                if text.lines().nth(line - 1) != Some(KEPT) {
                    found.push(format!("{path}:{line}: the engine of a technique: its folder of technique/ calls it"));
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_technique_is_named_in_its_table_and_in_tests_alone() {
        let line = "fn first() -> Technique {\n    Technique::Sheets\n}\n";
        let found = |path: &str, text: &str| named(&Repo::in_memory(&[(path, text)]));
        let told = found("crates/organza/src/frame.rs", line);
        assert!(told.len() == 1 && told[0].starts_with("crates/organza/src/frame.rs:2:"), "{told:?}");
        assert!(found("crates/organza/src/technique.rs", line).is_empty());
        assert!(found("crates/organza/src/technique/sheets.rs", line).is_empty());
        assert!(found("crates/organza/src/frame.rs", &format!("#[cfg(test)]\nmod tests {{\n{line}}}\n")).is_empty());
        assert!(found("crates/organza/src/choose.rs", "fn auto() -> Technique {\n    Technique::Auto\n}\n").is_empty());
    }

    #[test]
    fn an_engine_is_called_in_a_technique_alone() {
        let found = |path: &str, text: &str| named(&Repo::in_memory(&[(path, text)]));
        let told = found("crates/organza/src/frame.rs", "fn f() {}\nuse sheet_light::Volume;\n");
        assert!(told.len() == 1 && told[0].starts_with("crates/organza/src/frame.rs:2:"), "{told:?}");
        assert!(found("crates/organza/src/technique/sheets.rs", "use sheet_light::Volume;\n").is_empty());
        assert!(found("crates/organza/src/frame.rs", &format!("{KEPT}\n")).is_empty());
    }
}
