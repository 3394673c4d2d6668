//! Light ahead and what faces keep, where a picture shows too little of them.

use super::beam::Path;
use super::grid::LightGrid;
use super::medium::Cell;
use super::scene::Scene;
use super::{NUMBERS, Scattered};
use crate::Volume;
use crate::half_vector::params::{HalfParams, Scattering};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Camera, Grid, Light, LightShape, Material, Packing, Projection, Shading, Similarity};
use splat_core::{TransferFunction, TransferPoint};

/// A constant block of 48 x 48 x 24 around the origin.
fn with_block<T>(extinction: f32, read: impl FnOnce(&Volume<'_>) -> T) -> T {
    let dims = [48, 48, 24];
    let origin = DVec3::new(-23.5, -23.5, -11.5);
    let grid = Grid { origin, axes: DMat3::IDENTITY, dims, values: vec![1.0; dims.iter().product()] };
    let transfer = TransferFunction::new(vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction }]).unwrap();
    let material =
        Material { shading: Shading::Phase, single_scattering_albedo: 0.9, asymmetry: 0.5, ..Material::default() };
    read(&Volume {
        grid: &grid,
        packing: Packing::Cartesian,
        transform: Similarity::default(),
        transfer: &transfer,
        material: &material,
        extinction_scale: 1.0,
        normals: false,
        clip: &[],
        object: 0,
        shadow_coefficient: 1.0,
        casts_shadow: true,
    })
}

/// Its cells under light that comes along z.
fn cells() -> LightGrid {
    let above = Projection::Orthographic { height: 48.0 };
    let camera = Camera::look_at(DVec3::Z * 100.0, DVec3::ZERO, DVec3::Y, above, [64, 64]).unwrap();
    with_block(1.0, |volume| LightGrid::new(&[*volume], &camera, 8))
}

#[test]
fn ms07_light_ahead_spreads_as_its_cone_says() {
    let grid = cells();
    let [width, height] = grid.columns;
    let layers = grid.layers;
    let depth = layers as f64 * grid.depth;
    // All is scattered in the first layer, and nothing behind it.
    let sigma = (40.0 / grid.depth) as f32;
    let dense = Cell { extinction: [sigma; 3], scattering: [sigma; 3], ahead: [sigma; 3], ..Cell::default() };
    let mut cells = vec![Cell::default(); grid.cells()];
    let is_first = |at: usize| (at / width).is_multiple_of(layers);
    cells.iter_mut().enumerate().filter(|(at, _)| is_first(*at)).for_each(|(_, cell)| *cell = dense);
    let middle = [width / 2, height / 2];
    let mut entering = vec![0.0; width * height];
    entering[middle[1] * width + middle[0]] = 1.0;
    let entering = [entering.clone(), entering.clone(), entering];
    for cone in [0.05, 0.1, 0.2] {
        let beam = Path { grid: &grid, cells: &cells, entering: &entering, others: &[], cone }.march(0);
        assert!((beam.transmitted - 1.0).abs() < 1e-5, "{cone}: {}", beam.transmitted);
        for a in 0..2 {
            // Squares of distances at the far face: tan²·z²/3.
            let second = |at: usize| {
                let column = [at % width, at / width];
                let away = (column[a] as f64 - middle[a] as f64) * grid.step[a];
                beam.ahead[(column[1] * (layers + 1) + layers) * width + column[0]] * away * away
            };
            let found: f64 = (0..width * height).map(second).sum();
            let expected = (libm::tan(cone) * depth).powi(2) / 3.0;
            assert!((found / expected - 1.0).abs() < 3e-3, "{cone}, along {a}: {found}, not {expected}");
        }
    }
}

#[test]
fn ms08_light_that_fades_ends_before_its_numbers_are_not_normal() {
    let grid = cells();
    let sigma = (60.0 / grid.depth) as f32;
    let cell =
        Cell { extinction: [sigma; 3], scattering: [0.5 * sigma; 3], ahead: [0.2 * sigma; 3], ..Cell::default() };
    let entering = vec![1.0; grid.columns[0] * grid.columns[1]];
    let entering = [entering.clone(), entering.clone(), entering];
    let cells = vec![cell; grid.cells()];
    let others = &[];
    let beam = Path { grid: &grid, cells: &cells, entering: &entering, others, cone: 0.3 }.march(0);
    assert!(beam.incoming.iter().any(|power| *power > 0.5) && beam.transmitted == 0.0);
    assert!(beam.incoming.iter().all(|power| *power == 0.0 || *power > 1e-30), "a trace goes on");
    // Neither do faces keep such, in whichever layer they would come.
    let shape = LightShape::Directional { direction: -DVec3::Z };
    let lit = LitBy { slide: None, light: Light { shape, intensity: [1.0; 3] }, shadow: None };
    for scattering in [Scattering::Forward, Scattering::ForwardAndBack] {
        let params = HalfParams { scattering, voxels_per_cell: 8, ..HalfParams::default() };
        let numbers: Vec<[f32; NUMBERS]> = with_block(9.0, |volume| {
            let scene = Scene::new(&[*volume], None, &lit, &params, DVec3::ZERO);
            Scattered::new(&scene, scattering, false).faces
        });
        let is_fading = numbers.iter().flatten().any(|v| *v > 0.0 && *v < 1e-18);
        assert!(is_fading && !numbers.iter().flatten().any(|v| v.is_subnormal()), "{scattering:?}");
    }
}
