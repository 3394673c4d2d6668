//! Matter that surfaces bound: what is mirrored, bent and absorbed.

use crate::floored::by_turns;
use crate::scenes::{Asked, Scene, camera, disc, parallel, plane, sphere};
use deferred_blend::{Bending, Floors, Layering, Params};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Accumulator, Cloud, Material, Splat, SplatKind};

const MODES: [Bending; 3] = [Bending::Traced, Bending::Power, Bending::Nearest];

/// Everything is composited.
const WHOLE: Params = Params { disc_scale: 0.6, gap: 0.5, transmittance_cutoff: 0.0 };

fn in_sky(bending: Bending, sky: &(dyn Fn(Vec3, f32) -> [f32; 3] + Sync)) -> Asked<'_> {
    Asked { bending, sky, straight: false, unit: 1.0 }
}

/// Clear discs of some index.
fn clear(mut cloud: Cloud, index: [f32; 3], view: splat_core::Camera) -> Scene {
    cloud.crossing_depth.fill(0.0);
    cloud.cross_section.fill(0.0);
    let mut scene = Scene::new(cloud, view);
    scene.materials = vec![Material { index: Some(index), ..Material::default() }];
    scene
}

fn ball(opacity: f32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 2000, opacity);
    cloud
}

/// Two planes, `apart` apart across z.
fn slab(apart: f32, half: i32, opacity: f32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for z in [0.0, -apart] {
        plane(&mut cloud, Vec3::Z * z, Vec3::Z, half, &disc(Vec3::ZERO, Vec3::Z, 0.1, opacity));
    }
    cloud
}

fn through(picture: &Accumulator, channel: usize, k: usize) -> f64 {
    libm::exp(-f64::from(picture.optical_depth[channel][k]))
}

/// The share of unpolarised light that is mirrored, by the sine of the angle and the ratio of the sine beyond to it.
fn fresnel(eta: f64, sine: f64) -> f64 {
    let c = (1.0 - sine * sine).sqrt();
    let t = (1.0 - (eta * sine).powi(2)).sqrt();
    0.5 * (((eta * c - t) / (eta * c + t)).powi(2) + ((c - eta * t) / (c + eta * t)).powi(2))
}

#[test]
fn clear_glass_in_a_white_world_is_not_seen() {
    let view = camera(DVec3::new(0.3, 0.4, 4.0), [48, 36]);
    for index in [[1.01; 3], [1.5; 3], [2.4; 3], [0.7; 3], [1.4, 1.45, 1.5]] {
        for bending in MODES {
            let scene = clear(ball(0.0), index, view);
            let (picture, glass) = scene.draw_glass(&WHOLE, &in_sky(bending, &|_, _| [1.0; 3]), &[]);
            let mut mirrored = 0.0;
            for k in 0..48 * 36 {
                for c in 0..3 {
                    // What is not bent is seen straight on, and is white too.
                    let behind = if glass.behind[k][c].is_nan() { 1.0 } else { glass.behind[k][c] };
                    let sum = f64::from(glass.mirrored[k][c]) + through(&picture, c, k) * f64::from(behind);
                    assert!((sum - 1.0).abs() < 1e-6, "{index:?} {bending:?} pixel {k}: {sum}");
                    mirrored += f64::from(glass.mirrored[k][c]);
                }
            }
            assert!(mirrored > 0.0);
        }
    }
}

/// Figures 18 c, 18 d and 20 of the paper: mirrored and bent by its own algorithms.
#[test]
fn glass_is_drawn_by_the_papers_algorithms_as_by_gaps() {
    let view = camera(DVec3::new(0.2, 0.1, 3.0), [33, 24]);
    for layers in [1, 2, 3] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for l in 0..layers {
            plane(&mut cloud, Vec3::Z * (-0.5 * l as f32), Vec3::Z, 60, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.3));
        }
        let mut scene = Scene::new(cloud, view);
        let absorption_inside = [0.1, 0.2, 0.3];
        scene.materials = vec![Material { index: Some([1.3, 1.35, 1.4]), absorption_inside, ..Material::default() }];
        let groups = by_turns(&scene.cloud, 1);
        let floors = Floors { groups: &groups, steps: 1000 };
        for bending in MODES {
            let asked = in_sky(bending, &|d, _| d.into());
            let (gaps, bent) = scene.draw_glass(&WHOLE, &asked, &[]);
            for layering in [Layering::Algorithm1(floors), Layering::Algorithm2(floors)] {
                let (picture, glass) = scene.draw_glass_by(&WHOLE, layering, &asked, &[]);
                for k in 0..33 * 24 {
                    let what = format!("{layers} layers, {bending:?}, {layering:?}, pixel {k}");
                    let apart = |a: [f32; 3], b: [f32; 3]| (Vec3::from(a) - Vec3::from(b)).length();
                    assert!(apart(glass.behind[k], bent.behind[k]) < 1e-6, "{what}: behind");
                    assert!(apart(glass.mirrored[k], bent.mirrored[k]) < 1e-6, "{what}: mirrored");
                    for c in 0..3 {
                        let [found, expected] = [through(&picture, c, k), through(&gaps, c, k)];
                        assert!((found - expected).abs() < 1e-5, "{what}: {found} for {expected}");
                    }
                }
            }
        }
    }
}

#[test]
fn clear_glass_in_a_white_world_is_not_seen_by_the_papers_algorithms() {
    let view = camera(DVec3::new(0.3, 0.4, 4.0), [48, 36]);
    let scene = clear(ball(0.0), [1.4, 1.45, 1.5], view);
    let groups = by_turns(&scene.cloud, 4);
    let floors = Floors { groups: &groups, steps: 16 };
    for layering in [Layering::Algorithm1(floors), Layering::Algorithm2(floors)] {
        for bending in MODES {
            let (picture, glass) = scene.draw_glass_by(&WHOLE, layering, &in_sky(bending, &|_, _| [1.0; 3]), &[]);
            assert!(glass.mirrored.iter().any(|mirrored| mirrored[1] > 0.5), "rims mirror nearly all");
            for k in 0..48 * 36 {
                for c in 0..3 {
                    let behind = if glass.behind[k][c].is_nan() { 1.0 } else { glass.behind[k][c] };
                    let sum = f64::from(glass.mirrored[k][c]) + through(&picture, c, k) * f64::from(behind);
                    assert!((sum - 1.0).abs() < 1e-6, "{layering:?} {bending:?} pixel {k}: {sum}");
                }
            }
        }
    }
}

#[test]
fn an_index_of_one_changes_no_bit() {
    let view = camera(DVec3::new(0.3, 0.4, 4.0), [48, 36]);
    let plain = {
        let mut accumulator = Accumulator::new([48, 36], 3, 3, false, false);
        Scene::new(ball(0.4), view).draw_into(&WHOLE, &[], &mut accumulator);
        accumulator
    };
    for bending in MODES {
        let mut scene = Scene::new(ball(0.4), view);
        // Another material bends, so that the way of each ray is followed.
        scene.materials = vec![Material::default(), Material { index: Some([1.5; 3]), ..Material::default() }];
        let (picture, glass) = scene.draw_glass(&WHOLE, &in_sky(bending, &|_, _| [7.0; 3]), &[]);
        assert_eq!((&picture.optical_depth, &picture.channels), (&plain.optical_depth, &plain.channels));
        assert!(glass.behind.iter().all(|b| b[0].is_nan()) && glass.mirrored.iter().all(|m| *m == [0.0; 3]));
    }
}

#[test]
fn a_slab_shifts_rays_and_leaves_their_direction() {
    let size = [32, 24];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    let scene = clear(slab(0.5, 40, 0.0), [1.5; 3], view);
    let (_, glass) = scene.draw_glass(&WHOLE, &in_sky(Bending::Traced, &|d, _| d.into()), &[]);
    for (k, behind) in glass.behind.iter().enumerate() {
        let (from, along) = view.view_ray((k % 32) as f64 + 0.5, (k / 32) as f64 + 0.5);
        assert_eq!(from, DVec3::ZERO);
        let along = along.normalize();
        // At the second surface a part is mirrored, and is told what the sky has where it goes inside.
        let sine = along.x.hypot(along.y);
        let within = DVec3::new(along.x / 1.5, along.y / 1.5, (1.0 - (sine / 1.5).powi(2)).sqrt());
        let share = fresnel(1.5, sine / 1.5);
        // The camera looks along −z; its own space has z ahead.
        let [direct, mirrored] = [along, within].map(|d| DVec3::new(d.x, d.y, d.z.abs()));
        let expected = direct * (1.0 - share) + mirrored * DVec3::new(1.0, 1.0, -1.0) * share;
        let apart = (Vec3::from(*behind) - expected.as_vec3()).length();
        assert!(apart < 1e-5, "pixel {k}: {apart:e}");
    }
}

#[test]
fn layers_of_the_paper_bend_by_a_power() {
    let size = [33, 24];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    for (index, layers) in [(1.3f32, 1), (1.3, 2), (1.1, 5), (0.9, 2)] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for l in 0..layers {
            plane(&mut cloud, Vec3::Z * (-0.5 * l as f32), Vec3::Z, 60, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.3));
        }
        let mut scene = Scene::new(cloud, view);
        scene.materials = vec![Material { index: Some([index; 3]), ..Material::default() }];
        let (picture, glass) = scene.draw_glass(&WHOLE, &in_sky(Bending::Power, &|d, _| d.into()), &[]);
        for (k, behind) in glass.behind.iter().enumerate() {
            let (_, along) = view.view_ray((k % 33) as f64 + 0.5, (k / 33) as f64 + 0.5);
            let along = along.normalize();
            let sine = along.x.hypot(along.y);
            let eta = (1.0 / f64::from(index)).powi(layers);
            let found = f64::from(behind[0]).hypot(f64::from(behind[1]));
            assert!((found - eta * sine).abs() < 1e-5, "{index} {layers} pixel {k}: {found} for {}", eta * sine);
            // Eq. 15, and what is mirrored at the nearest layer.
            let passes = 0.7f64.powi(layers) * (1.0 - fresnel(eta, sine));
            assert!((through(&picture, 1, k) - passes).abs() < 1e-5, "{index} {layers} pixel {k}");
        }
    }
}

#[test]
fn opacities_of_one_object_are_those_of_its_nearest_layer_by_power_alone() {
    let view = parallel(DVec3::Z * 3.0, 0.5, [8, 8]);
    let mut cloud = slab(0.5, 30, 0.3);
    // The farther plane is thinner.
    let half = cloud.len() / 2;
    cloud.crossing_depth[half..].fill(0.0);
    cloud.cross_section[half..].fill(0.0);
    let mut scene = Scene::new(cloud, view);
    scene.materials = vec![Material { absorption_inside: [1e-9; 3], ..Material::default() }];
    for (bending, expected) in [(Bending::Traced, 0.7), (Bending::Nearest, 0.7), (Bending::Power, 0.49)] {
        let (picture, _) = scene.draw_glass(&WHOLE, &in_sky(bending, &|_, _| [1.0; 3]), &[]);
        assert!((through(&picture, 1, 27) - expected).abs() < 1e-6, "{bending:?}: {}", through(&picture, 1, 27));
    }
}

#[test]
fn matter_absorbs_between_its_surfaces_and_before_what_is_opaque() {
    let size = [16, 12];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    let mut scene = clear(slab(0.5, 40, 0.0), [1.0; 3], view);
    scene.materials[0].absorption_inside = [0.2, 1.0, 3.0];
    for (opaque, depth) in [(vec![], 0.5), (vec![3.2; 16 * 12], 0.2)] {
        let glass = Asked { unit: 2.0, ..in_sky(Bending::Traced, &|_, _| [1.0; 3]) };
        let (picture, _) = scene.draw_glass(&WHOLE, &glass, &opaque);
        for k in 0..16 * 12 {
            let (_, along) = view.view_ray((k % 16) as f64 + 0.5, (k / 16) as f64 + 0.5);
            for (c, absorption) in [0.2, 1.0, 3.0].into_iter().enumerate() {
                let expected = (-absorption * depth * 2.0 * along.length()).exp();
                let found = through(&picture, c, k);
                assert!((found - expected).abs() < 1e-5, "channel {c} pixel {k}: {found} for {expected}");
            }
        }
    }
}

#[test]
fn db13_glass_is_the_same_whichever_way_its_normals_point() {
    let view = camera(DVec3::new(0.3, 0.4, 4.0), [48, 36]);
    let drawn = |every: usize| {
        let mut cloud = ball(0.0);
        cloud.normal.iter_mut().step_by(every).for_each(|n| *n = -*n);
        clear(cloud, [1.5; 3], view).draw_glass(&WHOLE, &in_sky(Bending::Traced, &|d, _| (d + Vec3::ONE).into()), &[]).1
    };
    let whole = drawn(1);
    let third = drawn(3);
    for (a, b) in whole.behind.iter().zip(&third.behind).filter(|(a, _)| !a[0].is_nan()) {
        assert!((Vec3::from(*a) - Vec3::from(*b)).length() < 1e-4, "{a:?} {b:?}");
    }
}

/// A slab before a wall whose colour is its place, seen from the front.
fn slab_before_a_wall(view: splat_core::Camera) -> Scene {
    let mut cloud = slab(0.5, 40, 0.0);
    let glass = cloud.len();
    let wall = Splat { kind: SplatKind::Opaque, object: 1, ..disc(Vec3::ZERO, Vec3::Z, 0.05, 0.9) };
    plane(&mut cloud, Vec3::Z * -1.5, Vec3::Z, 80, &wall);
    for i in glass..cloud.len() {
        cloud.color[i] = [cloud.position[i].x + 9.0, cloud.position[i].y + 9.0, 1.0];
    }
    clear(cloud, [1.5; 3], view)
}

#[test]
fn from_within_a_ball_its_matter_absorbs_and_its_surface_is_left() {
    let size = [24, 18];
    let view = camera(DVec3::new(0.0, 0.0, 1e-3), size);
    let drawn = |flip: bool| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        sphere(&mut cloud, Vec3::ZERO, 1.0, 20_000, 0.0);
        cloud.normal.iter_mut().step_by(if flip { 2 } else { usize::MAX }).for_each(|n| *n = -*n);
        let mut scene = clear(cloud, [1.5; 3], view);
        scene.materials[0].absorption_inside = [0.2, 1.0, 3.0];
        scene.draw_glass(&WHOLE, &in_sky(Bending::Traced, &|d, _| [d.x + 1.0, d.y + 1.0, 1.0]), &[])
    };
    for (picture, glass) in [drawn(false), drawn(true)] {
        for k in 0..24 * 18 {
            let (_, along) = view.view_ray((k % 24) as f64 + 0.5, (k / 24) as f64 + 0.5);
            let along = along.normalize();
            // Rays from the middle meet the surface head-on: 4 % are mirrored, the rest goes straight on.
            for (c, absorption) in [0.2f64, 1.0, 3.0].into_iter().enumerate() {
                let expected = 0.96 * (-absorption).exp();
                let found = through(&picture, c, k);
                assert!((found / expected - 1.0).abs() < 0.02, "channel {c} pixel {k}: {found} for {expected}");
            }
            let behind = glass.behind[k];
            let apart = (f64::from(behind[0]) - 1.0 - along.x).hypot(f64::from(behind[1]) - 1.0 - along.y);
            assert!(apart < 0.05, "pixel {k}: {behind:?} for {along}");
        }
    }
}

#[test]
fn a_wall_behind_glass_is_seen_where_the_bent_ray_meets_it() {
    let size = [40, 30];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    let scene = slab_before_a_wall(view);
    let opaque = [4.5; 40 * 30];
    let (_, seen) = scene.draw_glass(&WHOLE, &in_sky(Bending::Traced, &|_, _| [9.0; 3]), &opaque);
    let mut worst = 0.0f64;
    let mut straight = f64::INFINITY;
    for (k, behind) in seen.behind.iter().enumerate() {
        let (_, along) = view.view_ray((k % 40) as f64 + 0.5, (k / 40) as f64 + 0.5);
        let unit = along.normalize();
        let sine = unit.x.hypot(unit.y);
        // Across the slab the tangent is that of the angle within.
        let outside = sine / (1.0 - sine * sine).sqrt();
        let inside = sine / 1.5 / (1.0 - (sine / 1.5).powi(2)).sqrt();
        let off = outside * (3.0 + 1.0) + inside * 0.5;
        let expected = [along.x, along.y].map(|v| off * v / along.x.hypot(along.y));
        // What is mirrored at the second surface sees the sky, which is 9 as the middle of the wall.
        let share = fresnel(1.5, sine / 1.5);
        assert!((f64::from(behind[2]) - (1.0 + 8.0 * share)).abs() < 1e-5, "pixel {k}: {behind:?}");
        let bent = [0, 1].map(|c| (f64::from(behind[c]) - 9.0) / (1.0 - share));
        worst = worst.max((bent[0] - expected[0]).hypot(bent[1] - expected[1]));
        straight = straight.min(if sine > 0.3 { (along.x.hypot(along.y) * 4.5 - off).abs() } else { f64::INFINITY });
    }
    // Colours are blended over discs that lie 0.05 apart, jittered: half of that.
    assert!(worst < 0.025 && straight > 0.05, "{worst}, a straight ray is {straight} off");
    // The paper's way: opaque surfaces straight on.
    let asked = Asked { straight: true, ..in_sky(Bending::Traced, &|_, _| [9.0; 3]) };
    let (_, seen) = scene.draw_glass(&WHOLE, &asked, &opaque);
    assert!(seen.behind.iter().all(|b| b[0].is_nan()));
}

#[test]
fn opaque_surfaces_hide_what_is_behind_them_and_end() {
    let view = camera(DVec3::new(0.0, 0.0, 3.0), [40, 30]);
    let mut cloud = slab(0.2, 40, 0.0);
    let near =
        Splat { color: [0.0, 1.0, 0.0], kind: SplatKind::Opaque, object: 1, ..disc(Vec3::ZERO, Vec3::Z, 0.05, 0.9) };
    plane(&mut cloud, Vec3::Z * -1.0, Vec3::Z, 6, &near);
    plane(&mut cloud, Vec3::Z * -2.0, Vec3::Z, 12, &Splat { color: [1.0, 0.0, 0.0], object: 2, ..near });
    let pane = clear(cloud, [1.0001; 3], view);
    let (_, seen) = pane.draw_glass(&WHOLE, &in_sky(Bending::Traced, &|_, _| [0.0, 0.0, 1.0]), &[]);
    let at = |x: usize, y: usize| seen.behind[y * 40 + x].map(|v| (v * 1e4).round() / 1e4);
    assert_eq!(at(20, 15), [0.0, 1.0, 0.0]);
    assert_eq!(at(24, 15), [1.0, 0.0, 0.0], "beside the near wall");
    assert_eq!(at(36, 15), [0.0, 0.0, 1.0], "beside both");
}

/// Where a ray leaves a ball of glass, by the laws of Snell and Fresnel alone.
fn through_a_ball(from: DVec3, along: DVec3, index: f64) -> Option<DVec3> {
    let along = along.normalize();
    let b = from.dot(along);
    let root = (b * b - from.length_squared() + 1.0).sqrt();
    let normal = (!root.is_nan()).then(|| from + along * (-b - root))?;
    let bend = |along: DVec3, normal: DVec3, ratio: f64| {
        let cosine = -along.dot(normal);
        let beyond = (1.0 - ratio * ratio * (1.0 - cosine * cosine)).sqrt();
        ratio * along + (ratio * cosine - beyond) * normal
    };
    let within = bend(along, normal, 1.0 / index);
    let leaves = normal - 2.0 * within.dot(normal) * within;
    Some(bend(within, -leaves, index))
}

#[test]
fn rays_leave_a_ball_where_they_do() {
    let size = [48, 36];
    let view = camera(DVec3::new(0.0, 0.0, 4.0), size);
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 20_000, 0.0);
    let scene = clear(cloud, [1.5; 3], view);
    let sky = |d: Vec3, _: f32| [d.x, d.y, d.z];
    let (_, seen) = scene.draw_glass(&WHOLE, &in_sky(Bending::Traced, &sky), &[]);
    let mut met = 0;
    let mut worst = 0.0f64;
    for (k, behind) in seen.behind.iter().enumerate() {
        let (_, along) = view.view_ray((k % 48) as f64 + 0.5, (k / 48) as f64 + 0.5);
        let miss = (DVec3::Z * -4.0).cross(along.normalize()).length();
        let Some(expected) = through_a_ball(DVec3::Z * -4.0, along, 1.5) else { continue };
        // Near the rim discs of the front and the back are one layer.
        if miss > 0.9 || behind[0].is_nan() {
            continue;
        }
        // A part is mirrored inside, by the angle within, and is told the sky there.
        let share = fresnel(1.5, miss / 1.5);
        let apart = DVec3::new(f64::from(behind[0]), f64::from(behind[1]), 0.0) - expected.with_z(0.0) * (1.0 - share);
        worst = worst.max(apart.length() - share);
        met += 1;
    }
    assert!(met > 250 && worst < 0.03, "{met} pixels, {worst}");
}
