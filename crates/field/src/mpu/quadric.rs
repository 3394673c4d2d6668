//! Local shapes: a quadratic polynomial, or two or three joined by maximum and minimum at edges and corners.
//!
//! Q(y) = c + l·y + yᵀMy in y = (x − center)/R, the local coordinates of a support ball of radius R; |y| ≤ 1 inside.

use splat_core::glam::{DMat3, DVec3};

/// A quadratic polynomial in local coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Quadric {
    pub(super) constant: f64,
    pub(super) linear: DVec3,
    /// M, symmetric: its diagonal and its entries yz, zx, xy.
    pub(super) diagonal: DVec3,
    pub(super) mixed: DVec3,
}

impl Quadric {
    /// n·y − h(u, v) with h = a·u² + b·uv + c·v² + d·u + e·v + f in the frame (e₁, e₂, n).
    pub(super) fn height(frame: [DVec3; 3], coefficients: [f64; 6]) -> Self {
        let [a, b, c, d, e, f] = coefficients;
        let [u, v, n] = frame;
        let product =
            |p: DVec3, q: DVec3| 0.5 * DVec3::new(p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x);
        Self {
            constant: -f,
            linear: n - u * d - v * e,
            diagonal: -(u * u * a + u * v * b + v * v * c),
            mixed: -(product(u, u) * a + product(u, v) * b + product(v, v) * c),
        }
    }

    /// Values times `s`, as a function of coordinates whose unit is `unit` of the old.
    pub(super) fn rescaled(self, s: f64, unit: f64) -> Self {
        let once = s * unit;
        let twice = s * unit * unit;
        Self {
            constant: self.constant * s,
            linear: self.linear * once,
            diagonal: self.diagonal * twice,
            mixed: self.mixed * twice,
        }
    }

    /// 2My.
    fn bend(&self, y: DVec3) -> DVec3 {
        let m = self.mixed;
        2.0 * (self.diagonal * y + DVec3::new(m.z * y.y + m.y * y.z, m.z * y.x + m.x * y.z, m.y * y.x + m.x * y.y))
    }

    pub(super) fn value(&self, y: DVec3) -> f64 {
        self.value_gradient(y).0
    }

    #[inline]
    pub(super) fn value_gradient(&self, y: DVec3) -> (f64, DVec3) {
        let bend = self.bend(y);
        (self.constant + (self.linear + 0.5 * bend).dot(y), self.linear + bend)
    }

    pub(super) fn hessian(&self) -> DMat3 {
        let d = 2.0 * self.diagonal;
        let m = 2.0 * self.mixed;
        DMat3::from_cols(DVec3::new(d.x, m.z, m.y), DVec3::new(m.z, d.y, m.x), DVec3::new(m.y, m.x, d.z))
    }

    /// Frobenius norm of M, at least its largest eigenvalue.
    fn curvature(&self) -> f64 {
        (self.diagonal.length_squared() + 2.0 * self.mixed.length_squared()).sqrt()
    }

    /// Range within `radius` of `y` and the largest gradient there.
    fn over_ball(&self, y: DVec3, radius: f64) -> ([f64; 2], f64) {
        let (value, gradient) = self.value_gradient(y);
        let slope = gradient.length();
        let curvature = self.curvature();
        let reach = radius * (slope + radius * curvature);
        // Terms may cancel in the value: what they lose is relative to them, not to it.
        let slack = 1e-14 * (self.constant.abs() + self.linear.abs().element_sum() + curvature);
        ([value - reach - slack, value + reach + slack], slope + 2.0 * radius * curvature + slack)
    }
}

/// How the pieces of a shape are joined. The inside is negative: a maximum intersects, a minimum unites.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Joint {
    /// One piece.
    Smooth,
    /// max of two or three.
    Max,
    /// min of two or three.
    Min,
    /// max(Q₀, min(Q₁, Q₂)).
    MaxMin,
    /// min(Q₀, max(Q₁, Q₂)).
    MinMax,
}

impl Joint {
    /// Index of the piece whose value counts.
    pub(super) fn active(self, values: &[f64]) -> usize {
        let pick = |range: std::ops::Range<usize>, greatest: bool| {
            let first = range.start;
            range.fold(first, |best, i| {
                if (values[i] > values[best]) == greatest && values[i] != values[best] { i } else { best }
            })
        };
        match self {
            Self::Smooth => 0,
            Self::Max => pick(0..values.len(), true),
            Self::Min => pick(0..values.len(), false),
            Self::MaxMin => {
                let other = pick(1..values.len(), false);
                if values[0] >= values[other] { 0 } else { other }
            }
            Self::MinMax => {
                let other = pick(1..values.len(), true);
                if values[0] <= values[other] { 0 } else { other }
            }
        }
    }
}

/// A local shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    pub(super) pieces: Vec<Quadric>,
    pub(super) joint: Joint,
}

impl Shape {
    pub(super) fn smooth(quadric: Quadric) -> Self {
        Self { pieces: vec![quadric], joint: Joint::Smooth }
    }
}

/// Most pieces of a shape.
pub(super) const MAX_PIECES: usize = 3;

/// The piece of a shape that counts at `y`.
#[inline]
pub(super) fn active_piece(pieces: &[Quadric], joint: Joint, y: DVec3) -> &Quadric {
    if pieces.len() == 1 {
        return &pieces[0];
    }
    let mut values = [0.0; MAX_PIECES];
    pieces.iter().zip(&mut values).for_each(|(q, v)| *v = q.value(y));
    &pieces[joint.active(&values[..pieces.len()])]
}

/// Range of a shape within `radius` of `y` and its largest gradient there.
pub(super) fn shape_over_ball(pieces: &[Quadric], joint: Joint, y: DVec3, radius: f64) -> ([f64; 2], f64) {
    let mut ends = [[0.0; MAX_PIECES]; 2];
    let mut steepest = 0.0f64;
    for (i, q) in pieces.iter().enumerate() {
        let ([low, high], slope) = q.over_ball(y, radius);
        (ends[0][i], ends[1][i]) = (low, high);
        steepest = steepest.max(slope);
    }
    // Joints rise with each piece, so ends go to ends.
    (ends.map(|e| e[joint.active(&e[..pieces.len()])]), steepest)
}
