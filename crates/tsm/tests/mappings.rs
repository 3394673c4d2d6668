//! TS2-TS5: mappings invert, cover the sphere, wrap, and never leave the table.

use proptest::prelude::*;
use splat_core::glam::{Vec2, Vec3};
use std::f64::consts::PI;
use tsm::mapping::{Mapping, Octahedral, Planar, PolarAzimuth, PolarRange};

fn sphere_tables(n: u32) -> [Box<dyn Mapping>; 2] {
    [Box::new(Octahedral::new(n)), Box::new(PolarAzimuth::new(2 * n, n, PolarRange::SPHERE))]
}

fn planar(perspective: bool) -> Planar {
    Planar { min: Vec2::splat(-1.0), cell: 1.0 / 64.0, size: [128, 128], perspective }
}

#[test]
fn ts05_cells_sum_to_the_sphere() {
    for n in [1, 2, 3, 16, 180, 1001] {
        for table in sphere_tables(n) {
            let [columns, rows] = table.size();
            let sum: f64 = (0..rows).map(|r| table.measure(r * columns) * f64::from(columns)).sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-12, "{n}: {sum}");
        }
    }
}

#[test]
fn ts05_octahedral_cells_have_equal_solid_angle() {
    // Uniform directions: each of 24² cells gets its share; χ² with 575 degrees of freedom exceeds 683 with p = 1e-3.
    let table = Octahedral::new(24);
    let (n, cells) = (576_000u64, 576);
    let mut count = vec![0u64; cells];
    for i in 0..n {
        let at = table.locate(crate::common::direction(1, i)).unwrap().at.floor();
        count[table.wrap(at.x as i32, at.y as i32).unwrap() as usize] += 1;
    }
    let expected = n as f64 / cells as f64;
    let chi2: f64 = count.iter().map(|c| (*c as f64 - expected).powi(2) / expected).sum();
    assert!(chi2 < 683.0, "χ² = {chi2}");
}

#[test]
fn rays_and_places_invert() {
    let mut tables: Vec<Box<dyn Mapping>> = vec![Box::new(planar(false)), Box::new(planar(true))];
    [7, 64, 513].into_iter().for_each(|n| tables.extend(sphere_tables(n)));
    for table in &tables {
        let [columns, rows] = table.size();
        for cell in 0..columns * rows {
            let centre = Vec2::new((cell % columns) as f32 + 0.5, (cell / columns) as f32 + 0.5);
            let ray = table.cell_ray(cell);
            assert!((ray.direction - table.ray(centre).direction).length() < 3e-6);
            let place = table.locate(ray.base + ray.direction * 3.0).unwrap();
            assert!((place.at - centre).length() < 0.02, "{cell}: {} for {centre}", place.at);
            assert!((place.distance - 3.0).abs() < 1e-5);
        }
    }
}

#[test]
fn gradients_are_the_derivatives_of_places() {
    let mut tables: Vec<Box<dyn Mapping>> = vec![Box::new(planar(false)), Box::new(planar(true))];
    tables.extend(sphere_tables(64));
    for (k, table) in tables.iter().enumerate() {
        for i in 0..2000 {
            let mut p = crate::common::direction(2, i);
            if k < 2 {
                p = Vec3::new(0.4 * p.x, 0.4 * p.y, 1.0 + 0.3 * p.z);
            }
            let steps = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
                let at = |s: f32| table.locate(p + axis * s).unwrap().at;
                (at(1e-3) - at(-1e-3)) / 2e-3
            });
            let [gu, gv] = table.gradients(p);
            let (nu, nv) = (Vec3::from(steps.map(|s| s.x)), Vec3::from(steps.map(|s| s.y)));
            let smooth = p.abs().min_element() > 5e-3 && p.x.hypot(p.y) > 0.1;
            if smooth && nu.length() < 1e3 {
                let error = (gu - nu).length() / gu.length() + (gv - nv).length() / gv.length();
                assert!(error < 0.01, "table {k}: at {p}: {gu} {nu}, {gv} {nv}");
            }
        }
    }
}

#[test]
fn ts02_directions_near_the_poles_keep_their_digits() {
    let polar = PolarAzimuth::new(1 << 20, 1 << 20, PolarRange { polar: [0.0, 1e-3], azimuth: [0.0, 2.0 * PI] });
    let octahedral = Octahedral::new(1 << 14);
    for exponent in [-5.0f64, -4.5, -4.0, -3.5, -3.0] {
        let theta = 10f64.powf(exponent);
        let p = Vec3::new(theta.sin() as f32, 0.0, theta.cos() as f32);
        let row = f64::from(polar.locate(p).unwrap().at.y) / f64::from(1 << 20) * 1e-3;
        assert!((row / theta - 1.0).abs() < 1e-5, "{theta}: row at {row}");
        // X − ½ grows as θ/√2 of a half width.
        let x = f64::from(octahedral.locate(p).unwrap().at.x) / f64::from(1 << 13) - 1.0;
        assert!((x / (theta / 2f64.sqrt()) - 1.0).abs() < 0.02 + 1e-7 / theta, "{theta}: {x}");
    }
}

#[test]
fn ts03_both_sides_of_the_seam_are_one_place() {
    let table = PolarAzimuth::new(1024, 512, PolarRange::SPHERE);
    let at = |y: f32| table.locate(Vec3::new(-1.0, y, 0.1)).unwrap().at;
    assert_eq!(at(0.0), at(-0.0));
    let plus_x = |y: f32| table.locate(Vec3::new(1.0, y, 0.1)).unwrap().at.x;
    assert_eq!(plus_x(0.0), plus_x(-0.0));
    let below = plus_x(-1e-7);
    let cell = table.wrap(below.floor() as i32, 100).unwrap();
    assert!(cell < 1024 * 512 && (below == 0.0 || below > 1023.9), "{below}");
    for (column, same) in [(-1, 1023), (1024, 0), (1025, 1)] {
        assert_eq!(table.wrap(column, 7), table.wrap(same, 7));
    }
    // Across the pole rows continue on the opposite side.
    assert_eq!(table.wrap(3, -1), table.wrap(515, 0));
}

#[test]
fn octahedral_edges_continue_at_the_neighbouring_direction() {
    let table = Octahedral::new(64);
    let side = (table.measure(0) as f32).sqrt();
    for k in 0..64 {
        for (inside, outside) in [((0, k), (-1, k)), ((63, k), (64, k)), ((k, 0), (k, -1)), ((k, 63), (k, 64))] {
            let a = table.cell_ray(table.wrap(inside.0, inside.1).unwrap()).direction;
            let b = table.cell_ray(table.wrap(outside.0, outside.1).unwrap()).direction;
            assert!(a.distance(b) < 2.0 * side, "{inside:?} → {outside:?}: {a} {b}");
        }
    }
    assert_eq!(table.wrap(-65, 0), None);
}

#[test]
fn ts04_a_table_of_one_direction_is_widened() {
    let table = PolarAzimuth::new(180, 180, PolarRange { polar: [1.0, 1.0], azimuth: [0.3, 0.0] });
    for i in 0..10_000 {
        if let Some(place) = table.locate(crate::common::direction(4, i)) {
            assert!(place.at.x < 181.0 && place.at.y < 181.0);
        }
    }
    assert!((0..180 * 180).all(|c| table.measure(c) > 0.0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn ts04_indices_stay_inside_for_any_direction(x in any::<f32>(), y in any::<f32>(), z in any::<f32>()) {
        prop_assume!(x.is_finite() && y.is_finite() && z.is_finite());
        // Frames scale their lengths to at most 4, so squares do not overflow here.
        let p = Vec3::new(x, y, z);
        let p = if p.abs().max_element() > 4.0 { p / p.abs().max_element() } else { p };
        let mut tables: Vec<Box<dyn Mapping>> = vec![Box::new(planar(false)), Box::new(planar(true))];
        tables.extend(sphere_tables(180));
        for table in &tables {
            let [columns, rows] = table.size();
            if let Some(place) = table.locate(p) {
                let at = place.at.floor();
                prop_assert!(place.distance > 0.0 || table.is_parallel());
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1), (-1, -1)] {
                    let cell = table.wrap(at.x as i32 + i, at.y as i32 + j);
                    prop_assert!(cell.is_none_or(|c| c < columns * rows));
                }
            }
        }
    }
}
