//! Light of one sweep on polygons, opaque and translucent ones, slab by slab (steps 7, 22 and 25 of the pseudocode, Table 1).
//!
//! Before the first slab there is nothing but polygons between a place and the light; among the slabs what lies before the present one is known
//! by the light buffer, and its own slab counts as far as light has come in it; behind the last slab all of them count. A polygon
//! that lies on the face of a slab belongs to the slab behind it, for the eye as for the light.

use super::light_depth::LightDepths;
use super::surfaces::{EyePolygons, Seen, Surfaces};
use crate::half_vector::lamps::{LampList, Lamps};
use crate::half_vector::light::illuminate::{Around, Illumination, ThroughVolumes};
use crate::half_vector::scatter::surface::{Facet, SurfaceLight};
use crate::half_vector::slicing::by_slab::BySlab;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::slab_place::SlabPlace;
use crate::shared::depths::DepthRange;
use rayon::prelude::*;
use splat_core::Camera;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::{OpaqueImage, pulp};
use splat_core::shade::{ChannelLayout, LitBy, MAX_CHANNELS, Point, Radiance, arriving};

/// Pixels of one task.
const CHUNK: usize = 256;

/// What of a light reaches the places on polygons that pixels show.
pub(crate) struct PolygonLight<'a> {
    surfaces: &'a Surfaces<'a>,
    camera: &'a Camera,
    depths: Option<&'a LightDepths>,
    /// By place: share by channel; all of it before the sweep comes to it.
    through: Vec<[f32; 3]>,
}

/// The places on polygons that pixels show by the slab that they lie in.
pub(crate) struct PolygonSlabs {
    /// Slab coordinates.
    pub(crate) places: Vec<Vec3>,
    /// Those behind the last slab are in one more.
    by_slab: BySlab,
    /// Slabs.
    count: u32,
    /// Places before the first body, among them, and behind the last.
    pub(crate) regions: [u64; 3],
}

impl PolygonSlabs {
    pub(crate) fn new(surfaces: &Surfaces<'_>, frame: &Frame, camera: &Camera, bodies: DepthRange) -> Self {
        let place = |world: DVec3| frame.point(world).as_vec3();
        let places: Vec<Vec3> = surfaces.places(camera).into_par_iter().map(place).collect();
        let count = frame.slabs.count;
        let width = frame.slabs.width as f32;
        let slabs: Vec<u32> = places.iter().map(|p| ((p.z / width) as u32).min(count)).collect();
        let mut regions = [0; 3];
        places
            .iter()
            .for_each(|p| regions[if p.z < bodies.near { 0 } else { usize::from(p.z >= bodies.far) + 1 }] += 1);
        Self { places, by_slab: BySlab::new(&slabs, count + 1), count, regions }
    }

    /// Ranks of the places in a slab, or of those behind the last.
    pub(crate) fn ranks(&self, place: SlabPlace) -> &[u32] {
        match place {
            SlabPlace::Slab(slab) => self.by_slab.in_slab(slab),
            SlabPlace::Behind => self.by_slab.in_slab(self.count),
        }
    }

    /// Bytes of the lists.
    pub(crate) fn bytes(&self) -> u64 {
        16 * self.places.len() as u64
    }
}

impl<'a> PolygonLight<'a> {
    /// Light that comes to all of them, but for polygons in its way.
    pub(crate) fn new(surfaces: &'a Surfaces<'a>, camera: &'a Camera, depths: Option<&'a LightDepths>) -> Self {
        let mut through = vec![[1.0; 3]; surfaces.count()];
        if let Some(depths) = depths {
            through.par_iter_mut().enumerate().for_each(|(rank, through)| {
                let Seen { world, face, .. } = surfaces.seen(rank, camera);
                *through = depths.visibility(world, Some(face));
            });
        }
        Self { surfaces, camera, depths, through }
    }

    /// Takes up the polygons of a slab, or those behind the last, behind the volumes and the splats before them, as `light` has them.
    pub(crate) fn enter(&mut self, slabs: &PolygonSlabs, place: SlabPlace, frame: &Frame, light: &Illumination<'_>) {
        let ranks = slabs.ranks(place);
        let first = place.index(&frame.slabs) as f32;
        let splats = light.splats;
        let mut found = vec![[1.0; 3]; ranks.len()];
        found.par_chunks_mut(CHUNK).zip(ranks.par_chunks(CHUNK)).for_each(|(out, ranks)| {
            let places: Vec<Vec3> = ranks.iter().map(|rank| slabs.places[*rank as usize]).collect();
            let depth = |place: &Vec3| place.z / frame.slabs.width as f32 - first;
            let mut more = Vec::new();
            if light.buffer.soft.is_some() {
                let visible = &self.visible(ranks);
                more.resize(places.len(), [0.0; 3]);
                let work = Around { light, places: &places, visible, out: &mut more };
                pulp::Arch::new().dispatch(work);
                for (more, place) in more.iter_mut().zip(&places) {
                    let of_splats = splats.map(|splats| splats.optical_depth(*place, depth(place)));
                    (0..3).for_each(|p| more[p] += of_splats.map_or(0.0, |tau| tau[p][1]));
                }
            }
            pulp::Arch::new().dispatch(ThroughVolumes { light, frame, places: &places, more: &more, out });
            let Some(splats) = splats.filter(|_| more.is_empty()) else {
                return;
            };
            for (out, place) in out.iter_mut().zip(&places) {
                let of_splats = splats.transmittance_at(*place, depth(place));
                (0..3).for_each(|c| out[c] *= of_splats[c]);
            }
        });
        for (rank, found) in ranks.iter().zip(found) {
            let through = &mut self.through[*rank as usize];
            (0..3).for_each(|c| through[c] *= found[c]);
        }
    }

    /// What polygons let through of each point of the light, pixel by pixel; empty without any in the way.
    fn visible(&self, ranks: &[u32]) -> Vec<f32> {
        let Some(depths) = self.depths else {
            return Vec::new();
        };
        let by_point = |rank: &u32| {
            let Seen { world, face, .. } = self.surfaces.seen(*rank as usize, self.camera);
            depths.visible(world, Some(face))
        };
        ranks.iter().flat_map(by_point).collect()
    }

    /// Adds what polygons show of the lights of the sweep.
    pub(crate) fn shade(&self, lamps: &Lamps<'_>, diffuse: Option<&SurfaceLight>, image: &mut PolygonImage) {
        let listed = &lamps.listed();
        let layout = image.layout;
        let channels = layout.count();
        let chunks = image.values.par_chunks_mut(CHUNK * channels).zip(image.received.par_chunks_mut(CHUNK));
        chunks.enumerate().for_each(|(chunk, (values, received))| {
            for (k, (values, received)) in values.chunks_exact_mut(channels).zip(received).enumerate() {
                let rank = chunk * CHUNK + k;
                let seen = self.surfaces.seen(rank, self.camera);
                self.add(&seen, rank, listed, &layout, values, received);
                add_diffuse(diffuse, &lamps.carried, &seen, &layout, values);
            }
        });
    }

    /// Adds what one pixel shows, and green light that it receives of how much.
    fn add(
        &self,
        seen: &Seen<'_>,
        rank: usize,
        listed: &LampList<'_>,
        layout: &ChannelLayout,
        values: &mut [f32],
        received: &mut Received,
    ) {
        let (point, radiance) = self.radiance(seen, rank, listed);
        if seen.polygons.is_lit() {
            let whole: f32 = listed.lights.iter().map(|lit| point.irradiance(lit).irradiance[1]).sum();
            received.shadowed += radiance.shadow * whole;
            received.whole += whole;
        }
        let mut shown = [0.0; MAX_CHANNELS];
        radiance.write(point.normal, layout, &mut shown);
        let colors = layout.colors();
        (0..colors).for_each(|c| values[c] += shown[c]);
        // The normal is the same under all lights, and the shadow is found at the end.
        values[colors..].copy_from_slice(&shown[colors..layout.count()]);
    }

    /// What one place shows of the lights of the sweep, the carried one first.
    pub(crate) fn radiance<'s>(&self, seen: &Seen<'s>, rank: usize, listed: &LampList<'_>) -> (Point<'s>, Radiance) {
        let LampList { lamps, lights } = listed;
        let point = seen.point();
        let is_carried = lamps.carried.is_some();
        let mut radiance = point.radiance(lamps.ambient, lights.iter(), |light, irradiance| {
            let carried = if is_carried && light == 0 { self.through[rank] } else { [1.0; 3] };
            let shadow = || {
                let others =
                    lights[light].shadow.map(|shadow| shadow.transmittance(&seen.receiver(lamps.shadow_origin)));
                [0, 1, 2].map(|c| carried[c] * others.map_or(1.0, |others| others[c]))
            };
            arriving(irradiance, seen.polygons.shadow_coefficient, Some(shadow))
        });
        if lamps.light_alone {
            (radiance.ambient, radiance.emission) = ([0.0; 3], [0.0; 3]);
        }
        (point, radiance)
    }
}

/// Adds what a place shows of light that is scattered to surfaces.
pub(crate) fn add_diffuse(
    diffuse: Option<&SurfaceLight>,
    carried: &Option<LitBy<'_>>,
    seen: &Seen<'_>,
    layout: &ChannelLayout,
    values: &mut [f32],
) {
    if let (Some(diffuse), Some(lit), Some(first)) = (diffuse, carried, layout.multiple()) {
        let point = seen.point();
        let facet = Facet { material: seen.polygons.material, color: point.color };
        let shown = diffuse.reflected(seen.world, point.normal.as_dvec3(), &facet, &lit.light);
        (0..3).for_each(|c| values[first + c] += shown[c]);
    }
}

/// What polygons show, of all lights so far.
pub(crate) struct PolygonImage {
    layout: ChannelLayout,
    /// Channels of each pixel that shows a polygon, one pixel after the other.
    values: Vec<f32>,
    received: Vec<Received>,
}

/// Green light that a pixel receives.
#[derive(Clone, Copy, Default)]
struct Received {
    shadowed: f32,
    /// What it would be without shadows.
    whole: f32,
}

impl PolygonImage {
    pub(crate) fn new(polygons: &EyePolygons<'_>, layout: &ChannelLayout) -> Self {
        let pixels = polygons.seen.count();
        Self {
            layout: *layout,
            values: vec![0.0; pixels * layout.count()],
            received: vec![Received::default(); pixels],
        }
    }

    /// Adds a share of another one.
    pub(crate) fn add(&mut self, other: &Self, share: f32) {
        self.values.iter_mut().zip(&other.values).for_each(|(to, value)| *to += share * value);
        for (to, from) in self.received.iter_mut().zip(&other.received) {
            to.shadowed += share * from.shadowed;
            to.whole += share * from.whole;
        }
    }

    /// Bytes of the sums.
    pub(crate) fn bytes(&self) -> u64 {
        4 * (self.values.len() + 2 * self.received.len()) as u64
    }

    /// The picture, with objects where these are kept.
    pub(crate) fn finish(self, polygons: &EyePolygons<'_>, keeps: bool) -> OpaqueImage {
        let pixels = polygons.opaque.len();
        let channels = self.layout.count();
        let mut image = OpaqueImage {
            depth: vec![f32::INFINITY; pixels],
            channels: vec![vec![0.0; pixels]; channels],
            object: if keeps { vec![u32::MAX; pixels] } else { Vec::new() },
        };
        for rank in 0..polygons.seen.count() {
            let k = polygons.seen.pixel(rank) as usize;
            image.depth[k] = polygons.seen.depth(rank);
            (0..channels).for_each(|c| image.channels[c][k] = self.values[rank * channels + c]);
            if let Some(shadow) = self.layout.shadow() {
                let Received { shadowed, whole } = self.received[rank];
                image.channels[shadow][k] = if whole > 0.0 { shadowed / whole } else { 1.0 };
            }
            if keeps {
                image.object[k] = polygons.seen.polygons(rank).object;
            }
        }
        image
    }
}
