//! Extinction that differs by channel: each channel is what particles of its own extinction would give.

use crate::common::*;
use pbsr::{Ensemble, EnsembleParams, MeshSampler, Object, SurfaceParams, pixel_area};
use splat_core::Projection;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::OpaqueImage;

const APART: EnsembleParams = EnsembleParams {
    effects: false,
    normal: false,
    shadow: false,
    depth_range: None,
    object: false,
    colored_extinction: true,
    radiance_unit: 0.0,
};

fn surface(opacity: f64, s: f64, color: [f32; 3], seed: u64) -> SurfaceParams {
    SurfaceParams { opacity, cross_section: s, color, seed, ..SurfaceParams::default() }
}

fn tinted<'a>(sampler: &'a MeshSampler<'a>, rgb: [f32; 3]) -> Object<'a> {
    let mut object = object(sampler);
    object.look.material.extinction_rgb = rgb;
    object
}

#[test]
fn where_all_channels_are_alike_the_picture_is_the_grey_one() {
    let camera = camera(Projection::Perspective { fov_y: 0.6 }, 4.0, [40, 30]);
    let mesh = rectangle(Vec3::ZERO, Vec3::new(0.5, 0.3, 0.5), Vec3::Y, 5);
    let sampler = MeshSampler::new(&mesh, &surface(0.4, 1e-3, [0.7, 0.5, 0.25], 3), None).unwrap();
    let fold = |rgb: [f32; 3], params: EnsembleParams| {
        let objects = [tinted(&sampler, rgb)];
        let mut ensemble = Ensemble::new(camera.size, &params).unwrap();
        fold_into(&scene(&camera, &objects), &mut ensemble, 40);
        (all_hits(&ensemble), ensemble.read(&|_, _| [0.1, 0.2, 0.3], None))
    };
    let grey = EnsembleParams { colored_extinction: false, depth_range: Some([2.0, 6.0]), object: true, ..APART };
    let (hits, plain) = fold([1.0; 3], grey);
    let (same, apart) = fold([2.0; 3], EnsembleParams { colored_extinction: true, ..grey });
    assert_eq!(same, hits);
    for name in ["beauty", "depth.first", "depth.median", "depth.mean", "depth.sigma", "object"] {
        assert_eq!(plain.images[name], apart.images[name], "{name}");
    }
    let error = |layers: &splat_core::Layers| layers.scalar("std_error").unwrap().to_vec();
    let differ = error(&plain).iter().zip(error(&apart)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(differ < 1e-6, "{differ}");
}

#[test]
fn the_stated_error_is_that_of_the_sets() {
    let camera = front(16);
    let meshes = [0.5, -0.5].map(|z| rectangle(Vec3::Z * z, Vec3::X * 4.0, Vec3::Y * 4.0, 2));
    let s = pixel_area(&camera, DVec3::Z);
    let sampler = |k: usize, color| MeshSampler::new(&meshes[k], &surface(0.6, s, color, k as u64), None).unwrap();
    let samplers = [sampler(0, [1.0, 0.5, 0.25]), sampler(1, [0.25, 0.5, 2.0])];
    let objects = [tinted(&samplers[0], [1.0, 0.5, 0.25]), tinted(&samplers[1], [0.25, 0.5, 1.0])];
    // A wall behind one half.
    let depth = (0..256).map(|k| if k % 16 < 8 { 6.0 } else { f32::INFINITY }).collect();
    let channels = [0.25, 1.0, 0.5].map(|v| vec![v; 256]).to_vec();
    let occluder = OpaqueImage { depth, channels, ..OpaqueImage::default() };
    let scene = pbsr::Scene { occluder: Some(&occluder), ..scene(&camera, &objects) };
    let mut ensemble = Ensemble::new([16, 16], &APART).unwrap();
    let mut sums = vec![0.0f64; 256];
    let mut squares = vec![0.0f64; 256];
    let mut last = vec![0.0f64; 256];
    const LEVELS: u32 = 64;
    let read = |ensemble: &Ensemble| ensemble.read(&|_, _| [0.5, 0.125, 0.75], Some(&occluder));
    for set in 1..=LEVELS {
        fold_into(&scene, &mut ensemble, 1);
        let layers = read(&ensemble);
        for (k, p) in layers.rgb("beauty").unwrap().iter().enumerate() {
            let luminance = 0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]);
            let total = luminance * f64::from(set);
            let y = total - last[k];
            (sums[k], squares[k], last[k]) = (sums[k] + y, squares[k] + y * y, total);
        }
    }
    let n = f64::from(LEVELS);
    let layers = read(&ensemble);
    for (k, stated) in layers.scalar("std_error").unwrap().iter().enumerate() {
        let mean = sums[k] / n;
        let found = ((squares[k] / n - mean * mean) / (n - 1.0)).sqrt();
        assert!((f64::from(*stated) - found).abs() < 1e-4 * (1.0 + found), "pixel {k}: {stated}, found {found}");
        assert!(found > 0.01);
    }
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn two_planes_let_the_product_of_their_channels_through() {
        const LEVELS: u32 = 300;
        let front = front(32);
        let oblique = camera(Projection::Perspective { fov_y: 0.5 }, 4.0, [32, 32]);
        // Optical depths of the planes in their largest channel; black planes before white.
        let a = 0.8f64;
        let b = 0.5f64;
        let shares = [[1.0, 0.5, 0.125], [0.0, 0.25, 1.0]];
        for (camera, scale) in [(&front, 1.0), (&front, 0.1), (&oblique, 1.0), (&oblique, 0.3)] {
            let s = scale * pixel_area(camera, DVec3::Z * 0.5);
            let meshes = [0.5, -0.5].map(|z| rectangle(Vec3::Z * z, Vec3::X * 4.0, Vec3::Y * 4.0, 2));
            let sampler = |mesh, tau: f64, seed| {
                let params = surface(-(-tau).exp_m1(), s, [0.0; 3], seed);
                let flat = SurfaceParams { surface_opacity: splat_core::optics::SurfaceOpacity::PerCrossing, ..params };
                MeshSampler::new(mesh, &flat, None).unwrap()
            };
            let samplers = [sampler(&meshes[0], a, 1), sampler(&meshes[1], b, 2)];
            let objects = [tinted(&samplers[0], shares[0].map(|k| 3.0 * k)), tinted(&samplers[1], shares[1])];
            let mut ensemble = Ensemble::new([32, 32], &APART).unwrap();
            fold_into(&scene(camera, &objects), &mut ensemble, LEVELS);
            let layers = ensemble.read(&|_, _| [1.0; 3], None);
            let beauty = layers.rgb("beauty").unwrap();
            let alpha = layers.rgb("alpha_rgb").unwrap();
            for c in 0..3 {
                let t = (-a * f64::from(shares[0][c]) - b * f64::from(shares[1][c])).exp();
                let n = beauty.len() as f64;
                let levels = f64::from(LEVELS);
                let error = (t * (1.0 - t) / levels).sqrt();
                let z = |k: usize| (f64::from(beauty[k][c]) - t) / error;
                let mean = (0..beauty.len()).map(z).sum::<f64>() / n.sqrt();
                let worst = (0..beauty.len()).map(|k| z(k).abs()).fold(0.0, f64::max);
                assert!(mean.abs() < sidak(1e-3, 12), "scale {scale}, channel {c}: z {mean}");
                assert!(worst < sidak(1e-3, 12 * beauty.len()) + 0.25, "scale {scale}, channel {c}: {worst}");
                // A bias of a tenth of the opacity would be seen.
                assert!(0.1 * (1.0 - t) / error * n.sqrt() > 2.0 * sidak(1e-3, 12));
                assert!(beauty.iter().zip(alpha).all(|(b, a)| (b[c] + a[c] - 1.0).abs() < 1e-6));
            }
        }
    }
}
