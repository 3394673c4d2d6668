//! The zero set of a field as a mesh: surface nets (Gibson 1998), vertices moved onto the surface by Newton's method.
//!
//! Every cell of a lattice that the surface crosses gets one vertex, every lattice edge that it crosses one
//! quadrilateral. The vertex begins at the mean of the crossings of the cell's edges and follows p ← p − f·∇f/|∇f|²,
//! so positions and normals are those of the field. Only the topology follows from the lattice. The lattice is processed
//! in blocks; a block whose interval bound excludes zero is not evaluated. The mesh is cut where the field's domain
//! ends.

use crate::FieldError;
use crate::domain::cut;
use crate::error::check_cancelled;
use rayon::prelude::*;
use splat_core::{
    Mesh, Progress, ScalarField,
    glam::{DVec3, Vec3},
};

/// Cells along an edge of a block.
const BLOCK: usize = 16;
/// Lattice points along an edge of a block.
const POINTS: usize = BLOCK + 1;

/// A lattice over a box.
#[derive(Debug, Clone, Copy)]
pub struct Lattice {
    /// Its least corner.
    pub low: DVec3,
    /// Edges of a cell, > 0.
    pub step: DVec3,
    /// Cells along x, y and z.
    pub cells: [usize; 3],
}

impl Lattice {
    fn at(&self, c: [usize; 3]) -> DVec3 {
        self.low + self.step * DVec3::new(c[0] as f64, c[1] as f64, c[2] as f64)
    }

    /// Blocks along x, y and z.
    fn blocks(&self) -> [usize; 3] {
        self.cells.map(|n| n.div_ceil(BLOCK))
    }

    /// The first cell of a block.
    fn first_of(&self, block: usize) -> [usize; 3] {
        let [nx, ny, _] = self.blocks();
        [block % nx, block / nx % ny, block / nx / ny].map(|i| i * BLOCK)
    }

    fn id(&self, c: [usize; 3]) -> u64 {
        ((c[2] * self.cells[1] + c[1]) * self.cells[0] + c[0]) as u64
    }
}

/// Blocks that are looked at to predict how many are evaluated.
const LOOKED_AT: usize = 512;

/// About how many values of the field [`surface_nets`] asks for at lattice points.
pub fn evaluations<F: ScalarField + ?Sized>(field: &F, lattice: &Lattice) -> f64 {
    let count = lattice.blocks().iter().product::<usize>();
    let looked_at = count.min(LOOKED_AT);
    // Steps of the golden section: even, and in step with no side of the lattice.
    let block = |k: usize| {
        if count <= LOOKED_AT { k } else { ((k as f64 * 0.618_033_988_749_894_9).fract() * count as f64) as usize }
    };
    let kept = (0..looked_at).filter(|k| !is_empty(field, lattice, lattice.first_of(block(*k)))).count();
    let points = lattice.cells.map(|n| n as f64 * POINTS as f64 / BLOCK as f64).iter().product::<f64>();
    points * kept as f64 / looked_at.max(1) as f64
}

/// Whether the field's bound excludes zero in the block that begins at a cell.
fn is_empty<F: ScalarField + ?Sized>(field: &F, lattice: &Lattice, first: [usize; 3]) -> bool {
    let low = lattice.at(first);
    let last = [0, 1, 2].map(|a| (first[a] + BLOCK).min(lattice.cells[a]));
    let half = (lattice.at(last) - low) * 0.5;
    field.bound(low + half, half.length()).is_some_and(|(min, max)| min > 0.0 || max < 0.0)
}

/// The part of a mesh from one block of cells.
#[derive(Default)]
struct Part {
    /// Cell id, position and unit normal of each vertex.
    vertices: Vec<(u64, DVec3, Vec3)>,
    /// Cell ids around each crossed edge, counter-clockwise seen from outside.
    quads: Vec<[u64; 4]>,
}

/// Meshes the zero set in the field's domain; normals point to where the field is positive. `origin` is the middle of the lattice. `object` is its name in
/// messages. Blocks are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// [`FieldError::NonFinite`] with the point, [`FieldError::Cancelled`].
pub fn surface_nets<F: ScalarField + ?Sized>(
    field: &F,
    lattice: &Lattice,
    object: &str,
    progress: &Progress,
) -> Result<Mesh, FieldError> {
    let count = lattice.blocks().iter().product::<usize>();
    progress.add_total(count as u64);
    let parts: Vec<Result<Part, FieldError>> = (0..count)
        .into_par_iter()
        .map(|b| {
            progress.tick(1).map_err(|_| FieldError::Cancelled)?;
            Block::sample(field, lattice, lattice.first_of(b), object)
                .map(|block| block.map_or(Part::default(), |b| b.part(field)))
        })
        .collect();
    check_cancelled(progress)?;
    let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
    Ok(cut(field, join(lattice, &parts)))
}

fn join(lattice: &Lattice, parts: &[Part]) -> Mesh {
    let mut vertices: Vec<(u64, DVec3, Vec3)> = parts.iter().flat_map(|p| p.vertices.iter().copied()).collect();
    vertices.par_sort_unstable_by_key(|v| v.0);
    let middle = lattice.cells.map(|n| n as f64 * 0.5);
    let origin = lattice.low + lattice.step * DVec3::from_array(middle);
    let position: Vec<Vec3> = vertices.iter().map(|v| (v.1 - origin).as_vec3()).collect();
    let quads: Vec<&[u64; 4]> = parts.iter().flat_map(|p| &p.quads).collect();
    let triangles = quads
        .par_iter()
        .with_min_len(1024)
        .flat_map_iter(|quad| {
            // Both cells of every crossed edge hold a vertex, as the edge is one of theirs.
            let [a, b, c, d] = quad.map(|id| vertices.partition_point(|v| v.0 < id) as u32);
            let length = |i: u32, j: u32| position[i as usize].distance_squared(position[j as usize]);
            if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect();
    Mesh { origin, position, normal: vertices.iter().map(|v| v.2).collect(), triangles, ..Mesh::default() }
}

/// Values at the corners of a block of cells.
struct Block<'a> {
    lattice: &'a Lattice,
    first: [usize; 3],
    /// Cells of this block along each axis.
    cells: [usize; 3],
    values: Vec<f64>,
}

impl<'a> Block<'a> {
    /// `None` when the field's bound excludes zero.
    fn sample<F: ScalarField + ?Sized>(
        field: &F,
        lattice: &'a Lattice,
        first: [usize; 3],
        object: &str,
    ) -> Result<Option<Self>, FieldError> {
        let cells = [0, 1, 2].map(|a| BLOCK.min(lattice.cells[a] - first[a]));
        if is_empty(field, lattice, first) {
            return Ok(None);
        }
        let mut values = vec![0.0; POINTS * POINTS * POINTS];
        for k in 0..=cells[2] {
            for j in 0..=cells[1] {
                for i in 0..=cells[0] {
                    let point = lattice.at([first[0] + i, first[1] + j, first[2] + k]);
                    let value = field.value(point);
                    if !value.is_finite() {
                        return Err(FieldError::NonFinite { object: object.to_owned(), point, value });
                    }
                    values[(k * POINTS + j) * POINTS + i] = value;
                }
            }
        }
        Ok(Some(Self { lattice, first, cells, values }))
    }

    fn value(&self, c: [usize; 3]) -> f64 {
        self.values[(c[2] * POINTS + c[1]) * POINTS + c[0]]
    }

    fn part<F: ScalarField + ?Sized>(&self, field: &F) -> Part {
        let mut part = Part::default();
        for k in 0..self.cells[2] {
            for j in 0..self.cells[1] {
                for i in 0..self.cells[0] {
                    let cell = [i, j, k];
                    let Some(start) = self.mean_crossing(cell) else { continue };
                    let global = [0, 1, 2].map(|a| self.first[a] + cell[a]);
                    let (position, normal) = project(field, start, self.lattice.step.length());
                    part.vertices.push((self.lattice.id(global), position, normal));
                    (0..3).for_each(|axis| self.quad(cell, global, axis, &mut part.quads));
                }
            }
        }
        part
    }

    /// Mean of the points where the edges of a cell are crossed.
    fn mean_crossing(&self, cell: [usize; 3]) -> Option<DVec3> {
        let mut sum = DVec3::ZERO;
        let mut count = 0.0;
        for corner in 0..8usize {
            let a = [0, 1, 2].map(|d| cell[d] + (corner >> d & 1));
            for d in (0..3).filter(|d| corner >> d & 1 == 0) {
                let b = step(a, d);
                let u = self.value(a);
                let v = self.value(b);
                if (u < 0.0) != (v < 0.0) {
                    sum += DVec3::from_array(a.map(|c| c as f64)) + DVec3::AXES[d] * (u / (u - v));
                    count += 1.0;
                }
            }
        }
        let first = DVec3::from_array(self.first.map(|c| c as f64));
        (count > 0.0).then(|| self.lattice.low + self.lattice.step * (first + sum / count))
    }

    /// The quadrilateral around the edge of the cell's lowest corner along `axis`, when crossed and inside the box.
    fn quad(&self, cell: [usize; 3], global: [usize; 3], axis: usize, quads: &mut Vec<[u64; 4]>) {
        let u = (axis + 1) % 3;
        let v = (axis + 2) % 3;
        let from = self.value(cell);
        let to = self.value(step(cell, axis));
        if (from < 0.0) == (to < 0.0) || global[u] == 0 || global[v] == 0 {
            return;
        }
        let around = |du: usize, dv: usize| {
            let mut c = global;
            c[u] -= du;
            c[v] -= dv;
            self.lattice.id(c)
        };
        let mut quad = [around(1, 1), around(0, 1), around(0, 0), around(1, 0)];
        // Counter-clockwise about +axis, which is outside when the field rises along it.
        if to < 0.0 {
            quad.reverse();
        }
        quads.push(quad);
    }
}

fn step(mut c: [usize; 3], axis: usize) -> [usize; 3] {
    c[axis] += 1;
    c
}

/// Newton steps onto the surface, never further than one cell; the unit gradient there, or zero.
fn project<F: ScalarField + ?Sized>(field: &F, start: DVec3, cell: f64) -> (DVec3, Vec3) {
    let mut p = start;
    for _ in 0..6 {
        let f = field.value(p);
        let g = field.gradient(p);
        let move_by = g * (f / g.length_squared());
        let next = p - move_by;
        // A field without gradient keeps the lattice's crossing.
        if next.is_nan() || next.distance(start) > cell {
            break;
        }
        p = next;
        if move_by.length() <= 1e-12 * cell {
            break;
        }
    }
    let g = field.gradient(p);
    let largest = g.abs().max_element();
    let normal = if largest > 0.0 && largest.is_finite() { (g / largest).normalize() } else { DVec3::ZERO };
    (p, normal.as_vec3())
}
