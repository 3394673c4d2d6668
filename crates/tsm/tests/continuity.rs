//! X2, TS16: no light jumps when a splat moves or grows across a threshold between two ways of depositing it.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Splat, SplatKind};
use tsm::{MappingChoice, Params, Resolution};

const CELLS: u32 = 64;
/// Optical depth of the splat at its middle; all bounds are shares of it.
const DEPTH: f32 = 0.3;

/// Light behind one splat in nine directions about `middle`.
fn lights(position: Vec3, radius: f32, normal: Vec3, middle: Vec3) -> [f32; 9] {
    let norm = splat_core::Footprint::default().norm() as f32;
    let kind = if normal == Vec3::ZERO { SplatKind::Medium } else { SplatKind::Surface };
    let cross_section = DEPTH * radius * radius / norm;
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat { position, radius, cross_section, kind, normal, ..Splat::default() });
    let mapping = MappingChoice::Octahedral;
    let resolution = Resolution::Cells(CELLS);
    let map = build(&cloud, &point_light(DVec3::ZERO), &Params { mapping, resolution, ..Params::default() });
    let [u, v] = [middle.any_orthonormal_vector(), middle.cross(middle.any_orthonormal_vector()).normalize()];
    std::array::from_fn(|k| {
        let aside = (u * (k % 3) as f32 + v * (k / 3) as f32 - u - v) * 0.04;
        light_at(&map, (middle.normalize() + aside) * 5.0)
    })
}

/// Greatest change of light from one of `steps` places and radii to the next.
fn greatest_step(steps: u32, normal: Vec3, at: impl Fn(f32) -> (Vec3, f32)) -> f32 {
    let middle = at(0.5).0;
    let mut last: Option<[f32; 9]> = None;
    let mut worst = 0.0f32;
    for k in 0..=steps {
        let (position, radius) = at(k as f32 / steps as f32);
        let now = lights(position, radius, normal, middle);
        if let Some(last) = last {
            worst = now.iter().zip(last).fold(worst, |m, (a, b)| m.max((a - b).abs()));
        }
        last = Some(now);
    }
    worst
}

#[test]
fn x2_growing_splats_make_no_jump() {
    // From a hundredth of a cell to where it would be swept: every threshold of size lies between.
    let cell = 2.0 * (4.0 * std::f32::consts::PI).sqrt() / CELLS as f32;
    let slant = Vec3::new(0.3, -0.8, 0.5).normalize();
    let [inner, edge, border] = [Vec3::new(0.5, 0.7, 0.4), Vec3::new(0.9, 0.01, 0.3), Vec3::new(0.6, 0.55, -0.02)];
    for (direction, normal) in [(inner, Vec3::ZERO), (edge, Vec3::ZERO), (edge, slant), (border, slant)] {
        let position = direction.normalize() * 2.0;
        let worst = greatest_step(3000, normal, |t| (position, cell * (0.01 + 7.5 * t)));
        println!("{direction} {normal}: {worst:.2e}");
        assert!(worst < 1e-3 * DEPTH, "{direction} {normal}: {worst}");
    }
}

#[test]
fn x2_moving_splats_make_no_jump_at_octant_edges_and_corners() {
    let cell = 2.0 * (4.0 * std::f32::consts::PI).sqrt() / CELLS as f32;
    // Across a middle line, a side, a diagonal; past a pole and a corner at some distance.
    let paths = [
        (Vec3::new(0.7, 0.0, 0.7), Vec3::Y),
        (Vec3::new(0.7, 0.0, -0.7), Vec3::Y),
        (Vec3::new(0.9, 0.3, 0.0), Vec3::Z),
        (Vec3::new(0.02, 0.05, 1.0), Vec3::X),
        (Vec3::new(1.0, 0.04, 0.03), Vec3::Z),
    ];
    for (at, (middle, along)) in paths.into_iter().enumerate() {
        for size in [[0.4, 2.0], [1.0, 3.5]][at % 2] {
            let path = |t: f32| ((middle.normalize() + along * (0.2 * (t - 0.5))) * 2.0, size * cell);
            let worst = greatest_step(2000, Vec3::ZERO, path);
            println!("{middle} {size}: {worst:.2e}");
            assert!(worst < 1e-3 * DEPTH, "{middle} {size}: {worst}");
        }
    }
}
