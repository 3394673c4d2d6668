//! TS2-TS5: mappings invert, cover the sphere, wrap, and never leave the table.

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
fn ts05_cells_of_equal_angles_differ_by_115_to_1() {
    let table = PolarAzimuth::new(360, 180, PolarRange::SPHERE);
    let of_row = |row: u32| table.measure(row * 360);
    let (least, most) = (0..180).map(of_row).fold((f64::MAX, 0.0f64), |(a, b), m| (a.min(m), b.max(m)));
    assert_eq!((most / least).round(), 115.0, "{}", most / least);
}

#[test]
fn ts04_the_papers_index_leaves_its_table_where_angles_are_degrees() {
    // Eq. 2 with φ from 0 to 180 degrees in k = 180 columns.
    let index = |phi: f64| (phi - 0.0) * 180.0 * 180.0 / (PI * (180.0 - 0.0));
    assert_eq!(index(180.0).round(), 10_313.0);
    let place = PolarAzimuth::new(360, 180, PolarRange::SPHERE).locate(Vec3::NEG_Z).unwrap();
    assert!(place.at.y.floor() <= 180.0, "{}", place.at);
}

#[test]
fn ts05_octahedral_cells_have_equal_solid_angle() {
    // Uniform directions: each of 24² cells gets its share; χ² with 575 degrees of freedom exceeds 683 with p = 1e-3.
    let table = Octahedral::new(24);
    let n = 576_000u64;
    let cells = 576;
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
            let nu = Vec3::from(steps.map(|s| s.x));
            let nv = Vec3::from(steps.map(|s| s.y));
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

#[test]
fn ts04_indices_stay_inside_for_a_million_directions_of_any_bits() {
    let mut tables: Vec<Box<dyn Mapping>> = vec![Box::new(planar(false)), Box::new(planar(true))];
    tables.extend(sphere_tables(180));
    let mut below_normal = 0;
    for i in 0..1_000_000 {
        let p = Vec3::from([0, 1, 2].map(|c| f32::from_bits((splat_core::rng::bits(4, 1, i, c) >> 32) as u32)));
        if !p.is_finite() {
            continue;
        }
        // Numbers below the normal ones, zeros of both signs and axes among them.
        let p = match i % 8 {
            0 => p * Vec3::new(1.0, 1e-38, 0.0),
            1 => Vec3::new(-0.0, p.y, 1e-40),
            _ => p,
        };
        below_normal += u32::from(p.to_array().iter().any(|v| v.is_subnormal()));
        // Frames scale their lengths to at most 4, so squares do not overflow here.
        let p = if p.abs().max_element() > 4.0 { p / p.abs().max_element() } else { p };
        for table in &tables {
            let [columns, rows] = table.size();
            if let Some(place) = table.locate(p) {
                let at = place.at.floor();
                assert!(place.distance > 0.0 || table.is_parallel(), "{p}");
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1), (-1, -1)] {
                    let cell = table.wrap(at.x as i32 + i, at.y as i32 + j);
                    assert!(cell.is_none_or(|c| c < columns * rows), "{p}: {cell:?}");
                }
            }
        }
    }
    assert!(below_normal > 100_000, "{below_normal}");
}

/// What lies a quarter turn about the axis of poles further lies a quarter of the table further, at the poles and at the seam as elsewhere.
#[test]
fn ts02_ts03_a_quarter_turn_moves_every_direction_by_a_quarter_of_the_table() {
    let columns = 1024;
    let rows = 512;
    let polar = PolarAzimuth::new(columns, rows, PolarRange::SPHERE);
    let octahedral = Octahedral::new(rows);
    let half = 0.5 * rows as f32;
    for i in 0..100_000 {
        let mut p = crate::common::direction(5, i);
        if i % 4 == 0 {
            // Beside a pole, down to where sines have no digits of a cosine left.
            p *= Vec3::new(1e-6, 1e-6, 1.0) * if i % 8 == 0 { 1.0 } else { 1e-3 };
        }
        let turned = Vec3::new(-p.y, p.x, p.z);
        let [a, b] = [p, turned].map(|p| polar.locate(p).unwrap());
        // A column is an f32, whose last digit is worth 2⁻¹⁴ of a column from column 512 on.
        let way = (b.at.x - a.at.x).rem_euclid(columns as f32);
        assert!((way - 0.25 * columns as f32).abs() <= 1.0 / 8192.0, "{p}: {way}");
        assert_eq!((a.at.y.to_bits(), a.distance.to_bits()), (b.at.y.to_bits(), b.distance.to_bits()), "{p}");
        let [a, b] = [p, turned].map(|p| octahedral.locate(p).unwrap().at - half);
        assert!((Vec2::new(-a.y, a.x) - b).abs().max_element() <= 1.0 / 16384.0, "{p}: {a} {b}");
    }
}
