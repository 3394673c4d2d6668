//! Solids from solids, and open surfaces from closed ones.
//!
//! Inside is negative: a union is the minimum of its parts, an intersection the maximum, a complement the negative, a
//! difference a ∖ b the maximum of a and −b. Gradient and Hessian are those of the part whose value counts (the first of
//! equals); bounds are the same operations on the ends of intervals. Zero sets keep the edges where parts meet.
//!
//! Clipping is something else: a clipped surface has a border, not a lid. Its field is that of the whole surface, and
//! [`ScalarField::in_domain`] decides which zeros belong to it.

use splat_core::glam::{DMat3, DVec3};
use splat_core::{Clip, Error, ScalarField};
use std::sync::Arc;

/// A field that combinations share.
pub type SharedField = Arc<dyn ScalarField + Send>;

/// One field of a combination, times 1 or −1.
#[derive(Clone)]
struct Part {
    field: SharedField,
    sign: f64,
}

/// A union, intersection, difference or complement of fields.
///
/// ```
/// use field::{CombinedField, ExpressionField, SharedField};
/// use splat_core::{ScalarField, glam::DVec3};
/// use std::sync::Arc;
/// let parse = |text: &str| -> SharedField { Arc::new(ExpressionField::parse(text).unwrap()) };
/// let ball = parse("x^2 + y^2 + z^2 - 1");
/// let slab = parse("z^2 - 0.25");
/// let ring = CombinedField::difference(ball, slab);
/// assert!(ring.value(DVec3::ZERO) > 0.0 && ring.value(DVec3::Z * 0.75) < 0.0);
/// ```
#[derive(Clone)]
pub struct CombinedField {
    parts: Vec<Part>,
    /// The greatest value counts, or the least.
    greatest: bool,
}

impl std::fmt::Debug for CombinedField {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let signs: Vec<f64> = self.parts.iter().map(|p| p.sign).collect();
        f.debug_struct("CombinedField").field("signs", &signs).field("greatest", &self.greatest).finish()
    }
}

impl CombinedField {
    /// The union: the inside of any of the fields.
    ///
    /// # Errors
    /// [`Error::Invalid`] without fields.
    pub fn union(fields: Vec<SharedField>) -> Result<Self, Error> {
        Self::with_fields(fields, false)
    }

    /// The intersection: the inside of all fields.
    ///
    /// # Errors
    /// [`Error::Invalid`] without fields.
    pub fn intersection(fields: Vec<SharedField>) -> Result<Self, Error> {
        Self::with_fields(fields, true)
    }

    /// The difference: the inside of `a` without that of `b`.
    pub fn difference(a: SharedField, b: SharedField) -> Self {
        Self { parts: vec![Part { field: a, sign: 1.0 }, Part { field: b, sign: -1.0 }], greatest: true }
    }

    /// The complement of `a`: the same surface, turned.
    pub fn complement(a: SharedField) -> Self {
        Self { parts: vec![Part { field: a, sign: -1.0 }], greatest: true }
    }

    fn with_fields(fields: Vec<SharedField>, greatest: bool) -> Result<Self, Error> {
        if fields.is_empty() {
            return Err(Error::invalid("combination", 0, "fields", 0, "at least one field"));
        }
        Ok(Self { parts: fields.into_iter().map(|field| Part { field, sign: 1.0 }).collect(), greatest })
    }

    /// The part whose value counts and that value; a part without a value makes one without.
    fn active(&self, p: DVec3) -> (&Part, f64) {
        let first = &self.parts[0];
        let mut best = (first, first.sign * first.field.value(p));
        for part in &self.parts[1..] {
            let value = part.sign * part.field.value(p);
            let counts = if self.greatest { value > best.1 } else { value < best.1 };
            if value.is_nan() || counts {
                best = (part, value);
            }
            if best.1.is_nan() {
                break;
            }
        }
        best
    }
}

impl ScalarField for CombinedField {
    fn value(&self, p: DVec3) -> f64 {
        self.active(p).1
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.value_gradient(p).1
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (part, value) = self.active(p);
        (value, part.field.gradient(p) * part.sign)
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let part = self.active(p).0;
        part.field.hessian(p) * part.sign
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let pick = |a: f64, b: f64| if self.greatest { a.max(b) } else { a.min(b) };
        let mut bounds: Option<(f64, f64)> = None;
        for part in &self.parts {
            let (low, high) = part.field.bound(p, radius)?;
            let (low, high) = if part.sign < 0.0 { (-high, -low) } else { (low, high) };
            bounds = Some(bounds.map_or((low, high), |(l, h)| (pick(l, low), pick(h, high))));
        }
        bounds
    }

    fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> {
        self.parts.iter().try_fold(0.0, |most: f64, part| Some(most.max(part.field.steepest(p, radius)?)))
    }

    /// Of the part whose value counts.
    fn in_domain(&self, p: DVec3) -> bool {
        self.active(p).0.field.in_domain(p)
    }
}

/// 1 in regions and 0 beyond them: what the particles of a volume that is cut are kept by.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionField(Vec<Clip>);

impl RegionField {
    /// 1 in all of the regions; `None` without any.
    pub fn shared(clips: &[Clip]) -> Option<SharedField> {
        (!clips.is_empty()).then(|| Arc::new(Self(clips.to_vec())) as SharedField)
    }
}

impl ScalarField for RegionField {
    fn value(&self, p: DVec3) -> f64 {
        if self.0.iter().all(|clip| clip.keeps(p)) { 1.0 } else { 0.0 }
    }

    fn gradient(&self, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    fn hessian(&self, _: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let may = self.0.iter().all(|clip| clip.may_keep(p, radius));
        Some((0.0, if may { 1.0 } else { 0.0 }))
    }
}

/// A surface cut off where it leaves a region: open, without a lid.
#[derive(Clone)]
pub struct ClippedField {
    field: SharedField,
    clips: Vec<Clip>,
}

impl std::fmt::Debug for ClippedField {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClippedField").field("clips", &self.clips).finish_non_exhaustive()
    }
}

impl ClippedField {
    /// Keeps of the surface of `field` what lies in all of the regions.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a half-space without normal or a box whose corners are in the wrong order.
    pub fn new(field: SharedField, clips: Vec<Clip>) -> Result<Self, Error> {
        clips.iter().try_for_each(Clip::validate)?;
        Ok(Self { field, clips })
    }
}

impl ScalarField for ClippedField {
    fn value(&self, p: DVec3) -> f64 {
        self.field.value(p)
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.field.gradient(p)
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        self.field.value_gradient(p)
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        self.field.hessian(p)
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        self.field.bound(p, radius)
    }

    fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> {
        self.field.steepest(p, radius)
    }

    fn in_domain(&self, p: DVec3) -> bool {
        self.clips.iter().all(|c| c.keeps(p)) && self.field.in_domain(p)
    }

    fn may_be_in_domain(&self, p: DVec3, radius: f64) -> bool {
        self.clips.iter().all(|c| c.may_keep(p, radius)) && self.field.may_be_in_domain(p, radius)
    }
}
