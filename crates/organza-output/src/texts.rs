//! Metadata about the origin of a file, as pairs of names and texts.

use super::Metadata;

/// Longest text of a scene that goes into its pictures, bytes; of a longer one the hash tells which it was.
const LONGEST_SCENE: usize = 1 << 16;

/// The pairs; texts without anything to say are left out.
pub(super) fn pairs(metadata: &Metadata) -> Vec<(&'static str, String)> {
    let mut texts = vec![
        ("organza:version", env!("CARGO_PKG_VERSION").to_owned()),
        ("organza:scene_sha256", metadata.scene_sha256.clone()),
        ("organza:technique", metadata.technique.clone()),
        ("organza:seed", metadata.seed.to_string()),
        ("organza:backend", metadata.backend.clone()),
    ];
    texts.extend((!metadata.left_out.is_empty()).then(|| ("organza:left_out", metadata.left_out.clone())));
    texts.extend(metadata.sets.map(|sets| ("organza:sets", sets.to_string())));
    texts
        .extend((1..=LONGEST_SCENE).contains(&metadata.scene.len()).then(|| ("organza:scene", metadata.scene.clone())));
    texts
}
