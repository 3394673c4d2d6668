//! Isosurfaces of volumes as meshes: marching cubes (Lorensen and Cline 1987) in three passes over rows, as flying edges
//! (Schroeder et al. 2015) do it.
//!
//! 1. Each lattice point gets a bit: at or above the isovalue ([`mod@signs`]).
//! 2. Each row counts its crossed edges, one vertex each, and its triangles; sums give each row its place in the result.
//! 3. Each row writes its vertices and its triangles. Words of 64 equal bits are passed over; a row knows the numbers of
//!    the vertices of its neighbours by counting along. Layers are independent, so threads change nothing.
//!
//! The table ([`mod@table`]) decides on each face by the face alone. So the mesh is closed except at the border of the
//! lattice, and every edge has two triangles, one each way. A value equal to the isovalue counts as above it. Vertices
//! then coincide with a lattice point, and triangles may have no area. They are kept, because the mesh must stay closed;
//! `convert::mesh_to_points` counts and skips them.

mod signs;
mod table;

use crate::Inside;
use rayon::prelude::*;
use signs::Signs;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Error, Exceeded, Grid, Mesh};
use table::TABLE;

/// Vertices along x, y and z and triangles of one row; then where they begin.
type Row = [u32; 4];

/// The surface where a volume takes the value `isovalue`, vertices where the lattice's edges reach it linearly.
///
/// Normals are unit central differences, one-sided at the border of the lattice, and point out of the `inside`; so does
/// the winding. The surface ends, open, where the lattice does. `origin` of the mesh is the middle of the lattice.
///
/// ```
/// use field::{Inside, isosurface_to_mesh};
/// use splat_core::{Grid, glam::{DMat3, DVec3}};
/// let at = |n: i32| DVec3::new((n % 9) as f64, (n / 9 % 9) as f64, (n / 81) as f64) - 4.0;
/// let values = (0..729).map(|n| at(n).length() as f32).collect();
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [9; 3], values };
/// let ball = isosurface_to_mesh(&grid, 3.0, Inside::Below).unwrap();
/// // Euler's formula for a closed surface of one piece.
/// assert_eq!(ball.position.len() - ball.triangles.len() / 2, 2);
/// ```
///
/// # Errors
/// [`Error::Invalid`] or [`Error::ColumnLength`] for a grid that does not validate or an isovalue that is not finite;
/// [`Error::Limit`] for more than 2³² − 1 vertices or triangles.
pub fn isosurface_to_mesh(grid: &Grid, isovalue: f64, inside: Inside) -> Result<Mesh, Error> {
    if !isovalue.is_finite() {
        return Err(Error::invalid("isosurface", 0, "isovalue", isovalue, "a finite number"));
    }
    let lattice_from_object = grid.axes.inverse();
    let whole = grid.dims.iter().try_fold(1usize, |n, d| n.checked_mul(*d)) == Some(grid.values.len());
    let sound = whole && !grid.values.is_empty() && grid.origin.is_finite() && lattice_from_object.is_finite();
    // Values are looked at once, together with their signs; what is wrong is told by the grid's own check.
    let Some(signs) = (if sound { Signs::new(grid, isovalue) } else { None }) else {
        grid.validate()?;
        return Err(Error::invalid("grid", 0, "axes", grid.axes, "steps that have an inverse"));
    };
    let last = DVec3::from_array(grid.dims.map(|n| (n - 1) as f64));
    let middle = 0.5 * last;
    let mut mesh = Mesh { origin: grid.origin + grid.axes * middle, ..Mesh::default() };
    if grid.dims.iter().any(|n| *n < 2) {
        return Ok(mesh);
    }
    let (rows, [vertices, triangles]) = count(&signs)?;
    mesh.position = vec![Vec3::ZERO; vertices];
    mesh.normal = vec![Vec3::ZERO; vertices];
    mesh.triangles = vec![[0; 3]; triangles];
    let flipped = (inside == Inside::Above) != (grid.axes.determinant() < 0.0);
    let writer = Writer {
        grid,
        signs: &signs,
        rows: &rows,
        isovalue,
        middle,
        normal_from_gradient: lattice_from_object.transpose() * inside.sign(),
        flipped,
    };
    let per_layer = |r: fn(&Row) -> u32, total: usize| starts(&rows, grid.dims[1], r, total);
    let ends = (per_layer(|r| r[0], vertices), per_layer(|r| r[3], triangles));
    let positions = split(&mut mesh.position, &ends.0);
    let normals = split(&mut mesh.normal, &ends.0);
    let faces = split(&mut mesh.triangles, &ends.1);
    (positions, normals, faces).into_par_iter().enumerate().for_each(|(k, (position, normal, faces))| {
        writer.vertices(k, position, normal);
        writer.triangles(k, faces);
    });
    Ok(mesh)
}

/// Where each row begins in the result, and how many vertices and triangles there are.
fn count(signs: &Signs) -> Result<(Vec<Row>, [usize; 2]), Error> {
    let [_, ny, nz] = signs.dims;
    let triangles: [u32; 256] = std::array::from_fn(|case| TABLE.triangles[case].len() as u32);
    let row = |n: usize| -> Row {
        let j = n % ny;
        let k = n / ny;
        let mut row = [0; 4];
        for w in 0..signs.words {
            (0..3).for_each(|axis| row[axis] += signs.crossed(axis, j, k, w).count_ones());
        }
        if j + 1 < ny && k + 1 < nz {
            signs.crossed_cells(j, k, |case| row[3] += triangles[case as usize]);
        }
        row
    };
    let mut rows: Vec<Row> = (0..ny * nz).into_par_iter().with_min_len(256).map(row).collect();
    let mut vertices = 0u64;
    let mut faces = 0u64;
    for row in &mut rows {
        let [x, y, z, t] = row.map(u64::from);
        // Sums that do not fit are refused below.
        *row = [vertices, vertices + x, vertices + x + y, faces].map(|n| n as u32);
        (vertices, faces) = (vertices + x + y + z, faces + t);
    }
    let limit = u64::from(u32::MAX);
    for (unit, needed) in [("vertices", vertices), ("triangles", faces)] {
        if needed > limit {
            let what = "an isosurface".into();
            let hint = "use a coarser grid".into();
            return Err(Error::Limit(Exceeded { what, needed, limit: Some(limit), unit, hint }));
        }
    }
    Ok((rows, [vertices as usize, faces as usize]))
}

/// Elements of each layer.
fn starts(rows: &[Row], per_layer: usize, count: fn(&Row) -> u32, total: usize) -> Vec<usize> {
    let first: Vec<usize> = rows.iter().step_by(per_layer).map(|r| count(r) as usize).chain([total]).collect();
    first.windows(2).map(|w| w[1] - w[0]).collect()
}

fn split<'a, T>(mut rest: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    let mut parts = Vec::with_capacity(lengths.len());
    for n in lengths {
        let (part, behind) = rest.split_at_mut(*n);
        parts.push(part);
        rest = behind;
    }
    parts
}

/// What writing a layer needs.
struct Writer<'a> {
    grid: &'a Grid,
    signs: &'a Signs,
    rows: &'a [Row],
    isovalue: f64,
    /// Lattice coordinates of the mesh's origin.
    middle: DVec3,
    /// Turns differences in the lattice into directions out of the inside.
    normal_from_gradient: DMat3,
    flipped: bool,
}

impl Writer<'_> {
    /// Writes the vertices of layer `k`: of each row those along x, then y, then z.
    fn vertices(&self, k: usize, position: &mut [Vec3], normal: &mut [Vec3]) {
        let mut n = 0;
        for j in 0..self.grid.dims[1] {
            for axis in 0..3 {
                for w in 0..self.signs.words {
                    let mut crossed = self.signs.crossed(axis, j, k, w);
                    while crossed != 0 {
                        let i = 64 * w + crossed.trailing_zeros() as usize;
                        crossed &= crossed - 1;
                        (position[n], normal[n]) = self.vertex([i, j, k], axis);
                        n += 1;
                    }
                }
            }
        }
    }

    /// Where the edge from a lattice point along `axis` is crossed, and the normal there.
    fn vertex(&self, from: [usize; 3], axis: usize) -> (Vec3, Vec3) {
        let mut to = from;
        to[axis] += 1;
        let a = self.value(from);
        let b = self.value(to);
        let t = (self.isovalue - a) / (b - a);
        let mut at = DVec3::from_array(from.map(|c| c as f64)) - self.middle;
        at[axis] += t;
        let gradient = self.gradient(from) * (1.0 - t) + self.gradient(to) * t;
        let direction = self.normal_from_gradient * gradient;
        let largest = direction.abs().max_element();
        let normal = if largest > 0.0 && largest.is_finite() {
            (direction / largest).normalize()
        } else {
            // A place without slope: along the edge, whose ends differ.
            (self.normal_from_gradient.col(axis) * (b - a).signum()).normalize_or_zero()
        };
        ((self.grid.axes * at).as_vec3(), normal.as_vec3())
    }

    fn value(&self, cell: [usize; 3]) -> f64 {
        let [i, j, k] = cell;
        let [nx, ny, _] = self.grid.dims;
        f64::from(self.grid.values[(k * ny + j) * nx + i])
    }

    /// Central differences over lattice coordinates.
    fn gradient(&self, at: [usize; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| {
            let mut low = at;
            let mut high = at;
            low[axis] = at[axis].saturating_sub(1);
            high[axis] = (at[axis] + 1).min(self.grid.dims[axis] - 1);
            let half = if high[axis] - low[axis] == 2 { 0.5 } else { 1.0 };
            (self.value(high) - self.value(low)) * half
        }))
    }

    /// Writes the triangles of layer `k`.
    fn triangles(&self, k: usize, out: &mut [[u32; 3]]) {
        let [_, ny, nz] = self.grid.dims;
        if k + 1 == nz {
            return;
        }
        let mut n = 0;
        for j in 0..ny - 1 {
            let mut next = Next::new(self.rows, ny, j, k);
            self.signs.crossed_cells(j, k, |case| {
                let vertex = next.step(case);
                for t in &TABLE.triangles[case as usize] {
                    let [a, b, c] = t.map(|e| vertex[e as usize]);
                    out[n] = if self.flipped { [a, c, b] } else { [a, b, c] };
                    n += 1;
                }
            });
        }
    }
}

/// The numbers of the next vertices along a row of cells.
///
/// A crossed edge that begins at point i belongs to cell i too, so cells passed in order meet every one of them.
struct Next {
    /// Edges along x at (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
    x: [u32; 4],
    /// Edges along y at z = 0, 1.
    y: [u32; 2],
    /// Edges along z at y = 0, 1.
    z: [u32; 2],
}

impl Next {
    fn new(rows: &[Row], ny: usize, j: usize, k: usize) -> Self {
        let row = |y: usize, z: usize| &rows[(k + z) * ny + j + y];
        Self {
            x: [row(0, 0)[0], row(1, 0)[0], row(0, 1)[0], row(1, 1)[0]],
            y: [row(0, 0)[1], row(0, 1)[1]],
            z: [row(0, 0)[2], row(1, 0)[2]],
        }
    }

    /// The vertices on the twelve edges of a cell (those that are not crossed mean nothing); moves on to the next cell.
    fn step(&mut self, case: u8) -> [u32; 12] {
        let differ = |a: u32, b: u32| u32::from((case >> a ^ case >> b) & 1);
        let y = [differ(0, 2), differ(4, 6)];
        let z = [differ(0, 4), differ(2, 6)];
        let vertex = [
            self.x[0],
            self.x[1],
            self.x[2],
            self.x[3],
            self.y[0],
            self.y[1],
            self.y[0] + y[0],
            self.y[1] + y[1],
            self.z[0],
            self.z[0] + z[0],
            self.z[1],
            self.z[1] + z[1],
        ];
        for (r, x) in self.x.iter_mut().enumerate() {
            *x += differ(2 * r as u32, 2 * r as u32 + 1);
        }
        (0..2).for_each(|i| (self.y[i], self.z[i]) = (self.y[i] + y[i], self.z[i] + z[i]));
        vertex
    }
}
