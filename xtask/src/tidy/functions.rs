//! Where pictures are made, functions that every system's mathematics library rounds in its own way come from `libm`.

use crate::repo::Repo;
use crate::source::{code_only, line_of};

/// Crates whose results reach a picture's bits. `reference` and `organza-judge` judge them, within tolerances.
const EXACT: [&str; 11] = [
    "splat-core",
    "read",
    "field",
    "convert",
    "tsm",
    "hbsort",
    "pbsr",
    "sheet-light",
    "deferred-blend",
    "organza-scene",
    "organza",
];

/// The standard library's functions that are not exactly rounded.
const ROUNDED: [&str; 20] = [
    "acos", "asin", "atan", "atan2", "cbrt", "cos", "cosh", "exp", "exp2", "exp_m1", "hypot", "ln", "ln_1p", "log10",
    "log2", "powf", "sin", "sin_cos", "tan", "tanh",
];

/// Finds calls of them outside tests, as methods and by path.
pub(crate) fn platform(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in repo.rust().filter(|(path, _)| is_exact(path)) {
        let code = code_only(text);
        let product = &code[..code.find("#[cfg(test)]\nmod ").unwrap_or(code.len())];
        for name in ROUNDED {
            let forms = [format!(".{name}("), format!("f32::{name}"), format!("f64::{name}")];
            let places = forms.iter().flat_map(|form| product.match_indices(form.as_str()));
            let is_whole = |(at, form): &(usize, &str)| {
                !product[at + form.len()..].starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_')
            };
            found.extend(places.filter(is_whole).map(|(at, _)| {
                format!("{path}:{}: {name} of the platform; libm's is the same everywhere", line_of(&code, at))
            }));
        }
    }
    found
}

fn is_exact(path: &str) -> bool {
    EXACT.iter().any(|name| path.starts_with(&format!("crates/{name}/src/"))) && !path.ends_with("/reference.rs")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_of_the_platform_is_found() {
        let text = "//! A.\nfn a(x: f64) -> f64 {\n    // x.exp()\n    libm::exp(x) + x.sin() + f64::exp2(x) + x.expand()\n}\n";
        let tests = "#[cfg(test)]\nmod tests {\n    fn b() {\n        1f64.exp();\n    }\n}\n";
        let text = format!("{text}{tests}");
        let found = platform(&Repo::in_memory(&[("crates/tsm/src/a.rs", &text), ("crates/reference/src/a.rs", &text)]));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found.iter().all(|f| f.starts_with("crates/tsm/src/a.rs:4: ")), "{found:?}");
    }
}
