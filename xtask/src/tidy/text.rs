//! What files must say, and must not.

use crate::repo::Repo;
use crate::source::{attributes, calls, code_only, line_of};
use crate::toml_lines::lines;

/// Folders that only one machine has. In pieces, so that this file passes its own rule.
const FOREIGN: [&str; 2] = [concat!("../sh", "ared"), concat!("/wo", "rk/")];

/// The one registry that a stranger has.
const REGISTRY: &str = "\"registry+https://github.com/rust-lang/crates.io-index\"";

/// Every Rust file begins with what it is about.
pub(crate) fn heads(repo: &Repo) -> Vec<String> {
    let bare = repo.rust().filter(|(_, text)| !text.starts_with("//!"));
    bare.map(|(path, _)| format!("{path}: expected //! on the first line")).collect()
}

/// No text names a folder of one machine, and no package comes from a private registry.
pub(crate) fn foreign_paths(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in repo.texts() {
        for (at, line) in text.lines().enumerate() {
            let foreign = FOREIGN.iter().copied().find(|f| line.contains(f));
            let source = line.strip_prefix("source = ").filter(|s| path.ends_with("Cargo.lock") && *s != REGISTRY);
            let replaced = (path.starts_with(".cargo/") && line.starts_with("[source")).then_some(line);
            if let Some(what) = foreign.or(source).or(replaced) {
                found.push(format!("{path}:{}: found {what}", at + 1));
            }
        }
    }
    found
}

/// A test that does not run proves nothing.
pub(crate) fn ignored_tests(repo: &Repo) -> Vec<String> {
    let says_ignore = |attribute: &str| attribute.starts_with("#[ignore");
    attributes_where(repo, says_ignore, "found #[ignore]; let the test run, or remove it")
}

/// Whoever silences a lint says why.
pub(crate) fn reasons(repo: &Repo) -> Vec<String> {
    let silent = |attribute: &str| {
        ["allow", "expect"].iter().any(|name| calls(attribute, name).any(|inside| !inside.contains("reason")))
    };
    attributes_where(repo, silent, "found a silenced lint without a reason")
}

fn attributes_where(repo: &Repo, bad: impl Fn(&str) -> bool, complaint: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in repo.rust() {
        let code = code_only(text);
        let hits = attributes(&code).into_iter().filter(|range| bad(&code[range.clone()]));
        found.extend(hits.map(|range| format!("{path}:{}: {complaint}", line_of(&code, range.start))));
    }
    found
}

/// Each crate has a page that says what it is, and what each of its features is for. Examples on it are compiled as doctests.
pub(crate) fn crate_pages(repo: &Repo) -> Vec<String> {
    repo.crate_folders().into_iter().flat_map(|folder| crate_page(repo, folder)).collect()
}

fn crate_page(repo: &Repo, folder: &str) -> Vec<String> {
    let page = format!("{folder}/README.md");
    let Some(text) = repo.text(&page).filter(|text| !text.trim().is_empty()) else {
        return vec![format!("{page} is missing")];
    };
    let manifest = lines(repo.text(&format!("{folder}/Cargo.toml")).unwrap_or_default());
    let features =
        manifest.iter().filter(|line| line.table == "features" && line.key != "default").map(|line| line.key);
    let unnamed = features.filter(|feature| !text.contains(&format!("`{feature}`")));
    let unnamed = unnamed.map(|feature| format!("{page} does not say what the feature `{feature}` is for"));
    unnamed.chain(uncompiled_example(repo, folder, text)).collect()
}

/// The marker of an example, up to its attributes.
const EXAMPLE: &str = "```rust";

/// Why no test compiles an example of a crate's page.
fn uncompiled_example(repo: &Repo, folder: &str, page: &str) -> Option<String> {
    let example = page.lines().find(|line| line.starts_with(EXAMPLE))?;
    if page.lines().any(|line| line.starts_with(EXAMPLE) && line.contains("ignore")) {
        return Some(format!("{folder}/README.md has an example that is ignored: expected {EXAMPLE}"));
    }
    let library = repo.text(&format!("{folder}/src/lib.rs")).unwrap_or_default();
    let is_included = library.contains("#[cfg(doctest)]\n#[doc = include_str!(\"../README.md\")]");
    (!is_included).then(|| {
        format!("{folder}/README.md has {example}, and {folder}/src/lib.rs does not include the page as a doctest")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_a_head_is_found() {
        let repo = Repo::in_memory(&[("a.rs", "//! A.\n"), ("b.rs", "// B.\n"), ("c.md", "C\n")]);
        assert_eq!(heads(&repo), ["b.rs: expected //! on the first line"]);
    }

    #[test]
    fn a_foreign_path_is_found() {
        for foreign in FOREIGN {
            let repo = Repo::in_memory(&[("notes.md", &format!("one\nsee {foreign}x\n"))]);
            assert_eq!(foreign_paths(&repo), [format!("notes.md:2: found {foreign}")]);
        }
        assert!(foreign_paths(&Repo::in_memory(&[("notes.md", "shared/x work/y ./home\n")])).is_empty());
    }

    #[test]
    fn a_private_registry_is_found() {
        let lock = format!("source = {REGISTRY}\nsource = \"registry+https://mirror.example\"\n");
        let repo = Repo::in_memory(&[("Cargo.lock", &lock), (".cargo/config.toml", "[source.crates-io]\n")]);
        let found = foreign_paths(&repo);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("Cargo.lock:2") && found[1].starts_with(".cargo/config.toml:1"), "{found:?}");
    }

    #[test]
    fn an_ignored_test_is_found() {
        let text = "//! T.\n// #[ignore]\nconst A: &str = \"#[ignore]\";\n#[test]\n#[ignore = \"slow\"]\nfn t() {}\n";
        let found = ignored_tests(&Repo::in_memory(&[("a.rs", text)]));
        assert_eq!(found, ["a.rs:5: found #[ignore]; let the test run, or remove it"]);
    }

    #[test]
    fn a_silenced_lint_without_a_reason_is_found() {
        let text = "#[allow(dead_code)]\n#[allow(dead_code, reason = \"r\")]\n#[cfg_attr(x, expect(unused))]\n";
        let found = reasons(&Repo::in_memory(&[("a.rs", text)]));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("a.rs:1:") && found[1].starts_with("a.rs:3:"), "{found:?}");
    }

    #[test]
    fn a_crate_without_a_page_is_found() {
        let repo = Repo::in_memory(&[
            ("crates/a/Cargo.toml", ""),
            ("crates/b/Cargo.toml", ""),
            ("crates/a/README.md", "# a\n"),
        ]);
        assert_eq!(crate_pages(&repo), ["crates/b/README.md is missing"]);
    }

    #[test]
    fn an_example_that_no_test_compiles_is_found() {
        let found = |page: &str, library: &str| {
            let files = [("crates/a/Cargo.toml", ""), ("crates/a/README.md", page), ("crates/a/src/lib.rs", library)];
            crate_pages(&Repo::in_memory(&files))
        };
        let page = "# a\n```rust\nlet a = 1;\n```\n```toml\n[dependencies]\n```\n";
        let library = "//! A.\n/// The page.\n#[cfg(doctest)]\n#[doc = include_str!(\"../README.md\")]\nstruct Page;\n";
        assert!(found(page, library).is_empty());
        assert!(found("# a\n```sh\nls\n```\n", "//! A.\n").is_empty());
        let without = "crates/a/README.md has ```rust, and crates/a/src/lib.rs does not include the page as a doctest";
        assert_eq!(found(page, "//! A.\n"), [without]);
        let ignored = "crates/a/README.md has an example that is ignored: expected ```rust";
        assert_eq!(found(&page.replace("```rust", "```rust,ignore"), library), [ignored]);
    }

    #[test]
    fn a_feature_that_no_page_names_is_found() {
        let manifest = "[features]\ndefault = [\"las\"]\nlas = []\nply = []\n";
        let page = "# a\n`las` reads LAS, as ply does.\n";
        let repo = Repo::in_memory(&[("crates/a/Cargo.toml", manifest), ("crates/a/README.md", page)]);
        assert_eq!(crate_pages(&repo), ["crates/a/README.md does not say what the feature `ply` is for"]);
    }
}
