//! The keys of surfaces of fields and of what is made of several.

use super::table::{Entry, Which, Which::These, of, one};

const ISOSURFACE: Which = These(&["isosurface"]);
const LEVEL_SET: Which = These(&["level_set"]);
const UNION: Which = These(&["union"]);

const SPACED: &[&str] = &[
    "object.it.implicit={expression='x^2 + y^2 + 2*z^2 - 0.3', box=[[-0.9, -0.9, -0.9], [0.9, 0.9, 0.9]], spacing=0.1}",
];
const SURFACES: Which = These(&[
    "mesh",
    "plain mesh",
    "points",
    "plain points",
    "implicit",
    "isosurface",
    "level_set",
    "union",
    "rectangle",
]);
/// A surface that shows a field.
const SHOWN: &[&str] = &[
    "object.it.field={volume='grid.nrrd'}",
    "object.it.transfer=[{value=0, color=[1, 0, 0], opacity=0.1}, {value=1, color=[0, 0.5, 1], opacity=1}]",
];
const SHOWN_SERIES: &[&str] = &["object.it.field={volume='series.nrrd'}", SHOWN[1]];
const SERIES: &[&str] = &["object.it.union.0.isosurface.volume='series.nrrd'"];
/// A ball through points instead of the isosurface.
const POINTS: &[&str] = &["object.it.union.0={level_set={points='ball.xyz'}}", "object.it.spacing=0.1"];
/// A ball by its resolution instead of the one by its spacing.
const COARSE: &[&str] = &[
    "object.it.union.1.implicit={expression='(x - 0.3)^2 + y^2 + z^2 - 0.1', box=[[-0.1, -0.4, -0.4], [0.7, 0.4, 0.4]], resolution=6}",
];

pub(super) fn entries() -> Vec<Entry> {
    vec![
        one(
            "object.implicit",
            "object.it.implicit={expression='x^2 + y^2 + z^2 - 0.2', box=[[-0.9, -0.9, -0.9], [0.9, 0.9, 0.9]], spacing=0.1}",
        ),
        one("object.implicit.expression", "object.it.implicit.expression='x^2 + y^2 + z^2 - 0.2'"),
        one("object.implicit.box", "object.it.implicit.box=[[-0.9, -0.9, -0.9], [0.2, 0.9, 0.9]]"),
        one("object.implicit.resolution", "object.it.implicit.resolution=16"),
        one("object.implicit.spacing", "object.it.implicit.spacing=0.15").with(SPACED),
        of(ISOSURFACE, "object.isosurface", "object.it.isosurface={volume='grid.nrrd', level=0.75}"),
        of(ISOSURFACE, "object.isosurface.volume", "object.it.isosurface.volume='other.nrrd'"),
        of(ISOSURFACE, "object.isosurface.frame", "object.it.isosurface.frame=1")
            .with(&["object.it.isosurface.volume='series.nrrd'"]),
        of(ISOSURFACE, "object.isosurface.level", "object.it.isosurface.level=0.75"),
        of(ISOSURFACE, "object.isosurface.interpolation", "object.it.isosurface.interpolation='catmull-rom'"),
        of(ISOSURFACE, "object.isosurface.inside", "object.it.isosurface.inside='below'"),
        of(SURFACES, "object.field", "object.it.field={volume='other.nrrd'}").with(SHOWN),
        of(SURFACES, "object.field.volume", "object.it.field.volume='other.nrrd'").with(SHOWN),
        of(SURFACES, "object.field.frame", "object.it.field.frame=1").with(SHOWN_SERIES),
        of(SURFACES, "object.field.interpolation", "object.it.field.interpolation='catmull-rom'").with(SHOWN),
        of(LEVEL_SET, "object.level_set", "object.it.level_set={points='larger.xyz'}"),
        of(LEVEL_SET, "object.level_set.points", "object.it.level_set.points='larger.xyz'"),
        of(LEVEL_SET, "object.level_set.tolerance", "object.it.level_set.tolerance=0.05"),
        of(
            UNION,
            "object.union",
            "object.it.union=[{level_set={points='ball.xyz'}}, {level_set={points='larger.xyz'}}]",
        )
        .with(&["object.it.spacing=0.1"]),
        of(
            UNION,
            "object.intersection",
            "object.2={name='it', material='m', intersection=[{isosurface={volume='grid.nrrd', level=0.75}}, {isosurface={volume='other.nrrd', level=0.5}}]}",
        ),
        of(
            UNION,
            "object.difference",
            "object.2={name='it', material='m', difference=[{isosurface={volume='grid.nrrd', level=0.75}}, {isosurface={volume='other.nrrd', level=0.5}}]}",
        ),
        of(
            UNION,
            "object.part.implicit",
            "object.it.union.1={implicit={expression='x', box=[[-0.1, -0.4, -0.4], [0.7, 0.4, 0.4]], spacing=0.1}}",
        ),
        of(
            UNION,
            "object.part.implicit.expression",
            "object.it.union.1.implicit.expression='(x - 0.3)^2 + y^2 + z^2 - 0.06'",
        ),
        of(UNION, "object.part.implicit.box", "object.it.union.1.implicit.box=[[-0.1, -0.4, -0.4], [0.5, 0.4, 0.4]]"),
        of(UNION, "object.part.implicit.spacing", "object.it.union.1.implicit.spacing=0.07"),
        of(UNION, "object.part.implicit.resolution", "object.it.union.1.implicit.resolution=12").with(COARSE),
        of(UNION, "object.part.isosurface", "object.it.union.0={isosurface={volume='grid.nrrd', level=0.75}}"),
        of(UNION, "object.part.isosurface.volume", "object.it.union.0.isosurface.volume='other.nrrd'"),
        of(UNION, "object.part.isosurface.frame", "object.it.union.0.isosurface.frame=1").with(SERIES),
        of(UNION, "object.part.isosurface.level", "object.it.union.0.isosurface.level=0.75"),
        of(UNION, "object.part.isosurface.interpolation", "object.it.union.0.isosurface.interpolation='catmull-rom'"),
        of(UNION, "object.part.isosurface.inside", "object.it.union.0.isosurface.inside='below'"),
        of(UNION, "object.part.level_set", "object.it.union.0={level_set={points='larger.xyz'}}").with(POINTS),
        of(UNION, "object.part.level_set.points", "object.it.union.0.level_set.points='larger.xyz'").with(POINTS),
        of(UNION, "object.part.level_set.tolerance", "object.it.union.0.level_set.tolerance=0.05").with(POINTS),
        of(
            UNION,
            "object.part.union",
            "object.it.union.1={union=[{isosurface={volume='grid.nrrd', level=0.75}}, {isosurface={volume='other.nrrd', level=0.5}}]}",
        ),
        of(
            UNION,
            "object.part.intersection",
            "object.it.union.0={intersection=[{isosurface={volume='grid.nrrd', level=0.75}}, {isosurface={volume='other.nrrd', level=0.5}}]}",
        ),
        of(
            UNION,
            "object.part.difference",
            "object.it.union.0={difference=[{isosurface={volume='grid.nrrd', level=0.75}}, {isosurface={volume='grid.nrrd', level=0.9}}]}",
        ),
    ]
}
