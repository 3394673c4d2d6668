//! Where the ray through a pixel meets the plane of a triangle.
//!
//! For a ray d from the eye, d·(v_j × v_k) of the three pairs of corners are to each other as the barycentric coordinates, whatever
//! the corners' depths, behind the eye too; they are linear in the picture. For parallel rays the cross product is that of x and y, seen from the
//! ray. Depth is that of the corners, mixed.

use super::view::Meshes;
use glam::DVec3;

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// In \[0, 1\]; where rounding of corners lets a pixel meet a triangle that its ray passes by, of the nearest place on its rim.
    pub(super) barycentric: [f64; 3],
    /// View depth.
    pub(super) depth: f64,
    /// See [`super::DepthPlanes::slope`].
    pub(super) slope: [f64; 2],
}

/// The three linear functions of one triangle.
pub(super) struct Plane {
    /// At column 0, row 0; per column; per row.
    weights: [DVec3; 3],
    depths: [f64; 3],
    is_parallel: bool,
}

impl Plane {
    pub(super) fn new(meshes: &Meshes<'_>, triangle: [DVec3; 3]) -> Self {
        let is_parallel = meshes.camera.is_orthographic();
        let weight = |k: usize| {
            let a = triangle[(k + 1) % 3];
            let b = triangle[(k + 2) % 3];
            // Of the ray's x, of its y, and without either.
            let (x, y, rest) = if is_parallel {
                (a.y - b.y, b.x - a.x, a.x * b.y - a.y * b.x)
            } else {
                let normal = a.cross(b);
                (normal.x, normal.y, normal.z)
            };
            let column = x / meshes.focal;
            let row = -y / meshes.focal;
            let [width, height] = meshes.camera.size.map(|s| 0.5 * f64::from(s) - 0.5);
            DVec3::new(rest - column * width - row * height, column, row)
        };
        Self { weights: [weight(0), weight(1), weight(2)], depths: triangle.map(|p| p.z), is_parallel }
    }

    /// Where the ray through the middle of a pixel meets the plane.
    #[inline]
    pub(super) fn at(&self, pixel: [usize; 2]) -> Crossing {
        let [x, y] = pixel;
        let at = DVec3::new(1.0, x as f64, y as f64);
        let raw = self.weights.map(|w| w.dot(at));
        let whole = raw[0] + raw[1] + raw[2];
        let turned = raw.map(|w| if whole < 0.0 { -w } else { w }.max(0.0));
        let sum = turned[0] + turned[1] + turned[2];
        let barycentric = if sum > 0.0 { turned.map(|w| w / sum) } else { [1.0 / 3.0; 3] };
        let mixed =
            |weights: [f64; 3]| weights[0] * self.depths[0] + weights[1] * self.depths[1] + weights[2] * self.depths[2];
        let slope = [1, 2].map(|axis| {
            let step = self.weights.map(|w| w[axis]);
            let grows = if self.is_parallel { mixed(step) } else { step[0] + step[1] + step[2] };
            let slope = grows / whole;
            if slope.is_finite() { slope } else { 0.0 }
        });
        Crossing { barycentric, depth: mixed(barycentric), slope }
    }
}
