//! TS2, TS16: absorbance about a lamp is as even beside the edges and corners of the octahedral table as elsewhere.

use common::*;
use splat_core::glam::DVec3;
use tsm::mapping::{Mapping, Table};
use tsm::{MappingChoice, Params, Resolution, ShadowMap};

mod common;

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
        let own = |cell| f64::from(map.list(cell).last().map_or(0.0, |e| e.1[0]));
        let mean = (0..map.cells()).map(own).sum::<f64>() / f64::from(map.cells());
        let (error, at) = (0..map.cells()).fold((0.0f64, 0), |m, cell| {
            let error = own(cell) / mean - 1.0;
            if error.abs() > m.0.abs() { (error, cell) } else { m }
        });
        let Table::Octahedral(table) = map.table() else { panic!("not octahedral") };
        println!("{resolution:?}: mean {mean:.5}, worst {error:+.5} at {}", table.cell_ray(at).direction);
        assert!((mean - 1.5).abs() < 5e-3, "{resolution:?}: mean {mean}");
        assert!(error.abs() < bound, "{resolution:?}: {error} at {}", table.cell_ray(at).direction);
    }
}
