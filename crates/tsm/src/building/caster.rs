//! Casters: the splats of a cloud that throw shadows, in the light's frame.

use crate::frame::Frame;
use crate::mapping::floor;
use crate::{Params, Scene};
use glam::Vec3;
use splat_core::optics::{self, AbsorbanceModel, SurfaceOpacity};
use splat_core::{Cloud, Footprint, FootprintStack, Material, Object, SplatKind, glam};

/// Normalised kernel of one footprint id, in f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kernel {
    sharpness: f32,
    rim: f32,
    /// 1/∫w dA for R = 1.
    pub(crate) norm: f32,
    /// R/σ of the Gaussian that is cut.
    pub(crate) cutoff: f32,
    /// Standard deviation along one axis, for R = 1.
    pub(crate) deviation: f32,
}

impl Kernel {
    /// The kernels of a stack.
    pub(crate) fn of_stack(stack: &FootprintStack) -> Vec<Self> {
        let kernel = |f: &splat_core::Footprint| Self {
            sharpness: f.sharpness(),
            rim: libm::expf(-f.sharpness()),
            norm: f.norm() as f32,
            cutoff: f.cutoff,
            deviation: deviation(f),
        };
        stack.layers().iter().map(kernel).collect()
    }

    /// Profile at s = ρ²/R², see [`splat_core::Footprint::profile`].
    #[inline(always)]
    pub(crate) fn profile(&self, s: f32) -> f32 {
        let x = self.sharpness * (1.0 - s);
        let inside = exp_negative(self.sharpness * s) - self.rim * (1.0 + x + 0.5 * x * x);
        if s < 1.0 { inside } else { 0.0 }
    }
}

/// √(½·∫s·w dA/∫w dA) with s and w of [`splat_core::Footprint::profile`], in closed form.
fn deviation(f: &Footprint) -> f32 {
    let q = 0.5 * f64::from(f.cutoff).powi(2);
    let rim = libm::exp(-q);
    let moment = (1.0 - rim * (1.0 + q)) / (q * q) - rim * (0.5 + q / 6.0 + q * q / 24.0);
    (0.5 * std::f64::consts::PI * f.norm() * moment).sqrt() as f32
}

/// 2^f on [0, 1] in powers of f; errs by less than 3e-7 of its value.
const EXP2: [f32; 6] = [0.999_999_9, 0.693_154_5, 0.240_141_82, 0.055_860_337, 0.008_949_591, 0.001_893_754_1];

/// e^−x for 0 ≤ x ≤ 64, in registers.
#[inline(always)]
fn exp_negative(x: f32) -> f32 {
    let y = x * std::f32::consts::LOG2_E;
    let whole = floor(y) + 1;
    let part = whole as f32 - y;
    let mantissa = EXP2.iter().rev().fold(0.0, |sum, c| sum * part + c);
    f32::from_bits(((127 - whole) << 23) as u32) * mantissa
}

/// What a material does to light that passes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extinction {
    /// Per channel, relative to the cross-section.
    pub(crate) rgb: [f32; 3],
    pub(crate) opacity: SurfaceOpacity,
}

impl Default for Extinction {
    fn default() -> Self {
        Self::from_material(&Material::default())
    }
}

impl Extinction {
    pub(crate) fn from_material(material: &Material) -> Self {
        Self { rgb: material.extinction_rgb, opacity: material.surface_opacity }
    }
}

/// One caster in the light's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Caster {
    pub(crate) position: Vec3,
    /// Distance from the light or from the plane where parallel light starts.
    pub(crate) distance: f32,
    pub(crate) kind: SplatKind,
    /// Cutoff radius of the kernel; for an opaque disc its radius.
    pub(crate) radius: f32,
    /// 1/R² of media.
    pub(crate) inverse_radius_sq: f32,
    /// Cross-section K.
    pub(crate) cross_section: f32,
    /// Semi-axes of the disc, for surfaces.
    pub(crate) axes: [Vec3; 2],
    /// Unit normal, zero for media.
    pub(crate) normal: Vec3,
    pub(crate) kernel: Kernel,
    pub(crate) extinction: Extinction,
    /// Absorbance in every covered cell by the paper's Eq. 6, where that model is asked for.
    pub(crate) paper_absorbance: Option<f32>,
}

/// Makes casters of the splats of one cloud.
pub(crate) struct Casters<'a> {
    pub(crate) cloud: &'a Cloud,
    pub(crate) extinctions: Vec<Extinction>,
    /// What has no more of its cross-section over its radius² casts no shadow.
    faintest: f32,
    pub(crate) objects: &'a [Object],
    pub(crate) kernels: Vec<Kernel>,
    pub(crate) params: &'a Params,
    /// Whether some object may throw no shadow, and whether some material may absorb channels differently.
    pub(crate) may_spare: bool,
    pub(crate) may_colour: bool,
}

impl<'a> Casters<'a> {
    pub(crate) fn new(scene: &Scene<'a>, params: &'a Params) -> Self {
        let Scene { cloud, materials, objects } = *scene;
        let extinctions: Vec<_> = materials.iter().map(Extinction::from_material).collect();
        let is_coloured = |e: &Extinction| e.rgb[0] != e.rgb[1] || e.rgb[1] != e.rgb[2];
        Self {
            cloud,
            objects,
            kernels: Kernel::of_stack(&params.footprints),
            params,
            may_spare: objects.iter().any(|o| !o.casts_shadow),
            may_colour: extinctions.iter().any(is_coloured) || is_coloured(&Extinction::default()),
            extinctions,
            faintest: optics::faintest(materials),
        }
    }
}

impl Casters<'_> {
    /// Whether splat `i` throws a shadow at all: its optical depth, within a factor of two of its cross-section over its radius², is not
    /// too faint to be seen.
    #[inline(always)]
    pub(crate) fn casts(&self, i: usize) -> bool {
        let casts = |object: u32| self.objects.get(object as usize).is_none_or(|o| o.casts_shadow);
        let radius = self.cloud.radius[i];
        let cross_section = self.cloud.cross_section[i];
        cross_section > self.faintest * radius * radius && (!self.may_spare || casts(self.cloud.object[i]))
    }

    /// Whether splat `i` throws its shadow as a disc of its area.
    #[inline(always)]
    pub(crate) fn is_opaque_disc(&self, i: usize) -> bool {
        self.cloud.kind[i] == SplatKind::Opaque && self.has_opaque_discs()
    }

    /// Whether opaque splats throw their shadows as discs.
    #[inline(always)]
    pub(crate) fn has_opaque_discs(&self) -> bool {
        self.params.absorbance == AbsorbanceModel::CrossSection
    }

    /// The kernel of splat `i`; an unknown footprint id means the first.
    #[inline(always)]
    pub(crate) fn kernel(&self, i: usize) -> Kernel {
        let id = self.cloud.footprint[i] as usize;
        self.kernels[if id < self.kernels.len() { id } else { 0 }]
    }

    /// How the material of splat `i` absorbs; an unknown id means the default.
    #[inline(always)]
    pub(crate) fn extinction(&self, i: usize) -> Extinction {
        self.extinctions.get(self.cloud.material[i] as usize).copied().unwrap_or_default()
    }

    /// Radius of the part that throws the shadow, world units: the kernel's, or the dilated disc's.
    #[inline]
    pub(crate) fn shadow_radius(&self, i: usize) -> f32 {
        if self.is_opaque_disc(i) {
            self.shadow_radius_of_area(self.cloud.cross_section[i])
        } else {
            self.cloud.radius[i]
        }
    }

    /// Radius of the dilated disc of an opaque splat that stands for an area.
    #[inline(always)]
    pub(crate) fn shadow_radius_of_area(&self, area: f32) -> f32 {
        self.params.opaque_dilation * (area * std::f32::consts::FRAC_1_PI).sqrt()
    }

    /// Splat `i` in the light's frame.
    #[inline(always)]
    pub(crate) fn get(&self, i: usize, frame: &Frame, parallel: bool) -> Caster {
        let cloud = self.cloud;
        let extinction = self.extinction(i);
        let kind = cloud.kind[i];
        let position = frame.position(cloud.position[i]);
        let mut caster = Caster {
            position,
            distance: if parallel { position.z } else { position.length() },
            kind,
            radius: frame.length(cloud.radius[i]),
            inverse_radius_sq: 1.0 / frame.length(cloud.radius[i]).powi(2),
            cross_section: frame.area(cloud.cross_section[i]),
            axes: [Vec3::ZERO; 2],
            normal: Vec3::ZERO,
            kernel: self.kernel(i),
            extinction,
            paper_absorbance: None,
        };
        if self.params.absorbance == AbsorbanceModel::Paper {
            caster.paper_absorbance = Some(self.paper_absorbance(i));
        }
        if kind != SplatKind::Medium {
            self.add_disc(i, frame, &mut caster);
        }
        caster
    }

    /// Gunjee 2007, Eq. 6: the size l is the splat's radius, the opacity c that of its centre or of one crossing.
    #[inline(never)]
    fn paper_absorbance(&self, i: usize) -> f32 {
        let kernel = self.kernel(i);
        let [radius, k] = [self.cloud.radius[i], self.cloud.cross_section[i]].map(f64::from);
        let spacing = radius / (f64::from(kernel.cutoff) * f64::from(Footprint::SIGMA_OVER_SPACING));
        let (opaque, depth) = match self.cloud.kind[i] {
            SplatKind::Medium => (false, k * f64::from(kernel.norm) / (radius * radius)),
            SplatKind::Surface => (false, k / (spacing * spacing)),
            SplatKind::Opaque => (true, f64::INFINITY),
        };
        optics::paper_absorbance(opaque, radius, optics::opacity(depth)) as f32
    }

    fn add_disc(&self, i: usize, frame: &Frame, caster: &mut Caster) {
        let is_opaque = caster.kind == SplatKind::Opaque && caster.paper_absorbance.is_none();
        let shadow = is_opaque.then(|| frame.length(self.shadow_radius(i)));
        let tangent = frame.displacement(self.cloud.tangent_of(i));
        let normal = frame.turn(self.cloud.normal_of(i));
        (caster.axes, caster.normal, caster.radius) = disc(normal, tangent, caster.radius, shadow);
    }
}

/// Semi-axes, normal and longer semi-axis of a disc; with `shadow` in the size that throws the shadow: it keeps its
/// aspect and has the area that the splat stands for, dilated.
#[inline(always)]
pub(crate) fn disc(normal: Vec3, tangent: Vec3, radius: f32, shadow: Option<f32>) -> ([Vec3; 2], Vec3, f32) {
    let first = tangent - normal * normal.dot(tangent);
    let length = first.length();
    let is_circle = length <= 0.0;
    let first = if is_circle { normal.any_orthonormal_vector() * radius } else { first };
    let length = if is_circle { radius } else { length };
    let second = normal.cross(first / length) * radius;
    let longer = length.max(radius);
    let Some(shadow) = shadow else { return ([first, second], normal, longer) };
    let scale = shadow / (length * radius).sqrt();
    ([first * scale, second * scale], normal, shadow.max(scale * longer))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_the_footprints_of_the_stack() {
        let stack = FootprintStack::default();
        for (kernel, footprint) in Kernel::of_stack(&stack).iter().zip(stack.layers()) {
            for i in 0..=1000 {
                let s = i as f32 / 1000.0;
                let error = f64::from(kernel.profile(s)) - footprint.profile(f64::from(s));
                assert!(error.abs() < 1e-6, "cutoff {}, s {s}: {error}", footprint.cutoff);
            }
        }
    }
}
