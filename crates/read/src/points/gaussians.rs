//! Gaussians as files have them, one by one, until they are points with a table of Gaussians.

use super::origin;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::stream::input;
use splat_core::glam::{DMat3, DQuat, DVec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::{Gaussians, RawPoints};

/// The constant of the harmonic of degree 0, by which files that have colours state them.
pub(crate) const CONSTANT: f64 = 0.282_094_791_773_878_14;

/// The largest coefficient of a harmonic: light that comes of such stays a number.
const MOST_COEFFICIENT: f32 = 1e4;

/// Logarithms of deviations: what an exponential makes of them stays a normal number.
const LOGARITHMS: std::ops::RangeInclusive<f64> = -80.0..=80.0;

/// The remark on Gaussians that were trained with the filter of Mip-Splatting.
pub(crate) const ANTIALIASED: &str =
    "its Gaussians were trained with a filter that keeps their light, and are drawn with that of others";

/// One Gaussian in the axes and the unit of its file.
pub(crate) struct Gaussian {
    pub(crate) position: DVec3,
    /// Standard deviations along its axes.
    pub(crate) deviation: DVec3,
    /// A quaternion of any length, w first.
    pub(crate) rotation: [f64; 4],
    pub(crate) opacity: f64,
}

/// The reason why a Gaussian is refused.
pub(crate) struct Refused {
    expected: &'static str,
    found: String,
    hint: &'static str,
}

impl Refused {
    /// Refuses a Gaussian for a reason that only its format knows.
    pub(crate) fn new(expected: &'static str, found: String) -> Self {
        Self { expected, found, hint: HINT }
    }
}

/// The hint of every refused Gaussian.
const HINT: &str = "remove the Gaussian, or leave such points out with --drop-invalid";

/// Gaussians that were read so far.
pub(crate) struct Gathered {
    positions: Vec<DVec3>,
    points: RawPoints,
    drop_invalid: bool,
}

/// Coefficients beside the constant of one colour, and the degree that has as many.
pub(crate) fn degree_of(coefficients: usize) -> Option<u8> {
    [0, 3, 8, 15].iter().position(|n| *n == coefficients).map(|degree| degree as u8)
}

/// Deviations from their natural logarithms; NaN for those beyond reason.
pub(crate) fn exponentials(logarithms: DVec3) -> DVec3 {
    logarithms.map(|l| if LOGARITHMS.contains(&l) { libm::exp(l) } else { f64::NAN })
}

/// The opacity that a logit stands for.
pub(crate) fn sigmoid(logit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-logit))
}

impl Gathered {
    /// Room for `count` Gaussians, checked against the limits.
    pub(crate) fn new(count: usize, degree: u8, params: &ReadParams) -> Result<Self, ReadError> {
        let mut points = RawPoints { gaussians: Gaussians { degree, ..Gaussians::default() }, ..RawPoints::default() };
        let g = &mut points.gaussians;
        let each = (size_of::<DVec3>() + 2 * size_of::<[f32; 3]>()) as u64 + Gaussians::bytes_each(degree);
        input::hold("the Gaussians", each.saturating_mul(count as u64), params)?;
        let mut positions = Vec::new();
        input::reserve(&mut positions, count)?;
        input::reserve(&mut points.color, count)?;
        input::reserve(&mut g.axes, count)?;
        input::reserve(&mut g.opacity, count)?;
        let terms = g.terms();
        input::reserve(&mut g.harmonics, count.saturating_mul(terms))?;
        Ok(Self { positions, points, drop_invalid: params.drop_invalid })
    }

    /// Takes one with its coefficients, the constant first, or counts it as dropped if its numbers make no Gaussian.
    pub(crate) fn push(
        &mut self,
        gaussian: &Gaussian,
        harmonics: impl ExactSizeIterator<Item = [f64; 3]>,
    ) -> Result<(), Refused> {
        let before = self.points.gaussians.harmonics.len();
        let narrowed = harmonics.map(|h| h.map(|v| v as f32));
        self.points.gaussians.harmonics.extend(narrowed);
        match self.checked(gaussian, before) {
            Ok(()) => Ok(()),
            Err(_) if self.drop_invalid => {
                self.points.gaussians.harmonics.truncate(before);
                self.points.dropped += 1;
                Ok(())
            }
            Err(reason) => Err(reason),
        }
    }

    /// Refuses one that its format has already found invalid, or counts it as dropped.
    pub(crate) fn refuse(&mut self, reason: Refused) -> Result<(), Refused> {
        if !self.drop_invalid {
            return Err(reason);
        }
        self.points.dropped += 1;
        Ok(())
    }

    fn checked(&mut self, gaussian: &Gaussian, first: usize) -> Result<(), Refused> {
        let refuse = |expected: &'static str, found: String| Err(Refused::new(expected, found));
        let Gaussian { position, deviation, rotation: [w, x, y, z], opacity } = *gaussian;
        if !position.is_finite() {
            return refuse("a place of finite numbers", position.to_string());
        }
        let axes = deviation.as_vec3();
        if !(axes.is_finite() && axes.cmpge(splat_core::glam::Vec3::ZERO).all()) {
            return refuse("deviations of a reasonable size, from 1e-34 to 1e34", deviation.to_string());
        }
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        let length = quaternion.length();
        if !(length.is_finite() && length > 1e-12) {
            return refuse("a rotation that is no quaternion of zeros", quaternion.to_string());
        }
        if !(0.0..=1.0).contains(&opacity) {
            return refuse("an opacity from 0 to 1", opacity.to_string());
        }
        let g = &mut self.points.gaussians;
        if let Some(bad) = g.harmonics[first..].iter().find(|h| !h.iter().all(|v| v.abs() <= MOST_COEFFICIENT)) {
            return refuse("colours of numbers from −10000 to 10000", format!("{bad:?}"));
        }
        let constant = g.harmonics[first].map(f64::from);
        let turned = DMat3::from_quat(DQuat::from_xyzw(x / length, y / length, z / length, w / length));
        let axis = |k: usize| (turned.col(k) * deviation[k]).as_vec3();
        g.axes.push([axis(0), axis(1), axis(2)]);
        g.opacity.push(opacity as f32);
        self.points.color.push(constant.map(|c| linear_from_srgb((0.5 + CONSTANT * c).max(0.0))));
        self.positions.push(position);
        Ok(())
    }

    /// Whether most of them are about as large as all of them together: a trainer makes none such.
    pub(crate) fn are_as_large_as_all(&self) -> bool {
        /// Fewer may be a test of one.
        const FEWEST: usize = 100;
        /// Median of the longest axes over the diagonal of the box of all places.
        const SHARE: f64 = 0.1;
        let longest = |axes: &[splat_core::glam::Vec3; 3]| axes.iter().map(|axis| axis.length()).fold(0.0, f32::max);
        let mut longest: Vec<f32> = self.points.gaussians.axes.iter().map(longest).collect();
        if longest.len() < FEWEST {
            return false;
        }
        let middle = longest.len() / 2;
        let median = f64::from(*longest.select_nth_unstable_by(middle, f32::total_cmp).1);
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        self.positions.iter().for_each(|place| (low, high) = (low.min(*place), high.max(*place)));
        median >= SHARE * (high - low).length()
    }

    /// Makes the logarithms of deviations the deviations: none of them may be below 0.
    pub(crate) fn take_logarithms(&mut self) {
        let logarithm = |axis: DVec3| {
            let length = axis.length();
            if length > 0.0 { axis * (libm::log(length).max(0.0) / length) } else { axis }
        };
        for axes in &mut self.points.gaussians.axes {
            *axes = axes.map(|axis| logarithm(axis.as_dvec3()).as_vec3());
        }
    }

    /// All of them; `place` is where they begin in the file.
    pub(crate) fn finish(self, place: Place) -> Result<RawPoints, ReadError> {
        let Self { positions, points, .. } = self;
        let (origin, position) = origin::relative(&positions, place, |i| format!("Gaussian {i}"))?;
        Ok(RawPoints { origin, position, ..points })
    }
}

/// The error of Gaussian `i` at a place.
pub(crate) fn refused(place: Place, i: u64, reason: Refused) -> ReadError {
    ReadError::input(place, format!("{} for Gaussian {i}", reason.expected), reason.found, reason.hint)
}
