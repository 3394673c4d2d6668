//! `color.NAME`: an object absorbs red, green and blue unequally. Without it all channels have their mean extinction.
//!
//! Along a line of optical depth τ, in units of the mean's, the transmittance of a channel of extinction r changes by |e^−τr − e^−τ·mean| at most, which
//! is no more than min(1, τ·|r − mean|) = d. Along a view ray the share d of the weights moves: g·L·d (`gain.rs`). On the way of a light it is the share of
//! that light which anything sends more or less. Where a spacing is optically thick, a splat's light is a mean along it, with weights that move by d as well:
//! it counts twice. The bound is g·(d·L + 2·Σ d·L of the light), with the greatest d of each.

use super::gain::{bound, share_of};
use super::{Open, Row, leave_out, object_candidates, row_of_technique};
use crate::plan::Plan;
use crate::scene::EffectKind;
use crate::statistics::{ObjectFacts, Statistics};

pub(super) static ROW: Row = Row {
    kind: EffectKind::Color,
    what: "extinction that differs by channel, so that light and shadows are tinted",
    without: "it absorbs red, green and blue alike, each as their mean",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Color, plan, candidates, is_on),
    work: None,
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    let ways = statistics.techniques.iter().filter_map(|technique| row_of_technique(*technique).by_channel);
    let ways = ways.map(|way| format!(": {way}")).collect::<String>();
    object_candidates(&ROW, statistics, "what all objects consist of absorbs red, green and blue alike", |object| {
        let changed = changed(object, object.view_depth);
        Open {
            bound: bound(change(object, statistics), statistics),
            on: format!("it absorbs red, green and blue unequally{ways}"),
            off: format!("no ray would lose {:.2} % more or less of a channel", 100.0 * changed),
        }
    })
}

/// The greatest change of a transmittance along a line of this optical depth of the channel that has most.
fn changed(object: &ObjectFacts, depth: f64) -> f64 {
    share_of(depth, object.color_spread).min(1.0)
}

fn change(object: &ObjectFacts, statistics: &Statistics) -> f64 {
    let lights = statistics.lights.iter().zip(&object.light_depths);
    let lit: f64 = lights.map(|(light, depth)| share_of(light.radiance, changed(object, *depth))).sum();
    share_of(statistics.brightest, changed(object, object.view_depth)) + 2.0 * lit
}
