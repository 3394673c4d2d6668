//! Work, counted: what is shaded of what was touched, and how fragments follow widths of slabs and pixels of a voxel.

use crate::common::{constant, cubic, draw, exact, grid, input, parallel, transfer, unlit, volume};
use sheet_light::{Params, SheetCounts, SheetInput};
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Grid, Light, LightShape, Material};

/// The counts of a volume that is seen along z, of which the picture shows a square.
fn counts(grid: &Grid, extinction: &[(f32, f32)], side: f64, pixels: u32, params: &Params) -> SheetCounts {
    let tf = transfer(extinction);
    let material = unlit();
    let camera = parallel([0.0, 0.0, 30.0], side, [pixels, pixels]);
    draw(&input(&[volume(grid, &tf, &material)], &camera, &[]), params).unwrap().1
}

#[test]
fn parts_of_a_sheet_that_received_nothing_are_not_shaded() {
    let ball = grid([48; 3], cubic(0.125), |p| (1.5 - p.length()).max(0.0));
    let counts = counts(&ball, &[(0.25, 0.0), (0.5, 1.0)], 12.0, 192, &exact());
    let all = 192 * 192 * counts.slabs;
    println!("of {all} pixels of sheets {} were touched, {} shaded", counts.touched, counts.shaded);
    assert!(counts.touched > 0 && 4 * counts.touched < all, "{counts:?}");
    // Whole vectors of at most sixteen pixels are shaded.
    assert!((counts.touched..counts.touched * 3 / 2).contains(&counts.shaded), "{counts:?}");
}

#[test]
fn pixels_that_are_opaque_are_not_shaded() {
    // Slabs of an optical depth of 1, of which four leave less than the threshold; what is done is looked for every four slabs, and kernels
    // reach two slabs before the block.
    let counted = |params: &Params| {
        let block = grid([40, 40, 64], cubic(0.25), |_| 1.0);
        counts(&block, &[(0.0, 4.0)], 6.0, 96, params)
    };
    let cut = Params { transmittance_cutoff: Params::PAPERS_CUTOFF, ..exact() };
    let full = counted(&exact());
    let early = counted(&cut);
    let a_pixel = |counts: SheetCounts| counts.shaded as f64 / (96.0 * 96.0);
    println!("pixels shaded: {:.1} a pixel of the picture, {:.1} with the threshold", a_pixel(full), a_pixel(early));
    assert!(a_pixel(full) >= 64.0 && (4.0..=4.0 + 4.0 + 4.0).contains(&a_pixel(early)), "{full:?}, {early:?}");
    // Beside pixels that are seen through: half of the block is thin.
    let half = grid([40, 40, 64], cubic(0.25), |p| if p.x < 0.0 { 1.0 } else { 0.0 });
    let counted = |params: &Params| counts(&half, &[(0.0, 0.01), (1.0, 4.0)], 6.0, 96, params);
    let full = counted(&exact());
    let early = counted(&cut);
    println!("half of it is thin: {:.1}, {:.1} with the threshold", a_pixel(full), a_pixel(early));
    assert!(a_pixel(full) >= 64.0 && a_pixel(early) < 0.5 * a_pixel(full) + 0.5 * 12.0, "{full:?}, {early:?}");
}

#[test]
fn x6_traces_of_matter_and_light_are_not_drawn() {
    let half = grid([24; 3], cubic(0.25), |p| if p.x < 0.0 { 1.0 } else { 0.0 });
    let material = Material::default();
    let camera = parallel([0.0, 0.0, 30.0], 6.0, [48, 48]);
    let drawn = |extinction: f32, intensity: f32| {
        let shape = LightShape::Directional { direction: DVec3::new(0.6, 0.0, -0.8) };
        let lights = [LitBy { slide: None, light: Light { shape, intensity: [intensity; 3] }, shadow: None }];
        let tf = transfer(&[(0.0, extinction), (0.5, extinction), (1.0, 1e-6)]);
        let volumes = [volume(&half, &tf, &material)];
        let input = SheetInput { ambient: [0.0; 3], ..input(&volumes, &camera, &lights) };
        let (out, counts) = draw(&input, &exact()).unwrap();
        (out.optical_depth, out.channels, counts.records)
    };
    let nothing = drawn(0.0, 1.0);
    let trace = drawn(1e-36, 1.0);
    assert!(trace == nothing && trace.2 > 0);
    // Matter that is not yet a trace takes all voxels.
    assert!(drawn(1e-12, 1.0).2 > trace.2);
    assert_eq!(drawn(0.0, 1e-39).1, drawn(0.0, 0.0).1);
    assert!(nothing.1.iter().flatten().any(|v| *v > 0.0));
}

#[test]
fn fragments_a_voxel_do_not_follow_the_number_of_slabs_and_shading_does() {
    let block = grid([24; 3], cubic(0.25), |_| 1.0);
    let counted = |width: f64| {
        let params = Params { slab_width: Some(width), ..exact() };
        counts(&block, &[(0.0, 0.1)], 3.0, 48, &params)
    };
    let series = [0.25, 0.125, 0.0625].map(counted);
    let a_voxel = |counts: &SheetCounts| counts.fragments as f64 / counts.records as f64;
    for (n, counts) in series.iter().enumerate() {
        let fragments = a_voxel(counts);
        let shaded = counts.shaded as f64 / series[0].shaded as f64;
        println!("1/{} of a step: {fragments:.1} fragments a voxel, {shaded:.2} times the pixels shaded", 1 << n);
        assert!((fragments / a_voxel(&series[0]) - 1.0).abs() < 0.02, "{counts:?}");
        // Kernels reach as far beyond the faces whatever the slabs.
        assert!((shaded / f64::from(1 << n) - 1.0).abs() < 0.2, "{counts:?}");
    }
}

#[test]
fn fragments_a_voxel_follow_the_pixels_that_it_is_wide() {
    let block = grid([6; 3], cubic(1.0), |_| 1.0);
    let tf = constant(0.1);
    let material = unlit();
    let volumes = [volume(&block, &tf, &material)];
    for scale in [1, 2, 4, 8] {
        let camera = parallel([0.0, 0.0, 30.0], 24.0, [24 * scale, 24 * scale]);
        let (_, counts) = draw(&input(&volumes, &camera, &[]), &exact()).unwrap();
        // A square four voxels wide; all voxels lie inside the picture.
        let fragments = counts.fragments as f64 / counts.visible as f64;
        let square = f64::from(4 * scale).powi(2);
        println!("{scale} pixels a voxel: {fragments:.1} fragments each");
        // Whole pixels at its borders, and rims of tiles.
        let border = (1.0 + 2.0 / f64::from(4 * scale)).powi(2);
        assert!((square..1.15 * border * square).contains(&fragments), "{scale}: {fragments} of {square}");
    }
}
