//! The path tracer on surfaces, and its promises of determinism. Statistical levels as in `path_media.rs`.

use crate::support::{assert_mean, ball_mesh, box_mesh, parallel, quad, trace};
use reference::{
    Cauchy, Density, Dielectric, Environment, Estimate, LatLong, LightSource, Medium, PathRules, PathSettings,
    PixelSampling, Scene, Surface, SurfaceKind, SurfaceMaterial, path_trace,
};
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{Camera, Error, Mesh, Progress, Projection};
use std::f64::consts::PI;

fn settings(samples: u32) -> PathSettings {
    PathSettings { seed: 5, samples, batch: samples, pixel: PixelSampling::Center, ..PathSettings::default() }
}

fn white(kind: SurfaceKind) -> SurfaceMaterial {
    SurfaceMaterial { kind, diffuse: [1.0; 3], ..SurfaceMaterial::default() }
}

fn skies() -> [Environment; 2] {
    [Environment::Constant([1.0; 3]), Environment::Image(LatLong::new([4, 3], vec![[1.0; 3]; 12]).unwrap())]
}

#[test]
fn white_furnace_of_lambertian_translucent_and_dielectric_meshes() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 3);
    let inner = box_mesh(Vec3::splat(-0.3), Vec3::splat(0.3));
    let kinds = [
        SurfaceKind::Opaque,
        SurfaceKind::Translucent { opacity: [0.2, 0.5, 0.9], law: SurfaceOpacity::PerCrossing },
        SurfaceKind::Translucent { opacity: [0.3; 3], law: SurfaceOpacity::ThinSlab },
        SurfaceKind::Dielectric(Dielectric::clear(1.5)),
        SurfaceKind::Dielectric(Dielectric { eta: Cauchy { a: 1.5, b: 0.01 }.channels(), absorption: [0.0; 3] }),
    ];
    let camera = parallel(DVec3::new(0.2, 0.1, 4.0), DVec3::ZERO, 2.2, [8, 8]);
    for kind in kinds {
        for environment in skies() {
            let material = SurfaceMaterial { transmission: 0.25, ..white(kind) };
            let surfaces =
                vec![Surface { mesh: &mesh, material }, Surface { mesh: &inner, material: white(SurfaceKind::Opaque) }];
            let medium = Medium::new(Density::Ball { center: DVec3::ZERO, radius: 0.7 }, 1.0, 1.0);
            let scene = Scene { surfaces, environment, media: vec![medium], ..Scene::default() };
            assert_mean(&trace(&scene, &camera, &settings(600)), |_| [1.0; 3], 4.5, &format!("{kind:?}"));
        }
    }
}

#[test]
fn closed_lambertian_box_with_a_glowing_wall_gathers_all_bounces() {
    // Inside a closed box whose walls all emit E and reflect ρ the radiance is E/(1 − ρ) everywhere.
    let mesh = box_mesh(Vec3::splat(-1.0), Vec3::splat(1.0));
    let material = SurfaceMaterial { diffuse: [0.5, 0.8, 0.0], emission: [1.0; 3], ..SurfaceMaterial::default() };
    let scene = Scene { surfaces: vec![Surface { mesh: &mesh, material }], ..Scene::default() };
    let projection = Projection::Perspective { fov_y: 1.2 };
    let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, projection, [6, 6]).unwrap();
    assert_mean(&trace(&scene, &camera, &settings(4000)), |_| [2.0, 5.0, 1.0], 4.5, "box");
}

#[test]
fn roulette_ends_paths_in_a_box_that_loses_nothing() {
    let mesh = box_mesh(Vec3::splat(-1.0), Vec3::splat(1.0));
    let surfaces = vec![Surface { mesh: &mesh, material: white(SurfaceKind::Opaque) }];
    let scene = Scene { surfaces, ..Scene::default() };
    let projection = Projection::Perspective { fov_y: 1.2 };
    let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, projection, [2, 2]).unwrap();
    let image = trace(&scene, &camera, &settings(16));
    assert!(image.radiance.mean.iter().flatten().all(|m| *m == 0.0));
}

/// The ground plane y = 0 seen from just above it, under a disk light and, if asked, a half plane at height 1 over x > 0.
fn penumbra(light: &LightSource, blocked: bool) -> Estimate {
    let ground = quad([(-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0)].map(|(x, z)| Vec3::new(x, 0.0, z)));
    let blocker = quad([(0.0, -50.0), (0.0, 50.0), (50.0, 50.0), (50.0, -50.0)].map(|(x, z)| Vec3::new(x, 1.0, z)));
    let mut surfaces = vec![Surface { mesh: &ground, material: white(SurfaceKind::Opaque) }];
    if blocked {
        surfaces.push(Surface { mesh: &blocker, material: white(SurfaceKind::Opaque) });
    }
    let scene = Scene { surfaces, lights: vec![*light], ..Scene::default() };
    let camera = Camera::look_at(
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::ZERO,
        DVec3::Z,
        Projection::Orthographic { height: 1.0 / 32.0 },
        [64, 1],
    )
    .unwrap();
    let rules = PathRules { max_bounces: Some(1), ..PathRules::default() };
    trace(&scene, &camera, &PathSettings { rules, ..settings(4000) })
}

#[test]
fn penumbra_of_a_disk_light_is_as_wide_as_similar_triangles_say() {
    // Light of radius r at height H, edge at height h: the penumbra is 2r·h/(H − h) wide around x = 0.
    let r = 1.2;
    let high = 4.0;
    let light = LightSource::Disk { center: DVec3::Y * high, normal: DVec3::NEG_Y, radius: r, radiance: [10.0; 3] };
    let half_width = r * 1.0 / (high - 1.0);
    let open = penumbra(&light, false);
    let shadowed = penumbra(&light, true);
    for k in 0..64 {
        // The image's right is −x or +x by its axes: take the place from the camera.
        let camera_right = DVec3::NEG_Y.cross(DVec3::Z).x;
        let x = ((k as f64 + 0.5) / 64.0 - 0.5) * 2.0 * camera_right;
        let o = open.radiance.mean[k][0];
        let s = shadowed.radiance.mean[k][0];
        if x > half_width {
            assert_eq!(s, 0.0, "umbra at {x}");
        } else if x < -half_width {
            assert_eq!(s, o, "full light at {x}");
        } else {
            assert!(0.0 < s && s < o, "penumbra at {x}: {s} of {o}");
        }
        if x.abs() < 1.0 / 32.0 {
            // The edge halves the disk seen from x = 0.
            assert!((s / o - 0.5).abs() < 0.05, "half light at {x}: {}", s / o);
        }
    }
    // The irradiance under the open disk at its foot: πL·r²/(r² + H²), reflected by 1/π.
    let foot = 10.0 * r * r / (r * r + high * high);
    let found = open.radiance.mean[32][0];
    let error = open.radiance.standard_error[32][0];
    assert!((found - foot).abs() < 4.0 * error + 1e-4 * foot, "{found} ± {error}, {foot}");
}

#[test]
fn environment_image_lights_a_plane_by_its_closed_form() {
    // E = Σ L·Δφ·(sin²θ₂ − sin²θ₁)/2 over the pixels of the upper half; a small sun beside a dim sky.
    let width = 16;
    let height = 8;
    let mut pixels = vec![[0.3, 0.2, 0.1]; width * height];
    pixels[width + 5] = [300.0, 200.0, 50.0];
    let ground = quad([(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)].map(|(x, z)| Vec3::new(x, 0.0, z)));
    let irradiance: [f64; 3] = std::array::from_fn(|c| {
        let edge = |y: usize| (PI * y as f64 / height as f64).sin().powi(2);
        let row = |y: usize| (0..width).map(|x| pixels[y * width + x][c]).sum::<f64>() * (edge(y + 1) - edge(y));
        (0..height / 2).map(row).sum::<f64>() * PI / width as f64
    });
    let environment = Environment::Image(LatLong::new([width, height], pixels).unwrap());
    let camera = parallel(DVec3::Y, DVec3::ZERO, 1.0, [6, 6]);
    let shiny = SurfaceMaterial { specular: 0.4, shininess: 0.0, diffuse: [0.0; 3], ..white(SurfaceKind::Opaque) };
    // Phong of exponent 0 is Lambert again: ρ_s·2/2π.
    for (material, reflectance) in [(white(SurfaceKind::Opaque), 1.0), (shiny, 0.4)] {
        let surfaces = vec![Surface { mesh: &ground, material }];
        let scene = Scene { surfaces, environment: environment.clone(), ..Scene::default() };
        let truth = irradiance.map(|e| e * reflectance / PI);
        assert_mean(&trace(&scene, &camera, &settings(3000)), |_| truth, 4.5, "sun and sky");
    }
}

#[test]
fn an_environment_that_lights_nothing_is_seen_straight_and_by_dielectrics_alone() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 3);
    let inner = box_mesh(Vec3::splat(-0.3), Vec3::splat(0.3));
    let camera = parallel(DVec3::new(0.2, 0.1, 4.0), DVec3::ZERO, 0.4, [4, 4]);
    let settings =
        PathSettings { rules: PathRules { environment_illuminates: false, ..PathRules::default() }, ..settings(400) };
    let pane = SurfaceKind::Translucent { opacity: [0.2, 0.5, 0.9], law: SurfaceOpacity::PerCrossing };
    let glass = SurfaceKind::Dielectric(Dielectric::clear(1.5));
    for environment in skies() {
        let seen = |surfaces: Vec<Surface<'_>>| {
            trace(&Scene { surfaces, environment: environment.clone(), ..Scene::default() }, &camera, &settings)
        };
        let surface = |kind: SurfaceKind| Surface { mesh: &mesh, material: white(kind) };
        assert_mean(&seen(vec![surface(glass)]), |_| [1.0; 3], 4.5, "glass");
        // Two crossings, and nothing reflected.
        assert_mean(&seen(vec![surface(pane)]), |_| [0.64, 0.25, 0.01], 4.5, "pane");
        // A white box inside of the glass is not lit by what comes through it.
        let inside = Surface { mesh: &inner, material: white(SurfaceKind::Opaque) };
        for surfaces in [vec![surface(SurfaceKind::Opaque)], vec![inside]] {
            assert!(seen(surfaces).radiance.mean.iter().flatten().all(|m| *m == 0.0));
        }
        let reflected = seen(vec![surface(glass), inside]);
        let r: f64 = 0.04;
        assert!(
            reflected.radiance.mean.iter().flatten().all(|m| *m > 0.2 * r && *m < 0.2),
            "{:?}",
            reflected.radiance.mean
        );
    }
}

#[test]
fn translucent_shadow_passes_the_product_of_the_opacities() {
    let ground = quad([(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)].map(|(x, z)| Vec3::new(x, 0.0, z)));
    let lid = box_mesh(Vec3::new(-8.0, 1.0, -8.0), Vec3::new(8.0, 2.0, 8.0));
    for (law, through) in [(SurfaceOpacity::PerCrossing, 0.7f64), (SurfaceOpacity::ThinSlab, 0.7f64.powf(1.25))] {
        let glass = SurfaceMaterial {
            kind: SurfaceKind::Translucent { opacity: [0.3; 3], law },
            diffuse: [0.0; 3],
            ..SurfaceMaterial::default()
        };
        let surfaces = vec![
            Surface { mesh: &ground, material: white(SurfaceKind::Opaque) },
            Surface { mesh: &lid, material: glass },
        ];
        let light = LightSource::Directional { direction: DVec3::new(0.6, -0.8, 0.0), irradiance: [PI; 3] };
        let scene = Scene { surfaces, lights: vec![light], ..Scene::default() };
        let camera =
            Camera::look_at(DVec3::Y * 0.5, DVec3::ZERO, DVec3::Z, Projection::Orthographic { height: 1.0 }, [4, 4])
                .unwrap();
        // Nothing here is random: E cos θ ρ/π through two crossings.
        let rules = PathRules { max_bounces: Some(1), ..PathRules::default() };
        let image = trace(&scene, &camera, &PathSettings { rules, ..settings(2) });
        let exact = 0.8 * through * through;
        assert!(
            image.radiance.mean.iter().flatten().all(|m| (m - exact).abs() < 1e-12),
            "{:?}",
            image.radiance.mean[0]
        );
    }
}

#[test]
fn glass_slab_transmits_by_all_its_inner_reflections() {
    // T = (1 − R)/(1 + R) for a plane-parallel plate; with absorption T = (1 − R)² a/(1 − R²a²), a = e^{−αd}.
    let plate = box_mesh(Vec3::new(-0.5, -1e3, -1e3), Vec3::new(0.5, 1e3, 1e3));
    let glass = Dielectric { eta: [1.5; 3], absorption: [0.0, 0.5, 2.0] };
    let surfaces = vec![Surface { mesh: &plate, material: white(SurfaceKind::Dielectric(glass)) }];
    // Bright where the azimuth is in (0, π), that is x > 0; the eye looks along +x.
    let half = Environment::Image(LatLong::new([2, 1], vec![[1.0; 3], [0.0; 3]]).unwrap());
    let scene = Scene { surfaces, environment: half, ..Scene::default() };
    let camera = parallel(DVec3::new(-5.0, 3.0, 4.0), DVec3::new(0.0, 3.0, 4.0), 1.0, [4, 4]);
    let r: f64 = 0.04;
    let truth = [0.0, 0.5, 2.0].map(|alpha: f64| {
        let a = (-alpha).exp();
        (1.0 - r).powi(2) * a / (1.0 - r * r * a * a)
    });
    assert_mean(&trace(&scene, &camera, &settings(4000)), |_| truth, 4.5, "plate");
}

/// A scene of everything, for determinism.
fn everything(mesh: &Mesh, at: DVec3, scale: f64) -> (Scene<'_>, Camera) {
    let p = |x: f64, y: f64, z: f64| at + DVec3::new(x, y, z) * scale;
    let medium = Medium {
        extinction: [2.0 / scale, 1.0 / scale, 0.5 / scale],
        asymmetry: 0.3,
        ..Medium::new(Density::Ball { center: p(0.0, 0.5, 0.0), radius: 0.8 * scale }, 0.0, 0.9)
    };
    let kind = SurfaceKind::Translucent { opacity: [0.5; 3], law: SurfaceOpacity::ThinSlab };
    let material = SurfaceMaterial { kind, specular: 0.2, transmission: 0.3, ..SurfaceMaterial::default() };
    let lights = vec![
        LightSource::Point { position: p(0.1, 0.7, 0.0), intensity: [scale * scale; 3] },
        LightSource::Sphere { center: p(0.0, 3.0, 1.0), radius: 0.5 * scale, radiance: [2.0; 3] },
    ];
    let surfaces = vec![Surface { mesh, material }];
    let scene = Scene { media: vec![medium], surfaces, lights, ..Scene::default() };
    let camera =
        Camera::look_at(p(0.5, 1.0, 4.0), p(0.0, 0.0, 0.0), DVec3::Y, Projection::Perspective { fov_y: 0.7 }, [16, 12]);
    (scene, camera.unwrap())
}

fn bits(image: &Estimate) -> Vec<u64> {
    let s = &image.radiance;
    s.mean.iter().chain(&s.standard_error).flatten().map(|v| v.to_bits()).collect()
}

#[test]
fn x1_any_number_of_threads_and_any_batch_give_the_same_bits() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 2);
    let (scene, camera) = everything(&mesh, DVec3::ZERO, 1.0);
    let run = |threads, batch| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        bits(&pool.install(|| trace(&scene, &camera, &PathSettings { batch, ..settings(24) })))
    };
    let one = run(1, 24);
    for (threads, batch) in [(2, 24), (3, 5), (7, 1)] {
        assert!(run(threads, batch) == one, "{threads} threads, batches of {batch}");
    }
}

#[test]
fn bs_scaling_by_powers_of_two_gives_the_same_bits() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 2);
    let (scene, camera) = everything(&mesh, DVec3::ZERO, 1.0);
    let one = bits(&trace(&scene, &camera, &settings(16)));
    for k in [-40, -10, 10, 40] {
        let scale = f64::from(k).exp2();
        let mut scaled = mesh.clone();
        scaled.position.iter_mut().for_each(|p| *p *= scale as f32);
        let (scene, camera) = everything(&scaled, DVec3::ZERO, scale);
        assert!(bits(&trace(&scene, &camera, &settings(16))) == one, "scale 2^{k}");
    }
}

#[test]
fn bs_far_from_the_origin_the_image_stays() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 2);
    let far = DVec3::splat(1e7);
    let moved = Mesh { origin: far, ..mesh.clone() };
    let (scene, camera) = everything(&mesh, DVec3::ZERO, 1.0);
    let here = trace(&scene, &camera, &settings(64));
    let (scene, camera) = everything(&moved, far, 1.0);
    let there = trace(&scene, &camera, &settings(64));
    let truth = there.radiance.mean.clone();
    // The same random numbers, so that most pixels agree far closer than their errors; a path that rounding sends
    // another way is one more sample.
    assert_mean(&here, |k| truth[k], 4.0, "moved");
    let close = (0..truth.len()).filter(|k| (here.radiance.mean[*k][1] - truth[*k][1]).abs() <= 1e-6).count();
    assert!(close * 10 >= truth.len() * 9, "{close} of {}", truth.len());
}

#[test]
fn adaptive_sampling_stops_at_the_target() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 2);
    let (mut scene, camera) = everything(&mesh, DVec3::ZERO, 1.0);
    // A light inside a medium has errors that fall slowly.
    scene.lights.remove(0);
    let target = PathSettings { target_relative_error: Some(0.1), batch: 8, samples: 5000, ..settings(8) };
    let image = trace(&scene, &camera, &PathSettings { batch: 8, ..target });
    assert!(image.relative_error() <= 0.1 && image.samples < 5000 && image.samples.is_multiple_of(8));
    let fewer = trace(&scene, &camera, &settings(image.samples - 8));
    assert!(fewer.relative_error() > 0.1);
}

#[test]
fn cancelled_work_says_so() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 1);
    let (scene, camera) = everything(&mesh, DVec3::ZERO, 1.0);
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(path_trace(&scene, &camera, &settings(8), Some(&progress)), Err(Error::Cancelled));
}

#[test]
fn broken_input_is_refused() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 1);
    let camera = parallel(DVec3::Z, DVec3::ZERO, 1.0, [2, 2]);
    let refused = |edit: &dyn Fn(&mut Scene<'_>)| {
        let (mut scene, _) = everything(&mesh, DVec3::ZERO, 1.0);
        edit(&mut scene);
        path_trace(&scene, &camera, &settings(2), None).is_err()
    };
    assert!(!refused(&|_| ()));
    assert!(refused(&|s| s.media[0].extinction[1] = f64::NAN));
    assert!(refused(&|s| s.media[0].albedo[0] = 1.5));
    assert!(refused(&|s| s.media[0].asymmetry = 1.0));
    assert!(refused(&|s| s.media[0].density = Density::Ball { center: DVec3::ZERO, radius: -1.0 }));
    assert!(refused(&|s| s.surfaces[0].material.diffuse[2] = 2.0));
    assert!(refused(&|s| s.lights[0] = LightSource::Directional { direction: DVec3::ONE, irradiance: [1.0; 3] }));
    assert!(refused(&|s| s.background = Some([f64::INFINITY; 3])));
    assert!(refused(&|s| s.environment = Environment::Constant([-1.0; 3])));
}
