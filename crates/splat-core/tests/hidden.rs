//! What opaque surfaces hide is known before it is shaded: its values are never read.

use glam::{DVec3, Vec3};
use splat_core::raster::{
    Cover, Detail, FoldInput, NearestSurfaces, OpaqueImage, Params, ProjectInput, Projected, Reached, fold, project,
};
use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat, SplatKind, rng};

const SIZE: [u32; 2] = [160, 96];

/// A number between 0 and 1 for each splat and purpose.
fn unit(seed: u64, splat: u64, purpose: u64) -> f32 {
    rng::unit_f32(seed, purpose, splat, 0)
}

/// Splats of all kinds in a box before the camera, some of them beside the eye, most of them behind others, and a wall amid them.
fn cloud(seed: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..3000 {
        let place = |axis| 2.0 * unit(seed, i, axis) - 1.0;
        let direction = Vec3::new(unit(seed, i, 4) - 0.5, unit(seed, i, 5) - 0.5, unit(seed, i, 6) - 0.5);
        let kind = match i % 4 {
            0 => SplatKind::Medium,
            1 => SplatKind::Surface,
            _ => SplatKind::Opaque,
        };
        let radius = 0.02 + 0.3 * unit(seed, i, 3).powi(4);
        cloud.push(&Splat {
            position: Vec3::new(1.6 * place(0), place(1), 4.0 * place(2)),
            radius,
            cross_section: radius * radius,
            kind,
            normal: direction.normalize(),
            ..Splat::default()
        });
    }
    let radius = 8.0;
    let wall = Vec3::new(0.0, 0.0, 1.0);
    let kind = SplatKind::Opaque;
    cloud.push(&Splat {
        position: wall,
        radius,
        cross_section: radius * radius,
        kind,
        normal: Vec3::Z,
        ..Splat::default()
    });
    cloud
}

fn camera(projection: Projection) -> Camera {
    Camera::look_at(DVec3::new(0.2, 0.1, 4.0), DVec3::ZERO, DVec3::Y, projection, SIZE).unwrap()
}

fn projected(cloud: &Cloud, camera: &Camera) -> Projected {
    project(&ProjectInput {
        cloud,
        camera,
        footprints: &FootprintStack::default(),
        materials: &[Material::default()],
        params: &Params::default(),
        detail: Detail::ALL,
    })
}

fn ids(cloud: &Cloud, are_opaque: bool) -> Vec<u32> {
    (0..cloud.len() as u32).filter(|i| (cloud.kind[*i as usize] == SplatKind::Opaque) == are_opaque).collect()
}

#[test]
fn values_of_hidden_splats_are_never_read() {
    let views = [Projection::Perspective { fov_y: 0.9 }, Projection::Orthographic { height: 2.4 }];
    let mut hidden_discs = 0;
    let mut hidden_translucent = 0;
    for seed in 0..6 {
        let cloud = cloud(seed);
        let camera = camera(views[seed as usize % 2]);
        let projected = projected(&cloud, &camera);
        let [solid, translucent] = [true, false].map(|are_opaque| ids(&cloud, are_opaque));
        let values: Vec<f32> = (0..cloud.len() as u64).map(|i| unit(seed, i, 9)).collect();
        let nearest = || NearestSurfaces::find(&projected, &solid, true, None).unwrap();

        let mut seen_alone = values.clone();
        let unseen = solid.iter().filter(|id| !nearest().shows(**id as usize));
        for id in unseen {
            hidden_discs += u32::from(projected.is_visible(*id as usize));
            seen_alone[*id as usize] = f32::NAN;
        }
        let (image, _) = nearest().resolve(&values, 1, None).unwrap();
        let (image_of_seen, _) = nearest().resolve(&seen_alone, 1, None).unwrap();
        assert_eq!(image, image_of_seen, "seed {seed}");

        let cover = Cover::new(&image, SIZE);
        for id in translucent.iter().filter(|id| projected.is_visible(**id as usize)) {
            if cover.hides(&projected, *id as usize) {
                hidden_translucent += 1;
                seen_alone[*id as usize] = f32::NAN;
            }
        }
        let folded = |values: &[f32]| {
            let mut accumulator = Accumulator::new(SIZE, 1, 1, false, false);
            let input = FoldInput {
                projected: &projected,
                order: &translucent,
                values,
                materials: &[Material::default()],
                opaque: &image,
                direction: Direction::FrontToBack,
                params: &Params::default(),
            };
            fold(&input, &mut accumulator, None).unwrap();
            accumulator
        };
        let [whole, of_seen] = [&values, &seen_alone].map(|values| folded(values));
        assert_eq!(whole.channels, of_seen.channels, "seed {seed}");
        assert_eq!(whole.optical_depth, of_seen.optical_depth, "seed {seed}");
    }
    assert!(hidden_discs > 3000, "{hidden_discs}");
    assert!(hidden_translucent > 300, "{hidden_translucent}");
}

/// A folded image of these values, of one plane of optical depth or three.
fn folded(input: &FoldInput<'_>, planes: usize, values: &[f32]) -> Accumulator {
    let channels = values.len() / input.projected.splats.len();
    let mut accumulator = Accumulator::new(SIZE, planes, channels, false, false);
    fold(&FoldInput { values, ..*input }, &mut accumulator, None).unwrap();
    accumulator
}

#[test]
fn values_behind_finished_pixels_are_never_read() {
    let views = [Projection::Perspective { fov_y: 0.9 }, Projection::Orthographic { height: 2.4 }];
    let mut passed_over = 0;
    for seed in 0..3 {
        let mut cloud = cloud(seed);
        // A hundred times as thick, so that pixels are finished early.
        cloud.cross_section.iter_mut().for_each(|area| *area *= 100.0);
        let camera = camera(views[seed as usize % 2]);
        let projected = projected(&cloud, &camera);
        let place = camera.view_from_offset(cloud.origin);
        let mut order = ids(&cloud, false);
        let depth = |id: &u32| place.depth(cloud.position[*id as usize]);
        order.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        let ones = vec![1.0; cloud.len()];
        let solid = NearestSurfaces::find(&projected, &ids(&cloud, true), false, None).unwrap();
        let behind = solid.resolve(&ones, 1, None).unwrap().0;
        for (opaque, planes, channels) in [(OpaqueImage::default(), 1, 1), (behind.clone(), 1, 3), (behind, 3, 3)] {
            let input = FoldInput {
                projected: &projected,
                order: &order,
                values: &[],
                materials: &[Material::default()],
                opaque: &opaque,
                direction: Direction::FrontToBack,
                params: &Params::default(),
            };
            let reached = Reached::find(&input, planes, None).unwrap();
            let values: Vec<f32> = (0..(channels * cloud.len()) as u64).map(|i| unit(seed, i, 9)).collect();
            let mut of_reached = values.clone();
            for id in order.iter().filter(|id| !reached.has(**id as usize)) {
                passed_over += u32::from(projected.is_visible(*id as usize));
                of_reached[*id as usize * channels..][..channels].fill(f32::NAN);
            }
            assert_eq!(reached.count(), order.iter().filter(|id| reached.has(**id as usize)).count() as u64);
            let [whole, of_reached] = [values, of_reached].map(|values| folded(&input, planes, &values));
            assert_eq!(whole.channels, of_reached.channels, "seed {seed}");
            assert_eq!(whole.optical_depth, of_reached.optical_depth, "seed {seed}");
        }
    }
    assert!(passed_over > 2500, "{passed_over}");
}

#[test]
fn every_disc_that_a_pixel_names_is_shown() {
    let cloud = cloud(11);
    let projected = projected(&cloud, &camera(Projection::Perspective { fov_y: 0.9 }));
    let solid = ids(&cloud, true);
    let nearest = NearestSurfaces::find(&projected, &solid, false, None).unwrap();
    let shown = solid.iter().filter(|id| nearest.shows(**id as usize)).count() as u64;
    assert_eq!(nearest.shown(), shown);
    // One disc after the other is taken away: the picture changes where it was shown alone.
    let ones = vec![1.0; cloud.len()];
    let image =
        |ids: &[u32]| NearestSurfaces::find(&projected, ids, false, None).unwrap().resolve(&ones, 1, None).unwrap().0;
    let whole = image(&solid);
    for k in (0..solid.len()).step_by(29) {
        let mut others = solid.clone();
        let disc = others.remove(k) as usize;
        assert!(nearest.shows(disc) || image(&others) == whole, "{disc}");
    }
}
