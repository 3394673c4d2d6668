//! Meshes become splats: hard cases CV1-CV6, CV10, weights, conserved areas, invariances.

use convert::{
    ConvertError, Density, MeshParams, SplatParams, SurfaceColors, mesh_to_points, painted_mesh_to_points, reference,
};
use splat_core::glam::{DQuat, DVec3, Vec2, Vec3};
use splat_core::{Cloud, Footprint, Limits, Mesh, Similarity, SplatKind, optics, rng};

fn quad(side: f32) -> Mesh {
    let p = |x, z| Vec3::new(x, 0.0, z);
    Mesh {
        position: vec![p(0.0, 0.0), p(side, 0.0), p(side, side), p(0.0, side)],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        ..Mesh::default()
    }
}

fn params(spacing: f64, opacity: f64) -> MeshParams {
    MeshParams { density: Density::Spacing(spacing), opacity, ..MeshParams::default() }
}

/// A sphere of unit radius, latitude and longitude.
fn sphere(rows: u32) -> Mesh {
    let columns = 2 * rows;
    let mut mesh = Mesh::default();
    for r in 0..=rows {
        for c in 0..columns {
            let theta = f64::from(r) / f64::from(rows);
            let phi = 2.0 * f64::from(c) / f64::from(columns);
            let theta = theta * std::f64::consts::PI;
            let phi = phi * std::f64::consts::PI;
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
            mesh.position.push(p.as_vec3());
        }
    }
    let id = |r: u32, c: u32| r * columns + c % columns;
    for (r, c) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        mesh.triangles.push([id(r, c), id(r + 1, c), id(r + 1, c + 1)]);
        mesh.triangles.push([id(r, c), id(r + 1, c + 1), id(r, c + 1)]);
    }
    mesh
}

/// Mean and largest deviation from 1 of τ/τ₁ over a 64 x 64 sweep of the interior.
fn coverage(cloud: &Cloud, tau: f64, side: f64) -> (f64, f64) {
    let mut mean = 0.0;
    let mut ripple = 0.0f64;
    for i in 0..4096 {
        let at = |n: u32| side * (0.35 + 0.3 * (f64::from(n) + 0.5) / 64.0);
        let p = DVec3::new(at(i % 64), 0.0, at(i / 64));
        let weight = reference::layer_depth(cloud, Footprint::default(), p, DVec3::Y) / tau;
        mean += weight / 4096.0;
        ripple = ripple.max((weight - 1.0).abs());
    }
    (mean, ripple)
}

#[test]
fn cv01_zero_area_triangles_become_nothing() {
    let mut mesh = quad(1.0);
    let n = mesh.position.len() as u32;
    mesh.position.extend([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]);
    mesh.triangles.extend([[0, 0, 1], [n, n + 1, n + 2], [2, 2, 2]]);
    let (cloud, report) = mesh_to_points(&mesh, &params(0.1, 0.5), None).unwrap();
    assert_eq!(report.degenerate, 3);
    cloud.validate().unwrap();
    assert_eq!(cloud.len(), mesh_to_points(&quad(1.0), &params(0.1, 0.5), None).unwrap().0.len());
    let only = Mesh { triangles: vec![[0, 0, 1]], ..mesh };
    assert_eq!(mesh_to_points(&only, &MeshParams::default(), None).unwrap().0.len(), 0);
}

#[test]
fn cv02_slivers_keep_their_area() {
    let mesh = Mesh {
        position: vec![Vec3::ZERO, Vec3::new(1e-4, 0.0, 0.0), Vec3::new(5e-5, 1.0, 0.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let (cloud, report) = mesh_to_points(&mesh, &params(0.05, 1.0), None).unwrap();
    let exact = 0.5 * f64::from(1e-4_f32);
    assert!((report.area / exact - 1.0).abs() < 1e-6, "{}", report.area);
    let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    assert!((sum / exact - 1.0).abs() < 1e-6);
    // The needle is cut along its length, so no splat stands for matter that is far away.
    assert!(cloud.len() >= 20 && cloud.len() <= 60, "{}", cloud.len());
}

#[test]
fn cv03_a_mesh_far_away_gives_the_same_offsets() {
    let mut mesh = quad(0.5);
    let (near, _) = mesh_to_points(&mesh, &params(0.01, 0.5), None).unwrap();
    mesh.origin = DVec3::splat(1e7);
    let (mut far, report) = mesh_to_points(&mesh, &params(0.01, 0.5), None).unwrap();
    assert_eq!(far.origin, DVec3::splat(1e7));
    assert!((report.area - 0.25).abs() < 1e-12);
    far.origin = DVec3::ZERO;
    assert_eq!(far, near);
}

#[test]
fn cv04_small_triangles_keep_their_share_among_many() {
    // Areas from 1 down to 2^-40 of the largest: each gets K in proportion, none is lost in a sum.
    let mut mesh = Mesh::default();
    for i in 0..21u32 {
        let s = 0.5f32.powi(i as i32);
        let n = mesh.position.len() as u32;
        mesh.position.extend([Vec3::ZERO, Vec3::X * s, Vec3::Z * s].map(|p| p + Vec3::Y * i as f32));
        mesh.triangles.push([n, n + 2, n + 1]);
    }
    let (cloud, _) = mesh_to_points(&mesh, &params(0.03, 1.0), None).unwrap();
    for i in 0..21u32 {
        let of_triangle = |j: &usize| cloud.position[*j].y == i as f32;
        let sum: f64 = (0..cloud.len()).filter(of_triangle).map(|j| f64::from(cloud.cross_section[j])).sum();
        assert!((sum / (0.5 * 0.25f64.powi(i as i32)) - 1.0).abs() < 1e-6, "triangle {i}: {sum}");
    }
}

#[test]
fn cv05_transmittance_does_not_depend_on_the_number_of_pieces() {
    let tau = optics::optical_depth(0.9);
    let footprint = Footprint::default();
    for (spacing, splats) in [(1.0 / 16.0, 288), (1.0 / 45.0, 2048), (1.0 / 64.0, 4232)] {
        let (cloud, report) = mesh_to_points(&quad(1.0), &params(spacing, 0.9), None).unwrap();
        assert!(report.splats.abs_diff(splats) < splats / 2, "{}", report.splats);
        let (mean, ripple) = coverage(&cloud, tau, 1.0);
        assert!((mean - 1.0).abs() < 1e-3, "spacing {spacing}: mean {mean}");
        assert!(ripple < 1e-2, "spacing {spacing}: ripple {ripple}");
    }
    // From one piece a triangle on, whatever is seen of the rims: the cross-sections of the pieces sum to τ times the area.
    let mut fewest = usize::MAX;
    for spacing in (0..8).map(|k| 2f64.powi(2 - k)) {
        let (cloud, _) = mesh_to_points(&quad(1.0), &params(spacing, 0.9), None).unwrap();
        let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
        assert!((sum / tau - 1.0).abs() < 1e-6, "spacing {spacing}: {sum}");
        fewest = fewest.min(cloud.len());
    }
    assert_eq!(fewest, 2);
    // Far finer than the kernels: the sum is the integral.
    let (mut cloud, report) = mesh_to_points(&quad(1.0), &params(1.0 / 64.0, 0.9), None).unwrap();
    cloud.radius.fill(4.0 * report.radius as f32);
    let depth = reference::layer_depth(&cloud, footprint, DVec3::new(0.5, 0.0, 0.5), DVec3::Y);
    assert!((depth / tau - 1.0).abs() < 1e-4, "{depth}");
}

#[test]
fn cv06_tiny_opacities_keep_their_ratio() {
    for alpha in [1e-6, 1e-12] {
        let (cloud, report) = mesh_to_points(&quad(1.0), &params(0.1, alpha), None).unwrap();
        let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
        assert!((sum / report.area / alpha - 1.0).abs() < 1e-5);
    }
}

#[test]
fn cv10_absurd_spacings_are_refused_by_name() {
    let with = |density, max_splats| MeshParams {
        splat: SplatParams {
            object_name: "bunny".into(),
            limits: Limits::elements(max_splats),
            ..SplatParams::default()
        },
        density,
        opacity: 1.0,
    };
    let error = mesh_to_points(&quad(1.0), &with(Density::Spacing(1e-9), 1000), None).unwrap_err();
    assert!(matches!(error, ConvertError::Limit(_)));
    assert!(error.to_string().contains("bunny") && error.to_string().contains("1.000e18"), "{error}");
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        let error = mesh_to_points(&quad(1.0), &with(Density::Spacing(spacing), 1000), None).unwrap_err();
        assert!(matches!(error, ConvertError::Parameter { parameter: "spacing", .. }), "{error}");
    }
    // A needle of no area to speak of whose strips alone would exceed the budget.
    let needle = Mesh {
        position: vec![Vec3::ZERO, Vec3::X * 1e6, Vec3::new(5e5, 1e-3, 0.0)],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    assert!(matches!(
        mesh_to_points(&needle, &with(Density::Spacing(1e-4), 1 << 20), None),
        Err(ConvertError::Limit(_))
    ));
    let (cloud, _) = mesh_to_points(&quad(1.0), &with(Density::Splats(u64::MAX), 100_000), None).map_or_else(
        |e| {
            assert!(matches!(e, ConvertError::Limit(_) | ConvertError::Parameter { .. }));
            (Cloud::default(), 0)
        },
        |r| (r.0, 1),
    );
    assert!(cloud.is_empty());
}

#[test]
fn slivers_cover_a_plane_as_evenly_as_squares() {
    // A fan of long thin triangles tiles the square: a vertex in one corner, 40 pieces of the far sides.
    let mut mesh = Mesh { position: vec![Vec3::ZERO], ..Mesh::default() };
    for i in 0..=40u32 {
        let t = i as f32 / 20.0;
        mesh.position.push(if i <= 20 { Vec3::new(1.0, 0.0, t) } else { Vec3::new(2.0 - t, 0.0, 1.0) });
    }
    mesh.triangles = (1..=40).map(|i| [0, i + 1, i]).collect();
    let tau = optics::optical_depth(0.5);
    let (cloud, report) = mesh_to_points(&mesh, &params(1.0 / 40.0, 0.5), None).unwrap();
    let (mean, ripple) = coverage(&cloud, tau, 1.0);
    assert!((mean - 1.0).abs() < 1e-3 && ripple < 0.02, "mean {mean} ripple {ripple}");
    assert!(report.splats < 3 * 1600, "{}", report.splats);
}

#[test]
fn computed_normals_of_a_sphere_point_outwards() {
    let (cloud, report) = mesh_to_points(&sphere(24), &params(0.05, 1.0), None).unwrap();
    assert!(report.normals_computed);
    assert!((report.area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{}", report.area);
    for i in 0..cloud.len() {
        let cos = cloud.normal[i].dot(cloud.position[i].normalize());
        // At the poles each vertex belongs to one triangle, so its normal is the triangle's.
        let polar = cloud.position[i].y.abs() > 0.97;
        assert!(cos > if polar { 0.997 } else { 0.9999 }, "{cos} at {}", cloud.position[i]);
    }
    assert!(cloud.kind.iter().all(|k| *k == SplatKind::Opaque));
}

#[test]
fn a_sphere_is_covered_once_by_its_own_splats() {
    let tau = optics::optical_depth(0.3);
    let (cloud, _) = mesh_to_points(&sphere(64), &params(0.025, 0.3), None).unwrap();
    let mut mean = 0.0;
    for i in 0..400u64 {
        let u = |k| 2.0 * rng::unit(5, 0, i, k) - 1.0;
        let n = DVec3::new(u(0), u(1), u(2)).normalize();
        mean += reference::layer_depth(&cloud, Footprint::default(), n, n) / tau / 400.0;
    }
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
}

#[test]
fn colours_and_given_normals_are_interpolated() {
    let mut mesh = quad(1.0);
    // All of one length, so that their sums lean as the place does.
    let leaning = |p: Vec3| Vec3::new(p.x - 0.5, 1.0, p.z - 0.5).normalize();
    mesh.normal = mesh.position.iter().map(|p| leaning(*p)).collect();
    mesh.color = mesh.position.iter().map(|p| [p.x, p.z, 0.25]).collect();
    let (cloud, report) = mesh_to_points(&mesh, &params(0.1, 1.0), None).unwrap();
    assert!(!report.normals_computed);
    for i in 0..cloud.len() {
        let p = cloud.position[i];
        let expected = [p.x, p.z, 0.25];
        assert!(cloud.color[i].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!(cloud.shading_normal_of(i).distance(leaning(p)) < 1e-6, "at {p}");
    }
}

#[test]
fn a_transform_moves_scales_and_turns() {
    let mut params = params(0.2, 0.5);
    params.splat.transform = Similarity {
        scale: 2.0,
        rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
        translation: DVec3::new(10.0, 20.0, 30.0),
    };
    let (cloud, report) = mesh_to_points(&quad(1.0), &params, None).unwrap();
    assert!((report.area - 4.0).abs() < 1e-12);
    assert_eq!(cloud.origin, DVec3::new(10.0, 20.0, 30.0));
    assert!(cloud.normal.iter().all(|n| (*n - Vec3::NEG_X).length() < 1e-6));
    assert!(cloud.position.iter().all(|p| p.x.abs() < 1e-6 && p.y > 0.0 && p.y < 2.0));
    assert_eq!(cloud.len(), mesh_to_points(&quad(1.0), &self::params(0.1, 0.5), None).unwrap().0.len());
}

#[test]
fn x3_scaling_by_a_power_of_two_scales_every_number() {
    let mesh = sphere(12);
    let (one, _) = mesh_to_points(&mesh, &MeshParams::default(), None).unwrap();
    let big = Mesh { position: mesh.position.iter().map(|p| *p * 1024.0).collect(), ..mesh };
    let (two, _) = mesh_to_points(&big, &MeshParams::default(), None).unwrap();
    assert_eq!(one.len(), two.len());
    for i in 0..one.len() {
        assert_eq!(one.position[i] * 1024.0, two.position[i]);
        assert_eq!(one.radius[i] * 1024.0, two.radius[i]);
        assert_eq!(one.cross_section[i] * 1024.0 * 1024.0, two.cross_section[i]);
        assert_eq!(one.normal[i], two.normal[i]);
    }
}

#[test]
fn x1_any_number_of_threads_gives_the_same_bits() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh_to_points(&sphere(20), &params(0.007, 0.4), None).unwrap().0)
    };
    let one = run(1);
    assert!(one.len() > 100_000);
    for threads in [2, 3, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

#[test]
fn a_number_of_splats_is_met() {
    for count in [2_000u64, 30_000, 400_000] {
        let params = MeshParams { density: Density::Splats(count), ..MeshParams::default() };
        let splats = mesh_to_points(&sphere(16), &params, None).unwrap().1.splats as f64;
        assert!((splats / count as f64 - 1.0).abs() < 0.25, "{splats} of {count}");
    }
}

#[test]
fn memory_is_used_again() {
    let mut cloud = Cloud::default();
    let fine = params(0.01, 0.5);
    convert::mesh_to_points_into(&quad(1.0), &fine, &mut cloud, None).unwrap();
    let place = cloud.position.as_ptr();
    convert::mesh_to_points_into(&quad(1.0), &params(0.02, 1.0), &mut cloud, None).unwrap();
    convert::mesh_to_points_into(&quad(1.0), &fine, &mut cloud, None).unwrap();
    assert_eq!(cloud.position.as_ptr(), place);
    assert_eq!(cloud, mesh_to_points(&quad(1.0), &fine, None).unwrap().0);
}

#[test]
fn discs_of_coarse_triangles_lie_in_their_planes() {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z];
    let octant = |a: u32, b: u32, c: u32, outwards: bool| if outwards { [a, b, c] } else { [a, c, b] };
    let signs = (0..8u32).map(|k| octant(k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2), k.count_ones() % 2 == 0));
    let mut mesh = Mesh { position: vec![x, -x, y, -y, z, -z], triangles: signs.collect(), ..Mesh::default() };
    mesh.normal = mesh.position.clone();
    let (cloud, _) = mesh_to_points(&mesh, &params(0.1, 1.0), None).unwrap();
    cloud.validate().unwrap();
    assert!(cloud.tangent.is_empty(), "a closed surface has no border");
    for (i, p) in cloud.position.iter().enumerate() {
        let plane = p.signum() / 3f32.sqrt();
        assert!(cloud.normal[i].distance(plane) < 1e-6, "{} at {p}", cloud.normal[i]);
        assert!(cloud.shading_normal_of(i).distance(p.normalize()) < 1e-6, "{} at {p}", cloud.shading_normal[i]);
    }
    // Triangles of one splat each stand for a surface that is as fine as they are.
    let fine = mesh_to_points(&mesh, &params(2.0, 1.0), None).unwrap().0;
    assert!(fine.shading_normal.is_empty() && fine.normal[0].distance(fine.position[0].normalize()) < 1e-6);
}

#[test]
fn opacities_of_vertices_are_those_of_pieces_and_opaque_ones_are_opaque() {
    // From 0 on the left to 1.5 on the right, cut at 1: opaque from two thirds on.
    let place = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let position = [0.0, 2.0, 3.0].into_iter().flat_map(|x| [place(x, 0.0), place(x, 1.0)]).collect();
    let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    let mesh = Mesh { position, triangles, opacity: vec![0.0, 0.0, 1.0, 1.0, 1.0, 1.0], ..Mesh::default() };
    for alpha in [1.0, 0.5] {
        let params = MeshParams { density: Density::Spacing(0.02), opacity: alpha, ..MeshParams::default() };
        let (cloud, report) = mesh_to_points(&mesh, &params, None).unwrap();
        cloud.validate().unwrap();
        assert_eq!(cloud.len() as u64, report.splats);
        for i in 0..cloud.len() {
            let x = f64::from(cloud.position[i].x);
            let is_opaque = alpha == 1.0 && x > 2.0;
            assert_eq!(cloud.kind[i], if is_opaque { SplatKind::Opaque } else { SplatKind::Surface });
            let opacity = alpha * (0.5 * x).min(1.0);
            let found = if is_opaque { 1.0 } else { 1.0 - (-f64::from(cloud.crossing_depth[i])).exp() };
            assert!((found - opacity).abs() < 1e-5, "{x}: {found} {opacity}");
        }
        // Of the ramp the integral of −ln(1 − α·x/2): 2 for α = 1, and 2 − 2·ln 2 for one half.
        let ramp = |i: &usize| cloud.position[*i].x < 2.0;
        let sum: f64 = (0..cloud.len()).filter(ramp).map(|i| f64::from(cloud.cross_section[i])).sum();
        let expected = if alpha == 1.0 { 2.0 } else { 2.0 - 2.0 * 2.0f64.ln() };
        assert!((sum - expected).abs() < 0.02, "{sum} {expected}");
    }
}

/// The colours of a mesh's vertices, as if they lay between them.
struct OfVertices<'a>(&'a Mesh);

impl SurfaceColors for OfVertices<'_> {
    fn fill(&self, triangle: usize, share: f64, weights: &mut dyn Iterator<Item = Vec2>, colors: &mut [[f32; 3]]) {
        assert!(share > 0.0 && share <= 1.0);
        let corners = self.0.triangles[triangle].map(|v| Vec3::from(self.0.color[v as usize]));
        for (color, w) in colors.iter_mut().zip(weights) {
            let between = corners[0] + (corners[1] - corners[0]) * w.x + (corners[2] - corners[0]) * w.y;
            *color = between.to_array();
        }
    }
}

#[test]
fn colours_between_vertices_are_asked_at_every_splat() {
    // Congruent pieces in a table and beyond it, strips of a sliver, and one piece a triangle.
    let mut mesh = quad(1.0);
    let first = mesh.position.len() as u32;
    mesh.position.extend([Vec3::new(0.0, 1.0, 0.0), Vec3::new(4.0, 1.0, 0.0), Vec3::new(1.0, 1.0, 0.1)]);
    mesh.triangles.push([first, first + 1, first + 2]);
    mesh.color = (0..7).map(|k| [0.1 * k as f32, 1.0 - 0.1 * k as f32, (k % 2) as f32]).collect();
    for spacing in [0.01, 0.05, 3.0] {
        let (expected, report) = mesh_to_points(&mesh, &params(spacing, 1.0), None).unwrap();
        let bare = Mesh { color: Vec::new(), ..mesh.clone() };
        let (found, same) = painted_mesh_to_points(&bare, &OfVertices(&mesh), &params(spacing, 1.0), None).unwrap();
        assert_eq!((found.position, report), (expected.position, same));
        let far = |(a, b): (&[f32; 3], &[f32; 3])| Vec3::from(*a).distance(Vec3::from(*b));
        let worst = found.color.iter().zip(&expected.color).map(far).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{spacing}: {worst}");
    }
}
