//! Splats of a file become splats of an object: unchanged, or moved by its transform.

use crate::common::columns::ColumnSet;
use crate::points::materials::materials_of;
use crate::{ConvertError, SurfelParams};
use splat_core::glam::DQuat;
use splat_core::{Cloud, RawPoints};

/// Which columns they fill.
pub(crate) fn column_set(points: &RawPoints) -> ColumnSet {
    let cloud = &points.ready.cloud;
    ColumnSet {
        normal: !cloud.normal.is_empty(),
        shading_normal: !cloud.shading_normal.is_empty(),
        tangent: !cloud.tangent.is_empty(),
        shadow_coefficient: !cloud.shadow_coefficient.is_empty(),
        value: !cloud.value.is_empty(),
        crossing_depth: !cloud.crossing_depth.is_empty(),
        gaussian: None,
    }
}

/// The cloud of points that were checked. Without a transform it has the bits of the file.
pub(crate) fn to_cloud(points: &RawPoints, params: &SurfelParams) -> Result<Cloud, ConvertError> {
    let splat = &params.splat;
    let t = &splat.transform;
    check_footprints(points, params)?;
    splat.check_cloud(points.len() as f64, column_set(points))?;
    let mut cloud = points.ready.cloud.clone();
    cloud.origin = t.apply(cloud.origin);
    if t.scale != 1.0 || t.rotation != DQuat::IDENTITY {
        let length = t.scale as f32;
        let area = (t.scale * t.scale) as f32;
        cloud.position.iter_mut().for_each(|p| *p = (t.rotation * (p.as_dvec3() * t.scale)).as_vec3());
        cloud.radius.iter_mut().for_each(|radius| *radius *= length);
        cloud.cross_section.iter_mut().for_each(|k| *k *= area);
        cloud.tangent.iter_mut().for_each(|tangent| *tangent = (t.rotation * (tangent.as_dvec3() * t.scale)).as_vec3());
        let normals = cloud.normal.iter_mut().chain(&mut cloud.shading_normal);
        normals.for_each(|normal| *normal = t.rotate(normal.as_dvec3()).as_vec3());
    }
    match materials_of(points, splat)? {
        Some(material_of) => cloud.material.iter_mut().enumerate().for_each(|(i, id)| *id = material_of(i).id),
        None => cloud.material.fill(splat.material),
    }
    cloud.footprint.fill(splat.footprint);
    cloud.object.fill(splat.object);
    if !params.colors {
        cloud.color.fill(splat.color);
    } else if !points.color.is_empty() {
        cloud.color.clone_from(&points.color);
    }
    Ok(cloud)
}

/// Refuses splats whose radii are of another kernel than that of the object.
fn check_footprints(points: &RawPoints, params: &SurfelParams) -> Result<(), ConvertError> {
    if params.splat.shows_images() {
        let expected = "a formula: splats of a file are of one";
        return Err(params.splat.bad_text("footprint", "an image".to_owned(), expected));
    }
    let cutoffs = &points.ready.cutoffs;
    let object_cutoff = params.splat.profile.cutoff;
    let cutoff = |footprint: &u8| cutoffs.get(usize::from(*footprint)).copied().unwrap_or_default();
    match points.ready.cloud.footprint.iter().map(cutoff).find(|cutoff| *cutoff != object_cutoff) {
        Some(other) => {
            let found = format!("cut at {object_cutoff} standard deviations, where splats of the file are at {other}");
            let expected = "the one that they were made with, by `footprints` and `footprint`; \
                            `keep` parts a file by its column `footprint`";
            Err(params.splat.bad_text("footprint", found, expected))
        }
        None => Ok(()),
    }
}
