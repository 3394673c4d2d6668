//! Whether every hard case of `docs/hard-cases.md` has a test that bears its id.

use crate::repo::Repo;
use crate::source::{code_only, functions};
use std::collections::BTreeSet;

const PAGE: &str = "docs/hard-cases.md";

/// One line per case without a test.
pub(crate) fn untested(repo: &Repo) -> Vec<String> {
    let mut bearers = BTreeSet::new();
    for (_, text) in repo.rust() {
        let code = code_only(text);
        let names = functions(&code);
        bearers.extend(names.iter().flat_map(|f| f.name.split('_').filter_map(plain)));
    }
    let page = repo.text(PAGE).unwrap_or_default();
    let cases =
        page.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" |")).filter_map(|(id, _)| plain(id));
    let untested = cases.filter(|id| !bearers.contains(id));
    untested.map(|(letters, number)| format!("{PAGE}: {letters}{number} has no test of that name")).collect()
}

/// An id in capitals and its number: of `CV5` and of the part `cv05` of a name alike; none of another word.
fn plain(word: &str) -> Option<(String, String)> {
    let at = word.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = word.split_at(at);
    let is_id = (1..=2).contains(&letters.len()) && number.trim_end_matches('a').chars().all(|c| c.is_ascii_digit());
    is_id.then(|| (letters.to_uppercase(), number.trim_start_matches('0').to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_without_a_test_is_found() {
        let page = "| id | danger | |\n|---|---|---|\n| CV5 | a | |\n| HV9a | b | |\n| X1 | c | |\n| X2 | d | |\n";
        let source = "fn cv05_holds() {}\nfn hv09a_holds() {}\nfn bi24_x1_holds() {}\n// fn x2_gone() {}\n";
        let repo = Repo::in_memory(&[(PAGE, page), ("src/a.rs", source)]);
        assert_eq!(untested(&repo), ["docs/hard-cases.md: X2 has no test of that name"]);
    }
}
