//! Light on visible particles: they are shaded as splats are (`splat_core::shade::gpu`), with the look-ups of each shadow map.
//!
//! A level first finds the visible particles, as without light. They alone are listed, one a pixel, in the layout of splats. The
//! list goes through the recorded look-ups of each shadow map and through shading, with as many workgroups as it needs. The
//! radiance is added at their pixels, so the order of the list changes nothing. Large images are divided into parts, which bounds
//! the memory of a level.
//!
//! Places are those of the CPU: within a pixel in steps of 1/256, relative to the eye and in the world's axes, so that a scene
//! far from its origin keeps its digits.
//!
//! Deviations from the CPU: a particle that covers several pixels has a place in each that is drawn anew. Radiances agree
//! within the tolerances of shading and look-ups.

use super::{BLOCK, Capacities, Inputs};
use crate::{Ensemble, EnsembleParams, Error, Scene};
use splat_core::raster::gpu::{AttributeBuffers, AttributeRoom};
use splat_core::shade::{ShadeInput, gpu as shading};
use splat_core::{Cloud, Material};
use splat_shaders::{BufferId, Groups, Joined, Recording, kernels};
use std::borrow::Cow;

/// Most pixels of a part, whole workgroups of them.
const AT_ONCE: u32 = 1 << 20;
/// Words of what is found of a part, of which the last three are the size of a dispatch.
const FOUND_WORDS: u64 = 4;
/// Words of one that is seen.
const SEEN_WORDS: u64 = 3;
/// Most objects: each is a material of the shading's tables.
const MOST_OBJECTS: usize = 1 << 16;

/// Capacities of a recording that lights visible particles.
#[derive(Debug, Clone, Copy)]
pub struct Lighting<'a> {
    /// The layers of a hit; without depths, objects and extinction by channel.
    pub params: EnsembleParams,
    /// Lights.
    pub lights: u32,
    /// Of each light with a shadow map, in their order, what says how much of it arrives.
    pub shadows: &'a [ShadowOf<'a>],
}

/// The recorded look-ups of one light: from splats, of which there is room for [`Capacities::seen`], to what they receive.
#[derive(Debug, Clone, Copy)]
pub struct ShadowOf<'a> {
    /// Its dispatches are over the splats, each.
    pub recording: &'a Recording,
    /// Input: splats, relative to the eye.
    pub attributes: &'a AttributeBuffers,
    /// Input: how much of a shadow each takes, f32.
    pub shares: BufferId,
    /// The received light of all splats, behind that of the lights before, as [`splat_core::shade::gpu`] reads it.
    pub received: BufferId,
}

/// Where the light of a recording lies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lit {
    pub(super) params: EnsembleParams,
    shade: shading::Recorded,
    in_shade: Joined,
    pub(super) shadows: Vec<Joined>,
    found: BufferId,
    /// Parts of all levels.
    parts: u64,
    lights: u32,
}

impl Capacities {
    /// The capacity of splats that are lit at once.
    pub fn seen(&self) -> AttributeRoom {
        AttributeRoom { splats: self.pixels().min(AT_ONCE), frame_words: 3 }
    }
}

/// Why the processor lights the particles of a scene better, if it does.
pub fn suits(scene: &Scene<'_>) -> Result<(), &'static str> {
    if scene.objects.len() > MOST_OBJECTS {
        return Err("particles of more than 65536 objects are lit by the processor");
    }
    with_input(scene, shading::suits)
}

/// The scene as shading sees it: each object a material, positions relative to the eye.
fn with_input<T>(scene: &Scene<'_>, work: impl FnOnce(&ShadeInput<'_>) -> T) -> T {
    let cloud = Cloud::new(scene.camera.position);
    let materials: Vec<Material> = scene.objects.iter().map(|o| o.look.material).collect();
    work(&ShadeInput {
        cloud: &cloud,
        materials: &materials,
        objects: &[],
        lights: scene.lights,
        ambient: scene.ambient,
        camera: scene.camera,
    })
}

/// Buffers in which a level has found its visible particles, if light is requested.
pub(super) enum Winners {
    /// Limits, nearest depths, ranks.
    Ranked([BufferId; 3]),
    /// Limits, and both in one number.
    Wide([BufferId; 2]),
}

/// The buffers of those that are seen.
pub(super) struct Seen {
    at_once: u32,
    pixels: u32,
    parts: u32,
    found: BufferId,
    seen: BufferId,
    attributes: AttributeBuffers,
    shares: BufferId,
}

impl Seen {
    pub(super) fn record(r: &mut Recording, capacities: &Capacities) -> Self {
        let room = capacities.seen();
        let pixels = capacities.pixels();
        let parts = pixels.div_ceil(room.splats);
        let words = |each: u64| 4 * each * u64::from(room.splats);
        let all_parts = u64::from(parts) * u64::from(capacities.levels);
        Self {
            at_once: room.splats,
            pixels,
            parts,
            found: r.input("found", 4 * FOUND_WORDS * all_parts),
            seen: r.scratch("seen", words(SEEN_WORDS)),
            attributes: AttributeBuffers {
                positions: r.scratch("positions", words(3)),
                radii: r.scratch("radii", words(2)),
                looks: r.scratch("looks", words(5)),
                frames: r.scratch("frames", words(room.frame_words.into())),
            },
            shares: r.scratch("shares", words(1)),
        }
    }
}

impl Lit {
    /// Adds the buffers of shadows and shading.
    pub(super) fn record(
        r: &mut Recording,
        capacities: &Capacities,
        lighting: &Lighting<'_>,
        seen: &Seen,
    ) -> Result<Self, Error> {
        let params = lighting.params;
        crate::error::check(params.only_numbers(), "ensemble", params, "light, normal and shadow alone")?;
        let mut shadows: Vec<Joined> = Vec::new();
        for shadow in lighting.shadows {
            let first = lighting.shadows.first().zip(shadows.first());
            let received = first.map(|(first, joined)| (shadow.received, joined.buffer(first.received)));
            let shared = shadow.attributes.shared(&seen.attributes).into_iter();
            let shared: Vec<_> = shared.chain([(shadow.shares, seen.shares)]).chain(received).collect();
            shadows.push(r.join_uploads(shadow.recording, &shared));
        }
        let shade = shading::record(shading::Capacities {
            attributes: capacities.seen(),
            materials: capacities.objects,
            lights: lighting.lights,
            shadows: lighting.shadows.len() as u32,
            layout: params.layout(),
        });
        let first = lighting.shadows.first().zip(shadows.first());
        let received = first.map(|(first, joined)| (shade.received, joined.buffer(first.received)));
        let shared: Vec<_> = shade.attributes.shared(&seen.attributes).into_iter().chain(received).collect();
        let in_shade = r.join_uploads(&shade.recording, &shared);
        let parts = u64::from(seen.parts) * u64::from(capacities.levels);
        Ok(Self { params, shade, in_shade, shadows, found: seen.found, parts, lights: lighting.lights })
    }

    /// Lights who is seen in a level, and adds it to the sums.
    pub(super) fn record_level(
        &self,
        r: &mut Recording,
        lighting: &Lighting<'_>,
        view: BufferId,
        objects: BufferId,
        sets: BufferId,
        particles: BufferId,
        sums: BufferId,
        seen: &Seen,
        winners: &Winners,
        level: u32,
    ) {
        let found = seen.found;
        let listed = seen.seen;
        let shares = seen.shares;
        let [positions, radii, looks, frames] = seen.attributes.buffers();
        for part in 0..seen.parts {
            let first = part * seen.at_once;
            let at = level * seen.parts + part;
            let pixels = Groups::cover((seen.pixels - first).min(seen.at_once).div_ceil(BLOCK));
            let push = [level, first, at];
            match *winners {
                Winners::Ranked([limits, nearest, winners]) => {
                    let see = [view, sets, limits, nearest, winners, found, listed];
                    r.dispatch(&kernels::PBSR_SEE, pixels, &see, &push);
                }
                Winners::Wide([limits, keys]) => {
                    r.dispatch(&kernels::PBSR_SEE_WIDE, pixels, &[view, sets, limits, keys, found, listed], &push);
                }
            }
            let each = Groups::Indirect { buffer: found, offset: 4 * (FOUND_WORDS * u64::from(at) + 1) };
            let place = [view, objects, particles, found, listed, positions, frames];
            r.dispatch(&kernels::PBSR_PLACE, each, &place, &[at]);
            let look = [objects, particles, found, listed, radii, looks, shares];
            r.dispatch(&kernels::PBSR_LOOK, each, &look, &[at]);
            for (shadow, joined) in lighting.shadows.iter().zip(&self.shadows) {
                r.join_dispatches(shadow.recording, joined, each);
            }
            r.join_dispatches(&self.shade.recording, &self.in_shade, each);
            let values = self.in_shade.buffer(self.shade.values);
            r.dispatch(&kernels::PBSR_SUM, each, &[view, found, listed, values, sums], &[at]);
        }
    }

    /// Inputs that do not change from run to run.
    pub(super) fn tables(&self, scene: &Scene<'_>) -> Result<Inputs<'static>, Error> {
        suits(scene).map_err(|why| Error::parameter("scene", why, "one that a device lights"))?;
        let lights = scene.lights.len();
        crate::error::check(lights == self.lights as usize, "lights", lights, "those of the recording")?;
        let shadows = scene.lights.iter().filter(|l| l.shadow.is_some()).count();
        crate::error::check(shadows == self.shadows.len(), "shadow maps", shadows, "those of the recording")?;
        let uploads = with_input(scene, |input| self.shade.uploads_beside_splats(input))?;
        let of_shade = self.shade.inputs(&uploads).into_iter().filter(|(_, bytes)| !bytes.is_empty());
        let inputs = self.in_shade.inputs(of_shade).map(|(buffer, bytes)| (buffer, Cow::Owned(bytes.to_vec())));
        Ok(inputs.collect())
    }

    /// Initial counts of each run: no visible particle yet, and one workgroup down and deep for those to come.
    pub(super) fn nobody(&self) -> (BufferId, Vec<u8>) {
        (self.found, bytemuck::cast_slice(&[[0u32, 0, 1, 1]].repeat(self.parts as usize)).to_vec())
    }

    /// Whether what comes out can be added to an ensemble.
    pub(super) fn check(&self, ensemble: &Ensemble) -> Result<(), Error> {
        crate::error::check(ensemble.params == self.params, "ensemble", ensemble.params, "what the recording keeps")
    }
}
