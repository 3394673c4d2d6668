//! TS2, TS16: absorbance about a lamp is as even beside the edges and corners of the octahedral table as elsewhere.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use tsm::mapping::{Mapping, Table};
use tsm::{MappingChoice, Params, Resolution, ShadowMap};

/// Tables, and how much a cell may be off.
const SIZES: [(Resolution, f64); 4] = [
    (Resolution::Auto, 5e-3),
    (Resolution::Cells(32), 1e-2),
    (Resolution::Cells(64), 5e-3),
    (Resolution::Cells(128), 5e-3),
];

fn octahedral(cloud: &splat_core::Cloud, resolution: Resolution) -> ShadowMap {
    let params = Params { mapping: MappingChoice::Octahedral, resolution, ..Params::default() };
    build(cloud, &point_light(DVec3::ZERO), &params)
}

#[test]
fn ts16_every_cell_has_the_absorbance_of_a_ball_about_the_lamp() {
    let cloud = smooth_ball(0.05, 1.5, 1.0);
    for (resolution, bound) in SIZES {
        let map = octahedral(&cloud, resolution);
        let last = |cell| f64::from(map.list(cell).last().map_or(0.0, |e| e.1[0]));
        let mean = (0..map.cells()).map(last).sum::<f64>() / f64::from(map.cells());
        let (error, at) = (0..map.cells()).fold((0.0f64, 0), |m, cell| {
            let error = last(cell) / mean - 1.0;
            if error.abs() > m.0.abs() { (error, cell) } else { m }
        });
        let Table::Octahedral(table) = map.table() else { panic!("not octahedral") };
        println!("{resolution:?}: mean {mean:.5}, worst {error:+.5} at {}", table.cell_ray(at).direction);
        assert!((mean - 1.5).abs() < 5e-3, "{resolution:?}: mean {mean}");
        assert!(error.abs() < bound, "{resolution:?}: {error} at {}", table.cell_ray(at).direction);
    }
}

/// The distance of a direction from the nearest edge between octants, radians: from z = 0 and from the planes x = 0, y = 0.
fn to_edge(d: Vec3) -> f32 {
    d.abs().min_element().asin()
}

#[test]
fn look_ups_beside_edges_of_octants_are_as_exact_as_elsewhere() {
    // A thick wall beside the lamp, seen across the equator and a middle line, that darkens fast to its sides.
    let wall = medium([2, 60, 60], 0.05, 2.0, |_| true);
    let mut cloud = wall;
    cloud.position.iter_mut().for_each(|p| p.x += 1.0);
    for (size, bound) in [(32, 0.02), (64, 0.006), (128, 0.004)] {
        let map = octahedral(&cloud, Resolution::Cells(size));
        let cell = (4.0 * std::f32::consts::PI).sqrt() / size as f32;
        let mut beside = 0.0f64;
        let mut apart = 0.0f64;
        for i in 0..40_000 {
            let to = Vec3::X + 0.5 * (direction(8, i) * Vec3::new(0.0, 2.2, 2.2));
            let d = to.normalize();
            if d.x < 0.7 {
                continue;
            }
            let truth = (-2.0 * 0.25 / f64::from(d.x)).exp();
            let error = (f64::from(light_at(&map, to * 2.0)) / truth - 1.0).abs();
            let worst = if to_edge(d) < cell { &mut beside } else { &mut apart };
            *worst = worst.max(error);
        }
        println!("{size}: {beside:.5} beside edges, {apart:.5} elsewhere");
        assert!(beside < bound && apart < bound, "{size}: {beside} beside edges, {apart} elsewhere");
    }
}
