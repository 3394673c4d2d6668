//! Triangles that stay triangles, of objects whose technique keeps them.

use crate::frame::Frame;
use crate::load::own::Own;
use crate::{CostRecord, Error, pass, stage};
use sheet_light::half::{PolygonLamp, PolygonView, Polygons, opaque_polygons};
use sheet_light::{SheetInput, Volume};
use splat_core::raster::OpaqueImage;
use splat_core::{optics, shade::LitBy};

impl<'a> Frame<'a> {
    /// All of them.
    pub(super) fn polygons(&self) -> Vec<Polygons<'a>> {
        let loaded = self.loaded;
        let scene = self.scene;
        let polygons = |native: &'a Own| {
            let placed = native.placed()?;
            let object = &loaded.objects[native.object];
            let [r, g, b] = scene.materials[scene.objects[native.object].material].material.extinction_rgb;
            native.form.is_polygons().then(|| Polygons {
                placed,
                material: &loaded.materials[native.material],
                color: native.color,
                // That of the channel that absorbs most is known.
                optical_depth: optics::optical_depth(native.opacity) as f32 / r.max(g).max(b).max(f32::MIN_POSITIVE),
                object: native.object as u32,
                shadow_coefficient: object.shadow_coefficient,
                casts_shadow: object.casts_shadow,
                radius: if native.has_splats { native.radius as f32 } else { 0.0 },
            })
        };
        loaded.own.iter().filter_map(polygons).collect()
    }

    /// What is seen of the opaque ones in the light that comes through shadow maps; without any pixel where there are none.
    pub(super) fn solid_polygons(&self, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
        let polygons: Vec<Polygons<'_>> = self.polygons().into_iter().filter(Polygons::is_opaque).collect();
        if polygons.is_empty() {
            return Ok(OpaqueImage::default());
        }
        let lamps = self.polygon_lamps(cost)?;
        let view = PolygonView {
            camera: &self.camera,
            polygons: &polygons,
            lamps: &lamps,
            ambient: self.scene.ambient,
            shadow_origin: self.loaded.cloud.origin,
            keeps_objects: self.layers.object,
        };
        self.progress.begin(stage::OPAQUE);
        cost.measure(pass::OPAQUE, |stage| {
            stage.items_in = polygons.len() as u64;
            let seen = opaque_polygons(&view, &self.layout(), Some(self.progress));
            seen.map_err(|e| {
                if e == sheet_light::Error::Cancelled { Error::Cancelled } else { Error::Internal(e.to_string()) }
            })
        })
    }

    /// The points of lights that have an intensity, as opaque triangles receive them. Of light that slabs carry, these ask the maps of all casters.
    fn polygon_lamps(&self, cost: &mut CostRecord) -> Result<Vec<PolygonLamp<'_>>, Error> {
        let plan = self.plan;
        let has_z_buffers = plan.carried.is_empty() && self.loaded.beside_polygons().is_some();
        let maps = if has_z_buffers { self.maps_of_others(cost)? } else { self.maps(cost)? };
        let points = self.light_points().iter().enumerate().filter(|(_, point)| point.light.intensity != [0.0; 3]);
        let lamps = points.map(|(k, point)| PolygonLamp {
            lit: LitBy { shadow: maps.get(k).and_then(Option::as_ref).map(|map| map as _), ..self.lit(point) },
            points: (has_z_buffers && plan.shadow_maps[point.light_index]).then_some(point.rank[1] as u32),
        });
        Ok(lamps.collect())
    }

    /// Volumes in slabs, in the light of some lights.
    pub(super) fn sheet_input<'b>(&'b self, volumes: Vec<Volume<'b>>, lights: Vec<LitBy<'b>>) -> SheetInput<'b> {
        let camera = &self.camera;
        let shadow_origin = self.loaded.cloud.origin;
        let ambient = self.scene.ambient;
        SheetInput { volumes, splats: None, camera, lights, shadow_origin, ambient }
    }
}
