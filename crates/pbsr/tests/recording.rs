//! The recorded ensemble, without a device: what it is, and what it refuses.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use pbsr::gpu::{Capacities, Nearest, Sources, record, record_generated};
use pbsr::{Appearance, GridSampler, MeshSampler, Object, Sampler, Scene, SurfaceParams, VolumeParams};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Camera, Grid, Mesh, Projection, Similarity, TransferFunction, TransferPoint};

const ROOM: Capacities = Capacities { size: [200, 100], objects: 2, levels: 2, of_set: 5000, particles: 9000 };

#[test]
fn it_is_as_kept_in_text() {
    for (nearest, expected) in
        [(Nearest::Ranked, include_str!("recording.txt")), (Nearest::Wide, include_str!("recording_wide.txt"))]
    {
        let found = record(ROOM, nearest).unwrap().recording.to_string();
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
    let scene = Scene { objects: &objects, lights: &[], ambient: [0.0; 3], camera: &camera, occluder: None };
    let sources = Sources::new(&scene).unwrap();
    let found = record_generated(ROOM, Nearest::Wide, &sources).unwrap().recording;
    found.check().unwrap();
    assert_eq!(found.to_string(), include_str!("recording_made.txt"), "now:\n{found}");
}

#[test]
fn it_is_without_fault_for_any_room() {
    for (levels, of_set) in [(0, 0), (1, 0), (3, 1), (2, 70_000_000)] {
        let room = Capacities { levels, of_set, ..ROOM };
        for nearest in [Nearest::Ranked, Nearest::Wide] {
            record(room, nearest).unwrap().recording.check().unwrap();
        }
    }
    assert!(record(Capacities { size: [0, 4], ..ROOM }, Nearest::Ranked).is_err());
    assert!(record(Capacities { size: [4, 40_000], ..ROOM }, Nearest::Wide).is_err());
}
