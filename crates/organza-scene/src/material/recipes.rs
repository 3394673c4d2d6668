//! Materials with a name: what `preset` of a material, and `--material` of the command, stand for.
//!
//! Coefficients are those of the matter, 1/m, from measurements wherever a source is named. Red, green and blue are those of the source, or the
//! dominant wavelengths of the primaries of Rec.709 (611.4, 549.1 and 464.2 nm).

use crate::material::raw::{RawMaterial, RawMedium};
use crate::material::tint::Tint;

/// Millimetres of a metre: tables of scattering are in 1/mm.
const PER_MM: f64 = 1e3;

/// A material with a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recipe {
    /// The word for it in scenes and on the command line.
    pub name: &'static str,
    /// Size that a thing of it has in life, metres: lengths of a file without a unit are taken so.
    pub across_m: f64,
    surface: Option<Surface>,
    matter: Option<Matter>,
}

/// What a surface of it does with light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Surface {
    /// Diffuse reflectance.
    color: [f64; 3],
    specular: f64,
    shininess: f64,
    /// What it bounds, where light passes it.
    inside: Option<Inside>,
}

/// Matter that light passes on straight ways.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Inside {
    index: f64,
    /// Share of light that passes one crossing of the surface.
    tint: [f64; 3],
    /// 1/m.
    absorption: [f64; 3],
}

/// What it does with light inside.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Matter {
    /// 1/m.
    scattering: [f64; 3],
    /// 1/m.
    absorption: [f64; 3],
    /// Mean cosine of scattering.
    asymmetry: f64,
}

/// The form in which an object has its material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// Light meets surfaces.
    Surface,
    /// Light goes through a medium.
    Medium,
}

/// A surface that scatters all light that it does not reflect.
const fn opaque(color: [f64; 3], specular: f64, shininess: f64) -> Option<Surface> {
    Some(Surface { color, specular, shininess, inside: None })
}

/// A surface that light passes. A refractive index mirrors by itself, so there is no highlight.
const fn clear(index: f64, tint: [f64; 3], absorption: [f64; 3]) -> Option<Surface> {
    Some(Surface { color: [1.0; 3], specular: 0.0, shininess: 32.0, inside: Some(Inside { index, tint, absorption }) })
}

/// Matter of Jensen et al. 2001, whose table has coefficients in 1/mm. Its scattering is the reduced one, of a phase function that is alike in all
/// directions.
const fn measured(scattering_mm: [f64; 3], absorption_mm: [f64; 3]) -> Option<Matter> {
    let [sr, sg, sb] = scattering_mm;
    let [ar, ag, ab] = absorption_mm;
    Some(Matter {
        scattering: [sr * PER_MM, sg * PER_MM, sb * PER_MM],
        absorption: [ar * PER_MM, ag * PER_MM, ab * PER_MM],
        asymmetry: 0.0,
    })
}

/// Droplets or grains of one extinction and single-scattering albedo in all channels.
const fn grains(extinction: f64, albedo: f64, asymmetry: f64) -> Option<Matter> {
    Some(Matter { scattering: [extinction * albedo; 3], absorption: [extinction * (1.0 - albedo); 3], asymmetry })
}

/// Absorption of pure water, 1/m: Pope and Fry 1997, Table 3, between its lines at the wavelengths above.
const WATER: [f64; 3] = [0.2654, 0.0555, 0.0101];
/// Share of light that a clear surface lets pass: nothing is tinted.
const WHOLE: [f64; 3] = [1.0; 3];
/// Matter that absorbs nothing to speak of at the size of a thing.
const NOTHING: [f64; 3] = [0.0; 3];

/// All materials that have a name, in the order in which they are listed. Scattering, absorption and diffuse reflectance of skin, milk, cream, marble and ketchup
/// are those of Jensen, Marschner, Levoy and Hanrahan 2001, "A Practical Model for Subsurface Light Transport", Figure 5.
const RECIPES: [Recipe; 22] = [
    // Crown glass (BK7) has an index of 1.517.
    Recipe { name: "glass", across_m: 0.2, surface: clear(1.517, WHOLE, NOTHING), matter: None },
    // Coloured glasses: tints chosen by eye, after window glass of some millimetres.
    Recipe { name: "glass-red", across_m: 0.2, surface: clear(1.517, [0.85, 0.12, 0.10], NOTHING), matter: None },
    Recipe { name: "glass-amber", across_m: 0.2, surface: clear(1.517, [0.92, 0.60, 0.15], NOTHING), matter: None },
    Recipe { name: "glass-green", across_m: 0.2, surface: clear(1.517, [0.25, 0.80, 0.35], NOTHING), matter: None },
    Recipe { name: "glass-blue", across_m: 0.2, surface: clear(1.517, [0.15, 0.35, 0.85], NOTHING), matter: None },
    // The index of water at 20 °C is 1.333. Its scattering, 0.002/m, is left out.
    Recipe {
        name: "water",
        across_m: 2.0,
        surface: clear(1.333, WHOLE, WATER),
        matter: Some(Matter { scattering: NOTHING, absorption: WATER, asymmetry: 0.0 }),
    },
    // Warren and Brandt 2008: index 1.31. Clear ice absorbs less than water does.
    Recipe { name: "ice", across_m: 0.2, surface: clear(1.31, WHOLE, [0.23, 0.03, 0.003]), matter: None },
    // The index of diamond at 589 nm is 2.417.
    Recipe { name: "diamond", across_m: 0.01, surface: clear(2.417, WHOLE, NOTHING), matter: None },
    // No table has wax: its colour and its dull highlight are chosen by eye, and inside it is taken as the flesh of an apple there.
    Recipe {
        name: "wax",
        across_m: 0.2,
        surface: opaque([0.86, 0.74, 0.47], 0.08, 14.0),
        matter: measured([2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    },
    // "Skin2".
    Recipe {
        name: "skin",
        across_m: 0.2,
        surface: opaque([0.63, 0.44, 0.34], 0.03, 12.0),
        matter: measured([1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    },
    // "Skin1".
    Recipe {
        name: "skin-dark",
        across_m: 0.2,
        surface: opaque([0.44, 0.22, 0.13], 0.04, 14.0),
        matter: measured([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    },
    // "Wholemilk".
    Recipe {
        name: "milk",
        across_m: 0.1,
        surface: opaque([0.91, 0.88, 0.76], 0.05, 90.0),
        matter: measured([2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
    },
    // "Skimmilk".
    Recipe {
        name: "milk-skimmed",
        across_m: 0.1,
        surface: opaque([0.81, 0.81, 0.69], 0.05, 90.0),
        matter: measured([0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    },
    Recipe {
        name: "cream",
        across_m: 0.1,
        surface: opaque([0.98, 0.90, 0.73], 0.02, 40.0),
        matter: measured([7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    },
    Recipe {
        name: "marble",
        across_m: 0.5,
        surface: opaque([0.83, 0.79, 0.75], 0.06, 60.0),
        matter: measured([2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    },
    Recipe {
        name: "ketchup",
        across_m: 0.1,
        surface: opaque([0.16, 0.01, 0.0], 0.05, 60.0),
        matter: measured([0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    },
    // Surfaces that are seen as they are every day: colours by eye.
    Recipe { name: "clay", across_m: 0.2, surface: opaque([0.58, 0.30, 0.18], 0.0, 32.0), matter: None },
    Recipe { name: "porcelain", across_m: 0.2, surface: opaque([0.86, 0.86, 0.84], 0.12, 250.0), matter: None },
    Recipe { name: "rubber", across_m: 0.2, surface: opaque([0.04, 0.04, 0.045], 0.03, 6.0), matter: None },
    // 0.3 g of soot in a cubic metre, of 8.7 m²/g (Mulholland and Croarkin 2000), whose albedo is about a quarter.
    Recipe { name: "smoke", across_m: 2.0, surface: None, matter: grains(2.6, 0.25, 0.6) },
    // 0.3 g of water in a cubic metre, in droplets of an effective radius of 8 µm: 3/2·0.3 g/m³ over their density and radius. Mie scattering of such
    // has a mean cosine of 0.85.
    Recipe { name: "cloud", across_m: 500.0, surface: None, matter: grains(0.056, 1.0, 0.85) },
    // Contrasts fall to 2 % over 200 m (Koschmieder's 3.912 over the visibility), in droplets as those of a cloud.
    Recipe { name: "fog", across_m: 200.0, surface: None, matter: grains(0.0196, 1.0, 0.85) },
];

impl Recipe {
    /// All that there are.
    pub fn list() -> &'static [Self] {
        &RECIPES
    }

    /// The one of a name.
    pub fn named(name: &str) -> Option<&'static Self> {
        RECIPES.iter().find(|recipe| recipe.name == name)
    }

    /// Whether surfaces may have it.
    pub fn is_of_surfaces(&self) -> bool {
        self.surface.is_some()
    }

    /// Whether media may have it.
    pub fn is_of_media(&self) -> bool {
        self.matter.is_some()
    }

    /// Whether light passes its surfaces.
    pub fn is_clear(&self) -> bool {
        self.surface.is_some_and(|surface| surface.inside.is_some())
    }

    /// The colour of a surface of it: its diffuse reflectance, or that of a tint.
    pub fn color(&self) -> Option<[f64; 3]> {
        let of_tint = |inside: Inside| Tint::new(inside.tint, None).color;
        self.surface.map(|surface| surface.inside.map_or(surface.color, of_tint))
    }

    /// Whether it has lengths, which `metre` scales: of media, or else of surfaces.
    pub fn has_lengths(&self, of_media: bool) -> bool {
        let absorbs = |surface: Surface| surface.inside.is_some_and(|inside| inside.absorption != NOTHING);
        if of_media { self.is_of_media() } else { self.surface.is_some_and(absorbs) }
    }

    pub(crate) fn has(&self, form: Form) -> bool {
        match form {
            Form::Surface => self.is_of_surfaces(),
            Form::Medium => self.is_of_media(),
        }
    }

    /// Its keys in this form, with lengths of which a metre has so many.
    pub(crate) fn keys(&self, form: Form, metre: f64) -> RawMaterial {
        match (form, self.surface, self.matter) {
            (Form::Surface, Some(surface), _) => surface.keys(metre),
            (Form::Medium, _, Some(matter)) => matter.keys(metre),
            _ => RawMaterial::default(),
        }
    }
}

impl Surface {
    fn keys(&self, metre: f64) -> RawMaterial {
        let mut keys =
            RawMaterial { specular: Some(self.specular), shininess: Some(self.shininess), ..RawMaterial::default() };
        match self.inside {
            None => keys.color = Some(self.color),
            Some(inside) => {
                // Clear matter scatters nothing: it mirrors, bends and absorbs.
                keys.diffuse = Some(0.0);
                keys.ambient = Some(0.0);
                keys.ior = Some(inside.index);
                keys.tint = (inside.tint != WHOLE).then_some(inside.tint);
                let absorption = inside.absorption.map(|per_m| per_m / metre);
                keys.absorption_inside = (inside.absorption != NOTHING).then_some(absorption);
            }
        }
        keys
    }
}

impl Matter {
    fn keys(&self, metre: f64) -> RawMaterial {
        let sums = [0, 1, 2].map(|c| self.scattering[c] + self.absorption[c]);
        let largest = sums.into_iter().fold(0.0, f64::max);
        RawMaterial {
            // The share of each channel that is scattered, which colours what is seen of it.
            color: Some([0, 1, 2].map(|c| self.scattering[c] / sums[c])),
            extinction_rgb: Some(sums.map(|sum| sum / largest)),
            medium: Some(RawMedium {
                extinction: Some(largest / metre),
                asymmetry: Some(self.asymmetry),
                ..RawMedium::default()
            }),
            ..RawMaterial::default()
        }
    }
}

impl RawMaterial {
    /// These keys, and those of a recipe that they say nothing else of.
    pub(crate) fn over(&self, recipe: &Self) -> Self {
        let says_inside = self.absorption_inside.is_some() || self.half_length.is_some();
        let says_index = self.ior.is_some() || self.cauchy.is_some();
        let half_length = self.medium.as_ref().is_some_and(|medium| medium.half_length.is_some());
        let says_extinction = self.absorption.is_some() || half_length;
        let says_ratio = says_extinction || self.extinction_rgb.is_some() || self.tint.is_some();
        let mut out = self.clone();
        out.color = out.color.or(recipe.color);
        out.ambient = out.ambient.or(recipe.ambient);
        out.diffuse = out.diffuse.or(recipe.diffuse);
        out.specular = out.specular.or(recipe.specular);
        out.shininess = out.shininess.or(recipe.shininess);
        out.ior = out.ior.or(recipe.ior.filter(|_| !says_index));
        out.absorption_inside = out.absorption_inside.or(recipe.absorption_inside.filter(|_| !says_inside));
        out.tint = out.tint.or(recipe.tint.filter(|_| !says_ratio));
        out.extinction_rgb = out.extinction_rgb.or(recipe.extinction_rgb.filter(|_| !says_ratio));
        if let Some(medium) = &recipe.medium {
            let stated = out.medium.get_or_insert_default();
            stated.extinction = stated.extinction.or(medium.extinction.filter(|_| !says_extinction));
            stated.albedo = stated.albedo.or(medium.albedo);
            stated.asymmetry = stated.asymmetry.or(medium.asymmetry);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart_and_each_has_a_form() {
        for (i, recipe) in RECIPES.iter().enumerate() {
            assert!(recipe.is_of_surfaces() || recipe.is_of_media(), "{}", recipe.name);
            assert!(RECIPES[..i].iter().all(|other| other.name != recipe.name), "{}", recipe.name);
            assert!(recipe.across_m > 0.0, "{}", recipe.name);
        }
    }

    #[test]
    fn milk_scatters_nearly_all_light_and_ketchup_red_light_alone() {
        let shares = |name: &str| Recipe::named(name).unwrap().keys(Form::Medium, 1.0).color.unwrap();
        assert!(shares("milk").into_iter().all(|share| share > 0.99));
        let [red, green, blue] = shares("ketchup");
        assert!(red > 0.7 && green < 0.1 && blue < 0.05, "{red} {green} {blue}");
    }

    #[test]
    fn lengths_are_those_of_the_scene() {
        let extinction = |metre| Recipe::named("milk").unwrap().keys(Form::Medium, metre).medium.unwrap().extinction;
        // 3.77 + 0.014 of blue light, 1/mm.
        assert!((extinction(1.0).unwrap() - 3784.0).abs() < 1e-9);
        assert!((extinction(1000.0).unwrap() - 3.784).abs() < 1e-12);
    }

    #[test]
    fn stated_keys_take_the_place_of_those_that_say_the_same() {
        let water = Recipe::named("water").unwrap().keys(Form::Surface, 1.0);
        let stated = RawMaterial { half_length: Some([1.0; 3]), ..RawMaterial::default() };
        let both = stated.over(&water);
        assert!(both.absorption_inside.is_none() && both.ior == Some(1.333));
        let red = Recipe::named("glass-red").unwrap().keys(Form::Surface, 1.0);
        let stated = RawMaterial { extinction_rgb: Some([1.0; 3]), opacity: Some(0.5), ..RawMaterial::default() };
        assert!(stated.over(&red).tint.is_none());
    }
}
