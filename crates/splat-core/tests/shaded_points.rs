//! The radiance of one point: which effect light becomes, and where its numbers lie.

use glam::{DVec3, Vec3};
use splat_core::shade::{ChannelLayout, LitBy, MAX_CHANNELS, MAX_SHADED_CHANNELS, Point, Radiance, arriving, facing};
use splat_core::{ADDITIVE_LAYERS, LayerSet, Light, LightShape, Material, SHADED_EFFECTS, Shading, SplatKind};

const AMBIENT: [f32; 3] = [0.1, 0.2, 0.3];
const EMISSION: [f32; 3] = [0.01, 0.02, 0.03];
const COLOR: [f32; 3] = [0.9, 0.5, 0.2];
/// Share of each light that arrives.
const SHARE: f32 = 0.25;

fn lights() -> [Light; 2] {
    let direction = DVec3::new(0.6, 0.0, -0.8);
    [[3.0, 2.0, 1.0], [0.5; 3]].map(|intensity| Light { shape: LightShape::Directional { direction }, intensity })
}

fn radiance(shading: Shading, normal: Vec3) -> Radiance {
    let material = Material { shading, emission: EMISSION, single_scattering_albedo: 0.5, ..Material::default() };
    let position = DVec3::new(1e7, 0.0, 0.0);
    let to_eye = Vec3::Z;
    let point = Point { position, radius: 0.1, normal, to_eye, color: COLOR, material: &material };
    point.radiance(AMBIENT, lights().map(|light| LitBy { slide: None, light, shadow: None }).iter(), |_, _| [SHARE; 3])
}

/// Whether all are within rounding.
fn near(found: [f32; 3], expected: [f32; 3]) -> bool {
    found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= 1e-6)
}

#[test]
fn light_is_direct_where_it_is_reflected_and_scatter1_where_it_is_scattered() {
    use std::f32::consts::PI;
    let of_each = |factor: f32| [0, 1, 2].map(|c| (lights()[0].intensity[c] + 0.5) * SHARE * COLOR[c] * factor);
    let reflected = radiance(Shading::Phong, Vec3::Z);
    assert!(near(reflected.direct, of_each(0.8 / PI)), "{reflected:?}");
    assert!(near(reflected.ambient, [0, 1, 2].map(|c| AMBIENT[c] * COLOR[c])), "{reflected:?}");
    assert_eq!((reflected.scatter1, reflected.emission, reflected.shadow), ([0.0; 3], EMISSION, SHARE));
    // Isotropic; what has no normal reflects nothing.
    for scattered in [radiance(Shading::Phase, Vec3::Z), radiance(Shading::Phong, Vec3::ZERO)] {
        assert!(near(scattered.scatter1, of_each(0.5 / (4.0 * PI))), "{scattered:?}");
        assert!(near(scattered.ambient, [0, 1, 2].map(|c| 0.5 * AMBIENT[c] * COLOR[c])), "{scattered:?}");
        assert_eq!((scattered.direct, scattered.emission, scattered.shadow), ([0.0; 3], EMISSION, SHARE));
    }
    let shown = radiance(Shading::Unlit, Vec3::Z);
    assert!(near(shown.emission, [0, 1, 2].map(|c| EMISSION[c] + COLOR[c])));
    assert_eq!((shown.ambient, shown.direct, shown.scatter1, shown.shadow), ([0.0; 3], [0.0; 3], [0.0; 3], 1.0));
}

#[test]
fn every_layout_has_its_numbers_in_a_row_without_gaps() {
    let normal = Vec3::new(0.0, 0.6, 0.8);
    let radiance = Radiance { scatter1: [0.3, 0.2, 0.1], ..radiance(Shading::Phong, normal) };
    for bits in 0..8 {
        let [effects, with_normal, shadow] = [0, 1, 2].map(|bit| bits >> bit & 1 == 1);
        let set = LayerSet { effects, normal: with_normal, shadow, ..LayerSet::default() };
        let layout = ChannelLayout::new(&set);
        let mut expected: Vec<f32> = Vec::new();
        if effects {
            expected.extend(radiance.effects().as_flattened());
        } else {
            let Radiance { ambient, emission, direct, scatter1, .. } = radiance;
            expected.extend([0, 1, 2].map(|c| ambient[c] + emission[c] + direct[c] + scatter1[c]));
        }
        assert_eq!(layout.colors(), expected.len());
        if with_normal {
            assert_eq!(layout.normal(), Some(expected.len()));
            expected.extend(normal.to_array());
        }
        if shadow {
            assert_eq!(layout.shadow(), Some(expected.len()));
            expected.push(SHARE);
        }
        let mut found = vec![f32::NAN; layout.count()];
        radiance.write(normal, &layout, &mut found);
        assert_eq!(found, expected, "{layout:?}");
        assert!(layout.count() <= MAX_SHADED_CHANNELS);
        let names: Vec<(&str, usize)> = layout.effects().collect();
        if effects {
            assert_eq!(names, [("ambient", 0), ("emission", 3), ("direct", 6), ("scatter1", 9)]);
        } else {
            assert_eq!(names, [("beauty", 0)]);
        }
    }
}

#[test]
fn a_layout_with_multiple_scattering_has_room_for_it_and_no_other_has() {
    let radiance = radiance(Shading::Phong, Vec3::ZERO);
    for bits in 0..8 {
        let [effects, normal, shadow] = [0, 1, 2].map(|bit| bits >> bit & 1 == 1);
        let plain = ChannelLayout::new(&LayerSet { effects, normal, shadow, ..LayerSet::default() });
        let layout = plain.with_multiple();
        assert_eq!(plain.multiple(), (!effects).then_some(0));
        assert!(plain.count() <= MAX_SHADED_CHANNELS && layout.count() <= MAX_CHANNELS);
        let mut found = vec![f32::NAN; layout.count()];
        radiance.write(Vec3::Y, &layout, &mut found);
        assert!(found.iter().all(|v| !v.is_nan()), "{layout:?}: {found:?}");
        let at = layout.multiple().unwrap();
        let names: Vec<(&str, usize)> = layout.effects().collect();
        if effects {
            assert_eq!((names.last(), names.len()), (Some(&("scatterN", at)), 5));
            assert_eq!((&found[at..at + 3], layout.normal()), (&[0.0; 3][..], Some(at + 3)));
        } else {
            assert_eq!((names, layout.count()), (vec![("beauty", at)], plain.count()));
        }
        // Colours by their own plane, all else by green's.
        for c in 0..layout.count() {
            let expected = if c < layout.colors() { c % 3 } else { 1 };
            assert_eq!(ChannelLayout::plane_of(c, layout.count(), 3), expected, "{layout:?}, channel {c}");
        }
    }
}

#[test]
fn effects_of_shading_are_additive_layers_in_the_same_order() {
    let mut all = ADDITIVE_LAYERS.iter();
    assert!(SHADED_EFFECTS.iter().all(|effect| all.any(|layer| layer == effect)), "{SHADED_EFFECTS:?}");
}

#[test]
fn surfaces_show_the_side_that_faces_and_shadows_are_asked_where_they_can_be_seen() {
    let face = Vec3::Z;
    let leaning = Vec3::new(0.0, 0.6, 0.8);
    for kind in [SplatKind::Surface, SplatKind::Opaque] {
        assert_eq!(facing(kind, face, leaning, Vec3::Z), leaning);
        assert_eq!(facing(kind, face, leaning, Vec3::NEG_Z), -leaning);
    }
    assert_eq!(facing(SplatKind::Medium, face, face, Vec3::NEG_Z), face);
    assert_eq!(arriving([1.0; 3], 0.5, Some(|| [0.0, 0.5, 1.0])), [0.5, 0.75, 1.0]);
    let never = || -> [f32; 3] { panic!("there is nothing to attenuate") };
    assert_eq!(arriving([1.0; 3], 0.0, Some(never)), [1.0; 3]);
    assert_eq!(arriving([0.0; 3], 1.0, Some(never)), [1.0; 3]);
}
