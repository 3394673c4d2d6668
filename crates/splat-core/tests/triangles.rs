//! Triangles of meshes: coverage without gaps, depth and attributes by the rays themselves.

use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::raster::triangles::{
    PlacedMesh, TriangleHit, TriangleImage, TriangleLayer, count_layers, resolve, resolve_depth, resolve_layers,
};
use splat_core::{Camera, Error, Mesh, Progress, Projection, Similarity, rng};

fn camera(from: DVec3, at: DVec3, projection: Projection, size: [u32; 2]) -> Camera {
    Camera::look_at(from, at, DVec3::Y, projection, size).unwrap()
}

const LENS: Projection = Projection::Perspective { fov_y: 0.8 };
const PARALLEL: Projection = Projection::Orthographic { height: 6.0 };

fn mesh(position: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh { position, triangles, ..Mesh::default() }
}

fn placed(mesh: &Mesh) -> [PlacedMesh<'_>; 1] {
    [PlacedMesh { mesh, transform: Similarity::default() }]
}

fn seen(mesh: &Mesh, camera: &Camera) -> TriangleImage {
    resolve(&placed(mesh), camera, None).unwrap()
}

/// How many triangles each pixel meets: every triangle is drawn by itself.
fn coverage(whole: &Mesh, camera: &Camera) -> Vec<u32> {
    let mut count = vec![0; (camera.size[0] * camera.size[1]) as usize];
    for triangle in &whole.triangles {
        let one = mesh(triangle.map(|v| whole.position[v as usize]).to_vec(), vec![[0, 1, 2]]);
        let hits = seen(&one, camera).hits;
        count.iter_mut().zip(hits).for_each(|(n, hit)| *n += u32::from(hit != TriangleHit::NONE));
    }
    count
}

/// A pixel's ray in the world.
fn ray(camera: &Camera, x: f64, y: f64) -> [DVec3; 2] {
    let (from, along) = camera.view_ray(x, y);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    [camera.position + world(from), world(along)]
}

/// A net of triangles over the plane through the origin, wider than the picture; inner corners are moved at random, or none.
fn net(cells: u32, half: f32, jitter: f32, turn: DQuat) -> Mesh {
    let n = cells + 1;
    let step = 2.0 * half / cells as f32;
    let corner = |k: u32| {
        let unit = |axis: u64| rng::unit_f32(5, u64::from(cells), u64::from(k), axis) - 0.5;
        let i = k % n;
        let j = k / n;
        let inner = if i.is_multiple_of(cells) || j.is_multiple_of(cells) { 0.0 } else { jitter * step };
        let place = Vec3::new(i as f32 * step - half + inner * unit(0), j as f32 * step - half + inner * unit(1), 0.0);
        (turn * place.as_dvec3()).as_vec3()
    };
    let cell = |k: u32| {
        let i = k % cells;
        let j = k / cells;
        let [a, b, c, d] = [j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i];
        if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    };
    mesh((0..n * n).map(corner).collect(), (0..cells * cells).flat_map(cell).collect())
}

#[test]
fn hv11_a_net_covers_every_pixel_once() {
    for turn in [DQuat::IDENTITY, DQuat::from_euler(splat_core::glam::EulerRot::XYZ, 0.4, -0.3, 0.7)] {
        // Corners and edges on the middles of pixels in the first, and next to them in the others.
        for (cells, half, jitter) in [(8, 12.0, 0.0), (8, 12.0, 0.6), (13, 9.0, 0.6), (40, 12.0, 0.5)] {
            let net = net(cells, half, jitter, turn);
            for projection in [PARALLEL, LENS] {
                let camera = camera(DVec3::new(0.0, 0.0, 7.0), DVec3::ZERO, projection, [48, 48]);
                let twice = coverage(&net, &camera).into_iter().filter(|n| *n != 1).count();
                assert_eq!(twice, 0, "{cells} cells, {jitter}, {projection:?}");
            }
        }
    }
}

#[test]
fn hv11_a_closed_fan_of_slivers_covers_every_pixel_once() {
    for (blades, middle) in [(5, [0.0f32, 0.0]), (700, [0.3, -0.2]), (1500, [0.0625, 0.0625])] {
        let rim = |k: u32| {
            let angle = f64::from(k) / f64::from(blades) * std::f64::consts::TAU;
            Vec3::new(40.0 * angle.cos() as f32, 40.0 * angle.sin() as f32, -1.0)
        };
        let position = std::iter::once(Vec3::new(middle[0], middle[1], 0.5)).chain((0..blades).map(rim)).collect();
        let fan = mesh(position, (0..blades).map(|k| [0, 1 + k, 1 + (k + 1) % blades]).collect());
        for projection in [PARALLEL, LENS] {
            let camera = camera(DVec3::Z * 9.0, DVec3::ZERO, projection, [40, 32]);
            assert!(coverage(&fan, &camera).iter().all(|n| *n == 1), "{blades} blades, {projection:?}");
        }
    }
}

/// A box of which no triangle fits in front of the eye.
fn room() -> Mesh {
    let corner = |k: u32| Vec3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.0 } else { -1.0 }));
    let face = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    mesh((0..8).map(corner).collect(), faces.into_iter().flat_map(face).collect())
}

#[test]
fn hv11_from_within_a_room_every_pixel_meets_one_wall_at_its_distance() {
    let room = room();
    for item in 0..40u64 {
        let unit = |n: u64| 2.0 * rng::unit(7, 1, item, n) - 1.0;
        // The last ones are next to walls and corners, far nearer than a pixel.
        let reach = if item < 20 { 0.9 } else { 1.0 - 10f64.powi(-(item as i32 - 18) / 3) };
        let from = DVec3::new(unit(0), unit(1), unit(2)).signum() * reach * DVec3::new(1.0, unit(3).abs(), 1.0);
        let to = from + DVec3::new(unit(4), unit(5), unit(6));
        let camera = camera(from, to, Projection::Perspective { fov_y: 2.2 }, [32, 24]);
        assert!(coverage(&room, &camera).iter().all(|n| *n == 1), "from {from}");
        let image = seen(&room, &camera);
        for (k, depth) in image.depth.iter().enumerate() {
            let [from, along] = ray(&camera, (k % 32) as f64 + 0.5, (k / 32) as f64 + 0.5);
            let wall = |a: usize| (along[a].signum() - from[a]) / along[a];
            let expected = wall(0).min(wall(1)).min(wall(2));
            let error = (f64::from(*depth) - expected).abs() / expected;
            // A wall that is nearer than 1/4096 pixel of an edge may be met beyond its edge.
            assert!(error < 1e-3, "from {from}: {depth}, not {expected}");
        }
    }
}

/// The nearest triangle of a ray by solving for it, with its barycentric coordinates and the least of them all.
fn slow(whole: &Mesh, [from, along]: [DVec3; 2]) -> (Option<(f64, usize, DVec3)>, f64) {
    let mut nearest: Option<(f64, usize, DVec3)> = None;
    let mut margin: f64 = f64::INFINITY;
    for (t, triangle) in whole.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| whole.position[v as usize].as_dvec3() - from);
        let normal = (b - a).cross(c - a);
        let depth = a.dot(normal) / along.dot(normal);
        let p = along * depth;
        let area = normal.length_squared();
        let at = DVec3::new(
            (c - b).cross(p - b).dot(normal) / area,
            (a - c).cross(p - c).dot(normal) / area,
            (b - a).cross(p - a).dot(normal) / area,
        );
        if depth > 0.0 {
            margin = margin.min(at.min_element().abs());
        }
        if depth > 0.0 && at.min_element() >= 0.0 && nearest.is_none_or(|(z, ..)| depth < z) {
            nearest = Some((depth, t, at));
        }
    }
    (nearest, margin)
}

#[test]
fn hv11_a_heap_of_triangles_is_what_rays_meet() {
    for item in 0..30u64 {
        let corner = |k: u64| {
            let unit = |n: u64| rng::unit_f32(9, 2, item, 3 * k + n) - 0.5;
            let far = if k.is_multiple_of(7) { 40.0 } else { 5.0 };
            Vec3::new(unit(0), unit(1), unit(2)) * far
        };
        let heap = mesh((0..36).map(corner).collect(), (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
        let projection = if item % 2 == 0 { LENS } else { PARALLEL };
        let camera = camera(DVec3::new(0.5, 0.2, 3.0), DVec3::ZERO, projection, [24, 20]);
        let image = seen(&heap, &camera);
        let mut met = 0;
        for (k, hit) in image.hits.iter().enumerate() {
            let x = (k % 24) as f64 + 0.5;
            let y = (k / 24) as f64 + 0.5;
            let (nearest, margin) = slow(&heap, ray(&camera, x, y));
            // Rounded corners decide within 1/4096 pixel of an edge.
            if margin < 1e-3 {
                continue;
            }
            assert_eq!((hit.triangle as usize), nearest.map_or(u32::MAX as usize, |(_, t, _)| t), "{item}: {x}, {y}");
            let Some((depth, _, at)) = nearest else { continue };
            met += 1;
            assert!((f64::from(image.depth[k]) / depth - 1.0).abs() < 1e-6, "{item}: {} not {depth}", image.depth[k]);
            let error = DVec3::new(
                1.0 - f64::from(hit.barycentric[0] + hit.barycentric[1]),
                hit.barycentric[0].into(),
                hit.barycentric[1].into(),
            ) - at;
            assert!(error.abs().max_element() < 1e-5, "{item}: {:?}, not {at}", hit.barycentric);
        }
        assert!(met > 50, "{item}: {met}");
    }
}

#[test]
fn attributes_are_those_of_the_place_and_depths_go_on_as_the_plane_does() {
    // Of the ground, which begins behind the eye: colour and normal grow with the place.
    let position = vec![Vec3::new(-9.0, 0.0, 9.0), Vec3::new(9.0, 0.0, 9.0), Vec3::new(0.0, 2.0, -30.0)];
    let tint = |p: Vec3| [0.5 + 0.05 * p.x, 0.3 + 0.01 * p.z, 0.2 + 0.1 * p.y];
    let color = position.iter().map(|p| tint(*p)).collect();
    let normal = vec![Vec3::Y, Vec3::X, Vec3::Z];
    let one = Mesh {
        origin: DVec3::new(100.0, 0.0, 0.0),
        position,
        normal,
        color,
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let transform =
        Similarity { scale: 2.0, rotation: DQuat::from_rotation_y(0.3), translation: DVec3::new(0.0, -1.0, 0.5) };
    let placed = [PlacedMesh { mesh: &one, transform }];
    let target = transform.apply(one.origin);
    for projection in [LENS, PARALLEL] {
        let camera = camera(target + DVec3::Y * 2.0, target + DVec3::new(0.0, 0.4, -4.0), projection, [32, 32]);
        let image = resolve(&placed, &camera, None).unwrap();
        let planes = resolve_depth(&placed, &camera, None).unwrap();
        assert_eq!(image.depth, planes.depth);
        let mut met = 0;
        for (k, hit) in image.hits.iter().enumerate().filter(|(_, hit)| **hit != TriangleHit::NONE) {
            let x = (k % 32) as f64 + 0.5;
            let y = (k / 32) as f64 + 0.5;
            let [from, along] = ray(&camera, x, y);
            let world = from + along * f64::from(image.depth[k]);
            let own = transform.rotation.inverse() * (world - transform.translation) / transform.scale - one.origin;
            let found = hit.color(&one).unwrap();
            let expected = tint(own.as_vec3());
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 1e-4), "{found:?}, not {expected:?}");
            let [b, c] = hit.barycentric;
            let expected = Vec3::new(b, 1.0 - b - c, c).normalize();
            assert!((hit.normal(&one) - expected).length() < 1e-5);
            assert!((hit.face(&one).dot(one.position[1] - one.position[0])).abs() < 1e-5);
            // Half a pixel beside it.
            let [from, along] = ray(&camera, x + 0.5, y - 0.4);
            let face = transform.rotation * hit.face(&one).as_dvec3();
            let depth = (world - from).dot(face) / along.dot(face);
            let found = f64::from(planes.at(k, [0.5, -0.4], camera.is_orthographic()));
            assert!((found / depth - 1.0).abs() < 1e-4, "{found}, not {depth}");
            met += 1;
        }
        assert!(met > 100, "{met}");
    }
}

#[test]
fn a_heap_far_away_and_by_any_number_of_threads_has_the_same_bits() {
    let net = net(20, 6.0, 0.8, DQuat::from_rotation_x(0.5));
    let images: Vec<TriangleImage> = [(0.0, 1), (0.0, 2), (0.0, 3), (16_777_216.0, 2)]
        .into_iter()
        .map(|(shift, threads)| {
            let net = Mesh { origin: DVec3::splat(shift), ..net.clone() };
            let camera = camera(DVec3::Z * 7.0 + shift, DVec3::splat(shift), LENS, [50, 50]);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| seen(&net, &camera))
        })
        .collect();
    assert!(images.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn of_surfaces_at_one_place_the_first_is_seen_and_what_is_behind_never() {
    let square = |z: f32| {
        let corner = |x: f32, y: f32| Vec3::new(x * 9.0, y * 9.0, z);
        mesh(vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)], vec![[0, 1, 2]])
    };
    let near = square(1.0);
    let far = square(0.0);
    let behind = square(9.0);
    let all = [&far, &behind, &near, &near].map(|mesh| PlacedMesh { mesh, transform: Similarity::default() });
    let camera = camera(DVec3::Z * 5.0, DVec3::ZERO, LENS, [8, 8]);
    let image = resolve(&all, &camera, None).unwrap();
    assert!(image.hits.iter().all(|hit| hit.mesh == 2), "{:?}", image.hits);
    assert!(image.depth.iter().all(|depth| (depth - 4.0).abs() < 1e-6));
}

#[test]
fn what_is_no_mesh_is_refused_and_what_has_no_area_is_not_seen() {
    let camera = camera(DVec3::Z * 5.0, DVec3::ZERO, LENS, [8, 8]);
    let wrong = mesh(vec![Vec3::ZERO], vec![[0, 0, 1]]);
    let found = resolve(&placed(&wrong), &camera, None).unwrap_err();
    assert!(matches!(found, Error::Invalid { element: "face", index: 0, .. }), "{found}");
    let wrong = mesh(vec![Vec3::NAN], Vec::new());
    assert!(resolve_depth(&placed(&wrong), &camera, None).is_err());
    for flat in [[Vec3::ZERO; 3], [Vec3::X, Vec3::ZERO, Vec3::NEG_X], [Vec3::Z * 5.0, Vec3::Z * 6.0, Vec3::ZERO]] {
        let image = seen(&mesh(flat.to_vec(), vec![[0, 1, 2]]), &camera);
        assert!(image.hits.iter().all(|hit| *hit == TriangleHit::NONE));
    }
    assert_eq!(resolve(&[], &camera, None).unwrap().depth, vec![f32::INFINITY; 64]);
    let stopped = Progress::new();
    stopped.cancel();
    assert_eq!(resolve(&placed(&room()), &camera, Some(&stopped)).unwrap_err(), Error::Cancelled);
}

#[test]
fn hv11_layers_are_what_each_triangle_shows_by_itself_nearest_first() {
    // A heap, some of it twice: equally near ones keep the order of the mesh.
    let corner = |k: u32| {
        let unit = |axis: u64| 5.0 * (rng::unit_f32(9, 1, u64::from(k), axis) - 0.5);
        Vec3::new(unit(0), unit(1), unit(2))
    };
    let mut triangles: Vec<[u32; 3]> = (0..40).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    triangles.extend_from_within(..10);
    let heap = mesh((0..120).map(corner).collect(), triangles);
    for projection in [LENS, PARALLEL] {
        let camera = camera(DVec3::new(0.3, 0.2, 7.0), DVec3::ZERO, projection, [37, 41]);
        let layers = |hidden: &[f32], most: u64| {
            let none = (f32::INFINITY, u32::MAX);
            let keep = |_: usize, at: &TriangleLayer| (at.depth, at.hit.triangle);
            resolve_layers(&placed(&heap), &camera, hidden, most, none, keep, None)
        };
        let all = layers(&[], u64::MAX).unwrap();
        let nearest = seen(&heap, &camera);
        let counts = coverage(&heap, &camera);
        let hidden: Vec<f32> = nearest.depth.iter().map(|depth| depth + 1.0).collect();
        let before = layers(&hidden, u64::MAX).unwrap();
        let mut most = 0;
        let mut sum = 0;
        for (k, count) in counts.iter().enumerate() {
            let own = all.at_pixel(k);
            assert_eq!(own.len() as u32, *count, "pixel {k}");
            assert!(own.windows(2).all(|w| w[0].0 < w[1].0 || (w[0].0 == w[1].0 && w[0].1 < w[1].1)), "{own:?}");
            assert_eq!(own.first().map_or(f32::INFINITY, |first| first.0), nearest.depth[k]);
            let expected: Vec<_> = own.iter().copied().filter(|layer| layer.0 < hidden[k]).collect();
            assert_eq!(before.at_pixel(k), expected, "pixel {k}");
            (most, sum) = (most.max(own.len()), sum + own.len());
        }
        assert!(most > 8 && sum > 2000, "{most} {sum}");
        assert_eq!(count_layers(&placed(&heap), &camera).unwrap(), sum as u64);
        // One byte less is refused before it is taken.
        assert!(layers(&[], 8 * sum as u64).is_ok());
        let Err(Error::Limit(said)) = layers(&[], 8 * sum as u64 - 1) else { panic!("not refused") };
        assert_eq!((said.needed, said.limit), (8 * sum as u64, Some(8 * sum as u64 - 1)));
    }
}
