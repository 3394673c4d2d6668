//! Splats in sheets, beside volumes and alone.

use crate::common::{
    apart, constant, cubic, exact, grid, largest, parallel, perspective, projected, unlit, volume, with_gaussians,
};
use sheet_light::{Params, SheetInput, Splats, prepare};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::{self, FoldInput, OpaqueImage, Projected};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, Cloud, Direction, LayerSet, Material, Splat, SplatKind, rng};

const EVERYWHERE: std::ops::Range<f32> = f32::NEG_INFINITY..f32::INFINITY;
const LAYERS: LayerSet = LayerSet { effects: false, shadow: false, normal: false, depth: true, object: true };

/// Splats as sheets take them.
pub(crate) struct Shown {
    cloud: Cloud,
    projected: Projected,
    depths: Vec<f32>,
    order: Vec<u32>,
    values: Vec<f32>,
    materials: Vec<Material>,
}

impl Shown {
    pub(crate) fn new(cloud: Cloud, camera: &Camera, materials: Vec<Material>) -> Self {
        let projected = projected(&cloud, camera, &materials);
        let place = camera.view_from_offset(cloud.origin);
        let depths: Vec<f32> = cloud.position.iter().map(|p| place.depth(*p)).collect();
        let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
        order.sort_by(|a, b| depths[*a as usize].total_cmp(&depths[*b as usize]));
        let values = (0..3 * cloud.len() as u64).map(|i| rng::unit(5, 1, i, 0) as f32).collect();
        Self { cloud, projected, depths, order, values, materials }
    }

    pub(crate) fn splats(&self, slab_width: f64) -> Splats<'_> {
        let Self { projected, depths, order, values, materials, .. } = self;
        Splats { projected, depths: depths.clone(), order: order.clone(), values, materials, slab_width }
    }
}

/// Discs and media of two objects, 1/64 apart along z.
fn some(count: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..count {
        let at = |k: u64| (rng::unit(3, k, i, 0) - 0.5) as f32;
        let medium = i % 3 == 0;
        cloud.push(&Splat {
            position: Vec3::new(3.0 * at(0), 3.0 * at(1), (i * 77 % count) as f32 / 64.0 - 2.0),
            normal: Vec3::new(at(3), at(4), 1.0).normalize(),
            radius: 0.2 + 0.2 * (at(5) + 0.5),
            cross_section: 0.05 * (at(6) + 0.6),
            kind: if medium { SplatKind::Medium } else { SplatKind::Surface },
            material: (i % 2) as u16,
            object: (i % 2) as u32,
            ..Splat::default()
        });
    }
    cloud
}

fn sheets(input: &SheetInput<'_>, opaque: &[f32], ranges: &[f32], planes: usize) -> Accumulator {
    let mut out = Accumulator::new(input.camera.size, planes, 3, true, true);
    let sheeted = prepare(input.clone(), &exact(), None).unwrap();
    let ends: Vec<f32> = [EVERYWHERE.start].iter().chain(ranges).chain(&[EVERYWHERE.end]).copied().collect();
    for range in ends.windows(2) {
        sheeted.fold(range[0]..range[1], opaque, &ChannelLayout::new(&LAYERS), &mut out, None).unwrap();
    }
    out
}

pub(crate) fn alone<'a>(splats: Splats<'a>, camera: &'a Camera) -> SheetInput<'a> {
    SheetInput {
        volumes: Vec::new(),
        splats: Some(splats),
        camera,
        lights: Vec::new(),
        shadow_origin: DVec3::ZERO,
        ambient: [0.0; 3],
    }
}

fn materials() -> Vec<Material> {
    vec![Material::default(), Material { extinction_rgb: [1.0, 0.6, 0.3], ..Material::default() }]
}

#[test]
fn a_slab_for_each_splat_is_the_order_of_splats() {
    let size = [100, 70];
    for camera in [parallel([0.0, 0.0, 9.0], 4.0, size), perspective([0.0, 0.0, 6.0], 40.0, size)] {
        let shown = Shown::new(with_gaussians(some(256)), &camera, materials());
        let opaque: Vec<f32> = (0..7000).map(|i| if i % 100 < 40 { 6.0 } else { f32::INFINITY }).collect();
        for planes in [1, 3] {
            let hidden = OpaqueImage { depth: opaque.clone(), ..OpaqueImage::default() };
            let mut expected = Accumulator::new(size, planes, 3, true, true);
            let params = raster::Params { transmittance_cutoff: 0.0, ..raster::Params::default() };
            let input = FoldInput {
                projected: &shown.projected,
                order: &shown.order,
                values: &shown.values,
                materials: &shown.materials,
                opaque: &hidden,
                direction: Direction::FrontToBack,
                params: &params,
            };
            raster::fold(&input, &mut expected, None).unwrap();
            let found = sheets(&alone(shown.splats(1.0 / 128.0), &camera), &opaque, &[], planes);
            assert!(apart(&found, &expected) < 3e-6, "{planes} planes: {:e}", apart(&found, &expected));
            assert!(expected.optical_depth[0].iter().any(|tau| *tau > 0.5));
            for p in 0..planes {
                assert!(largest(&found.optical_depth[p], &expected.optical_depth[p]) < 3e-6);
            }
            assert_eq!(found.object, expected.object);
            let parts = sheets(&alone(shown.splats(1.0 / 128.0), &camera), &opaque, &[5.5, 6.1, 8.0], planes);
            assert!(apart(&parts, &found) < 3e-6, "{planes} planes in ranges: {:e}", apart(&parts, &found));
        }
    }
}

#[test]
fn within_a_slab_extinctions_add_and_colours_weigh() {
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [64, 64]);
    let mut cloud = Cloud::new(DVec3::ZERO);
    for (z, object) in [(0.1, 1), (-0.1, 2)] {
        let position = Vec3::new(0.0, 0.0, z);
        let kind = SplatKind::Surface;
        let radius = 0.5;
        let normal = Vec3::Z;
        cloud.push(&Splat {
            position,
            kind,
            radius,
            normal,
            object,
            cross_section: 0.3 * object as f32,
            ..Splat::default()
        });
    }
    let shown = Shown::new(cloud, &camera, materials());
    let found = sheets(&alone(shown.splats(4.0), &camera), &[], &[], 1);
    let tau = found.optical_depth[0][32 * 64 + 32];
    let colors = [0, 1, 2].map(|c| found.channels[c][32 * 64 + 32]);
    assert!(tau > 0.3);
    for c in 0..3 {
        // One of three parts, two of three parts.
        let mean = (shown.values[c] + 2.0 * shown.values[3 + c]) / 3.0;
        assert!((colors[c] / (1.0 - (-tau).exp()) - mean).abs() < 1e-5, "{c}: {colors:?}");
    }
    assert_eq!(found.object[32 * 64 + 32], 1);
    assert_eq!(shown.cloud.len(), 2);
}

#[test]
fn a_volume_and_splats_in_it_share_its_slabs() {
    let camera = parallel([0.0, 0.0, 9.0], 1.5, [60, 60]);
    let tf = constant(0.25);
    let material = unlit();
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let shown = Shown::new(some(256), &camera, materials());
    let both = SheetInput { volumes: volumes.to_vec(), ..alone(shown.splats(1.0), &camera) };
    let found = sheets(&both, &[], &[], 1);
    let splats = sheets(&alone(shown.splats(0.5), &camera), &[], &[], 1);
    let whole = found.optical_depth[0].iter().zip(&splats.optical_depth[0]).map(|(both, own)| both - own);
    // Six units of extinction 0.25, whatever else is in them.
    assert!(whole.clone().all(|tau| (tau - 1.5).abs() < 1e-5), "{:?}", whole.reduce(f32::max));
    let parts = sheets(&both, &[], &[7.3, 8.1, 9.6], 1);
    assert!(largest(&parts.optical_depth[0], &found.optical_depth[0]) < 2e-6);
}

#[test]
fn splats_of_any_number_of_threads_are_the_same() {
    let camera = perspective([0.3, 0.2, 6.0], 40.0, [130, 90]);
    let shown = Shown::new(some(256), &camera, materials());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sheets(&alone(shown.splats(0.1), &camera), &[], &[], 1))
    };
    let one = with(1);
    assert!(one.channels[0].iter().any(|c| *c > 0.1));
    [2, 3, 7].into_iter().for_each(|threads| assert_eq!(with(threads), one, "{threads} threads"));
}

#[test]
fn slabs_of_no_width_are_refused() {
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [16, 16]);
    let shown = Shown::new(some(3), &camera, materials());
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = prepare(alone(shown.splats(width), &camera), &Params::default(), None).err().unwrap();
        assert!(refused.to_string().starts_with("splats.slab_width is"), "{refused}");
    }
    let refused = prepare(alone(shown.splats(1e-9), &camera), &Params::default(), None).err().unwrap();
    assert!(refused.to_string().contains("slabs"), "{refused}");
}
