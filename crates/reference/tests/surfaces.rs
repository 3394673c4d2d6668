//! Ordered surfaces and exact visibility against closed forms and brute force.

use crate::support::{ball_mesh, box_mesh, parallel};
use reference::{
    Density, ImplicitSurface, LightSource, MarchParams, Medium, Ray, RootParams, Scene, Surface, SurfaceKind,
    SurfaceMaterial, SurfaceScene, Visibility, composite_surfaces, march_image, optical_depth,
};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{DAabb, Mesh, ScalarField, rng};
use std::f64::consts::PI;

/// |p − center|² − r², with the exact bound over a ball.
struct Ball {
    center: DVec3,
    radius: f64,
}

impl ScalarField for Ball {
    fn value(&self, p: DVec3) -> f64 {
        (p - self.center).length_squared() - self.radius * self.radius
    }
    fn gradient(&self, p: DVec3) -> DVec3 {
        2.0 * (p - self.center)
    }
    fn hessian(&self, _: DVec3) -> DMat3 {
        DMat3::from_diagonal(DVec3::splat(2.0))
    }
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let d = (p - self.center).length();
        let square = |v: f64| v * v - self.radius * self.radius;
        Some((square((d - radius).max(0.0)), square(d + radius)))
    }
}

fn glass(alpha: f64, law: SurfaceOpacity) -> SurfaceMaterial {
    let kind = SurfaceKind::Translucent { opacity: [alpha; 3], law };
    SurfaceMaterial { kind, diffuse: [0.0; 3], glow: [1.0; 3], ..SurfaceMaterial::default() }
}

fn around(center: DVec3, reach: f64) -> DAabb {
    DAabb::around(center, DVec3::splat(reach))
}

#[test]
fn nested_balls_composite_in_the_order_of_their_shells() {
    let balls = [1.0, 0.6, 0.3].map(|radius| Ball { center: DVec3::ZERO, radius });
    let colors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let alpha = 0.3;
    for law in [SurfaceOpacity::PerCrossing, SurfaceOpacity::ThinSlab] {
        let implicit = |k: usize| ImplicitSurface {
            field: &balls[k],
            bounds: around(DVec3::ZERO, 1.1),
            color: colors[k],
            material: glass(alpha, law),
        };
        let scene = SurfaceScene { implicits: (0..3).map(implicit).collect(), ..SurfaceScene::default() };
        let camera = parallel(DVec3::Z * 3.0, DVec3::ZERO, 2.2, [10, 10]);
        let image = composite_surfaces(&scene, &camera, None).unwrap();
        assert!(image.proven && image.unresolved == 0);
        for k in 0..100 {
            let at = |i: usize| ((i as f64 + 0.5) / 10.0 - 0.5) * 2.2;
            let apart = at(k % 10).hypot(at(k / 10));
            // Shells from the outside in, then out again; cos θ = √(1 − b²/r²).
            let crossed: Vec<usize> = (0..3).filter(|b| apart < balls[*b].radius).collect();
            let mut expected = [0.0; 3];
            let mut left = 1.0;
            for b in crossed.iter().chain(crossed.iter().rev()) {
                let cosine = (1.0 - (apart / balls[*b].radius).powi(2)).sqrt();
                let power = if law == SurfaceOpacity::ThinSlab { 1.0 / cosine } else { 1.0 };
                let keep = (1.0f64 - alpha).powf(power);
                expected[*b] += left * (1.0 - keep);
                left *= keep;
            }
            assert_eq!(image.crossings[k] as usize, 2 * crossed.len(), "pixel {k}");
            assert!((image.transmittance[k][0] - left).abs() < 1e-12, "pixel {k}: {}", image.transmittance[k][0]);
            (0..3).for_each(|c| assert!((image.radiance[k][c] - expected[c]).abs() < 1e-12, "pixel {k}"));
        }
    }
}

#[test]
fn opaque_ball_is_lit_by_lambert_and_shadows_itself() {
    let ball = Ball { center: DVec3::new(3.0, 1.0, -2.0), radius: 1.0 };
    let material = SurfaceMaterial { diffuse: [0.8; 3], ..SurfaceMaterial::default() };
    let implicit =
        ImplicitSurface { field: &ball, bounds: around(ball.center, 1.5), color: [1.0, 0.5, 0.25], material };
    let to_light = DVec3::new(0.6, 0.0, 0.8);
    let lights = vec![LightSource::Directional { direction: -to_light, irradiance: [PI; 3] }];
    for shadows in [false, true] {
        let implicits = vec![implicit];
        let scene = SurfaceScene { implicits, lights: lights.clone(), shadows, ..SurfaceScene::default() };
        let camera = parallel(ball.center + DVec3::Z * 3.0, ball.center, 2.2, [9, 9]);
        let image = composite_surfaces(&scene, &camera, None).unwrap();
        for k in 0..81 {
            let at = |i: usize| ((i as f64 + 0.5) / 9.0 - 0.5) * 2.2;
            let x = at(k % 9);
            let y = -at(k / 9);
            let z_sq = 1.0 - x * x - y * y;
            let cosine = if z_sq > 0.0 { DVec3::new(x, y, z_sq.sqrt()).dot(to_light).max(0.0) } else { 0.0 };
            for (c, color) in [1.0, 0.5, 0.25].into_iter().enumerate() {
                let found = image.radiance[k][c];
                assert!((found - 0.8 * color * cosine).abs() < 1e-9, "shadows {shadows}, pixel {k}: {found}");
            }
        }
    }
}

#[test]
fn implicit_and_mesh_of_one_ball_agree() {
    let ball = Ball { center: DVec3::ZERO, radius: 1.0 };
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 6);
    let material = glass(0.4, SurfaceOpacity::PerCrossing);
    let camera = parallel(DVec3::new(0.3, 0.4, 3.0), DVec3::ZERO, 1.2, [8, 8]);
    let implicits = vec![ImplicitSurface { field: &ball, bounds: around(DVec3::ZERO, 1.1), color: [1.0; 3], material }];
    let of_field = SurfaceScene { implicits, ..SurfaceScene::default() };
    let of_mesh = SurfaceScene { meshes: vec![Surface { mesh: &mesh, material }], ..SurfaceScene::default() };
    let render = |s: &SurfaceScene<'_>| composite_surfaces(s, &camera, None).unwrap();
    let a = render(&of_field);
    let b = render(&of_mesh);
    // Away from the rim both cross the shell twice.
    assert!(a.crossings.iter().chain(&b.crossings).all(|c| *c == 2));
    for k in 0..64 {
        assert!((a.radiance[k][0] - b.radiance[k][0]).abs() < 1e-12 && (a.radiance[k][0] - 0.64).abs() < 1e-12);
    }
}

fn soup(n: u64) -> Mesh {
    let u = |i: u64, k: u64| rng::unit_f32(9, 0, i, k) - 0.5;
    let vertex = |i: u64| {
        let at = Vec3::new(u(i / 3, 10), u(i / 3, 11), u(i / 3, 12));
        at + 0.2 * Vec3::new(u(i, 0), u(i, 1), u(i, 2))
    };
    Mesh {
        position: (0..3 * n).map(vertex).collect(),
        triangles: (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    }
}

/// Plane and barycentric coordinates by Cramer's rule: shares nothing with the sheared edge functions.
fn brute_force(mesh: &Mesh, ray: &Ray) -> Vec<(f64, u32)> {
    let mut hits: Vec<(f64, u32)> = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|v| mesh.origin + mesh.position[v as usize].as_dvec3());
        let m = DMat3::from_cols(a - b, a - c, ray.direction);
        let solved = m.inverse() * (a - ray.origin);
        if m.determinant() != 0.0 && solved.x >= 0.0 && solved.y >= 0.0 && solved.x + solved.y <= 1.0 && solved.z > 0.0
        {
            hits.push((solved.z, i as u32));
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

#[test]
fn closest_any_and_all_hits_are_those_of_brute_force() {
    let mesh = soup(3000);
    for far in [DVec3::ZERO, DVec3::splat(1e7)] {
        let mesh = Mesh { origin: far, ..mesh.clone() };
        let visibility = Visibility::new(&[&mesh]).unwrap();
        let mut hits = Vec::new();
        let mut met = 0;
        for i in 0..400 {
            let u = |k| rng::unit(21, 0, i, k) - 0.5;
            let distance = [0.5, 3.0, 1000.0][i as usize % 3];
            let from = DVec3::new(u(0), u(1), u(2)).normalize() * distance;
            let target = DVec3::new(u(3), u(4), u(5)) * 0.8;
            let ray = Ray { origin: far + from, direction: (target - from).normalize() };
            let expected = brute_force(&mesh, &ray);
            visibility.hits(&ray, f64::INFINITY, &mut hits);
            let ids: Vec<u32> = hits.iter().map(|h| h.triangle).collect();
            assert_eq!(ids, expected.iter().map(|h| h.1).collect::<Vec<_>>(), "ray {i} from {far}");
            let closest = visibility.closest(&ray, f64::INFINITY);
            assert_eq!(closest.map(|h| h.triangle), expected.first().map(|h| h.1), "ray {i}");
            assert_eq!(visibility.is_occluded(&ray, f64::INFINITY), !expected.is_empty());
            if let (Some(hit), Some(first)) = (closest, expected.first()) {
                met += 1;
                assert!((hit.t - first.0).abs() < 1e-6 * first.0 + 1e-9 * far.x, "{} {}", hit.t, first.0);
                assert!(!visibility.is_occluded(&ray, hit.t) && visibility.closest(&ray, hit.t).is_none());
            }
        }
        assert!(met > 100, "{met} rays met anything");
    }
}

#[test]
fn aligned_rays_cross_a_closed_box_twice() {
    // Rays through corners, edges and diagonals, parallel to axes: no leak, no double count.
    let mesh = box_mesh(Vec3::splat(-1.0), Vec3::splat(1.0));
    let visibility = Visibility::new(&[&mesh]).unwrap();
    let mut hits = Vec::new();
    for i in -3..=3 {
        for j in -3..=3 {
            let ray = Ray { origin: DVec3::new(f64::from(i) / 4.0, f64::from(j) / 4.0, 5.0), direction: DVec3::NEG_Z };
            visibility.hits(&ray, f64::INFINITY, &mut hits);
            let t: Vec<f64> = hits.iter().map(|h| h.t).collect();
            assert_eq!(t, [4.0, 6.0], "{i} {j}");
        }
    }
    assert!(Visibility::new(&[]).unwrap().closest(&Ray { origin: DVec3::ZERO, direction: DVec3::X }, 1.0).is_none());
}

#[test]
fn solid_of_a_field_has_the_optical_depth_of_its_chords() {
    let ball = Ball { center: DVec3::new(0.1, 0.2, 0.3), radius: 0.75 };
    let density = Density::Inside { field: &ball, bounds: around(ball.center, 1.0) };
    let medium = Medium { extinction: [1.0, 2.0, 3.0], ..Medium::new(density, 0.0, 0.0) };
    for k in 0..20 {
        let apart = f64::from(k) * 0.05;
        let ray = Ray { origin: ball.center + DVec3::new(apart, 0.0, 4.0), direction: DVec3::NEG_Z };
        let found = optical_depth(&[medium], &ray, 0.0, f64::INFINITY, &MarchParams::default());
        let chord = 2.0 * (0.75f64 * 0.75 - apart * apart).max(0.0).sqrt();
        (0..3).for_each(|c| assert!((found.value[c] - chord * (c + 1) as f64).abs() < 1e-12, "{k}: {found:?}"));
    }
}

#[test]
fn procedural_density_is_marched_within_its_stated_error() {
    // ∫ e^{−t²/2s²} dt = s√(2π) along a ray through the middle of a Gaussian.
    let sigma = 0.05;
    let gauss = move |p: DVec3| (-p.length_squared() / (2.0 * sigma * sigma)).exp();
    let density = Density::Function { function: &gauss, bounds: around(DVec3::ZERO, 1.0), majorant: 1.0 };
    let medium = Medium { emission: [2.0; 3], ..Medium::new(density, 40.0, 0.0) };
    let camera = parallel(DVec3::Z * 3.0, DVec3::ZERO, 0.4, [7, 7]);
    let scene = Scene { media: vec![medium], ..Scene::default() };
    for tolerance in [1e-3, 1e-6, 1e-10] {
        let params = MarchParams { relative_tolerance: tolerance, ..MarchParams::default() };
        let image = march_image(&scene, &camera, &params, None).unwrap();
        for k in 0..49 {
            let at = |i: usize| ((i as f64 + 0.5) / 7.0 - 0.5) * 0.4;
            let apart = at(k % 7).hypot(at(k / 7));
            let depth = 40.0 * sigma * (2.0 * PI).sqrt() * (-apart * apart / (2.0 * sigma * sigma)).exp();
            // Emission alone: S(1 − e^−τ), whatever the profile.
            let exact = -2.0 * (-depth).exp_m1();
            let off = (image.radiance[k][0] - exact).abs();
            assert!(off <= image.error[k][0] + 1e-15, "{tolerance:e} pixel {k}: off {off:e}, {:e}", image.error[k][0]);
            assert!(image.error[k][0] <= 2.0 * tolerance * exact + 1e-15, "{:e}", image.error[k][0]);
            assert!((image.transmittance[k][0] - (-depth).exp()).abs() <= tolerance, "pixel {k}");
        }
    }
}

#[test]
fn unknown_bounds_are_said() {
    struct NoBound(Ball);
    impl ScalarField for NoBound {
        fn value(&self, p: DVec3) -> f64 {
            self.0.value(p)
        }
        fn gradient(&self, p: DVec3) -> DVec3 {
            self.0.gradient(p)
        }
        fn hessian(&self, p: DVec3) -> DMat3 {
            self.0.hessian(p)
        }
        fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
            None
        }
    }
    let ball = NoBound(Ball { center: DVec3::ZERO, radius: 1.0 });
    let ray = Ray { origin: DVec3::Z * 3.0, direction: DVec3::NEG_Z };
    let found = reference::crossings(&ball, &ray, 0.0, 6.0, &RootParams::default());
    assert!(!found.proven && found.roots == [2.0, 4.0], "{found:?}");
}
