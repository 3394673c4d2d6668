//! How far light is from that of smaller cells, as it is estimated and as it is.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Receiver, Splat, SplatKind, Transmittance};
use tsm::{Params, Resolution};

/// The mean estimate, and the mean difference from a table of sixteen times the cells, of places on a square behind the casters.
fn means(cloud: &Cloud, normal: Vec3) -> [f32; 2] {
    let light = point_light(DVec3::new(0.0, 0.0, -6.0));
    let [coarse, fine] =
        [12, 192].map(|n| build(cloud, &light, &Params { resolution: Resolution::Cells(n), ..Params::default() }));
    let mut sums = [0.0; 2];
    for k in 0..40 * 40 {
        let position = Vec3::new((k % 40) as f32 - 19.5, (k / 40) as f32 - 19.5, 0.0) * 0.037 + Vec3::Z * 2.0;
        let kind = if normal == Vec3::ZERO { SplatKind::Medium } else { SplatKind::Opaque };
        let receiver = Receiver { position, normal, radius: 0.01, kind };
        let [through, exact] = [&coarse, &fine].map(|map| map.transmittance(&receiver)[1]);
        sums[0] += coarse.interpolation_error(&receiver);
        sums[1] += (through - exact).abs();
    }
    sums.map(|sum| sum / 1600.0)
}

fn wall() -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..40 * 40 {
        let position = Vec3::new((k % 40) as f32 - 19.5, (k / 40) as f32 - 19.5, 0.0) * 0.02;
        let kind = SplatKind::Opaque;
        cloud.push(&Splat {
            position,
            radius: 0.02,
            cross_section: 4e-4,
            kind,
            normal: Vec3::NEG_Z,
            ..Splat::default()
        });
    }
    cloud
}

#[test]
fn the_error_of_cells_is_estimated_within_a_factor_of_three() {
    let ball = smooth_ball(0.05, 4.0, 0.5);
    for (name, cloud, normal) in
        [("an edge", &wall(), Vec3::NEG_Z), ("a ball", &ball, Vec3::NEG_Z), ("a ball in a medium", &ball, Vec3::ZERO)]
    {
        let [estimated, found] = means(cloud, normal);
        assert!(found > 1e-4, "{name}: {found}");
        assert!(estimated > found / 3.0 && estimated < found * 3.0, "{name}: {estimated}, not {found}");
    }
}

#[test]
fn what_is_lit_evenly_has_no_error() {
    let map = build(&wall(), &point_light(DVec3::new(0.0, 0.0, -6.0)), &Params::default());
    for position in [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 3.0), Vec3::new(30.0, 0.0, 0.0)] {
        assert_eq!(map.interpolation_error(&probe(position)), 0.0, "{position}");
    }
}

#[test]
fn what_wider_cells_would_change_is_three_times_the_error_of_cells() {
    let ball = smooth_ball(0.05, 4.0, 0.5);
    let light = point_light(DVec3::new(0.0, 0.0, -6.0));
    let map = |cells| build(&ball, &light, &Params { resolution: Resolution::Cells(cells), ..Params::default() });
    let [coarse, fine] = [map(12), map(192)];
    let wider = coarse.wider();
    let mut sums = [0.0; 4];
    for k in 0..40 * 40 {
        let position = Vec3::new((k % 40) as f32 - 19.5, (k / 40) as f32 - 19.5, 0.0) * 0.037 + Vec3::Z * 2.0;
        let receiver = probe(position);
        sums[0] += (wider.transmittance(&receiver)[1] - coarse.transmittance(&receiver)[1]) / 3.0;
        sums[1] += coarse.transmittance(&receiver)[1] - fine.transmittance(&receiver)[1];
        sums[2] += ((wider.absorbance(&receiver)[1] - coarse.absorbance(&receiver)[1]) / 3.0).abs();
        sums[3] += (coarse.absorbance(&receiver)[1] - fine.absorbance(&receiver)[1]).abs();
    }
    let [light, found_light, depth, found_depth] = sums.map(|sum| sum / 1600.0);
    assert!(found_depth > 1e-3, "{found_depth}");
    assert!((found_depth / 2.0..2.0 * found_depth).contains(&depth), "{depth} for {found_depth}");
    assert!((light - found_light).abs() < found_depth, "{light} for {found_light}");
    let outside = probe(Vec3::new(30.0, 0.0, 0.0));
    assert_eq!(wider.transmittance(&outside), coarse.transmittance(&outside));
}
