//! Hard cases of more than one step.

use crate::floored::by_turns;
use crate::grouping::ball;
use crate::scenes::{Asked, Scene, disc, parallel, plane};
use deferred_blend::grouping::{GraphParams, OverlapGraph, minimum_coloring};
use deferred_blend::{Bending, Floors, Layering, Params};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Accumulator, Cloud, Material, Splat};

/// α of 0, ½ and 1 by no layer, one and five: (1 − α)^l has all nine values, and nothing is lost that is a number.
#[test]
fn db7_layers_of_no_opacity_of_half_and_of_all_and_no_layers() {
    let params = Params { disc_scale: 1.0, transmittance_cutoff: 0.0, ..Params::default() };
    let view = parallel(DVec3::Z * 3.0, 0.5, [8, 8]);
    for (opacity, crossing_depth) in [(0.0, 0.0), (0.5, std::f32::consts::LN_2), (1.0, 90.0f32)] {
        for layers in [0, 1, 5] {
            let mut cloud = Cloud::new(DVec3::ZERO);
            let like = Splat { crossing_depth, cross_section: crossing_depth, ..disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5) };
            for l in 0..layers {
                plane(&mut cloud, Vec3::Z * (-0.5 * l as f32), Vec3::Z, 20, &like);
            }
            let mut scene = Scene::new(cloud, view);
            let groups = by_turns(&scene.cloud, 1);
            let floors = Floors { groups: &groups, steps: 64 };
            let by = |layering| {
                let mut picture = Accumulator::new([8, 8], 1, 3, true, true);
                scene.draw_by(&params, layering, &[], &mut picture).expect("nobody cancels");
                picture
            };
            let mut pictures: Vec<Accumulator> =
                [Layering::Gaps, Layering::Algorithm1(floors), Layering::Algorithm2(floors)].map(by).into();
            // As glass of index 1, by Eqs. 15 and 16.
            scene.materials = vec![Material { absorption_inside: [1e-9; 3], ..Material::default() }];
            let sky = |_: Vec3, _: f32| [1.0; 3];
            let asked = Asked { bending: Bending::Power, sky: &sky, straight: false, unit: 1.0 };
            let (picture, glass) = scene.draw_glass(&params, &asked, &[]);
            assert!(glass.mirrored.iter().flatten().all(|light| *light == 0.0));
            pictures.push(picture);
            let expected = (1.0f64 - opacity).powi(layers);
            for (k, picture) in pictures.iter().enumerate() {
                let found = libm::exp(-f64::from(picture.optical_depth[0][27]));
                assert!((found - expected).abs() < 1e-6, "way {k}: α {opacity}, {layers} layers: {found}");
                assert!(picture.channels.iter().flatten().all(|light| light.is_finite()));
            }
        }
    }
}

/// Layers are counted by no channel that ends: thousands of faint ones multiply, and so do those of unlike opacities.
#[test]
fn db6_opacities_of_any_layers_multiply() {
    let params = Params { disc_scale: 1.0, transmittance_cutoff: 0.0, ..Params::default() };
    for opacities in [vec![0.9, 0.1, 0.1], vec![1e-3; 5_000]] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for (l, opacity) in opacities.iter().enumerate() {
            cloud.push(&disc(Vec3::Z * (-0.5 * l as f32), Vec3::Z, 0.1, *opacity));
        }
        let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 0.02, [2, 2]));
        let groups = by_turns(&scene.cloud, 1);
        let floors = Floors { groups: &groups, steps: 1 << 20 };
        let expected: f64 = opacities.iter().map(|opacity| 1.0 - f64::from(*opacity)).product();
        for layering in [Layering::Gaps, Layering::Algorithm1(floors), Layering::Algorithm2(floors)] {
            let mut picture = Accumulator::new([2, 2], 1, 3, true, true);
            scene.draw_by(&params, layering, &[], &mut picture).expect("nobody cancels");
            for tau in &picture.optical_depth[0] {
                let found = libm::exp(-f64::from(*tau));
                assert!((found - expected).abs() < 1e-5, "{layering:?}, {} layers: {found}", opacities.len());
            }
        }
    }
}

/// Ten thousand kilometres away no pair overlaps that does not, and groups are those that they were.
#[test]
fn db10_edges_and_groups_far_away_are_those_at_hand() {
    let mut near = ball();
    let far = ball();
    near.origin = DVec3::ZERO;
    assert!(far.origin.length() > 9e6);
    let graph = |cloud: &Cloud| OverlapGraph::build(cloud, &GraphParams::default(), None).expect("a valid cloud");
    let [at_hand, away] = [&near, &far].map(graph);
    let [groups, same] = [&at_hand, &away].map(|graph| minimum_coloring(graph, 256, None).expect("in range").groups);
    assert_eq!(groups, same);
    assert_eq!(at_hand.edges(), away.edges());
    let place = |i: usize| far.origin + far.position[i].as_dvec3();
    for node in 0..away.nodes() {
        let i = away.place(node);
        for &n in away.neighbors(node) {
            let j = away.place(n as usize);
            let reach = f64::from(far.radius[i]) + f64::from(far.radius[j]);
            // At 10⁷ f64 has 2·10⁻⁹.
            assert!(place(i).distance(place(j)) < reach + 1e-8, "{i} {j}");
            assert_ne!(same.by_disc()[i], same.by_disc()[j]);
        }
    }
}
