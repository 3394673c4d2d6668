//! Whether there is light in a scene for what it draws.

use crate::{Scene, SceneObject};
use splat_core::Shading;

impl Scene {
    /// Whether something of the scene would show in light, and there is none: no light, no ambient light that it reflects, nothing
    /// that shines.
    pub fn lacks_light(&self) -> bool {
        let material = |o: &SceneObject| &self.materials[o.material].material;
        // Clear glass shows what is around it, and reflects nothing of its own.
        let is_clear = |o: &SceneObject| {
            material(o).bounds_matter() && o.opacity.unwrap_or(self.materials[o.material].opacity) == 0.0
        };
        let drawn = || self.objects.iter().filter(|o| o.visible && !is_clear(o));
        let shines =
            drawn().any(|o| material(o).shading == Shading::Unlit || material(o).emission.iter().any(|e| *e > 0.0));
        let reflects = drawn().any(|o| match material(o).shading {
            Shading::Phase => material(o).single_scattering_albedo > 0.0,
            _ => material(o).diffuse > 0.0 || material(o).specular > 0.0 || material(o).transmission > 0.0,
        });
        let lit = self.lights.iter().any(|l| l.light.intensity.iter().any(|i| *i > 0.0))
            || self.ambient.iter().any(|a| *a > 0.0) && drawn().any(|o| material(o).ambient > 0.0);
        reflects && !shines && !lit
    }
}
