//! The shadow map of a cloud of media, surfaces and opaque discs by both: its lists, and one recording from splats to light.

use super::{Agreement, Failure, Found, LEAST_SHARE};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::Attributes;
use splat_core::{Cloud, Light, LightShape, Material, Progress, Receiver, Splat, SplatKind, Transmittance, rng};
use splat_shaders::{DeviceError, Executor};
use tsm::gpu::{Casting, MapRun, map_on, record_shadow};
use tsm::{Deposits, Params, ShadowMap};

/// Splats that throw shadows and receive them.
const SPLATS: u64 = 1 << 14;
/// The key of their random numbers.
const SEED: u64 = 0x5348_4144;
/// What transmittances may differ by, for nearly all splats: where a driver rounds each product and sum by itself they stay below a
/// tenth of it.
const TOLERANCE: f64 = 1e-4;

/// Generated splats around a lamp beside them, and what the processor makes of them.
pub(super) struct ShadowInput {
    cloud: Cloud,
    casting: Casting,
    deposits: Deposits,
    map: ShadowMap,
    receivers: Vec<Receiver>,
    light: Light,
}

impl ShadowInput {
    pub(super) fn new() -> Self {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..SPLATS {
            let u = |k| 2.0 * rng::unit_f32(SEED, 0, i, k) - 1.0;
            let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Medium, SplatKind::Opaque][(i % 4) as usize];
            let normal = Vec3::new(u(3), u(4), u(5)).normalize_or(Vec3::Z);
            cloud.push(&Splat {
                position: Vec3::new(u(0), u(1), u(2)),
                radius: 0.03 + 0.02 * u(6),
                cross_section: 2e-4 * (1.0 + u(7)),
                kind,
                normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
                ..Splat::default()
            });
        }
        let shape = LightShape::Point { position: DVec3::new(0.4, 2.0, -0.3) };
        let light = Light { shape, intensity: [1.0; 3] };
        let materials = [Material::default()];
        let params = Params::default();
        let progress = Progress::new();
        let valid = "invariant: generated splats and a lamp are valid, and fit";
        let casting = Casting::new(
            &tsm::Scene { cloud: &cloud, materials: &materials, objects: &[] },
            &light,
            &params,
            Some(&progress),
        )
        .expect(valid);
        let deposits = Deposits::new(
            &tsm::Scene { cloud: &cloud, materials: &materials, objects: &[] },
            &light,
            &params,
            Some(&progress),
        )
        .expect(valid);
        let map = deposits.clone().into_map();
        let receivers = (0..cloud.len()).map(|i| Receiver::of_splat(&cloud, i)).collect();
        Self { cloud, casting, deposits, map, receivers, light }
    }

    /// The processor's map, and its light.
    pub(super) fn lamp(&self) -> (&ShadowMap, Light) {
        (&self.map, self.light)
    }

    /// The lists: equal bits, cell by cell.
    pub(super) fn check_lists(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let made = map_on(device, &self.deposits)?;
        let MapRun { map: found, passes } =
            made.ok_or(Failure::from(DeviceError::Memory { bytes: self.map.counts().bytes }))?;
        let apart = |cell: u32| {
            let a = found.list(cell);
            let b = self.map.list(cell);
            let total =
                |list: &[(f64, [f32; 3])]| list.iter().rfind(|(_, t)| t[0].is_finite()).map_or(0.0, |(_, t)| t[0]);
            (a != b, f64::from((total(&a) - total(&b)).abs()))
        };
        let apart: Vec<(bool, f64)> = (0..self.map.cells()).map(apart).collect();
        let n = apart.len() as f64;
        let agreement = Agreement {
            within: found == self.map,
            equal_share: apart.iter().filter(|(differ, _)| !differ).count() as f64 / n,
            mean: apart.iter().map(|(_, d)| d).sum::<f64>() / n,
            max: apart.iter().map(|(_, d)| *d).fold(0.0, f64::max),
            unit: "absorbance",
        };
        Ok(Found { items: self.map.counts().entries, agreement, passes })
    }

    /// From splats to light in one go: deposits, lists and look-ups.
    pub(super) fn check_shadow(&self, device: &mut dyn Executor) -> Result<Found, Failure> {
        let attributes = Attributes::new(&self.cloud, None)?;
        let recorded = record_shadow(self.casting.room(attributes.room(), self.casting.expected()), 0);
        let uploads = recorded.uploads(&self.casting, None, &[1.0])?;
        let mut inputs = recorded.inputs(&uploads);
        inputs.extend(attributes.inputs(recorded.attributes()));
        let run = device.run(&recorded.recording, &inputs)?;
        let entries = recorded.cast.found(run.bytes(recorded.cast.state))?;
        let (words, _) = run.bytes(recorded.received).as_chunks::<4>();
        let (lights, _) = words.as_chunks::<3>();
        let lights: Vec<[f32; 3]> = lights.iter().map(|light| light.map(f32::from_ne_bytes)).collect();
        let mut agreement = self.agreement(&lights);
        // A surface's step that lies at a receiver within rounding may fall on its other side.
        let pairs = self.receivers.iter().map(|receiver| self.map.transmittance(receiver)).zip(&lights);
        let close = pairs.filter(|(a, b)| f64::from((a[0] - b[0]).abs()) <= TOLERANCE).count();
        agreement.within = close as f64 >= LEAST_SHARE * self.receivers.len() as f64;
        Ok(Found { items: entries.into(), agreement, passes: run.passes })
    }

    fn agreement(&self, lights: &[[f32; 3]]) -> Agreement {
        let pairs = self.receivers.iter().map(|receiver| self.map.transmittance(receiver)).zip(lights);
        let apart: Vec<f64> = pairs.map(|(a, b)| f64::from((a[0] - b[0]).abs())).collect();
        let n = apart.len() as f64;
        Agreement {
            // What is no number is not within it.
            within: lights.len() == self.receivers.len() && apart.iter().all(|d| *d <= TOLERANCE),
            equal_share: apart.iter().filter(|d| **d == 0.0).count() as f64 / n,
            mean: apart.iter().sum::<f64>() / n,
            max: apart.iter().copied().fold(0.0, f64::max),
            unit: "transmittance",
        }
    }
}
