//! Shading as a recording: the GPU's twin of [`shade`](super::shade).
//!
//! One thread a splat. What the shadow maps let through ([`received`]) is uploaded, or left there by a recording before.
//!
//! Deviations from the CPU: the direction to a light is found in single precision, from a light whose position is a sum of
//! two f32, so that it keeps its digits near the light; x^m is e^(m ln x) by series, which devices promise less of. A
//! highlight of exponent m multiplies a rounding of its cosine by m, the rim of a cone by the inverse of its width in
//! cosines: values agree within 10⁻⁵ of the largest for what [`suits`] takes.
//!
//! ```
//! use splat_core::raster::gpu::AttributeRoom;
//! use splat_core::shade::{ChannelLayout, gpu::{Capacities, record}};
//!
//! let attributes = AttributeRoom { splats: 1_000_000, frame_words: 3 };
//! let layout = ChannelLayout::default();
//! let recorded = record(Capacities { attributes, materials: 8, lights: 2, shadows: 1, layout });
//! recorded.recording.check().unwrap();
//! // 52 bytes of a splat's attributes and 12 of received light come in, its colour takes 12.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 76);
//! ```

use super::{CHUNK, ChannelLayout, LitBy, ShadeInput, point_of, shadow_share};
use crate::raster::gpu::{AttributeBuffers, AttributeRoom, Attributes};
use crate::scene::light::rect_normal;
use crate::{Error, Light, LightShape, Material, Progress, Shading};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use splat_shaders::layouts::ShadeView;
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

/// Splats that a workgroup shades.
const BLOCK: u32 = 256;
/// Vectors of a material and of a light in the tables.
const MATERIAL_VECTORS: u64 = 3;
const LIGHT_VECTORS: u64 = 4;
/// The largest exponent of a highlight, and the narrowest rim of a cone in cosines.
const MOST_SHININESS: f32 = 64.0;
const LEAST_RIM: f64 = 1.0 / 64.0;

/// What a recording makes room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Splats and their attributes.
    pub attributes: AttributeRoom,
    /// Materials.
    pub materials: u32,
    /// Lights.
    pub lights: u32,
    /// Lights with a shadow map.
    pub shadows: u32,
    /// Channels.
    pub layout: ChannelLayout,
}

impl Capacities {
    /// Room for these splats of the input.
    pub fn for_input(input: &ShadeInput<'_>, attributes: AttributeRoom, layout: ChannelLayout) -> Self {
        let materials = input.materials.len() as u32;
        let lights = input.lights.len() as u32;
        Self { attributes, materials, lights, shadows: shadowed(input.lights).count() as u32, layout }
    }
}

/// The recorded shading and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Input: one [`ShadeView`].
    pub view: BufferId,
    /// Input.
    pub attributes: AttributeBuffers,
    /// Input: materials, then lights.
    pub tables: BufferId,
    /// Input: as [`received`] gives it.
    pub received: BufferId,
    /// Read back: the channels of each splat.
    pub values: BufferId,
}

/// The bytes of what is shaded beside the attributes.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    bytes: [Vec<u8>; 3],
}

/// Records shading with this room.
pub fn record(capacities: Capacities) -> Recorded {
    let Capacities { attributes: room, materials, lights, shadows, layout } = capacities;
    let splats = u64::from(room.splats);
    let mut recording = Recording::default();
    let r = &mut recording;
    let view = r.input("shade view", size_of::<ShadeView>() as u64);
    let attributes = AttributeBuffers::record(r, room);
    let vectors = MATERIAL_VECTORS * u64::from(materials) + LIGHT_VECTORS * u64::from(lights);
    let tables = r.input("shade tables", 16 * vectors);
    let received = r.input("received", 12 * splats * u64::from(shadows));
    let values = r.scratch("values", 4 * splats * layout.count() as u64);
    let [positions, radii, looks, frames] = attributes.buffers();
    let bound = [view, positions, radii, looks, frames, tables, received, values];
    r.dispatch(&kernels::SPLAT_SHADE, Groups::cover(room.splats.div_ceil(BLOCK)), &bound, &[]);
    r.read(values);
    Recorded { recording, capacities, view, attributes, tables, received, values }
}

/// Why the processor shades this better, if it does.
pub fn suits(input: &ShadeInput<'_>) -> Result<(), &'static str> {
    if !input.cloud.gaussians.is_empty() {
        return Err("3D Gaussians are projected and shaded by the processor");
    }
    let sharp = |m: &Material| m.specular > 0.0 && m.shininess > MOST_SHININESS && m.shading == Shading::Phong;
    if input.materials.iter().any(sharp) {
        return Err("highlights of an exponent above 64 are shaded by the processor");
    }
    let narrow = |light: &Light| match light.shape {
        LightShape::Spot { inner, outer, .. } => libm::cos(inner) - libm::cos(outer) < LEAST_RIM,
        _ => false,
    };
    if input.lights.iter().any(|lit| narrow(&lit.light)) {
        return Err("a spot with a sharp rim is shaded by the processor");
    }
    if input.lights.iter().any(|lit| lit.slide.is_some()) {
        return Err("light through a slide is shaded by the processor");
    }
    Ok(())
}

/// Share of each light with a shadow map that each splat receives, per channel: for one light after the other, of the
/// splats `ids` in their order.
///
/// # Errors
/// [`Error::Cancelled`].
///
/// # Panics
/// If an id, or a material or object of the cloud is out of range.
pub fn received(input: &ShadeInput<'_>, ids: &[u32], progress: Option<&Progress>) -> Result<Vec<[f32; 3]>, Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let mut irradiances = Vec::new();
    for lit in shadowed(input.lights) {
        let mut column = vec![[0.0; 3]; ids.len()];
        column.par_chunks_mut(CHUNK).zip(ids.par_chunks(CHUNK)).for_each(|(to, ids)| {
            if progress.is_cancelled() {
                return;
            }
            for (to, &i) in to.iter_mut().zip(ids) {
                let irradiance = point_of(input, i as usize).irradiance(lit).irradiance;
                *to = super::received(input, i as usize, lit.shadow, irradiance);
            }
        });
        irradiances.append(&mut column);
    }
    progress.tick(0)?;
    Ok(irradiances)
}

/// How much of a shadow each of the splats `ids` takes, in \[0, 1\]: one number for all where they are alike.
///
/// # Panics
/// If an id, or an object of the cloud is out of range.
pub fn shadow_shares(input: &ShadeInput<'_>, ids: &[u32]) -> Vec<f32> {
    let share = |&id: &u32| shadow_share(input, id as usize);
    let shares: Vec<f32> = ids.par_iter().with_min_len(1 << 14).map(share).collect();
    match shares.split_first() {
        None => vec![1.0],
        Some((first, others)) if others.iter().all(|share| share == first) => vec![*first],
        Some(_) => shares,
    }
}

fn shadowed<'a>(lights: &'a [LitBy<'a>]) -> impl Iterator<Item = &'a LitBy<'a>> {
    lights.iter().filter(|lit| lit.shadow.is_some())
}

impl Recorded {
    /// The bytes that the recording takes beside the attributes, with `light` as [`received`] gives it.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, [`Error::Invalid`] for ids that the tables do not have,
    /// [`Error::ColumnLength`] for attributes of another room or another number of received lights.
    pub fn uploads(
        &self,
        input: &ShadeInput<'_>,
        attributes: &Attributes,
        light: &[[f32; 3]],
    ) -> Result<Uploads, Error> {
        let splats = attributes.room().splats as usize;
        let expected = shadowed(input.lights).count() * splats;
        if light.len() != expected {
            return Err(Error::ColumnLength { attribute: "received light", found: light.len(), expected });
        }
        self.uploads_of(input, attributes, light)
    }

    /// The same where a recording before this one leaves the received light on the device.
    ///
    /// # Errors
    /// As [`Recorded::uploads`].
    pub fn uploads_beside_light(&self, input: &ShadeInput<'_>, attributes: &Attributes) -> Result<Uploads, Error> {
        self.uploads_of(input, attributes, &[])
    }

    /// The same where attributes are left there too: there may be as many splats as there is room for, and the cloud gives the
    /// origin of their positions alone.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for.
    pub fn uploads_beside_splats(&self, input: &ShadeInput<'_>) -> Result<Uploads, Error> {
        self.uploads_for(input, self.capacities.attributes.splats, &[])
    }

    fn uploads_of(
        &self,
        input: &ShadeInput<'_>,
        attributes: &Attributes,
        light: &[[f32; 3]],
    ) -> Result<Uploads, Error> {
        // Footprints are not read here.
        attributes.check(self.capacities.attributes, input.materials.len(), usize::MAX)?;
        self.uploads_for(input, attributes.room().splats, light)
    }

    fn uploads_for(&self, input: &ShadeInput<'_>, splats: u32, light: &[[f32; 3]]) -> Result<Uploads, Error> {
        let room = self.capacities;
        for (what, needed, had) in [
            ("materials", input.materials.len(), room.materials),
            ("lights", input.lights.len(), room.lights),
            ("shadow maps", shadowed(input.lights).count(), room.shadows),
        ] {
            if needed as u64 > u64::from(had) {
                return Err(Error::Overflow(Overflow { what, needed: needed as u64, had: had.into() }));
            }
        }
        let tables: Vec<[f32; 4]> = input.materials.iter().flat_map(material).chain(lights(input)).collect();
        let view = self.view(input, splats);
        Ok(Uploads {
            bytes: [
                bytemuck::bytes_of(&view).to_vec(),
                bytemuck::cast_slice(&tables).to_vec(),
                bytemuck::cast_slice(light).to_vec(),
            ],
        })
    }

    fn view(&self, input: &ShadeInput<'_>, splats: u32) -> ShadeView {
        let camera = input.camera;
        let layout = self.capacities.layout;
        let parallel = camera.is_orthographic();
        let eye = if parallel { -camera.axes[2] } else { camera.position - input.cloud.origin };
        ShadeView {
            eye: eye.as_vec3().extend(0.0).to_array(),
            ambient: Vec3::from(input.ambient).extend(0.0).to_array(),
            orthographic: parallel.into(),
            splats,
            frame_words: self.capacities.attributes.frame_words,
            materials: input.materials.len() as u32,
            lights: input.lights.len() as u32,
            channels: layout.count() as u32,
            layers: layer_bits(&layout),
            unused: 0,
        }
    }

    /// The uploads with the buffers that they go to; the attributes' are [`Attributes::inputs`].
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 3] {
        let buffers = [self.view, self.tables, self.received];
        std::array::from_fn(|k| (buffers[k], &uploads.bytes[k][..]))
    }
}

/// 1 where effects are apart, + 2 where the normal is a channel, + 4 the shadow.
fn layer_bits(layout: &ChannelLayout) -> u32 {
    let bits = [layout.is_apart(), layout.normal().is_some(), layout.shadow().is_some()];
    (0..).zip(bits).map(|(k, on)| u32::from(on) << k).sum()
}

fn material(m: &Material) -> [[f32; 4]; 3] {
    let shading = match m.shading {
        Shading::Phong => 0.0,
        Shading::Phase => 1.0,
        Shading::Unlit => 2.0,
    };
    [
        [shading, m.ambient, m.diffuse, m.specular],
        [m.shininess, m.transmission, m.single_scattering_albedo, m.asymmetry],
        [m.emission[0], m.emission[1], m.emission[2], 0.0],
    ]
}

/// The vectors of all lights, relative to the cloud's origin; one with an extent is what [`Light::irradiance`] takes it for.
fn lights(input: &ShadeInput<'_>) -> impl Iterator<Item = [f32; 4]> {
    let origin = input.cloud.origin;
    let mut slots = 0u32;
    input.lights.iter().flat_map(move |lit| {
        let (kind, position, direction, low, high) = match lit.light.shape {
            LightShape::Point { position } | LightShape::Sphere { center: position, .. } => {
                (0.0, position, DVec3::ZERO, 0.0, 0.0)
            }
            LightShape::Directional { direction } => (1.0, origin, direction, 0.0, 0.0),
            LightShape::Spot { position, direction, inner, outer } => {
                (2.0, position, direction, libm::cos(outer) as f32, libm::cos(inner) as f32)
            }
            LightShape::Patch { position, normal } | LightShape::Disk { center: position, normal, .. } => {
                (3.0, position, normal, 0.0, 0.0)
            }
            LightShape::Rect { center, u, v } => (3.0, center, rect_normal(u, v), 0.0, 0.0),
        };
        let slot = if lit.shadow.is_some() { slots as f32 } else { -1.0 };
        slots += u32::from(lit.shadow.is_some());
        let offset = position - origin;
        let coarse = offset.as_vec3();
        let fine = (offset - coarse.as_dvec3()).as_vec3();
        let [r, g, b] = lit.light.intensity;
        let direction = direction.as_vec3().extend(slot);
        [[r, g, b, kind], coarse.extend(low).to_array(), fine.extend(high).to_array(), direction.to_array()]
    })
}
