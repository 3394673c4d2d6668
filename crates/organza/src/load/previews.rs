//! Splats of the last preview, by object: the next one converts the objects that have changed.

use crate::form::PlannedObject;
use crate::scene::{Scene, Source};
use convert::DiscSize;
use splat_core::Cloud;

/// The splats of a preview, and the scene and the choices that they were converted by.
pub(super) struct Converted {
    pub(super) scene: Scene,
    /// By the rank of the object; `None` for one that was not converted.
    pub(super) planned: Vec<Option<PlannedObject>>,
    /// All splats, as few as are drawn.
    pub(super) cloud: Cloud,
    /// Its lengths are those of the world times two to the power of minus this.
    pub(super) exponent: i32,
}

impl Converted {
    /// The splats of an object of another scene, where they are the same.
    pub(super) fn cloud(&self, scene: &Scene, rank: usize, planned: &PlannedObject) -> Option<Cloud> {
        let object = scene.objects.get(rank)?;
        let is_same = self.scene.objects.get(rank) == Some(object) && self.planned.get(rank)?.as_ref() == Some(planned);
        let by_pixels = matches!(object.points.size, Some(DiscSize::Pixels(_)));
        // Points that a light sees depend on all other objects.
        let is_of_others = matches!(object.source, Source::Extract(_));
        if !is_same || by_pixels || is_of_others || !self.serves(scene) {
            return None;
        }
        let is_of_object = |i: &u32| self.cloud.object[*i as usize] as usize == rank;
        let ids: Vec<u32> = (0..self.cloud.len() as u32).filter(is_of_object).collect();
        let mut cloud = self.cloud.gather(&ids);
        cloud.scale_world(libm::exp2(f64::from(self.exponent)));
        Some(cloud)
    }

    /// Whether a scene differs in its objects, in its camera, and in lights that are there before and after.
    fn serves(&self, scene: &Scene) -> bool {
        let Scene { camera, target, lights, sha256, objects, .. } = self.scene.clone();
        let alike = Scene { camera, target, lights, sha256, objects, ..scene.clone() };
        self.scene == alike && self.scene.lights.is_empty() == scene.lights.is_empty()
    }
}
