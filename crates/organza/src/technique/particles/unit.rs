//! The unit in which the sets of a frame sum radiance. It neither clips nor loses light, however bright or dim a scene is.
//!
//! Sums have steps of 2⁻²⁴ of the unit, and end at 2¹⁶ of it ([`pbsr::EnsembleParams::radiance_unit`]). The unit lies 2¹² below a bound of the
//! radiance of any particle: the brightest light that could reach the box of an object, at the peak of its material. Visible radiance may be a
//! million times dimmer, as around a lamp in the box, and still has steps of 1/60,000 of it.

use super::parts::Part;
use crate::frame::Frame;
use pbsr::Appearance;
use splat_core::{DAabb, Shading};
use std::ops::Range;

/// How many powers of two the unit lies below the bound.
const BELOW_BOUND: i32 = 12;
/// Powers of two that a unit may be: its steps and its largest sums are normal numbers of f32.
const LEAST_POWER: i32 = -100;
const MOST_POWER: i32 = 100;
/// How near a lamp comes to particles without a radius, over the diagonal of their box.
const NEAREST: f64 = 1e-4;

/// The unit, a power of two.
pub(super) fn radiance_unit(frame: &Frame<'_>, parts: &[&Part<'_>]) -> f32 {
    let brightest = parts.iter().map(|part| brightest(frame, part)).fold(0.0, f64::max);
    if brightest == 0.0 {
        return 1.0;
    }
    let (_, power) = libm::frexp(brightest);
    libm::exp2(f64::from((power - BELOW_BOUND).clamp(LEAST_POWER, MOST_POWER))) as f32
}

/// No particle of an object has more radiance in any channel.
fn brightest(frame: &Frame<'_>, part: &Part<'_>) -> f64 {
    let Appearance { material, radius, .. } = part.look;
    let greatest = |channels: [f32; 3]| f64::from(channels.into_iter().fold(0.0, f32::max));
    let color = f64::from(part.brightest_color);
    let emission = greatest(material.emission);
    if material.shading == Shading::Unlit {
        return emission + color;
    }
    let spread = (f64::from(radius) / 3.0).max(NEAREST * part.bounds.diagonal());
    let received = |bounds: &DAabb| -> f64 {
        let points = frame.light_points().iter();
        points.map(|point| frame.lit(point).brightest_in(bounds, spread)).sum()
    };
    let ambient = greatest(frame.scene.ambient) * f64::from(material.ambient) * color;
    emission + ambient + received(&part.bounds) * material.brightest(color, true)
}

/// Colours that need no unit: particles hold them as they are, with all nine bits for a hundredth of the brightest, too.
const UNITLESS: Range<f32> = 1.0 / 256.0..32_768.0;

/// The unit of an object's colours by the largest channel of any, a power of two ([`Appearance::color_unit`]).
pub(super) fn color_unit(brightest_color: f32) -> f32 {
    if brightest_color == 0.0 || UNITLESS.contains(&brightest_color) {
        return 1.0;
    }
    let (_, power) = libm::frexp(f64::from(brightest_color));
    libm::exp2(f64::from(power.clamp(LEAST_POWER, MOST_POWER))) as f32
}
