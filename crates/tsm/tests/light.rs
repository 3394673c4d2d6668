//! TS1, TS3, TS8-TS13, TS16: how much light arrives.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::AbsorbanceModel;
use splat_core::{Cloud, Light, LightShape, Material, Object, Receiver, Splat, SplatKind, Transmittance};
use tsm::{MappingChoice, Params, Resolution, Scene, ShadowMap};

#[test]
fn ts01_light_exactly_on_a_point() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat { radius: 0.1, cross_section: 1e-3, ..Splat::default() });
    for i in 0..500 {
        let normal = -direction(1, i);
        let kind = SplatKind::Surface;
        cloud.push(&Splat { position: -normal, radius: 0.05, cross_section: 1e-3, kind, normal, ..Splat::default() });
    }
    for mapping in [MappingChoice::Auto, MappingChoice::PolarAzimuth] {
        let map = build(&cloud, &point_light(DVec3::ZERO), &Params { mapping, ..Params::default() });
        let lights: Vec<f32> = (1..501).map(|i| map.transmittance(&receiver(&cloud, i))[0]).collect();
        // The splat around the light shadows all directions by half its chord through the middle.
        let f = splat_core::Footprint::default();
        let expected = (-0.5 * 1e-3 * f.norm() * f.profile(0.0) / 0.01).exp() as f32;
        for light in &lights {
            assert!((light - expected).abs() < 1e-6, "{light}, not {expected}");
        }
        assert_eq!(light_at(&map, Vec3::ZERO), 1.0, "the light itself is lit");
    }
}

#[test]
fn ts03_ring_of_equal_points_gets_equal_light() {
    let n = 64;
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..n {
        let (s, c) = (std::f32::consts::TAU * k as f32 / n as f32).sin_cos();
        for r in [1.0, 2.0] {
            cloud.push(&Splat {
                position: Vec3::new(r * c, r * s, 0.0),
                radius: 0.04,
                cross_section: 1e-3,
                ..Splat::default()
            });
        }
    }
    let resolution = Resolution::Cells(256);
    let mapping = MappingChoice::PolarAzimuth;
    let map = build(&cloud, &point_light(DVec3::ZERO), &Params { mapping, resolution, ..Params::default() });
    let outer: Vec<f32> = (0..n).map(|k| map.transmittance(&receiver(&cloud, 2 * k + 1))[0]).collect();
    let spread = outer.iter().fold(0.0f32, |m, t| m.max((t - outer[0]).abs()));
    assert!(outer[0] < 0.95 && spread < 2e-4, "{} ± {spread}", outer[0]);
}

#[test]
fn ts09_error_of_the_limit_is_bounded_by_it() {
    let cloud = medium([12, 12, 30], 0.05, 12.0, |_| true);
    let light = directional(DVec3::Z);
    let exact = build(&cloud, &light, &Params { tolerance: 1e-30, ..Params::default() });
    let mut last = f32::INFINITY;
    for limit in [2.0f32, 4.0, 8.0, 16.0] {
        let tolerance = (-limit).exp();
        let map = build(&cloud, &light, &Params { tolerance, ..Params::default() });
        let error = (0..200).map(|i| {
            let p = Vec3::new(0.0, 0.0, -1.6 + 0.017 * i as f32);
            (light_at(&map, p) - light_at(&exact, p)).abs()
        });
        let error = error.fold(0.0, f32::max);
        assert!(error <= tolerance && error < 0.5 * last, "limit {limit}: {error}");
        assert!(map.counts().kept <= exact.counts().kept);
        last = error;
    }
}

#[test]
fn ts10_light_inside_a_ball() {
    let h = 0.08;
    let sigma = 1.5;
    let r = 1.0;
    let mut cloud = medium([14; 3], h, sigma, |p| p.length() < r + h);
    // A splat stands for the part of its voxel that lies in the ball: without that the ball would be rough.
    for i in 0..cloud.len() {
        let part = |k: i32| (k as f32 - 3.5) * h / 8.0;
        let inside = |k: &i32| {
            let d = Vec3::new(part(k % 8), part(k / 8 % 8), part(k / 64));
            (cloud.position[i] + d).length() < r
        };
        cloud.cross_section[i] *= (0..512).filter(inside).count() as f32 / 512.0;
    }
    for offset in [Vec3::ZERO, Vec3::new(0.37, 0.21, 0.11) * h] {
        let map = build(&cloud, &point_light(offset.as_dvec3()), &Params::default());
        let lights: Vec<f64> = (0..2000).map(|i| f64::from(light_at(&map, offset + direction(3, i) * 2.0))).collect();
        let mean = lights.iter().sum::<f64>() / 2000.0;
        let deviation = (lights.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        // The lattice ball is no perfect sphere: its own optical depth by brute force is the truth.
        let truth: Vec<f64> = (0..2000)
            .map(|i| {
                let to = (offset + direction(3, i) * 2.0).as_dvec3();
                (-tsm::reference::optical_depth(&cloud, &Params::default().footprints, offset.as_dvec3(), to)).exp()
            })
            .collect();
        let true_mean = truth.iter().sum::<f64>() / 2000.0;
        let worst = lights.iter().zip(&truth).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        let rough = (truth.iter().map(|t| (t - true_mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        println!(
            "{:?} rough {rough} mean {mean} ({true_mean}, e^-σR {}) σ {deviation} worst {worst}",
            map.counts(),
            (-sigma * r).exp()
        );
        assert!((mean - true_mean).abs() < 1e-5, "mean {mean}, truth {true_mean}");
        assert!((mean - f64::from((-sigma * r).exp())).abs() < 5e-3);
        assert!(worst < 1e-3, "{worst}");
    }
}

#[test]
fn ts11_coincident_points_get_equal_light() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for color in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        cloud.push(&Splat { position: Vec3::Z, radius: 0.1, cross_section: 0.01, color, ..Splat::default() });
    }
    let map = build(&cloud, &point_light(DVec3::ZERO), &Params::default());
    let [a, b] = [0, 1].map(|i| map.transmittance(&receiver(&cloud, i))[0]);
    assert_eq!(a.to_bits(), b.to_bits());
    // Half the absorbance of both, as the table sees it.
    let behind = light_at(&map, Vec3::Z * 2.0);
    assert!((a - behind.sqrt()).abs() < 0.02 && a < 0.8, "{a} and {behind}");
}

#[test]
fn ts13_opaque_and_translucent_in_every_order() {
    let sheet = |z: f32, kind, depth| plane(Vec3::Z * z, Vec3::NEG_Z, 30, 0.05, kind, depth);
    let light = point_light(DVec3::ZERO);
    let probe_at = |cloud: &Cloud, z: f32| light_at(&build(cloud, &light, &Params::default()), Vec3::Z * z);
    let half = std::f32::consts::LN_2;
    // Translucent, then opaque.
    let mut cloud = sheet(2.0, SplatKind::Surface, half);
    cloud.append(&sheet(3.0, SplatKind::Opaque, 1.0));
    for (z, light) in [(1.0, 1.0), (2.5, 0.5), (3.5, 0.0)] {
        assert!((probe_at(&cloud, z) - light).abs() < 2e-3, "{z}: {}", probe_at(&cloud, z));
    }
    // Opaque, then translucent.
    let mut cloud = sheet(3.0, SplatKind::Surface, half);
    cloud.append(&sheet(2.0, SplatKind::Opaque, 1.0));
    for (z, light) in [(1.0, 1.0), (2.5, 0.0), (3.5, 0.0)] {
        assert_eq!(probe_at(&cloud, z), light, "{z}");
    }
    // Two translucent ones.
    let mut cloud = sheet(2.0, SplatKind::Surface, half);
    cloud.append(&sheet(3.0, SplatKind::Surface, half));
    for (z, light) in [(2.5, 0.5), (3.5, 0.25)] {
        assert!((probe_at(&cloud, z) - light).abs() < 2e-3);
    }
}

#[test]
fn ts13_objects_that_cast_no_shadow_leave_no_trace() {
    let cloud = plane(Vec3::Z * 2.0, Vec3::NEG_Z, 5, 0.05, SplatKind::Opaque, 1.0);
    let objects = [Object { casts_shadow: false, ..Object::default() }];
    let map = ShadowMap::build(
        &Scene { cloud: &cloud, materials: &[], objects: &objects },
        &point_light(DVec3::ZERO),
        &Params::default(),
        None,
    )
    .unwrap();
    assert_eq!(map.counts().casters, 0);
    assert_eq!(light_at(&map, Vec3::Z * 3.0), 1.0);
}

#[test]
fn ts16_deposits_keep_the_cross_section_in_any_table() {
    for (k, kind) in [SplatKind::Medium, SplatKind::Surface].into_iter().enumerate() {
        for n in [1, 3, 64, 200, 513, 1024, 4096] {
            // The largest table takes most of the time: places beside three corners of the octahedron, and another one.
            for seed in if n > 1024 { 9..13 } else { 0..18 } {
                let p = directions(10 * seed + k as u64) * 2.0;
                let mut cloud = Cloud::new(DVec3::ZERO);
                let normal = (direction(9, seed) - p).normalize();
                cloud.push(&Splat {
                    position: p,
                    radius: 0.03,
                    cross_section: 0.002,
                    kind,
                    normal,
                    ..Splat::default()
                });
                for mapping in [MappingChoice::Octahedral, MappingChoice::PolarAzimuth] {
                    let params = Params { mapping, resolution: Resolution::Cells(n), ..Params::default() };
                    let map = build(&cloud, &point_light(DVec3::ZERO), &params);
                    let measured = cross_section(&map);
                    let cosine =
                        if kind == SplatKind::Medium { 1.0 } else { f64::from(p.normalize().dot(normal)).abs() };
                    let ratio = measured / (0.002 * cosine);
                    // A disc at an angle is seen under another angle at its rim: second order in radius/distance.
                    let tilt = if kind == SplatKind::Medium { 0.0 } else { 4e-4 / cosine };
                    let error = (ratio - 1.0).abs();
                    assert!(error < 1e-4 + tilt, "{kind:?} {mapping:?} {n} {seed}: {ratio}");
                }
            }
        }
    }
}

/// All poles with places beside them, and random directions.
fn directions(item: u64) -> Vec3 {
    let beside = Vec3::new(0.004, 0.003, 0.002);
    let poles = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y];
    match (item / 10) as usize {
        n if n < 6 => poles[n],
        n if n < 12 => (poles[n - 6] + beside).normalize(),
        _ => direction(8, item),
    }
}

/// Σ A·Ω·d² of a map with one splat at distance 2.
fn cross_section(map: &ShadowMap) -> f64 {
    use tsm::mapping::{Mapping, Table};
    let measure = |cell| match map.table() {
        Table::Octahedral(m) => m.measure(cell),
        Table::PolarAzimuth(m) => m.measure(cell),
        Table::Planar(m) => m.measure(cell),
    };
    let cell_absorbance = |cell| map.list(cell).last().map_or(0.0, |e| f64::from(e.1[0])) * measure(cell) * 4.0;
    (0..map.cells()).map(cell_absorbance).sum()
}

#[test]
fn ts16_mean_transmittance_does_not_depend_on_the_table() {
    // One layer of optical depth 1, so that 1024 rows are soon built; seen at an angle, and along an axis, where the octahedral
    // table has a corner and the polar one its pole.
    let cloud = medium([10, 10, 0], 0.1, 10.0, |_| true);
    for position in [DVec3::new(-1.3, 0.9, -2.6), DVec3::new(0.05, 0.02, -3.0)] {
        for mapping in [MappingChoice::Octahedral, MappingChoice::PolarAzimuth, MappingChoice::Planar] {
            // A planar table spends all its cells on the casters.
            let planar = mapping == MappingChoice::Planar;
            let sizes = if planar { [16, 32, 64, 128, 256] } else { [64, 128, 256, 512, 1024] };
            let means = sizes.map(|n| {
                let params = Params { mapping, resolution: Resolution::Cells(n), ..Params::default() };
                mean_behind_layer(&build(&cloud, &point_light(position), &params), position)
            });
            println!("{mapping:?} {means:?}");
            assert!(means.iter().all(|mean| (mean - means[4]).abs() < 1e-3), "{mapping:?}: {means:?}");
        }
    }
}

/// Mean light at places whose rays cross the middle of the layer z = 0.
fn mean_behind_layer(map: &ShadowMap, light: DVec3) -> f64 {
    let at = |i: u64| {
        let u = |k| (splat_core::rng::unit_f32(2, 0, i, k) - 0.5) * 0.7;
        let crossing = Vec3::new(u(0), u(1), 0.0);
        f64::from(light_at(map, crossing + (crossing - light.as_vec3()) * 0.25))
    };
    (0..4000).map(at).sum::<f64>() / 4000.0
}

#[test]
fn slab_shadow_is_beers_law_with_little_ripple() {
    for tau in [0.01f64, 1.0, 5.0] {
        let h = 0.05;
        let cloud = medium([40, 40, 5], h, (tau / (11.0 * f64::from(h))) as f32, |_| true);
        let light = directional(DVec3::Z);
        let mut ripples = Vec::new();
        for resolution in [Resolution::Auto, Resolution::Cells(32), Resolution::Cells(64), Resolution::Cells(256)] {
            let map = build(&cloud, &light, &Params { resolution, ..Params::default() });
            let lights: Vec<f64> = (0..20_000)
                .map(|i| {
                    let u = |k| (splat_core::rng::unit_f32(3, 0, i, k) - 0.5) * 2.0;
                    f64::from(light_at(&map, Vec3::new(u(0), u(1), 1.0)))
                })
                .collect();
            let mean = lights.iter().sum::<f64>() / lights.len() as f64;
            let ripple = lights.iter().fold(0.0f64, |m, t| m.max((t - mean).abs()));
            println!(
                "τ {tau} {resolution:?} {:?} mean error {:.2e} ripple {ripple:.2e}",
                map.counts(),
                mean - (-tau).exp()
            );
            assert!((mean - (-tau).exp()).abs() < 1e-4, "τ {tau} {resolution:?}: {mean}");
            assert!(ripple < 1e-2, "τ {tau} {resolution:?}: ripple {ripple}");
            ripples.push(ripple);
        }
        assert!(ripples[3] < ripples[1]);
    }
}

#[test]
fn inside_a_slab_light_falls_as_beers_law() {
    let cloud = medium([30, 30, 30], 0.05, 1.0, |_| true);
    let map = build(&cloud, &directional(DVec3::Z), &Params::default());
    for k in -25..=25 {
        let z = k as f32 * 0.05;
        let light = f64::from(light_at(&map, Vec3::new(0.013, 0.007, z)));
        let truth = (-f64::from(z + 30.5 * 0.05)).exp();
        assert!((light - truth).abs() < 6e-3, "z {z}: {light}, not {truth}");
    }
}

#[test]
fn colours_are_absorbed_one_by_one() {
    let cloud = plane(Vec3::Z * 2.0, Vec3::NEG_Z, 30, 0.05, SplatKind::Surface, 1.0);
    let materials = [Material { extinction_rgb: [0.5, 1.0, 2.0], ..Material::default() }];
    let map = ShadowMap::build(
        &Scene { cloud: &cloud, materials: &materials, objects: &[] },
        &point_light(DVec3::ZERO),
        &Params::default(),
        None,
    )
    .unwrap();
    assert_eq!(map.channels(), 3);
    let light = map.transmittance(&probe(Vec3::Z * 3.0));
    for (c, depth) in [0.5f32, 1.0, 2.0].into_iter().enumerate() {
        assert!((light[c] - (-depth).exp()).abs() < 2e-3, "{light:?}");
    }
    assert_eq!(build(&cloud, &point_light(DVec3::ZERO), &Params::default()).channels(), 1);
}

#[test]
fn absorption_from_kappa_and_wavelength_is_equation_7() {
    // Water at 700 nm: κ = 3.35e-8, so α = 4πκ/λ = 0.601 per metre; a slab of 2 m passes e^−1.2.
    let alpha = splat_core::optics::absorption_coefficient(3.35e-8, 700e-9);
    assert!((alpha - 0.6014).abs() < 1e-3);
    let h = 0.1;
    let cloud = medium([20, 20, 9], h, alpha as f32, |_| true);
    let map = build(&cloud, &directional(DVec3::Z), &Params::default());
    let light = f64::from(light_at(&map, Vec3::Z * 1.5));
    assert!((light - (-alpha * 1.9).exp()).abs() < 1e-3, "{light}");
}

#[test]
fn thin_slabs_absorb_more_at_an_angle_and_crossings_do_not() {
    use splat_core::optics::SurfaceOpacity;
    for (surface_opacity, factor) in [(SurfaceOpacity::PerCrossing, 1.0), (SurfaceOpacity::ThinSlab, 2.0)] {
        for spacing in [0.1, 0.02] {
            let cloud = plane(Vec3::ZERO, Vec3::new(0.0, 3f32.sqrt(), 1.0), 40, spacing, SplatKind::Surface, 0.4);
            let materials = [Material { surface_opacity, ..Material::default() }];
            let map = ShadowMap::build(
                &Scene { cloud: &cloud, materials: &materials, objects: &[] },
                &directional(DVec3::Z),
                &Params::default(),
                None,
            )
            .unwrap();
            let light = map.transmittance(&probe(Vec3::Z * 3.0))[0];
            assert!((light - (-0.4 * factor as f32).exp()).abs() < 3e-3, "{surface_opacity:?}: {light}");
        }
    }
}

#[test]
fn a_patch_casts_the_shadows_of_a_point_and_whole_lights_are_refused() {
    let cloud = medium([4; 3], 0.1, 3.0, |_| true);
    let position = DVec3::new(0.3, 2.0, -0.2);
    let normal = DVec3::NEG_Y;
    let patch = Light { shape: LightShape::Patch { position, normal }, intensity: [1.0; 3] };
    let [of_patch, of_point] = [patch, point_light(position)].map(|light| build(&cloud, &light, &Params::default()));
    for k in 0..cloud.len() {
        let receiver = receiver(&cloud, k);
        assert_eq!(of_patch.transmittance(&receiver), of_point.transmittance(&receiver), "{k}");
    }
    let whole = Light { shape: LightShape::Disk { center: position, normal, radius: 0.5 }, ..patch };
    let refused = ShadowMap::build(
        &Scene { cloud: &cloud, materials: &[Material::default()], objects: &[] },
        &whole,
        &Params::default(),
        None,
    );
    assert!(refused.is_err_and(|e| e.to_string().contains("Light::points")));
}

/// Discs of the slow form: their optical depth summed over their plane is their cross-section, on rays of any angle; an opaque one ends rays on
/// the area that it stands for.
#[test]
fn a_disc_of_the_reference_keeps_its_cross_section() {
    let footprints = Params::default().footprints;
    let normal = Vec3::new(0.6, 0.0, 0.8);
    let tangent = Vec3::new(-0.8, 0.0, 0.6) * 0.5;
    // Cells that an opaque edge cuts count whole or not at all.
    for (kind, tangent, error) in [
        (SplatKind::Surface, Vec3::ZERO, 1e-5),
        (SplatKind::Surface, tangent, 1e-5),
        (SplatKind::Opaque, Vec3::ZERO, 5e-4),
        (SplatKind::Opaque, tangent, 5e-4),
    ] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        let position = Vec3::new(0.1, -0.2, 0.3);
        cloud.push(&Splat { position, radius: 0.25, cross_section: 0.1, kind, normal, tangent, ..Splat::default() });
        for along in [DVec3::Z, DVec3::new(0.3, 0.4, 0.8).normalize()] {
            let [u, v] = [along.any_orthonormal_vector(), along.cross(along.any_orthonormal_vector())];
            let n = 400;
            let cell = 1.4 / 400.0;
            let depth = |k: usize| {
                let [x, y] = [k % n, k / n].map(|i| (i as f64 + 0.5) * cell - 0.7);
                let middle = position.as_dvec3() + u * x + v * y;
                tsm::reference::optical_depth(&cloud, &footprints, middle - along, middle + along)
            };
            let covered = |tau: f64| if tau.is_infinite() { 1.0 } else { tau };
            let sum: f64 = (0..n * n).map(depth).map(covered).sum();
            // The plane's area in the area across the rays.
            let found = sum * cell * cell / along.dot(normal.as_dvec3());
            assert!((found - 0.1).abs() < error, "{kind:?}, {tangent}, {along}: {found}");
        }
    }
}

#[test]
fn papers_model_goes_dark_at_an_absorbance_of_two() {
    // Discs on one ray, each of size 1 and opacity 1 − e^−1: A = 0.632 each; light ends after the fourth (2.53 > 2).
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 1..=8 {
        let position = Vec3::Z * (20.0 + k as f32);
        let cross_section = (1.0f32 / 2.4).powi(2);
        let normal = Vec3::NEG_Z;
        let kind = SplatKind::Surface;
        cloud.push(&Splat { position, radius: 1.0, cross_section, kind, normal, ..Splat::default() });
    }
    let params = Params { absorbance: AbsorbanceModel::Paper, resolution: Resolution::Cells(64), ..Params::default() };
    let map = build(&cloud, &point_light(DVec3::ZERO), &params);
    let depth = 1.0 - (-1f32).exp();
    for k in 0..8 {
        let expected = if k as f32 * depth > 2.0 { 0.0 } else { (-depth * k as f32).exp() };
        let target = Receiver { kind: SplatKind::Medium, ..receiver(&cloud, k) };
        let light = map.transmittance(&target)[0];
        assert!((light - expected).abs() < 1e-5, "behind {k}: {light}, not {expected}");
    }
}

#[test]
fn papers_model_takes_the_opacity_of_a_balls_centre() {
    let footprint = splat_core::Footprint::default();
    for (radius, cross_section) in [(0.5f32, 0.1f32), (2.0, 0.1), (2.0, 1.0)] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { position: Vec3::Z * 20.0, radius, cross_section, ..Splat::default() });
        let params =
            Params { absorbance: AbsorbanceModel::Paper, resolution: Resolution::Cells(64), ..Params::default() };
        let map = build(&cloud, &point_light(DVec3::ZERO), &params);
        let [size, k] = [radius, cross_section].map(f64::from);
        // Eq. 6: A = l·c.
        let absorbance = size * (1.0 - libm::exp(-k * footprint.norm() / (size * size)));
        let light = f64::from(light_at(&map, Vec3::Z * 30.0));
        assert!((light - libm::exp(-absorbance)).abs() < 1e-5, "{radius}, {cross_section}: {light}");
    }
}

/// Light behind a cloud of smooth, overlapping splats, by tables of ever more cells, against the sum of their kernels along each ray.
#[test]
fn smooth_shadows_converge_in_second_order() {
    let footprint = splat_core::Footprint::default();
    let radius = 0.25f32;
    let spread = 1.0f32;
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..400 {
        let u = |k| splat_core::rng::unit_f32(31, 0, i, k) - 0.5;
        let position = Vec3::new(u(0), u(1), u(2)) * (2.0 * spread);
        cloud.push(&Splat { position, radius, cross_section: 0.01, ..Splat::default() });
    }
    let places: Vec<Vec3> = (0..4000u64)
        .map(|i| {
            let u = |k| (splat_core::rng::unit_f32(32, 0, i, k) - 0.5) * 2.6;
            Vec3::new(u(0), u(1), -3.0)
        })
        .collect();
    let exact: Vec<f64> = places
        .iter()
        .map(|place| {
            let depth = |p: &Vec3| {
                let s = f64::from((*p - *place).truncate().length_squared() / (radius * radius));
                0.01 * footprint.norm() * footprint.profile(s.min(1.0)) / f64::from(radius * radius)
            };
            libm::exp(-cloud.position.iter().map(depth).sum::<f64>())
        })
        .collect();
    let error = |n: u32| {
        let params = Params { resolution: Resolution::Cells(n), tolerance: 1e-6, ..Params::default() };
        let map = build(&cloud, &directional(-DVec3::Z), &params);
        let square = |(place, exact): (&Vec3, &f64)| (f64::from(light_at(&map, *place)) - exact).powi(2);
        (places.iter().zip(&exact).map(square).sum::<f64>() / places.len() as f64).sqrt()
    };
    // A splat's radius is of 6.4, 12.8 and 25.6 cells: from 4 on kernels are taken on the rays of cells, and only interpolation is left.
    let errors = [64, 128, 256].map(error);
    println!("{errors:?}; of 0.8, 1.6 and 3.2 cells a radius {:?}", [8, 16, 32].map(error));
    for pair in errors.windows(2) {
        let order = libm::log2(pair[0] / pair[1]);
        assert!((1.9..2.1).contains(&order), "{errors:?}: order {order}");
    }
    assert!(errors[0] < 6e-3, "{errors:?}");
}
