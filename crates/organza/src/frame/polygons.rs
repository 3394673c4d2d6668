//! Triangles that stay triangles, of objects whose technique keeps them.

use super::Frame;
use crate::load::own::Own;
use crate::{CostRecord, Error, pass, stage};
use sheet_light::half::{Polygons, opaque_polygons};
use sheet_light::{SheetInput, Volume};
use splat_core::raster::OpaqueImage;
use splat_core::{optics, shade::LitBy};

impl<'a> Frame<'a> {
    /// Whether there are any.
    pub(super) fn has_polygons(&self) -> bool {
        self.loaded.own.iter().any(|own| own.form.is_polygons())
    }

    /// All of them.
    pub(crate) fn polygons(&self) -> Vec<Polygons<'a>> {
        let (loaded, scene) = (self.loaded, self.scene);
        let one = |own: &'a Own| {
            let (placed, object) = (own.placed()?, &loaded.objects[own.object]);
            let [r, g, b] = scene.materials[scene.objects[own.object].material].material.extinction_rgb;
            own.form.is_polygons().then(|| Polygons {
                placed,
                material: &loaded.materials[own.material],
                color: own.color,
                // That of the channel that absorbs most is known.
                optical_depth: optics::optical_depth(own.opacity) as f32 / r.max(g).max(b).max(f32::MIN_POSITIVE),
                object: own.object as u32,
                shadow_coefficient: object.shadow_coefficient,
                casts_shadow: object.casts_shadow,
                radius: if own.has_splats { own.radius as f32 } else { 0.0 },
            })
        };
        loaded.own.iter().filter_map(one).collect()
    }

    /// What is seen of the opaque ones in the light that comes through shadow maps; without any pixel where there are none.
    pub(super) fn solid_polygons(&self, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
        let polygons: Vec<Polygons<'_>> = self.polygons().into_iter().filter(Polygons::is_opaque).collect();
        if polygons.is_empty() {
            return Ok(OpaqueImage::default());
        }
        let input = self.sheet_input(Vec::new(), self.lit_by(self.maps(cost)?));
        self.progress.begin(stage::OPAQUE);
        cost.measure(pass::OPAQUE, |stage| {
            stage.items_in = polygons.len() as u64;
            let (layout, objects) = (self.layout(), self.layers.object);
            let seen = opaque_polygons(&input, &polygons, &layout, objects, Some(self.progress));
            seen.map_err(|e| {
                if e == sheet_light::Error::Cancelled { Error::Cancelled } else { Error::Internal(e.to_string()) }
            })
        })
    }

    /// Volumes in slabs, in the light of some lights.
    pub(crate) fn sheet_input<'b>(&'b self, volumes: Vec<Volume<'b>>, lights: Vec<LitBy<'b>>) -> SheetInput<'b> {
        let (camera, shadow_origin, ambient) = (&self.camera, self.loaded.cloud.origin, self.scene.ambient);
        SheetInput { volumes, splats: None, camera, lights, shadow_origin, ambient }
    }
}
