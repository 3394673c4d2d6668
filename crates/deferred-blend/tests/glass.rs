//! Matter that surfaces bound: what is mirrored, bent and absorbed.

use crate::scenes::{Scene, camera, disc, parallel, plane, sphere};
use deferred_blend::{Bending, DiscInput, Glass, Params, Solids, Surroundings};
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Cloud, LayerSet, Material, Splat};

const MODES: [Bending; 3] = [Bending::EachLayer, Bending::Power, Bending::Nearest];

/// Everything is composited.
const WHOLE: Params = Params { disc_scale: 0.6, gap: 0.5, transmittance_cutoff: 0.0 };

fn in_sky(bending: Bending, sky: &(dyn Fn(Vec3) -> [f32; 3] + Sync)) -> Glass<'_> {
    Glass { bending, surroundings: Surroundings { sky, solids: None }, unit: 1.0 }
}

/// Clear discs of some index.
fn clear(mut cloud: Cloud, index: [f32; 3], view: splat_core::Camera) -> Scene {
    cloud.crossing_depth.fill(0.0);
    cloud.cross_section.fill(0.0);
    let mut scene = Scene::new(cloud, view);
    scene.materials = vec![Material { index, ..Material::default() }];
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

#[test]
fn clear_glass_in_a_white_world_is_not_seen() {
    let view = camera(DVec3::new(0.3, 0.4, 4.0), [48, 36]);
    for index in [[1.01; 3], [1.5; 3], [2.4; 3], [0.7; 3], [1.4, 1.45, 1.5]] {
        for bending in MODES {
            let scene = clear(ball(0.0), index, view);
            let (picture, glass) = scene.draw_glass(&WHOLE, in_sky(bending, &|_| [1.0; 3]), &[]);
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
        scene.materials = vec![Material::default(), Material { index: [1.5; 3], ..Material::default() }];
        let (picture, glass) = scene.draw_glass(&WHOLE, in_sky(bending, &|_| [7.0; 3]), &[]);
        assert_eq!((&picture.optical_depth, &picture.channels), (&plain.optical_depth, &plain.channels));
        assert!(glass.behind.iter().all(|b| b[0].is_nan()) && glass.mirrored.iter().all(|m| *m == [0.0; 3]));
    }
}

#[test]
fn a_slab_shifts_rays_and_leaves_their_direction() {
    let size = [32, 24];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    let scene = clear(slab(0.5, 40, 0.0), [1.5; 3], view);
    let (_, glass) = scene.draw_glass(&WHOLE, in_sky(Bending::EachLayer, &|d| d.into()), &[]);
    for (k, behind) in glass.behind.iter().enumerate() {
        let (from, along) = view.view_ray((k % 32) as f64 + 0.5, (k / 32) as f64 + 0.5);
        assert_eq!(from, DVec3::ZERO);
        let apart = (Vec3::from(*behind) - along.normalize().as_vec3()).length();
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
        scene.materials = vec![Material { index: [index; 3], ..Material::default() }];
        let (picture, glass) = scene.draw_glass(&WHOLE, in_sky(Bending::Power, &|d| d.into()), &[]);
        for (k, behind) in glass.behind.iter().enumerate() {
            let (_, along) = view.view_ray((k % 33) as f64 + 0.5, (k / 33) as f64 + 0.5);
            let along = along.normalize();
            let (sine, eta) = (along.x.hypot(along.y), (1.0 / f64::from(index)).powi(layers));
            let found = f64::from(behind[0]).hypot(f64::from(behind[1]));
            assert!((found - eta * sine).abs() < 1e-5, "{index} {layers} pixel {k}: {found} for {}", eta * sine);
            // Eq. 15, and what is mirrored at the nearest layer.
            let (c, t) = ((1.0 - sine * sine).sqrt(), (1.0 - (eta * sine).powi(2)).sqrt());
            let share = 0.5 * (((eta * c - t) / (eta * c + t)).powi(2) + ((c - eta * t) / (c + eta * t)).powi(2));
            let passes = 0.7f64.powi(layers) * (1.0 - share);
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
    scene.materials = vec![Material { index: [1.0; 3], absorption_inside: [1e-9; 3], ..Material::default() }];
    for (bending, expected) in [(Bending::EachLayer, 0.7), (Bending::Nearest, 0.7), (Bending::Power, 0.49)] {
        let (picture, _) = scene.draw_glass(&WHOLE, in_sky(bending, &|_| [1.0; 3]), &[]);
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
        let glass = Glass { unit: 2.0, ..in_sky(Bending::EachLayer, &|_| [1.0; 3]) };
        let (picture, _) = scene.draw_glass(&WHOLE, glass, &opaque);
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
        clear(cloud, [1.5; 3], view).draw_glass(&WHOLE, in_sky(Bending::EachLayer, &|d| (d + Vec3::ONE).into()), &[]).1
    };
    let (all, third) = (drawn(1), drawn(3));
    for (a, b) in all.behind.iter().zip(&third.behind).filter(|(a, _)| !a[0].is_nan()) {
        assert!((Vec3::from(*a) - Vec3::from(*b)).length() < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn a_wall_behind_glass_is_seen_where_the_bent_ray_meets_it() {
    let size = [40, 30];
    let view = camera(DVec3::new(0.0, 0.0, 3.0), size);
    let glass = clear(slab(0.5, 40, 0.0), [1.5; 3], view);
    // A wall whose colour is its place.
    let mut wall = Cloud::new(DVec3::ZERO);
    plane(&mut wall, Vec3::Z * -1.5, Vec3::Z, 60, &disc(Vec3::ZERO, Vec3::Z, 0.05, 0.9));
    for i in 0..wall.len() {
        wall.color[i] = [wall.position[i].x, wall.position[i].y, 1.0];
    }
    let values: Vec<f32> = wall.color.iter().flatten().copied().collect();
    let ids: Vec<u32> = (0..wall.len() as u32).collect();
    let input = DiscInput { cloud: &wall, ids: &ids, ..glass.input() };
    let solids = Solids::new(&input, &values, ChannelLayout::new(&LayerSet::default()));
    let surroundings = Surroundings { sky: &|_| [9.0; 3], solids: Some(&solids) };
    let (_, seen) =
        glass.draw_glass(&WHOLE, Glass { bending: Bending::EachLayer, surroundings, unit: 1.0 }, &[4.5; 40 * 30]);
    for (k, behind) in seen.behind.iter().enumerate() {
        let (_, along) = view.view_ray((k % 40) as f64 + 0.5, (k / 40) as f64 + 0.5);
        let unit = along.normalize();
        let sine = unit.x.hypot(unit.y);
        // Across the slab the tangent is that of the angle within.
        let (outside, inside) = (sine / (1.0 - sine * sine).sqrt(), sine / 1.5 / (1.0 - (sine / 1.5).powi(2)).sqrt());
        let off = outside * (3.0 + 1.0) + inside * 0.5;
        let expected = [along.x, along.y].map(|v| off * v / along.x.hypot(along.y));
        // Colours are blended over discs, which lie 0.05 apart, jittered: a straight line through them keeps the mean.
        let apart = (f64::from(behind[0]) - expected[0]).hypot(f64::from(behind[1]) - expected[1]);
        let straight = (along.x.hypot(along.y) * 4.5 - off).abs();
        assert!(apart < 0.02 && behind[2] > 0.999, "pixel {k}: {behind:?} for {expected:?}, straight {straight}");
    }
    // The paper's way: opaque surfaces straight on.
    let surroundings = Surroundings { sky: &|_| [9.0; 3], solids: None };
    let (_, seen) =
        glass.draw_glass(&WHOLE, Glass { bending: Bending::EachLayer, surroundings, unit: 1.0 }, &[4.5; 40 * 30]);
    assert!(seen.behind.iter().all(|b| b[0].is_nan()));
}

#[test]
fn solids_hide_what_is_behind_them_and_end() {
    let view = camera(DVec3::new(0.0, 0.0, 3.0), [40, 30]);
    let mut cloud = Cloud::new(DVec3::ZERO);
    let near = Splat { color: [0.0, 1.0, 0.0], ..disc(Vec3::ZERO, Vec3::Z, 0.05, 0.9) };
    plane(&mut cloud, Vec3::Z * -1.0, Vec3::Z, 6, &near);
    plane(&mut cloud, Vec3::Z * -2.0, Vec3::Z, 12, &Splat { color: [1.0, 0.0, 0.0], ..near });
    let walls = Scene::new(cloud, view);
    let solids = Solids::new(&walls.input(), &walls.values, ChannelLayout::new(&LayerSet::default()));
    let pane = clear(slab(0.2, 40, 0.0), [1.0001; 3], view);
    let surroundings = Surroundings { sky: &|_| [0.0, 0.0, 1.0], solids: Some(&solids) };
    let (_, seen) = pane.draw_glass(&WHOLE, Glass { bending: Bending::EachLayer, surroundings, unit: 1.0 }, &[]);
    let at = |x: usize, y: usize| seen.behind[y * 40 + x];
    assert_eq!(at(20, 15), [0.0, 1.0, 0.0]);
    assert_eq!(at(24, 15), [1.0, 0.0, 0.0], "beside the near wall");
    assert_eq!(at(36, 15), [0.0, 0.0, 1.0], "beside both");
}
