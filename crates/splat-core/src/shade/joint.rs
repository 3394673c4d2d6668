//! Light within a splat of a medium whose spacing is optically thick: the joint integral of what is left of it on its way in and out.
//!
//! A splat stands for a cell of its medium, a spacing h wide. Light that it scatters has come through a part of that cell, and what the eye
//! sees leaves through a part of it. Both parts belong together: what is seen of a thick cell lies at the face that the eye sees, and gets
//! the light of that place, not of the middle. With optical depths A_l toward the light and A_e toward the eye the cell sends
//!
//! L = ∫ e^(−A_l − A_e) dV / ∫ e^(−A_e) dV
//!
//! of the light before all shadows; the denominator is what compositing multiplies it with. Within a cell both depths are taken as linear: A_l = a +
//! g_l·x/h and A_e = b + g_e·x/h, a at the middle. With a cell that is h wide along whatever direction depths grow,
//! ∫ e^(−g·x/h) dV = sinh(|g|/2)/(|g|/2), and so
//!
//! L = e^−a · sinh(s/2)/s · e/sinh(e/2) = e^−(a − (s − e)/2) · M(s)/M(e),   s = |g_l + g_e|, e = |g_e|, M(x) = (1 − e^−x)/x
//!
//! Light against the view is the same form: there s < e. In a slab of layers h thick, seen and lit at the cosines μ and μ₀, g_l is τ/μ₀ and
//! g_e is τ/μ along the normal. Then layer n sends e^(−nτ/μ₀)·∫₀¹ e^(−τs(1/μ + 1/μ₀)) ds/∫₀¹ e^(−τs/μ) ds, and all layers together have the closed
//! form of the slab, μ₀/(μ₀ + μ)·(1 − e^(−T(1/μ + 1/μ₀))). Where spacings are thin L is e^−a to second order, which needs no more than the middle.
//!
//! **Slanted views.** Splats are flat across the view and come in the order of their middles, so an eye that looks along layers aslant sees some of the
//! deeper ones before all of the first: it misses the share δ of that, which `early` has by a fit to a lattice of splats. What is lost of the
//! light so is δ·(1 − e^−g) of what the first layer sends, g the growth of A_l along g_e; [`joint`] gives it back.
//!
//! Depths come from two maps, the light's and one of the eye, each looked up at the middle of the cell and of its six faces. They are interpolated as
//! absorbances: means of transmittances between rays are those of the brightest ray. A map blurs a medium across its
//! rays as splats do, so its depths grow too early and too slowly near a face of the medium; how fast they grow inside is known from the
//! splat itself: its own depth over the cosine of light and face. What a map has before a cell more than
//! two widths outside, and is not a third of the cell's own depth, is blur.

use super::{ShadeInput, passing, to_eye};
use crate::{Cloud, FootprintStack, Receiver, SplatKind, Transmittance};
use glam::Vec3;

/// Optical depth of a spacing up to which the light at a splat's middle is that of the splat: it is right within 3·10⁻⁴ there.
pub const THIN: f32 = 1.0 / 16.0;
/// Optical depth of a spacing from which on the joint integral counts alone. Between the two both are mixed, so nothing jumps.
pub const THICK: f32 = 1.0 / 8.0;
/// Least cosine of light and lit face: beyond, a slab gets next to no light.
const LEAST_COSINE: f32 = 0.2;
/// Depth before a cell, in cells, up to which it is blur of the map: .28 at the face of a slab at 60°, see the tests.
const BLUR: f32 = 0.3;
/// Depth before a cell, in cells, from which on it is what it is: one less the blur.
const CLEAR: f32 = 0.75;
/// Widths of a cell from its middle toward the light, along the normal, where the kernels of its layer end: what a map has there is no blur of it.
const BEYOND: f32 = 2.5;
/// Optical depth before a cell from which on its light is taken at its middle: e^−8, a third of a thousandth, of it is seen. The eye's map need reach no
/// farther than some cells behind.
pub const HIDDEN: f32 = 8.0;
/// Slope, over the cell's own depth, below which no direction can be told from it.
const FLAT: f32 = 1e-3;

/// What tells the light within thick splats.
#[derive(Clone, Copy)]
pub struct Within<'a> {
    /// The splats in their light.
    pub input: &'a ShadeInput<'a>,
    /// Transmittance from the eye to any point, relative to the origin of the cloud: a shadow map whose light is the eye, and all that is drawn casts.
    pub eye: &'a dyn Transmittance,
    /// Footprints by id, which tell spacings.
    pub footprints: &'a FootprintStack,
}

/// The spacing of the splats of a medium about one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MediumSpacing {
    /// World units.
    pub width: f32,
    /// Optical depth along it, to be multiplied with [`crate::Material::extinction_rgb`].
    pub optical_depth: f32,
}

impl MediumSpacing {
    /// That of splat `i`; `None` of a surface and of a 3D Gaussian.
    ///
    /// # Panics
    /// If there is no such splat, or its footprint is out of range.
    #[inline]
    pub fn of_splat(cloud: &Cloud, footprints: &FootprintStack, i: usize) -> Option<Self> {
        if cloud.kind[i] != SplatKind::Medium || cloud.gaussian_of(i).is_some() {
            return None;
        }
        let footprint = &footprints.layers()[cloud.footprint[i] as usize];
        let width = footprint.spacing_for_radius(cloud.radius[i]);
        Some(Self { width, optical_depth: cloud.cross_section[i] / (width * width) })
    }
}

/// A cell of a medium.
#[derive(Debug, Clone, Copy)]
pub struct MediumCell {
    /// Its middle, as receivers have it.
    pub position: Vec3,
    /// Its width, world units.
    pub width: f32,
    /// Cutoff radius of its splat, world units.
    pub radius: f32,
    /// Optical depth of its width by channel.
    pub optical_depth: [f32; 3],
    /// Whether it is a part of what absorbs.
    pub absorbs: bool,
}

/// Optical depth toward a light, or the eye, about a cell, in one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthAbout {
    /// At the face where the light comes in.
    pub before: f32,
    /// From this face to the one behind; along the normal of the lit face, toward the light.
    pub across: Vec3,
}

/// What a map has about a cell in one channel: absorbances at its middle and where no blur of its layer reaches, and how much it falls over the cell.
#[derive(Debug, Clone, Copy)]
struct Looked {
    middle: f32,
    beyond: f32,
    slope: Vec3,
}

impl MediumCell {
    /// A point of it that takes light.
    fn receiver(&self, offset: Vec3) -> Receiver {
        let position = self.position + offset;
        Receiver { position, normal: Vec3::ZERO, radius: self.radius, kind: SplatKind::Medium }
    }

    /// Whether nothing is seen of it from `eye`, nor of what lies around it up to where no kernel of its layer reaches. An eye that looks along a face of
    /// a thick medium has a great depth even before the outermost cells, by which alone they would count as hidden.
    fn is_hidden(&self, eye: &dyn Transmittance) -> bool {
        let around = [Vec3::ZERO, Vec3::NEG_X, Vec3::X, Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z, Vec3::Z];
        let depths = eye.absorbances_about(&around.map(|side| self.receiver(BEYOND * self.width * side)));
        depths.iter().flatten().all(|depth| *depth > HIDDEN)
    }

    /// Optical depths by channel about the cell toward what `shadow` has the transmittance of, which lies in the unit direction `towards`.
    pub fn depths(&self, shadow: &dyn Transmittance, towards: Vec3) -> [DepthAbout; 3] {
        let half = 0.5 * self.width;
        let about = [Vec3::ZERO, Vec3::NEG_X, Vec3::X, Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z, Vec3::Z];
        let [middle, faces @ ..] = shadow.absorbances_about(&about.map(|side| self.receiver(half * side)));
        let mut slopes = [Vec3::ZERO; 3];
        for (axis, [behind, ahead]) in faces.as_chunks().0.iter().enumerate() {
            for channel in 0..3 {
                slopes[channel][axis] = behind[channel] - ahead[channel];
            }
        }
        let strongest = slopes.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let outward = strongest.and_then(Vec3::try_normalize).unwrap_or(towards);
        let beyond = shadow.absorbance(&self.receiver(outward * (BEYOND * self.width)));
        let of_channel = |channel| Looked { middle: middle[channel], beyond: beyond[channel], slope: slopes[channel] };
        std::array::from_fn(|channel| self.depth(&of_channel(channel), channel, towards))
    }

    /// The depths of one channel, from what a map has.
    fn depth(&self, looked: &Looked, channel: usize, towards: Vec3) -> DepthAbout {
        let Looked { middle, beyond, slope } = *looked;
        let optical_depth = self.optical_depth[channel];
        // Beside an edge of somebody's shadow a map falls by any amount.
        let grown = slope.length().min(optical_depth / LEAST_COSINE);
        let normal = if slope.length() > FLAT * optical_depth { slope.normalize() } else { towards };
        let within = optical_depth / normal.dot(towards).max(LEAST_COSINE);
        let across = if self.absorbs { grown.max(within) } else { grown };
        if across <= 0.0 {
            return DepthAbout { before: middle, across: Vec3::ZERO };
        }
        let face = (middle - 0.5 * grown).max(0.0);
        // Somebody else's shadow is no blur.
        let others = beyond.min(face);
        let before = others + across * unblurred((face - others) / across);
        DepthAbout { before, across: normal * across }
    }
}

impl DepthAbout {
    /// At the middle of the cell.
    pub fn middle(&self) -> f32 {
        self.before + 0.5 * self.across.length()
    }
}

/// Depth before a cell without the blur of the map, both in cells.
fn unblurred(before: f32) -> f32 {
    if before >= CLEAR { before } else { ((before - BLUR) * (CLEAR / (CLEAR - BLUR))).max(0.0) }
}

/// Share of what is seen of the first layer that deeper ones hide, at an optical depth of a cell along the view and the squared sine of view and normal.
///
/// A fit to splats of the default footprint in a cubic lattice whose layers lie across an axis, in f64: by .125·s⁴·τ²/(1 + .7τ² + .03τ⁴) slabs lit at 0° and 60°
/// have .97 to 1.015 of their closed form at views of 0° to 80° in any azimuth, and within 2 % at most of them; .95 just beyond 45°, where rows of
/// splats change places in the order. Without it they have .92 at 60°.
fn early(optical_depth: f32, sine_sq: f32) -> f32 {
    let square = optical_depth * optical_depth;
    // In quotients, so that no square of a large depth is infinite.
    if square < 1.0 {
        0.125 * sine_sq * sine_sq * square / (1.0 + square * (0.7 + 0.03 * square))
    } else {
        0.125 * sine_sq * sine_sq / (square.recip() + 0.7 + 0.03 * square)
    }
}

/// [`joint`] with what slanted views lose of it, to an eye in the unit direction `to_eye`.
pub fn joint_aslant(light: &DepthAbout, eye: &DepthAbout, to_eye: Vec3) -> f32 {
    let sent = joint(light, eye);
    let depth = eye.across.length();
    if depth <= 0.0 {
        return sent;
    }
    let normal = eye.across / depth;
    let growth = light.across.dot(normal);
    let cosine = normal.dot(to_eye).clamp(0.0, 1.0);
    // Over what it is of the first layer, the share of all layers of an endless slab.
    let first = if growth > 0.0 { depth * mean(depth) / ((depth + growth) * mean(depth + growth)) } else { 1.0 };
    let lost = early(depth, 1.0 - cosine * cosine) * -libm::expm1f(-growth.max(-1.0)) / first;
    (sent * (1.0 + lost)).min(1.0)
}

/// Share of the light that a cell sends to the eye as if it had come there through nothing.
pub fn joint(light: &DepthAbout, eye: &DepthAbout) -> f32 {
    let light_alone = light.across.length();
    let eye_alone = eye.across.length();
    let both = (light.across + eye.across).length();
    // Never negative: a side of a triangle is no longer than the two others.
    let lost = light.before + 0.5 * (light_alone + eye_alone - both).max(0.0);
    libm::expf(-lost) * mean(both) / mean(eye_alone)
}

/// Mean of e^−t over t from 0 to `depth`.
pub fn mean(depth: f32) -> f32 {
    if depth < 1e-3 { 1.0 - 0.5 * depth } else { -libm::expm1f(-depth) / depth }
}

/// How much of the joint integral counts at an optical depth of a spacing.
pub fn thickness(optical_depth: f32) -> f32 {
    ((optical_depth - THIN) / (THICK - THIN)).clamp(0.0, 1.0)
}

/// A splat that is lit by the joint integral.
#[derive(Debug, Clone, Copy)]
pub(super) struct ThickSplat {
    cell: MediumCell,
    eye: [DepthAbout; 3],
    to_eye: Vec3,
    /// How much the joint integral counts.
    weight: f32,
}

impl ThickSplat {
    /// Splat `i` as a thick one; `None` where its middle tells its light, and of what is no medium.
    #[inline]
    pub(super) fn new(within: &Within<'_>, i: usize) -> Option<Self> {
        let input = within.input;
        let cloud = input.cloud;
        let spacing = MediumSpacing::of_splat(cloud, within.footprints, i)?;
        let material = &input.materials[cloud.material[i] as usize];
        let weight = thickness(spacing.optical_depth * material.greatest_extinction());
        if weight <= 0.0 {
            return None;
        }
        let cell = MediumCell {
            position: cloud.position[i],
            width: spacing.width,
            radius: cloud.radius[i],
            optical_depth: material.extinction_rgb.map(|factor| factor * spacing.optical_depth),
            absorbs: true,
        };
        // Nothing is seen of most splats of a thick medium.
        let before = within.eye.absorbance(&cell.receiver(Vec3::ZERO));
        let is_deep = |channel: usize| before[channel] - 0.5 * cell.optical_depth[channel] / LEAST_COSINE > HIDDEN;
        if (0..3).all(is_deep) && cell.is_hidden(within.eye) {
            return None;
        }
        let to_eye = to_eye(input, i);
        let eye = cell.depths(within.eye, to_eye);
        Some(Self { cell, eye, to_eye, weight })
    }

    /// Share of a light that the splat sends on, where `through` arrives at its middle and it takes the share `coefficient` of the shadow.
    pub(super) fn received(
        &self,
        input: &ShadeInput<'_>,
        i: usize,
        rank: usize,
        through: [f32; 3],
        coefficient: f32,
    ) -> [f32; 3] {
        let lit = &input.lights[rank];
        let Some(shadow) = lit.shadow.filter(|_| through != [0.0; 3]) else { return passing(through, coefficient) };
        let place = input.cloud.origin + self.cell.position.as_dvec3();
        let to_light = lit.light.irradiance(place, f64::from(self.cell.radius) / 3.0).to_light;
        let absorbs = input.objects[input.cloud.object[i] as usize].casts_shadow;
        let cell = MediumCell { absorbs, ..self.cell };
        let depths = cell.depths(shadow, to_light.as_vec3().normalize_or_zero());
        let mixed = |channel: usize| {
            let together = joint_aslant(&depths[channel], &self.eye[channel], self.to_eye);
            through[channel] + self.weight * (together - through[channel])
        };
        passing([0, 1, 2].map(mixed), coefficient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng;

    /// ∫ e^(−l(s) − e·s) ds/∫ e^(−e·s) ds over a cell from the eye's face on, in f64 by Simpson's rule.
    fn by_quadrature(light: [f64; 2], eye: f64) -> f64 {
        const STEPS: usize = 20_000;
        let sum = |integrand: &dyn Fn(f64) -> f64| {
            let term = |k: usize| {
                let weight = if k == 0 || k == STEPS { 1.0 } else { [2.0, 4.0][k % 2] };
                weight * integrand(k as f64 / STEPS as f64)
            };
            (0..=STEPS).map(term).sum::<f64>()
        };
        let lit = |s: f64| light[0] + (light[1] - light[0]) * s;
        sum(&|s| libm::exp(-lit(s) - eye * s)) / sum(&|s| libm::exp(-eye * s))
    }

    #[test]
    fn a_cell_sends_what_quadrature_finds_lit_from_before_and_from_behind() {
        for case in 0..400 {
            let number = |k| f64::from(rng::unit_f32(50, 2, case, k));
            let scale = [1e-6, 1e-2, 1.0, 20.0][case as usize % 4];
            let light = scale * (0.05 + number(0));
            let eye = scale * (0.05 + number(1));
            let before = 3.0 * number(2);
            let normal = Vec3::new(0.48, -0.6, 0.64);
            for side in [1.0, -1.0] {
                let found = joint(
                    &DepthAbout { before: before as f32, across: normal * (light * side) as f32 },
                    &DepthAbout { before: 0.0, across: normal * eye as f32 },
                );
                let ends = if side > 0.0 { [before, before + light] } else { [before + light, before] };
                let exact = by_quadrature(ends, eye);
                let error = (f64::from(found) - exact).abs();
                assert!(error < 1e-5 * exact + 1e-12, "{light} {eye} {side}: {found} for {exact}");
            }
        }
    }

    #[test]
    fn layers_of_cells_have_the_closed_form_of_their_slab() {
        for spacing in [1e-4, 0.01, 0.1, 0.25, 1.0, 2.0, 4.0, 8.0, 14.0] {
            for [view, light] in [[1.0, 1.0], [0.5, 1.0], [1.0, 0.4], [0.7, 0.3]] {
                let layers = 12;
                let across = |cosine: f64| Vec3::Y * (spacing / cosine) as f32;
                let sent = |n: i32| {
                    let lit = DepthAbout { before: (f64::from(n) * spacing / light) as f32, across: across(light) };
                    let weight = libm::exp(-f64::from(n) * spacing / view) * -libm::expm1(-spacing / view);
                    weight * f64::from(joint(&lit, &DepthAbout { before: 0.0, across: across(view) }))
                };
                let found: f64 = (0..layers).map(sent).sum();
                let whole = f64::from(layers) * spacing * (1.0 / view + 1.0 / light);
                let exact = light / (light + view) * -libm::expm1(-whole);
                assert!((found / exact - 1.0).abs() < 2e-5, "{spacing} at {view}, {light}: {found} for {exact}");
            }
        }
    }

    #[test]
    fn no_cell_sends_more_than_comes_to_it() {
        for case in 0..4000 {
            let number = |k| 2.0 * rng::unit_f32(50, 3, case, k) - 1.0;
            let vector = |k| Vec3::new(number(k), number(k + 1), number(k + 2)) * [0.01, 1.0, 30.0][case as usize % 3];
            let before = number(6).abs();
            let sent = joint(&DepthAbout { before, across: vector(0) }, &DepthAbout { before: 0.0, across: vector(3) });
            assert!(sent >= 0.0 && sent <= (-before).exp() * 1.00001, "{case}: {sent}");
        }
    }

    /// A slab that begins at y = 0 under a pane, lit from above.
    struct PaneOverSlab {
        pane: f32,
        spacing: f32,
    }

    impl Transmittance for PaneOverSlab {
        fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
            self.absorbance(receiver).map(|absorbance| (-absorbance).exp())
        }

        fn absorbance(&self, receiver: &Receiver) -> [f32; 3] {
            [self.pane + self.spacing * (-receiver.position.y).max(0.0); 3]
        }
    }

    #[test]
    fn the_shadow_of_a_pane_over_a_thick_slab_is_no_blur() {
        for spacing in [0.2, 1.0, 5.0, 12.0] {
            for layer in 0..3 {
                let cell = MediumCell {
                    position: Vec3::new(0.0, -0.5 - layer as f32, 0.0),
                    width: 1.0,
                    radius: 2.4,
                    optical_depth: [spacing; 3],
                    absorbs: true,
                };
                let [depth, ..] = cell.depths(&PaneOverSlab { pane: 1.386, spacing }, Vec3::Y);
                let exact = 1.386 + layer as f32 * spacing;
                assert!((depth.before - exact).abs() < 1e-4 * exact, "{spacing}, {layer}: {}", depth.before);
                assert!((depth.across - Vec3::Y * spacing).length() < 1e-4 * spacing);
            }
        }
    }

    #[test]
    fn the_blur_of_a_map_is_no_depth_and_depths_stay_in_order() {
        assert_eq!(unblurred(-0.2), 0.0);
        assert_eq!(unblurred(0.28), 0.0);
        assert_eq!(unblurred(1.02), 1.02);
        let mut last = 0.0;
        for step in 0..200 {
            let depth = unblurred(step as f32 * 0.01);
            assert!(depth >= last && depth - last < 0.02, "{step}");
            last = depth;
        }
    }
}
