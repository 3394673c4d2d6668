//! Gradients of a volume by the 3D Sobel operator (Gunjee 2007, section 4, "Converting the volume data").
//!
//! Along x: ∂ₓ = ½(v₊ − v₋) smoothed by (1, 2, 1)/4 along y and z; the others by turns; then the step of the lattice
//! turns index space into object space: g = axes⁻ᵀ·g_index. The operator is separable, so a slab needs 21 operations
//! a voxel: rows are smoothed and differenced across k once and reused for three rows j.
//!
//! Values are taken relative to one voxel of the slab before anything is added: a volume that lies on a large offset
//! keeps its gradient. On a face the difference is one-sided (divided by one step, not two), so a linear field has an
//! exact gradient everywhere; the paper leaves the faces open.

use rayon::prelude::*;
use splat_core::{
    Grid,
    glam::{DVec3, Mat3, Vec3},
};
use std::ops::Range;

/// Gradient at every lattice point, value per object-space unit.
///
/// ```
/// use convert::sobel_gradient;
/// use splat_core::{Grid, glam::{DMat3, DVec3, Vec3}};
/// let values = (0..27).map(|i| (i % 3) as f32).collect();
/// let axes = DMat3::from_diagonal(DVec3::splat(0.5));
/// let grid = Grid { origin: DVec3::ZERO, axes, dims: [3; 3], values };
/// assert_eq!(sobel_gradient(&grid), vec![Vec3::new(2.0, 0.0, 0.0); 27]);
/// ```
pub fn sobel_gradient(grid: &Grid) -> Vec<Vec3> {
    let mut gradient = bytemuck::zeroed_vec(grid.values.len());
    sobel_gradient_into(grid, &mut gradient);
    gradient
}

/// [`sobel_gradient`] into memory of the caller, one entry per value.
///
/// # Panics
/// If `gradient` is shorter than the grid's values.
pub fn sobel_gradient_into(grid: &Grid, gradient: &mut [Vec3]) {
    let slab = grid.dims[0] * grid.dims[1];
    let sobel = Sobel::new(grid);
    gradient[..grid.values.len()]
        .par_chunks_mut(slab.max(1))
        .enumerate()
        .for_each_init(Rows::default, |rows, (k, out)| sobel.slab(k, 0..grid.dims[1], rows, out));
}

/// The operator for one grid.
pub(crate) struct Sobel<'a> {
    grid: &'a Grid,
    /// axes⁻ᵀ/32: Sobel weights sum to 16, interior differences span two steps.
    object_from_index: Mat3,
    /// Whether that has zeros off its diagonal.
    diagonal: bool,
}

/// Scratch rows of one task.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    /// Smoothed and differenced along k, for rows j − 1, j and j + 1.
    smooth: [Vec<f32>; 3],
    across: [Vec<f32>; 3],
    /// The three sums over j, with one entry of padding at both ends.
    sum: [Vec<f32>; 3],
    /// The gradient in index space, by component.
    gradient: [Vec<f32>; 3],
}

impl<'a> Sobel<'a> {
    pub(crate) fn new(grid: &'a Grid) -> Self {
        let object_from_index = (grid.axes.inverse().transpose() * (1.0 / 32.0)).as_mat3();
        let diagonal = object_from_index == Mat3::from_diagonal(object_from_index.diagonal());
        Self { grid, object_from_index, diagonal }
    }

    /// Gradients of some rows of the slab of constant `k`, x fastest; of `out`, which is for all of them, the rest stays as it is.
    pub(crate) fn slab(&self, k: usize, js: Range<usize>, rows: &mut Rows, out: &mut [Vec3]) {
        rows.resize(self.grid.dims[0]);
        pulp::Arch::new().dispatch(Slab { sobel: self, k, js, rows, out });
    }

    /// The last direction, along the row.
    #[inline(always)]
    fn finish(&self, rows: &mut Rows, factor_j: f32, factor_k: f32, out: &mut [Vec3]) {
        let nx = out.len();
        let m = &self.object_from_index;
        let columns = [m.x_axis, m.y_axis * factor_j, m.z_axis * factor_k];
        let [x, y, z] = [&rows.sum[0][..nx + 2], &rows.sum[1][..nx + 2], &rows.sum[2][..nx + 2]];
        let [gx, gy, gz] = &mut rows.gradient;
        let gx = &mut gx[..nx];
        let gy = &mut gy[..nx];
        let gz = &mut gz[..nx];
        for i in 0..nx {
            let dx = x[i + 2] - x[i];
            let dy = y[i] + y[i + 2] + (y[i + 1] + y[i + 1]);
            let dz = z[i] + z[i + 2] + (z[i + 1] + z[i + 1]);
            (gx[i], gy[i], gz[i]) = (dx, dy, dz);
        }
        gx[0] *= 2.0;
        if nx > 1 {
            gx[nx - 1] *= 2.0;
        }
        // A lattice along the axes, as most are, needs no products of different directions.
        if self.diagonal {
            let scale = Vec3::new(columns[0].x, columns[1].y, columns[2].z);
            for (i, g) in out.iter_mut().enumerate() {
                *g = Vec3::new(gx[i] * scale.x, gy[i] * scale.y, gz[i] * scale.z);
            }
            return;
        }
        for (i, g) in out.iter_mut().enumerate() {
            *g = columns[0] * gx[i] + columns[1] * gy[i] + columns[2] * gz[i];
        }
    }
}

/// One slab's work, in the form that [`pulp`] compiles once per instruction set.
struct Slab<'a> {
    sobel: &'a Sobel<'a>,
    k: usize,
    js: Range<usize>,
    rows: &'a mut Rows,
    out: &'a mut [Vec3],
}

impl pulp::NullaryFnOnce for Slab<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { sobel, k, js, rows, out } = self;
        let [nx, ny, nz] = sobel.grid.dims;
        let reference = sobel.grid.values[k * nx * ny + nx * ny / 2];
        let mut loaded = js.start.saturating_sub(1);
        for j in js {
            while loaded < ny.min(j + 2) {
                rows.load(sobel.grid, loaded, k, reference);
                loaded += 1;
            }
            rows.sum_over_j(j, ny);
            // One-sided differences span one step, not two.
            let at_face = |i: usize, n: usize| if i == 0 || i + 1 == n { 2.0 } else { 1.0 };
            sobel.finish(rows, at_face(j, ny), at_face(k, nz), &mut out[j * nx..][..nx]);
        }
    }
}

impl Rows {
    fn resize(&mut self, nx: usize) {
        self.smooth.iter_mut().chain(&mut self.across).chain(&mut self.gradient).for_each(|r| r.resize(nx, 0.0));
        self.sum.iter_mut().for_each(|r| r.resize(nx + 2, 0.0));
    }

    /// Row j of slab k and its neighbours across k.
    #[inline(always)]
    fn load(&mut self, grid: &Grid, j: usize, k: usize, reference: f32) {
        let [nx, ny, nz] = grid.dims;
        let row = |k: usize| &grid.values[(k * ny + j) * nx..][..nx];
        let below = row(k.saturating_sub(1));
        let here = row(k);
        let above = row((k + 1).min(nz - 1));
        let smooth = &mut self.smooth[j % 3][..nx];
        let across = &mut self.across[j % 3][..nx];
        for i in 0..nx {
            let b = below[i] - reference;
            let h = here[i] - reference;
            let a = above[i] - reference;
            smooth[i] = b + a + (h + h);
            across[i] = a - b;
        }
    }

    /// Smooths and differences along j, repeating the rows at the faces.
    #[inline(always)]
    fn sum_over_j(&mut self, j: usize, ny: usize) {
        let below = j.saturating_sub(1) % 3;
        let above = (j + 1).min(ny - 1) % 3;
        let nx = self.smooth[0].len();
        let [sx, sy, sz] = &mut self.sum;
        let [b, h, a] = [below, j % 3, above].map(|r| &self.smooth[r][..nx]);
        let [db, dh, da] = [below, j % 3, above].map(|r| &self.across[r][..nx]);
        let px = &mut sx[1..=nx];
        let py = &mut sy[1..=nx];
        let pz = &mut sz[1..=nx];
        for i in 0..nx {
            px[i] = b[i] + a[i] + (h[i] + h[i]);
            py[i] = a[i] - b[i];
            pz[i] = db[i] + da[i] + (dh[i] + dh[i]);
        }
        for row in &mut self.sum {
            (row[0], row[nx + 1]) = (row[1], row[nx]);
        }
    }
}

/// Normal of the level set through a voxel, towards lower values; zero where there is no gradient.
pub(crate) fn normal_from_gradient(gradient: Vec3) -> DVec3 {
    let g = gradient.as_dvec3();
    let largest = g.abs().max_element();
    if largest > 0.0 && largest.is_finite() { -(g / largest).normalize() } else { DVec3::ZERO }
}
