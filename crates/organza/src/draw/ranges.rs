//! The ranges of depth in which techniques take turns.
//!
//! Where one technique is alone at a depth, or none, there is nothing to take turns for. Where several lie at the same depths,
//! `render.depth_ranges` says into how many ranges these are cut: inside of a range one technique's share hides the next one's
//! whole, so their order is right to a range's thickness. Opacity is right whatever the number: transmittances multiply in any
//! order.

use crate::frame::Frame;
use crate::scene::Technique;
use crate::technique::EVERYWHERE;
use splat_core::SplatKind;
use std::ops::Range;

/// Rounding of a depth, over the farthest one.
const ROUNDING: f32 = 4e-6;
/// Most ranges, in times of what the scene asks for: beyond it they are cut evenly.
const MOST: usize = 4;

/// Which techniques are somewhere, a bit each.
type Present = u32;

/// Ranges that follow each other and hold all depths.
pub(super) fn ranges(frame: &Frame<'_>) -> Vec<Range<f32>> {
    if frame.plan.techniques.len() < 2 {
        return vec![EVERYWHERE];
    }
    let wanted = frame.settings.depth_ranges as usize;
    let stretches = stretches(&spans(frame), frame.plan.techniques.len());
    let mut cuts = cuts(&stretches, wanted);
    if cuts.len() > MOST * wanted {
        let [near, far] = [cuts[0], cuts[cuts.len() - 1]];
        cuts = (0..=wanted).map(|k| near + (far - near) * (k as f32 / wanted as f32)).collect();
    }
    let ends: Vec<f32> = [f32::NEG_INFINITY].into_iter().chain(cuts).chain([f32::INFINITY]).collect();
    ends.windows(2).map(|w| w[0]..w[1]).collect()
}

/// Depths between which a translucent object may lie, with the place of its technique in the plan.
fn spans(frame: &Frame<'_>) -> Vec<(usize, [f32; 2])> {
    let (loaded, plan) = (frame.loaded, frame.plan);
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
            let (z, radius) = (place.depth(cloud.position[i]), cloud.radius[i]);
            meet(object, [z - radius, z + radius]);
        }
    }
    for own in &loaded.own {
        for corner in own.world_box().corners() {
            let z = frame.camera.view_from_world(corner).z as f32;
            meet(own.object, [z, z]);
        }
    }
    let farthest = of_object.iter().map(|s| s[1]).filter(|z| z.is_finite()).fold(0.0, f32::max);
    let margin = ROUNDING * farthest;
    let seen = of_object.iter().zip(&plan.by).filter(|(s, _)| s[0] <= s[1] && s[1] > 0.0);
    seen.map(|([near, far], by)| (at(*by), [near.max(0.0) - margin, far + margin])).collect()
}

/// Stretches of depth, near to far, in which the same techniques are present; those where none is are left out.
fn stretches(spans: &[(usize, [f32; 2])], techniques: usize) -> Vec<(Range<f32>, Present)> {
    let mut events: Vec<(f32, usize, i64)> =
        spans.iter().flat_map(|(t, [near, far])| [(*near, *t, 1), (*far, *t, -1)]).collect();
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut open = vec![0i64; techniques];
    let mut stretches: Vec<(Range<f32>, Present)> = Vec::new();
    for (k, (depth, technique, change)) in events.iter().enumerate() {
        open[*technique] += change;
        let present = open.iter().enumerate().fold(0, |bits, (t, n)| bits | Present::from(*n > 0) << t);
        let Some((next, ..)) = events.get(k + 1) else { break };
        if present == 0 || next <= depth {
            continue;
        }
        match stretches.last_mut() {
            Some((range, same)) if *same == present && range.end == *depth => range.end = *next,
            _ => stretches.push((*depth..*next, present)),
        }
    }
    stretches
}

/// Depths at which techniques change, and those between that cut what several share into `wanted` parts, all together.
fn cuts(stretches: &[(Range<f32>, Present)], wanted: usize) -> Vec<f32> {
    let is_shared = |present: Present| present.count_ones() > 1;
    let length = |range: &Range<f32>| range.end - range.start;
    let shared: f32 = stretches.iter().filter(|s| is_shared(s.1)).map(|s| length(&s.0)).sum();
    let step = shared / wanted as f32;
    let mut cuts: Vec<f32> = Vec::new();
    let mut last = None;
    for (range, present) in stretches {
        if last.is_some_and(|last| last != *present) || is_shared(*present) {
            cuts.push(range.start);
        }
        if is_shared(*present) {
            let parts = (length(range) / step).ceil().max(1.0);
            cuts.extend((1..parts as usize).map(|k| range.start + length(range) * (k as f32 / parts)));
            cuts.push(range.end);
        }
        last = Some(*present);
    }
    cuts.dedup();
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn techniques_that_lie_apart_are_cut_once() {
        let apart = stretches(&[(0, [1.0, 2.0]), (0, [1.5, 3.0]), (1, [4.0, 5.0]), (0, [6.0, 7.0])], 2);
        assert_eq!(apart, [(1.0..3.0, 1), (4.0..5.0, 2), (6.0..7.0, 1)]);
        assert_eq!(cuts(&apart, 16), [4.0, 6.0]);
    }

    #[test]
    fn what_techniques_share_is_cut_into_as_many_parts() {
        let shared = stretches(&[(0, [0.0, 10.0]), (1, [4.0, 8.0])], 2);
        assert_eq!(shared, [(0.0..4.0, 1), (4.0..8.0, 3), (8.0..10.0, 1)]);
        assert_eq!(cuts(&shared, 4), [4.0, 5.0, 6.0, 7.0, 8.0]);
        // A pane across the view is thinner than a range.
        let pane = stretches(&[(0, [0.0, 10.0]), (1, [4.0, 4.001])], 2);
        assert_eq!(cuts(&pane, 1), [4.0, 4.001]);
    }
}
