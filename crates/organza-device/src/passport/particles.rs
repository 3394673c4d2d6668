//! Sets of particles by both: uploaded, or made by the device; unlit, or lit through a shadow map.

use super::{Agreement, Failure, Found, LEAST_SHARE, SIZE, ShadowInput};
use crate::{Folding, Goal};
use pbsr::{
    Appearance, Ensemble, EnsembleParams, FoldParams, LitBy, MeshSampler, Object, Renderer, Scene, SurfaceParams,
    pixel_area,
};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::{Camera, Material, Mesh, Progress, Projection, Shading, Similarity};
use splat_shaders::Executor;

/// Sets of particles that are folded.
const SETS: u32 = 3;
/// Radius of the splats that the particles stand for.
const RADIUS: f32 = 0.02;
/// What the means of a pixel may differ by, as a share of the brightest, or of 1; and the share of the numbers that do: a
/// hit in a thousand pixels may be another.
const TOLERANCE: f64 = 3e-5;
const LEAST_NEAR: f64 = 0.998;

/// Two walls, one before the other, in particles.
pub(super) struct ParticlesInput {
    walls: [Mesh; 2],
    camera: Camera,
}

impl ParticlesInput {
    pub(super) fn new() -> Self {
        let wall = |side: f32, z: f32| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let position = corners.map(|(x, y)| Vec3::new(side * x, side * y, z)).to_vec();
            Mesh { position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
        };
        let eye = DVec3::new(0.3, 0.2, 4.0);
        let view = Projection::Perspective { fov_y: 0.7 };
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, view, SIZE).expect("invariant: a view of its target");
        Self { walls: [wall(0.7, 0.8), wall(1.5, -0.5)], camera }
    }

    /// Shown as they are; the nearer ones are widened, the farther thinned out.
    pub(super) fn check(&self, device: &mut dyn Executor, folding: Folding<'_>) -> Result<Found, Failure> {
        let material = Material { shading: Shading::Unlit, ..Material::default() };
        self.check_in(device, folding, material, 3.0, &[])
    }

    /// Lit by the lamp of a shadow map; none is widened, so that places within pixels are the same.
    pub(super) fn check_lit(&self, device: &mut dyn Executor, shadow: &ShadowInput) -> Result<Found, Failure> {
        let (map, light) = shadow.lamp();
        let lit = LitBy { slide: None, light, shadow: Some(map) };
        let material = Material { specular: 0.2, shininess: 20.0, ..Material::default() };
        self.check_in(device, Folding::new(vec![(map, DVec3::ZERO)]), material, 0.6, &[lit])
    }

    fn check_in(
        &self,
        device: &mut dyn Executor,
        mut folding: Folding<'_>,
        material: Material,
        nearer: f64,
        lights: &[LitBy<'_>],
    ) -> Result<Found, Failure> {
        let middle = pixel_area(&self.camera, self.camera.position + 4.0 * self.camera.axes[2]);
        let params = |s: f64, seed, color| SurfaceParams {
            opacity: 0.4,
            cross_section: s * middle,
            color,
            seed,
            ..SurfaceParams::default()
        };
        let near = MeshSampler::new(&self.walls[0], &params(nearer, 1, [0.9, 0.4, 0.1]), None)?;
        let far = MeshSampler::new(&self.walls[1], &params(0.5, 2, [0.1, 0.5, 2.0]), None)?;
        let object = |sampler, turn| {
            let transform = Similarity { rotation: DQuat::from_rotation_y(turn), ..Similarity::default() };
            Object { sampler, transform, look: Appearance { material, radius: RADIUS, ..Appearance::default() } }
        };
        let objects = [object(&near, 0.5), object(&far, -0.3)];
        let shadow_origin = DVec3::ZERO;
        let camera = &self.camera;
        let scene = Scene { objects: &objects, lights, shadow_origin, ambient: [0.1; 3], camera, occluder: None };
        let empty = Ensemble::new(SIZE, &EnsembleParams { radiance_unit: 0.5, ..EnsembleParams::default() })?;
        let mut expected = empty.clone();
        let mut found = empty;
        let progress = Progress::default();
        Renderer::new().fold(
            &scene,
            &mut expected,
            &FoldParams { levels: SETS, ..FoldParams::default() },
            Some(&progress),
        )?;
        if let Some(why) =
            folding.fold_on(device, &scene, &mut found, Goal { until: SETS, max_bytes: u64::MAX }, &progress)?
        {
            return Err(Failure::Left(why));
        }
        let Folding { particles, passes, .. } = folding;
        Ok(Found { items: particles, agreement: agreement(&found, &expected), passes })
    }
}

fn agreement(found: &Ensemble, expected: &Ensemble) -> Agreement {
    let pixels = || (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let same = pixels().filter(|&(x, y)| found.hits(x, y) == expected.hits(x, y)).count();
    let radiance = |ensemble: &Ensemble| {
        let layers = ensemble.read(&|_, _| [0.0; 3], None);
        layers.rgb("beauty").map(<[[f32; 3]]>::to_vec).unwrap_or_default()
    };
    let a = radiance(found);
    let b = radiance(expected);
    let apart: Vec<f64> =
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| f64::from((a - b).abs())).collect();
    let equal_share = same as f64 / pixels().count() as f64;
    let brightest = b.as_flattened().iter().fold(1.0f32, |a, b| a.max(*b));
    let near = apart.iter().filter(|d| **d <= TOLERANCE * f64::from(brightest)).count();
    Agreement {
        within: equal_share >= LEAST_SHARE && near as f64 >= LEAST_NEAR * apart.len() as f64,
        equal_share,
        mean: apart.iter().sum::<f64>() / apart.len().max(1) as f64,
        max: apart.iter().copied().fold(0.0, f64::max),
        unit: "radiance",
    }
}
