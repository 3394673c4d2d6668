//! The recorded ensemble, without a device: what it is, and what it refuses.

use pbsr::gpu::{Capacities, Lighting, Nearest, ShadowOf, Sources, record, record_generated};
use pbsr::{Appearance, EnsembleParams, GridSampler, MeshSampler, Object, Sampler, Scene, SurfaceParams, VolumeParams};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::raster::gpu::{AttributeBuffers, AttributeRoom};
use splat_core::{Camera, Grid, Mesh, Projection, Similarity, TransferFunction, TransferPoint};
use splat_shaders::{BufferId, Groups, Recording, kernels};

const ROOM: Capacities = Capacities { size: [200, 100], objects: 2, levels: 2, of_set: 5000, particles: 9000 };

#[test]
fn it_is_as_kept_in_text() {
    for (nearest, expected) in
        [(Nearest::Ranked, include_str!("recording.txt")), (Nearest::Wide, include_str!("recording_wide.txt"))]
    {
        let found = record(ROOM, nearest, None).unwrap().recording.to_string();
        assert_eq!(found, expected, "now:\n{found}");
    }
}

#[test]
fn sets_that_the_device_makes_are_as_kept_in_text() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh { position: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let surface = MeshSampler::new(&mesh, &SurfaceParams::default(), None).unwrap();
    let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [3; 3], values: vec![1.0; 27] };
    let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
    let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(2.0, 4.0)]).unwrap();
    let volume = GridSampler::new(&grid, &transfer, &VolumeParams::default(), None).unwrap();
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, ROOM.size).unwrap();
    let object = |sampler| Object { sampler, transform: Similarity::default(), look: Appearance::default() };
    let objects = [object(&surface as &dyn Sampler), object(&volume)];
    let scene = Scene {
        objects: &objects,
        lights: &[],
        shadow_origin: DVec3::ZERO,
        ambient: [0.0; 3],
        camera: &camera,
        occluder: None,
    };
    let sources = Sources::new(&scene).unwrap();
    let found = record_generated(ROOM, Nearest::Wide, None, &sources).unwrap().recording;
    found.check().unwrap();
    assert_eq!(found.to_string(), include_str!("recording_made.txt"), "now:\n{found}");
}

/// The look-ups of a light, as far as they matter here: what it gives to splats.
struct Shadow {
    recording: Recording,
    attributes: AttributeBuffers,
    shares: BufferId,
    received: BufferId,
}

impl Shadow {
    fn new(room: AttributeRoom, light: u32) -> Self {
        let mut recording = Recording::default();
        let r = &mut recording;
        let attributes = AttributeBuffers::record(r, room);
        let [view, lights] = [r.input("frame", 16), r.input("lights", 4)];
        let shares = r.input("own shares", 4);
        let received = r.scratch("received", 12 * u64::from(room.splats) * u64::from(1 + light));
        r.dispatch(&kernels::TSM_HAND_ON, Groups::cover(1), &[view, lights, shares, received], &[light]);
        r.read(received);
        Self { recording, attributes, shares, received }
    }

    fn parts(&self) -> ShadowOf<'_> {
        let Self { recording, attributes, shares, received } = self;
        ShadowOf { recording, attributes, shares: *shares, received: *received }
    }
}

#[test]
fn lit_levels_are_as_kept_in_text() {
    let shadows = [0, 1].map(|light| Shadow::new(ROOM.seen(), light));
    let shadows: Vec<_> = shadows.iter().map(Shadow::parts).collect();
    let lighting = Lighting { params: EnsembleParams::default(), lights: 2, shadows: &shadows };
    let found = record(ROOM, Nearest::Ranked, Some(&lighting)).unwrap().recording;
    found.check().unwrap();
    assert_eq!(found.to_string(), include_str!("recording_lit.txt"), "now:\n{found}");
}

#[test]
fn large_images_are_lit_in_parts_and_what_is_kept_makes_room() {
    let room = Capacities { size: [4000, 3000], ..ROOM };
    let params = EnsembleParams { effects: true, shadow: true, ..EnsembleParams::default() };
    for (nearest, see) in [(Nearest::Ranked, "pbsr_see "), (Nearest::Wide, "pbsr_see_wide ")] {
        let lighting = Lighting { params, lights: 1, shadows: &[] };
        let recorded = record(room, nearest, Some(&lighting)).unwrap();
        recorded.recording.check().unwrap();
        // Two levels of 63 × 47 tiles, 256 of them at once.
        let text = recorded.recording.to_string();
        assert_eq!(text.lines().filter(|line| line.starts_with(see)).count(), 2 * 12);
        assert_eq!(room.seen().splats, 256 * 4096);
        let bytes = recorded.recording.buffers()[recorded.sums.index()].bytes;
        assert_eq!(bytes, 63 * 47 * 4096 * 4 * (3 + 2 * 13));
    }
    let object = EnsembleParams { object: true, ..EnsembleParams::default() };
    assert!(record(room, Nearest::Wide, Some(&Lighting { params: object, lights: 0, shadows: &[] })).is_err());
}

#[test]
fn it_is_without_fault_for_any_room() {
    for (levels, of_set) in [(0, 0), (1, 0), (3, 1), (2, 70_000_000)] {
        let room = Capacities { levels, of_set, ..ROOM };
        for nearest in [Nearest::Ranked, Nearest::Wide] {
            record(room, nearest, None).unwrap().recording.check().unwrap();
        }
    }
    assert!(record(Capacities { size: [0, 4], ..ROOM }, Nearest::Ranked, None).is_err());
    assert!(record(Capacities { size: [4, 40_000], ..ROOM }, Nearest::Wide, None).is_err());
}
