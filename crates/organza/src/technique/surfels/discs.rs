//! Discs of a frame that rays meet exactly: what they show, and the opaque ones (Zhang and Pajarola 2007, sections 3 and 5.1).

use super::groups;
use crate::frame::{Frame, record};
use crate::pass;
use crate::scene::OpaqueSurfels;
use crate::{CostRecord, Error};
use deferred_blend::{DiscInput, Discs, Light, OpaqueInput, Params, Passes, Shown, resolve_opaque};
use splat_core::Similarity;
use splat_core::raster::OpaqueImage;

/// What these discs hide, and show.
pub(crate) fn opaque(frame: &Frame<'_>, ids: &[u32], cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
    let params = params(frame);
    let asked = &frame.settings.surfels.opaque;
    let group = |asked| groups::members(frame, asked, ids, true, cost);
    let members = asked.groups().map(group).transpose()?;
    let passes = match (asked, &members) {
        (OpaqueSurfels::OnePass { voronoi, .. }, Some(members)) => {
            Passes::OnePlusOne { groups: members.groups(), voronoi: *voronoi }
        }
        _ => Passes::TwoPlusOne,
    };
    with_shown(frame, cost, |shown, cost| {
        cost.measure(pass::OPAQUE, |stage| {
            let discs = Discs::project(&disc_input(frame, ids), &params);
            let channels = frame.layout().count() as u32;
            let objects = frame.layers.object;
            let input = OpaqueInput { discs: &discs, shown, channels, objects, passes, max_bytes: u64::MAX };
            let seen = resolve_opaque(&input, &params, Some(frame.progress)).map_err(refuse)?;
            record(stage, &seen.counts);
            stage.items_in = ids.len() as u64;
            stage.bytes += discs.bytes();
            Ok(seen.image)
        })
    })
}

/// Hands on what discs show: light on pixels, or what shading has given to each.
pub(super) fn with_shown<T>(
    frame: &Frame<'_>,
    cost: &mut CostRecord,
    draw: impl FnOnce(Shown<'_>, &mut CostRecord) -> Result<T, Error>,
) -> Result<T, Error> {
    if !frame.settings.surfels.lights_pixels {
        let values = &frame.shaded(cost)?.values;
        return draw(Shown::Discs(values), cost);
    }
    let lights = frame.lit_by(frame.maps(cost)?);
    let input = &frame.shading(&lights);
    let layout = frame.layout();
    let transforms = &transforms(frame);
    draw(Shown::Pixels(Light { input, layout, transforms, heights: &frame.loaded.images.heights }), cost)
}

/// From each object into the world, in the cloud's unit.
pub(super) fn transforms(frame: &Frame<'_>) -> Vec<Similarity> {
    let unit = libm::exp2(f64::from(-frame.loaded.exponent));
    frame.scene.objects.iter().map(|object| object.transform.scaled(unit)).collect()
}

/// Some discs of what is drawn.
pub(super) fn disc_input<'a>(frame: &'a Frame<'a>, ids: &'a [u32]) -> DiscInput<'a> {
    let loaded = frame.loaded;
    let cloud = frame.drawn();
    DiscInput { cloud, ids, camera: &frame.camera, footprints: &loaded.footprints, materials: &loaded.materials }
}

pub(super) fn params(frame: &Frame<'_>) -> Params {
    let settings = &frame.settings.surfels;
    Params {
        disc_scale: settings.disc_scale as f32,
        gap: settings.gap as f32,
        transmittance_cutoff: settings.transmittance_cutoff as f32,
    }
}

pub(super) fn refuse(error: deferred_blend::Error) -> Error {
    match error {
        deferred_blend::Error::Cancelled => Error::Cancelled,
        other => Error::Internal(other.to_string()),
    }
}
