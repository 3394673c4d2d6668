//! `color.NAME`: an object absorbs red, green and blue unequally. Without it all channels have their mean extinction.
//!
//! Along a line of optical depth τ, in units of the mean's, the transmittance of a channel of extinction r is e^±x times that of the mean at most, with
//! x = τ·|r − mean|, and changes by d = min(1, x) at most. Light from behind the object so changes by e^±x, and light on its way to anything by e^±y, y as x
//! towards the lamp. Where a spacing is optically thick, a splat's light is a mean along it, and its weights change by as much again: all of a pixel is
//! within e^±2(x + y) of what it has, y that of the lamp for which it is greatest. What the object itself shows changes by the share d of the weights
//! besides. So the bound is 1 − s(e^−2(x + y)) + g·d·L (`gain.rs`), L the most radiance that the object shows.

use super::gain::{darkened, displayed, gain, share_of};
use super::{Open, Row, leave_out, object_candidates, row_of_technique};
use crate::plan::{Bound, Plan};
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
        let changed = -libm::expm1(-stretched(object, object.view_depth));
        Open {
            bound: bound(object, statistics),
            on: format!("it absorbs red, green and blue unequally{ways}"),
            off: format!("no ray would lose {:.2} % more or less of a channel", 100.0 * changed),
        }
    })
}

/// The greatest change of the optical depth of a channel along a line of this one, of the channel that has most.
fn stretched(object: &ObjectFacts, depth: f64) -> f64 {
    share_of(depth, object.color_spread)
}

fn bound(object: &ObjectFacts, statistics: &Statistics) -> Bound {
    let lights = statistics.lights.iter().zip(&object.light_depths).filter(|(light, _)| light.radiance > 0.0);
    let towards_lights = lights.map(|(_, depth)| stretched(object, *depth)).fold(0.0, f64::max);
    let in_view = stretched(object, object.view_depth);
    change(in_view, towards_lights, object.shown, statistics).map_or(Bound::Unknown, Bound::at_most)
}

/// The most that a displayed pixel changes without the colour of an object that shows no more than a radiance, where optical depths of a channel change by
/// this along rays of the view and of lights; `None` where it is not known.
pub(super) fn change(in_view: f64, towards_lights: f64, shown: f64, statistics: &Statistics) -> Option<f64> {
    let added = share_of(shown, in_view.min(1.0));
    let lost = -libm::expm1(-2.0 * (in_view + towards_lights));
    added.is_finite().then(|| darkened(lost) + displayed(added, gain(statistics)))
}
