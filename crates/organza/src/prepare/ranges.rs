//! The ranges of depth in which techniques take turns.
//!
//! Depths with at most one technique need no turns. Depths that several techniques share are cut into `render.depth_ranges`
//! ranges. Inside a range the share of one technique hides the whole share of the next, so their order is right to a range's
//! thickness. Opacity is right whatever the number: transmittances multiply in any order.

use crate::frame::Frame;
use crate::load::by_object::by_object;
use crate::scene::Technique;
use crate::technique::EVERYWHERE;
use splat_core::{SplatKind, turns};
use std::ops::Range;

/// Rounding of a depth, over the farthest one.
const ROUNDING: f32 = 4e-6;

/// Ranges that follow each other and hold all depths.
pub(crate) fn ranges(frame: &Frame<'_>) -> Vec<Range<f32>> {
    if frame.plan.techniques.len() < 2 {
        return vec![EVERYWHERE];
    }
    let cuts = turns(&spans(frame), frame.plan.techniques.len(), frame.settings.depth_ranges as usize);
    let ends: Vec<f32> = [f32::NEG_INFINITY].into_iter().chain(cuts).chain([f32::INFINITY]).collect();
    ends.windows(2).map(|w| w[0]..w[1]).collect()
}

/// Depths between which a translucent object may lie, with the place of its technique in the plan.
fn spans(frame: &Frame<'_>) -> Vec<(usize, [f32; 2])> {
    let loaded = frame.loaded;
    let plan = frame.plan;
    let at = |t: Technique| plan.techniques.iter().position(|u| *u == t).unwrap_or(0);
    let join = |span: &mut [f32; 2], other: &[f32; 2]| {
        span[0] = span[0].min(other[0]);
        span[1] = span[1].max(other[1]);
    };
    let cloud = &loaded.cloud;
    let place = frame.camera.view_from_offset(cloud.origin);
    let meet = |span: &mut [f32; 2], i: usize| {
        if cloud.kind[i] != SplatKind::Opaque && !plan.is_own[cloud.object[i] as usize] {
            let z = place.depth(cloud.position[i]);
            let radius = cloud.radius[i];
            join(span, &[z - radius, z + radius]);
        }
    };
    let nowhere = [f32::INFINITY, f32::NEG_INFINITY];
    let mut of_object = by_object(cloud, loaded.objects.len(), &nowhere, meet, join);
    for native in &loaded.own {
        for corner in native.world_box().corners() {
            let z = frame.camera.view_from_world(corner).z as f32;
            join(&mut of_object[native.object], &[z, z]);
        }
    }
    let farthest = of_object.iter().map(|s| s[1]).filter(|z| z.is_finite()).fold(0.0, f32::max);
    let margin = ROUNDING * farthest;
    let seen = of_object.iter().zip(&plan.by).filter(|(s, _)| s[0] <= s[1] && s[1] > 0.0);
    seen.map(|([near, far], by)| (at(*by), [near.max(0.0) - margin, far + margin])).collect()
}
