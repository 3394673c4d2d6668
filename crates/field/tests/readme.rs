//! The README names every feature.

const README: &str = include_str!("../README.md");
const MANIFEST: &str = include_str!("../Cargo.toml");

#[test]
fn every_feature_is_listed() {
    let features = MANIFEST.split("[features]").nth(1).unwrap().split("\n[").next().unwrap();
    let names: Vec<&str> = features.lines().filter_map(|l| l.split_once(" = ")).map(|(name, _)| name).collect();
    assert!(names.len() > 1, "{names:?}");
    for name in names.iter().filter(|name| **name != "default") {
        assert!(README.contains(&format!("`{name}`")), "{name}");
    }
}
