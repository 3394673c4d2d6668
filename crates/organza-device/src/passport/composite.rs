//! Ordered splats of a medium composited by both.

use super::{Agreement, Failure, Found, SIZE};
use splat_core::glam::DVec3;
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::record;
use splat_core::raster::{Detail, OpaqueImage, Params, ProjectInput, fold, project};
use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat, SplatKind, rng};
use splat_shaders::Executor;

/// Splats that are composited.
const SPLATS: u32 = 1 << 14;
/// Pairs of a splat and a tile, more than there are.
const ENTRIES: u32 = 1 << 19;
/// The key of their random numbers.
const SEED: u64 = 0x434f_4d50;
/// Tolerance of transmittances, and of channels of values up to 1.
const TOLERANCE: f64 = 1e-5;

/// Generated splats, by depth, with a colour each.
pub(super) struct CompositeInput {
    cloud: Cloud,
    camera: Camera,
    values: Vec<f32>,
}

impl CompositeInput {
    pub(super) fn new() -> Self {
        let number = |i: u64, k| rng::unit_f32(SEED, 0, i, k);
        let mut depths: Vec<f32> = (0..u64::from(SPLATS)).map(|i| 1.0 - 2.0 * number(i, 0)).collect();
        // The eye stands at positive z: what is nearer comes first.
        depths.sort_by(|a, b| b.total_cmp(a));
        let mut cloud = Cloud::new(DVec3::ZERO);
        for (i, depth) in (0..).zip(depths) {
            let position = [3.2 * number(i, 1) - 1.6, 2.0 * number(i, 2) - 1.0, depth].into();
            let radius = 0.01 + 0.1 * number(i, 3) * number(i, 4);
            let cross_section = 0.3 * radius * radius * number(i, 5);
            cloud.push(&Splat { position, radius, cross_section, kind: SplatKind::Medium, ..Splat::default() });
        }
        let eye = DVec3::Z * 4.0;
        let view = Projection::Orthographic { height: 2.2 };
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, view, SIZE).expect("invariant: a view of its target");
        Self { cloud, camera, values: (0..3 * u64::from(SPLATS)).map(|i| number(i, 6)).collect() }
    }

    pub(super) fn check(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let params = Params::default();
        let materials = [Material::default()];
        let opaque = OpaqueImage::default();
        let projected = project(&ProjectInput {
            cloud: &self.cloud,
            camera: &self.camera,
            footprints: &FootprintStack::default(),
            materials: &materials,
            params: &params,
            detail: Detail::ALL,
        });
        let order: Vec<u32> = (0..SPLATS).collect();
        let values = &self.values[..];
        let direction = Direction::FrontToBack;
        let mut expected = Accumulator::new(SIZE, 1, 3, false, false);
        let mut found = expected.clone();
        let input = FoldInput {
            projected: &projected,
            order: &order,
            values,
            materials: &materials,
            opaque: &opaque,
            direction,
            params: &params,
        };
        fold(&input, &mut expected, None)?;
        let recorded = record(input.capacities(&found, ENTRIES))?;
        let uploads = recorded.uploads(&input, &found)?;
        let run = device.run(&recorded.recording, &recorded.inputs(&uploads))?;
        recorded.finish([recorded.state, recorded.planes].map(|buffer| run.bytes(buffer)), &mut found)?;
        Ok(Found { items: SPLATS.into(), agreement: accumulators(&found, &expected), passes: run.passes })
    }
}

/// How two accumulators of one plane agree.
pub(super) fn accumulators(found: &Accumulator, expected: &Accumulator) -> Agreement {
    let transmittances = |a: &Accumulator| a.optical_depth[0].iter().map(|tau| libm::expf(-tau)).collect::<Vec<f32>>();
    let radiance = |a: &Accumulator| [a.channels.concat(), transmittances(a)].concat();
    numbers(&radiance(found), &radiance(expected), "radiance")
}

/// How numbers up to 1 agree.
pub(super) fn numbers(found: &[f32], expected: &[f32], unit: &'static str) -> Agreement {
    let apart: Vec<f64> = found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs())).collect();
    let n = apart.len() as f64;
    Agreement {
        // What is no number is not within it, nor what is not there.
        within: found.len() == expected.len() && apart.iter().all(|d| *d <= TOLERANCE),
        equal_share: apart.iter().filter(|d| **d == 0.0).count() as f64 / n,
        mean: apart.iter().sum::<f64>() / n,
        max: apart.iter().copied().fold(0.0, |most, d| if d <= most { most } else { d }),
        unit,
    }
}
