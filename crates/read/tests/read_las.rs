//! LAS and LAZ: exact integers, colours, intensity, classes.
#![cfg(feature = "las")]

use crate::read_samples::oldest::{EndlessSwitches, laz_oldest, laz_pointwise};
use crate::read_samples::{gzip, las, las_steps, load};
use read::Loaded;
use splat_core::RawPoints;

fn points(content: &[u8]) -> RawPoints {
    match load("c.laz", content).unwrap() {
        Loaded::Points(points) => points,
        other => panic!("not points: {other:?}"),
    }
}

#[test]
fn cv12_integers_survive_exactly_in_every_point_format() {
    for format in [0, 1, 2, 3, 6, 7, 8] {
        for compressed in [false, true] {
            let p = points(&las(format, 40, compressed));
            let lattice = p.lattice.as_ref().unwrap();
            let expected: Vec<[i32; 3]> = (0..40).map(las_steps).collect();
            assert_eq!(lattice.steps, expected, "format {format}, compressed {compressed}");
            assert_eq!((lattice.scale.x, lattice.offset.x), (1e-3, 5e6));
            assert_eq!(p.value, (0..40).map(|i| i as f32 * 3.0).collect::<Vec<_>>());
            assert_eq!(p.classification, (0..40).map(|i| i % 7).collect::<Vec<u8>>());
            assert_eq!(p.color.is_empty(), !matches!(format, 2 | 3 | 7 | 8));
            p.validate().unwrap();
        }
    }
}

/// Files of the oldest kind of LAZ have no chunks; they were called damaged.
#[test]
fn laz_without_chunks_is_read() {
    for format in 0..=3 {
        assert_eq!(points(&laz_oldest(format, 300)), points(&las(format, 300, false)), "format {format}");
    }
    // What may follow the points of version 1.3 and later.
    let mut content = laz_oldest(1, 300);
    content.pop();
    assert!(load("c.laz", &content).is_err());
    content.extend([0, 0]);
    assert!(load("c.laz", &content).is_err());
}

/// The decoder called itself for each switch between sequences of times, until the stack was full: no catching that.
#[test]
fn times_that_switch_without_end_are_damage() {
    let model = laz::models::ArithmeticModelBuilder::new(6).with_compression(true).build();
    let content = laz_pointwise(1, 2, Some(EndlessSwitches(model)));
    let error = load("c.laz", &content).unwrap_err();
    assert!(error.to_string().starts_with("c.laz@327: expected a chunk of 2 points, found two switches"), "{error}");
}

/// Fields that nobody asks for are read over, whatever they hold.
#[test]
fn every_field_gets_its_own_values_whatever_is_read_over() {
    for format in [1, 3, 6, 7, 8] {
        let plain = points(&las(format, 3000, false));
        let packed = points(&las(format, 3000, true));
        assert_eq!(plain, packed, "format {format}");
    }
}

/// 5 001 234.5 and 5 001 234.567 are the same f32; relative to the middle they are 67 mm apart.
#[test]
fn cv12_offsets_give_the_integers_back() {
    let p = points(&las(3, 40, true));
    let lattice = p.lattice.as_ref().unwrap();
    for i in 0..p.len() {
        let world = p.origin + p.position[i].as_dvec3();
        let steps = ((world - lattice.offset) / lattice.scale).round().as_ivec3().to_array();
        assert_eq!(steps, las_steps(i as i32), "point {i}");
        assert!(world.distance(p.exact_position(i)) < 1e-6);
    }
}

#[test]
fn eight_bit_colours_in_sixteen_bit_fields_are_told_by_their_range() {
    let p = points(&las(2, 40, false));
    assert_eq!((p.color[0][0], p.color[0][2]), (0.0, 1.0));
    assert!((p.color[0][1] - 0.215_860_5).abs() < 1e-6);
    let mut content = las(2, 40, false);
    // The red of the last point becomes 16-bit: 128 of 65,535 is nearly black then.
    let last = content.len() - 6;
    content[last..last + 2].copy_from_slice(&60_000u16.to_le_bytes());
    assert!(points(&content).color[0][1] < 2e-4);
}

#[test]
fn many_chunks_and_gzip_around_las() {
    let n = 120_000;
    let p = points(&las(3, n, true));
    assert_eq!(p.lattice.as_ref().unwrap().steps, (0..n).map(las_steps).collect::<Vec<_>>());
    assert_eq!(points(&gzip(&las(1, 9, false))).len(), 9);
}

#[test]
fn ba20_no_points() {
    assert!(points(&las(3, 0, false)).is_empty());
    assert!(points(&las(3, 0, true)).is_empty());
}
