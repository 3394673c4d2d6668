//! Level sets of scattered points: multi-level partition of unity implicits (Ohtake, Belyaev, Alexa, Turk, Seidel 2003).
//!
//! f(x) = Σ wᵢ(x)Qᵢ(x) / Σ wᵢ(x), negative inside. Qᵢ is a local shape fitted to the points of one cell of an octree
//! ([`mod@fit`], [`mod@sharp`]), about the signed distance to them; wᵢ is a quadratic B-spline of the distance to the cell's
//! middle with support radius α times the diagonal of the cell ([`mod@weight`]). Cells divide until the shape is within the
//! tolerance ε₀ of its points ([`mod@octree`]). The paper descends the tree for each value; here a cell lists the functions
//! that reach it ([`mod@blend`]).
//!
//! | symbol | name | meaning |
//! |---|---|---|
//! | ε₀ | `tolerance` | Taubin's distance of points from a shape, over the diagonal of the points' box |
//! | α | `support` | support radius over the diagonal of a cell |
//! | N_min | `samples` | fewest points a shape is fitted to |

mod blend;
mod fit;
mod octree;
mod quadric;
mod samples;
mod sharp;
mod side;
mod solve;
mod weight;

use crate::FieldError;
use octree::Octree;
pub use samples::SurfaceSample;
use samples::{SampleTree, box_of, in_order};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{DAabb, Progress, ScalarField};

/// Half the side of the cube over half the longest side of the points' box: closed surfaces end before the cube does.
const MARGIN: f64 = 1.25;

/// Parameters of the field through scattered points.
#[derive(Debug, Clone, PartialEq)]
pub struct MpuParams {
    /// Name of the object in messages.
    pub object_name: String,
    /// ε₀: how far points may lie from the local shape, over the diagonal of their box; above 0, up to 1.
    pub tolerance: f64,
    /// Most levels below the root, 0 to 24.
    pub max_depth: u32,
    /// N_min: fewest points that a shape is fitted to, 6 to 64.
    pub samples: usize,
    /// α: support radius over the diagonal of a cell, 0.6 to 2.
    pub support: f64,
    /// Whether shapes may have edges and corners.
    pub sharp: bool,
}

impl Default for MpuParams {
    fn default() -> Self {
        Self {
            object_name: "object".to_owned(),
            tolerance: 1e-3,
            max_depth: 16,
            samples: 15,
            support: 0.75,
            sharp: true,
        }
    }
}

/// The report of the construction of a field from points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MpuReport {
    /// Points given.
    pub points: u64,
    /// Points that count: exact copies do not.
    pub samples: u64,
    /// Leaves of the octree, each with one local shape.
    pub leaves: u64,
    /// Leaves with an edge or a corner.
    pub sharp: u64,
    /// Levels below the root.
    pub depth: u32,
    /// Entries in the lists of leaves; over `leaves` the functions looked at for one value.
    pub listed: u64,
    /// ε₀ as a length, units of the points.
    pub tolerance: f64,
    /// Leaves that miss the tolerance because they had too few points or the tree was deep enough.
    pub missed: u64,
    /// Largest distance of a point from the shape of a leaf whose ball it lies in, by Taubin's measure.
    pub largest_error: f64,
}

/// What cells are built to.
#[derive(Debug, Clone, Copy)]
struct Tolerances {
    /// ε₀ as a length.
    error: f64,
    depth: u32,
    samples: usize,
    support: f64,
    sharp: bool,
}

/// A field whose zero set passes by scattered points; see [`MpuField::through`].
///
/// The points define the field in a cube around them ([`MpuField::bounds`]). Elsewhere the field has the value of the
/// nearest place of the cube, and no surface ([`ScalarField::in_domain`]).
#[derive(Debug)]
pub struct MpuField {
    origin: DVec3,
    octree: Octree,
}

fn bad(params: &MpuParams, parameter: &'static str, found: impl std::fmt::Debug, expected: &'static str) -> FieldError {
    FieldError::Parameter { object: params.object_name.clone(), parameter, found: format!("{found:?}"), expected }
}

impl MpuParams {
    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`FieldError::Parameter`] for the first that is not.
    pub fn check(&self) -> Result<(), FieldError> {
        if !(self.tolerance > 0.0 && self.tolerance <= 1.0) {
            return Err(bad(self, "tolerance", self.tolerance, "a number above 0, up to 1"));
        }
        if self.max_depth > 24 {
            return Err(bad(self, "max_depth", self.max_depth, "0 to 24"));
        }
        if !(6..=64).contains(&self.samples) {
            return Err(bad(self, "samples", self.samples, "6 to 64"));
        }
        if !(0.6..=2.0).contains(&self.support) {
            return Err(bad(self, "support", self.support, "0.6 to 2"));
        }
        Ok(())
    }
}

impl MpuField {
    /// Makes a field whose zero set passes by samples of a surface, whose positions are relative to `origin`; it is positive where their
    /// normals point. Neither their order nor exact copies matter. Work stops where `progress` is cancelled.
    ///
    /// ```
    /// use field::{MpuField, MpuParams, SurfaceSample};
    /// use splat_core::{ScalarField, glam::DVec3};
    /// let on_ball = |i: i32| {
    ///     let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 2000.0;
    ///     let a = f64::from(i) * 2.399_963;
    ///     let place = DVec3::new(a.cos() * (1.0 - y * y).sqrt(), y, a.sin() * (1.0 - y * y).sqrt());
    ///     SurfaceSample { position: place, normal: place.normalize() }
    /// };
    /// let samples = (0..2000).map(on_ball).collect();
    /// let (field, report) = MpuField::through(DVec3::ZERO, samples, &MpuParams::default(), None).unwrap();
    /// assert!(field.value(DVec3::new(0.6, 0.0, 0.8)).abs() < report.tolerance);
    /// assert!(field.value(DVec3::ZERO) < 0.0);
    /// ```
    ///
    /// # Errors
    /// [`FieldError::Parameter`] for parameters outside their ranges, fewer than N_min distinct samples or samples at one
    /// place; [`FieldError::Cancelled`].
    pub fn through(
        origin: DVec3,
        samples: Vec<SurfaceSample>,
        params: &MpuParams,
        progress: Option<&Progress>,
    ) -> Result<(Self, MpuReport), FieldError> {
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        params.check()?;
        let points = samples.len() as u64;
        let samples = in_order(samples);
        if samples.len() < params.samples {
            return Err(bad(
                params,
                "points",
                samples.len(),
                "at least as many different points as `samples` asks for",
            ));
        }
        let bounds = box_of(&samples);
        let side = bounds.size().max_element();
        // The square of the smallest cell must be a normal number.
        if !(1e-140..1e140).contains(&side) {
            return Err(bad(params, "extent of the points", side, "points at different places, 1e-140 to 1e140 apart"));
        }
        let asked = Tolerances {
            error: params.tolerance * bounds.diagonal(),
            depth: params.max_depth,
            samples: params.samples,
            support: params.support,
            sharp: params.sharp,
        };
        let tree = SampleTree::new(samples);
        let middle = bounds.min + 0.5 * bounds.size();
        let (octree, report) = Octree::new(&tree, middle, 0.5 * MARGIN * side, &asked, progress)?;
        Ok((Self { origin, octree }, MpuReport { points, ..report }))
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.octree.bytes()
    }

    /// The cube.
    pub fn bounds(&self) -> DAabb {
        DAabb::around(self.origin + self.octree.center, DVec3::splat(self.octree.half))
    }

    /// A radius with what covers the rounding of positions; `None` for a ball of no numbers.
    fn reach(&self, p: DVec3, radius: f64) -> Option<f64> {
        let far = p.abs().max_element() + self.origin.abs().max_element() + radius;
        let reach = radius + 8.0 * f64::EPSILON * far;
        (p.is_finite() && reach.is_finite() && radius >= 0.0).then_some(reach)
    }

    /// The place of the cube that stands for `p`, relative to the origin, and 1 for each axis on which it is `p`.
    fn local(&self, p: DVec3) -> (DVec3, DVec3) {
        let p = p - self.origin;
        let center = self.octree.center;
        let half = self.octree.half;
        let inside = p.clamp(center - half, center + half);
        (inside, DVec3::select(p.cmpeq(inside), DVec3::ONE, DVec3::ZERO))
    }
}

impl ScalarField for MpuField {
    fn value(&self, p: DVec3) -> f64 {
        self.octree.blend::<0>(self.local(p).0).value
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.value_gradient(p).1
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (p, kept) = self.local(p);
        let blend = self.octree.blend::<1>(p);
        (blend.value, blend.gradient * kept)
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let (p, kept) = self.local(p);
        let keep = DMat3::from_diagonal(kept);
        keep * self.octree.blend::<2>(p).hessian * keep
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let [low, high] = self.octree.over_ball(self.local(p).0, self.reach(p, radius)?);
        Some((low, high))
    }

    fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> {
        let slope = self.octree.steepest(self.local(p).0, self.reach(p, radius)?);
        slope.is_finite().then_some(slope)
    }

    fn in_domain(&self, p: DVec3) -> bool {
        self.local(p).1 == DVec3::ONE
    }
}
