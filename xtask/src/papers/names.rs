//! Whether what the rows name exists: files, items in them, tests; and whether a verdict has one of these or a benchmark, and what is
//! not built has none.

use super::ledger::{Ledger, Row, Verdict};
use crate::repo::Repo;
use crate::source::{code_only, functions, words};
use std::collections::HashSet;

/// Where programs lie that write what rows say.
const RAN: [&str; 2] = ["benches/benches/", "benches/examples/"];

/// One line per name that does not exist, and per verdict that nothing stands for.
pub(crate) fn missing(repo: &Repo, ledgers: &[Ledger]) -> Vec<String> {
    let mut known = HashSet::new();
    for (_, text) in repo.rust() {
        known.extend(functions(&code_only(text)).iter().map(|f| f.name.to_owned()));
    }
    let rows = ledgers.iter().flat_map(|l| &l.rows);
    rows.flat_map(|row| [code(repo, row), tests(&known, row)].concat()).collect()
}

fn code(repo: &Repo, row: &Row) -> Vec<String> {
    let mut wrong = Vec::new();
    for place in &row.code {
        let (path, item) = place.split_once("::").unwrap_or((place, ""));
        // `Type::method`: each part must stand in the file.
        let mut parts = item.split("::").filter(|part| !part.is_empty());
        match repo.text(path) {
            None => wrong.push(format!("{}: no file {path}", row.id)),
            Some(text) if !parts.all(|part| words(text, part).next().is_some()) => {
                wrong.push(format!("{}: {path} has no {item}", row.id));
            }
            Some(_) => {}
        }
    }
    wrong
}

fn tests(known: &HashSet<String>, row: &Row) -> Vec<String> {
    // `ts06_*` stands for every test of one hard case.
    let exists = |test: &str| match test.strip_suffix('*') {
        Some(beginning) => known.iter().any(|name| name.starts_with(beginning)),
        None => known.contains(test),
    };
    let unknown = row.tests.iter().filter(|test| !exists(test));
    let unknown = unknown.map(|test| format!("{}: no source has the test {test}", row.id));
    let is_decided = matches!(row.verdict, Verdict::Holds | Verdict::Differs);
    let is_shown =
        !row.tests.is_empty() || row.code.iter().any(|place| RAN.iter().any(|folder| place.starts_with(folder)));
    let bare = (is_decided && !is_shown).then(|| format!("{}: no test and no benchmark shows what is said", row.id));
    let is_named = !row.tests.is_empty() || !row.code.is_empty();
    let built = (row.verdict == Verdict::NotBuilt && is_named)
        .then(|| format!("{}: not built, but names code or a test of it", row.id));
    unknown.chain(bare).chain(built).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(code: &str, test: &str) -> Vec<String> {
        found_of(code, test, Verdict::Holds)
    }

    fn found_of(code: &str, test: &str, verdict: Verdict) -> Vec<String> {
        let list = |name: &str| if name.is_empty() { Vec::new() } else { vec![name.to_owned()] };
        let row = Row {
            id: "Eq. 9".to_owned(),
            claim: "c".to_owned(),
            code: list(code),
            tests: list(test),
            ours: "—".to_owned(),
            verdict,
            reason: "r".to_owned(),
        };
        let none = String::new;
        let ledger = Ledger { title: none(), authors: none(), year: none(), note: none(), rows: vec![row] };
        let source = "struct Map;\nimpl Map {\n    fn build() {}\n}\n// fn gone() {}\nfn ts01_holds() {}\n";
        missing(&Repo::in_memory(&[("src/map.rs", source)]), &[ledger])
    }

    #[test]
    fn names_that_exist_pass() {
        assert!(found("src/map.rs::Map::build", "ts01_holds").is_empty());
        assert!(found("src/map.rs", "ts01_*").is_empty());
    }

    #[test]
    fn a_verdict_needs_a_test_or_a_benchmark() {
        assert_eq!(found("src/map.rs", ""), ["Eq. 9: no test and no benchmark shows what is said"]);
        assert_eq!(found("benches/benches/map.rs", ""), ["Eq. 9: no file benches/benches/map.rs"]);
    }

    #[test]
    fn what_is_not_built_has_neither_code_nor_tests() {
        assert!(found_of("", "", Verdict::NotBuilt).is_empty());
        let names_some = ["Eq. 9: not built, but names code or a test of it"];
        assert_eq!(found_of("src/map.rs::Map", "", Verdict::NotBuilt), names_some);
        assert_eq!(found_of("", "ts01_holds", Verdict::NotBuilt), names_some);
        // What depends on hardware may have a part that is here.
        assert!(found_of("src/map.rs::Map", "ts01_holds", Verdict::NotReproducible).is_empty());
    }

    #[test]
    fn names_that_do_not_exist_are_found() {
        assert_eq!(found("src/mop.rs::Map", "ts01_holds"), ["Eq. 9: no file src/mop.rs"]);
        assert_eq!(found("src/map.rs::Map::bui", "ts01_holds"), ["Eq. 9: src/map.rs has no Map::bui"]);
        for test in ["gone", "ts01", "ts02_*"] {
            assert_eq!(found("src/map.rs::Map", test), [format!("Eq. 9: no source has the test {test}")]);
        }
    }
}
