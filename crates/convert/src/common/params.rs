//! Parameters that all conversions share.

#[cfg(feature = "cache")]
use crate::Cache;
use crate::common::columns::ColumnSet;
use crate::{ConvertError, FootprintChoice, PointMaterial};
use splat_core::{Exceeded, Footprint, Limits, Similarity};
use std::sync::Arc;

/// Smallest and largest splat spacing, world units: areas must stay normal f32 numbers.
const SPACING_RANGE: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

/// The attributes that every splat of one object gets, and the limits of its conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct SplatParams {
    /// Name of the object in messages.
    pub object_name: String,
    /// Index into the object table.
    pub object: u32,
    /// Index into the material table.
    pub material: u16,
    /// Index into the footprint stack.
    pub footprint: u8,
    /// The profile that `footprint` stands for; it gives the ratio of cutoff radius to spacing.
    pub profile: Footprint,
    /// The choice of each disc's footprint, and of the orientation of images; `None` for `footprint`, a formula.
    pub footprints: Option<Arc<FootprintChoice>>,
    /// The materials that a column `material` of raw points chooses from, by numbers from 0; `None` for `material`,
    /// one for all.
    pub materials: Option<Arc<[PointMaterial]>>,
    /// Object space → world space, applied in f64.
    pub transform: Similarity,
    /// Linear Rec.709 colour, each channel ≥ 0, where the input has none.
    pub color: [f32; 3],
    /// Splats that this object may become, 2³² − 1 at most, and the bytes of their cloud.
    pub limits: Limits,
    /// Whether surfaces of opacity 0 become splats too: the matter that they bound may bend light.
    pub keep_clear: bool,
    /// Cache of slow results for later conversions of the same input: estimates from the neighbours of raw points. The cache changes
    /// no result.
    #[cfg(feature = "cache")]
    pub cache: Option<Arc<Cache>>,
}

impl Default for SplatParams {
    fn default() -> Self {
        Self {
            object_name: "object".to_owned(),
            object: 0,
            material: 0,
            footprint: 0,
            profile: Footprint::default(),
            footprints: None,
            materials: None,
            transform: Similarity::default(),
            color: [1.0; 3],
            limits: Limits::default(),
            keep_clear: false,
            #[cfg(feature = "cache")]
            cache: None,
        }
    }
}

/// The distance between splats.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Density {
    /// Each splat stands for at most this much length (lattices) or for its square in area (surfaces), world units.
    Spacing(f64),
    /// About this many splats; a surface whose triangles are finer keeps them.
    Splats(u64),
    /// From the size of the object and the fineness of its input, see each conversion.
    #[default]
    Auto,
}

impl Density {
    /// The length that it states, world units; 0 for other ways.
    pub fn spacing(self) -> f64 {
        if let Self::Spacing(h) = self { h } else { 0.0 }
    }
}

impl SplatParams {
    /// Checks the transform and the colour.
    pub(crate) fn check(&self) -> Result<(), ConvertError> {
        let t = &self.transform;
        if !(t.scale.is_finite() && t.scale > 0.0) {
            return Err(self.bad("scale", t.scale, "a finite number > 0"));
        }
        if !(t.rotation.is_normalized() && t.translation.is_finite()) {
            return Err(self.bad("transform", t, "a unit quaternion and a finite translation"));
        }
        if !self.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
            return Err(self.bad("color", self.color, "three finite numbers ≥ 0"));
        }
        if !(1.0..=8.0).contains(&self.profile.cutoff) {
            return Err(self.bad("cutoff", self.profile.cutoff, "1 to 8 standard deviations"));
        }
        Ok(())
    }

    /// Checks a spacing in world units.
    pub(crate) fn check_spacing(&self, spacing: f64) -> Result<f64, ConvertError> {
        if SPACING_RANGE.contains(&spacing) {
            return Ok(spacing);
        }
        Err(self.bad("spacing", spacing, "a number from 1e-15 to 1e15 world units"))
    }

    /// Whether some of its discs have an image as their footprint.
    pub(crate) fn shows_images(&self) -> bool {
        self.footprints.as_ref().is_some_and(|choice| choice.has_images(false))
    }

    /// A parameter error of this object.
    pub(crate) fn bad(
        &self,
        parameter: &'static str,
        found: impl std::fmt::Debug,
        expected: &'static str,
    ) -> ConvertError {
        self.bad_text(parameter, format!("{found:?}"), expected)
    }

    /// A parameter error whose value is told in words.
    pub(crate) fn bad_text(&self, parameter: &'static str, found: String, expected: &'static str) -> ConvertError {
        ConvertError::Parameter { object: self.object_name.clone(), parameter, found, expected }
    }

    /// Turns a broken promise of an input into an error that names this object.
    pub(crate) fn input(&self, source: splat_core::Error) -> ConvertError {
        ConvertError::Input { object: self.object_name.clone(), source }
    }

    /// Refuses more splats than the limit.
    pub(crate) fn check_count(&self, needed: f64) -> Result<(), ConvertError> {
        self.check_limit(needed, self.most_splats(), "splats")
    }

    /// Refuses a cloud of more splats or bytes than the limits.
    pub(crate) fn check_cloud(&self, splats: f64, columns: ColumnSet) -> Result<(), ConvertError> {
        self.check_count(splats)?;
        self.check_limit(splats * columns.bytes_per_splat() as f64, self.limits.max_bytes, "bytes")
    }

    /// Refuses more of something than the limit.
    pub(crate) fn check_limit(&self, needed: f64, limit: u64, unit: &'static str) -> Result<(), ConvertError> {
        if needed <= limit as f64 { Ok(()) } else { Err(self.exceeded(needed, Some(limit), unit)) }
    }

    /// Most splats that this object may become.
    pub(crate) fn most_splats(&self) -> u64 {
        self.limits.max_elements.min(u32::MAX.into())
    }

    /// The refusal of this object; numbers beyond counting, and those that are none, are the largest.
    pub(crate) fn exceeded(&self, needed: f64, limit: Option<u64>, unit: &'static str) -> ConvertError {
        let needed = if needed.is_nan() { u64::MAX } else { needed as u64 };
        let what = format!("object '{}'", self.object_name).into();
        ConvertError::Limit(Exceeded { what, needed, limit, unit, hint: "choose a larger spacing".into() })
    }

    /// Cutoff radius of splats that are `spacing` apart, world units.
    pub(crate) fn radius(&self, spacing: f64) -> f64 {
        f64::from(self.profile.cutoff) * f64::from(Footprint::SIGMA_OVER_SPACING) * spacing
    }
}
