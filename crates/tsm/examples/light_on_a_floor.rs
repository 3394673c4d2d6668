//! A translucent ball above a floor of opaque discs, lit by a lamp above: prints the light along the floor.

use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Light, LightShape, Receiver, Splat, SplatKind, Transmittance};
use tsm::{Params, Scene, ShadowMap};

fn main() -> Result<(), tsm::Error> {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let h = 0.05f32;
    let radius = Footprint::default().radius_for_spacing(h);
    for i in 0..20i32.pow(3) {
        let p = Vec3::new((i % 20) as f32 - 9.5, (i / 20 % 20) as f32 - 9.5, (i / 400) as f32 - 9.5) * h;
        if p.length() < 0.45 {
            // Extinction 4 per metre: K = σ_t·h³.
            cloud.push(&Splat { position: p + Vec3::Y, radius, cross_section: 4.0 * h * h * h, ..Splat::default() });
        }
    }
    for i in 0..80i32.pow(2) {
        let position = Vec3::new((i % 80) as f32 - 39.5, 0.0, (i / 80) as f32 - 39.5) * h;
        let kind = SplatKind::Opaque;
        cloud.push(&Splat { position, radius, cross_section: h * h, kind, normal: Vec3::Y, ..Splat::default() });
    }
    let light = Light { shape: LightShape::Point { position: DVec3::new(0.0, 4.0, 0.0) }, intensity: [20.0; 3] };
    let map = ShadowMap::build(&Scene::from(&cloud), &light, &Params::default(), None)?;
    println!("{:?}", map.counts());
    for k in 0..20 {
        let position = Vec3::new(k as f32 * h, 0.0, 0.0);
        let floor = Receiver { position, normal: Vec3::Y, radius, kind: SplatKind::Opaque };
        println!("{:.2} m: {:.4}", position.x, map.transmittance(&floor)[0]);
    }
    Ok(())
}
