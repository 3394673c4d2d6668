//! Splats in the slabs of a sweep: surfaces and media that are classified already, each whole in the slab of its centre, for the eye
//! as for the light.
//!
//! What arrives at a splat is looked up when the sweep has come to it. A surface is not shadowed by itself: its discs overlap, and of
//! one that lies slanted to the slabs, neighbours come first. So it asks before the slabs in which they may lie. A medium shadows
//! itself, by what of its slab the light has come through at its place.

use super::bodies::SplatBounds;
use super::frame::Frame;
use super::illuminate::{Around, Illumination, ThroughVolumes};
use super::light_buffer::LightBuffer;
use super::light_depth::LightDepths;
use super::scatter::SurfaceLight;
use super::splat_light::SplatLight;
use super::splat_squares::{BySlab, Slab, Squares};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::raster::{Detail, Params, ProjectInput, Projected, project, pulp};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade_splat};
use splat_core::{
    Accumulator, Camera, Cloud, DAabb, FootprintStack, Material, Object, Receiver, Shading, SplatKind, Transmittance,
};

/// Splats shaded by one task.
const CHUNK: usize = 256;

/// How far around a place a look-up sees of a light with an extent: a slab is interpolated between pixels of the light's image, moved by a cubic, and looked up.
const SOFT_LOOK_UP_PX: f64 = 4.0;

/// Splats of the input.
#[derive(Clone, Copy)]
pub struct HalfSplats<'a> {
    /// The splats, all of which are drawn and none of which is opaque. Shadows of lights lie relative to its origin.
    pub cloud: &'a Cloud,
    /// Materials by id.
    pub materials: &'a [Material],
    /// Objects by id: who casts shadows, and how much of one each receives.
    pub objects: &'a [Object],
    /// Footprints by id.
    pub footprints: &'a FootprintStack,
    /// Their footprints in the eye's image, with depths where something opaque hides them, polygons are translucent or depths are asked for, with
    /// objects where these are.
    pub projected: &'a Projected,
    /// Width of the slabs where neither the parameters nor a volume give one, world units, > 0.
    pub slab_width: f64,
}

impl HalfSplats<'_> {
    /// Where they lie; `None` without any.
    pub fn bounds(&self) -> Option<SplatBounds> {
        let all = self.cloud.bounds();
        let place = |p: Vec3| self.cloud.origin + p.as_dvec3();
        let bounds = DAabb::new(place(all.min), place(all.max));
        let Self { slab_width, .. } = *self;
        (!all.is_empty()).then_some(SplatBounds { bounds, slab_width, count: self.cloud.len() as u64 })
    }

    /// Whether any asks for light.
    pub(crate) fn are_lit(&self) -> bool {
        let is_lit: Vec<bool> = self.materials.iter().map(|m| m.shading != Shading::Unlit).collect();
        self.cloud.material.iter().any(|m| is_lit[usize::from(*m)])
    }

    /// Whether light that is scattered to surfaces is reflected by any.
    pub(crate) fn have_surfaces(&self) -> bool {
        let is_lit: Vec<bool> = self.materials.iter().map(|m| m.shading == Shading::Phong).collect();
        let mut kinds = self.cloud.kind.iter().zip(&self.cloud.material);
        kinds.any(|(kind, material)| *kind != SplatKind::Medium && is_lit[usize::from(*material)])
    }

    /// The first that is opaque.
    pub(crate) fn opaque(&self) -> Option<usize> {
        self.cloud.kind.iter().position(|kind| *kind == SplatKind::Opaque)
    }

    /// Their footprints in another image.
    pub(crate) fn seen_by(&self, camera: &Camera) -> Projected {
        let Self { cloud, footprints, materials, .. } = *self;
        let params = &Params::default();
        let detail = Detail { depth: false, object: false };
        project(&ProjectInput { cloud, camera, footprints, materials, params, detail })
    }
}

/// The splats of a sweep, and what those of the present slab show.
pub(crate) struct SplatSheets<'a> {
    of: &'a HalfSplats<'a>,
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

/// The lights of a sweep, for splats.
pub(crate) struct Lamps<'a> {
    /// The one that is carried.
    pub(crate) carried: Option<LitBy<'a>>,
    /// Those whose shadows are known.
    pub(crate) mapped: &'a [LitBy<'a>],
    pub(crate) ambient: [f32; 3],
    pub(crate) camera: &'a Camera,
    /// Whether ambient and emitted light belong to another sweep.
    pub(crate) light_alone: bool,
}

impl<'a> SplatSheets<'a> {
    /// Those of a sweep, for what `form` keeps; `opaque` has depths of what hides them from the eye, or nothing.
    pub(crate) fn new(
        of: &'a HalfSplats<'a>,
        frame: &Frame,
        buffer: Option<&LightBuffer>,
        opaque: &[f32],
        form: &Accumulator,
    ) -> Self {
        let place = |p: &Vec3| frame.point(of.cloud.origin + p.as_dvec3()).as_vec3();
        let places: Vec<Vec3> = of.cloud.position.par_iter().map(place).collect();
        let last = frame.slabs.count - 1;
        let slab = |depth: f32| ((depth / frame.slabs.width as f32) as u32).min(last);
        let slabs: Vec<u32> = places.iter().map(|p| slab(p.z)).collect();
        let drawn = BySlab::new(&slabs, frame.slabs.count);
        let planes = form.optical_depth.len();
        let around = |buffer: &LightBuffer| if buffer.soft.is_some() { SOFT_LOOK_UP_PX } else { 1.0 };
        let light = |b: &LightBuffer| SplatLight::new(of, frame, (&b.sight, around(b)), (&places, &drawn.ids), planes);
        Self {
            light: buffer.map(light),
            squares: Squares::new(of.projected, &drawn.ids, opaque, form),
            of,
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
    /// volumes scatter to surfaces. Fragments of both.
    pub(crate) fn enter(
        &mut self,
        slab: u32,
        lamps: &Lamps<'_>,
        (volumes, diffuse): (Option<(&Illumination<'_>, Option<&LightDepths>)>, Option<&SurfaceLight>),
        layout: &ChannelLayout,
    ) -> [u64; 2] {
        let ids = self.drawn.of(slab);
        let mut fragments = 0;
        if let (Some(light), Some((of, depths))) = (&mut self.light, volumes) {
            fragments = light.enter(slab, ids, &self.slabs, &self.places);
            let frame = &self.frame;
            let is_soft = of.buffer.soft.is_some();
            let places = |ids: &[u32]| -> Vec<Vec3> { ids.iter().map(|id| self.places[*id as usize]).collect() };
            if is_soft {
                let asking = light.asking(slab).to_vec();
                let mut found = vec![[0.0; 3]; asking.len()];
                let of = &Illumination { splats: Some(light), ..*of };
                found.par_chunks_mut(CHUNK).zip(asking.par_chunks(CHUNK)).for_each(|(out, ids)| {
                    let places = places(ids);
                    let seen = |of: &LightDepths| -> Vec<f32> {
                        places.iter().flat_map(|p| of.visible(frame.world(p.as_dvec3()), None)).collect()
                    };
                    let visible = &depths.map(seen).unwrap_or_default();
                    pulp::Arch::new().dispatch(Around { of, places: &places, visible, out });
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
                pulp::Arch::new().dispatch(ThroughVolumes { of, frame, places: &places, more: &more, out });
                let Some(depths) = depths else { return };
                for (out, place) in out.iter_mut().zip(&places) {
                    let visible = depths.visibility(frame.world(place.as_dvec3()), None);
                    *out = [0, 1, 2].map(|c| out[c] * visible[c]);
                }
            });
            if is_soft { light.set(ids, &volumes) } else { light.attenuate(ids, &volumes) }
        }
        self.shade(slab, lamps, diffuse, layout);
        [self.draw(slab), fragments]
    }

    /// Takes those of a slab up for the eye, with the values that were found before, if there are any. Fragments.
    pub(crate) fn draw(&mut self, slab: u32) -> u64 {
        let projected = self.of.projected;
        let materials = self.of.materials;
        let values = &self.values[..];
        self.squares.fill(Slab { projected, materials, slabs: &self.slabs, slab, ids: self.drawn.of(slab), values })
    }

    /// Ends a slab.
    pub(crate) fn leave(&mut self) {
        if let Some(light) = &mut self.light {
            light.leave();
        }
    }

    /// Finds the radiance of the splats of a slab.
    fn shade(&mut self, slab: u32, lamps: &Lamps<'_>, diffuse: Option<&SurfaceLight>, layout: &ChannelLayout) {
        let (of, ids, channels) = (self.of, self.drawn.of(slab), layout.count());
        self.values.clear();
        self.values.resize(ids.len() * channels, 0.0);
        let through = self.light.as_ref().map_or(&[][..], SplatLight::through);
        let arrives = lamps.carried.map(|lit| Arrives { through, others: lit.shadow });
        let carried = lamps.carried.zip(arrives.as_ref()).map(|(lit, shadow)| LitBy { shadow: Some(shadow), ..lit });
        let lights: Vec<LitBy<'_>> = carried.into_iter().chain(lamps.mapped.iter().copied()).collect();
        let HalfSplats { cloud, materials, objects, .. } = *of;
        let Lamps { ambient, camera, .. } = *lamps;
        let input = ShadeInput { cloud, materials, objects, lights: &lights, ambient, camera };
        let chunks = self.values.par_chunks_mut(CHUNK * channels).zip(ids.par_chunks(CHUNK));
        chunks.for_each(|(values, ids)| {
            for (id, values) in ids.iter().zip(values.chunks_exact_mut(channels)) {
                let i = *id as usize;
                if !of.projected.is_visible(i) {
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
                    let of = (&materials[usize::from(cloud.material[i])], cloud.color[i]);
                    let own = diffuse.reflected(world, normal.as_dvec3(), of, &lit.light);
                    (0..3).for_each(|c| values[first + c] += own[c]);
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
