//! Turns a layer of a picture into a displayable picture.

use organza::Layers;
use splat_core::LayerData;

/// Displayed grey of what has no depth and no object.
const NOTHING: f32 = 0.5;

/// Displayed greys of the nearest and of the farthest depth.
const NEAREST: f32 = 0.95;
const FARTHEST: f32 = 0.1;

/// A layer by its name, as layers whose beauty shows it, and whether the exposure is that of the picture: radiance has one, numbers have none.
/// `None` where the picture has no such layer.
pub(crate) fn shown(layers: &Layers, name: &str) -> Option<(Layers, Radiance)> {
    let (name, data) = layers.images.get_key_value(name)?;
    let is_number = name.starts_with("depth.") || ["alpha", "normal", "shadow", "object", "std_error"].contains(name);
    let pixels: Vec<[f32; 3]> = match data {
        LayerData::Rgb(pixels) if is_number => pixels.iter().map(|vector| vector.map(of_direction)).collect(),
        LayerData::Rgb(pixels) => pixels.clone(),
        LayerData::Scalar(depths) if name.starts_with("depth.") => of_depths(depths),
        LayerData::Scalar(shares) => shares.iter().map(|share| [linear(share.clamp(0.0, 1.0)); 3]).collect(),
        LayerData::Id(ids) => ids.iter().map(|id| of_object(*id)).collect(),
    };
    let alpha = vec![1.0; pixels.len()];
    let mut shown = Layers { size: layers.size, ..Layers::default() };
    shown.insert("beauty", LayerData::Rgb(pixels));
    shown.insert("alpha", LayerData::Scalar(alpha));
    Some((shown, if is_number { Radiance::Never } else { Radiance::Exposed }))
}

/// Whether a picture takes an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Radiance {
    Exposed,
    Never,
}

/// Linear radiance that is displayed as this share of white (the inverse of sRGB's curve).
fn linear(displayed: f32) -> f32 {
    if displayed <= 0.040_45 { displayed / 12.92 } else { libm::powf((displayed + 0.055) / 1.055, 2.4) }
}

/// A component of a normal, −1 to 1.
fn of_direction(component: f32) -> f32 {
    linear((0.5 + 0.5 * component).clamp(0.0, 1.0))
}

/// Near is bright, as a lamp at the eye would light it.
fn of_depths(depths: &[f32]) -> Vec<[f32; 3]> {
    let finite = depths.iter().copied().filter(|depth| depth.is_finite());
    let ends = finite.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], d| [low.min(d), high.max(d)]);
    let [near, far] = ends;
    let width = (far - near).max(f32::MIN_POSITIVE);
    let grey = |depth: &f32| {
        if !depth.is_finite() {
            return linear(NOTHING) * 0.25;
        }
        linear(NEAREST + (FARTHEST - NEAREST) * ((depth - near) / width).clamp(0.0, 1.0))
    };
    depths.iter().map(|depth| [grey(depth); 3]).collect()
}

/// Colours of objects: neighbours in the scene's list have unlike hues, by the golden ratio.
fn of_object(id: u32) -> [f32; 3] {
    if id == u32::MAX {
        return [linear(NOTHING) * 0.25; 3];
    }
    let hue = (f64::from(id) * 0.618_033_988_75).fract() * 6.0;
    let channel = |offset: f64| {
        let distance = ((hue + offset).rem_euclid(6.0) - 3.0).abs();
        linear(0.35 + 0.55 * (distance - 1.0).clamp(0.0, 1.0) as f32)
    };
    [channel(0.0), channel(4.0), channel(2.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use organza::output::displayed;

    fn layers() -> Layers {
        let mut layers = Layers { size: [3, 1], ..Layers::default() };
        layers.insert("depth.median", LayerData::Scalar(vec![2.0, f32::INFINITY, 4.0]));
        layers.insert("normal", LayerData::Rgb(vec![[1.0, 0.0, -1.0]; 3]));
        layers.insert("direct", LayerData::Rgb(vec![[0.25; 3]; 3]));
        layers.insert("object", LayerData::Id(vec![0, 1, u32::MAX]));
        layers.insert("shadow", LayerData::Scalar(vec![0.0, 0.5, f32::NAN]));
        layers
    }

    fn bytes(name: &str) -> Vec<[u8; 3]> {
        let (shown, _) = shown(&layers(), name).unwrap();
        shown.rgb("beauty").unwrap().iter().map(|pixel| pixel.map(displayed)).collect()
    }

    #[test]
    fn numbers_are_displayed_as_greys_and_radiance_as_it_is() {
        let depth = bytes("depth.median");
        assert!((depth[0][0], depth[2][0]) == (242, 26) && depth[1][0] < 80, "{depth:?}");
        assert_eq!(bytes("normal")[0], [255, 128, 0]);
        assert_eq!(bytes("shadow"), [[0; 3], [128; 3], [0; 3]]);
        assert_eq!(shown(&layers(), "direct").unwrap().1, Radiance::Exposed);
        assert_eq!(bytes("direct")[0][0], displayed(0.25));
        let objects = bytes("object");
        assert!(objects[0] != objects[1] && objects[2][0] == objects[2][1]);
        assert!(shown(&layers(), "none").is_none());
    }
}
