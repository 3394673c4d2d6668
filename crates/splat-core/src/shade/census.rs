//! What a cloud consists of, as far as light and order go: counted once, for whoever plans what to do with it.

use crate::{Cloud, FootprintStack, Material, Object, Shading, SplatKind};

/// Counts of the splats of a cloud.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Census {
    /// All splats.
    pub splats: u64,
    /// Translucent ones: media and surfaces.
    pub translucent: u64,
    /// Opaque ones.
    pub opaque: u64,
    /// Those that can receive a shadow: lit, with a shadow coefficient above 0.
    pub receivers: u64,
    /// Those that can cast a shadow.
    pub casters: u64,
    /// Opaque ones among them.
    pub opaque_casters: u64,
    /// An optical depth that no light ray through all of them can exceed.
    pub caster_optical_depth: f64,
    /// Whether the material of a translucent one absorbs the three channels unequally.
    pub colored_extinction: bool,
}

impl Census {
    /// Counts a cloud, by its tables of materials, objects and footprints.
    ///
    /// # Panics
    /// If an id of the cloud has no entry in its table, which [`Cloud::validate`] and the tables' makers see to.
    pub fn new(cloud: &Cloud, materials: &[Material], objects: &[Object], footprints: &FootprintStack) -> Self {
        let norms: Vec<f64> = footprints.layers().iter().map(|f| f.norm()).collect();
        let mut census = Self { splats: cloud.len() as u64, ..Self::default() };
        for i in 0..cloud.len() {
            let object = &objects[cloud.object[i] as usize];
            let material = &materials[cloud.material[i] as usize];
            let opaque = cloud.kind[i] == SplatKind::Opaque;
            census.opaque += u64::from(opaque);
            census.translucent += u64::from(!opaque);
            let coefficient = object.shadow_coefficient * cloud.shadow_coefficient_of(i);
            census.receivers += u64::from(material.shading != Shading::Unlit && coefficient > 0.0);
            let largest = material.greatest_extinction();
            if object.casts_shadow && cloud.cross_section[i] > 0.0 && (opaque || largest > 0.0) {
                census.casters += 1;
                census.opaque_casters += u64::from(opaque);
                let radius = f64::from(cloud.radius[i]);
                let peak = f64::from(cloud.cross_section[i]) * norms[cloud.footprint[i] as usize] / (radius * radius);
                census.caster_optical_depth += peak * f64::from(largest);
            }
            let [r, g, b] = material.extinction_rgb;
            census.colored_extinction |= !opaque && (r != g || g != b);
        }
        census
    }
}
