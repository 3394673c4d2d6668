//! What is drawn, in closed form: kernels and Gaussians at every pixel, samples that become pixels, and what is counted before.

use glam::{DVec2, DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::raster::bins::{TILE, bin};
use splat_core::raster::{
    Background, Detail, FinishInput, FoldInput, GlassImage, OpaqueImage, Params, ProjectInput, Projected, finish, fold,
    project, tile_bytes,
};
use splat_core::shade::{Census, ChannelLayout};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Footprint, FootprintStack, Gaussians, LayerData, LayerSet, Material,
};
use splat_core::{Object, Projection, Shading, Splat, SplatKind};
use std::sync::Arc;

const SIZE: [u32; 2] = [96, 64];

/// From the origin along z.
fn camera(view: Projection) -> Camera {
    Camera::look_at(DVec3::ZERO, DVec3::Z, DVec3::Y, view, SIZE).unwrap()
}

/// What is to be seen of a cloud of one splat by a filter of this width, and its optical depth at every pixel. Surfaces are slabs.
fn draw(cloud: &Cloud, camera: &Camera, opaque: &OpaqueImage, filter_px: f32) -> (Projected, Vec<f32>) {
    let material = Material { surface_opacity: SurfaceOpacity::ThinSlab, ..Material::default() };
    let materials = &[material];
    let footprints = &FootprintStack::default();
    let params = &Params { resampling_sigma_px: filter_px, ..Params::default() };
    let projected = project(&ProjectInput { cloud, camera, footprints, materials, params, detail: Detail::ALL });
    let mut out = Accumulator::new(camera.size, 1, 1, false, false);
    let order = &(0..cloud.len() as u32).collect::<Vec<_>>();
    let values = &vec![1.0; cloud.len()];
    let direction = Direction::FrontToBack;
    let input = FoldInput { projected: &projected, order, values, materials, opaque, direction, params };
    fold(&input, &mut out, None).unwrap();
    // A splat of the value 1 alone shows how opaque it is.
    for (depth, shown) in out.optical_depth[0].iter().zip(&out.channels[0]) {
        assert!((1.0 - (-depth).exp() - shown).abs() < 1e-6, "{depth} {shown}");
    }
    (projected, out.optical_depth.remove(0))
}

/// View space, x right, y up, in the world.
fn world(camera: &Camera, v: DVec3) -> Vec3 {
    let [right, up, forward] = camera.axes;
    (right * v.x + up * v.y + forward * v.z).as_vec3()
}

/// The ray of each pixel at depth 1 with its place from the middle, y up.
fn rays(camera: &Camera) -> impl Iterator<Item = DVec3> {
    let [width, height] = camera.size;
    let focal = camera.focal_px();
    let middle = DVec2::new(f64::from(width), f64::from(height)) / 2.0;
    (0..width * height).map(move |k| {
        let at = (DVec2::new(f64::from(k % width), f64::from(k / width)) + 0.5 - middle) / focal;
        DVec3::new(at.x, -at.y, 1.0)
    })
}

#[test]
fn a_medium_is_its_kernel_around_every_ray_and_lies_in_few_tiles() {
    let camera = camera(Projection::Perspective { fov_y: 1.2 });
    let radius = 0.3f32;
    let kernel = Footprint::default();
    // The last so thin that it has a loop of its own.
    for (x, y, cross_section) in [(0.0, 0.0, 0.05), (2.0, -0.9, 0.05), (-1.4, 1.3, 0.01f32)] {
        let center = DVec3::new(x, y, 3.0);
        let position = world(&camera, center);
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { position, radius, cross_section, ..Splat::default() });
        let (projected, found) = draw(&cloud, &camera, &OpaqueImage::default(), 0.0);
        let wall = OpaqueImage { depth: vec![3.1; found.len()], ..OpaqueImage::default() };
        let (_, cut) = draw(&cloud, &camera, &wall, 0.0);
        let before = kernel.share_before(0.1 / f64::from(radius));
        let peak = f64::from(cross_section) * kernel.norm() / f64::from(radius).powi(2);
        for (k, (ray, (found, cut))) in rays(&camera).zip(found.iter().zip(&cut)).enumerate() {
            let s = center.cross(ray).length_squared() / ray.length_squared() / f64::from(radius).powi(2);
            let expected = peak * kernel.profile(s);
            assert!((f64::from(*found) - expected).abs() < 2e-5 * peak, "{center} {k}: {found} {expected}");
            assert!((f64::from(*cut) - expected * before).abs() < 1e-4 * peak, "{center} {k}: {cut} of {expected}");
        }
        // Its image is a box of 2·5.2 pixels or little more: it lies in at most two by two tiles.
        assert!(bin(&projected, &[0]).entries() <= 4, "{center}");
    }
}

#[test]
fn a_slab_is_thicker_along_a_slanted_ray_far_away_and_through_the_eye_plane() {
    let camera = camera(Projection::Perspective { fov_y: 1.2 });
    let kernel = Footprint::default();
    let slab = |center: DVec3, radius: f32, normal: DVec3| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        let position = world(&camera, center);
        let normal = world(&camera, normal);
        let kind = SplatKind::Surface;
        cloud.push(&Splat { position, radius, cross_section: 0.05, kind, normal, ..Splat::default() });
        draw(&cloud, &camera, &OpaqueImage::default(), 0.0)
    };
    let peak = |radius: f32| 0.05 * kernel.norm() / f64::from(radius).powi(2);
    for normal in [-DVec3::Z, DVec3::new(0.6, 0.0, -0.8), DVec3::new(-0.48, 0.6, -0.64)] {
        let center = DVec3::new(1.5, -0.8, 3.0);
        let cosine = (normal.dot(center) / center.length()).abs();
        let found = f64::from(slab(center, 0.1, normal).0.splats[0].peak);
        assert!((found * cosine / peak(0.1) - 1.0).abs() < 1e-4, "{normal}: {found}");
    }
    let center = DVec3::new(0.2, -0.3, 0.4);
    let normal = DVec3::new(0.0, 0.8, -0.6);
    let radius = 1.0;
    let (_, found) = slab(center, radius, normal);
    for (k, (ray, found)) in rays(&camera).zip(found).enumerate() {
        let depth = normal.dot(center) / normal.dot(ray);
        let s = (ray * depth - center).length_squared();
        let cosine = (normal.dot(ray) / ray.length()).abs();
        let expected = if depth > 0.0 { peak(radius) * kernel.profile(s.min(1.0)) / cosine.max(1e-3) } else { 0.0 };
        assert!((f64::from(found) - expected).abs() < 1e-3 * (peak(radius) + expected), "{k}: {found} {expected}");
    }
}

#[test]
fn a_gaussian_is_its_opacity_around_every_place_and_a_surface_cuts_it_in_depth() {
    let camera = camera(Projection::Orthographic { height: 8.0 });
    let center = DVec3::new(0.7, -0.4, 5.0);
    let axes = [DVec3::new(0.8, 0.3, 0.1), DVec3::new(-0.2, 0.5, 0.3), DVec3::new(0.1, -0.3, 0.7)];
    let opacity = 0.8;
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat {
        position: world(&camera, center),
        radius: 3.0,
        cross_section: 1.0,
        gaussian: 0,
        ..Splat::default()
    });
    cloud.gaussians = Arc::new(Gaussians {
        axes: vec![axes.map(|axis| world(&camera, axis))],
        opacity: vec![opacity as f32],
        degree: 0,
        harmonics: vec![[0.0; 3]],
    });
    let sum = |term: &dyn Fn(DVec3) -> f64| axes.iter().map(|a| term(*a)).sum::<f64>();
    let xx = sum(&|a| a.x * a.x);
    let yy = sum(&|a| a.y * a.y);
    let xy = sum(&|a| a.x * a.y);
    let zx = sum(&|a| a.z * a.x);
    let zy = sum(&|a| a.z * a.y);
    let zz = sum(&|a| a.z * a.z);
    let kernel = Footprint::default();
    for filter_px in [0.0, 4.0] {
        let filter = f64::from(Gaussians::FILTER_VARIANCE) * (f64::from(filter_px) / camera.focal_px()).powi(2);
        let xx = xx + filter;
        let yy = yy + filter;
        let determinant = xx * yy - xy * xy;
        // Of the depth at a place in the image: how the mean changes, and what is left of the variance.
        let along_x = (yy * zx - xy * zy) / determinant;
        let along_y = (xx * zy - xy * zx) / determinant;
        let deviation = (zz - along_x * zx - along_y * zy).sqrt();
        let (_, whole) = draw(&cloud, &camera, &OpaqueImage::default(), filter_px);
        for surface in [4.4, 5.0, 5.3] {
            let wall = OpaqueImage { depth: vec![surface as f32; whole.len()], ..OpaqueImage::default() };
            let (_, cut) = draw(&cloud, &camera, &wall, filter_px);
            for (k, ray) in rays(&camera).enumerate() {
                // Parallel rays: `ray` is the place itself.
                let dx = ray.x - center.x;
                let dy = ray.y - center.y;
                let half_square = 0.5 * (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
                let alpha = opacity * (-half_square).exp();
                if (alpha * 255.0 - 1.0).abs() < 1e-2 {
                    continue;
                }
                let expected = if alpha * 255.0 > 1.0 { -(-alpha).ln_1p() } else { 0.0 };
                assert!((f64::from(whole[k]) - expected).abs() < 1e-4, "{filter_px} {k}: {} {expected}", whole[k]);
                let distance = (surface - center.z - along_x * dx - along_y * dy) / deviation;
                let expected = expected * kernel.share_before(distance / f64::from(kernel.cutoff));
                assert!((f64::from(cut[k]) - expected).abs() < 1e-4, "{surface} {k}: {} {expected}", cut[k]);
            }
        }
    }
}

#[test]
fn a_pixel_is_the_mean_of_its_samples_in_every_band_of_rows() {
    // Rows of more than one band, the last not whole; four samples a pixel.
    let width = 3;
    let height = 40;
    let layers = LayerSet { normal: true, shadow: true, object: true, ..LayerSet::default() };
    let layout = ChannelLayout::new(&layers);
    let mut acc = Accumulator::new([2 * width, 2 * height], 1, layout.count(), false, true);
    let mut glass = GlassImage::new(acc.size);
    let samples = acc.optical_depth[0].len();
    let mut opaque = OpaqueImage {
        depth: vec![f32::INFINITY; samples],
        channels: vec![vec![0.0; samples]; layout.count()],
        object: vec![u32::MAX; samples],
    };
    let at = |k: usize, seed: f32| (k as f32 * seed).fract();
    let is_bent = |k: usize| k.is_multiple_of(3);
    let is_solid = |k: usize| k.is_multiple_of(5);
    for k in 0..samples {
        acc.optical_depth[0][k] = at(k, 0.618);
        (0..layout.count()).for_each(|c| acc.channels[c][k] = at(k, 0.414 + 0.1 * c as f32));
        glass.mirrored[k] = [at(k, 0.732), at(k, 0.236), 0.0];
        if is_bent(k) {
            glass.behind[k] = [1.0, at(k, 0.873), 0.5];
        }
        if is_solid(k) {
            opaque.depth[k] = 2.0;
            opaque.object[k] = 7;
            (0..layout.count()).for_each(|c| opaque.channels[c][k] = at(k, 0.314 + 0.1 * c as f32));
        }
        if k.is_multiple_of(11) {
            acc.object[k] = 2;
        }
    }
    // Infinite radiance: of a surface that splats hide, and of one that a bent ray passes by.
    let hidden = 25;
    acc.optical_depth[0][hidden] = 1e9;
    let passed = 45;
    for c in 0..3 {
        opaque.channels[c][hidden] = f32::INFINITY;
        opaque.channels[c][passed] = f32::INFINITY;
    }
    let background = [0.25, 0.5, 1.0];
    let found = finish(&FinishInput {
        accumulator: &acc,
        opaque: &opaque,
        background: Background::Color(background),
        glass: Some(&glass),
        layout: &layout,
        layers: &layers,
        antialias: 2,
    });
    assert_eq!(found.size, [width, height]);
    let beauty = found.rgb("beauty").unwrap();
    let alpha = found.scalar("alpha").unwrap();
    let normal = found.rgb("normal").unwrap();
    let shadow = found.scalar("shadow").unwrap();
    let Some(LayerData::Id(objects)) = found.images.get("object") else { panic!("ids") };
    assert_eq!((beauty.len(), alpha.len()), (120, 120));
    for y in 0..height {
        for x in 0..width {
            let pixel = (y * width + x) as usize;
            let four = [0, 1, 2, 3].map(|s| ((2 * y + s / 2) * 2 * width + 2 * x + s % 2) as usize);
            let mean = |value: &dyn Fn(usize) -> f32| four.iter().map(|&k| value(k)).sum::<f32>() / 4.0;
            let through = |k: usize| (-acc.optical_depth[0][k]).exp();
            let seen = |k: usize, c: usize| if through(k) > 0.0 { through(k) * opaque.channels[c][k] } else { 0.0 };
            let told = |c: usize| mean(&|k| acc.channels[c][k] + if is_solid(k) { seen(k, c) } else { 0.0 });
            let expected = mean(&|k| if is_solid(k) { 1.0 } else { 1.0 - through(k) });
            assert!((alpha[pixel] - expected).abs() < 1e-6, "{x} {y}");
            for c in 0..3 {
                let behind = |k: usize| match (is_bent(k), is_solid(k)) {
                    (true, _) => through(k) * glass.behind[k][c],
                    (false, true) => seen(k, c),
                    (false, false) => through(k) * background[c],
                };
                let expected = mean(&|k| acc.channels[c][k] + glass.mirrored[k][c] + behind(k));
                assert!((beauty[pixel][c] - expected).abs() < 2e-6, "{x} {y} {c}: {} {expected}", beauty[pixel][c]);
                assert!((normal[pixel][c] - told(3 + c)).abs() < 1e-6, "{x} {y} {c}");
            }
            assert!((shadow[pixel] - told(6)).abs() < 1e-6, "{x} {y}");
            let nearest = |k: usize| if acc.object[k] == u32::MAX { opaque.object[k] } else { acc.object[k] };
            let object = four.iter().map(|&k| nearest(k)).find(|id| *id != u32::MAX);
            assert_eq!(objects[pixel], object.unwrap_or(u32::MAX), "{x} {y}");
        }
    }
}

#[test]
fn lists_by_tile_are_predicted_as_their_entries_and_beginnings() {
    let side = f64::from(TILE as u32);
    let splat = |z: f32, radius: f32| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { position: Vec3::Z * z, radius, ..Splat::default() });
        cloud
    };
    // Three by two tiles; a pixel is as wide as an eighth of the unit.
    let parallel = camera(Projection::Orthographic { height: f64::from(SIZE[1]) / 8.0 });
    let tile = (side / 8.0) as f32;
    // A footprint as wide as a tile begins anywhere in one: two by two. One that is larger than the picture: all.
    assert_eq!(tile_bytes(&splat(5.0, 0.5 * tile), &parallel), 4 * (4 + 6));
    assert_eq!(tile_bytes(&splat(5.0, 50.0 * tile), &parallel), 4 * (6 + 6));
    let perspective = camera(Projection::Perspective { fov_y: 1.0 });
    let wide = (0.5 * side / perspective.focal_px()) as f32;
    // As wide as a tile where its ball is nearest; around the eye, and behind it.
    assert_eq!(tile_bytes(&splat(4.0 + 4.0 * wide, 4.0 * wide), &perspective), 4 * (4 + 6));
    assert_eq!(tile_bytes(&splat(0.0, 1.0), &perspective), 4 * (6 + 6));
    assert_eq!(tile_bytes(&splat(-2.0, 1.0), &perspective), 4 * 6);
}

#[test]
fn only_what_is_translucent_can_absorb_in_colours() {
    let tinted = Material { extinction_rgb: [1.0, 0.5, 1.0], ..Material::default() };
    let materials = [Material::default(), tinted, Material { shading: Shading::Unlit, ..Material::default() }];
    let count = |splats: &[(SplatKind, u16)]| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for &(kind, material) in splats {
            let normal = if kind == SplatKind::Medium { Vec3::ZERO } else { Vec3::Z };
            cloud.push(&Splat { radius: 2.0, cross_section: 1.0, kind, material, normal, ..Splat::default() });
        }
        Census::new(&cloud, &materials, &[Object::default()], &FootprintStack::default())
    };
    use SplatKind::{Medium, Opaque, Surface};
    assert!(!count(&[(Medium, 0), (Surface, 0), (Opaque, 0), (Opaque, 1)]).colored_extinction);
    assert!(count(&[(Medium, 1)]).colored_extinction && count(&[(Opaque, 0), (Surface, 1)]).colored_extinction);
    let all = count(&[(Medium, 1), (Surface, 0), (Opaque, 0), (Medium, 2)]);
    assert_eq!((all.splats, all.translucent, all.opaque), (4, 3, 1));
    assert_eq!((all.receivers, all.casters, all.opaque_casters), (3, 4, 1));
    let peak = Footprint::default().norm() / 4.0;
    assert!((all.caster_optical_depth - 4.0 * peak).abs() < 1e-9, "{}", all.caster_optical_depth);
}
