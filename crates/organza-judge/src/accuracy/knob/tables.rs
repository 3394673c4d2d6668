//! Gaussians from tables, as section 4.3 of Gunjee 2007 has its footprints, beside the formula.

use super::points::{choice, step};
use crate::accuracy::{Knob, Options, Request, Theory};
use convert::FootprintChoice;
use organza::scene::{Scene, SceneObject, Source};
use splat_core::{Footprint, FootprintImage, FootprintStack};
use std::f32::consts::SQRT_2;
use std::sync::Arc;

/// Name of the knob.
pub(super) const NAME: &str = "footprint table size";

/// Most footprints of a scene.
const MOST: usize = 256;

/// Sizes of the table of translucent discs.
pub(super) fn footprint_tables(scene: &Scene, options: &Options) -> Result<Knob, String> {
    if options.quick {
        return Err("left out by --quick".into());
    }
    let many = tabled(scene).count();
    if many == 0 || many + scene.footprints.layers().len() > MOST {
        return Err("no translucent surface has discs of one Gaussian; media and opaque discs have no tables".into());
    }
    let size = |n: f64| step(format!("{n} texels a side"), n.recip(), n);
    let mut steps: Vec<_> = [4.0, 8.0, 16.0, 32.0, 64.0].map(size).into();
    steps.push(choice("the formula", 0.0));
    Ok(Knob {
        name: NAME,
        size_meaning: "1 / texels along a side, without shadows and the pixel's filter",
        set: tabulate,
        ends: steps.last().cloned().into_iter().collect(),
        steps,
        end_is_exact: true,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "2: bilinear between texels; less where discs are hardly larger than pixels",
        }),
        scene_size: None,
        joint: false,
    })
}

/// The objects whose discs are translucent and show one Gaussian, by rank, with it.
fn tabled(scene: &Scene) -> impl Iterator<Item = (usize, Footprint)> + '_ {
    let tabled_object = |(rank, object): (usize, &SceneObject)| {
        let is_surface = !object.source.is_medium() && !matches!(object.source, Source::Points(_));
        let [id] = object.footprints.ids[..] else { return None };
        let footprint = scene.footprints.layers()[usize::from(id)];
        let is_gaussian = scene.footprints.image(usize::from(id)).is_none() && footprint.cutoff * SQRT_2 <= 8.0;
        let is_drawn = object.visible && is_surface && scene.opacity_of(object) < 1.0;
        (is_drawn && is_gaussian).then_some((rank, footprint))
    };
    scene.objects.iter().enumerate().filter_map(tabled_object)
}

/// Puts images of so many texels a side in the place of Gaussians; 0 leaves the formula. What knows formulas alone, shadows, and the filter,
/// which images have in levels, is left out with both.
fn tabulate(request: &mut Request, texels: f64) {
    request.scene.render.points.resampling_filter = false;
    request.scene.lights.iter_mut().for_each(|light| light.shadow = false);
    let found: Vec<(usize, Footprint)> = tabled(&request.scene).filter(|_| texels > 0.0).collect();
    for (rank, footprint) in found {
        let stack = with_table(&request.scene.footprints, footprint, texels as u32);
        let id = stack.layers().len() - 1;
        let object = &mut request.scene.objects[rank];
        let choice =
            FootprintChoice { stack: stack.clone(), ids: vec![id as u8], ..FootprintChoice::clone(&object.footprints) };
        (object.footprints, request.scene.footprints) = (Arc::new(choice), stack);
    }
}

/// The size of the tables that one scene has and the other has not.
pub(crate) fn texels(before: &Scene, after: &Scene) -> Option<usize> {
    let last = after.footprints.layers().len() - 1;
    let is_new = before.footprints.layers().len() <= last;
    after.footprints.image(last).filter(|_| is_new).map(|image| image.size()[0])
}

/// A stack with the table of a Gaussian as its last layer: an image has its corners on the rim, so the disc is √2 times as wide as the circle
/// that it holds.
fn with_table(stack: &FootprintStack, footprint: Footprint, texels: u32) -> FootprintStack {
    let at = |i: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(texels) - 1.0;
    let places = (0..texels * texels).map(|k| [at(k % texels), at(k / texels)]);
    let coverage: Vec<f32> = places.map(|[x, y]| footprint.profile(x * x + y * y) as f32).collect();
    let wide = Footprint { cutoff: footprint.cutoff * SQRT_2 };
    let layers: Vec<Footprint> = stack.layers().iter().copied().chain([wide]).collect();
    let last = layers.len() - 1;
    let image =
        FootprintImage::new([texels; 2], &coverage).expect("invariant: a profile is a share of 1 in the middle");
    let new = FootprintStack::new(layers).expect("invariant: there is room, or the knob is left out");
    let images = (0..last).filter_map(|id| Some((id, stack.image(id)?.clone())));
    images.chain([(last, image.into())]).fold(new, |stack, (id, image)| stack.with_image(id, image))
}
