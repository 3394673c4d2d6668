//! Lookup tables: materials and objects (Gunjee 2007, section 3: "for some attributes we define a separate table").

use glam::Vec3;
use std::f32::consts::PI;

/// How a splat turns light into radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shading {
    /// Diffuse and specular reflection at the normal; a splat without a normal falls back to `Phase`.
    #[default]
    Phong,
    /// Single scattering by the phase function.
    Phase,
    /// The colour is shown as it is: radiance = colour.
    Unlit,
}

/// Optical properties shared by many splats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// How light becomes radiance.
    pub shading: Shading,
    /// Share of the ambient radiance that is reflected, ≥ 0.
    pub ambient: f32,
    /// Diffuse reflectance factor, in \[0, 1\]; multiplied by the splat's colour.
    pub diffuse: f32,
    /// Specular reflectance, in \[0, 1\].
    pub specular: f32,
    /// Phong exponent, ≥ 0.
    pub shininess: f32,
    /// Share of the diffuse light that passes to the other side of a thin surface, in \[0, 1\].
    pub transmission: f32,
    /// Single-scattering albedo ω of a medium, in \[0, 1\]; multiplied by the splat's colour.
    pub single_scattering_albedo: f32,
    /// Asymmetry g of the phase function, in (−1, 1).
    pub asymmetry: f32,
    /// Emitted radiance per channel of a fully opaque column, W·m⁻²·sr⁻¹.
    pub emission: [f32; 3],
    /// Extinction per channel relative to the splat's cross-section, each ≥ 0; (1, 1, 1) absorbs all alike.
    pub extinction_rgb: [f32; 3],
    /// How the opacity of a translucent surface grows at grazing angles.
    pub surface_opacity: crate::optics::SurfaceOpacity,
    /// Refractive index of the matter that a surface bounds, by channel, > 0; `None` for a surface that bounds none. Around it the index is
    /// 1: matter of index 1 bends no light, and is as clear as any other.
    pub index: Option<[f32; 3]>,
    /// What that matter absorbs, by channel, 1 / world unit, ≥ 0.
    pub absorption_inside: [f32; 3],
    /// How its surfaces are rough to light.
    pub bump: Bump,
}

/// Noise or a [`HeightImage`](crate::HeightImage) as heights over a surface, whose slopes tilt the normals that light falls on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bump {
    /// Of the largest bumps, or of what is white in an image over what is black; in the object's own unit, ≥ 0. 0 is smooth.
    pub height: f32,
    /// Length of the largest bumps, or width of the image, in that unit; > 0 where there are some.
    pub size: f32,
    /// How many sizes of noise there are, each half as large and as high as the one before; 0 where an image has the heights.
    pub octaves: u32,
    /// Of the noise.
    pub seed: u64,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            shading: Shading::Phong,
            ambient: 1.0,
            diffuse: 1.0,
            specular: 0.0,
            shininess: 32.0,
            transmission: 0.0,
            single_scattering_albedo: 1.0,
            asymmetry: 0.0,
            emission: [0.0; 3],
            extinction_rgb: [1.0; 3],
            surface_opacity: crate::optics::SurfaceOpacity::PerCrossing,
            index: None,
            absorption_inside: [0.0; 3],
            bump: Bump::default(),
        }
    }
}

impl Material {
    /// Extinction of the channel that is absorbed most, relative to the splat's cross-section.
    #[inline(always)]
    pub fn greatest_extinction(&self) -> f32 {
        let [r, g, b] = self.extinction_rgb;
        r.max(g).max(b)
    }

    /// The most radiance that it sends in any direction of an irradiance of 1 on a plane that faces the light, 1/sr, where the largest channel of
    /// its colour is `color`: at the peak of the phase function, or, where it may have a normal, by Lambert and the peak of the highlight. An unlit
    /// one sends none.
    pub fn brightest(&self, color: f64, may_have_normal: bool) -> f64 {
        if self.shading == Shading::Unlit {
            return 0.0;
        }
        let pi = f64::from(PI);
        let g = f64::from(self.asymmetry.abs());
        let phase = (1.0 + g) / (4.0 * pi * (1.0 - g) * (1.0 - g));
        let scattered = color * f64::from(self.single_scattering_albedo) * phase;
        if self.shading == Shading::Phase || !may_have_normal {
            return scattered;
        }
        let highlight = f64::from(self.specular) * (f64::from(self.shininess) + 2.0) / (2.0 * pi);
        scattered.max(color * f64::from(self.diffuse) / pi + highlight)
    }

    /// Whether its surfaces bound matter, which has an index or absorbs.
    pub fn bounds_matter(&self) -> bool {
        self.index.is_some() || self.absorption_inside != [0.0; 3]
    }

    /// The refractive index of what its surfaces bound, by channel: 1 where nothing else is known.
    #[inline]
    pub fn index_inside(&self) -> [f32; 3] {
        self.index.unwrap_or([1.0; 3])
    }

    /// Whether its surfaces mirror and bend light.
    pub fn bends_light(&self) -> bool {
        self.index_inside() != [1.0; 3]
    }

    /// Reflection of a surface per unit irradiance on a plane that faces the light. Unit vectors point away from the surface,
    /// the normal to the viewer's side.
    ///
    /// Lambert ρ/π·⟨n·l⟩, of which the share `transmission` goes to the other side, and energy-normalised Phong
    /// ρ_s·(m + 2)/2π·⟨r·v⟩^m·⟨n·l⟩ (Gunjee 2007, section 4.3).
    #[inline]
    pub fn reflect(&self, normal: Vec3, to_light: Vec3, to_eye: Vec3) -> Reflection {
        let cosine = normal.dot(to_light);
        let diffuse = cosine.max(0.0) * (1.0 - self.transmission) + (-cosine).max(0.0) * self.transmission;
        let mut specular = 0.0;
        if self.specular > 0.0 && cosine > 0.0 {
            let mirrored = 2.0 * cosine * normal - to_light;
            let lobe = libm::powf(mirrored.dot(to_eye).max(0.0), self.shininess);
            specular = self.specular * (self.shininess + 2.0) / (2.0 * PI) * lobe * cosine;
        }
        Reflection { diffuse: self.diffuse / PI * diffuse, specular }
    }
}

/// Reflected radiance per unit irradiance, 1/sr.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflection {
    /// Factor on the surface's colour.
    pub diffuse: f32,
    /// Without colour.
    pub specular: f32,
}

/// Materials by [`crate::Splat::material`].
pub type MaterialTable = Vec<Material>;

/// What one object of the scene does with shadows.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Name in the scene file.
    pub name: String,
    /// Whether its splats cast shadows.
    pub casts_shadow: bool,
    /// Factor on its splats' shadow coefficients, in \[0, 1\]; 0 receives no shadow.
    pub shadow_coefficient: f32,
}

/// Without a name; casts and receives shadows.
impl Default for Object {
    fn default() -> Self {
        Self { name: String::new(), casts_shadow: true, shadow_coefficient: 1.0 }
    }
}

/// Objects by [`crate::Splat::object`].
pub type ObjectTable = Vec<Object>;
