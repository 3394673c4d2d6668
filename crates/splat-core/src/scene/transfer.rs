//! Transfer functions: physical value → colour and extinction.

use crate::Error;

/// A control point of a [`TransferFunction`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// Physical value.
    pub value: f32,
    /// Linear Rec.709 colour.
    pub color: [f32; 3],
    /// Extinction coefficient σ_t at that value, 1/world unit.
    pub extinction: f32,
}

/// Piecewise linear between control points, constant outside.
///
/// ```
/// use splat_core::{TransferFunction, TransferPoint};
/// let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
/// let tf = TransferFunction::new(vec![point(0.0, 0.0), point(255.0, 2.0)]).unwrap();
/// assert_eq!(tf.at(127.5).extinction, 1.0);
/// assert_eq!(tf.at(300.0).extinction, 2.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    points: Vec<TransferPoint>,
}

impl TransferFunction {
    /// Builds from control points of strictly rising value.
    ///
    /// # Errors
    /// [`Error::Invalid`] when there is no point, values do not rise, or a number is negative or not finite.
    pub fn new(points: Vec<TransferPoint>) -> Result<Self, Error> {
        if points.is_empty() {
            return Err(Error::invalid("transfer function", 0, "points", points.len(), "at least one control point"));
        }
        for (i, p) in points.iter().enumerate() {
            if !p.value.is_finite() || (i > 0 && p.value <= points[i - 1].value) {
                return Err(Error::invalid("transfer point", i, "value", p.value, "finite and above the one before"));
            }
            if !(p.extinction.is_finite() && p.extinction >= 0.0) {
                return Err(Error::invalid("transfer point", i, "extinction", p.extinction, "a finite number ≥ 0"));
            }
            if !p.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
                return Err(Error::invalid("transfer point", i, "color", p.color, "three finite numbers ≥ 0"));
            }
        }
        Ok(Self { points })
    }

    /// Colour and extinction at `value`; NaN gives the first point.
    pub fn at(&self, value: f32) -> TransferPoint {
        let upper = self.points.partition_point(|p| p.value <= value);
        if upper == 0 {
            return self.points[0];
        }
        let a = self.points[upper - 1];
        let Some(b) = self.points.get(upper) else { return a };
        let width = b.value - a.value;
        let wide = || ((f64::from(value) - f64::from(a.value)) / (f64::from(b.value) - f64::from(a.value))) as f32;
        // Two values may lie farther apart than single precision reaches.
        let t = if width.is_finite() { (value - a.value) / width } else { wide() };
        let mix = |x: f32, y: f32| x + (y - x) * t;
        TransferPoint {
            value,
            color: std::array::from_fn(|c| mix(a.color[c], b.color[c])),
            extinction: mix(a.extinction, b.extinction),
        }
    }

    /// The same with 0 for extinctions that are no more than `extinction`, and for colours that are no more than `color`.
    pub fn without_traces(&self, extinction: f32, color: f32) -> Self {
        let above = |v: f32, least: f32| if v > least { v } else { 0.0 };
        let kept = |p: &TransferPoint| TransferPoint {
            extinction: above(p.extinction, extinction),
            color: p.color.map(|c| above(c, color)),
            ..*p
        };
        Self { points: self.points.iter().map(kept).collect() }
    }

    /// The same with colours times a factor, ≥ 0.
    #[must_use]
    pub fn with_colors_times(&self, factor: f32) -> Self {
        let point = |p: &TransferPoint| TransferPoint { color: p.color.map(|c| c * factor), ..*p };
        Self { points: self.points.iter().map(point).collect() }
    }

    /// The largest channel of all colours.
    pub fn brightest(&self) -> f32 {
        self.points.iter().flat_map(|p| p.color).fold(0.0, f32::max)
    }

    /// The control points.
    pub fn points(&self) -> &[TransferPoint] {
        &self.points
    }
}
