//! Keys of footprints that are images, and of their choice.

use super::table::{Entry, POINTS, one};

const LEAF: &[&str] = &["footprints=[{image='leaf.png'}]"];

pub(super) fn entries() -> Vec<Entry> {
    vec![
        one("footprints.image", "footprints=[{image='leaf.png'}]").by(POINTS),
        one("footprints.images", "footprints=[{images='leaves'}]").by(POINTS),
        one("footprints.cutoff", "footprints=[{image='leaf.png', cutoff=2}]").by(POINTS).with(LEAF),
        one("object.footprint.of", "object.it.footprint={of=[0, 1]}"),
        one("object.footprint.seed", "object.it.footprint.seed=5").with(&["object.it.footprint={of=[0, 1]}"]),
        one("object.footprint.turn", "object.it.footprint={turn=90}").by(POINTS).with(LEAF),
        one("material.footprint", "material.m.footprint=2"),
    ]
}
