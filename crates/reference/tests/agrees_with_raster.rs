//! The rasterizer against the exact compositor, and the twin orders against each other, on mixed random scenes.

use reference::{Input, Order, composite};
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::raster::{
    Detail, FoldInput, OpaqueImage, OpaqueInput, Params, ProjectInput, fold, project, resolve_opaque,
};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, FootprintImage, FootprintStack, Material, Projection, Splat, SplatKind, rng,
};

const SIZE: [u32; 2] = [75, 50];

fn camera(projection: Projection) -> Camera {
    Camera::look_at(DVec3::new(0.3, 0.2, 4.0), DVec3::ZERO, DVec3::Y, projection, SIZE).unwrap()
}

fn random(item: u64, sample: u64) -> f32 {
    rng::unit_f32(42, 7, item, sample)
}

/// Media, translucent discs (some elliptical) and opaque discs, mixed in a box.
fn mixed_cloud(n: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(1e-3, 0.0, 0.0));
    for i in 0..n {
        let u = |k| random(i, k);
        let normal = Vec3::new(u(3) - 0.5, u(4) - 0.5, u(5) - 0.5).normalize();
        let kind = match i % 20 {
            0..10 => SplatKind::Medium,
            10..19 => SplatKind::Surface,
            _ => SplatKind::Opaque,
        };
        let radius = 0.05 + 0.25 * u(6);
        cloud.push(&Splat {
            position: Vec3::new(3.0 * u(0) - 1.5, 2.0 * u(1) - 1.0, 2.0 * u(2) - 1.0),
            radius,
            cross_section: 0.2 * u(7) * radius * radius,
            color: [u(8), u(9), u(10)],
            kind,
            material: (i % 2) as u16,
            footprint: (i % 3) as u8,
            normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
            tangent: if i % 4 == 2 { normal.any_orthonormal_vector() * 0.5 * radius } else { Vec3::ZERO },
            ..Splat::default()
        });
    }
    cloud
}

struct Raster {
    values: Vec<Vec<f32>>,
    transmittance: Vec<Vec<f32>>,
}

fn rasterize(cloud: &Cloud, camera: &Camera, materials: &[Material], planes: usize, direction: Direction) -> Raster {
    rasterize_by(cloud, camera, materials, planes, (direction, &FootprintStack::default()))
}

fn rasterize_by(
    cloud: &Cloud,
    camera: &Camera,
    materials: &[Material],
    planes: usize,
    (direction, footprints): (Direction, &FootprintStack),
) -> Raster {
    let view = camera.view_from_offset(cloud.origin);
    let depth = |i: &u32| view.depth(cloud.position[*i as usize]);
    let mut translucent: Vec<u32> =
        (0..cloud.len() as u32).filter(|i| cloud.kind[*i as usize] != SplatKind::Opaque).collect();
    translucent.sort_by(|a, b| depth(a).total_cmp(&depth(b)).then(a.cmp(b)));
    if direction == Direction::BackToFront {
        translucent.reverse();
    }
    let opaque: Vec<u32> = (0..cloud.len() as u32).filter(|i| cloud.kind[*i as usize] == SplatKind::Opaque).collect();
    let params = Params { transmittance_cutoff: 0.0, ..Params::default() };
    let projected =
        project(&ProjectInput { cloud, camera, footprints, materials, params: &params, detail: Detail::ALL });
    let values: Vec<f32> = cloud.color.iter().flatten().copied().collect();
    let solid = OpaqueInput { projected: &projected, ids: &opaque, values: &values, channels: 3, objects: false };
    let (solid, _) = resolve_opaque(&solid, None).unwrap();
    let input = FoldInput {
        projected: &projected,
        order: &translucent,
        values: &values,
        materials,
        opaque: &solid,
        direction,
        params: &params,
    };
    let mut acc = Accumulator::new(SIZE, planes, 3, false, false);
    fold(&input, &mut acc, None).unwrap();
    finish(acc, &solid)
}

fn finish(mut acc: Accumulator, solid: &OpaqueImage) -> Raster {
    let mut transmittance: Vec<Vec<f32>> =
        acc.optical_depth.iter().map(|p| p.iter().map(|a| (-a).exp()).collect()).collect();
    for k in 0..solid.depth.len() {
        if solid.depth[k].is_finite() {
            for c in 0..3 {
                let p = if transmittance.len() == 3 { c } else { 0 };
                acc.channels[c][k] += transmittance[p][k] * solid.channels[c][k];
            }
            transmittance.iter_mut().for_each(|p| p[k] = 0.0);
        }
    }
    Raster { values: acc.channels, transmittance }
}

fn largest_difference(raster: &Raster, cloud: &Cloud, camera: &Camera, materials: &[Material]) -> f64 {
    largest_difference_by(raster, cloud, camera, (materials, &FootprintStack::default()))
}

fn largest_difference_by(
    raster: &Raster,
    cloud: &Cloud,
    camera: &Camera,
    (materials, footprints): (&[Material], &FootprintStack),
) -> f64 {
    let values: Vec<f32> = cloud.color.iter().flatten().copied().collect();
    let exact = composite(
        &Input {
            cloud,
            camera,
            footprints,
            materials,
            values: &values,
            channels: 3,
            resampling_sigma_px: Params::default().resampling_sigma_px,
            order: Order::Centre,
        },
        None,
    )
    .unwrap();
    let mut largest: f64 = 0.0;
    for k in 0..exact.values.len() {
        for c in 0..3 {
            let p = if raster.transmittance.len() == 3 { c } else { 0 };
            largest = largest.max((f64::from(raster.values[c][k]) - exact.values[k][c]).abs());
            largest = largest.max((f64::from(raster.transmittance[p][k]) - exact.transmittance[k][c]).abs());
        }
    }
    largest
}

fn materials(rgb: bool) -> [Material; 2] {
    let tinted = Material { extinction_rgb: [1.0, 0.5, 0.25], ..Material::default() };
    [Material::default(), if rgb { tinted } else { Material::default() }]
}

#[test]
fn the_exact_compositor_agrees_with_the_rasterizer() {
    let cloud = mixed_cloud(3000);
    for projection in [Projection::Perspective { fov_y: 0.7 }, Projection::Orthographic { height: 2.5 }] {
        let camera = camera(projection);
        for (rgb, planes) in [(false, 1), (true, 3)] {
            let materials = materials(rgb);
            let raster = rasterize(&cloud, &camera, &materials, planes, Direction::FrontToBack);
            let difference = largest_difference(&raster, &cloud, &camera, &materials);
            assert!(difference < 2e-5, "{projection:?} rgb {rgb}: {difference:e}");
        }
    }
}

/// Formulas, and images that are no mirror images of themselves: one wide with many texels, one high with few.
fn with_images() -> FootprintStack {
    let leaf = |size: [u32; 2]| {
        let share = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
        let at = |x: f64, y: f64| {
            let width = 0.4 * (1.0 - y) * (1.2 * y + 0.1).sqrt() + 0.02;
            let edge = (0.5 + 0.1 * y - x).abs() / width;
            (1.5 - edge).clamp(0.0, 1.0) as f32 * (0.6 + 0.4 * x as f32)
        };
        let pixels = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j)));
        let coverage: Vec<f32> = pixels.map(|(i, j)| at(share(i, size[0]), share(j, size[1]))).collect();
        FootprintImage::new(size, &coverage).unwrap().into()
    };
    FootprintStack::default().with_image(1, leaf([150, 90])).with_image(2, leaf([7, 20]))
}

/// Far away, near, and through the eye plane in parallel rays; some are opaque.
#[test]
fn the_exact_compositor_agrees_on_images() {
    let cloud = mixed_cloud(3000);
    let footprints = with_images();
    let materials = materials(false);
    let far =
        |projection| Camera::look_at(DVec3::new(2.0, 7.0, 25.0), DVec3::ZERO, DVec3::Y, projection, SIZE).unwrap();
    let amid = Camera::look_at(
        DVec3::new(0.1, 0.05, 0.3),
        DVec3::ZERO,
        DVec3::Y,
        Projection::Orthographic { height: 2.0 },
        SIZE,
    );
    let cameras = [
        camera(Projection::Perspective { fov_y: 0.7 }),
        camera(Projection::Orthographic { height: 0.7 }),
        far(Projection::Perspective { fov_y: 0.3 }),
        amid.unwrap(),
    ];
    for camera in cameras {
        let raster = rasterize_by(&cloud, &camera, &materials, 1, (Direction::FrontToBack, &footprints));
        let difference = largest_difference_by(&raster, &cloud, &camera, (&materials, &footprints));
        assert!(difference < 5e-5, "{:?}: {difference:e}", camera.projection);
        let formulas = largest_difference(&raster, &cloud, &camera, &materials);
        assert!(formulas > 0.05, "images are seen: {formulas}");
    }
}

/// The eye among the splats: some lie across the eye plane, some behind it.
#[test]
fn the_exact_compositor_agrees_around_the_eye() {
    let cloud = mixed_cloud(3000);
    let materials =
        [Material { surface_opacity: SurfaceOpacity::ThinSlab, ..Material::default() }, Material::default()];
    // In perspective splats across the eye plane are not filtered by the definition, and seen from R/32 away at least.
    for (projection, tolerance) in
        [(Projection::Orthographic { height: 2.0 }, 3e-5), (Projection::Perspective { fov_y: 0.7 }, 0.03)]
    {
        let camera = Camera::look_at(DVec3::new(0.1, 0.05, 0.3), DVec3::ZERO, DVec3::Y, projection, SIZE).unwrap();
        let raster = rasterize(&cloud, &camera, &materials, 1, Direction::FrontToBack);
        let difference = largest_difference(&raster, &cloud, &camera, &materials);
        assert!(difference < tolerance, "{projection:?}: {difference:e}");
    }
}

#[test]
fn a_wrong_order_is_seen_by_the_comparison() {
    let cloud = mixed_cloud(3000);
    let camera = camera(Projection::Perspective { fov_y: 0.7 });
    let materials = materials(false);
    let mut raster = rasterize(&cloud, &camera, &materials, 1, Direction::FrontToBack);
    raster.values.swap(0, 1);
    assert!(largest_difference(&raster, &cloud, &camera, &materials) > 1e-2);
}

#[test]
fn back_to_front_is_the_twin_of_front_to_back() {
    let cloud = mixed_cloud(3000);
    let camera = camera(Projection::Perspective { fov_y: 0.7 });
    for (rgb, planes) in [(false, 1), (true, 3)] {
        let materials = materials(rgb);
        let raster = rasterize(&cloud, &camera, &materials, planes, Direction::BackToFront);
        let difference = largest_difference(&raster, &cloud, &camera, &materials);
        assert!(difference < 2e-5, "rgb {rgb}: {difference:e}");
    }
}

#[test]
fn x1_any_number_of_threads_gives_the_same_bits() {
    let cloud = mixed_cloud(40_000);
    let camera = camera(Projection::Perspective { fov_y: 0.7 });
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let raster = pool.install(|| rasterize(&cloud, &camera, &materials(true), 3, Direction::FrontToBack));
        raster.values.concat().iter().map(|v| v.to_bits()).collect::<Vec<u32>>()
    };
    let one = run(1);
    for threads in [2, 3, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}
