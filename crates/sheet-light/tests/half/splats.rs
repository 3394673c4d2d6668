//! Splats in half-vector slabs: closed forms of what shadows what, and the limits of other ways to composite them.

use super::common::{draw, exact, input, lamp, scattering, sun};
use crate::common::{BEAUTY, constant, cubic, grid, largest, parallel, perspective, projected, volume, with_gaussians};
use sheet_light::half::{HalfInput, HalfParams, HalfSplats, fold};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::{self, FoldInput, OpaqueImage, Projected};
use splat_core::shade::LitBy;
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Footprint, FootprintStack, Material, Object, Shading, Splat, SplatKind, rng,
};
use std::f64::consts::PI;

/// Splats as sweeps take them.
pub(super) struct Shown {
    cloud: Cloud,
    projected: Projected,
    footprints: FootprintStack,
    materials: Vec<Material>,
    pub(super) objects: Vec<Object>,
    slab_width: f64,
}

impl Shown {
    pub(super) fn new(cloud: Cloud, camera: &Camera, materials: Vec<Material>, slab_width: f64) -> Self {
        let footprints = FootprintStack::default();
        let projected = projected(&cloud, camera, &materials);
        let objects = (0..4).map(|i| Object { name: i.to_string(), ..Object::default() }).collect();
        Self { cloud, projected, footprints, materials, objects, slab_width }
    }

    fn splats(&self) -> HalfSplats<'_> {
        let Self { cloud, projected, footprints, materials, objects, slab_width } = self;
        HalfSplats { cloud, materials, objects, footprints, projected, slab_width: *slab_width }
    }
}

/// Reflects all light alike to all sides, from both sides.
pub(super) fn lambert() -> Material {
    Material { ambient: 0.0, diffuse: 1.0, specular: 0.0, ..Material::default() }
}

/// Discs 1/8 apart that fill a square of the plane through `at` across `normal`, `half` to each side: τ for each crossing.
pub(super) fn plane(cloud: &mut Cloud, (at, normal): (DVec3, DVec3), half: f64, tau: f64, like: &Splat) {
    let step = 0.125;
    let (u, v) = normal.any_orthonormal_pair();
    let n = (half / step) as i32;
    for (i, j) in (-n..=n).flat_map(|i| (-n..=n).map(move |j| (i, j))) {
        let position = at + u * (step * f64::from(i)) + v * (step * f64::from(j));
        cloud.push(&Splat {
            position: position.as_vec3(),
            normal: normal.as_vec3(),
            radius: (step * f64::from(Footprint::SIGMA_OVER_SPACING * Footprint::default().cutoff)) as f32,
            cross_section: (tau * step * step) as f32,
            kind: SplatKind::Surface,
            ..*like
        });
    }
}

pub(super) fn with<'a>(shown: &'a Shown, input: HalfInput<'a>) -> HalfInput<'a> {
    HalfInput { splats: Some(shown.splats()), ..input }
}

/// Radiance of the middle pixel over its opacity.
fn middle(out: &Accumulator) -> f64 {
    let at = out.optical_depth[0].len() / 2 + out.size[0] as usize / 2;
    f64::from(out.channels[1][at]) / -(-f64::from(out.optical_depth[0][at])).exp_m1()
}

#[test]
fn a_plane_of_splats_does_not_shadow_itself_at_any_angle() {
    let camera = parallel([0.0, 0.0, 9.0], 1.0, [21, 21]);
    for degrees in [0.0f64, 20.0, 45.0, 65.0, 80.0] {
        for (sign, slab_width) in [1.0, -1.0].into_iter().flat_map(|s| [0.02, 0.1, 0.4].map(|w| (s, w))) {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let mut cloud = Cloud::new(DVec3::ZERO);
            plane(&mut cloud, (DVec3::ZERO, DVec3::Z), 3.0, 0.8, &Splat::default());
            let shown = Shown::new(cloud, &camera, vec![lambert()], slab_width);
            let lights = [sun([sin, 0.0, sign * cos])];
            let out = draw(&with(&shown, input(&[], &camera, &lights)), &exact(None)).unwrap().0;
            // Lit from behind, a surface that is turned to the eye shows nothing.
            let expected = if sign > 0.0 { cos / PI } else { 0.0 };
            let found = middle(&out);
            assert!(
                (found - expected).abs() < 2e-3,
                "{degrees}°, side {sign}, slabs {slab_width}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn a_translucent_plane_shadows_another_by_its_optical_depth() {
    // Seen from aside, so that only the receiver is in the picture.
    for (to_light, eye) in
        [([0.0, 0.0, 1.0], [9.0, 0.0, 5.0]), ([0.4, 0.3, 1.0], [9.0, 0.0, 5.0]), ([0.0, 0.2, 1.0], [9.0, 2.0, 9.0])]
    {
        let camera = parallel(eye, 0.5, [15, 15]);
        for tau in [0.1, 1.0, 3.0] {
            let mut cloud = Cloud::new(DVec3::ZERO);
            plane(&mut cloud, (DVec3::ZERO, DVec3::Z), 2.0, 0.5, &Splat::default());
            let above = DVec3::new(0.0, 0.0, 3.0);
            plane(&mut cloud, (above, DVec3::Z), 2.0, tau, &Splat { object: 1, ..Splat::default() });
            let mut shown = Shown::new(cloud, &camera, vec![lambert()], 0.1);
            let to_light = DVec3::from_array(to_light).normalize();
            let lights = [sun(to_light.to_array())];
            for casts in [true, false] {
                shown.objects[1].casts_shadow = casts;
                let out = draw(&with(&shown, input(&[], &camera, &lights)), &exact(None)).unwrap().0;
                let expected = to_light.z / PI * if casts { (-tau).exp() } else { 1.0 };
                let found = middle(&out);
                let whole = to_light.z / PI;
                assert!((found - expected).abs() < 1e-2 * whole, "τ {tau}, casts {casts}: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn volumes_shadow_splats_and_splats_shadow_volumes() {
    let camera = parallel([9.0, 0.0, 5.0], 0.4, [15, 15]);
    let tau = 1.0f64;
    let tf = constant(0.5);
    let material = scattering();
    let lights = [sun([0.0, 0.0, 1.0])];
    // Two thick, and so of τ 1, above a plane of splats.
    let above = grid([24, 24, 8], cubic(0.25), |_| 1.0);
    let mut raised = above.clone();
    raised.origin.z += 4.0;
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, (DVec3::ZERO, DVec3::Z), 2.0, 0.5, &Splat::default());
    let shown = Shown::new(cloud, &camera, vec![lambert()], 0.1);
    let volumes = [volume(&raised, &tf, &material)];
    for width in [0.05, 0.25, 1.0] {
        let out = draw(&with(&shown, input(&volumes, &camera, &lights)), &exact(Some(width))).unwrap().0;
        let expected = (-tau).exp() / PI;
        assert!((middle(&out) - expected).abs() < 2e-3 / PI, "slabs {width}: {} {expected}", middle(&out));
    }
    // The plane inside of the volume has what is above it, whatever slab it lies in.
    for depth in [-0.9, -0.33, 0.0, 0.71] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        let none = Splat { color: [0.0; 3], ..Splat::default() };
        plane(&mut cloud, (DVec3::new(0.0, 0.0, depth), DVec3::Z), 2.0, 1.5, &none);
        let along = parallel([0.0, 0.0, 9.0], 0.4, [15, 15]);
        let shown = Shown::new(cloud, &along, vec![lambert()], 0.1);
        let volumes = [volume(&above, &tf, &material)];
        for width in [0.01, 0.05] {
            let out = draw(&with(&shown, input(&volumes, &along, &lights)), &exact(Some(width))).unwrap().0;
            // Above the plane of τ 1.5 as without it, below it twice e^−1.5 as much.
            let front = 0.5 * (1.0 - depth);
            let below = (-2.0f64 * front).exp() - (-2.0f64).exp();
            let scattered = 0.5 * (-(-2.0 * front).exp_m1() + (-3.0f64).exp() * below);
            let at = 7 * 15 + 7;
            let found = 4.0 * PI * f64::from(out.channels[0][at]);
            assert!(
                (found - scattered).abs() < 0.6 * width,
                "plane at {depth}, slabs {width}: {found}, not {scattered}"
            );
            assert!((f64::from(out.optical_depth[0][at]) - 2.5).abs() < 2e-2);
        }
    }
}

#[test]
fn a_medium_of_splats_shadows_itself_as_the_closed_form_says() {
    let camera = parallel([0.0, 0.0, 9.0], 0.5, [15, 15]);
    let spacing = 0.125;
    let n = 16;
    for tau in [0.3, 1.0, 3.0] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for (i, (j, k)) in (-n..n).flat_map(|i| (-n..n).flat_map(move |j| (0..n).map(move |k| (i, (j, k))))) {
            let at = DVec3::new(f64::from(i), f64::from(j), f64::from(k)) * spacing;
            cloud.push(&Splat {
                position: at.as_vec3(),
                radius: (spacing * f64::from(Footprint::SIGMA_OVER_SPACING * Footprint::default().cutoff)) as f32,
                cross_section: (tau / f64::from(n) * spacing * spacing) as f32,
                kind: SplatKind::Medium,
                ..Splat::default()
            });
        }
        let shown = Shown::new(cloud, &camera, vec![scattering()], spacing);
        let along = -(-2.0f64 * tau).exp_m1() / 2.0;
        for (from, expected) in [([0.0, 0.0, 1.0], along), ([0.0, 0.0, -1.0], tau * (-tau).exp())] {
            let lights = [sun(from)];
            let out = draw(&with(&shown, input(&[], &camera, &lights)), &exact(None)).unwrap().0;
            let found = 4.0 * PI * middle(&out) * -(-tau).exp_m1();
            assert!((found - expected).abs() < 1e-2 * expected, "τ {tau} from {from:?}: {found}, not {expected}");
        }
    }
}

/// Discs and media of two objects and two materials.
fn some(count: u64, shading: Shading) -> (Cloud, Vec<Material>) {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..count {
        let at = |k: u64| (rng::unit(3, k, i, 0) - 0.5) as f32;
        cloud.push(&Splat {
            position: Vec3::new(3.0 * at(0), 3.0 * at(1), (i * 77 % count) as f32 / 64.0 - 2.0),
            normal: Vec3::new(at(3), at(4), 1.0).normalize(),
            radius: 0.2 + 0.2 * (at(5) + 0.5),
            color: [0.2, 0.5, 0.9].map(|c: f32| c + 0.2 * at(6)),
            cross_section: 0.05 * (at(6) + 0.6),
            kind: if i % 3 == 0 { SplatKind::Medium } else { SplatKind::Surface },
            material: (i % 2) as u16,
            object: (i % 2) as u32,
            ..Splat::default()
        });
    }
    let one = Material { shading, ..Material::default() };
    (cloud, vec![one, Material { extinction_rgb: [1.0, 0.6, 0.3], ..one }])
}

#[test]
fn a_slab_for_each_splat_is_the_order_of_splats() {
    let size = [100, 70];
    for camera in [parallel([0.0, 0.0, 9.0], 4.0, size), perspective([0.0, 0.0, 6.0], 40.0, size)] {
        let (cloud, materials) = some(256, Shading::Unlit);
        let shown = Shown::new(with_gaussians(cloud), &camera, materials, 1.0 / 128.0);
        let opaque: Vec<f32> = (0..7000).map(|i| if i % 100 < 40 { 6.0 } else { f32::INFINITY }).collect();
        let hidden = OpaqueImage { depth: opaque.clone(), ..OpaqueImage::default() };
        for planes in [1, 3] {
            let mut expected = Accumulator::new(size, planes, 3, true, true);
            let params = raster::Params { transmittance_cutoff: 0.0, ..raster::Params::default() };
            let place = camera.view_from_offset(shown.cloud.origin);
            let mut order: Vec<u32> = (0..256).collect();
            order.sort_by(|a, b| {
                let [a, b] = [a, b].map(|i| place.depth(shown.cloud.position[*i as usize]));
                a.total_cmp(&b)
            });
            let values: Vec<f32> = (0..256).flat_map(|i| shown.cloud.color_along(i, Vec3::Z)).collect();
            let fold_input = FoldInput {
                projected: &shown.projected,
                order: &order,
                values: &values,
                materials: &shown.materials,
                opaque: &hidden,
                direction: Direction::FrontToBack,
                params: &params,
            };
            raster::fold(&fold_input, &mut expected, None).unwrap();
            let mut found = Accumulator::new(size, planes, 3, true, true);
            let input = HalfInput { opaque: &opaque, ..with(&shown, input(&[], &camera, &[])) };
            fold(&input, &exact(None), &BEAUTY, &mut found, None).unwrap();
            assert!(crate::common::apart(&found, &expected) < 3e-6, "{:e}", crate::common::apart(&found, &expected));
            (0..planes).for_each(|p| assert!(largest(&found.optical_depth[p], &expected.optical_depth[p]) < 3e-6));
            assert_eq!(found.object, expected.object);
        }
    }
}

#[test]
fn hv17_alpha_and_depths_know_no_order_of_sweeps_or_slicing() {
    let camera = perspective([0.3, 0.2, 6.0], 40.0, [130, 90]);
    let (cloud, materials) = some(256, Shading::Phong);
    let shown = Shown::new(cloud, &camera, materials, 1.0 / 128.0);
    let before = [sun([0.2, 0.1, 1.0]), lamp([2.0, 3.0, 9.0])];
    let behind = [sun([0.2, 0.1, -1.0])];
    let one = draw(&with(&shown, input(&[], &camera, &before)), &exact(None)).unwrap().0;
    let other = draw(&with(&shown, input(&[], &camera, &behind)), &exact(None)).unwrap().0;
    assert!(largest(&one.optical_depth[0], &other.optical_depth[0]) < 2e-6);
    let near = |out: &Accumulator| {
        out.depth.iter().zip(&out.optical_depth[0]).map(|(d, tau)| d.depths(*tau, None)[2]).collect::<Vec<f32>>()
    };
    assert!(one.channels[0].iter().chain(&other.channels[0]).any(|c| *c > 0.05));
    assert!(near(&one).iter().zip(near(&other)).filter(|(a, b)| (*a - b).abs() > 0.05).count() < near(&one).len() / 50);
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let again = pool.install(|| draw(&with(&shown, input(&[], &camera, &before)), &exact(None)).unwrap().0);
        assert_eq!(again, one, "{threads} threads");
    }
    let swapped = [before[1], before[0]];
    assert_eq!(draw(&with(&shown, input(&[], &camera, &swapped)), &exact(None)).unwrap().0, one);
}

#[test]
fn splats_that_sweeps_cannot_take_are_refused() {
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [16, 16]);
    let shown = |kind: SplatKind, slab_width: f64| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { kind, radius: 0.1, cross_section: 0.1, ..Splat::default() });
        Shown::new(cloud, &camera, vec![lambert()], slab_width)
    };
    let lights: [LitBy<'_>; 1] = [sun([0.0, 0.0, 1.0])];
    let refused = |scene: &Shown, params: &HalfParams| {
        draw(&with(scene, input(&[], &camera, &lights)), params).err().unwrap().to_string()
    };
    let opaque = refused(&shown(SplatKind::Opaque, 1.0), &exact(None));
    assert!(opaque.contains("splat 0 is opaque"), "{opaque}");
    for width in [0.0, f64::NAN, f64::INFINITY] {
        assert!(refused(&shown(SplatKind::Surface, width), &exact(None)).contains("splats.slab_width"));
    }
    let lamp = lamp([0.05, 0.0, 0.0]);
    let mut cloud = Cloud::new(DVec3::ZERO);
    for x in [-1.0, 1.0] {
        cloud.push(&Splat { position: Vec3::splat(x), kind: SplatKind::Surface, ..Splat::default() });
    }
    let pair = Shown::new(cloud, &camera, vec![lambert()], 1.0);
    let among = draw(&with(&pair, input(&[], &camera, &[lamp])), &exact(None)).err().unwrap().to_string();
    assert!(among.contains("lies among the splats"), "{among}");
}

#[test]
fn an_edge_of_translucent_discs_is_as_wide_as_their_kernels() {
    let camera = parallel([0.0, 0.0, 9.0], 0.02, [120, 2]);
    let step = 0.125;
    let tau = 0.7;
    let pixel = 0.01;
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, (DVec3::new(-1.0, 0.0, 0.0), DVec3::Z), 1.0, tau, &Splat::default());
    let shown = Shown::new(cloud, &camera, vec![lambert()], 0.1);
    let out = draw(&with(&shown, input(&[], &camera, &[])), &exact(None)).unwrap().0;
    let row = &out.optical_depth[0][..120];
    // The outermost discs stand for half a step on either side of their centres, which lie at 0: a triangle would end there.
    for (share, expected) in [(0.9, -0.31), (0.5, 0.5), (0.1, 1.31)] {
        let k = row.iter().position(|t| f64::from(*t) < share * tau).unwrap();
        let [one, other] = [k - 1, k].map(|k| f64::from(row[k]) / tau);
        let at = (k as f64 - 0.5 + (one - share) / (one - other) - 60.0) * pixel / step;
        assert!((at - expected).abs() < 0.01, "{share} of τ is {at} steps from the centres");
    }
}
