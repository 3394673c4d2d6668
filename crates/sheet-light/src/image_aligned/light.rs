//! Light of neighbouring pixels at once: the radiance of [`splat_core::shade::Point`] for media, in view space, lane by lane.
//!
//! Lengths are counted from the first slab, so f32 has digits enough however far away the eye is. Cosines near 1 are had from
//! differences of unit vectors, 1 − cos θ = |u − v|²/2, which do not cancel.

use crate::shared::input::SheetInput;
use crate::shared::vectors::{difference, dot, sum, vector};
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::TRACE;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::LitBy;
use splat_core::{LightShape, Material, SHADED_EFFECTS, Shading, Slide, SlideProjection};
use std::f32::consts::PI;

/// A light as lanes read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lamp<'a> {
    shape: Shape,
    intensity: [f32; 3],
    slide: Option<SlideInView<'a>>,
    pub(crate) has_shadow: bool,
}

/// A slide, with its projection in view space.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SlideInView<'a> {
    slide: &'a Slide,
    origin: Vec3,
    axis: Option<Vec3>,
    across: Vec3,
    down: Vec3,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// The unit vector to the light.
    Parallel(Vec3),
    From(Vec3, Beam),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Beam {
    Even,
    /// Along a unit axis; 1 − cosine at the rim, and over how much of it the light grows to all, inverse.
    Cone(Vec3, [f32; 2]),
    /// With the cosine to a unit normal.
    Cosine(Vec3),
}

/// Where light is asked for.
#[derive(Clone, Copy)]
pub(crate) struct Spots<S: Simd> {
    /// View positions, depths from the first slab.
    pub(crate) places: [Lanes<S>; 3],
    /// Unit directions to the eye.
    pub(crate) to_eye: [Lanes<S>; 3],
    /// Unit normals where `is_normal` is 1; it is 0 where there is none.
    pub(crate) normal: [Lanes<S>; 3],
    pub(crate) is_normal: Lanes<S>,
    pub(crate) color: [Lanes<S>; 3],
}

/// A medium under its lights.
#[derive(Clone, Copy)]
pub(crate) struct Lit<S: Simd> {
    pub(crate) radiance: [Lanes<S>; 3],
    /// Green light that arrived, and that would without shadows.
    received: Lanes<S>,
    unshadowed: Lanes<S>,
}

/// What a medium does with light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reflector<'a> {
    pub(crate) material: &'a Material,
    /// Whether any of it may have normals that light is reflected about.
    pub(crate) has_normals: bool,
    /// Variance that softens lights nearby, world units².
    pub(crate) spread: f32,
    /// Share of shadows that it receives.
    pub(crate) shadow_coefficient: f32,
}

impl<'a> Lamp<'a> {
    /// The lights, in their order.
    pub(crate) fn list(input: &SheetInput<'a>, origin: f64) -> Vec<Self> {
        input.lights.iter().map(|lit| Self::new(lit, input, origin)).collect()
    }

    fn new(lit: &LitBy<'a>, input: &SheetInput<'a>, origin: f64) -> Self {
        let axes = input.camera.axes;
        let turned = |v: DVec3| DVec3::new(axes[0].dot(v), axes[1].dot(v), axes[2].dot(v)).as_vec3();
        let placed = |p: DVec3| (input.camera.view_from_world(p) - DVec3::Z * origin).as_vec3();
        let shape = match lit.light.shape {
            LightShape::Directional { direction } => Shape::Parallel(-turned(direction)),
            LightShape::Spot { position, direction, inner, outer } => {
                let [rim, full] = [outer, inner].map(|angle| 2.0 * libm::sin(0.5 * angle) * libm::sin(0.5 * angle));
                let per = (1.0 / (rim - full)).min(f64::from(f32::MAX)) as f32;
                Shape::From(placed(position), Beam::Cone(turned(direction), [rim as f32, per]))
            }
            shape => {
                let beam = shape.normal().map_or(Beam::Even, |normal| Beam::Cosine(turned(normal)));
                Shape::From(placed(shape.place().unwrap_or_default()), beam)
            }
        };
        let slide = lit.slide.map(|slide| {
            let SlideProjection { origin, axis, across, down } = *slide.projection();
            let origin = placed(origin);
            let axis = axis.map(turned);
            SlideInView { slide, origin, axis, across: turned(across), down: turned(down) }
        });
        Self { shape, intensity: lit.light.intensity, slide, has_shadow: lit.shadow.is_some() }
    }

    /// Directions to the light, and which share of its intensity is irradiance there without shadow.
    #[inline(always)]
    fn arriving<S: Simd>(&self, simd: S, places: &[Lanes<S>; 3], spread: f32) -> ([Lanes<S>; 3], Lanes<S>) {
        let (place, beam) = match self.shape {
            Shape::Parallel(to_light) => return (vector(simd, to_light), simd.lanes(1.0)),
            Shape::From(place, beam) => (place, beam),
        };
        let way = [simd.lanes(place.x) - places[0], simd.lanes(place.y) - places[1], simd.lanes(place.z) - places[2]];
        let falloff = simd.lanes(1.0) / (dot(&way, &way) + simd.lanes(spread)).max(simd.lanes(f32::MIN_POSITIVE));
        let inverse = falloff.sqrt();
        let to_light = [way[0] * inverse, way[1] * inverse, way[2] * inverse];
        match beam {
            Beam::Even => (to_light, falloff),
            Beam::Cosine(normal) => {
                let cosine = simd.lanes(0.0) - dot(&to_light, &vector(simd, normal));
                (to_light, falloff * cosine.max(simd.lanes(0.0)))
            }
            Beam::Cone(axis, [rim, per]) => {
                let apart = sum(&to_light, &vector(simd, axis));
                // A direction is shorter than 1 by what softens the light.
                let beside = (dot(&apart, &apart) + simd.lanes(spread) * falloff) * simd.lanes(0.5);
                let t = ((simd.lanes(rim) - beside) * simd.lanes(per)).max(simd.lanes(0.0)).min(simd.lanes(1.0));
                (to_light, falloff * t * t * (simd.lanes(3.0) - simd.lanes(2.0) * t))
            }
        }
    }
}

impl SlideInView<'_> {
    /// What it lets through, as [`Slide::passing`] has it: places by lanes, look-ups one by one.
    #[inline(always)]
    fn passing<S: Simd>(&self, simd: S, places: &[Lanes<S>; 3], spread: f32) -> [Lanes<S>; 3] {
        let way = [
            places[0] - simd.lanes(self.origin.x),
            places[1] - simd.lanes(self.origin.y),
            places[2] - simd.lanes(self.origin.z),
        ];
        let mut depth = simd.lanes(1.0);
        if let Some(axis) = self.axis {
            depth = dot(&way, &vector(simd, axis));
        }
        let half = simd.lanes(0.5);
        let mut numbers = [[0.0; MAX_LANES]; 3];
        let sides = [dot(&way, &vector(simd, self.across)), dot(&way, &vector(simd, self.down)), depth];
        numbers
            .iter_mut()
            .zip([sides[0] / depth + half, sides[1] / depth + half, depth])
            .for_each(|(to, v)| v.store(to));
        let per = f64::from(spread.sqrt() * self.across.length());
        let mut passing = [[0.0; MAX_LANES]; 3];
        for lane in 0..Lanes::<S>::COUNT {
            let [u, v, depth] = numbers.map(|n| f64::from(n[lane]));
            if depth > 0.0 {
                let seen = self.slide.look_up([u, v], per / depth);
                (0..3).for_each(|c| passing[c][lane] = seen[c]);
            }
        }
        [Lanes::load(simd, &passing[0]), Lanes::load(simd, &passing[1]), Lanes::load(simd, &passing[2])]
    }
}

impl Reflector<'_> {
    /// Adds a lamp, of which the share `through` passes by what casts shadows.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        lamp: &Lamp<'_>,
        spots: &Spots<S>,
        through: &[Lanes<S>; 3],
        lit: &mut Lit<S>,
    ) {
        let (to_light, share) = lamp.arriving(simd, &spots.places, self.spread);
        let (factor, specular) = self.factors(simd, spots, &to_light);
        let mut passing = [simd.lanes(1.0); 3];
        if let Some(slide) = &lamp.slide {
            passing = slide.passing(simd, &spots.places, self.spread);
        }
        for c in 0..3 {
            let irradiance = share * simd.lanes(lamp.intensity[c]) * passing[c];
            let irradiance = irradiance.where_less(simd.lanes(TRACE), irradiance);
            let arrives = if lamp.has_shadow { irradiance * self.taken(simd, through[c]) } else { irradiance };
            lit.radiance[c] = arrives.mul_add(spots.color[c].mul_add(factor, specular), lit.radiance[c]);
            if c == 1 {
                (lit.received, lit.unshadowed) = (lit.received + arrives, lit.unshadowed + irradiance);
            }
        }
    }

    /// Radiance by effect: ambient, emission, direct, scattered once.
    #[inline(always)]
    pub(crate) fn effects<S: Simd>(
        &self,
        simd: S,
        spots: &Spots<S>,
        ambient: [f32; 3],
        lit: &Lit<S>,
    ) -> [[Lanes<S>; 3]; SHADED_EFFECTS.len()] {
        let m = self.material;
        let zero = simd.lanes(0.0);
        let half = simd.lanes(0.5);
        let mut out = [[zero; 3]; SHADED_EFFECTS.len()];
        let is_unlit = m.shading == Shading::Unlit;
        let is_normal = if m.shading == Shading::Phase { zero } else { spots.is_normal };
        let albedo = simd.lanes(m.single_scattering_albedo);
        let reflectance = albedo.where_less_or(is_normal, half, simd.lanes(m.diffuse));
        for c in 0..3 {
            let emission = simd.lanes(m.emission[c]);
            if is_unlit {
                out[1][c] = emission + spots.color[c];
                continue;
            }
            out[0][c] = spots.color[c] * reflectance * simd.lanes(ambient[c] * m.ambient);
            out[1][c] = emission;
            out[2][c] = lit.radiance[c].where_less(half, is_normal);
            out[3][c] = lit.radiance[c].where_less(is_normal, half);
        }
        out
    }

    /// What arrives where a medium takes its share of a shadow.
    #[inline(always)]
    fn taken<S: Simd>(&self, simd: S, through: Lanes<S>) -> Lanes<S> {
        let one = simd.lanes(1.0);
        (one - through).negate_mul_add(simd.lanes(self.shadow_coefficient), one)
    }

    /// Per unit irradiance: the factor on the colour, and what is specular.
    #[inline(always)]
    fn factors<S: Simd>(&self, simd: S, spots: &Spots<S>, to_light: &[Lanes<S>; 3]) -> (Lanes<S>, Lanes<S>) {
        let zero = simd.lanes(0.0);
        let half = simd.lanes(0.5);
        if self.material.shading == Shading::Phase || !self.has_normals {
            return (self.scatter(simd, &spots.to_eye, to_light), zero);
        }
        let (diffuse, specular) = self.reflect(simd, spots, to_light);
        if !spots.is_normal.any_less(half) {
            return (diffuse, specular);
        }
        let scattered = self.scatter(simd, &spots.to_eye, to_light);
        (scattered.where_less_or(spots.is_normal, half, diffuse), zero.where_less_or(spots.is_normal, half, specular))
    }

    /// Albedo times the phase function of Henyey and Greenstein, as [`splat_core::henyey_greenstein`] has it.
    #[inline(always)]
    fn scatter<S: Simd>(&self, simd: S, to_eye: &[Lanes<S>; 3], to_light: &[Lanes<S>; 3]) -> Lanes<S> {
        let g = self.material.asymmetry.abs();
        let whole = self.material.single_scattering_albedo * (1.0 - g) * (1.0 + g) / (4.0 * PI);
        let apart = if self.material.asymmetry >= 0.0 { sum(to_light, to_eye) } else { difference(to_light, to_eye) };
        let d = dot(&apart, &apart).mul_add(simd.lanes(g), simd.lanes((1.0 - g) * (1.0 - g)));
        simd.lanes(whole) / (d * d.sqrt())
    }

    /// Diffuse and specular reflection, as [`Material::reflect`] has them.
    #[inline(always)]
    fn reflect<S: Simd>(&self, simd: S, spots: &Spots<S>, to_light: &[Lanes<S>; 3]) -> (Lanes<S>, Lanes<S>) {
        let m = self.material;
        let cosine = dot(&spots.normal, to_light);
        let front = cosine.max(simd.lanes(0.0));
        let back = (simd.lanes(0.0) - cosine).max(simd.lanes(0.0));
        let diffuse =
            (front * simd.lanes(1.0 - m.transmission) + back * simd.lanes(m.transmission)) * simd.lanes(m.diffuse / PI);
        if m.specular <= 0.0 {
            return (diffuse, simd.lanes(0.0));
        }
        // r·v, r the light mirrored at the normal.
        let mirrored = (simd.lanes(2.0) * cosine) * dot(&spots.normal, &spots.to_eye) - dot(to_light, &spots.to_eye);
        let lobe = power(simd, mirrored, m.shininess);
        (diffuse, lobe * front * simd.lanes(m.specular * (m.shininess + 2.0) / (2.0 * PI)))
    }
}

impl<S: Simd> Lit<S> {
    #[inline(always)]
    pub(crate) fn dark(simd: S) -> Self {
        let zero = simd.lanes(0.0);
        Self { radiance: [zero; 3], received: zero, unshadowed: zero }
    }

    /// Share of green light that shadows let through; 1 where no light arrives.
    #[inline(always)]
    pub(crate) fn shadow(&self, simd: S) -> Lanes<S> {
        let zero = simd.lanes(0.0);
        let least = simd.lanes(f32::MIN_POSITIVE);
        (self.received / self.unshadowed.max(least)).where_less_or(zero, self.unshadowed, simd.lanes(1.0))
    }
}

/// max(x, 0)^exponent for x ≤ 1 or next to it, exponent ≥ 0; 0⁰ is 1.
#[inline(always)]
fn power<S: Simd>(simd: S, x: Lanes<S>, exponent: f32) -> Lanes<S> {
    if exponent == 0.0 {
        return simd.lanes(1.0);
    }
    let positive = (simd.lanes(-exponent) * x.max(simd.lanes(f32::MIN_POSITIVE)).logarithm()).exp_neg();
    positive.where_less(simd.lanes(0.0), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::raster::pulp;
    use splat_core::shade::Point;
    use splat_core::{Camera, Framing, Light, Projection, RadianceImage, rng};

    /// Numbers in \[−1, 1) of one trial.
    struct Trial(u64, u64);

    impl Trial {
        fn next(&mut self) -> f64 {
            self.1 += 1;
            2.0 * rng::unit(5, 0, self.0, self.1) - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }

        fn share(&mut self) -> f32 {
            (0.5 + 0.5 * self.next()) as f32
        }

        fn material(&mut self) -> Material {
            let shading = [Shading::Phong, Shading::Phong, Shading::Phase, Shading::Unlit][self.0 as usize % 4];
            let shininess = [0.0, 1.0, 32.0, 7.5, 120.0][self.0 as usize % 5];
            Material {
                shading,
                shininess,
                ambient: self.share(),
                diffuse: self.share(),
                specular: if self.0.is_multiple_of(3) { 0.0 } else { self.share() },
                transmission: self.share(),
                single_scattering_albedo: self.share(),
                asymmetry: 0.95 * self.next() as f32,
                emission: [self.share(), 0.0, 0.5],
                ..Material::default()
            }
        }

        fn lights<'a>(&mut self) -> Vec<LitBy<'a>> {
            let mut place = || 2.0 * self.vector();
            let positions = [place(), place(), place()];
            let direction = self.vector().normalize();
            let normal = self.vector().normalize();
            let inner = f64::from(self.share());
            let shapes = [
                LightShape::Directional { direction },
                LightShape::Point { position: positions[0] },
                LightShape::Spot { position: positions[1], direction: normal, inner, outer: inner + 0.3 },
                LightShape::Patch { position: positions[2], normal },
            ];
            let light = |shape| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.0, 0.5] }, shadow: None };
            shapes.map(light).to_vec()
        }

        /// A slide that a light shines through, of 5 by 3 texels.
        fn slide(&mut self, light: &LightShape) -> Slide {
            let image = RadianceImage { size: [5, 3], pixels: (0..15).map(|_| [0; 3].map(|_| self.share())).collect() };
            let framing = Framing { up: self.vector(), width: Some(4.0), center: self.vector() };
            Slide::new(&image, light, &framing).unwrap()
        }
    }

    /// All effects and the shadow of one point by lanes.
    struct ByLanes<'a> {
        lamps: &'a [Lamp<'a>],
        reflector: Reflector<'a>,
        place: Vec3,
        to_eye: Vec3,
        normal: Vec3,
        color: [f32; 3],
        through: &'a [[f32; 3]],
    }

    impl pulp::WithSimd for ByLanes<'_> {
        type Output = Vec<f32>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
            let is_normal = simd.lanes(if self.normal == Vec3::ZERO { 0.0 } else { 1.0 });
            let places = vector(simd, self.place);
            let to_eye = vector(simd, self.to_eye);
            let color = vector(simd, Vec3::from_array(self.color));
            let spots = Spots { places, to_eye, normal: vector(simd, self.normal), is_normal, color };
            let mut lit = Lit::dark(simd);
            if self.reflector.material.shading != Shading::Unlit {
                for (lamp, through) in self.lamps.iter().zip(self.through) {
                    self.reflector.add(simd, lamp, &spots, &vector(simd, Vec3::from_array(*through)), &mut lit);
                }
            }
            let effects = self.reflector.effects(simd, &spots, [0.1, 0.2, 0.3], &lit);
            let shadow = lit.shadow(simd);
            let number = |lanes: &Lanes<S>| {
                let mut out = [0.0; MAX_LANES];
                lanes.store(&mut out);
                out[0]
            };
            effects.as_flattened().iter().chain([&shadow]).map(number).collect()
        }
    }

    #[test]
    fn light_by_lanes_is_that_of_points() {
        let mut lit = 0;
        for n in 0..3000 {
            let mut trial = Trial(n, 0);
            let eye = trial.vector() * 5.0;
            let target = trial.vector();
            let view = Projection::Perspective { fov_y: 1.0 };
            let camera = Camera::look_at(eye, target, DVec3::Y, view, [8, 8]).unwrap();
            let material = trial.material();
            let mut lights = trial.lights();
            let position = trial.vector();
            lights.iter_mut().for_each(|lit| lit.light.validate(0).unwrap());
            let slides = [0, 2].map(|k: usize| Trial(n + 10_000 * (1 + k as u64), 0).slide(&lights[k].light.shape));
            if n.is_multiple_of(2) {
                (lights[0].slide, lights[2].slide) = (Some(&slides[0]), Some(&slides[1]));
            }
            let normal = if n.is_multiple_of(7) { Vec3::ZERO } else { trial.vector().normalize().as_vec3() };
            let through: Vec<[f32; 3]> = lights.iter().map(|_| [trial.share(), trial.share(), 0.0]).collect();
            let to_eye = (eye - position).normalize().as_vec3();
            let coefficient = trial.share();
            let color = [0.9, 0.5, 1.2];
            let radius = 0.3;
            let point = Point { position, radius, normal, to_eye, color, material: &material };
            let exact = point.radiance([0.1, 0.2, 0.3], lights.iter(), |rank, _| {
                through[rank].map(|t| 1.0 - coefficient * (1.0 - t))
            });
            let mut input = SheetInput {
                volumes: Vec::new(),
                splats: None,
                camera: &camera,
                lights,
                shadow_origin: DVec3::ZERO,
                ambient: [0.0; 3],
            };
            let turned = |v: Vec3| Vec3::from_array(camera.axes.map(|axis| axis.as_vec3().dot(v)));
            let mut lamps = Lamp::list(&input, 2.5);
            lamps.iter_mut().for_each(|lamp| lamp.has_shadow = true);
            input.lights.clear();
            let has_normals = !n.is_multiple_of(14);
            let reflector =
                Reflector { material: &material, has_normals, spread: 0.01, shadow_coefficient: coefficient };
            let place = (camera.view_from_world(position) - 2.5 * DVec3::Z).as_vec3();
            let to_eye = turned(to_eye);
            let normal = turned(normal);
            let by_lanes = ByLanes { lamps: &lamps, reflector, place, to_eye, normal, color, through: &through };
            let effects = exact.effects();
            let expected = effects.as_flattened().iter().chain([&exact.shadow]);
            let scale = effects.as_flattened().iter().fold(1.0f32, |most, e| most.max(*e));
            for (k, (found, expected)) in pulp::Arch::new().dispatch(by_lanes).into_iter().zip(expected).enumerate() {
                assert!(
                    (found - expected).abs() < 2e-5 * scale,
                    "{n}, {k}: {found}, expected {expected}; {material:?}"
                );
                lit += u32::from(k >= 6 && *expected > 0.01);
            }
        }
        assert!(lit > 3000, "{lit} numbers");
    }
}
