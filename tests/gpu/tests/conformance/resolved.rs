//! Opaque splats resolved on a device: the CPU's image, within a stated tolerance.

use super::splat::{SIZE, VIEWS, discs, unit};
use gpu_conformance::{Device, open};
use splat_core::glam::DVec3;
use splat_core::raster::OpaqueInput;
use splat_core::raster::gpu::Counts;
use splat_core::raster::gpu::resolve::record;
use splat_core::raster::{Detail, OpaqueImage, Params, ProjectInput, Projected, project_into, resolve_opaque};
use splat_core::{Camera, Cloud, Error, FootprintStack, Material, Projection, SplatKind, rng};
use splat_shaders::Overflow;

/// Most that a depth may differ by, as a share of the scene's extent, and a channel as a share of the largest value.
const TOLERANCE: f32 = 1e-5;
/// Share of the pixels on which a fragment may lie within rounding of the edge of a disc, or of epsilon-z behind the nearest:
/// those are another blend. Measured on lavapipe: 1.5·10⁻⁴, on discs seen edge-on.
const OTHER_SHARE: f64 = 1e-3;

/// Discs, some of them translucent.
fn cloud() -> Cloud {
    let mut cloud = discs(3000);
    for i in 0..cloud.len() {
        cloud.kind[i] = if i % 10 == 3 { SplatKind::Surface } else { SplatKind::Opaque };
        cloud.object[i] = (5.0 * unit(i as u64, 91)) as u32;
    }
    cloud
}

fn opaque_ids(cloud: &Cloud) -> Vec<u32> {
    (0..cloud.len() as u32).filter(|i| cloud.kind[*i as usize] == SplatKind::Opaque).collect()
}

fn projected(cloud: &Cloud, view: Projection, size: [u32; 2]) -> Projected {
    let eye = cloud.origin + DVec3::new(0.3, 0.2, 4.0);
    let camera = Camera::look_at(eye, cloud.origin, DVec3::Y, view, size).unwrap();
    let mut projected = Projected::default();
    let footprints = FootprintStack::default();
    let materials = [Material::default()];
    project_into(
        &mut projected,
        &ProjectInput {
            cloud,
            camera: &camera,
            footprints: &footprints,
            materials: &materials,
            params: &Params::default(),
            detail: Detail::ALL,
        },
    );
    projected
}

fn values(splats: usize, channels: u32) -> Vec<f32> {
    (0..splats as u64 * u64::from(channels)).map(|i| 3.0 * rng::unit_f32(77, 0, i, 0)).collect()
}

fn on_device(device: &mut Device, input: &OpaqueInput<'_>, room: u32) -> Result<(OpaqueImage, Counts), Error> {
    let recorded = record(input.capacities(room))?;
    let uploads = recorded.uploads(input)?;
    let run = device.run(&recorded.recording, &recorded.inputs(&uploads)).unwrap();
    recorded.finish([recorded.state, recorded.image].map(|b| run.bytes(b)))
}

fn on_processor(input: &OpaqueInput<'_>) -> OpaqueImage {
    resolve_opaque(input, None).unwrap().0
}

/// Share of the pixels that differ by more than the tolerance, or are another object's.
fn others(a: &OpaqueImage, b: &OpaqueImage) -> f64 {
    let n = a.depth.len();
    assert_eq!([b.depth.len(), b.channels.len(), b.object.len()], [n, a.channels.len(), a.object.len()]);
    // What is no number is another.
    let near = |a: f32, b: f32, scale: f32| a == b || (a - b).abs() <= TOLERANCE * scale;
    let same = |k: &usize| {
        near(a.depth[*k], b.depth[*k], 3.0)
            && a.object.get(*k) == b.object.get(*k)
            && a.channels.iter().zip(&b.channels).all(|(a, b)| near(a[*k], b[*k], 3.0))
    };
    (0..n).filter(|k| !same(k)).count() as f64 / n as f64
}

#[test]
fn opaque_surfaces_are_the_cpu_s() {
    let mut device = open().unwrap();
    let cloud = cloud();
    let ids = opaque_ids(&cloud);
    for view in VIEWS {
        let projected = projected(&cloud, view, SIZE);
        for (channels, objects) in [(3, false), (3, true), (1, true), (7, false), (16, true)] {
            let values = values(cloud.len(), channels);
            let input = OpaqueInput { projected: &projected, ids: &ids, values: &values, channels, objects };
            let (found, counts) = on_device(&mut device, &input, 1 << 18).unwrap();
            let expected = on_processor(&input);
            let differ = others(&expected, &found);
            assert!(differ <= OTHER_SHARE, "{view:?} {channels} {objects}: {differ}");
            let solid = found.depth.iter().filter(|z| **z < f32::INFINITY).count();
            assert!(solid > 5000 && solid < found.depth.len(), "{solid}");
            assert!(counts.splats > 2000 && counts.splats <= ids.len() as u64, "{counts:?}");
            // The translucent ones are none of them: with those, or in another order of depths, it is another image.
            let ids_of_all: Vec<u32> = (0..cloud.len() as u32).collect();
            let with_others = on_processor(&OpaqueInput { ids: &ids_of_all, ..input });
            assert!(others(&with_others, &found) > 10.0 * OTHER_SHARE);
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn any_size_no_splat_and_too_little_room_are_the_cpu_s() {
    let mut device = open().unwrap();
    let cloud = cloud();
    let ids = opaque_ids(&cloud);
    let values = values(cloud.len(), 3);
    for size in [[1, 1], [17, 33], [257 * 16, 9]] {
        let projected = projected(&cloud, VIEWS[1], size);
        let input = OpaqueInput { projected: &projected, ids: &ids, values: &values, channels: 3, objects: true };
        let (found, _) = on_device(&mut device, &input, 1 << 20).unwrap();
        assert!(others(&on_processor(&input), &found) <= OTHER_SHARE, "{size:?}");
        let (none, counts) = on_device(&mut device, &OpaqueInput { ids: &[], ..input }, 0).unwrap();
        assert!(none.depth.iter().all(|z| *z == f32::INFINITY) && none.object.iter().all(|o| *o == u32::MAX));
        assert!(none.channels.iter().flatten().all(|v| *v == 0.0) && counts == Counts::default());
    }
    let projected = projected(&cloud, VIEWS[0], SIZE);
    let input = OpaqueInput { projected: &projected, ids: &ids, values: &values, channels: 3, objects: false };
    let expected = on_device(&mut device, &input, 1 << 18).unwrap();
    let Err(Error::Overflow(Overflow { needed, had: 100, .. })) = on_device(&mut device, &input, 100) else {
        panic!("room for 100 entries is enough")
    };
    assert_eq!(needed, expected.1.entries);
    assert_eq!(on_device(&mut device, &input, needed as u32).unwrap(), expected);
    assert_eq!(device.take_messages(), [""; 0]);
}
