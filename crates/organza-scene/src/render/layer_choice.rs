//! Which images a render keeps.

use splat_core::{ADDITIVE_LAYERS, LayerSet, Layers, SHADED_EFFECTS};
use std::collections::BTreeSet;

/// Every name that `layers` accepts. `effects` and `depth` stand for several; `beauty` and `alpha` are always kept.
pub const LAYER_NAMES: [&str; 20] = [
    "beauty",
    "alpha",
    "effects",
    "background",
    "ambient",
    "emission",
    "direct",
    "scatter1",
    "scatterN",
    "reflection",
    "refraction",
    "shadow",
    "normal",
    "depth",
    "depth.first",
    "depth.median",
    "depth.mean",
    "depth.sigma",
    "object",
    "std_error",
];

const DEPTHS: [&str; 4] = ["depth.first", "depth.median", "depth.mean", "depth.sigma"];

/// The images that were asked for, by name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LayerChoice {
    names: BTreeSet<&'static str>,
}

impl LayerChoice {
    /// Adds a layer or a group of layers; false if there is none of this name.
    #[must_use]
    pub fn add(&mut self, name: &str) -> bool {
        match name {
            "effects" => self.names.extend(["background"].into_iter().chain(SHADED_EFFECTS)),
            "depth" => self.names.extend(DEPTHS),
            _ => match LAYER_NAMES.iter().find(|known| **known == name) {
                Some(known) => _ = self.names.insert(known),
                None => return false,
            },
        }
        true
    }

    /// Adds effects that not every scene has, by their names in [`LAYER_NAMES`].
    pub(crate) fn add_effects(&mut self, names: impl IntoIterator<Item = &'static str>) {
        self.names.extend(names);
    }

    /// Whether it keeps all effects that every technique fills, as `effects` asks.
    pub fn has_effects(&self) -> bool {
        ["background"].iter().chain(&SHADED_EFFECTS).all(|name| self.names.contains(name))
    }

    /// What has to be accumulated so that these images can be made.
    pub fn set(&self) -> LayerSet {
        let any = |names: &[&str]| names.iter().any(|n| self.names.contains(n));
        LayerSet {
            effects: any(&ADDITIVE_LAYERS),
            shadow: any(&["shadow"]),
            normal: any(&["normal"]),
            depth: any(&DEPTHS),
            object: any(&["object"]),
        }
    }

    /// Drops every image that was not asked for. Beauty and alpha stay.
    pub fn keep(&self, layers: &mut Layers) {
        layers.images.retain(|name, _| matches!(*name, "beauty" | "alpha") || self.names.contains(name));
    }

    /// Names in alphabetical order, groups resolved.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.names.iter().copied()
    }
}
