//! Whether there is light in a scene for what it draws.

use crate::{Scene, SceneObject};
use splat_core::Shading;

impl Scene {
    /// Whether something of the scene would show in light, and there is none: no light, no ambient light that it reflects, nothing
    /// that shines.
    pub fn lacks_light(&self) -> bool {
        // Clear glass shows what is around it, and reflects nothing of its own.
        let is_clear =
            |o: &SceneObject| self.materials[o.material].material.bounds_matter() && self.opacity_of(o) == 0.0;
        let drawn = self.objects.iter().filter(|o| o.visible && !is_clear(o)).flat_map(SceneObject::material_ids);
        let drawn = || drawn.clone().map(|id| &self.materials[id].material);
        let shines = drawn().any(|m| m.shading == Shading::Unlit || m.emission.iter().any(|e| *e > 0.0));
        let reflects = drawn().any(|m| match m.shading {
            Shading::Phase => m.single_scattering_albedo > 0.0,
            _ => m.diffuse > 0.0 || m.specular > 0.0 || m.transmission > 0.0,
        });
        let lit = self.lights.iter().any(|l| l.light.intensity.iter().any(|i| *i > 0.0))
            || self.ambient.iter().any(|a| *a > 0.0) && drawn().any(|m| m.ambient > 0.0);
        reflects && !shines && !lit
    }
}
