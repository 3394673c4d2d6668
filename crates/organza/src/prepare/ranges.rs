//! The ranges of depth in which techniques take turns.
//!
//! Depths with at most one technique need no turns. Depths that several techniques share are cut into `render.depth_ranges`
//! ranges. Inside a range the share of one technique hides the whole share of the next, so their order is right to a range's
//! thickness. Opacity is right whatever the number: transmittances multiply in any order.

use crate::frame::Frame;
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
    let mut of_object: Vec<[f32; 2]> = vec![[f32::INFINITY, f32::NEG_INFINITY]; loaded.objects.len()];
    let mut meet = |object: usize, [near, far]: [f32; 2]| {
        let [n, f] = &mut of_object[object];
        (*n, *f) = (n.min(near), f.max(far));
    };
    let cloud = &loaded.cloud;
    let place = frame.camera.view_from_offset(cloud.origin);
    for i in 0..cloud.len() {
        let object = cloud.object[i] as usize;
        if cloud.kind[i] != SplatKind::Opaque && !plan.is_own[object] {
            let z = place.depth(cloud.position[i]);
            let radius = cloud.radius[i];
            meet(object, [z - radius, z + radius]);
        }
    }
    for native in &loaded.own {
        for corner in native.world_box().corners() {
            let z = frame.camera.view_from_world(corner).z as f32;
            meet(native.object, [z, z]);
        }
    }
    let farthest = of_object.iter().map(|s| s[1]).filter(|z| z.is_finite()).fold(0.0, f32::max);
    let margin = ROUNDING * farthest;
    let seen = of_object.iter().zip(&plan.by).filter(|(s, _)| s[0] <= s[1] && s[1] > 0.0);
    seen.map(|([near, far], by)| (at(*by), [near.max(0.0) - margin, far + margin])).collect()
}
