//! The kinds of effects, by the words that scenes call them, and what a scene switches of them.

use splat_core::{Material, Shading};

/// What effects of a kind hang on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HangsOn {
    /// There is one for each light.
    Light,
    /// There is one for each object.
    Object,
    /// There is one for the whole scene.
    Scene,
}

/// A kind of effects. Its effects are called by its word, a dot, and the name of the light or object that they are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectKind {
    /// An object as a whole: what it shows, hides and shadows.
    Object,
    /// A light.
    Light,
    /// The shadow of a light.
    Shadow,
    /// The size of a light, which softens its shadows.
    Soft,
    /// Light that media scatter more than once.
    Scatter,
    /// Reflection and refraction at the surfaces of an object.
    Bending,
    /// The index of what an object bounds, by channel.
    Dispersion,
    /// Absorption in what an object bounds.
    Absorption,
    /// The extinction of an object, by channel.
    Color,
    /// The shading of a volume by its gradients.
    Gradients,
    /// Light that surfaces send to one another.
    Interreflection,
    /// Light that surfaces bend and gather on others.
    Caustics,
    /// The order of what is translucent.
    Translucency,
    /// Opaque surfaces, which hide what lies behind.
    Opaque,
    /// Images beside beauty and alpha.
    Layers,
}

impl EffectKind {
    /// Every kind.
    pub const ALL: [Self; 15] = [
        Self::Object,
        Self::Light,
        Self::Shadow,
        Self::Soft,
        Self::Scatter,
        Self::Bending,
        Self::Dispersion,
        Self::Absorption,
        Self::Color,
        Self::Gradients,
        Self::Interreflection,
        Self::Caustics,
        Self::Translucency,
        Self::Opaque,
        Self::Layers,
    ];

    /// The first part of a name, before the dot.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Light => "light",
            Self::Shadow => "shadow",
            Self::Soft => "soft",
            Self::Scatter => "scatter",
            Self::Bending => "bending",
            Self::Dispersion => "dispersion",
            Self::Absorption => "absorption",
            Self::Color => "color",
            Self::Gradients => "gradients",
            Self::Interreflection => "interreflection",
            Self::Caustics => "caustics",
            Self::Translucency => "translucency",
            Self::Opaque => "opaque",
            Self::Layers => "layers",
        }
    }

    /// What its effects hang on.
    pub const fn hangs_on(self) -> HangsOn {
        match self {
            Self::Light | Self::Shadow | Self::Soft => HangsOn::Light,
            Self::Object | Self::Bending | Self::Dispersion | Self::Absorption | Self::Color | Self::Gradients => {
                HangsOn::Object
            }
            Self::Scatter
            | Self::Interreflection
            | Self::Caustics
            | Self::Translucency
            | Self::Opaque
            | Self::Layers => HangsOn::Scene,
        }
    }

    /// Why a scene cannot switch it, and what to do instead; `None` where it can.
    pub const fn fixed_because(self) -> Option<&'static str> {
        match self {
            Self::Interreflection => Some("no technique simulates it; `[ambient]` stands for it"),
            Self::Caustics => Some("no technique simulates it"),
            Self::Translucency => Some("what is translucent has to be put in order; switch its objects instead"),
            Self::Opaque => Some("what is opaque hides what lies behind; switch its objects instead"),
            Self::Layers => Some("render.layers says which images are kept"),
            _ => None,
        }
    }

    /// Name of the effect of the light or object that is called `label`, such as `shadow.sun`. For an effect of the whole scene `label` is ignored.
    pub fn name(self, label: &str) -> String {
        match self.hangs_on() {
            HangsOn::Scene => self.word().to_owned(),
            HangsOn::Light | HangsOn::Object => format!("{}.{label}", self.word()),
        }
    }

    /// A material without the cause that it has of this effect; the same material where it has none.
    pub fn taken_from(self, material: &Material) -> Material {
        match self {
            Self::Bending if material.bends_light() => Material { index: None, ..*material },
            Self::Dispersion => {
                // The channel in the middle of the spectrum.
                let index = material.index.map(|[_, green, _]| [green; 3]);
                Material { index, ..*material }
            }
            Self::Absorption => Material { absorption_inside: [0.0; 3], ..*material },
            Self::Color => {
                let [red, green, blue] = material.extinction_rgb;
                let is_alike = red == green && green == blue;
                let mean = if is_alike { red } else { (red + green + blue) / 3.0 };
                Material { extinction_rgb: [mean; 3], ..*material }
            }
            Self::Gradients if material.shading == Shading::Phong => Material { shading: Shading::Phase, ..*material },
            _ => *material,
        }
    }

    /// Whether a material is a cause of this effect.
    pub fn is_of(self, material: &Material) -> bool {
        self.taken_from(material) != *material
    }
}

/// An effect that a scene switches on or off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SwitchedEffect {
    /// Its kind.
    pub kind: EffectKind,
    /// The light's label or the object's name that it is of; empty for the scene.
    pub label: String,
    /// Whether it is simulated.
    pub is_on: bool,
}

impl SwitchedEffect {
    /// Whether a list of switched effects has this one on or off; `None` where it has neither.
    pub fn find(switched: &[Self], kind: EffectKind, label: &str) -> Option<bool> {
        let found = switched.iter().find(|effect| effect.kind == kind && effect.label == label);
        found.map(|effect| effect.is_on)
    }
}
