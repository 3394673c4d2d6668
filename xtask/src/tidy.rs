//! The rules that the compiler does not know. Each is a function from the tree to its findings, and has a test that
//! shows it can fail.

mod assets;
mod dependencies;
mod floors;
mod functions;
mod locks;
mod techniques;
mod text;

use crate::repo::{Outcome, Repo};
pub(crate) use assets::{MAX_BYTES, credit_of, in_assets};

type Rule = fn(&Repo) -> Vec<String>;

const RULES: [(&str, Rule); 11] = [
    ("heads", text::heads),
    ("foreign paths", text::foreign_paths),
    ("ignored tests", text::ignored_tests),
    ("reasons", text::reasons),
    ("crate pages", text::crate_pages),
    ("dependency direction", dependencies::direction),
    ("floors", floors::upward),
    ("techniques", techniques::named),
    ("functions of the platform", functions::platform),
    ("assets", assets::assets),
    ("locks", locks::locks),
];

/// Applies every rule.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let findings = findings(repo);
    if findings.is_empty() {
        return Ok(format!("tidy: {} rules hold in {} files", RULES.len(), repo.files.len()));
    }
    Err(format!("tidy found {}\n{}", findings.len(), findings.join("\n")))
}

fn findings(repo: &Repo) -> Vec<String> {
    let of_rule = |(name, rule): &(&str, Rule)| rule(repo).into_iter().map(|f| format!("  {name}: {f}")).collect();
    RULES.iter().flat_map(|rule| -> Vec<String> { of_rule(rule) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_repository_is_tidy() {
        let repo = Repo::open().expect("the repository is readable");
        assert!(repo.files.len() > 20, "only {} files found", repo.files.len());
        let found = findings(&repo);
        assert!(found.is_empty(), "\n{}", found.join("\n"));
    }

    #[test]
    fn a_finding_fails_the_task() {
        let said = run(&Repo::in_memory(&[("src/a.rs", "fn a() {}\n")])).expect_err("no head");
        assert!(said.starts_with("tidy found 1\n  heads: src/a.rs"), "{said}");
    }
}
