//! Participating media: a density with optical properties.

use crate::liberty::Liberty;
use crate::media::density::Density;
use crate::media::phase::henyey_greenstein;
use crate::surfaces::surface::Response;
use glam::DVec3;
use splat_core::Error;

/// A colour that varies over space.
pub type ColorAt<'a> = &'a (dyn Fn(DVec3) -> [f64; 3] + Sync);

/// What a medium has instead of its phase function where it has a normal: it reflects about that, as a surface does
/// ([`SurfaceMaterial`](crate::SurfaceMaterial)), but shows its outside whoever looks.
#[derive(Clone, Copy)]
pub struct Facets<'a> {
    /// Unit normal by world position; zero where there is none.
    pub normal: &'a (dyn Fn(DVec3) -> DVec3 + Sync),
    /// Diffuse reflectance, in \[0, 1\]; multiplied by the colour.
    pub diffuse: f64,
    /// Share of the diffuse light that leaves on the other side, in \[0, 1\].
    pub transmission: f64,
    /// Specular reflectance, in \[0, 1\].
    pub specular: f64,
    /// Phong exponent, ≥ 0.
    pub shininess: f64,
    /// Emitted radiance of a fully opaque column per unit of colour, in place of the medium's.
    pub glow: [f64; 3],
}

/// A medium. Where several overlap, their extinctions add.
///
/// The radiative transfer equation of one medium of density ρ along a ray is
/// dL/ds = ρ·σ·(−L + S + ω∫p·L dω'), σ `extinction`, S = `emission` + `glow`·c, ω = `albedo`·c, c `color` (1 without); with
/// `facets` the response of a surface stands for ω·p wherever there is a normal.
#[derive(Clone, Copy)]
pub struct Medium<'a> {
    /// How much of it there is where.
    pub density: Density<'a>,
    /// Extinction σ_t per channel at density 1, 1/world unit, ≥ 0.
    pub extinction: [f64; 3],
    /// Single-scattering albedo ω per channel, in \[0, 1\].
    pub albedo: [f64; 3],
    /// Asymmetry g of the Henyey-Greenstein phase function, in (−1, 1).
    pub asymmetry: f64,
    /// Emitted radiance of a fully opaque column per channel, ≥ 0.
    pub emission: [f64; 3],
    /// Emitted radiance of a fully opaque column per unit of `color`, ≥ 0.
    pub glow: [f64; 3],
    /// Colour by world position, each channel in \[0, 1\] (larger values count as 1 in the albedo).
    pub color: Option<ColorAt<'a>>,
    /// How it reflects where it has a normal; `None` for a medium that scatters everywhere.
    pub facets: Option<Facets<'a>>,
    /// What it does otherwise than nature.
    pub liberty: Liberty,
}

impl<'a> Medium<'a> {
    /// A grey, isotropic, dark medium: what the caller does not set.
    pub fn new(density: Density<'a>, extinction: f64, albedo: f64) -> Self {
        Self {
            density,
            extinction: [extinction; 3],
            albedo: [albedo; 3],
            asymmetry: 0.0,
            emission: [0.0; 3],
            glow: [0.0; 3],
            color: None,
            facets: None,
            liberty: Liberty::default(),
        }
    }

    /// Colour at `p`, 1 without.
    fn color(&self, p: DVec3) -> [f64; 3] {
        self.color.map_or([1.0; 3], |color| color(p))
    }

    fn albedo(&self, p: DVec3) -> [f64; 3] {
        let color = self.color(p);
        std::array::from_fn(|c| self.albedo[c] * color[c].clamp(0.0, 1.0))
    }

    /// How it reflects at `p`, and about which normal, where it has one.
    fn facet(&self, p: DVec3) -> Option<(&Facets<'a>, DVec3)> {
        let facets = self.facets.as_ref()?;
        Some((facets, (facets.normal)(p))).filter(|(_, normal)| *normal != DVec3::ZERO)
    }

    /// Whether it reflects at `p`, where it does not scatter.
    pub(crate) fn reflects(&self, p: DVec3) -> bool {
        self.facet(p).is_some()
    }

    /// Radiance that a fully opaque column emits at `p`.
    pub(crate) fn emitted(&self, p: DVec3) -> [f64; 3] {
        let glow = self.facet(p).map_or(self.glow, |(facets, _)| facets.glow);
        let color = self.color(p);
        std::array::from_fn(|c| self.emission[c] + glow[c] * color[c].max(0.0))
    }

    /// What becomes of light at `p`, seen from unit direction `to_eye`.
    pub(crate) fn event(&self, p: DVec3, to_eye: DVec3) -> Event {
        if let Some((facets, normal)) = self.facet(p) {
            let Facets { transmission, specular, shininess, .. } = *facets;
            let diffuse = self.color(p).map(|c| (facets.diffuse * c).clamp(0.0, 1.0));
            return Event::Reflected(Response::new(diffuse, [transmission, specular, shininess], normal, to_eye));
        }
        Event::Scattered { albedo: self.albedo(p), asymmetry: self.asymmetry }
    }

    /// Share of the light from unit direction `to_light`, per unit irradiance on a facing plane, that leaves along `to_eye`.
    pub(crate) fn toward(&self, p: DVec3, to_light: DVec3, to_eye: DVec3) -> [f64; 3] {
        match self.event(p, to_eye) {
            Event::Reflected(response) => response.toward(to_light).0,
            Event::Scattered { albedo, asymmetry } => {
                albedo.map(|a| a * henyey_greenstein(-to_eye, to_light, asymmetry))
            }
        }
    }

    pub(crate) fn emits(&self) -> bool {
        let glow = self.facets.iter().flat_map(|facets| &facets.glow);
        self.emission.iter().chain(&self.glow).chain(glow).any(|e| *e > 0.0)
    }

    pub(crate) fn largest_extinction(&self) -> f64 {
        self.extinction.iter().fold(0.0, |m, e| m.max(*e))
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the medium by `index`.
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        self.density.validate(index)?;
        self.liberty.validate("medium", index)?;
        for (attribute, values) in [("extinction", self.extinction), ("emission", self.emission), ("glow", self.glow)] {
            if !values.iter().all(|v| v.is_finite() && *v >= 0.0) {
                return Err(Error::invalid("medium", index, attribute, values, "three finite numbers ≥ 0"));
            }
        }
        if !self.albedo.iter().all(|a| (0.0..=1.0).contains(a)) {
            return Err(Error::invalid("medium", index, "albedo", self.albedo, "three numbers in [0, 1]"));
        }
        if let Some(Facets { diffuse, transmission, specular, shininess, glow, .. }) = self.facets {
            let are_shares = [diffuse, transmission, specular].iter().all(|s| (0.0..=1.0).contains(s));
            if !(are_shares && shininess.is_finite() && shininess >= 0.0) {
                let found = [diffuse, transmission, specular, shininess];
                return Err(Error::invalid(
                    "medium",
                    index,
                    "facets",
                    found,
                    "three numbers in [0, 1] and an exponent ≥ 0",
                ));
            }
            if !glow.iter().all(|g| g.is_finite() && *g >= 0.0) {
                return Err(Error::invalid("medium", index, "glow", glow, "three finite numbers ≥ 0"));
            }
        }
        if !(self.asymmetry > -1.0 && self.asymmetry < 1.0) {
            return Err(Error::invalid("medium", index, "asymmetry", self.asymmetry, "a number in (−1, 1)"));
        }
        Ok(())
    }
}

/// What becomes of light at a place in a medium.
pub(crate) enum Event {
    /// It is scattered by the phase function.
    Scattered { albedo: [f64; 3], asymmetry: f64 },
    /// It is reflected about a normal.
    Reflected(Response),
}
