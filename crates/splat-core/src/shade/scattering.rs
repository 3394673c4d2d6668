//! Splats that scatter by the phase function, under light of lamps and parallel light, as many at a time as there are lanes: what
//! [`Point::radiance`](super::Point::radiance) says of each, within rounding, by itself and whatever its neighbours are.

use super::joint::{ThickSplat, Within};
use super::point::{Incoming, is_attenuated, passing};
use super::{ChannelLayout, LitBy, Radiance, ShadeInput, Shaded, facing, shadow_share};
use crate::optics::TRACE;
use crate::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use crate::{LightShape, Receiver, Shading, TOGETHER};
use glam::{DVec3, Vec3};
use pulp::Simd;
use std::f32::consts::PI;
use std::ops::Range;

// A batch is asked for at once.
const _: () = assert!(MAX_LANES <= TOGETHER);

/// One number for each splat of a batch.
type Column = [f32; MAX_LANES];

/// Where light comes from, relative to the cloud's origin.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// The unit direction to parallel light.
    Parallel(Vec3),
    /// The place of a lamp in two parts: what is near to it is told apart from it by all digits.
    Lamp([Vec3; 2]),
}

/// Lights that take no more than [`Source`] to tell what arrives of them.
pub(super) struct Scattering<'a> {
    input: &'a ShadeInput<'a>,
    within: Option<Within<'a>>,
    sources: Vec<Source>,
    /// Relative to the cloud's origin.
    eye: Vec3,
    /// The unit direction to it, where that is everywhere the same.
    to_eye: Option<Vec3>,
}

/// What some splats need of their light.
#[derive(Default)]
pub(super) struct Batch {
    to_eye: [Column; 3],
    lights: Vec<OfLight>,
    /// Those that ask one of them for its shadow.
    asked: Vec<usize>,
}

/// One light at some splats.
#[derive(Clone, Default)]
struct OfLight {
    /// How much of its intensity arrives without shadow.
    falloff: Column,
    /// How much of what arrives leaves to the eye, before colour.
    leaving: Column,
    /// Irradiance without shadow.
    irradiance: [[f32; 3]; MAX_LANES],
    /// Share that arrives.
    share: [[f32; 3]; MAX_LANES],
}

impl<'a> Scattering<'a> {
    /// `None` where each splat has to ask for its light: behind a slide, of spots and of what is flat; and where colours depend on
    /// who sees them.
    pub(super) fn new(shaded: Shaded<'a>) -> Option<Self> {
        let Shaded { input, within } = shaded;
        let source = |lit: &LitBy<'_>| match lit.light.shape {
            _ if lit.slide.is_some() => None,
            LightShape::Directional { direction } => Some(Source::Parallel(-direction.as_vec3())),
            LightShape::Point { position } | LightShape::Sphere { center: position, .. } => {
                let place: DVec3 = position - input.cloud.origin;
                let rounded = place.as_vec3();
                Some(Source::Lamp([rounded, (place - rounded.as_dvec3()).as_vec3()]))
            }
            _ => None,
        };
        let sources = input.lights.iter().map(source).collect::<Option<_>>()?;
        let camera = input.camera;
        let to_eye = camera.is_orthographic().then(|| -camera.axes[2].as_vec3());
        let eye = (camera.position - input.cloud.origin).as_vec3();
        input.cloud.gaussians.is_empty().then_some(Self { input, within, sources, eye, to_eye })
    }

    /// How many splats from `first` on, before `end`, can be shaded together: none, or up to as many as a vector has lanes at most.
    pub(super) fn together(&self, first: usize, end: usize) -> usize {
        let materials = &self.input.cloud.material[first..end.min(first + MAX_LANES)];
        let [id, ..] = *materials else { return 0 };
        if self.input.materials[id as usize].shading != Shading::Phase {
            return 0;
        }
        materials.iter().take_while(|other| **other == id).count()
    }

    /// Values of the splats from `first` on that `is_one` says, 0 for the others: as many as `out` has room for, of which `batch` has the
    /// [`Scattering::light`].
    #[inline(always)]
    pub(super) fn shade(
        &self,
        first: usize,
        is_one: &impl Fn(usize) -> bool,
        layout: &ChannelLayout,
        batch: &mut Batch,
        out: &mut [f32],
    ) {
        let input = self.input;
        let material = &input.materials[input.cloud.material[first] as usize];
        let channels = layout.count();
        let splats = first..first + out.len() / channels;
        // Light by light: what is remembered of one is not waited for before the next is asked for.
        let Batch { to_eye, lights, asked } = batch;
        let mut thick: [Option<ThickSplat>; MAX_LANES] = [None; MAX_LANES];
        if let Some(within) = &self.within {
            for (k, i) in splats.clone().enumerate().filter(|(_, i)| is_one(*i)) {
                thick[k] = ThickSplat::new(within, i);
            }
        }
        for (rank, (lit, light)) in input.lights.iter().zip(&mut *lights).enumerate() {
            asked.clear();
            for (k, i) in splats.clone().enumerate().filter(|(_, i)| is_one(*i)) {
                let arriving = lit.light.intensity.map(|intensity| intensity * light.falloff[k]);
                light.irradiance[k] = arriving.map(|e| if e > TRACE { e } else { 0.0 });
                light.share[k] = [1.0; 3];
                if is_attenuated(light.irradiance[k], shadow_share(input, i)) {
                    asked.push(i);
                }
            }
            if let Some(shadow) = lit.shadow {
                let through = shadow.at_splats(asked, &|i| Receiver::of_splat(input.cloud, i));
                for (i, through) in asked.iter().zip(through) {
                    let coefficient = shadow_share(input, *i);
                    light.share[i - first] = match &thick[i - first] {
                        Some(splat) => splat.received(input, *i, rank, through, coefficient),
                        None => passing(through, coefficient),
                    };
                }
            }
        }
        for ((k, i), out) in splats.enumerate().zip(out.chunks_exact_mut(channels)) {
            if !is_one(i) {
                out.fill(0.0);
                continue;
            }
            let incoming = |light: &OfLight| Incoming {
                irradiance: light.irradiance[k],
                diffuse: light.leaving[k],
                specular: 0.0,
            };
            let incoming = lights.iter().map(incoming);
            let color = input.cloud.color[i];
            let radiance =
                Radiance::new(material, color, true, input.ambient, incoming, |rank, _| lights[rank].share[k]);
            let cloud = input.cloud;
            let to_eye = Vec3::from_array(to_eye.map(|axis| axis[k]));
            let normal = facing(cloud.kind[i], cloud.normal_of(i), cloud.shading_normal_of(i), to_eye);
            radiance.write(normal, layout, out);
        }
    }

    /// What some splats need of their light: as many as [`Scattering::together`] tells.
    #[inline(always)]
    pub(super) fn light<S: Simd>(&self, simd: S, splats: Range<usize>, batch: &mut Batch) {
        let cloud = self.input.cloud;
        let material = &self.input.materials[cloud.material[splats.start] as usize];
        let mut columns = [[0.0; MAX_LANES]; 4];
        for (k, i) in splats.enumerate() {
            let [x, y, z] = cloud.position[i].to_array();
            let [xs, ys, zs, radii] = &mut columns;
            (xs[k], ys[k], zs[k], radii[k]) = (x, y, z, cloud.radius[i]);
        }
        batch.lights.resize_with(self.sources.len(), OfLight::default);
        // Not `map`, which is not compiled into code for vectors.
        let vector = |v: Vec3| [simd.lanes(v.x), simd.lanes(v.y), simd.lanes(v.z)];
        let scaled = |[x, y, z]: [Lanes<S>; 3], by: Lanes<S>| [x * by, y * by, z * by];
        for lane in (0..MAX_LANES).step_by(Lanes::<S>::COUNT) {
            let [x, y, z, radius] = [
                Lanes::load(simd, &columns[0][lane..]),
                Lanes::load(simd, &columns[1][lane..]),
                Lanes::load(simd, &columns[2][lane..]),
                Lanes::load(simd, &columns[3][lane..]),
            ];
            let to_eye = if let Some(to_eye) = self.to_eye {
                vector(to_eye)
            } else {
                let [ex, ey, ez] = vector(self.eye);
                let away = [ex - x, ey - y, ez - z];
                let length = length_sq(away).sqrt();
                scaled(away, (simd.lanes(1.0) / length).where_less(simd.lanes(0.0), length))
            };
            to_eye[0].store(&mut batch.to_eye[0][lane..]);
            to_eye[1].store(&mut batch.to_eye[1][lane..]);
            to_eye[2].store(&mut batch.to_eye[2][lane..]);
            for (source, light) in self.sources.iter().zip(&mut batch.lights) {
                let (to_light, arriving) = match *source {
                    Source::Parallel(to_light) => (vector(to_light), simd.lanes(1.0)),
                    Source::Lamp([near, rest]) => {
                        let [nx, ny, nz] = vector(near);
                        let [rx, ry, rz] = vector(rest);
                        let away = [(nx - x) + rx, (ny - y) + ry, (nz - z) + rz];
                        let spread = radius / simd.lanes(3.0);
                        let distance_sq = spread.mul_add(spread, length_sq(away));
                        let nearness = (simd.lanes(1.0) / distance_sq.sqrt()).where_less(simd.lanes(0.0), distance_sq);
                        (scaled(away, nearness), nearness * nearness)
                    }
                };
                arriving.store(&mut light.falloff[lane..]);
                (simd.lanes(material.single_scattering_albedo) * phase(simd, to_light, to_eye, material.asymmetry))
                    .store(&mut light.leaving[lane..]);
            }
        }
    }
}

#[inline(always)]
fn length_sq<S: Simd>(vector: [Lanes<S>; 3]) -> Lanes<S> {
    let [x, y, z] = vector;
    x.mul_add(x, y.mul_add(y, z * z))
}

/// [`henyey_greenstein`](crate::henyey_greenstein) of light that travels away from where it comes from.
#[inline(always)]
fn phase<S: Simd>(simd: S, to_light: [Lanes<S>; 3], to_eye: [Lanes<S>; 3], asymmetry: f32) -> Lanes<S> {
    let g = asymmetry.abs();
    let [lx, ly, lz] = to_light;
    let [ex, ey, ez] = to_eye;
    let apart = if asymmetry >= 0.0 { [lx + ex, ly + ey, lz + ez] } else { [ex - lx, ey - ly, ez - lz] };
    let d = simd.lanes(g).mul_add(length_sq(apart), simd.lanes((1.0 - g) * (1.0 - g)));
    simd.lanes((1.0 - g) * (1.0 + g)) / (simd.lanes(4.0 * PI) * d * d.sqrt())
}

#[cfg(test)]
mod tests {
    use crate::shade::{ChannelLayout, LitBy, ShadeInput, shade_into, shade_splat};
    use crate::{Camera, Cloud, LayerSet, Light, LightShape, Material, Object, Projection, Receiver, Shading, Splat};
    use crate::{SplatKind, Transmittance, rng};
    use glam::{DVec3, Vec3};

    /// A shadow that tells splats and channels apart.
    struct Haze;

    impl Transmittance for Haze {
        fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
            [0.3, 0.6, 0.9].map(|share| share * (1.0 - 0.5 * receiver.position.x.abs()))
        }
    }

    /// Beside the cloud's origin; no numbers of f32.
    const LAMP: f64 = 0.25 + 3e-9;

    /// Media and discs of four materials in rows of twenty, a very small one of them next to the lamp.
    fn cloud(splats: usize) -> Cloud {
        let mut cloud = Cloud::new(DVec3::new(3.0, -2.0, 7.0));
        for i in 0..splats as u64 {
            let [x, y, z, r, red] = [0, 1, 2, 3, 4].map(|stream| rng::unit_f32(9, stream, i, 0));
            let (position, radius) = match i {
                9 => (Vec3::splat(0.25), 1e-8),
                _ => (Vec3::new(x, y, z) - 0.5, 0.01 + 0.1 * r),
            };
            let (kind, normal) =
                if i % 5 == 0 { (SplatKind::Surface, Vec3::Y) } else { (SplatKind::Medium, Vec3::ZERO) };
            let color = [red, 0.5, 1.0 - red];
            let material = (i / 20 % 4) as u16;
            cloud.push(&Splat { position, radius, kind, normal, color, material, ..Splat::default() });
        }
        cloud
    }

    /// What is checked of all views and channels: the cloud's values together, and one by one.
    fn for_each_picture(cloud: &Cloud, mut check: impl FnMut(Vec<f32>, Vec<f32>)) {
        let phase = |asymmetry, albedo| Material {
            asymmetry,
            single_scattering_albedo: albedo,
            shading: Shading::Phase,
            ..Material::default()
        };
        let materials = [phase(0.0, 1.0), phase(0.85, 0.7), phase(-0.5, 0.9), Material::default()];
        let direction = DVec3::new(0.6, 0.0, -0.8);
        let position = cloud.origin + LAMP;
        let light = |shape, intensity| LitBy { light: Light { shape, intensity }, slide: None, shadow: Some(&Haze) };
        let lights = &[
            light(LightShape::Directional { direction }, [3.0, 2.0, 1.0]),
            light(LightShape::Point { position }, [0.1, 0.0, 0.3]),
        ];
        for view in [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 2.0 }] {
            let camera = &Camera::look_at(cloud.origin + DVec3::Z, cloud.origin, DVec3::Y, view, [64, 64]).unwrap();
            let objects = &[Object { shadow_coefficient: 0.75, ..Object::default() }];
            let input = &ShadeInput { cloud, materials: &materials, objects, lights, ambient: [0.1, 0.2, 0.3], camera };
            for effects in [false, true] {
                let set = LayerSet { effects, normal: true, shadow: true, ..LayerSet::default() };
                let layout = &ChannelLayout::new(&set);
                let is_one = |i: usize| i % 11 != 4;
                let mut together = Vec::new();
                shade_into(&mut together, input, is_one, layout, None).unwrap();
                let mut each = vec![0.0; together.len()];
                for (i, out) in each.chunks_exact_mut(layout.count()).enumerate().filter(|(i, _)| is_one(*i)) {
                    let (radiance, normal) = shade_splat(input, i);
                    radiance.write(normal, layout, out);
                }
                check(together, each);
            }
        }
    }

    #[test]
    fn splats_together_are_as_one_by_one() {
        let mut pictures = 0;
        for_each_picture(&cloud(3000), |together, each| {
            for (k, (found, expected)) in together.iter().zip(&each).enumerate() {
                assert!((found - expected).abs() <= 4e-6 * expected.abs().max(0.01), "{k}: {found} for {expected}");
            }
            assert!(each.iter().any(|v| *v > 1.0));
            pictures += 1;
        });
        assert_eq!(pictures, 4);
    }

    #[test]
    fn a_splat_has_the_same_bits_among_others() {
        let mut few = Vec::new();
        let mut many = Vec::new();
        for_each_picture(&cloud(50), |together, _| few.push(together));
        for_each_picture(&cloud(5000), |together, _| many.push(together));
        assert!(few.iter().zip(&many).all(|(few, many)| few[..] == many[..few.len()]));
    }
}
