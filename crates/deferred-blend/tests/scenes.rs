//! Discs whose pictures are known.

use deferred_blend::{Bending, BlendInput, DiscInput, Discs, Error, Glass, Layering, Params, Shown, Surfaces, blend};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::GlassImage;
use splat_core::shade::ChannelLayout;
use splat_core::{
    Accumulator, Camera, Cloud, FootprintStack, LayerSet, Material, Projection, Splat, SplatKind, optics, rng,
};

/// How glass is drawn.
pub(crate) struct Asked<'a> {
    pub(crate) bending: Bending,
    pub(crate) sky: &'a (dyn Fn(Vec3, f32) -> [f32; 3] + Sync),
    pub(crate) straight: bool,
    pub(crate) unit: f32,
}

/// Discs and what they are seen by.
pub(crate) struct Scene {
    pub(crate) cloud: Cloud,
    pub(crate) camera: Camera,
    pub(crate) footprints: FootprintStack,
    pub(crate) materials: Vec<Material>,
    /// Three numbers a disc.
    pub(crate) values: Vec<f32>,
    pub(crate) ids: Vec<u32>,
}

impl Scene {
    /// A cloud before a camera; its colours are its values.
    pub(crate) fn new(cloud: Cloud, camera: Camera) -> Self {
        cloud.validate().expect("a cloud that keeps its promises");
        let values = cloud.color.iter().flatten().copied().collect();
        let ids = (0..cloud.len() as u32).filter(|i| cloud.kind[*i as usize] != SplatKind::Opaque).collect();
        let footprints = FootprintStack::default();
        let materials = vec![Material::default()];
        Self { cloud, camera, footprints, materials, values, ids }
    }

    /// What is projected.
    pub(crate) fn input(&self) -> DiscInput<'_> {
        let Self { cloud, camera, footprints, materials, ids, .. } = self;
        DiscInput { cloud, ids, camera, footprints, materials }
    }

    /// The picture: optical depths and three channels.
    pub(crate) fn draw(&self, params: &Params) -> Accumulator {
        let mut accumulator = Accumulator::new(self.camera.size, 1, 3, true, true);
        self.draw_into(params, &[], &mut accumulator);
        accumulator
    }

    /// The picture, with what was mirrored and bent.
    pub(crate) fn draw_glass(&self, params: &Params, glass: &Asked<'_>, opaque: &[f32]) -> (Accumulator, GlassImage) {
        self.draw_glass_by(params, Layering::Gaps, glass, opaque)
    }

    /// The same by some way to tell layers apart.
    pub(crate) fn draw_glass_by(
        &self,
        params: &Params,
        layering: Layering<'_>,
        glass: &Asked<'_>,
        opaque: &[f32],
    ) -> (Accumulator, GlassImage) {
        let mut accumulator = Accumulator::new(self.camera.size, 3, 3, false, false);
        let discs = Discs::project(&self.input(), params);
        let is_met = |i: &u32| self.cloud.kind[*i as usize] != SplatKind::Opaque || !glass.straight;
        let met: Vec<u32> = (0..self.cloud.len() as u32).filter(is_met).collect();
        let layout = ChannelLayout::new(&LayerSet::default());
        let surfaces = Surfaces::new(&DiscInput { ids: &met, ..self.input() }, &self.values, layout);
        let Asked { bending, sky, straight, unit } = *glass;
        let glass = Some(Glass { bending, sky, surfaces: &surfaces, straight, unit });
        let range = 0.0..f32::INFINITY;
        let input = BlendInput { discs: &discs, shown: Shown::Discs(&self.values), opaque, range, layering, glass };
        let made = blend(&input, params, &mut accumulator, None).expect("nobody cancels");
        (accumulator, made.glass.expect("asked for"))
    }

    /// The same before something opaque, behind what is there.
    pub(crate) fn draw_into(&self, params: &Params, opaque: &[f32], accumulator: &mut Accumulator) {
        self.draw_by(params, Layering::Gaps, opaque, accumulator).expect("nobody cancels");
    }

    /// The same by some way to tell layers apart.
    pub(crate) fn draw_by(
        &self,
        params: &Params,
        layering: Layering<'_>,
        opaque: &[f32],
        accumulator: &mut Accumulator,
    ) -> Result<(), Error> {
        let discs = Discs::project(&self.input(), params);
        let range = 0.0..f32::INFINITY;
        let input =
            BlendInput { discs: &discs, shown: Shown::Discs(&self.values), opaque, range, layering, glass: None };
        blend(&input, params, accumulator, None).map(|_| ())
    }
}

/// A camera at `from` that looks at the origin.
pub(crate) fn camera(from: DVec3, size: [u32; 2]) -> Camera {
    let view = Projection::Perspective { fov_y: 0.7 };
    Camera::look_at(from, DVec3::ZERO, DVec3::Y, view, size).expect("a view")
}

/// The same with parallel rays.
pub(crate) fn parallel(from: DVec3, height: f64, size: [u32; 2]) -> Camera {
    let view = Projection::Orthographic { height };
    Camera::look_at(from, DVec3::ZERO, DVec3::Y, view, size).expect("a view")
}

/// A disc of a surface whose discs lie `spacing` apart.
pub(crate) fn disc(position: Vec3, normal: Vec3, spacing: f32, opacity: f32) -> Splat {
    let crossing_depth = optics::optical_depth(f64::from(opacity)) as f32;
    Splat {
        position,
        normal: normal.normalize(),
        radius: 2.4 * spacing,
        cross_section: crossing_depth * spacing * spacing,
        crossing_depth,
        kind: SplatKind::Surface,
        color: [0.7, 0.5, 0.25],
        ..Splat::default()
    }
}

/// Discs on a jittered square lattice of 2·`half` + 1 a side through `center`, across `normal`.
pub(crate) fn plane(cloud: &mut Cloud, center: Vec3, normal: Vec3, half: i32, like: &Splat) {
    let (u, v) = normal.normalize().any_orthonormal_pair();
    let spacing = like.radius / 2.4;
    for i in -half..=half {
        for j in -half..=half {
            let jitter = |k: u64| rng::unit_f32(17, 0, (i + 500) as u64 * 1000 + (j + 500) as u64, k) - 0.5;
            let at = [i as f32 + 0.5 * jitter(0), j as f32 + 0.5 * jitter(1)];
            let position = center + (u * at[0] + v * at[1]) * spacing;
            cloud.push(&Splat { position, normal: normal.normalize(), ..*like });
        }
    }
}

/// Discs on a sphere, by a spiral.
pub(crate) fn sphere(cloud: &mut Cloud, center: Vec3, radius: f32, count: u32, opacity: f32) {
    let spacing = radius * (4.0 * std::f32::consts::PI / count as f32).sqrt();
    for k in 0..count {
        let z = 1.0 - (2.0 * k as f32 + 1.0) / count as f32;
        let around = k as f32 * 2.399_963_2;
        let across = (1.0 - z * z).sqrt();
        let normal = Vec3::new(across * libm::cosf(around), across * libm::sinf(around), z);
        cloud.push(&disc(center + radius * normal, normal, spacing, opacity));
    }
}

/// Discs anywhere, of any size, turned anyhow, some of them ellipses.
pub(crate) fn soup(count: u64, extent: f32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(3.0, -2.0, 5.0));
    for k in 0..count {
        let u = |n: u64| rng::unit_f32(5, 0, k, n);
        let around = |n: u64| Vec3::new(u(n) - 0.5, u(n + 1) - 0.5, u(n + 2) - 0.5);
        let normal = around(0).normalize_or(Vec3::Z);
        let one = disc(2.0 * extent * around(3) - cloud.origin.as_vec3(), normal, 0.05 + 0.1 * u(6), 0.1 + 0.8 * u(7));
        let tangent = if k % 3 == 0 { normal.any_orthonormal_vector() * (0.5 * one.radius) } else { Vec3::ZERO };
        let object = u32::from(u(11) < 0.3);
        cloud.push(&Splat { tangent, object, color: [u(8), u(9), u(10)], ..one });
    }
    cloud
}
