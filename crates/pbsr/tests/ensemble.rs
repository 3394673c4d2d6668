//! The average over sets: its error, its integers, its determinism; ties, occluders, depths, checkpoints, cancelling.

use crate::common::*;
use pbsr::{
    Appearance, Ensemble, EnsembleParams, Error, FoldParams, KeptSets, LitBy, MeshSampler, Object, Renderer, Sampler,
    Scene, SurfaceParams, pixel_area, predict,
};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::raster::OpaqueImage;
use splat_core::{
    Light, LightShape, Limits, Material, Mesh, Progress, Projection, Receiver, Shading, Similarity, Transmittance,
};

fn wall(z: f32) -> Mesh {
    rectangle(Vec3::Z * z, Vec3::X * 1.5, Vec3::Y * 1.5, 2)
}

fn params(opacity: f64, s: f64, color: [f32; 3], seed: u64) -> SurfaceParams {
    SurfaceParams { opacity, cross_section: s, color, seed, ..SurfaceParams::default() }
}

fn rms(layers: &splat_core::Layers, expected: f64) -> f64 {
    let pixels = layers.rgb("beauty").unwrap();
    (pixels.iter().map(|p| (f64::from(p[1]) - expected).powi(2)).sum::<f64>() / pixels.len() as f64).sqrt()
}

#[test]
fn pb06_the_error_falls_with_the_root_of_the_repeat_level() {
    let camera = front(64);
    let mesh = wall(0.0);
    let sampler = MeshSampler::new(&mesh, &params(0.3, pixel_area(&camera, DVec3::Z), [1.0; 3], 4), None).unwrap();
    let objects = objects(&[&sampler]);
    let mut ensemble = Ensemble::new([64, 64], &EnsembleParams::default()).unwrap();
    let mut points = Vec::new();
    for levels in [16u32, 64, 256, 1024] {
        let more = levels - ensemble.levels();
        fold_into(&scene(&camera, &objects), &mut ensemble, more);
        let layers = ensemble.read(&|_, _| [0.0; 3], None);
        let error = rms(&layers, 0.3);
        let theory = (0.3 * 0.7 / f64::from(levels)).sqrt();
        assert!((error / theory - 1.0).abs() < 0.06, "L {levels}: {error} for {theory}");
        // The picture's own estimate of its error.
        let estimate = ensemble.rms_error(&|_, _| [0.0; 3], None);
        assert!((estimate / theory - 1.0).abs() < 0.06, "L {levels}: says {estimate} for {theory}");
        points.push((f64::from(levels).ln(), error.ln()));
    }
    let n = points.len() as f64;
    let mx = points.iter().map(|p| p.0).sum::<f64>() / n;
    let my = points.iter().map(|p| p.1).sum::<f64>() / n;
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    assert!((slope + 0.5).abs() < 0.03, "slope {slope}");
}

#[test]
fn pb07_ten_million_hits_are_counted_exactly() {
    let camera = front(8);
    let mesh = wall(0.0);
    // 32 particles a pixel: each is hit in every set (e^−32).
    let surface =
        SurfaceParams { opaque_optical_depth: 32.0, ..params(1.0, pixel_area(&camera, DVec3::Z), [0.3; 3], 4) };
    let sampler = MeshSampler::new(&mesh, &surface, None).unwrap();
    let mut sum = render(&camera, &[&sampler], 1);
    let one = sum.clone();
    // 2²³ + 2²¹ = 10 485 760 sets, by doubling.
    for _ in 0..21 {
        let twin = sum.clone();
        sum.merge(&twin).unwrap();
    }
    let quarter = sum.clone();
    (0..2).for_each(|_| sum.merge(&sum.clone()).unwrap());
    sum.merge(&quarter).unwrap();
    assert_eq!(sum.levels(), 10_485_760);
    assert!(all_hits(&sum).iter().all(|h| *h == 10_485_760));
    let beauty = |e: &Ensemble| e.read(&|_, _| [9.0; 3], None).rgb("beauty").unwrap().to_vec();
    assert_eq!(beauty(&sum), beauty(&one), "the mean of equal sets is the set");
}

#[test]
fn pb02_opaque_surfaces_are_exact_as_occluders() {
    let camera = front(16);
    let mesh = wall(0.5);
    let sampler = MeshSampler::new(&mesh, &params(0.4, pixel_area(&camera, DVec3::Z), [1.0; 3], 1), None).unwrap();
    let objects = objects(&[&sampler]);
    // The camera is at z = 4: the wall at depth 3.5. A solid left half in front of it, a solid row behind it.
    let mut occluder =
        OpaqueImage { depth: vec![f32::INFINITY; 256], channels: vec![vec![0.0; 256]; 3], ..OpaqueImage::default() };
    for k in 0..256 {
        if k % 16 < 8 || k / 16 == 3 {
            occluder.depth[k] = if k % 16 < 8 { 3.0 } else { 5.0 };
            (0..3).for_each(|c| occluder.channels[c][k] = [0.25, 0.5, 0.75][c]);
        }
    }
    let ensemble = fold(&Scene { occluder: Some(&occluder), ..scene(&camera, &objects) }, 400);
    let layers = ensemble.read(&|_, _| [0.0; 3], Some(&occluder));
    let beauty = layers.rgb("beauty").unwrap();
    let alpha = layers.scalar("alpha").unwrap();
    for k in 0..256 {
        if k % 16 < 8 {
            assert_eq!((beauty[k], alpha[k]), ([0.25, 0.5, 0.75], 1.0), "pixel {k}");
        } else if k / 16 == 3 {
            assert_eq!(alpha[k], 1.0);
            assert!((beauty[k][1] - (0.4 + 0.6 * 0.5)).abs() < 0.06, "{:?}", beauty[k]);
        } else {
            assert!((alpha[k] - 0.4).abs() < 0.15, "{}", alpha[k]);
        }
    }
    // α = 0: no particles, and the background exactly.
    let clear = MeshSampler::new(&mesh, &params(0.0, 1e-3, [1.0; 3], 1), None).unwrap();
    let layers = render(&camera, &[&clear], 5).read(&|x, y| [x as f32, y as f32, 0.1], None);
    assert!(layers.rgb("beauty").unwrap().iter().zip(0..).all(|(p, k)| *p == [(k % 16) as f32, (k / 16) as f32, 0.1]));
}

#[test]
fn pb16_coincident_surfaces_share_their_pixels_fairly() {
    // Equal depths everywhere: the plane faces an orthographic camera.
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let mesh = wall(0.0);
    let red = MeshSampler::new(&mesh, &params(0.9, s, [1.0, 0.0, 0.0], 1), None).unwrap();
    let green = MeshSampler::new(&mesh, &params(0.9, s, [0.0, 1.0, 0.0], 2), None).unwrap();
    let share = |samplers: [&dyn Sampler; 2]| {
        let layers = render(&camera, &samplers, 200).read(&|_, _| [0.0; 3], None);
        let sums = layers.rgb("beauty").unwrap().iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        f64::from(sums[0] / (sums[0] + sums[1]))
    };
    // 1024 pixels × 200 sets: 4σ = 0.0045.
    let one = share([&red, &green]);
    let two = share([&green, &red]);
    assert!((one - 0.5).abs() < 0.006 && (two - 0.5).abs() < 0.006, "{one} {two}");
}

#[test]
fn x1_any_number_of_threads_and_any_batches_give_the_same_bits() {
    let camera = camera(Projection::Perspective { fov_y: 0.6 }, 4.0, [150, 100]);
    let meshes = [wall(0.0), rectangle(Vec3::ZERO, Vec3::new(0.5, 0.3, 0.5), Vec3::Y, 5)];
    let s = pixel_area(&camera, DVec3::Z);
    let samplers: Vec<_> =
        meshes.iter().zip(1..).map(|(m, i)| MeshSampler::new(m, &params(0.4, s, [0.5; 3], i), None).unwrap()).collect();
    let grey = EnsembleParams {
        effects: true,
        normal: true,
        shadow: true,
        depth_range: Some([1.0, 9.0]),
        object: true,
        colored_extinction: false,
        radiance_unit: 0.5,
    };
    for full in [grey, EnsembleParams { colored_extinction: true, ..grey }] {
        same_bits(&camera, &samplers, &full);
    }
}

fn same_bits(camera: &splat_core::Camera, samplers: &[MeshSampler<'_>], full: &EnsembleParams) {
    let mut objects: Vec<Object<'_>> = samplers.iter().map(|s| object(s)).collect();
    objects[0].look.material.extinction_rgb = [0.5, 1.0, 2.0];
    let run = |threads: usize, batch: u64, steps: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut ensemble = Ensemble::new(camera.size, full).unwrap();
        let fold = FoldParams { batch_particles: batch, ..FoldParams::default() };
        for levels in steps {
            let scene = scene(camera, &objects);
            pool.install(|| Renderer::new().fold(&scene, &mut ensemble, &FoldParams { levels: *levels, ..fold }, None))
                .unwrap();
            // Through a checkpoint each time.
            ensemble = Ensemble::from_bytes(&ensemble.to_bytes(&[1; 32]), &[1; 32]).unwrap();
        }
        ensemble
    };
    let one = run(1, 1 << 22, &[30]);
    for (threads, batch, steps) in [(2, 1 << 22, vec![30]), (4, 1, vec![30]), (3, 40_000, vec![1, 20, 9])] {
        assert_eq!(run(threads, batch, &steps), one, "{threads} threads, batches of {batch}");
    }
    assert!(all_hits(&one).iter().sum::<u32>() > 10_000);
}

#[test]
fn x2_a_scene_at_1e7_has_the_same_hits() {
    let at = |shift: DVec3| {
        let p = Projection::Perspective { fov_y: 0.6 };
        let eye = shift + DVec3::new(0.5, 0.25, 4.0);
        let camera = splat_core::Camera::look_at(eye, shift, DVec3::Y, p, [48, 48]).unwrap();
        let mesh = Mesh { origin: shift, ..wall(0.0) };
        let sampler = MeshSampler::new(&mesh, &params(0.4, 3e-3, [1.0; 3], 1), None).unwrap();
        all_hits(&render(&camera, &[&sampler], 8))
    };
    let near = at(DVec3::ZERO);
    let far = at(DVec3::splat(1e7));
    let differ = near.iter().zip(&far).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "of {}", near.len());
}

#[test]
fn x3_scaling_by_powers_of_two_changes_no_hit() {
    let at = |power: i32| {
        let k = 2f64.powi(power);
        let mut mesh = wall(0.0);
        mesh.position.iter_mut().for_each(|p| *p *= k as f32);
        let p = Projection::Perspective { fov_y: 0.6 };
        let camera = splat_core::Camera::look_at(DVec3::Z * 4.0 * k, DVec3::ZERO, DVec3::Y, p, [48, 48]).unwrap();
        let sampler = MeshSampler::new(&mesh, &params(0.4, 3e-3 * k * k, [1.0; 3], 1), None).unwrap();
        all_hits(&render(&camera, &[&sampler], 4))
    };
    for power in [-40, -10, 10, 40] {
        assert_eq!(at(power), at(0), "2^{power}");
    }
}

#[test]
fn depths_are_those_of_the_hits() {
    let camera = front(16);
    let s = pixel_area(&camera, DVec3::Z);
    let near = wall(1.0);
    let far = wall(-1.0);
    let a = MeshSampler::new(&near, &params(0.5, s, [1.0; 3], 1), None).unwrap();
    let b = MeshSampler::new(&far, &params(0.999_999, s, [1.0; 3], 2), None).unwrap();
    let kept = EnsembleParams { depth_range: Some([0.0, 8.0]), ..EnsembleParams::default() };
    let mut ensemble = Ensemble::new([16, 16], &kept).unwrap();
    fold_into(&scene(&camera, &objects(&[&a, &b])), &mut ensemble, 600);
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    // Depths 3 and 5, half each: mean 4, deviation 1.
    let first = layers.scalar("depth.first").unwrap();
    assert!(first.iter().all(|d| (d - 3.0).abs() < 1e-6), "{first:?}");
    assert!(layers.scalar("depth.mean").unwrap().iter().all(|d| (d - 4.0).abs() < 0.18));
    assert!(layers.scalar("depth.sigma").unwrap().iter().all(|d| (d - 1.0).abs() < 0.03));
}

/// Half of the light arrives.
struct Half;

impl Transmittance for Half {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        assert!(receiver.position.is_finite());
        [0.5; 3]
    }
}

#[test]
fn light_and_shadow_make_the_radiance_of_a_lambertian() {
    let camera = front(16);
    let mesh = wall(0.0);
    let surface = params(1.0, pixel_area(&camera, DVec3::Z), [0.8, 0.4, 0.2], 1);
    let sampler = MeshSampler::new(&mesh, &surface, None).unwrap();
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let light = Light { shape: LightShape::Directional { direction }, intensity: [3.0; 3] };
    let lights = [LitBy { slide: None, light, shadow: Some(&Half) }];
    let look = pbsr::Appearance { material: Material::default(), ..unlit() };
    let objects = [Object { look, ..object(&sampler) }];
    let lit = Scene { lights: &lights, ambient: [0.1; 3], ..scene(&camera, &objects) };
    let kept = EnsembleParams { effects: true, normal: true, shadow: true, ..EnsembleParams::default() };
    let mut ensemble = Ensemble::new([16, 16], &kept).unwrap();
    fold_into(&lit, &mut ensemble, 20);
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    for k in 0..256 {
        let near = |name: &str, expected: [f32; 3]| {
            let found = layers.rgb(name).unwrap()[k];
            // Colours have nine bits: the mean of twenty.
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 3e-3), "{name} {k}: {found:?} for {expected:?}");
        };
        let e = 3.0 * 0.5 * 0.8 / std::f32::consts::PI;
        near("direct", [0.8 * e, 0.4 * e, 0.2 * e]);
        near("ambient", [0.08, 0.04, 0.02]);
        near("normal", [0.0, 0.0, 1.0]);
        assert_eq!(layers.scalar("shadow").unwrap()[k], 0.5);
        near("scatter1", [0.0; 3]);
        let effects = ["background", "ambient", "emission", "direct", "scatter1"];
        let sum: f32 = effects.iter().map(|n| layers.rgb(n).unwrap()[k][0]).sum();
        assert!((sum - layers.rgb("beauty").unwrap()[k][0]).abs() < 1e-5);
    }
}

#[test]
fn cost_is_predicted_and_work_can_be_cancelled() {
    let camera = front(64);
    let mesh = wall(0.0);
    let sampler = MeshSampler::new(&mesh, &params(0.5, pixel_area(&camera, DVec3::Z), [1.0; 3], 1), None).unwrap();
    let objects = objects(&[&sampler]);
    let scene = scene(&camera, &objects);
    let mut ensemble = Ensemble::new([64, 64], &EnsembleParams::default()).unwrap();
    let fold = FoldParams { levels: 50, batch_particles: 20_000, ..FoldParams::default() };
    let expected = predict(&scene, ensemble.params(), &fold);
    let counts = Renderer::new().fold(&scene, &mut ensemble, &fold, None).unwrap();
    assert!((counts.particles as f64 - expected.particles).abs() < 4.5 * expected.particles.sqrt(), "{counts:?}");
    assert!(counts.bytes <= expected.batch_bytes, "{counts:?} {expected:?}");
    assert_eq!(ensemble.bytes(), expected.ensemble_bytes);
    assert_eq!(counts.levels, 50);
    let progress = Progress::new();
    progress.cancel();
    let before = ensemble.clone();
    let stopped = Renderer::new().fold(&scene, &mut ensemble, &fold, Some(&progress));
    assert!(matches!(stopped, Err(Error::Core(splat_core::Error::Cancelled))));
    assert_eq!(ensemble, before);
    let small = FoldParams { limits: Limits::bytes(1000), ..fold };
    let refused = Renderer::new().fold(&scene, &mut ensemble, &FoldParams { levels: 1, ..small }, None);
    assert!(matches!(refused, Err(Error::Limit(_))));
    let other = front(32);
    let refused = Renderer::new().fold(
        &Scene { camera: &other, ..scene },
        &mut ensemble,
        &FoldParams { levels: 1, ..fold },
        None,
    );
    assert!(matches!(refused, Err(Error::Parameter { .. })));
}

#[test]
fn sums_gathered_by_tile_are_those_added_hit_by_hit() {
    // More sets in a batch than a tile gathers at once; blue is negative.
    let camera = camera(Projection::Orthographic { height: 2.0 }, 3.0, [70, 60]);
    let mesh = wall(0.0);
    let sampler = MeshSampler::new(&mesh, &params(0.7, 1e-3, [0.25, 0.5, 0.1], 3), None).unwrap();
    let material = Material { shading: Shading::Unlit, emission: [0.5, 0.0, -0.75], ..Material::default() };
    let look = Appearance { material, ..Appearance::default() };
    let objects = [Object { sampler: &sampler, transform: Similarity::default(), look }];
    let scene = scene(&camera, &objects);
    let fold = |object: bool| {
        let params = EnsembleParams { object, ..EnsembleParams::default() };
        let mut ensemble = Ensemble::new(camera.size, &params).unwrap();
        Renderer::new()
            .fold(&scene, &mut ensemble, &FoldParams { levels: 300, ..FoldParams::default() }, None)
            .unwrap();
        ensemble.read(&|_, _| [0.25; 3], None)
    };
    let gathered = fold(false);
    let one_by_one = fold(true);
    for name in ["beauty", "alpha", "std_error"] {
        assert_eq!(gathered.images.get(name), one_by_one.images.get(name), "{name}");
    }
    assert!(gathered.rgb("beauty").unwrap().iter().any(|p| p[2] < -0.1));
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn the_fast_path_sees_what_the_slow_one_sees() {
        use splat_core::optics::SurfaceOpacity::{PerCrossing, ThinSlab};
        let camera = camera(Projection::Perspective { fov_y: 0.7 }, 3.0, [70, 60]);
        let mesh = rectangle(Vec3::ZERO, Vec3::new(0.8, 0.2, 0.9), Vec3::Y, 3);
        // Thinned out, and widened.
        for (s, surface_opacity) in [(5e-4, ThinSlab), (6e-3, ThinSlab), (2e-3, PerCrossing)] {
            let surface = SurfaceParams { surface_opacity, ..params(0.6, s, [0.25, 0.5, 1.0], 7) };
            let sampler = MeshSampler::new(&mesh, &surface, None).unwrap();
            let objects = objects(&[&sampler]);
            let scene = scene(&camera, &objects);
            let mut slow = vec![0u32; 70 * 60];
            for set in 0..10 {
                let nearest = pbsr::reference::nearest(&scene, set);
                slow.iter_mut().zip(&nearest).for_each(|(n, hit)| *n += u32::from(hit.is_some()));
            }
            let fast = all_hits(&fold(&scene, 10));
            let differ = fast.iter().zip(&slow).filter(|(a, b)| a != b).count();
            assert!(slow.iter().sum::<u32>() > 2000);
            assert!(differ <= 2, "s {s}: {differ} pixels differ");
        }
        assert!((pbsr::reference::equation_1(0.01, 1.0, 100) - pbsr::opacity::opacity(100.0, 0.01)).abs() < 1e-12);
        assert!((pbsr::reference::layers(&[0.5, 0.2]) - 0.6).abs() < 1e-15);
    }

    #[test]
    fn kept_sets_are_the_sets_and_moving_them_needs_no_sampling() {
        const SETS: u32 = 500;
        let camera = front(32);
        let mesh = wall(0.0);
        let sampler = MeshSampler::new(&mesh, &params(0.4, pixel_area(&camera, DVec3::Z), [1.0; 3], 1), None).unwrap();
        let kept = KeptSets::new(&sampler, 0, 12);
        assert_eq!(render(&camera, &[&kept], 12), render(&camera, &[&sampler], 12));
        assert_eq!(kept.bytes(), kept.particles() * 20);
        // Particles of a hundredth of a pixel are thinned out by the same numbers, though their chunks are joined.
        let fine = params(0.4, 0.01 * pixel_area(&camera, DVec3::Z), [1.0; 3], 1);
        let wall = rectangle(Vec3::ZERO, Vec3::X * 1.5, Vec3::Y * 1.5, 64);
        let sampler = MeshSampler::new(&wall, &fine, None).unwrap();
        let kept = KeptSets::new(&sampler, 0, 3);
        assert!(1 < kept.chunks() && kept.chunks() < sampler.chunks(), "{} of {}", kept.chunks(), sampler.chunks());
        assert_eq!(render(&camera, &[&kept], 3), render(&camera, &[&sampler], 3));
        // Twice as large: particles are widened, the opacity stays. Turned by 60°: 1 − 0.6².
        let turned =
            Similarity { scale: 2.0, rotation: DQuat::from_rotation_y(60f64.to_radians()), ..Similarity::default() };
        let many = KeptSets::new(&sampler, 100, SETS as usize);
        let moved = Object { transform: turned, ..object(&many) };
        let ensemble = fold(&scene(&camera, &[moved]), SETS);
        let mut sum = 0.0;
        let mut n = 0.0;
        for y in 2..30 {
            for x in 2..30 {
                sum += f64::from(ensemble.hits(x, y));
                n += f64::from(SETS);
            }
        }
        // Widened particles cover four pixels: 4 times the variance.
        let sigma = f64::sqrt(0.64 * 0.36 * 4.0 / n);
        assert!((sum / n - 0.64).abs() < 4.0 * sigma, "{} ± {sigma}", sum / n);
    }
}
