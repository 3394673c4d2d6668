//! The wall about techniques: outside their table the orchestrator knows none of them by name.

use crate::repo::Repo;
use crate::source::{code_only, line_of};

/// Where the wall stands.
const HOUSE: &str = "crates/organza/src/";
/// What lies behind it: the table, and a folder for each technique.
const TABLE: &str = "crates/organza/src/technique";

/// Techniques as scenes name them.
const NAMES: [&str; 5] = ["Points", "Particles", "Sheets", "Surfels", "Reference"];

/// Finds names of techniques in product code beside the table.
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
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_technique_is_named_in_its_table_and_in_tests_alone() {
        let line = "fn first() -> Technique {\n    Technique::Sheets\n}\n";
        let found = |path: &str, text: &str| named(&Repo::of(&[(path, text)]));
        let told = found("crates/organza/src/frame.rs", line);
        assert!(told.len() == 1 && told[0].starts_with("crates/organza/src/frame.rs:2:"), "{told:?}");
        assert!(found("crates/organza/src/technique.rs", line).is_empty());
        assert!(found("crates/organza/src/technique/sheets.rs", line).is_empty());
        assert!(found("crates/organza/src/frame.rs", &format!("#[cfg(test)]\nmod tests {{\n{line}}}\n")).is_empty());
        assert!(found("crates/organza/src/choose.rs", "fn auto() -> Technique {\n    Technique::Auto\n}\n").is_empty());
    }
}
