//! Bounds of each object's occlusion: of the view behind it, and of each light for anything visible.

use super::casters::Shadowing;
use super::eye;
use super::probe::{Casters, Probe};
use crate::brightness::ObjectBrightness;
use crate::load::Loaded;
use crate::scene::{LightPoint, light_points};

/// Looks at all splats, at most: an object that is probed tile by tile takes one for the view and one for each point of a light.
const MOST_LOOKS: usize = 16;

/// What one object can hide, as optical depths of the channel that has most; infinite where none is known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hiding {
    /// Whether some of it may lie in the view.
    pub(crate) is_in_view: bool,
    /// Along any view ray.
    pub(crate) view_depth: f64,
    /// On the way of each light to anything that receives its shadow and may be seen.
    pub(crate) light_depths: Vec<f64>,
}

/// What view the objects are judged by.
pub(crate) struct View<'a> {
    /// The objects as boxes.
    pub(crate) shadowing: &'a Shadowing,
    /// Whether what objects hide is known of it: not where light leaves the view, or other views follow.
    pub(crate) is_known: bool,
}

/// What each object can hide. Objects with a splat that is `thin` are looked at tile by tile, unless that takes many looks.
pub(crate) fn hiding(
    loaded: &Loaded,
    view: &View<'_>,
    brightness: &[ObjectBrightness],
    is_thin: &dyn Fn(usize, f64) -> bool,
) -> Vec<Hiding> {
    let nothing_known = |rank: usize| Hiding {
        is_in_view: view.shadowing.shown()[rank],
        view_depth: f64::INFINITY,
        light_depths: vec![f64::INFINITY; loaded.lights.len()],
    };
    if !view.is_known {
        return (0..brightness.len()).map(nothing_known).collect();
    }
    let points = light_points(&loaded.lights);
    let casters: Vec<Vec<bool>> = points.iter().map(|point| view.shadowing.casters(&point.light)).collect();
    let casters = casters_by_light(loaded, &points, &casters);
    let hiding = |rank: usize| {
        let sum = brightness[rank].sum_of_splats;
        let casts = |light: usize| loaded.objects[rank].casts_shadow && casters[light][rank];
        let is_in_view = view.shadowing.shown()[rank];
        Hiding {
            is_in_view,
            view_depth: if is_in_view { sum } else { 0.0 },
            light_depths: (0..loaded.lights.len()).map(|light| if casts(light) { sum } else { 0.0 }).collect(),
        }
    };
    let mut hidings: Vec<Hiding> = (0..brightness.len()).map(hiding).collect();
    let hides = |hiding: &Hiding| hiding.view_depth > 0.0 || hiding.light_depths.iter().any(|depth| *depth > 0.0);
    let probed: Vec<usize> = (0..brightness.len())
        .filter(|rank| is_thin(*rank, brightness[*rank].thickest_splat) && hides(&hidings[*rank]))
        .collect();
    if probed.is_empty() || probed.len() * (1 + points.len()) > MOST_LOOKS {
        return hidings;
    }
    let probe = Probe::new(loaded, false);
    for rank in probed {
        look(loaded, &probe, &points, rank, &mut hidings[rank]);
    }
    hidings
}

/// For each light and object, whether any point of the light throws its shadow, given the same of each point.
pub(crate) fn casters_by_light(loaded: &Loaded, points: &[LightPoint], casters: &[Vec<bool>]) -> Vec<Vec<bool>> {
    let mut by_light = vec![vec![false; loaded.objects.len()]; loaded.lights.len()];
    for (point, casters) in points.iter().zip(casters) {
        by_light[point.light_index].iter_mut().zip(casters).for_each(|(casts, of_point)| *casts |= of_point);
    }
    by_light
}

/// Looks at an object tile by tile.
fn look(loaded: &Loaded, probe: &Probe<'_>, points: &[LightPoint], rank: usize, hiding: &mut Hiding) {
    if hiding.view_depth > 0.0 {
        let depth = probe.with_casters(Casters::Seen(rank)).greatest_depth(&eye(&loaded.camera));
        hiding.view_depth = hiding.view_depth.min(depth);
    }
    for (light, known) in hiding.light_depths.iter_mut().enumerate().filter(|(_, known)| **known > 0.0) {
        let of_light = points.iter().filter(|point| point.light_index == light);
        let shadows = probe.with_casters(Casters::Shadows(rank));
        let depth = of_light.map(|point| shadows.greatest_depth(&point.light)).fold(0.0, f64::max);
        *known = known.min(depth);
    }
}
