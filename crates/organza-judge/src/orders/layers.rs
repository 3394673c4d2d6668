//! Layers of surfaces, separated by every method of the technique `surfels`.
//!
//! The reference meets every ray with every disc in f64, averages each layer and composites all of them. It is the paper's yardstick,
//! depth peeling (Zhang and Pajarola 2007, section 6.3), without a limit to the number of layers.

use super::{Ordered, by_technique, image};
use ::reference::metrics::{Image, Linear};
use deferred_blend::{DiscInput, Params, reference};
use organza::scene::{LayerChoice, Scene, SurfelLayers, Technique};
use organza::{CostRecord, Error, Frame, Loaded, Progress, RenderOptions, escape_controls, plan_loaded};

/// Numbers of peeled layers.
const PEELED: [u32; 2] = [3, 8];

/// Draws a loaded scene in each way, and gives the picture with all layers; or why its discs have no layers. Groups are those of the scene
/// where it asks for some.
pub(super) fn ways(
    scene: &Scene,
    loaded: &Loaded,
    ordered: &mut Vec<Ordered>,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Result<Image<Linear>, String>, Error> {
    if let Some(reason) = without_layers(scene) {
        return Ok(Err(reason));
    }
    let mut scene = scene.clone();
    scene.render.technique = Technique::Surfels;
    scene.render.layers = LayerChoice::default();
    let groups = scene.render.surfels.layers.groups().copied().unwrap_or_default();
    scene.render.surfels.transmittance_cutoff = 0.0;
    // All ways show the same light.
    scene.render.surfels.lights_pixels = false;
    let mut draw = |name: String, layers: SurfelLayers| {
        scene.render.surfels.layers = layers;
        let image = by_technique(Technique::Surfels, &scene, loaded, options, progress)?;
        ordered.push(Ordered { of_layers: true, ..Ordered::new(name, image) });
        Ok::<_, Error>(())
    };
    draw("layers by gaps".into(), SurfelLayers::Gaps)?;
    draw(format!("layers by Algorithm 1, {} groups", groups.count), SurfelLayers::Algorithm1(groups))?;
    draw(format!("layers by Algorithm 2, {} groups", groups.count), SurfelLayers::Algorithm2(groups))?;
    for most in PEELED {
        draw(format!("the {most} nearest layers"), SurfelLayers::Peeled(most))?;
    }
    scene.render.surfels.layers = SurfelLayers::Gaps;
    truth(&scene, loaded, options, progress).map(Ok)
}

/// Why discs of a scene have no layers that could be compared.
fn without_layers(scene: &Scene) -> Option<String> {
    let drawn = || scene.objects.iter().filter(|o| o.visible);
    if let Some(medium) = drawn().find(|o| o.source.is_medium()) {
        return Some(format!("`{}` is a medium", escape_controls(&medium.name)));
    }
    let bends = drawn().find(|o| scene.materials[o.material].material.bounds_matter());
    bends.map(|o| format!("`{}` bounds matter, through which no ray goes straight", escape_controls(&o.name)))
}

/// All layers of every pixel, each averaged, in f64.
fn truth(scene: &Scene, loaded: &Loaded, options: &RenderOptions, progress: &Progress) -> Result<Image<Linear>, Error> {
    let plan = plan_loaded(scene, loaded, options)?;
    progress.enter();
    let frame = Frame::new(scene, loaded, &plan, progress).with_hidden();
    let mut cost = CostRecord::default();
    let values = &frame.shaded(&mut cost)?.values;
    let settings = &scene.render.surfels;
    let cloud = frame.drawn();
    let params = Params {
        disc_scale: settings.disc_scale as f32,
        gap: settings.gap as f32,
        transmittance_cutoff: settings.transmittance_cutoff as f32,
    };
    let ids = frame.translucent(Technique::Surfels);
    let footprints = &loaded.footprints;
    let materials = &loaded.materials;
    let input = DiscInput { cloud, ids, camera: &frame.camera, footprints, materials };
    let mut accumulator = frame.accumulator();
    let sizes = [accumulator.optical_depth.len(), accumulator.channels.len()];
    let opaque = &frame.opaque(&mut cost)?.depth;
    let pixels = reference::picture(&input, &params, values, sizes, opaque);
    for (k, pixel) in pixels.iter().enumerate() {
        accumulator.channels.iter_mut().zip(&pixel.values).for_each(|(plane, v)| plane[k] = *v as f32);
        let planes = accumulator.optical_depth.iter_mut().zip(&pixel.transmittance);
        planes.for_each(|(plane, t)| plane[k] = -libm::log(*t) as f32);
    }
    let layers = frame.finish(&accumulator, None, &mut cost)?;
    progress.leave();
    image(&layers)
}
