//! Footprints point by point: by a column, or by chance; how images lie, and what has none.

use crate::point_attributes::surfels;
use convert::{
    FootprintChoice, MatterParams, PointsShown, Rectangle, SplatParams, SurfelParams, cost, raw_to_matter,
    raw_to_surfels, rectangle, shown_points,
};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Column, FootprintImage, FootprintStack, RawPoints, Similarity};
use std::sync::Arc;

/// Formulas of 3, 2 and 5 deviations, an image in the place of the last.
fn stack() -> FootprintStack {
    FootprintStack::default().with_image(2, Arc::new(FootprintImage::new([1, 2], &[0.25, 1.0]).unwrap()))
}

fn splat(ids: &[u8], by_column: bool) -> SplatParams {
    let choice = FootprintChoice { stack: stack(), ids: ids.to_vec(), by_column, seed: 7, turn: 0.0 };
    let profile = stack().layers()[usize::from(ids[0])];
    SplatParams { footprint: ids[0], profile, footprints: Some(Arc::new(choice)), ..SplatParams::default() }
}

fn params(ids: &[u8], by_column: bool) -> SurfelParams {
    SurfelParams { splat: splat(ids, by_column), ..SurfelParams::default() }
}

/// A wall of 12 x 12 points that faces +Z, in some order.
fn wall(order: impl Fn(usize) -> usize) -> RawPoints {
    let at = |i: usize| Vec3::new((i % 12) as f32, (i / 12) as f32, 0.0);
    let position: Vec<Vec3> = (0..144).map(|i| at(order(i))).collect();
    RawPoints { normal: vec![Vec3::Z; 144], position, ..RawPoints::default() }
}

fn with_column(points: RawPoints, number: impl Fn(Vec3) -> f64) -> RawPoints {
    let values = points.position.iter().map(|p| number(*p)).collect();
    RawPoints { columns: vec![Column { name: "footprint".into(), values }], ..points }
}

#[test]
fn a_column_gives_each_point_its_footprint_and_images_stand_upright() {
    let points = with_column(wall(|i| i), |p| f64::from(p.x as u32 % 3));
    let cloud = surfels(&points, &params(&[0], true));
    let plain = surfels(&wall(|i| i), &params(&[0], true));
    for i in 0..cloud.len() {
        let id = cloud.position[i].x as u8 % 3;
        assert_eq!(cloud.footprint[i], id);
        // The standard deviation stays.
        let wider = stack().layers()[usize::from(id)].cutoff / 3.0;
        assert!((cloud.radius[i] / plain.radius[i] / wider - 1.0).abs() < 1e-6);
        let upright = if id == 2 { Vec3::X * cloud.radius[i] } else { Vec3::ZERO };
        assert!((cloud.tangent[i] - upright).length() <= 1e-6 * cloud.radius[i], "{id}: {}", cloud.tangent[i]);
    }
    // What the object states counts before the column, which is then said to be unused.
    let stated = surfels(&points, &params(&[1], false));
    assert!(stated.footprint.iter().all(|id| *id == 1) && stated.tangent.is_empty());
    let shown = shown_points(points.clone().into(), &PointsShown::default(), &splat(&[1], false)).unwrap();
    assert_eq!(shown.said, ["`footprint` of the file is not used: the object has one"]);
}

#[test]
fn chance_depends_on_the_seed_and_on_places_in_the_file_alone() {
    let ids = |points: &RawPoints, params: &SurfelParams| {
        let cloud = surfels(points, params);
        let mut chosen: Vec<_> =
            (0..cloud.len()).map(|i| (cloud.footprint[i], cloud.tangent[i].length() > 0.0)).collect();
        let key = |i: &usize| cloud.position[*i].to_array().map(|v| (v * 16.0).round() as i64);
        let mut order: Vec<usize> = (0..cloud.len()).collect();
        order.sort_by_key(key);
        chosen = order.iter().map(|i| chosen[*i]).collect();
        chosen
    };
    let first = ids(&wall(|i| i), &params(&[0, 1, 2], false));
    let share = |id: u8| first.iter().filter(|(found, _)| *found == id).count();
    assert!([0, 1, 2].iter().all(|id| (30..66).contains(&share(*id))), "{:?}", [share(0), share(1), share(2)]);
    assert!(first.iter().all(|(id, lies)| *lies == (*id == 2)));
    assert_eq!(first, ids(&wall(|i| 143 - i), &params(&[0, 1, 2], false)), "another order of the file");
    let translation = DVec3::new(1e3, 5.0, -20.0);
    let moved = Similarity { translation, ..Similarity::default() };
    let mut other = params(&[0, 1, 2], false);
    other.splat.transform = moved;
    assert_eq!(first, ids(&wall(|i| i), &other), "another place");
    let choice = other.splat.footprints.take().unwrap();
    other.splat.footprints = Some(Arc::new(FootprintChoice { seed: 8, ..(*choice).clone() }));
    assert_ne!(first, ids(&wall(|i| i), &other), "another seed");
}

#[test]
fn turns_stay_within_their_angle_and_reach_it() {
    let mut turned = params(&[2], false);
    let choice = turned.splat.footprints.take().unwrap();
    let most = 0.5;
    turned.splat.footprints = Some(Arc::new(FootprintChoice { turn: most, ..(*choice).clone() }));
    let cloud = surfels(&wall(|i| i), &turned);
    let angles: Vec<f32> = cloud.tangent.iter().map(|t| libm::atan2f(t.y, t.x)).collect();
    let (low, high) = angles.iter().fold((0.0f32, 0.0f32), |(l, h), a| (l.min(*a), h.max(*a)));
    assert!((-0.5..-0.45).contains(&low) && (0.45..=0.5).contains(&high), "{low} {high}");
}

#[test]
fn what_has_no_place_for_an_image_is_refused() {
    let beyond = with_column(wall(|i| i), |p| f64::from(p.x as u32));
    let error = raw_to_surfels(&beyond, &params(&[0], true), None).unwrap_err().to_string();
    assert!(error.contains("footprint is 3 in the column `footprint`, expected an index of the scene's"), "{error}");
    for bad in [-1.0, 0.5, f64::NAN, 256.0] {
        let points = with_column(wall(|i| i), |p| if p.x > 10.0 { bad } else { 0.0 });
        let error = raw_to_surfels(&points, &params(&[0], true), None).unwrap_err().to_string();
        assert!(error.contains("expected a whole number from 0 to 255"), "{bad}: {error}");
    }
    let matter = MatterParams { splat: splat(&[2], false), extinction: 1.0, ..MatterParams::default() };
    let error = raw_to_matter(&wall(|i| i), &matter, None).unwrap_err().to_string();
    assert!(error.contains("an image, expected a formula for a medium"), "{error}");
}

#[test]
fn discs_of_surfaces_without_points_lie_as_the_predicted_bytes_say() {
    let flat = Rectangle { center: DVec3::ZERO, u: DVec3::X, v: DVec3::Y, spacing: 0.25 };
    let some = splat(&[2, 0], false);
    let none = splat(&[0], false);
    let cloud = rectangle(&flat, 1.0, &some).unwrap();
    let predicted = cost::rectangle(&flat, 1.0, &some).unwrap();
    assert_eq!((predicted.splats, predicted.bytes), (cloud.len() as u64, cloud.bytes()));
    let images = (0..cloud.len()).filter(|i| cloud.footprint[*i] == 2);
    assert!(images.clone().count() > 8);
    images.for_each(|i| assert!((cloud.tangent[i] / cloud.radius[i] - Vec3::X).length() < 1e-6));
    assert!(rectangle(&flat, 1.0, &none).unwrap().footprint.iter().all(|id| *id == 0));
}
