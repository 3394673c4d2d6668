//! The paper's own transparency, and what gaps do otherwise.

use crate::scenes::{Scene, camera, disc, parallel, plane, sphere};
use deferred_blend::grouping::{Collisions, Groups, HashParams, hash_grouping};
use deferred_blend::{Error, Floors, Layering, Params};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Accumulator, Cloud};

/// Discs as large as they may be, for groups should cover what they show.
const LARGE: Params = Params { disc_scale: 1.0, gap: 0.5, transmittance_cutoff: 0.0 };

fn draw(scene: &Scene, layering: Layering<'_>) -> Accumulator {
    let mut picture = Accumulator::new(scene.camera.size, 1, 3, true, true);
    scene.draw_by(&LARGE, layering, &[], &mut picture).expect("nobody cancels");
    picture
}

/// Each disc a group of its own, by turns of K.
pub(crate) fn by_turns(cloud: &Cloud, count: u32) -> Groups {
    Groups::new(count, (0..cloud.len()).map(|i| (i % count as usize) as u8).collect()).expect("below the count")
}

/// The paper's ε: Σ|ΔR| + |ΔG| + |ΔB| of 8 bits a channel, a pixel.
fn apart(a: &Accumulator, b: &Accumulator) -> f64 {
    let pixels = a.channels[0].len();
    let difference =
        |k: usize| (0..3).map(|c| 255.0 * f64::from((a.channels[c][k] - b.channels[c][k]).abs())).sum::<f64>();
    (0..pixels).map(difference).sum::<f64>() / pixels as f64
}

fn alphas(picture: &Accumulator) -> impl Iterator<Item = f32> + '_ {
    picture.optical_depth[0].iter().map(|tau| -libm::expm1f(-tau))
}

#[test]
fn discs_that_do_not_overlap_look_alike_by_every_way() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..49 {
        let at = Vec3::new((k % 7) as f32 - 3.0, (k / 7) as f32 - 3.0, 0.1 * (k % 5) as f32);
        cloud.push(&disc(at * 0.3, Vec3::new(0.1, 0.2, 1.0), 0.04, 0.2 + 0.1 * (k % 6) as f32));
    }
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 2.2, [96, 96]));
    // Rims that no core of a layer meets are no layer where gaps tell them, so only cores are compared.
    let groups = by_turns(&scene.cloud, 1);
    let gaps = draw(&scene, Layering::Gaps);
    for layering in [
        Layering::Peeled(1),
        Layering::Algorithm1(Floors { groups: &groups, steps: 1000 }),
        Layering::Algorithm2(Floors { groups: &groups, steps: 1000 }),
    ] {
        let other = draw(&scene, layering);
        let mut seen = 0;
        for (a, b) in alphas(&gaps).zip(alphas(&other)).filter(|(a, _)| *a > 0.0) {
            assert!((a - b).abs() < 1e-6, "{layering:?}: {a} {b}");
            seen += 1;
        }
        assert!(seen > 300, "{seen} pixels");
    }
}

/// Discs of a plane are met at one depth, wherever steps end; those of a ball are not.
#[test]
fn db3_floored_depths_attenuate_a_curved_surface_twice_where_a_step_ends() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 3000, 0.5);
    let scene = Scene::new(cloud, camera(DVec3::Z * 6.0, [64, 48]));
    let groups = by_turns(&scene.cloud, 1);
    let middle = |k: usize| ((k % 64) as f32 - 31.5).hypot((k / 64) as f32 - 23.5) < 8.0;
    let wrong = |layering: Layering<'_>| {
        let picture = draw(&scene, layering);
        let shown: Vec<f32> =
            alphas(&picture).enumerate().filter(|(k, _)| middle(*k)).map(|(_, alpha)| alpha).collect();
        shown.iter().filter(|alpha| (**alpha - 0.75).abs() > 1e-3).count() as f64 / shown.len() as f64
    };
    assert_eq!(wrong(Layering::Gaps), 0.0);
    let floored = [4, 16, 64].map(|steps| wrong(Layering::Algorithm1(Floors { groups: &groups, steps })));
    println!("share of wrong pixels at 4, 16 and 64 steps: {floored:?}");
    // More steps, more ends of steps.
    assert!(floored[1] > 0.05 && floored.windows(2).all(|w| w[1] > w[0]), "{floored:?}");
    let smooth = wrong(Layering::Algorithm2(Floors { groups: &groups, steps: 16 }));
    assert!(smooth < floored[1], "{smooth}");
}

#[test]
fn db4_the_farthest_disc_is_seen_and_so_is_what_has_one_depth() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, Vec3::ZERO, Vec3::Z, 20, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    let flat = Scene::new(cloud.clone(), parallel(DVec3::Z * 3.0, 1.0, [16, 16]));
    plane(&mut cloud, Vec3::Z * -2.0, Vec3::Z, 20, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    let deep = Scene::new(cloud, parallel(DVec3::Z * 3.0, 1.0, [16, 16]));
    for (scene, expected) in [(flat, 0.5), (deep, 0.75)] {
        let groups = by_turns(&scene.cloud, 1);
        for steps in [2, 64, u32::MAX] {
            let picture = draw(&scene, Layering::Algorithm1(Floors { groups: &groups, steps }));
            assert!(alphas(&picture).all(|alpha| (alpha - expected).abs() < 1e-6), "{steps} steps");
        }
    }
}

#[test]
fn peeling_leaves_out_what_lies_deeper() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..6 {
        plane(&mut cloud, Vec3::Z * -(k as f32), Vec3::Z, 40, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    }
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 1.0, [8, 8]));
    for layers in [1, 3, 6, 9] {
        let expected = 1.0 - 0.5f32.powi(layers.min(6));
        let picture = draw(&scene, Layering::Peeled(layers as u32));
        assert!(alphas(&picture).all(|alpha| (alpha - expected).abs() < 1e-6), "{layers} layers");
    }
}

/// Section 6.2, Fig. 17: Algorithm 2 is nearer to peeling of all layers than Algorithm 1, and that than three layers; gaps are that peeling.
#[test]
fn errors_come_in_the_papers_order() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    // Many layers of bodies within one another, lit from a side.
    for (radius, count) in [(1.0, 6000), (0.8, 4000), (0.6, 2500), (0.4, 1200)] {
        sphere(&mut cloud, Vec3::ZERO, radius, count, 0.2);
    }
    for i in 0..cloud.len() {
        let lit = 0.2 + 0.8 * cloud.normal[i].dot(Vec3::new(0.6, 0.6, 0.5)).max(0.0);
        cloud.color[i] = [lit, 0.8 * lit, 0.6 * lit];
    }
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.3, 4.0), [96, 72]));
    let params = HashParams { groups: 4, collisions: Collisions::Resolve, ..HashParams::default() };
    let groups = hash_grouping(&scene.cloud, &params, None).expect("a cloud");
    let floors = Floors { groups: &groups, steps: 40 };
    let gaps = draw(&scene, Layering::Gaps);
    let [first, second, three, eight] =
        [Layering::Algorithm1(floors), Layering::Algorithm2(floors), Layering::Peeled(3), Layering::Peeled(8)]
            .map(|layering| apart(&draw(&scene, layering), &gaps));
    println!("ε: Algorithm 1 {first:.2}, Algorithm 2 {second:.2}, 3 layers {three:.2}, 8 layers {eight:.2}");
    assert!(second < first && first < three && eight < second, "{first} {second} {three} {eight}");
}

#[test]
fn numbers_of_steps_and_layers_are_checked() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, Vec3::ZERO, Vec3::Z, 2, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 1.0, [8, 8]));
    let groups = by_turns(&scene.cloud, 2);
    for layering in [Layering::Peeled(0), Layering::Algorithm1(Floors { groups: &groups, steps: 0 })] {
        let mut picture = Accumulator::new([8, 8], 1, 3, false, false);
        let refused = scene.draw_by(&LARGE, layering, &[], &mut picture);
        assert!(matches!(refused, Err(Error::Parameter { .. })), "{layering:?}");
    }
}
