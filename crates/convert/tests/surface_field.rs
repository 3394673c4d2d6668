//! Fields that surfaces show.

use convert::{
    Classified, ConvertError, Density, MeshParams, PointsShown, SplatParams, SurfaceField, SurfelParams,
    mesh_to_points, raw_to_surfels, shown_points, surface_to_points,
};
use field::ExpressionField;
use splat_core::glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::{
    Cloud, DAabb, Grid, Interpolation, Mesh, RawPoints, ReadySplats, Similarity, Splat, SplatKind, TransferFunction,
    TransferPoint,
};
use std::sync::Arc;

/// A lattice of n³ points over a cube about 0 with half a side `reach`, sheared, with the values of a function.
fn grid(n: usize, reach: f64, value: impl Fn(DVec3) -> f64) -> Arc<Grid> {
    let step = 2.0 * reach / (n - 1) as f64;
    let axes = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z) * step;
    let origin = -(axes * DVec3::splat(0.5 * (n - 1) as f64));
    let at = |i: usize| origin + axes * DVec3::from_array([i % n, i / n % n, i / n / n].map(|k| k as f64));
    Grid { origin, axes, dims: [n; 3], values: (0..n * n * n).map(|i| value(at(i)) as f32).collect() }.into()
}

/// From red at 0 to blue at 1, `share` of opacity at both ends.
fn transfer(shares: [f32; 2]) -> TransferFunction {
    let point = |value, extinction| TransferPoint { value, color: [1.0 - value, 0.25, value], extinction };
    TransferFunction::new(vec![point(0.0, shares[0]), point(1.0, shares[1])]).unwrap()
}

fn places(cloud: &Cloud, transform: &Similarity) -> Vec<DVec3> {
    let back = |p: &Vec3| {
        transform.rotation.inverse() * (cloud.origin + p.as_dvec3() - transform.translation) / transform.scale
    };
    cloud.position.iter().map(back).collect()
}

#[test]
fn every_splat_of_a_sphere_has_the_value_of_a_linear_field_where_it_lies() {
    let linear = |p: DVec3| 0.5 + 0.3 * p.x - 0.1 * p.y + 0.05 * p.z;
    let ball = ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap();
    let transform = Similarity {
        scale: 3.0,
        rotation: DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-1.1),
        translation: DVec3::new(1e4, -20.0, 7.0),
    };
    let splat = SplatParams { transform, ..SplatParams::default() };
    let params = MeshParams { splat, density: Density::Spacing(0.3), opacity: 0.5 };
    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
    let (bare, _) = surface_to_points(&ball, bounds, &params, None).unwrap();
    for interpolation in [Interpolation::Trilinear, Interpolation::CatmullRom] {
        let field = SurfaceField::new(grid(7, 1.5, linear), interpolation, transfer([0.0; 2]), Classified::No).unwrap();
        let mut cloud = bare.clone();
        assert_eq!(field.show(&mut cloud, &params.splat, true).unwrap(), None);
        assert!(cloud.len() > 1000);
        for (i, place) in places(&cloud, &transform).into_iter().enumerate() {
            let value = linear(place) as f32;
            assert!((cloud.value[i] - value).abs() < 1e-6, "{place}: {} {value}", cloud.value[i]);
            let expected = Vec3::new(1.0 - value, 0.25, value);
            assert!(Vec3::from(cloud.color[i]).distance(expected) < 2e-6, "{place}");
        }
        let same = Cloud { color: bare.color.clone(), value: Vec::new(), ..cloud };
        assert_eq!(same, bare, "colours and values alone change");
    }
}

#[test]
fn opacity_is_the_surfaces_times_the_fields_share() {
    let square = Mesh::rectangle(DVec3::new(0.5, 0.0, 0.0), DVec3::X * 0.5, DVec3::Y * 0.5);
    for opacity in [1.0, 0.6] {
        let params = MeshParams { density: Density::Spacing(0.04), opacity, ..MeshParams::default() };
        let (bare, _) = mesh_to_points(&square, &params, None).unwrap();
        // Above 1 the ends of the transfer function hold.
        let field = |p: DVec3| 1.25 * p.x;
        let field =
            SurfaceField::new(grid(5, 1.0, field), Interpolation::Trilinear, transfer([0.0, 1.0]), Classified::Opacity)
                .unwrap();
        assert_eq!(field.least_share(), 0.0);
        let mut cloud = bare.clone();
        field.show(&mut cloud, &params.splat, false).unwrap();
        let area =
            |i: usize| f64::from(bare.cross_section[i]) / if opacity < 1.0 { -f64::ln(1.0 - opacity) } else { 1.0 };
        let mut opaque = 0;
        for (i, place) in places(&cloud, &params.splat.transform).into_iter().enumerate() {
            let share = (1.25 * place.x).min(1.0);
            if opacity * share >= 1.0 {
                opaque += 1;
                assert_eq!(cloud.get(i), Splat { color: [0.0, 0.25, 1.0], ..bare.get(i) });
                continue;
            }
            let depth = -(-opacity * share).ln_1p();
            assert_eq!(cloud.kind[i], SplatKind::Surface);
            let [found, k] = [cloud.crossing_depth[i], cloud.cross_section[i]].map(f64::from);
            assert!((found / depth - 1.0).abs() < 1e-4, "{place}: {found} {depth}");
            assert!((k / (depth * area(i)) - 1.0).abs() < 1e-4, "{place}: {k}");
        }
        assert_eq!(opaque > 0, opacity == 1.0);
        cloud.validate().unwrap();
    }
}

#[test]
fn points_keep_their_own_opacities_times_the_fields() {
    let position: Vec<Vec3> = (0..400).map(|i| Vec3::new((i % 20) as f32, (i / 20) as f32, 0.0) / 20.0).collect();
    let opacity: Vec<f32> = (0..400).map(|i| [0.0, 0.5, 1.0][i % 3]).collect();
    let points = RawPoints { position, opacity, ..RawPoints::default() };
    let params = SurfelParams::default();
    let (bare, _) = raw_to_surfels(&points, &params, None).unwrap();
    let field =
        SurfaceField::new(grid(3, 1.0, |_| 0.25), Interpolation::Trilinear, transfer([0.0, 1.0]), Classified::Opacity)
            .unwrap();
    let mut cloud = bare.clone();
    assert_eq!(field.show(&mut cloud, &params.splat, false).unwrap(), None);
    for i in 0..cloud.len() {
        let of_point = match bare.kind[i] {
            SplatKind::Opaque => 1.0,
            _ => 1.0 - (-f64::from(bare.crossing_depth[i])).exp(),
        };
        let found = 1.0 - (-f64::from(cloud.crossing_depth[i])).exp();
        assert!((found - 0.25 * of_point).abs() < 1e-6, "{i}: {found} {of_point}");
        // A constant field has one colour.
        assert_eq!(cloud.color[i], [0.75, 0.25, 0.25]);
    }
}

#[test]
fn what_a_field_does_not_reach_is_told_and_stays() {
    let square = Mesh::rectangle(DVec3::new(1.5, 0.0, 0.0), DVec3::X * 1.5, DVec3::Y * 0.3);
    let params = MeshParams { density: Density::Spacing(0.05), opacity: 0.5, ..MeshParams::default() };
    let (bare, _) = mesh_to_points(&square, &params, None).unwrap();
    let field = |reach, classified| {
        SurfaceField::new(grid(3, reach, |_| 1.0), Interpolation::Trilinear, transfer([0.0, 0.5]), classified).unwrap()
    };
    // Three points 1 apart reach half a step farther, up to x = 1.5: half of the square.
    let mut cloud = bare.clone();
    let said = field(1.0, Classified::Opacity).show(&mut cloud, &params.splat, true).unwrap().unwrap();
    assert!(said.starts_with("50.") || said.starts_with("49."), "{said}");
    assert!(said.ends_with(" % of its surface lies where the field is not known, and looks as without it"), "{said}");
    assert!(cloud.value.is_empty(), "no value where some have none");
    // A surface that lets all light through has its colours, and goes on doing so.
    let clear = SplatParams { keep_clear: true, ..params.splat.clone() };
    let (mut glass, _) =
        mesh_to_points(&square, &MeshParams { splat: clear, opacity: 0.0, ..params.clone() }, None).unwrap();
    let said = field(1.0, Classified::Opacity).show(&mut glass, &params.splat, false).unwrap().unwrap();
    assert!(said.starts_with("50.") || said.starts_with("49."), "{said}");
    assert!(glass.cross_section.iter().all(|k| *k == 0.0) && glass.color.contains(&[0.0, 0.25, 1.0]));
    let far =
        (0..bare.len()).filter(|i| bare.position[*i].x > 0.06).inspect(|i| assert_eq!(cloud.get(*i), bare.get(*i)));
    assert!(far.count() > 100);
    let aside =
        SplatParams { transform: Similarity { translation: DVec3::X * -9.0, ..Similarity::default() }, ..params.splat };
    let error = field(1.0, Classified::No).show(&mut bare.clone(), &aside, false).unwrap_err();
    let ConvertError::Parameter { parameter: "field", found, .. } = &error else { panic!("{error}") };
    assert!(
        found.starts_with("known from [-1.1, -1, -1] to [1.1, 1, 1] alone, and the surface lies from [9.0"),
        "{found}"
    );
    // A surface without splats asks nothing.
    assert_eq!(field(1.0, Classified::No).show(&mut Cloud::default(), &aside, false).unwrap(), None);
}

#[test]
fn a_volume_with_a_value_that_is_no_number_is_no_field() {
    let mut bad = Grid::clone(&grid(3, 1.0, |_| 1.0));
    bad.values[4] = f32::NAN;
    let error =
        SurfaceField::new(bad.into(), Interpolation::Trilinear, transfer([0.0; 2]), Classified::No).unwrap_err();
    assert!(error.to_string().contains("voxel 4: value is NaN"), "{error}");
}

#[test]
fn splats_of_a_file_are_no_surface_for_a_field() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat::default());
    let ready = ReadySplats { cloud, cutoffs: vec![3.0] };
    let points = Arc::new(RawPoints { position: vec![Vec3::ZERO], ready, ..RawPoints::default() });
    let shown = PointsShown { has_field: true, ..PointsShown::default() };
    let error = shown_points(points, &shown, &SplatParams::default()).unwrap_err();
    assert!(error.to_string().contains("splats of a file, are no samples of a surface"), "{error}");
}
