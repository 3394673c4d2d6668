//! Opaque splats resolved, by both.

use super::{Agreement, Found, SIZE, composite::numbers};
use crate::Failure;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::resolve::record;
use splat_core::raster::{self, Detail, OpaqueImage, Params, ProjectInput, Projected, project_into, resolve_opaque};
use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, SplatKind, rng};
use splat_shaders::Executor;

/// Discs.
const SPLATS: u32 = 1 << 13;
const SEED: u64 = 0x4f50_4151;
/// Pairs of a disc and a tile, more than there are.
const ENTRIES: u32 = 1 << 18;
/// Share of the pixels of which none of the fragments lies within rounding of an edge.
const LEAST_SHARE: f64 = 0.999;

/// Generated discs with a colour each.
pub(super) struct OpaqueInput {
    projected: Projected,
    ids: Vec<u32>,
    values: Vec<f32>,
}

impl OpaqueInput {
    pub(super) fn new() -> Self {
        let number = |i: u64, k| rng::unit_f32(SEED, 0, i, k);
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..u64::from(SPLATS) {
            let position = [3.2 * number(i, 0) - 1.6, 2.0 * number(i, 1) - 1.0, 2.0 * number(i, 2) - 1.0].into();
            let normal = Vec3::new(number(i, 3) - 0.5, number(i, 4) - 0.5, number(i, 5)).normalize_or(Vec3::Z);
            let radius = 0.02 + 0.1 * number(i, 6);
            let kind = SplatKind::Opaque;
            let cross_section = 0.17 * radius * radius;
            cloud.push(&Splat { position, normal, radius, cross_section, kind, ..Splat::default() });
        }
        let eye = DVec3::Z * 4.0;
        let view = Projection::Perspective { fov_y: 0.5 };
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, view, SIZE).expect("invariant: a view of its target");
        let footprints = FootprintStack::default();
        let materials = [Material::default()];
        let mut projected = Projected::default();
        project_into(
            &mut projected,
            &ProjectInput {
                cloud: &cloud,
                camera: &camera,
                footprints: &footprints,
                materials: &materials,
                params: &Params::default(),
                detail: Detail::ALL,
            },
        );
        let values = (0..3 * u64::from(SPLATS)).map(|i| number(i, 7)).collect();
        Self { projected, ids: (0..SPLATS).collect(), values }
    }

    pub(super) fn check(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let Self { projected, ids, values } = self;
        let input = raster::OpaqueInput { projected, ids, values, channels: 3, objects: false };
        let (expected, _) = resolve_opaque(&input, None)?;
        let recorded = record(input.capacities(ENTRIES))?;
        let uploads = recorded.uploads(&input)?;
        let run = device.run(&recorded.recording, &recorded.inputs(&uploads))?;
        let (found, _) = recorded.finish([recorded.state, recorded.image].map(|buffer| run.bytes(buffer)))?;
        let channels = |image: &OpaqueImage| image.channels.concat();
        Ok(Found {
            items: SPLATS.into(),
            agreement: agreement(&channels(&found), &channels(&expected)),
            passes: run.passes,
        })
    }
}

fn agreement(found: &[f32], expected: &[f32]) -> Agreement {
    let near = found.iter().zip(expected).filter(|(a, b)| (*a - *b).abs() <= 1e-5).count();
    let within = found.len() == expected.len() && near as f64 >= LEAST_SHARE * expected.len() as f64;
    Agreement { within, ..numbers(found, expected, "radiance") }
}
