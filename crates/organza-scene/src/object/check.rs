//! Checks of objects: what all of them have, whatever their source.

use crate::at::At;
use crate::footprint::check::check_choice;
use crate::limits::{LARGEST, SMALLEST};
use crate::object::labels::{LABEL_COLUMN, check_labels};
use crate::object::points_check::check_points;
use crate::object::raw::{RawLattice, RawObject, RawTransform, RawUp};
use crate::paths::Paths;
use crate::render::check::check_technique;
use crate::source::check::check_source;
use crate::source::field::{check_clip, check_shown_field};
use crate::source::in_memory::name_of;
use crate::{Error, FieldSource, ObjectLabels, SceneMaterial, SceneObject, Source, Technique, Up, UpBy};
use convert::{ColorBy, PointColors};
use glam::{DQuat, DVec3};
use read::{VoxelSize, stated_up_axis, up_axis};
use splat_core::{FootprintStack, MemoryAccount, Packing, Similarity, UpAxis};
use std::collections::HashSet;
use std::sync::Arc;

/// Greatest value that a voxel may have, in the digits that single precision is written with: they round to it.
const GREATEST_VALUE: f64 = 3.402_823_5e38;

/// What objects refer to.
pub(crate) struct Named<'a> {
    pub(crate) materials: &'a [SceneMaterial],
    pub(crate) footprints: &'a FootprintStack,
    pub(crate) paths: &'a Paths,
    /// On which tables of labels are while they are read.
    pub(crate) memory: &'a MemoryAccount,
    /// Objects that lights are asked for: they are read even where they are invisible.
    pub(crate) seen: &'a HashSet<String>,
}

/// Checks one object whose material is known.
pub(crate) fn check_object(
    at: &At<'_>,
    raw: RawObject,
    material: usize,
    named: &Named<'_>,
) -> Result<SceneObject, Error> {
    if raw.name.is_empty() || raw.name.len() > 256 {
        let message = format!("`name`: expected 1 to 256 bytes of text, found {}", raw.name.len());
        return Err(at.key("name").error(message, ""));
    }
    let fallback = named.materials[material].extinction;
    let source = check_source(at, &raw, fallback, named.paths)?;
    refuse_what_does_not_apply(at, &raw, &source)?;
    let of_material = named.materials[material].footprint;
    let footprints = check_choice(at, raw.footprint.as_ref(), of_material, named.footprints, &source)?;
    let field = raw.field.as_ref().map(|field| check_shown_field(at, &raw, field, &source, named.paths)).transpose()?;
    let up = match raw.transform.up {
        // An invisible object is not even read, unless a light is to see it.
        RawUp::Auto if raw.visible == Some(false) && !named.seen.contains(&raw.name) => by_scene(UpAxis::Y),
        RawUp::Auto => up_of_files(at, &source, field.as_ref())?,
        RawUp::Y => by_scene(UpAxis::Y),
        RawUp::Z => by_scene(UpAxis::Z),
        RawUp::MinusY => by_scene(UpAxis::MinusY),
    };
    let labels = check_labels(at, &raw, named.paths, named.memory)?;
    let mut points = check_points(at, &raw)?;
    if let Some(ObjectLabels { table, .. }) = &labels {
        points.color_by = Some(ColorBy { column: LABEL_COLUMN.to_owned(), colors: PointColors::Labels(table.clone()) });
    }
    Ok(SceneObject {
        transform: check_transform(&at.key("transform"), &raw.transform, up.axis)?,
        up,
        source,
        material,
        materials: Vec::new(),
        color: raw.color.map(|c| at.color("color", c)).transpose()?,
        opacity: raw.opacity.map(|a| at.number("opacity", a, 0.0..=1.0)).transpose()?,
        packing: match raw.lattice {
            None | Some(RawLattice::Cartesian) => Packing::Cartesian,
            Some(RawLattice::Bcc) => Packing::BodyCentred,
        },
        array: raw.array.clone(),
        nodata: raw
            .nodata
            .map(|value| at.number("nodata", value, -GREATEST_VALUE..=GREATEST_VALUE))
            .transpose()?
            .map(|v| v as f32),
        voxel_size: raw.voxel_size.map(|steps| check_voxel_size(at, steps)).transpose()?,
        degrees: raw.degrees.unwrap_or(false),
        field,
        points,
        labels,
        clip: raw
            .clip
            .iter()
            .enumerate()
            .map(|(i, c)| check_clip(&at.key("clip").index(i), c))
            .collect::<Result<_, _>>()?,
        spacing: raw.spacing.map(|s| at.length("spacing", s)).transpose()?,
        shadow_coefficient: at.number("shadow_coefficient", raw.shadow_coefficient.unwrap_or(1.0), 0.0..=1.0)? as f32,
        casts_shadow: raw.casts_shadow.unwrap_or(true),
        visible: raw.visible.unwrap_or(true),
        footprints: Arc::new(footprints),
        merge_duplicates: raw.merge_duplicates,
        technique: check_own_technique(at, raw.technique.as_deref())?,
        is_chosen: false,
        deforms: false,
        name: raw.name,
    })
}

/// Steps between voxels.
fn check_voxel_size(at: &At<'_>, steps: [f64; 3]) -> Result<VoxelSize, Error> {
    let fits = |step: &f64| (SMALLEST..=LARGEST).contains(step);
    let found = VoxelSize::new(steps).filter(|size| size.steps().iter().all(fits));
    found.ok_or_else(|| {
        let message =
            format!("`voxel_size`: expected three numbers above 0, from {SMALLEST:e} to {LARGEST:e}, found {steps:?}");
        at.key("voxel_size").error(message, "such as [0.5, 0.5, 2]: steps along x, y and from slice to slice")
    })
}

/// An axis that the scene states, or the coordinates of the scene itself.
fn by_scene(axis: UpAxis) -> Up {
    Up { axis, by: UpBy::Scene }
}

/// The axis that points up by the source's files and the field's, which have to agree.
fn up_of_files(at: &At<'_>, source: &Source, field: Option<&FieldSource>) -> Result<Up, Error> {
    let of_field = field.map(|field| &*field.path);
    let paths = || source.paths().into_iter().chain(of_field).filter(|path| name_of(path).is_none());
    let mut axes = paths().map(|path| (path, up_axis(path)));
    let Some((first, axis)) = axes.next() else { return Ok(by_scene(UpAxis::Y)) };
    if let Some((other, another)) = axes.find(|(_, another)| *another != axis) {
        let [first, other] = [first, other].map(crate::printable);
        let message = format!(
            "the files of an object have several axes that point up: {first} has {}, {other} {}",
            axis.name(),
            another.name()
        );
        return Err(at.key("transform").error(message, "say which one counts: `transform = { up = \"z\" }`"));
    }
    let is_stated = paths().any(|path| stated_up_axis(path).is_some());
    Ok(Up { axis, by: if is_stated { UpBy::File } else { UpBy::Nothing } })
}

/// The technique that an object names; "auto" is that of the scene.
fn check_own_technique(at: &At<'_>, name: Option<&str>) -> Result<Option<Technique>, Error> {
    let named = name.map(|name| check_technique(at, name)).transpose()?;
    Ok(named.filter(|technique| *technique != Technique::Auto))
}

/// A key that would silently do nothing is an error.
fn refuse_what_does_not_apply(at: &At<'_>, raw: &RawObject, source: &Source) -> Result<(), Error> {
    if source.is_medium() && raw.opacity.is_some() {
        return Err(at.key("opacity").error("a medium has no `opacity`", "use its extinction"));
    }
    let has_own_spacing =
        matches!(source, Source::Density(_) | Source::Cloud(_) | Source::Medium(_) | Source::Rectangle(_));
    if has_own_spacing && raw.spacing.is_some() {
        return Err(at.key("spacing").error("this source states its own spacing", "move `spacing` into the source"));
    }
    if raw.slice.is_some() && raw.unit_length.is_some() {
        return Err(at.key("unit_length").error("a slice has no extinction", "its `opacity` is that of one crossing"));
    }
    let colored = [(raw.volume.is_some(), "volume"), (raw.slice.is_some(), "slice")].into_iter().find(|c| c.0);
    if let (Some((_, what)), true) = (colored, raw.color.is_some()) {
        let message = format!("the colours of a {what} are those of its `transfer`");
        return Err(at.key("color").error(message, "change `color` in `transfer`"));
    }
    if raw.points.is_none() && raw.merge_duplicates {
        return Err(at.key("merge_duplicates").error("`merge_duplicates` belongs to `points`", ""));
    }
    for (key, on) in [("lattice", raw.lattice.is_some()), ("frame", raw.frame.is_some())] {
        if raw.volume.is_none() && on {
            return Err(at.key(key).error(format!("`{key}` belongs to a `volume`"), ""));
        }
    }
    if raw.degrees.is_some() && raw.points.is_none() {
        return Err(at.key("degrees").error("`degrees` belongs to `points`", ""));
    }
    let has_volume = raw.volume.is_some() || raw.isosurface.is_some() || raw.slice.is_some() || raw.field.is_some();
    for (key, on) in [("array", raw.array.is_some()), ("nodata", raw.nodata.is_some())] {
        if on && !has_volume {
            let message =
                format!("`{key}` belongs to a `volume`, an `isosurface`, a `slice` and a surface with a `field`");
            return Err(at.key(key).error(message, ""));
        }
    }
    if raw.voxel_size.is_some() && !has_volume && raw.mesh.is_none() {
        let message = "`voxel_size` belongs to a `volume`, an `isosurface`, a `slice`, a surface with a `field` and a `mesh` of labels";
        return Err(at.key("voxel_size").error(message, ""));
    }
    let is_classified = raw.volume.is_some() || raw.slice.is_some();
    if raw.transfer.is_some() && !is_classified && raw.color_by.is_none() && raw.field.is_none() {
        let message = "`transfer` belongs to a `volume` or `slice`, to a surface with a `field`, and to `points` or a `mesh` with `color_by`";
        return Err(at.key("transfer").error(message, ""));
    }
    let is_matter = matches!(source, Source::Matter(_)) && raw.transfer.is_some();
    if raw.unit_length.is_some() && !is_classified && !is_matter {
        let message = "`unit_length` belongs to a `volume`, and to `points` that are a medium with a `transfer`";
        return Err(at.key("unit_length").error(message, ""));
    }
    Ok(())
}

/// Turns `up`, then rotates around x, y and z in this order.
fn check_transform(at: &At<'_>, raw: &RawTransform, up: UpAxis) -> Result<Similarity, Error> {
    let angles = at.vector("rotate", raw.rotate)?.map(f64::to_radians);
    // Extrinsic x, y, z is intrinsic z, y, x.
    let rotation = turned(DVec3::Z, angles.z) * turned(DVec3::Y, angles.y) * turned(DVec3::X, angles.x);
    let up = match up {
        UpAxis::Y => DQuat::IDENTITY,
        UpAxis::Z => turned(DVec3::X, -std::f64::consts::FRAC_PI_2),
        // Half a turn about x, without rounding.
        UpAxis::MinusY => DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
    };
    Ok(Similarity {
        scale: at.length("scale", raw.scale.unwrap_or(1.0))?,
        rotation: (rotation * up).normalize(),
        translation: at.vector("translate", raw.translate)?,
    })
}

/// A turn about an axis, radians, with the same bits on every system, which glam's own has not.
fn turned(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = axis * sin;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}
