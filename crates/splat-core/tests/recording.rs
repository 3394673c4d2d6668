//! The recorded compositing, without a device: what it is, and what it refuses.

use glam::{DVec3, Vec3};
use splat_core::raster::gpu::{AttributeRoom, Attributes, Capacities, follow, project, record, resolve};
use splat_core::raster::{self, Accumulation, Detail, OpaqueImage, Params, ProjectInput, Projected};
use splat_core::raster::{FoldInput, OpaqueInput};
use splat_core::shade::{ChannelLayout, MAX_SHADED_CHANNELS, gpu as shade};
use splat_core::{Accumulator, Camera, Cloud, Direction, Error, FootprintStack, Material, Projection, Splat};
use splat_shaders::Overflow;

/// All effects, the normal and the shadow.
const MOST: u32 = MAX_SHADED_CHANNELS as u32;

const ROOM: Capacities = Capacities {
    size: [640, 360],
    planes: 1,
    channels: 3,
    splats: 100_000,
    ordered: 80_000,
    entries: 300_000,
    footprints: 3,
    materials: 2,
    opaque: true,
    depths: false,
    objects: false,
};

#[test]
fn it_is_as_kept_in_text() {
    let found = record(ROOM).unwrap().recording.to_string();
    assert_eq!(found, include_str!("recording.txt"), "now:\n{found}");
}

#[test]
fn it_is_without_fault_for_any_room() {
    for size in [[1, 1], [16, 16], [17, 16], [4096, 16], [4097, 16], [16_384, 16_384]] {
        for (ordered, entries) in [(0, 0), (1, 1), (1025, 2048), (50_000_000, 200_000_000)] {
            for (planes, channels) in [(1, 1), (1, 3), (3, MOST)] {
                let room = Capacities { size, planes, channels, ordered, entries, opaque: false, ..ROOM };
                record(room).unwrap().recording.check().unwrap();
            }
        }
    }
}

#[test]
fn what_no_kernel_does_is_refused() {
    for room in [
        Capacities { size: [0, 5], ..ROOM },
        Capacities { size: [5, 16_385], ..ROOM },
        Capacities { planes: 2, ..ROOM },
        Capacities { channels: 0, ..ROOM },
        Capacities { channels: MOST + 1, ..ROOM },
    ] {
        assert!(matches!(record(room), Err(Error::Invalid { .. })), "{room:?}");
    }
}

fn projected() -> Projected {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..10 {
        cloud.push(&Splat { position: Vec3::X * 0.1 * i as f32, radius: 0.2, cross_section: 1.0, ..Splat::default() });
    }
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, ROOM.size).unwrap();
    raster::project(&ProjectInput {
        cloud: &cloud,
        camera: &camera,
        footprints: &FootprintStack::default(),
        materials: &[Material::default()],
        params: &Params::default(),
        detail: Detail::ALL,
    })
}

fn input<'a>(projected: &'a Projected, params: &'a Params, opaque: &'a OpaqueImage) -> FoldInput<'a> {
    static MATERIALS: std::sync::LazyLock<[Material; 1]> = std::sync::LazyLock::new(|| [Material::default()]);
    let direction = Direction::FrontToBack;
    FoldInput { projected, order: &[3, 1, 9], values: &[0.5; 30], materials: &*MATERIALS, opaque, direction, params }
}

#[test]
fn what_does_not_fit_the_room_or_the_device_is_refused() {
    let projected = projected();
    let params = Params::default();
    let opaque = OpaqueImage::default();
    let plain = Accumulator::new(ROOM.size, 1, 3, false, false);
    let input = input(&projected, &params, &opaque);
    let uploads =
        |room: Capacities, input: &FoldInput<'_>, acc: &Accumulator| record(room).unwrap().uploads(input, acc);
    uploads(ROOM, &input, &plain).unwrap();
    assert_eq!(
        input.capacities(&plain, 7),
        Capacities { splats: 10, ordered: 3, entries: 7, materials: 1, opaque: false, ..ROOM }
    );
    for room in [
        Capacities { splats: 9, ..ROOM },
        Capacities { ordered: 2, ..ROOM },
        Capacities { footprints: 2, ..ROOM },
        Capacities { materials: 0, ..ROOM },
    ] {
        assert!(matches!(uploads(room, &input, &plain), Err(Error::Overflow(_))), "{room:?}");
    }
    let wall = OpaqueImage { depth: vec![1.0; 640 * 360], ..OpaqueImage::default() };
    let hidden = FoldInput { opaque: &wall, ..input };
    let refused = uploads(Capacities { opaque: false, ..ROOM }, &hidden, &plain);
    assert_eq!(refused, Err(Error::Overflow(Overflow { what: "opaque images", needed: 1, had: 0 })));
    let short = OpaqueImage { depth: vec![1.0; 5], ..OpaqueImage::default() };
    for input in [FoldInput { values: &[0.5; 29], ..input }, FoldInput { opaque: &short, ..input }] {
        assert!(matches!(uploads(ROOM, &input, &plain), Err(Error::ColumnLength { .. })));
    }
    let half = Params { accumulation: Accumulation::F16, ..params };
    for input in [FoldInput { order: &[10], ..input }, FoldInput { params: &half, ..input }] {
        assert!(matches!(uploads(ROOM, &input, &plain), Err(Error::Invalid { .. })));
    }
    for (depths, objects) in [(true, false), (false, true)] {
        let acc = Accumulator::new(ROOM.size, 1, 3, depths, objects);
        let refused = uploads(ROOM, &input, &acc);
        assert!(matches!(refused, Err(Error::ColumnLength { .. })), "no room for layers: {refused:?}");
        let room = Capacities { opaque: false, depths, objects, ..ROOM };
        uploads(room, &input, &acc).unwrap();
        let mut shallow = projected.clone();
        let mut nameless = projected.clone();
        shallow.depths.clear();
        nameless.objects.clear();
        let lacking = FoldInput { projected: if depths { &shallow } else { &nameless }, ..input };
        assert!(matches!(uploads(room, &lacking, &acc), Err(Error::ColumnLength { .. })));
    }
    let acc = Accumulator::new(ROOM.size, 1, 3, true, false);
    let backwards = FoldInput { direction: Direction::BackToFront, ..input };
    assert!(matches!(uploads(Capacities { depths: true, ..ROOM }, &backwards, &acc), Err(Error::Invalid { .. })));
    assert!(matches!(
        uploads(ROOM, &input, &Accumulator::new([9, 9], 1, 3, false, false)),
        Err(Error::ColumnLength { .. })
    ));
}

#[test]
fn opaque_splats_are_recorded_without_fault_or_refused() {
    let room = resolve::Capacities {
        size: [640, 360],
        channels: 3,
        splats: 10,
        listed: 5,
        entries: 100,
        footprints: 3,
        objects: true,
    };
    for size in [[1, 1], [17, 16], [16_384, 16_384]] {
        for (channels, listed, entries) in [(1, 0, 0), (3, 1, 1), (MOST, 1025, 2048)] {
            let room = resolve::Capacities { size, channels, listed, entries, ..room };
            resolve::record(room).unwrap().recording.check().unwrap();
        }
    }
    for wrong in [resolve::Capacities { size: [0, 9], ..room }, resolve::Capacities { channels: MOST + 1, ..room }] {
        assert!(matches!(resolve::record(wrong), Err(Error::Invalid { .. })));
    }
    let projected = projected();
    let input = OpaqueInput { projected: &projected, ids: &[1, 7], values: &[0.5; 30], channels: 3, objects: true };
    let uploads = |room, input: &OpaqueInput<'_>| resolve::record(room).unwrap().uploads(input);
    uploads(room, &input).unwrap();
    for small in [
        resolve::Capacities { splats: 9, ..room },
        resolve::Capacities { listed: 1, ..room },
        resolve::Capacities { footprints: 2, ..room },
    ] {
        assert!(matches!(uploads(small, &input), Err(Error::Overflow(_))), "{small:?}");
    }
    let mut nameless = projected.clone();
    nameless.objects.clear();
    for wrong in [OpaqueInput { values: &[0.5; 29], ..input }, OpaqueInput { projected: &nameless, ..input }] {
        assert!(matches!(uploads(room, &wrong), Err(Error::ColumnLength { .. })));
    }
    assert!(matches!(uploads(room, &OpaqueInput { ids: &[10], ..input }), Err(Error::Invalid { .. })));
    let recorded = resolve::record(resolve::Capacities { size: [2, 1], channels: 1, ..room }).unwrap();
    let state = |low: u32| [low, 0, 5, 7].map(u32::to_ne_bytes).concat();
    let image = [1.5f32.to_bits(), f32::INFINITY.to_bits(), 2.5f32.to_bits(), 0, 4, u32::MAX].map(u32::to_ne_bytes);
    let (found, counts) = recorded.finish([&state(12), &image.concat()]).unwrap();
    let depth = vec![1.5, f32::INFINITY];
    let channels = vec![vec![2.5, 0.0]];
    let object = vec![4, u32::MAX];
    assert_eq!((found, counts.entries), (OpaqueImage { depth, channels, object }, 12));
    assert!(matches!(
        recorded.finish([&state(101), &image.concat()]),
        Err(Error::Overflow(Overflow { needed: 101, .. }))
    ));
    assert!(matches!(recorded.finish([&state(12), &[0; 20]]), Err(Error::ColumnLength { .. })));
}

#[test]
fn what_is_read_back_is_put_in_or_refused() {
    let recorded = record(Capacities { size: [2, 1], channels: 1, ..ROOM }).unwrap();
    let mut acc = Accumulator::new([2, 1], 1, 1, false, false);
    let state = |low: u32, high: u32| [low, high, 5, 7].map(u32::to_ne_bytes).concat();
    let planes = [0.5f32, 1.5, 2.5, 3.5].map(f32::to_ne_bytes).concat();
    let counts = recorded.finish([&state(12, 0), &planes], &mut acc).unwrap();
    assert_eq!((counts.splats, counts.entries, counts.longest), (5, 12, 7));
    assert_eq!((&acc.optical_depth, &acc.channels), (&vec![vec![0.5, 1.5]], &vec![vec![2.5, 3.5]]));
    let overflow = |needed| Err(Error::Overflow(Overflow { what: "tile entries", needed, had: 300_000 }));
    assert_eq!(recorded.finish([&state(300_001, 0), &planes], &mut acc), overflow(300_001));
    assert_eq!(recorded.finish([&state(1, 1), &planes], &mut acc), overflow((1 << 32) + 1));
    assert!(matches!(recorded.finish([&[], &planes], &mut acc), Err(Error::ColumnLength { .. })));
    assert!(matches!(recorded.finish([&state(1, 0), &planes[4..]], &mut acc), Err(Error::ColumnLength { .. })));
}

#[test]
fn projection_and_shading_are_as_kept_in_text() {
    let attributes = AttributeRoom { splats: 1000, frame_words: 3 };
    let room = project::Capacities { attributes, footprints: 3, materials: 2, depth: true };
    let found = project::record(room).unwrap().recording;
    found.check().unwrap();
    assert_eq!(found.to_string(), include_str!("recording_project.txt"), "now:\n{found}");
    let layout = ChannelLayout::default();
    let found = shade::record(shade::Capacities { attributes, materials: 2, lights: 3, shadows: 2, layout }).recording;
    found.check().unwrap();
    assert_eq!(found.to_string(), include_str!("recording_shade.txt"), "now:\n{found}");
    for frame_words in [1, 7] {
        let attributes = AttributeRoom { splats: 1, frame_words };
        assert!(matches!(project::record(project::Capacities { attributes, ..room }), Err(Error::Invalid { .. })));
    }
}

#[test]
fn what_follows_a_sort_reads_how_many_splats_it_left() {
    let follows = follow::record(ROOM).unwrap();
    follows.recording.check().unwrap();
    let text = follows.recording.to_string();
    assert!(
        text.contains("upload sorted\nsplat_follow 1x1x1 sorted view*\nsplat_begin 1x1x1 view state* place scan*\n")
    );
    assert!(follows.sorted.is_some() && record(ROOM).unwrap().sorted.is_none());
    // View, tables and planes alone are uploaded; the planes hold nothing yet.
    let params = Params::default();
    let opaque = OpaqueImage::default();
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, ROOM.size).unwrap();
    let footprints = FootprintStack::default();
    let direction = Direction::FrontToBack;
    let input = follow::Input {
        camera: &camera,
        footprints: &footprints,
        materials: &[Material::default()],
        opaque: Some(&opaque),
        direction,
        params: &params,
        order: &[],
        objects: &[],
    };
    let plain = Accumulator::new(ROOM.size, 1, 3, false, false);
    let uploads = follow::uploads(&follows, &input, &plain).unwrap();
    let given: Vec<usize> = follows.inputs(&uploads).iter().map(|(_, bytes)| bytes.len()).collect();
    assert_eq!(given, [80, 0, 0, 0, 16 * (5 * footprints.layers().len() + 1), 0, 0]);
    let other = Accumulator::new([8, 8], 1, 3, false, false);
    assert!(matches!(follow::uploads(&follows, &input, &other), Err(Error::ColumnLength { .. })));
}

#[test]
fn ou7_what_is_no_number_is_refused_before_a_device_sees_it() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    (0..5).for_each(|_| cloud.push(&Splat { normal: Vec3::Z, tangent: Vec3::X, value: 1.0, ..Splat::default() }));
    assert!(Attributes::new(&cloud, None).is_ok());
    type Poison = fn(&mut Cloud, f32);
    let fields: [(&str, Poison); 7] = [
        ("position", |cloud, v| cloud.position[3].y = v),
        ("radius", |cloud, v| cloud.radius[3] = v),
        ("cross_section", |cloud, v| cloud.cross_section[3] = v),
        ("color", |cloud, v| cloud.color[3][2] = v),
        ("normal", |cloud, v| cloud.normal[3].x = v),
        ("tangent", |cloud, v| cloud.tangent[3].z = v),
        ("value", |cloud, v| cloud.value[3] = v),
    ];
    for (name, poison) in fields {
        for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut cloud = cloud.clone();
            poison(&mut cloud, number);
            let found = Attributes::new(&cloud, None);
            assert!(
                matches!(found, Err(Error::Invalid { element: "splat", index: 3, attribute, .. }) if attribute == name),
                "{name} {number}: {found:?}"
            );
        }
    }
}
