//! Light that falls on layers once a pixel.

use crate::floored::by_turns;
use crate::scenes::{Scene, camera, disc, parallel, plane, sphere};
use deferred_blend::{
    BlendInput, Discs, Layering, Light as Lit, OpaqueInput, Params, Passes, Shown, blend, resolve_opaque,
};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade_splat};
use splat_core::{
    Accumulator, Bump, Cloud, LayerSet, Light, LightShape, Material, Object, Receiver, Similarity, Splat, SplatKind,
    Transmittance,
};

const SIZE: [u32; 2] = [96, 72];

/// The scene of discs of one material in the light of a sun, by which it is lit.
struct Sunny<'a> {
    scene: Scene,
    lights: Vec<LitBy<'a>>,
    objects: Vec<Object>,
    transforms: Vec<Similarity>,
}

impl<'a> Sunny<'a> {
    fn new(cloud: Cloud, view: splat_core::Camera, material: Material, shadow: Option<&'a dyn Transmittance>) -> Self {
        let objects = cloud.object.iter().max().map_or(0, |last| *last as usize + 1);
        let one = Object::default();
        let direction = DVec3::new(-0.5, -0.6, -0.7).normalize();
        let light = Light { shape: LightShape::Directional { direction }, intensity: [3.0, 2.0, 1.0] };
        let ids = (0..cloud.len() as u32).collect();
        let scene = Scene { materials: vec![material], ids, ..Scene::new(cloud, view) };
        let transforms = vec![Similarity::default(); objects];
        Self { scene, lights: vec![LitBy { slide: None, light, shadow }], objects: vec![one; objects], transforms }
    }

    fn input(&self) -> ShadeInput<'_> {
        let Scene { cloud, camera, materials, .. } = &self.scene;
        let objects = &self.objects;
        let lights = &self.lights;
        ShadeInput { cloud, materials, objects, lights, ambient: [0.1, 0.2, 0.3], camera }
    }

    /// Numbers of each disc, shaded before it is blended.
    fn of_discs(&self, layout: ChannelLayout) -> Vec<f32> {
        let input = self.input();
        let shaded = |i: usize| {
            let mut out = vec![0.0; layout.count()];
            let (radiance, normal) = shade_splat(&input, i);
            radiance.write(normal, &layout, &mut out);
            out
        };
        (0..self.scene.cloud.len()).flat_map(shaded).collect()
    }

    /// Channels of the translucent picture, or of the opaque one.
    fn draw(&self, pixels: bool, layout: ChannelLayout, passes: Option<Passes<'_>>) -> Vec<Vec<f32>> {
        let params = Params::default();
        let input = self.input();
        let values = self.of_discs(layout);
        let light = Lit { input: &input, layout, transforms: &self.transforms, heights: &[] };
        let shown = if pixels { Shown::Pixels(light) } else { Shown::Discs(&values) };
        let discs = &Discs::project(&self.scene.input(), &params);
        let channels = layout.count();
        if let Some(passes) = passes {
            let channels = channels as u32;
            let max_bytes = 1 << 30;
            let input = OpaqueInput { discs, shown, channels, objects: false, passes, max_bytes };
            return resolve_opaque(&input, &params, None).expect("in range").image.channels;
        }
        let mut picture = Accumulator::new(self.scene.camera.size, 1, channels, false, false);
        let range = 0.0..f32::INFINITY;
        let layering = Layering::Gaps;
        let input = BlendInput { discs, shown, opaque: &[], range, layering, glass: None };
        blend(&input, &params, &mut picture, None).expect("nobody cancels");
        picture.channels
    }
}

fn beauty() -> ChannelLayout {
    ChannelLayout::new(&LayerSet::default())
}

fn all_layers() -> ChannelLayout {
    ChannelLayout::new(&LayerSet { effects: true, normal: true, shadow: true, ..LayerSet::default() })
}

fn apart(a: &[Vec<f32>], b: &[Vec<f32>]) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn opaque(mut cloud: Cloud) -> Cloud {
    cloud.kind.fill(SplatKind::Opaque);
    cloud
}

#[test]
fn discs_of_a_plane_show_before_they_are_blended_what_they_show_after() {
    let mut cloud = Cloud::new(DVec3::new(100.0, -50.0, 20.0));
    let normal = Vec3::new(0.3, 0.2, 1.0);
    for z in [0.0, -1.0] {
        let middle = Vec3::Z * z - cloud.origin.as_vec3();
        plane(&mut cloud, middle, normal, 30, &disc(Vec3::ZERO, normal, 0.1, 0.4));
    }
    // Normals that were wound the other way are one side all the same.
    cloud.normal.iter_mut().step_by(3).for_each(|n| *n = -*n);
    let colors = [[0.2, 0.5, 0.9], [0.8, 0.1, 0.4]];
    cloud.color.iter_mut().enumerate().for_each(|(k, color)| *color = colors[k % 2]);
    let view = parallel(DVec3::Z * 4.0, 2.0, SIZE);
    // A wide lobe, which does not multiply the rounding of normals.
    let material = Material { specular: 0.1, shininess: 4.0, ..Material::default() };
    for (cloud, passes) in [(cloud.clone(), None), (opaque(cloud), Some(Passes::TwoPlusOne))] {
        let sunny = Sunny::new(cloud, view, material, None);
        let groups = by_turns(&sunny.scene.cloud, 40);
        let one_pass = Passes::OnePlusOne { groups: &groups, voronoi: true };
        for passes in [passes, passes.map(|_| one_pass)] {
            let [before, after] = [false, true].map(|pixels| sunny.draw(pixels, all_layers(), passes));
            assert!(before[6].iter().all(|light| *light > 0.05), "lit");
            assert!(apart(&before, &after) < 1e-6, "{:e}", apart(&before, &after));
        }
    }
}

/// A ball of few discs: what each shows is one radiance, and the highlight has facets. Light on pixels is nearer to that on the ball, and
/// ripples less, from pixel to pixel.
#[test]
fn highlights_have_fewer_facets_where_light_falls_on_pixels() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 1200, 0.5);
    let shiny = Material { specular: 0.5, shininess: 60.0, ..Material::default() };
    let sunny = Sunny::new(opaque(cloud), parallel(DVec3::Z * 4.0, 2.4, SIZE), shiny, None);
    let input = sunny.input();
    // The ball itself, a disc at each pixel's place.
    let exact = |k: usize| {
        let at = |i: usize, size: u32| (i as f32 + 0.5 - 0.5 * size as f32) * 2.4 / 72.0;
        let x = at(k % 96, 96);
        let y = -at(k / 96, 72);
        let square = x * x + y * y;
        (square < 0.8).then(|| {
            let place = Vec3::new(x, y, (1.0 - square).sqrt());
            let mut cloud = Cloud::new(DVec3::ZERO);
            cloud.push(&Splat { kind: SplatKind::Opaque, ..disc(place, place, 0.1, 0.5) });
            shade_splat(&ShadeInput { cloud: &cloud, ..input }, 0).0.direct[0]
        })
    };
    let layout = all_layers();
    let [before, after] = [false, true].map(|pixels| {
        let picture = &sunny.draw(pixels, layout, Some(Passes::TwoPlusOne))[6];
        let off = |k: usize| Some(f64::from(picture[k] - exact(k)?));
        let ripple = |k: usize| Some(off(k + 1)? - off(k)?);
        let rms = |error: &dyn Fn(usize) -> Option<f64>| {
            let squares: Vec<f64> = (0..picture.len() - 1).filter_map(error).map(|v| v * v).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        [rms(&off), rms(&ripple)]
    });
    let peak = (0..96 * 72).filter_map(exact).fold(0.0, f32::max);
    println!("highlight of {peak:.2}, RMSE and ripple: {before:.4?} by discs, {after:.4?} by pixels");
    assert!(after[0] < before[0] && after[1] < before[1], "{before:?} {after:?}");
}

/// Shadow left of the middle.
struct Half;

impl Transmittance for Half {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        [f32::from(u8::from(receiver.position.x > 0.0)); 3]
    }
}

#[test]
fn shadows_end_at_a_pixel_and_not_at_a_disc() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, Vec3::ZERO, Vec3::Z, 20, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    for (cloud, passes) in [(cloud.clone(), None), (opaque(cloud), Some(Passes::TwoPlusOne))] {
        let sunny = Sunny::new(cloud, parallel(DVec3::Z * 4.0, 2.0, SIZE), Material::default(), Some(&Half));
        let between = |pixels: bool| {
            let picture = sunny.draw(pixels, all_layers(), passes);
            let full = picture[6][72 * 48 - 1];
            picture[6].iter().filter(|v| (0.01 * full..0.99 * full).contains(v)).count()
        };
        assert_eq!(between(true), 0);
        assert!(between(false) > 300, "{}", between(false));
    }
}

fn bumpy(height: f32) -> Material {
    Material { bump: Bump { height, size: 0.4, octaves: 3, seed: 5 }, ..Material::default() }
}

#[test]
fn bumps_tilt_normals_and_move_with_their_object() {
    let layout = all_layers();
    let at = layout.normal().expect("asked for");
    let picture = |height: f32, transform: Similarity| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        plane(&mut cloud, Vec3::ZERO, Vec3::Z, 20, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
        cloud.position.iter_mut().for_each(|p| *p = transform.apply(p.as_dvec3()).as_vec3());
        cloud.normal.iter_mut().for_each(|n| *n = transform.rotate(n.as_dvec3()).as_vec3());
        let eye = transform.apply(DVec3::Z * 4.0);
        let view = splat_core::Projection::Orthographic { height: 2.0 };
        let target = transform.apply(DVec3::ZERO);
        let up = transform.rotate(DVec3::Y);
        let view = splat_core::Camera::look_at(eye, target, up, view, SIZE).expect("a view");
        let mut sunny = Sunny::new(opaque(cloud), view, bumpy(height), None);
        sunny.transforms = vec![transform];
        let channels = sunny.draw(true, layout, Some(Passes::TwoPlusOne));
        let back = transform.rotation.inverse();
        let normal = |k: usize| back * Vec3::new(channels[at][k], channels[at + 1][k], channels[at + 2][k]).as_dvec3();
        (0..96 * 72).map(normal).collect::<Vec<DVec3>>()
    };
    assert!(picture(0.0, Similarity::default()).iter().all(|n| *n == DVec3::Z), "smooth to the last bit");
    let still = picture(0.05, Similarity::default());
    let mean = still.iter().sum::<DVec3>() / still.len() as f64;
    let tilt = still.iter().map(|n| n.truncate().length()).fold(0.0, f64::max);
    assert!(mean.truncate().length() < 0.03 && (0.1..0.7).contains(&tilt), "{mean} {tilt}");
    assert!(still.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    let turned =
        Similarity { rotation: DQuat::from_rotation_x(0.7), translation: DVec3::new(3.0, -2.0, 5.0), scale: 1.0 };
    let off = picture(0.05, turned).iter().zip(&still).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(off < 1e-3, "{off:e}");
}

#[test]
fn threads_light_on_pixels_has_the_same_bits() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 800, 0.5);
    let view = camera(DVec3::new(0.3, 0.4, 3.0), SIZE);
    let translucent = Sunny::new(cloud.clone(), view, bumpy(0.03), None);
    let solid = Sunny::new(opaque(cloud), view, bumpy(0.03), None);
    let by = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| [translucent.draw(true, beauty(), None), solid.draw(true, beauty(), Some(Passes::TwoPlusOne))])
    };
    assert!([2, 3, 7].into_iter().all(|threads| by(threads) == by(1)));
}
