//! Files and functions that one can read.

use crate::repo::Repo;
use crate::source::{code_only, functions as functions_of};

const MAX_FILE_LINES: usize = 500;
const MAX_FUNCTION_LINES: usize = 60;
/// A test tells one story from its input to its checks; it may be longer.
const MAX_TEST_LINES: usize = 100;

/// No Rust file is longer than [`MAX_FILE_LINES`].
pub(crate) fn files(repo: &Repo) -> Vec<String> {
    let counted = repo.rust().map(|(path, text)| (path, text.lines().count()));
    let long = counted.filter(|(_, n)| *n > MAX_FILE_LINES);
    long.map(|(path, n)| format!("{path}: {n} lines, at most {MAX_FILE_LINES}")).collect()
}

/// No function has more lines of code than [`MAX_FUNCTION_LINES`], or [`MAX_TEST_LINES`] among tests.
pub(crate) fn functions(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in repo.rust() {
        let test_file = path.starts_with("tests/") || path.contains("/tests/");
        for f in functions_of(&code_only(text)) {
            let limit = if test_file || f.in_test_module { MAX_TEST_LINES } else { MAX_FUNCTION_LINES };
            if f.lines_of_code > limit {
                found.push(format!(
                    "{path}:{}: {} has {} lines of code, at most {limit}",
                    f.line, f.name, f.lines_of_code
                ));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(lines: usize) -> String {
        format!("fn long() {{\n{}}}\n", "    step();\n".repeat(lines - 2))
    }

    #[test]
    fn a_long_file_is_found() {
        let (fits, long) = ("//!\n".repeat(500), "//!\n".repeat(501));
        assert_eq!(files(&Repo::of(&[("a.rs", &fits), ("b.rs", &long)])), ["b.rs: 501 lines, at most 500"]);
    }

    #[test]
    fn a_long_function_is_found() {
        let repo = Repo::of(&[("a.rs", &function(60)), ("b.rs", &function(61))]);
        assert_eq!(functions(&repo), ["b.rs:1: long has 61 lines of code, at most 60"]);
    }

    #[test]
    fn a_long_test_is_found() {
        let module = |lines| format!("#[cfg(test)]\nmod tests {{\n{}}}\n", function(lines));
        let repo = Repo::of(&[("a.rs", &module(100)), ("crates/a/tests/b.rs", &function(101)), ("c.rs", &module(101))]);
        let expected = ["crates/a/tests/b.rs:1: long has 101", "c.rs:3: long has 101"];
        let found = functions(&repo);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.iter().zip(expected).all(|(f, e)| f.starts_with(e)), "{found:?}");
    }

    #[test]
    fn comments_and_blank_lines_are_free() {
        let text = format!("fn long() {{\n{}}}\n", "\n    // why\n    step();\n".repeat(58));
        assert!(functions(&Repo::of(&[("a.rs", &text)])).is_empty());
    }
}
