//! Absorbances are interpolated between rays as they are: in steep slanted layers they are even, where means of transmittances are those of the brightest ray.

use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Light, LightShape, Receiver, Splat, SplatKind, Transmittance};
use tsm::{Params, Scene, ShadowMap};

/// Optical depth of a spacing of 1.
const TAU: f32 = 10.0;

#[test]
fn absorbances_of_a_slanted_layer_are_even_where_transmittances_are_not() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let radius = Footprint::default().radius_for_spacing(1.0);
    for n in 0..24 * 24 * 2 {
        let [x, z, y] = [n % 24, n / 24 % 24, n / 576].map(|k| k as f32);
        cloud.push(&Splat { position: Vec3::new(x, -0.5 - y, z), radius, cross_section: TAU, ..Splat::default() });
    }
    let direction = DVec3::new(0.8, -0.5, 0.33).normalize();
    let light = Light { shape: LightShape::Directional { direction }, intensity: [1.0; 3] };
    let params = Params { tolerance: 1e-30, ..Params::default() };
    let map = ShadowMap::build(&Scene::from(&cloud), &light, &params, None).unwrap();
    let numbers = |number: &dyn Fn(&Receiver) -> f32| -> [f32; 2] {
        let places = (9..16).flat_map(|x| (9..16).map(move |z| Vec3::new(x as f32, -0.5, z as f32)));
        let found: Vec<f32> = places
            .map(|position| number(&Receiver { position, normal: Vec3::ZERO, radius, kind: SplatKind::Medium }))
            .collect();
        let mean = found.iter().sum::<f32>() / found.len() as f32;
        [mean, found.iter().fold(0.0, |most, a| f32::max(most, (a - mean).abs()))]
    };
    let [mean, ripple] = numbers(&|place| map.absorbance(place)[0]);
    let [brightest, uneven] = numbers(&|place| -map.transmittance(place)[0].ln());
    assert!(ripple < 0.02 * mean, "{ripple} of {mean}");
    assert!(brightest < mean && uneven > 2.0 * ripple, "{uneven} of {brightest}, {ripple} of {mean}");
    // Where nothing falls off both are one.
    let above = Receiver { position: Vec3::new(12.0, 4.0, 12.0), normal: Vec3::ZERO, radius, kind: SplatKind::Medium };
    assert_eq!((map.absorbance(&above), map.transmittance(&above)), ([0.0; 3], [1.0; 3]));
}
