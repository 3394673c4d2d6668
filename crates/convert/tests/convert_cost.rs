//! Predicted splats and bytes against the counters of the conversions, and conversions that are interrupted.
#![cfg(feature = "noise")]

use convert::cost::{self, Prediction};
use convert::*;
use field::ExpressionField;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{
    Clip, Cloud, DAabb, Grid, Limits, Mesh, Progress, RawPoints, Similarity, TransferFunction, TransferPoint, Units,
    rng,
};

fn mesh() -> Mesh {
    let unit = |i: u64, a: u64| rng::unit_f32(8, 0, i, a);
    let position = (0..300).map(|i| Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2))).collect();
    Mesh { position, triangles: (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), ..Mesh::default() }
}

fn points(n: u64) -> RawPoints {
    let position = (0..n).map(|i| Vec3::new(rng::unit_f32(9, 0, i, 0), 0.0, rng::unit_f32(9, 0, i, 1))).collect();
    RawPoints { position, value: vec![1.0; n as usize], ..RawPoints::default() }
}

fn wave(dims: [usize; 3], axes: DVec3) -> Grid {
    let n = dims[0] * dims[1] * dims[2];
    let values = (0..n).map(|i| ((i % dims[0]) as f32 * 0.4).sin() + ((i / dims[0]) as f32 * 0.07).cos()).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::from_diagonal(axes), dims, values }
}

fn transfer() -> TransferFunction {
    let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
    TransferFunction::new(vec![point(0.3, 0.0), point(2.0, 1.0)]).unwrap()
}

fn exact(prediction: Prediction, cloud: &Cloud) {
    assert_eq!(prediction.splats, cloud.len() as u64);
    assert_eq!(prediction.at_most, Some(prediction.splats));
    assert_eq!(prediction.bytes, cloud.bytes());
}

fn close(prediction: Prediction, cloud: &Cloud, tolerance: f64) {
    let n = cloud.len() as f64;
    assert!((prediction.splats as f64 / n - 1.0).abs() < tolerance, "{prediction:?} {n}");
    assert!(prediction.at_most.is_none_or(|most| most >= cloud.len() as u64), "{prediction:?} {n}");
    assert!((prediction.bytes as f64 / cloud.bytes() as f64 - 1.0).abs() < tolerance);
}

#[test]
fn meshes_points_and_unsplit_volumes_are_counted_exactly() {
    let transform = Similarity { scale: 3.0, ..Similarity::default() };
    for density in [Density::Spacing(0.05), Density::Spacing(9.0), Density::Splats(5000), Density::Auto] {
        for opacity in [0.0, 0.5, 1.0] {
            let splat = SplatParams { transform, ..SplatParams::default() };
            let params = MeshParams { splat, density, opacity };
            exact(cost::mesh(&mesh(), &params).unwrap(), &mesh_to_points(&mesh(), &params, None).unwrap().0);
        }
    }
    for values in [false, true] {
        let params = SurfelParams { values, ..SurfelParams::default() };
        exact(
            cost::raw_points(&points(500), &params).unwrap(),
            &raw_to_surfels(&points(500), &params, None).unwrap().0,
        );
        let params = VolumeParams {
            normals: values,
            values,
            omitted_optical_depth: if values { 0.5 } else { 0.0 },
            clip: values.then_some(Clip::Box(DAabb::new(DVec3::splat(2.0), DVec3::splat(7.5)))).into_iter().collect(),
            ..VolumeParams::default()
        };
        let grid = wave([12, 13, 14], DVec3::ONE);
        let cloud = volume_to_points(&grid, &transfer(), &params, None).unwrap().0;
        exact(cost::volume(&grid, &transfer(), &params).unwrap(), &cloud);
        assert!(!cloud.is_empty());
    }
}

#[test]
fn split_volumes_fields_and_clouds_are_predicted_closely() {
    let grid = wave([20, 20, 20], DVec3::new(1.0, 1.0, 3.0));
    let params = VolumeParams { refine: 2, ..VolumeParams::default() };
    let cloud = volume_to_points(&grid, &transfer(), &params, None).unwrap().0;
    close(cost::volume(&grid, &transfer(), &params).unwrap(), &cloud, 0.05);

    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.3));
    for text in ["x^2 + y^2 + z^2 - 1", "y - 0.1*sin(7*x)*cos(5*z)", "(sqrt(x^2+z^2) - 0.8)^2 + y^2 - 0.06"] {
        let field = ExpressionField::parse(text).unwrap();
        for density in [Density::Spacing(0.03), Density::Splats(20_000), Density::Auto] {
            let params = MeshParams { density, ..MeshParams::default() };
            let cloud = surface_to_points(&field, bounds, &params, None).unwrap().0;
            close(cost::surface(&field, bounds, &params).unwrap(), &cloud, 0.3);
        }
        let params = DensityParams { density: Density::Spacing(0.04), ..DensityParams::default() };
        let cloud = density_to_points(&field, bounds, &params, None).unwrap().0;
        close(cost::density(&field, bounds, &params).unwrap(), &cloud, 0.03);
    }
    // Most of the box has an extinction that f32 does not hold, or that no line shows.
    let faint = ExpressionField::parse("exp(-(x^2 + y^2 + z^2)/0.02)").unwrap();
    for omitted_optical_depth in [0.0, 1e-4] {
        let volume = VolumeParams { omitted_optical_depth, ..VolumeParams::default() };
        let params = DensityParams { density: Density::Spacing(0.02), volume, ..DensityParams::default() };
        let cloud = density_to_points(&faint, bounds, &params, None).unwrap().0;
        close(cost::density(&faint, bounds, &params).unwrap(), &cloud, 0.1);
    }
    let shape = CloudShape::default();
    let params = VolumeParams::default();
    let lattice = procedural_cloud(&shape, 0.06, &params.splat, None).unwrap();
    let point = |value: f32| TransferPoint { value, color: [1.0; 3], extinction: value };
    let tf = TransferFunction::new(vec![point(0.0), point(12.0)]).unwrap();
    let cloud = volume_to_points(&lattice, &tf, &params, None).unwrap().0;
    close(cost::procedural(&shape, 0.06, &params).unwrap(), &cloud, 0.05);
}

#[test]
fn closed_shapes_are_counted() {
    let p = SplatParams::default();
    let low = DVec3::ZERO;
    let high = DVec3::new(2.0, 1.0, 0.3);
    for extinction in [5.0, 0.0] {
        let slab = HomogeneousMedium { body: MediumBody::Box(DAabb::new(low, high)), extinction, spacing: 0.07 };
        for clips in [&[][..], &[Clip::HalfSpace { normal: DVec3::ONE, offset: 1.3 }]] {
            exact(cost::medium(&slab, clips, &p).unwrap(), &medium(&slab, clips, &p).unwrap());
        }
    }
    let u = DVec3::X;
    let v = DVec3::Z * 2.0;
    for opacity in [0.75, 1.0] {
        let flat = Rectangle { center: low, u, v, spacing: 0.05 };
        exact(cost::rectangle(&flat, opacity, &p).unwrap(), &rectangle(&flat, opacity, &p).unwrap());
    }
    for spacing in [0.03, 0.1] {
        let ball =
            HomogeneousMedium { body: MediumBody::Ball { center: DVec3::ONE, radius: 0.8 }, extinction: 2.0, spacing };
        close(cost::medium(&ball, &[], &p).unwrap(), &medium(&ball, &[], &p).unwrap(), 0.06);
    }
}

#[test]
fn cv10_predictions_refuse_what_conversions_refuse() {
    let splat = SplatParams { limits: Limits::elements(1000), ..SplatParams::default() };
    let params = MeshParams { splat: splat.clone(), density: Density::Spacing(1e-6), ..MeshParams::default() };
    assert!(matches!(cost::mesh(&mesh(), &params), Err(ConvertError::Limit(_))));
    let params = SurfelParams { splat, ..SurfelParams::default() };
    assert!(matches!(cost::raw_points(&points(1001), &params), Err(ConvertError::Limit(_))));
}

/// Every conversion ticks what it announced, and stops when it is cancelled.
fn interrupted(run: &dyn Fn(&Progress) -> Result<(), ConvertError>) {
    let progress = Progress::new();
    run(&progress).unwrap();
    let Units { done, total } = progress.read();
    assert!(done == total && total > 0, "{done} of {total}");
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(run(&progress), Err(ConvertError::Cancelled));
    // Cancelled from outside while it runs: it ends either way, but never with half a cloud.
    let progress = Progress::new();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while progress.read().done == 0 {
                std::thread::yield_now();
            }
            progress.cancel();
        });
        let result = run(&progress);
        assert!(matches!(result, Ok(()) | Err(ConvertError::Cancelled)));
        progress.cancel();
    });
}

#[test]
fn long_conversions_tick_and_stop() {
    let field = ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap();
    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.3));
    let fine = MeshParams { density: Density::Spacing(0.01), ..MeshParams::default() };
    interrupted(&|p| mesh_to_points_into(&mesh(), &fine, &mut Cloud::default(), Some(p)).map(|_| ()));
    interrupted(&|p| raw_to_surfels(&points(3000), &SurfelParams::default(), Some(p)).map(|_| ()));
    let grid = wave([20; 3], DVec3::ONE);
    let params = VolumeParams { normals: true, ..VolumeParams::default() };
    interrupted(&|p| volume_to_points(&grid, &transfer(), &params, Some(p)).map(|_| ()));
    interrupted(&|p| surface_to_points(&field, bounds, &fine, Some(p)).map(|_| ()));
    let density = DensityParams { density: Density::Spacing(0.1), ..DensityParams::default() };
    interrupted(&|p| density_to_points(&field, bounds, &density, Some(p)).map(|_| ()));
    let shape = CloudShape::default();
    let splat = SplatParams::default();
    interrupted(&|p| procedural_cloud(&shape, 0.2, &splat, Some(p)).map(|_| ()));
}
