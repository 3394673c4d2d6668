//! One object from each source, as clouds of splats: a triangle, an implicit ball, a procedural cloud and raw points.
//!
//! `cargo run -p organza-convert --example sources`

use convert::{
    CloudShape, Density, MeshParams, SplatParams, SurfelParams, VolumeParams, mesh_to_points, procedural_cloud,
    raw_to_surfels, surface_to_points, volume_to_points,
};
use field::ExpressionField;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{DAabb, Mesh, RawPoints, TransferFunction, TransferPoint};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let glass = MeshParams { opacity: 0.3, density: Density::Spacing(0.02), ..MeshParams::default() };
    println!("triangle: {:?}", mesh_to_points(&mesh, &glass, None)?.1);

    let ball = ExpressionField::parse("x^2 + y^2 + z^2 - 1")?;
    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
    println!("ball: {:?}", surface_to_points(&ball, bounds, &MeshParams::default(), None)?.1);

    let cloud = procedural_cloud(&CloudShape::default(), 0.06, &SplatParams::default(), None)?;
    let point = |value: f32| TransferPoint { value, color: [1.0; 3], extinction: value };
    let tf = TransferFunction::new(vec![point(0.0), point(12.0)])?;
    println!("cloud: {:?}", volume_to_points(&cloud, &tf, &VolumeParams::default(), None)?.1);

    let position = (0..400).map(|i| Vec3::new((i % 20) as f32, 0.0, (i / 20) as f32)).collect();
    let points = RawPoints { position, ..RawPoints::default() };
    println!("points: {:?}", raw_to_surfels(&points, &SurfelParams::default(), None)?.1);
    Ok(())
}
