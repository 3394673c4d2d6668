//! A translucent ball of glass-like surface around a cloud, cut by a plane: prints the opacity along a row, with its error.

use pbsr::{
    Appearance, Density, Ensemble, EnsembleParams, Error, FieldVolumeParams, FieldVolumeSampler, FoldParams,
    ImplicitSurface, LineParams, LineSampler, MeshSampler, Object, Renderer, Scene, SurfaceParams, finest_pixel_area,
};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Camera, DAabb, Mesh, Projection, ScalarField, Similarity};

/// Distance to a sphere; outside minus inside of the cloud, too.
struct Ball {
    radius: f64,
    sign: f64,
}

impl ScalarField for Ball {
    fn value(&self, p: DVec3) -> f64 {
        self.sign * (p.length() - self.radius)
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.sign * p.normalize_or_zero()
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let n = p.normalize_or_zero();
        let across = DMat3::IDENTITY - DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        across * (self.sign / p.length().max(1e-300))
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        Some((self.value(p) - radius, self.value(p) + radius))
    }
}

fn main() -> Result<(), Error> {
    let view = Projection::Perspective { fov_y: 0.6 };
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO, DVec3::Y, view, [64, 64])?;
    let cross_section = finest_pixel_area(&camera, DVec3::ZERO, 1.2, 0.1);
    let params = |opacity, seed| SurfaceParams { opacity, cross_section, seed, ..SurfaceParams::default() };
    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.1));

    let shell = Ball { radius: 1.0, sign: 1.0 };
    let surface = ImplicitSurface { field: &shell, level: 0.0, bounds, inside: None };
    let ball = LineSampler::new(&surface, &LineParams { resolution: 24 }, &params(0.2, 1), None)?;
    println!("{:?}", ball.report());

    let fog = Ball { radius: 0.7, sign: -1.0 };
    let extinction = Density { field: &fog, max: 0.7 };
    let cloud = FieldVolumeSampler::new(
        extinction,
        bounds,
        &FieldVolumeParams { resolution: 24, cross_section, color: [1.0, 0.8, 0.6], seed: 2 },
    )?;

    let corner = |x: f32, z: f32| Vec3::new(x, -0.3, z);
    let position = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let plane = Mesh { position, triangles: vec![[0, 2, 1], [0, 3, 2]], ..Mesh::default() };
    let plane = MeshSampler::new(&plane, &params(0.5, 3), None)?;

    let object = |sampler| Object { sampler, transform: Similarity::default(), look: Appearance::default() };
    let objects = [object(&ball), object(&cloud), object(&plane)];
    let scene = Scene {
        objects: &objects,
        lights: &[],
        shadow_origin: DVec3::ZERO,
        ambient: [1.0; 3],
        camera: &camera,
        occluder: None,
    };
    let mut ensemble = Ensemble::new(camera.size, &EnsembleParams::default())?;
    let mut renderer = Renderer::new();
    while ensemble.rms_error(&|_, _| [0.0; 3], None) > 0.02 {
        let counts = renderer.fold(&scene, &mut ensemble, &FoldParams { levels: 50, ..FoldParams::default() }, None)?;
        println!("{} sets, {} particles more", ensemble.levels(), counts.particles);
    }
    let picture = ensemble.read(&|_, _| [0.0; 3], None);
    let (Some(alpha), Some(error)) = (picture.scalar("alpha"), picture.scalar("std_error")) else { return Ok(()) };
    for x in (0..64).step_by(4) {
        println!("{x:2}: {:.3} ± {:.3}", alpha[32 * 64 + x], error[32 * 64 + x]);
    }
    Ok(())
}
