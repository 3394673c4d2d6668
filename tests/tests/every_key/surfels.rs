//! Settings of the technique `surfels`.

use super::table::{Entry, OPEN, SURFELS, of, one};

pub(crate) fn entries() -> Vec<Entry> {
    vec![
        of(OPEN, "render.surfels", "render.surfels={disc_scale=1}").by(SURFELS),
        of(OPEN, "render.surfels.disc_scale", "render.surfels.disc_scale=1").by(SURFELS),
        of(OPEN, "render.surfels.gap", "render.surfels.gap=4").by(SURFELS),
        of(OPEN, "render.surfels.transmittance_cutoff", "render.surfels.transmittance_cutoff=0.9").by(SURFELS),
        of(OPEN, "render.surfels.bending", "render.surfels.bending='power'").by(SURFELS).with(GLASS),
        of(OPEN, "render.surfels.behind", "render.surfels.behind='straight'").by(SURFELS).with(GLASS),
        of(OPEN, "render.surfels.shading", "render.surfels.shading='discs'").by(SURFELS),
        one("render.surfels.opaque", "render.surfels={opaque='one_pass', groups=2}").by(SURFELS),
        one("render.surfels.voronoi", "render.surfels.voronoi=false").by(SURFELS).with(ONE_PASS),
        of(OPEN, "render.surfels.layers", "render.surfels.layers='algorithm1'").by(SURFELS),
        one("render.surfels.peeled_layers", "render.surfels.peeled_layers=1").by(SURFELS).with(PEELED),
        of(OPEN, "render.surfels.groups", "render.surfels.groups=9").by(SURFELS).with(GROUPED),
        of(OPEN, "render.surfels.grouping", "render.surfels.grouping='mgc'").by(SURFELS).with(GROUPED),
        of(OPEN, "render.surfels.overlap_factor", "render.surfels.overlap_factor=0.2").by(SURFELS).with(MINIMUM),
        of(OPEN, "render.surfels.collisions", "render.surfels.collisions='keep'").by(SURFELS).with(HASHED),
        of(OPEN, "render.surfels.near_distance", "render.surfels.near_distance=1").by(SURFELS).with(NEAR),
        of(OPEN, "render.surfels.coverage", "render.surfels.coverage='partial'").by(SURFELS).with(COVERED),
        one("render.surfels.depth_steps", "render.surfels.depth_steps=1").by(SURFELS).with(GROUPED),
    ]
}

const GLASS: &[&str] = &["material.m.ior=1.5"];

const PEELED: &[&str] = &["render.surfels.layers='peeled'"];

const GROUPED: &[&str] = &["render.surfels.layers='algorithm1'"];

const ONE_PASS: &[&str] = &["render.surfels={opaque='one_pass', groups=1}"];

const COVERED: &[&str] = &["render.surfels.layers='algorithm1'", "render.surfels.groups=16"];

const MINIMUM: &[&str] = &["render.surfels.layers='algorithm2'", "render.surfels.grouping='mgc'"];

const HASHED: &[&str] = &["render.surfels.layers='algorithm1'", "render.surfels.grouping='hash'"];

const NEAR: &[&str] = &[
    "render.surfels.layers='algorithm1'",
    "render.surfels.grouping='hash'",
    "render.surfels.collisions='near'",
    "render.surfels.near_distance=100",
];
