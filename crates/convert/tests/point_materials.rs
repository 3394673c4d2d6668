//! Materials point by point, by a column; and the values that splats keep.

use crate::point_attributes::surfels;
use convert::{
    ColorBy, ColorMap, MatterParams, PointColors, PointMaterial, PointsShown, SplatParams, SurfelParams, cost,
    raw_to_matter, raw_to_surfels, shown_points, thinned,
};
use splat_core::glam::Vec3;
use splat_core::{Column, RawPoints, SplatKind};
use std::sync::Arc;

const CLAY: PointMaterial = PointMaterial { id: 4, color: [0.7, 0.3, 0.1], opacity: 1.0 };
const GLASS: PointMaterial = PointMaterial { id: 2, color: [0.1, 0.3, 0.9], opacity: 0.25 };

/// A wall of 12 x 12 points with a number each in one column.
fn wall(name: &str, number: impl Fn(Vec3) -> f64) -> RawPoints {
    let position: Vec<Vec3> = (0..144).map(|i| Vec3::new((i % 12) as f32, (i / 12) as f32, 0.0)).collect();
    let values = position.iter().map(|p| number(*p)).collect();
    RawPoints { columns: vec![Column { name: name.into(), values }], position, ..RawPoints::default() }
}

fn by_parity(p: Vec3) -> f64 {
    f64::from(p.x as u32 % 2)
}

fn choice() -> SplatParams {
    SplatParams { materials: Some(vec![CLAY, GLASS].into()), color: [0.5; 3], ..SplatParams::default() }
}

fn shown(points: RawPoints, shown: &PointsShown<'_>) -> Result<Arc<RawPoints>, String> {
    shown_points(points.into(), shown, &choice()).map(|shown| shown.points).map_err(|e| e.to_string())
}

#[test]
fn a_column_gives_each_point_its_material_with_colour_and_opacity() {
    let points = shown(wall("material", by_parity), &PointsShown::default()).unwrap();
    let params = SurfelParams { splat: choice(), ..SurfelParams::default() };
    let cloud = surfels(&points, &params);
    for i in 0..cloud.len() {
        let material = [CLAY, GLASS][by_parity(cloud.position[i]) as usize];
        assert_eq!((cloud.material[i], cloud.color[i]), (material.id, material.color));
        let kind = if material.opacity < 1.0 { SplatKind::Surface } else { SplatKind::Opaque };
        assert_eq!(cloud.kind[i], kind);
    }
    // Colours of the file and an opacity that the object states count before those of materials.
    let colored = RawPoints { color: vec![[0.0, 1.0, 0.0]; 144], ..wall("material", by_parity) };
    let points = shown(colored, &PointsShown { has_opacity: true, ..PointsShown::default() }).unwrap();
    assert!(points.opacity.is_empty() && points.color.iter().all(|color| *color == [0.0, 1.0, 0.0]));
    // Points that become one have the material of one of them, and no mean of numbers.
    let thin = thinned(&wall("material", |p| 3.0 * by_parity(p)), 4.0, &SplatParams::default()).unwrap();
    assert!(thin.columns[0].values.iter().all(|id| *id == 0.0 || *id == 3.0));
}

#[test]
fn what_chooses_no_material_is_refused_or_named() {
    let error = |points| shown(points, &PointsShown::default()).unwrap_err();
    let missing = error(wall("heat", by_parity));
    assert!(missing.contains("materials is a file without such a column, expected one with a column"), "{missing}");
    let beyond = error(wall("material", |p| f64::from(p.x)));
    assert!(beyond.contains("2 in the column `material` of point 2, and 2 listed"), "{beyond}");
    for bad in [-1.0, 0.5, f64::NAN, 65536.0] {
        let points = wall("material", |p| if p.x > 10.0 { bad } else { 0.0 });
        let error = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap_err().to_string();
        assert!(error.contains("expected a whole number from 0 to 65535"), "{bad}: {error}");
    }
    let said = |as_matter| {
        let shown = PointsShown { as_matter, ..PointsShown::default() };
        shown_points(wall("material", by_parity).into(), &shown, &SplatParams::default()).unwrap().said
    };
    assert_eq!(said(false), ["`material` of the file is not used: the object has one, and no list `materials`"]);
    assert_eq!(said(true), ["a medium does not use `material`: it has that of its object"]);
}

#[test]
fn splats_keep_the_numbers_that_their_colours_are_of_where_that_is_asked_for() {
    let colors = PointColors::map(ColorMap::VIRIDIS);
    let by = ColorBy { column: "heat".into(), colors };
    let heat = |p: Vec3| f64::from(p.x + 12.0 * p.y) * 0.5;
    let asked = PointsShown { color_by: Some(&by), keeps_values: true, ..PointsShown::default() };
    let splat = SplatParams::default();
    let points_shown = |points: RawPoints, shown: &PointsShown<'_>| shown_points(points.into(), shown, &splat).unwrap();
    let points = points_shown(wall("heat", heat), &asked).points;
    let cloud = surfels(&points, &SurfelParams { values: true, ..SurfelParams::default() });
    assert!((0..144).all(|i| f64::from(cloud.value[i]) == heat(cloud.position[i])));
    assert!(surfels(&points, &SurfelParams::default()).value.is_empty());
    // Of matter the mean by what each point absorbs, where several are one.
    for spacing in [None, Some(2.0)] {
        let params = MatterParams { values: true, spacing, ..MatterParams::default() };
        let (cloud, _) = raw_to_matter(&points, &params, None).unwrap();
        let predicted = cost::raw_matter(&points, &params).unwrap();
        assert_eq!((predicted.splats, predicted.bytes), (cloud.len() as u64, cloud.bytes()));
        assert_eq!(cloud.len(), if spacing.is_some() { 36 } else { 144 });
        let off = |i: usize| (f64::from(cloud.value[i]) - heat(cloud.position[i])).abs();
        assert!((0..cloud.len()).all(|i| off(i) < 1e-4 + 0.01 * f64::from(spacing.is_some() as u8)), "{spacing:?}");
    }
    // A value is a number: where one is missing none is kept, and that is said.
    for missing in [f64::NAN, 1e300] {
        let gaps = points_shown(wall("heat", |p| if p == Vec3::X { missing } else { p.x.into() }), &asked);
        assert!(gaps.points.value.is_empty());
        let said = "splats keep no values: 1 point without a number that f32 holds";
        assert_eq!(gaps.said.last().map(String::as_str), Some(said));
    }
}
