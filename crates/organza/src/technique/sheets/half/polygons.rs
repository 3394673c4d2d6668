//! Triangles that stay triangles.

use crate::form::Form;
use crate::frame::Frame;
use crate::load::own::Body;
use crate::matter::Matter;
use crate::scene::Technique;
use sheet_light::half::Polygons;
use splat_core::{optics, raster::triangles::PlacedMesh};

/// Whether there are any.
pub(super) fn any(matter: &Matter<'_>) -> bool {
    matter.planned.iter().any(|object| matches!(object.form, Form::Polygons | Form::Panes))
}

/// Those of a frame.
pub(super) fn polygons<'a>(frame: &'a Frame<'_>) -> Vec<Polygons<'a>> {
    let one = |own: &'a crate::load::own::Own| {
        let Body::Triangles(mesh) = &own.body else { return None };
        let (object, scene) = (&frame.loaded.objects[own.object], frame.scene);
        let [r, g, b] = scene.materials[scene.objects[own.object].material].material.extinction_rgb;
        (own.technique == Technique::Sheets).then(|| Polygons {
            placed: PlacedMesh { mesh, transform: own.transform },
            material: &frame.loaded.materials[own.material],
            color: own.color,
            // That of the channel that absorbs most is known.
            optical_depth: optics::optical_depth(own.opacity) as f32 / r.max(g).max(b).max(f32::MIN_POSITIVE),
            object: own.object as u32,
            shadow_coefficient: object.shadow_coefficient,
            casts_shadow: object.casts_shadow,
            radius: if own.has_splats { own.radius as f32 } else { 0.0 },
        })
    };
    frame.loaded.own.iter().filter_map(one).collect()
}
