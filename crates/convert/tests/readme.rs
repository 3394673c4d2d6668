//! The README names every feature, and what needs it.

const README: &str = include_str!("../README.md");
const MANIFEST: &str = include_str!("../Cargo.toml");
const LIB: &str = include_str!("../src/lib.rs");

#[test]
fn every_feature_is_listed() {
    let features = MANIFEST.split("[features]").nth(1).unwrap().split("\n[").next().unwrap();
    let names: Vec<&str> = features.lines().filter_map(|l| l.split_once(" = ")).map(|(name, _)| name).collect();
    assert!(names.len() > 3, "{names:?}");
    for name in names.iter().filter(|name| **name != "default") {
        assert!(README.contains(&format!("`{name}`")), "{name}");
    }
}

/// Functions of the README's first table that lib.rs gives only with a feature are named beside it.
#[test]
fn what_needs_a_feature_is_said() {
    let table = README.split("| from | function | becomes |").nth(1).unwrap().split("\n\n").next().unwrap();
    let section = README.split("## Features").nth(1).unwrap().split("\n## ").next().unwrap();
    let functions = table.lines().flat_map(|l| l.split('|').nth(2).unwrap_or("").split('`').skip(1).step_by(2));
    let mut gated = 0;
    for function in functions {
        let lines: Vec<&str> = LIB.lines().collect();
        let Some(at) = lines.iter().position(|l| l.starts_with("pub use") && l.contains(function)) else { continue };
        if let Some(feature) = lines[at - 1].strip_prefix("#[cfg(feature = \"").and_then(|l| l.strip_suffix("\")]")) {
            gated += 1;
            let row = section.lines().find(|l| l.starts_with(&format!("| `{feature}` |"))).unwrap_or_default();
            assert!(row.contains(&format!("`{function}`")), "{function} needs {feature}");
        }
    }
    assert_eq!(gated, 2);
}
