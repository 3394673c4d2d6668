//! Splats in the slabs of a sweep: surfaces and media that are classified already, each whole in the slab of its centre, for the eye
//! as for the light.
//!
//! What arrives at a splat is looked up when the sweep has come to it. A surface is not shadowed by itself: its discs overlap, and of
//! one that lies slanted to the slabs, neighbours come first. So it asks before the slabs in which they may lie. A medium shadows
//! itself, by what of its slab the light has come through at its place.

use super::light::SplatLight;
use super::squares::{Slab, Squares};
use crate::half_vector::input::HalfSplats;
use crate::half_vector::lamps::Lamps;
use crate::half_vector::light::buffer::LightBuffer;
use crate::half_vector::light::illuminate::{Around, Illumination, ThroughVolumes};
use crate::half_vector::polygons::light_depth::LightDepths;
use crate::half_vector::scatter::surface::{Facet, SurfaceLight};
use crate::half_vector::slicing::by_slab::BySlab;
use crate::half_vector::slicing::frame::Frame;
use crate::shared::pixel::PixelForm;
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::raster::pulp;
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade_splat};
use splat_core::{Receiver, SplatKind, Transmittance};

/// Splats shaded by one task.
const CHUNK: usize = 256;

/// How far around a place a look-up sees of a light with an extent: a slab is interpolated between pixels of the light's image, moved by a cubic, and looked up.
const SOFT_LOOK_UP_PX: f64 = 4.0;

/// The splats of a sweep, and what those of the present slab show.
pub(crate) struct SplatSheets<'a> {
    splats: &'a HalfSplats<'a>,
    frame: Frame,
    /// Slab coordinates of the centres, and their slabs.
    places: Vec<Vec3>,
    slabs: Vec<u32>,
    drawn: BySlab,
    /// The eye's image.
    pub(crate) squares: Squares,
    pub(crate) light: Option<SplatLight<'a>>,
    /// Radiance of those of the present slab, and whatever else a pixel keeps.
    values: Vec<f32>,
}

/// Footprint numbers of the splats of a slab.
pub(crate) struct SplatFragments {
    pub(crate) eye: u64,
    pub(crate) light: u64,
}

impl<'a> SplatSheets<'a> {
    /// Those of a sweep, for what `form` keeps; `opaque` has depths of what hides them from the eye, or nothing.
    pub(crate) fn new(
        splats: &'a HalfSplats<'a>,
        frame: &Frame,
        buffer: Option<&LightBuffer>,
        opaque: &[f32],
        form: PixelForm,
    ) -> Self {
        let place = |p: &Vec3| frame.point(splats.cloud.origin + p.as_dvec3()).as_vec3();
        let places: Vec<Vec3> = splats.cloud.position.par_iter().map(place).collect();
        let last = frame.slabs.count - 1;
        let slab = |depth: f32| ((depth / frame.slabs.width as f32) as u32).min(last);
        let slabs: Vec<u32> = places.iter().map(|p| slab(p.z)).collect();
        let drawn = BySlab::new(&slabs, frame.slabs.count);
        let planes = form.planes;
        let around = |buffer: &LightBuffer| {
            if buffer.soft.is_some() { SOFT_LOOK_UP_PX } else { 1.0 }
        };
        let light = |b: &LightBuffer| SplatLight::new(splats, frame, &b.sight, around(b), &places, &drawn.ids, planes);
        Self {
            light: buffer.map(light),
            squares: Squares::new(splats.projected, &drawn.ids, opaque, form),
            splats,
            frame: *frame,
            slabs,
            drawn,
            places,
            values: Vec::new(),
        }
    }

    /// Bytes of lists and sums.
    pub(crate) fn bytes(&self) -> u64 {
        let light = self.light.as_ref().map_or(0, SplatLight::bytes);
        self.squares.bytes() + light + 24 * self.places.len() as u64
    }

    /// Takes the splats of a slab up for eye and light, the latter behind the volumes of the slabs before and behind polygons, if there is any, with what
    /// volumes scatter to surfaces.
    pub(crate) fn enter(
        &mut self,
        slab: u32,
        lamps: &Lamps<'_>,
        volumes: Option<&Illumination<'_>>,
        depths: Option<&LightDepths>,
        diffuse: Option<&SurfaceLight>,
        layout: &ChannelLayout,
    ) -> SplatFragments {
        let ids = self.drawn.in_slab(slab);
        let mut fragments = 0;
        if let (Some(light), Some(light_before)) = (&mut self.light, volumes) {
            fragments = light.enter(slab, ids, &self.slabs, &self.places);
            let frame = &self.frame;
            let is_soft = light_before.buffer.soft.is_some();
            let places = |ids: &[u32]| -> Vec<Vec3> { ids.iter().map(|id| self.places[*id as usize]).collect() };
            if is_soft {
                let asking = light.asking(slab).to_vec();
                let mut found = vec![[0.0; 3]; asking.len()];
                let light_before = &Illumination { splats: Some(light), ..*light_before };
                found.par_chunks_mut(CHUNK).zip(asking.par_chunks(CHUNK)).for_each(|(out, ids)| {
                    let places = places(ids);
                    let seen = |light_before: &LightDepths| -> Vec<f32> {
                        places.iter().flat_map(|p| light_before.visible(frame.world(p.as_dvec3()), None)).collect()
                    };
                    let visible = &depths.map(seen).unwrap_or_default();
                    pulp::Arch::new().dispatch(Around { light: light_before, places: &places, visible, out });
                });
                light.set(&asking, &found);
            } else {
                light.ask(slab, &self.places);
            }
            let mut volumes = vec![[1.0; 3]; ids.len()];
            volumes.par_chunks_mut(CHUNK).zip(ids.par_chunks(CHUNK)).for_each(|(out, ids)| {
                let places = places(ids);
                let more: Vec<[f32; 3]> = match is_soft {
                    true => ids.iter().map(|id| light.more(*id, self.places[*id as usize], slab)).collect(),
                    false => Vec::new(),
                };
                pulp::Arch::new().dispatch(ThroughVolumes {
                    light: light_before,
                    frame,
                    places: &places,
                    more: &more,
                    out,
                });
                let Some(depths) = depths else { return };
                for (out, place) in out.iter_mut().zip(&places) {
                    let visible = depths.visibility(frame.world(place.as_dvec3()), None);
                    *out = [0, 1, 2].map(|c| out[c] * visible[c]);
                }
            });
            if is_soft { light.set(ids, &volumes) } else { light.attenuate(ids, &volumes) }
        }
        self.shade(slab, lamps, diffuse, layout);
        SplatFragments { eye: self.draw(slab), light: fragments }
    }

    /// Takes those of a slab up for the eye, with the values that were found before, if there are any. Fragments.
    pub(crate) fn draw(&mut self, slab: u32) -> u64 {
        let projected = self.splats.projected;
        let materials = self.splats.materials;
        let values = &self.values[..];
        self.squares.fill(Slab {
            projected,
            materials,
            slabs: &self.slabs,
            slab,
            ids: self.drawn.in_slab(slab),
            values,
        })
    }

    /// Ends a slab.
    pub(crate) fn leave(&mut self) {
        if let Some(light) = &mut self.light {
            light.leave();
        }
    }

    /// Finds the radiance of the splats of a slab.
    fn shade(&mut self, slab: u32, lamps: &Lamps<'_>, diffuse: Option<&SurfaceLight>, layout: &ChannelLayout) {
        let splats = self.splats;
        let ids = self.drawn.in_slab(slab);
        let channels = layout.count();
        self.values.clear();
        self.values.resize(ids.len() * channels, 0.0);
        let through = self.light.as_ref().map_or(&[][..], SplatLight::through);
        let arrives = lamps.carried.map(|lit| Arrives { through, others: lit.shadow });
        let carried = lamps.carried.zip(arrives.as_ref()).map(|(lit, shadow)| LitBy { shadow: Some(shadow), ..lit });
        let lights: Vec<LitBy<'_>> = carried.into_iter().chain(lamps.mapped.iter().copied()).collect();
        let HalfSplats { cloud, materials, objects, .. } = *splats;
        let Lamps { ambient, camera, .. } = *lamps;
        let input = ShadeInput { cloud, materials, objects, lights: &lights, ambient, camera };
        let chunks = self.values.par_chunks_mut(CHUNK * channels).zip(ids.par_chunks(CHUNK));
        chunks.for_each(|(values, ids)| {
            for (id, values) in ids.iter().zip(values.chunks_exact_mut(channels)) {
                let i = *id as usize;
                if !splats.projected.is_visible(i) {
                    continue;
                }
                let (mut radiance, normal) = shade_splat(&input, i);
                if lamps.light_alone {
                    (radiance.ambient, radiance.emission) = ([0.0; 3], [0.0; 3]);
                }
                radiance.write(normal, layout, values);
                if let (Some(diffuse), Some(lit), Some(first)) = (diffuse, &lamps.carried, layout.multiple())
                    && cloud.kind[i] != SplatKind::Medium
                {
                    let world = cloud.origin + cloud.position[i].as_dvec3();
                    let facet = Facet { material: &materials[usize::from(cloud.material[i])], color: cloud.color[i] };
                    let shown = diffuse.reflected(world, normal.as_dvec3(), &facet, &lit.light);
                    (0..3).for_each(|c| values[first + c] += shown[c]);
                }
            }
        });
    }
}

/// What arrives at splats of the light of a sweep.
struct Arrives<'a> {
    /// Share that is carried to each, by id.
    through: &'a [[f32; 3]],
    /// Shadows of all that is not carried.
    others: Option<&'a dyn Transmittance>,
}

impl Transmittance for Arrives<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        self.others.map_or([1.0; 3], |others| others.transmittance(receiver))
    }

    fn at_splat(&self, splat: usize, receiver: &Receiver) -> [f32; 3] {
        let others = self.transmittance(receiver);
        [0, 1, 2].map(|c| self.through[splat][c] * others[c])
    }
}
