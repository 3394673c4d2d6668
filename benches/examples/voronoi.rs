//! A third of the Stanford bunny's vertices as a raw scan of opaque discs: in 2+1 passes, and in 1+1 passes with few groups, by plain
//! depth and by the Voronoi depth of Eq. 14 (Zhang and Pajarola 2007, Figs. 13 and 14). Light falls on pixels.
//!
//! `cargo run --release -p organza-benches --example voronoi -- docs/images/voronoi.png`
#![allow(clippy::expect_used, reason = "an example")]

use convert::{SurfelParams, raw_to_surfels};
use deferred_blend::grouping::{GraphParams, OverlapGraph, Relaxation, minimum_coloring};
use deferred_blend::{DiscInput, Discs, Light, Opaque, OpaqueInput, Params, Passes, Shown, resolve_opaque};
use read::{Loaded, ReadParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput};
use splat_core::{
    Camera, Cloud, FootprintStack, LayerSet, Light as Sun, LightShape, Material, Object, Projection, RawPoints,
    Similarity,
};
use std::f32::consts::PI;

const SIZE: [u32; 2] = [300, 280];
/// c: discs whose centres lie nearer than this share of both radii are of different groups.
const FACTOR: f32 = 0.4;

fn main() {
    let to = std::env::args().nth(1).expect("a file to write");
    let cloud = bunny();
    let footprints = FootprintStack::default();
    let materials = [Material::default()];
    let bounds = cloud.bounds();
    let middle = 0.5 * (bounds.min + bounds.max);
    let size = (bounds.max - bounds.min).max_element();
    let target = cloud.origin + (middle + size * Vec3::new(-0.22, 0.0, 0.14)).as_dvec3();
    let eye = target + f64::from(size) * DVec3::new(-0.4, -2.0, 0.5);
    let view = Projection::Perspective { fov_y: 0.26 };
    let camera = Camera::look_at(eye, target, DVec3::Z, view, SIZE).expect("a view");
    let ids: Vec<u32> = (0..cloud.len() as u32).collect();
    let params = Params::default();
    let discs = DiscInput { cloud: &cloud, ids: &ids, camera: &camera, footprints: &footprints, materials: &materials };
    let discs = Discs::project(&discs, &params);

    let relaxation = Relaxation { factor: FACTOR, ..Relaxation::default() };
    let graph = GraphParams { disc_scale: params.disc_scale, relaxation, ..GraphParams::default() };
    let graph = OverlapGraph::build(&cloud, &graph, None).expect("a graph");
    let groups = &minimum_coloring(&graph, 256, None).expect("groups").groups;
    println!("{} discs in {} groups", cloud.len(), groups.count());

    let direction = DVec3::new(0.4, 0.77, -0.5).normalize();
    let sun = Sun { shape: LightShape::Directional { direction }, intensity: [0.75 * PI; 3] };
    let objects = [Object { name: "bunny".into(), casts_shadow: false, shadow_coefficient: 1.0 }];
    let lights = &[LitBy { light: sun, slide: None, shadow: None }];
    let materials = &materials;
    let camera = &camera;
    let cloud = &cloud;
    let objects = &objects;
    let ambient = [0.1; 3];
    let input = &ShadeInput { cloud, materials, objects, lights, ambient, camera };
    let layout = ChannelLayout::new(&LayerSet::default());
    let transforms = &[Similarity::default()];
    let light = Light { input, layout, transforms, heights: &[] };
    let resolve = |passes: Passes<'_>| {
        let shown = Shown::Pixels(light);
        let max_bytes = 1 << 30;
        let input = OpaqueInput { discs: &discs, shown, channels: 3, objects: false, passes, max_bytes };
        resolve_opaque(&input, &params, None).expect("a picture")
    };
    let plain = Passes::OnePlusOne { groups, voronoi: false };
    let voronoi = Passes::OnePlusOne { groups, voronoi: true };
    let pictures = [Passes::TwoPlusOne, plain, voronoi].map(resolve);
    let pixel = |x: u32, y: u32| lit(&pictures[(x / SIZE[0]) as usize], [x % SIZE[0], y]);
    let image = image::GrayImage::from_fn(3 * SIZE[0], SIZE[1], |x, y| image::Luma([pixel(x, y)]));
    image.save(to).expect("a place for the picture");
}

fn bunny() -> Cloud {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/stanford-bunny/bunny.ply.gz");
    let (loaded, _) = read::file(file.as_ref(), &ReadParams::default(), None).expect("the bunny");
    let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
    let position = mesh.position.iter().step_by(3).copied().collect();
    let points = RawPoints { position, origin: mesh.origin, ..RawPoints::default() };
    let (mut cloud, _) = raw_to_surfels(&points, &SurfelParams::default(), None).expect("discs of the bunny");
    cloud.canonicalize();
    cloud
}

/// Grey of a pixel, in sRGB.
fn lit(picture: &Opaque, [x, y]: [u32; 2]) -> u8 {
    let k = (y * SIZE[0] + x) as usize;
    if picture.disc[k] == u32::MAX {
        return 255;
    }
    (255.0 * picture.image.channels[0][k].powf(1.0 / 2.2)) as u8
}
