//! Splats projected, shaded, and from their attributes to the picture, by both.

use super::composite::{accumulators, numbers};
use super::{Failure, Found, SIZE};
use crate::chain::{Splats, chain_on};
use hbsort::{Scratch, slice_cloud};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::{Attributes, project, words};
use splat_core::raster::{self, Detail, OpaqueImage, Params, ProjectInput, Projected};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, gpu as shade};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, FootprintStack, Light, LightShape, Material, Object, Progress, Projection,
    Receiver, Splat, SplatKind, Transmittance, rng,
};
use splat_shaders::{BufferId, Executor};

/// Splats that are looked at.
const SPLATS: u32 = 1 << 14;
/// The key of their random numbers.
const SEED: u64 = 0x4348_4149;

/// Generated splats of a medium and of surfaces, lit by two lights.
pub(super) struct ChainInput {
    cloud: Cloud,
    camera: Camera,
    materials: [Material; 2],
    objects: [Object; 1],
    lights: [Light; 2],
    footprints: FootprintStack,
    projected: Projected,
}

/// Light that a place lets through.
struct Veil;

impl Transmittance for Veil {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        [0.5 + 0.25 * receiver.position.x.clamp(-1.0, 1.0), 0.5, 0.9]
    }
}

impl ChainInput {
    pub(super) fn new() -> Self {
        let number = |i: u32, k| rng::unit_f32(SEED, 0, i.into(), k);
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..SPLATS {
            let n = |k| 2.0 * number(i, k) - 1.0;
            let radius = 0.01 + 0.1 * number(i, 3) * number(i, 4);
            let surface = i % 2 == 1;
            let normal = Vec3::new(n(5), n(6), n(7)).normalize_or(Vec3::Z);
            cloud.push(&Splat {
                position: Vec3::new(2.0 * n(0), 1.2 * n(1), n(2)),
                normal: if surface { normal } else { Vec3::ZERO },
                radius,
                cross_section: 0.3 * radius * radius * number(i, 8),
                color: [number(i, 9), 0.7, number(i, 10)],
                kind: if surface { SplatKind::Surface } else { SplatKind::Medium },
                material: (i % 2) as u16,
                ..Splat::default()
            });
        }
        let eye = DVec3::new(0.3, 0.2, 4.0);
        let view = Projection::Perspective { fov_y: 0.5 };
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, view, SIZE).expect("invariant: a view of its target");
        let glossy = Material { specular: 0.05, transmission: 0.2, ..Material::default() };
        let materials = [Material { asymmetry: 0.5, ..Material::default() }, glossy];
        let light = |shape, intensity| Light { shape, intensity };
        let direction = DVec3::new(0.6, -0.8, 0.0);
        let lights = [
            light(LightShape::Point { position: DVec3::new(1.0, 2.0, 2.0) }, [2.0; 3]),
            light(LightShape::Directional { direction }, [0.5, 0.4, 0.3]),
        ];
        let footprints = FootprintStack::default();
        let params = Params::default();
        let projected = raster::project(&ProjectInput {
            cloud: &cloud,
            camera: &camera,
            footprints: &footprints,
            materials: &materials,
            params: &params,
            detail: Detail::ALL,
        });
        let objects = [Object { shadow_coefficient: 0.8, ..Object::default() }];
        Self { cloud, camera, materials, objects, lights, footprints, projected }
    }

    /// Passes the inputs of shading to `work`.
    fn lit<T>(&self, work: impl FnOnce(&ShadeInput<'_>) -> T) -> T {
        let veil: Option<&dyn Transmittance> = Some(&Veil);
        let lit = [(self.lights[0], veil), (self.lights[1], None)].map(|(light, shadow)| LitBy {
            slide: None,
            light,
            shadow,
        });
        let cloud = &self.cloud;
        let materials = &self.materials[..];
        let objects = &self.objects[..];
        work(&ShadeInput { cloud, materials, objects, lights: &lit, ambient: [0.05; 3], camera: &self.camera })
    }

    pub(super) fn check_project(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let attributes = Attributes::new(&self.cloud, None)?;
        let footprints = &self.footprints;
        let materials = &self.materials[..];
        let params = &Params::default();
        let recorded = project::record(project::Capacities {
            attributes: attributes.room(),
            footprints: footprints.layers().len() as u32,
            materials: materials.len() as u32,
            depth: false,
        })?;
        let origin = self.cloud.origin;
        let camera = &self.camera;
        let uploads =
            recorded.uploads(&project::Input { origin, camera, footprints, materials, params }, &attributes)?;
        let mut inputs: Vec<(BufferId, &[u8])> = recorded.inputs(&uploads).to_vec();
        inputs.extend(attributes.inputs(&recorded.attributes));
        let run = device.run(&recorded.recording, &inputs)?;
        let twin: Vec<f32> = words(&self.projected, false).into_iter().map(f32::from_bits).collect();
        let mut found = shares(&floats(run.bytes(recorded.splats)), &twin);
        let expected = shares(&twin, &twin);
        // What no pixel shows has no footprint.
        let hidden = |k: usize| expected[k / 8 * 8 + 5] == 0.0;
        found.iter_mut().enumerate().filter(|(k, _)| hidden(*k) && k % 8 != 5).for_each(|(_, v)| *v = 0.0);
        let mut agreement = numbers(&found, &expected, "of itself");
        agreement.within &= project::visible(run.bytes(recorded.state))? == self.projected.visible();
        Ok(Found { items: SPLATS.into(), agreement, passes: run.passes })
    }

    pub(super) fn check_shade(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let attributes = Attributes::new(&self.cloud, None)?;
        let layout = ChannelLayout::default();
        let ids: Vec<u32> = (0..SPLATS).collect();
        self.lit(|input| {
            let recorded = shade::record(shade::Capacities::for_input(input, attributes.room(), layout));
            let uploads = recorded.uploads(input, &attributes, &shade::received(input, &ids, None)?)?;
            let mut inputs: Vec<(BufferId, &[u8])> = recorded.inputs(&uploads).to_vec();
            inputs.extend(attributes.inputs(&recorded.attributes));
            let run = device.run(&recorded.recording, &inputs)?;
            let expected = splat_core::shade::shade(input, &self.projected, &layout, None)?;
            let mut found = floats(run.bytes(recorded.values));
            // The processor shades what a pixel shows.
            found.iter_mut().enumerate().filter(|(k, _)| !self.projected.is_visible(k / 3)).for_each(|(_, v)| *v = 0.0);
            Ok(Found { items: SPLATS.into(), agreement: numbers(&found, &expected, "radiance"), passes: run.passes })
        })
    }

    pub(super) fn check_chain(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let ids: Vec<u32> = (0..SPLATS).collect();
        let progress = Progress::new();
        let layout = ChannelLayout::default();
        let raster = Params::default();
        let opaque = OpaqueImage::default();
        let direction = Direction::FrontToBack;
        let sort = hbsort::Params { direction, exact: true, margin_px: 2.0, ..hbsort::Params::default() };
        let mut expected = Accumulator::new(SIZE, 1, layout.count(), false, false);
        let mut found = expected.clone();
        self.lit(|input| {
            let values = splat_core::shade::shade(input, &self.projected, &layout, None)?;
            let order = slice_cloud(&self.cloud, Some(&ids), &self.camera, &sort, &mut Scratch::new())?;
            let folded = raster::FoldInput {
                projected: &self.projected,
                order: &order.input_from_sorted,
                values: &values,
                materials: &self.materials,
                opaque: &opaque,
                direction,
                params: &raster,
            };
            raster::fold(&folded, &mut expected, None)?;
            let splats = Splats {
                input,
                ids: &ids,
                solid: &[],
                footprints: &self.footprints,
                layout,
                sort: &sort,
                raster: &raster,
                opaque: &opaque,
                castings: &[],
                progress: &progress,
            };
            let chained = chain_on(device, &splats, &mut found)?.map_err(|reason| Failure::Left(reason.words()))?;
            let mut agreement = accumulators(&found, &expected);
            agreement.within &= chained.visible == self.projected.visible();
            Ok(Found { items: SPLATS.into(), agreement, passes: chained.passes })
        })
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|w| f32::from_ne_bytes(*w)).collect()
}

/// The numbers of footprints, 8 words each, as shares of the largest of their kind in `twin`, centres of the image's
/// width. Words that are no numbers count as 0.
fn shares(words: &[f32], twin: &[f32]) -> Vec<f32> {
    let mut shares = vec![0.0; words.len()];
    for ((to, from), twin) in shares.chunks_exact_mut(8).zip(words.chunks_exact(8)).zip(twin.chunks_exact(8)) {
        for kind in [0..2, 2..5, 5..6] {
            let largest = twin[kind.clone()].iter().fold(f32::MIN_POSITIVE, |most, v| most.max(v.abs()));
            let scale = if kind.start == 0 { SIZE[0] as f32 } else { largest };
            to[kind.clone()].iter_mut().zip(&from[kind]).for_each(|(to, v)| *to = v / scale);
        }
    }
    shares
}
