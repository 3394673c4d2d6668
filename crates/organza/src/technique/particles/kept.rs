//! Sets of particles that serve all frames of an animation.

use super::parts::Source;
use crate::frame::Frame;
use crate::pass;
use crate::scene::{Scene, SceneObject};
use crate::{CostRecord, Error};
use pbsr::KeptSets;
use splat_core::{Camera, Similarity};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Share of the allowed memory that kept sets may take.
const SHARE: u64 = 4;

/// One frame's view of the objects, in the scene's unit.
#[derive(Debug, PartialEq)]
struct View {
    /// With one pixel a sample.
    camera: Camera,
    /// From each visible object to the world; frames that agree on it share it.
    transforms: Arc<[Option<Similarity>]>,
}

/// Kept sets of objects, and the frames that they are for.
#[derive(Default)]
pub(crate) struct Kept {
    views: Vec<View>,
    /// Bytes that the sets may take.
    allowed: u64,
    of_object: BTreeMap<usize, Entry>,
}

struct Entry {
    /// All that the sets depend on.
    made_from: String,
    sets: Arc<KeptSets>,
}

impl Kept {
    /// Keeps how a frame that samples objects sees them.
    pub(crate) fn add(&mut self, scene: &Scene) {
        let transforms = scene.objects.iter().map(|o| o.visible.then_some(o.transform)).collect();
        let mut view = View { camera: scene.camera.with_samples(scene.render.antialias), transforms };
        match self.views.last() {
            Some(last) if *last == view => return,
            Some(last) if last.transforms == view.transforms => view.transforms = Arc::clone(&last.transforms),
            _ => {}
        }
        self.views.push(view);
    }

    /// Allows a share of the memory, no more than is left beside `other` bytes.
    pub(crate) fn allow(&mut self, max_memory: u64, other: u64) {
        self.allowed = (max_memory / SHARE).min(max_memory.saturating_sub(other));
    }

    /// What cross-sections follow from, in words that differ where it does.
    pub(crate) fn views(&self) -> String {
        format!("{:?}", self.views)
    }

    /// Takes the finest cross-section that any frame needs, and samples the objects that are not kept and may be.
    pub(super) fn sample(
        &mut self,
        sources: &mut [Source<'_>],
        frame: &Frame<'_>,
        cost: &mut CostRecord,
        warnings: &mut Vec<String>,
    ) -> Result<(), Error> {
        let scene = frame.scene;
        let levels = frame.settings.particles.repeat_level;
        for source in sources.iter_mut() {
            let Some(object) = source.own_object() else { continue };
            for view in &self.views {
                if let Some(Some(transform)) = view.transforms.get(object) {
                    source.refine(&view.camera, transform);
                }
            }
            let made_from = made_from(&scene.objects[object], scene, source.cross_section());
            if self.of_object.get(&object).is_some_and(|entry| entry.made_from == made_from) {
                continue;
            }
            self.of_object.remove(&object);
            let held: u64 = self.of_object.values().map(|entry| entry.sets.bytes()).sum();
            let Some(part) = source.part(warnings)? else { continue };
            let sampler = part.object().sampler;
            let needed = sampler.expected_particles() * f64::from(levels) * pbsr::Particles::BYTES as f64;
            if needed <= self.allowed.saturating_sub(held) as f64 {
                let sets = cost.measure(pass::SAMPLE, |stage| {
                    let sets = Arc::new(KeptSets::new(sampler, 0, levels as usize));
                    (stage.items_in, stage.items_out, stage.bytes) = (1, sets.particles(), sets.bytes());
                    Ok::<_, Error>(sets)
                })?;
                self.of_object.insert(object, Entry { made_from, sets });
            }
            frame.progress.tick(0).map_err(|_| Error::Cancelled)?;
        }
        Ok(())
    }

    /// The sets of an object, by its rank in the scene.
    pub(super) fn sets_of(&self, object: usize) -> Option<Arc<KeptSets>> {
        self.of_object.get(&object).map(|entry| Arc::clone(&entry.sets))
    }
}

/// An object without its place and visibility, its material and what random numbers come from. Every number is written so
/// that it reads back the same.
fn made_from(object: &SceneObject, scene: &Scene, cross_section: f64) -> String {
    let scale = object.transform.scale;
    let material = &scene.materials[object.material];
    let object = SceneObject { transform: Similarity::default(), visible: true, ..object.clone() };
    let settings = (scene.render.seed, scene.render.particles, cross_section, scale);
    // Where nothing is lit and no layer shows them, volumes have no normals.
    format!("{object:?} {material:?} {settings:?} {:?} {}", scene.render.layers, scene.lights.is_empty())
}
