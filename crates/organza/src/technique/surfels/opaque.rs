//! Opaque discs of the technique: met exactly by rays, those of a surface averaged (Zhang and Pajarola 2007, sections 3 and 5.1).

use super::{disc_input, grouped, params, refuse, with_shown};
use crate::frame::{Frame, record};
use crate::pass;
use crate::scene::OpaqueSurfels;
use crate::{CostRecord, Error};
use deferred_blend::{Discs, OpaqueInput, Passes, resolve_opaque};
use splat_core::raster::OpaqueImage;

/// What these discs hide, and show.
pub(crate) fn opaque(frame: &Frame<'_>, ids: &[u32], cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
    let (params, asked) = (params(frame), &frame.settings.surfels.opaque);
    let group = |groups| grouped::members(frame, groups, ids, None, cost);
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
            let (channels, objects) = (frame.layout().count() as u32, frame.layers.object);
            let input = OpaqueInput { discs: &discs, shown, channels, objects, passes, max_bytes: u64::MAX };
            let seen = resolve_opaque(&input, &params, Some(frame.progress)).map_err(refuse)?;
            record(stage, &seen.counts);
            stage.items_in = ids.len() as u64;
            stage.bytes += discs.bytes();
            Ok(seen.image)
        })
    })
}
