//! The recordings of four stages joined: one submission under validation gives the CPU's picture.

use gpu_conformance::open;
use hbsort::Scratch;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::{Attributes, Capacities, follow, project as projection};
use splat_core::raster::{Detail, FoldInput, OpaqueImage, Params, ProjectInput, fold, project};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, gpu as shading, shade};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, FootprintStack, Light, LightShape, Material, Object, Projection, Splat,
    SplatKind, rng,
};

/// Most that a transmittance may differ by, or a channel as a share of the largest value.
const TOLERANCE: f32 = 1e-5;

const SIZE: [u32; 2] = [150, 90];
const SPLATS: u32 = 5000;

/// Media and discs; one in ten lies outside the view.
fn cloud() -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(1e6, 0.0, -1e6));
    for i in 0..SPLATS {
        let u = |k| rng::unit_f32(19, 0, i.into(), k);
        let aside = if i % 10 == 0 { 40.0 } else { 1.0 };
        let radius = 0.02 + 0.1 * u(3) * u(4);
        let normal = Vec3::new(u(5) - 0.5, u(6) - 0.5, 0.6).normalize();
        cloud.push(&Splat {
            position: Vec3::new(3.0 * u(0) - 1.5, 2.0 * u(1) - 1.0, 2.0 * u(2) - 1.0) * aside,
            normal: if i % 2 == 0 { normal } else { Vec3::ZERO },
            radius,
            cross_section: radius * radius * u(7),
            kind: if i % 2 == 0 { SplatKind::Surface } else { SplatKind::Medium },
            ..Splat::default()
        });
    }
    cloud
}

#[test]
fn four_stages_in_one_submission_are_the_cpu_s_picture() {
    let cloud = cloud();
    let materials = [Material::default()];
    let footprints = FootprintStack::default();
    let view = Projection::Perspective { fov_y: 0.6 };
    let camera = Camera::look_at(cloud.origin + DVec3::new(0.3, 0.2, 4.0), cloud.origin, DVec3::Y, view, SIZE).unwrap();
    let objects = [Object::default()];
    let shape = LightShape::Point { position: cloud.origin + DVec3::new(1.0, 2.0, 2.0) };
    let lights = [LitBy { slide: None, light: Light { shape, intensity: [9.0; 3] }, shadow: None }];
    let ambient = [0.1; 3];
    let objects = &objects[..];
    let lights = &lights[..];
    let input = ShadeInput { cloud: &cloud, materials: &materials, objects, lights, ambient, camera: &camera };
    let layout = ChannelLayout::default();
    let params = Params::default();
    let opaque = OpaqueImage::default();
    let mut device = open().unwrap();
    for direction in [Direction::FrontToBack, Direction::BackToFront] {
        let sort_params = hbsort::Params { direction, exact: true, margin_px: 2.0, ..hbsort::Params::default() };
        let projected = &project(&ProjectInput {
            cloud: &cloud,
            camera: &camera,
            footprints: &footprints,
            materials: &materials,
            params: &params,
            detail: Detail::ALL,
        });
        let values = &shade(&input, projected, &layout, None).unwrap();
        let order = hbsort::slice_cloud(&cloud, None, &camera, &sort_params, &mut Scratch::new()).unwrap();
        assert!(order.culled > u64::from(SPLATS) / 20);
        let mut cpu = Accumulator::new(SIZE, 1, 3, false, false);
        let mut gpu = cpu.clone();
        let ids = &order.input_from_sorted;
        let opaque = &opaque;
        let params = &params;
        let materials = &materials[..];
        let folded = FoldInput { projected, order: ids, values, materials, opaque, direction, params };
        fold(&folded, &mut cpu, None).unwrap();

        let attributes = Attributes::new(&cloud, None).unwrap();
        let sort = hbsort::gpu::record(hbsort::gpu::Capacities { splats: SPLATS, kept: SPLATS });
        let room = Capacities {
            size: SIZE,
            planes: 1,
            channels: 3,
            splats: SPLATS,
            ordered: SPLATS,
            entries: 1 << 17,
            footprints: footprints.layers().len() as u32,
            materials: 1,
            opaque: false,
            depths: false,
            objects: false,
        };
        let held = attributes.room();
        let layers = room.footprints;
        let room_for = projection::Capacities { attributes: held, footprints: layers, materials: 1, depth: false };
        let project = projection::record(room_for).unwrap();
        let shade = shading::record(shading::Capacities::for_input(&input, attributes.room(), layout));
        let composite = follow::record(room).unwrap();
        let mut whole = sort.recording.clone();
        let held = &project.attributes;
        let p = whole.join(&project.recording, &[(held.positions, sort.positions), (held.radii, sort.radii)]);
        let s = whole.join(&shade.recording, &shade.attributes.shared(&held.in_joined(&p)));
        let c = whole.join(
            &composite.recording,
            &[
                (composite.splats, p.buffer(project.splats)),
                (composite.values, s.buffer(shade.values)),
                (composite.order, sort.places),
                (composite.sorted.unwrap(), sort.state),
            ],
        );
        let origin = cloud.origin;
        let view = hbsort::gpu::view_bytes(origin, SPLATS, &camera, &sort_params);
        let camera = &camera;
        let footprints = &footprints;
        let to = projection::Input { origin, camera, footprints, materials, params };
        let to = project.uploads(&to, &attributes).unwrap();
        let lit = shade.uploads(&input, &attributes, &[]).unwrap();
        let into = follow::Input {
            camera,
            footprints,
            materials,
            opaque: Some(opaque),
            direction,
            params,
            order: &[],
            objects: &[],
        };
        let into = follow::uploads(&composite, &into, &gpu).unwrap();
        let mut inputs = vec![(sort.view, &view[..])];
        inputs.extend(p.inputs(attributes.inputs(held)));
        inputs.extend(p.inputs(project.inputs(&to)));
        inputs.extend(s.inputs(shade.inputs(&lit)));
        inputs.extend(c.inputs(composite.inputs(&into)));
        inputs.retain(|(_, bytes)| !bytes.is_empty());
        let run = device.run(&whole, &inputs).unwrap();
        let read = [composite.state, composite.planes].map(|b| run.bytes(c.buffer(b)));
        let counts = composite.finish(read, &mut gpu).unwrap();
        assert_eq!(projection::visible(run.bytes(p.buffer(project.state))).unwrap(), projected.visible());
        assert!(counts.longest > 100 && counts.longest < counts.entries);

        let largest = values.iter().fold(0.0, |most: f32, v| most.max(*v));
        let far = |a: &[f32], b: &[f32], scale: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE * scale);
        let through = |a: &Accumulator| a.optical_depth[0].iter().map(|tau| (-tau).exp()).collect::<Vec<f32>>();
        assert!(through(&gpu).iter().any(|t| *t < 0.5));
        assert!(far(&through(&cpu), &through(&gpu), 1.0), "{direction:?}");
        assert!(far(&cpu.channels.concat(), &gpu.channels.concat(), largest), "{direction:?}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}
