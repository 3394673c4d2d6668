//! A volume of labels → the surfaces between its regions.
//!
//! The number of a voxel is its region; voxels of 0, −1 and NaN have no region. Every cell between eight voxels of several regions gets one vertex, every two
//! neighbours of different regions one quadrilateral (surface nets, Gibson 1998). So a surface lies halfway between two
//! voxels, and shows no label but theirs. A surface between two regions belongs to the one of greater opacity, so that what lies within
//! a translucent region is seen, else to that of the greater number.
//!
//! Steps of voxels do not show: a low pass over the net moves its vertices, within their cells. It is a sum of Chebyshev polynomials of the mean M over a
//! vertex's neighbours, Σ cₙ·Tₙ(M), whose coefficients are those of a box in the angle arccos M under a Hamming window (Taubin, Zhang and Golub 1996). Long waves
//! pass it whole, so a region does not shrink as by means alone.

use crate::{ConvertError, LARGEST_LABEL, LabelTable};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Association, Grid, Mesh, MeshColumn};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// The name of the column of labels.
const LABEL: &str = "label";

/// Order of the low pass.
const ORDER: usize = 12;
/// The greatest 1 − M that passes it: waves along the net that are shorter than some eight voxels do not.
const PASS_BAND: f64 = 0.15;
/// How far from the middle of their cell vertices may be, in voxels: nearly to its faces.
const REACH: f64 = 0.45;
/// The same where a region is a line of voxels or one alone, which would collapse.
const REACH_OF_THIN: f64 = 0.3;

/// Voxels looked at by one task.
const CHUNK: usize = 1 << 16;

/// Numbers whose opacity is listed rather than searched: those of 16 bits, which atlases have.
const SMALL: u32 = 1 << 16;

/// The number below 0 that voxels may have: programs that count regions from 0 write it where there is none.
const NOTHING: f32 = -1.0;

/// A cell without a vertex.
const NONE: u32 = u32::MAX;

/// Layers of cells are those before a layer of voxels, and one behind the last.
struct Nets<'a> {
    grid: &'a Grid,
    /// The opacities of labels, where some are not opaque.
    opacities: Option<Opacities<'a>>,
    /// Vertices of the cells of this layer and the one before it.
    layers: [Vec<u32>; 2],
    /// In voxels from the first.
    vertices: Vec<DVec3>,
    /// How far each may be from the middle of its cell, along each axis.
    reaches: Vec<f64>,
    quads: Vec<[u32; 4]>,
    labels: Vec<f32>,
}

/// The opacities of labels: every voxel asks for them.
struct Opacities<'a> {
    table: &'a LabelTable,
    /// Rows of the numbers below [`SMALL`].
    small: Vec<f32>,
}

/// The surfaces of the regions of a volume of whole numbers from 0 on, and −1 where there is none, with the column `label` of faces. Regions that `table` hides have none.
/// `object` is named in errors.
///
/// # Errors
/// [`ConvertError::Parameter`] for a value that is no label, and for more vertices than a mesh can have.
pub fn label_surfaces(grid: &Grid, table: Option<&LabelTable>, object: &str) -> Result<Mesh, ConvertError> {
    let is_label = |value: &f32| {
        value.is_nan() || *value == NOTHING || (0.0..=LARGEST_LABEL as f32).contains(value) && value.fract() == 0.0
    };
    if let Some(value) = grid.values.par_iter().find_first(|value| !is_label(value)) {
        return Err(ConvertError::Parameter {
            object: object.to_owned(),
            parameter: "a voxel of a mesh of labels",
            found: value.to_string(),
            expected: "a whole number from 0 to 16777216, or -1 for no label",
        });
    }
    let [nx, ny, nz] = grid.dims;
    let cells = (nx + 1) * (ny + 1);
    let layers = [vec![NONE; cells], vec![NONE; cells]];
    let opacities = table.filter(|table| table.has_opacities()).map(Opacities::new);
    let mut nets = Nets {
        grid,
        opacities,
        layers,
        vertices: Vec::new(),
        reaches: Vec::new(),
        quads: Vec::new(),
        labels: Vec::new(),
    };
    for k in 0..=nz {
        nets.layers.swap(0, 1);
        nets.make_vertices(k);
        nets.make_quads(k);
        if nets.vertices.len() >= NONE as usize {
            return Err(ConvertError::Parameter {
                object: object.to_owned(),
                parameter: "the number of vertices between labels",
                found: nets.vertices.len().to_string(),
                expected: "at most 4294967294",
            });
        }
    }
    nets.relax();
    Ok(nets.into_mesh())
}

/// Sentences, without full stops, about the labels of a volume that a table hides, and those that the table lacks.
pub fn said_of_labels(grid: &Grid, table: &LabelTable) -> Vec<String> {
    let chunks = grid.values.par_chunks(CHUNK);
    let of_chunk = |values: &[f32]| {
        let mut found: BTreeSet<u32> = BTreeSet::new();
        let mut last = 0.0;
        for value in values.iter().filter(|value| **value > 0.0) {
            if *value != last {
                last = *value;
                found.insert(last as u32);
            }
        }
        found
    };
    let join = |mut one: BTreeSet<u32>, mut other: BTreeSet<u32>| {
        one.append(&mut other);
        one
    };
    let found = chunks.map(of_chunk).reduce(BTreeSet::new, join);
    let hidden = found.iter().filter(|label| table.opacity(f64::from(**label)) == 0.0);
    let missing = found.iter().filter(|label| table.get(f64::from(**label)).is_none());
    let hidden = listed(hidden).map(|labels| format!("hidden by the table of labels: {labels}"));
    let missing =
        listed(missing).map(|labels| format!("not in the table of labels, so in colours of their numbers: {labels}"));
    hidden.into_iter().chain(missing).collect()
}

/// Some numbers in words.
fn listed<'n>(labels: impl Iterator<Item = &'n u32>) -> Option<String> {
    /// Numbers up to which each is named.
    const NAMED: usize = 16;
    let labels: Vec<String> = labels.map(u32::to_string).collect();
    let more = if labels.len() > NAMED { format!(" and {} more", labels.len() - NAMED) } else { String::new() };
    (!labels.is_empty()).then(|| labels[..labels.len().min(NAMED)].join(", ") + &more)
}

/// Bytes that [`label_surfaces`] of a volume takes.
pub fn label_surface_bytes(grid: &Grid) -> u64 {
    /// Bytes of a quad and of a vertex while surfaces are made, of which there are about as many.
    const OF_A_BORDER: u64 = 16 + 4 + 2 * (12 + 8) + 2 * (24 + 12) + 4 * 24 + 2 * 8;
    let [nx, ny, _] = grid.dims;
    let differ = |a: &f32, b: &f32| label(*a) != label(*b);
    let of_row = |(row, values): (usize, &[f32])| {
        let at_ends = [values.first(), values.last()].into_iter().flatten().filter(|v| label(**v) != 0.0).count();
        let along = values.windows(2).filter(|pair| differ(&pair[0], &pair[1])).count();
        let against = |before: Option<usize>, is_first: bool| match before.filter(|_| !is_first) {
            Some(before) => grid.values[before * nx..][..nx].iter().zip(values).filter(|(a, b)| differ(a, b)).count(),
            None => values.iter().filter(|v| label(**v) != 0.0).count(),
        };
        at_ends + along + against(row.checked_sub(1), row % ny == 0) + against(row.checked_sub(ny), row < ny)
    };
    let borders: usize = grid.values.par_chunks(nx.max(1)).enumerate().map(of_row).sum();
    // Faces at the far sides of the volume are not counted above: a quarter more has room for them.
    borders as u64 * OF_A_BORDER * 5 / 4
}

impl<'a> Opacities<'a> {
    fn new(table: &'a LabelTable) -> Self {
        Self { table, small: (0..SMALL).map(|number| table.opacity(f64::from(number))).collect() }
    }

    fn at(&self, label: f32) -> f32 {
        self.small.get(label as usize).copied().unwrap_or_else(|| self.table.opacity(f64::from(label)))
    }
}

/// The region of a value; 0 is none.
fn label(value: f32) -> f32 {
    if value > 0.0 { value } else { 0.0 }
}

impl Nets<'_> {
    /// The label of a voxel, counted from 1; 0 outside.
    fn at(&self, x: usize, y: usize, z: usize) -> f32 {
        let [nx, ny, nz] = self.grid.dims;
        let is_inside = (1..=nx).contains(&x) && (1..=ny).contains(&y) && (1..=nz).contains(&z);
        if !is_inside {
            return 0.0;
        }
        let label = label(self.grid.values[x - 1 + nx * (y - 1 + ny * (z - 1))]);
        if self.opacity(label) > 0.0 { label } else { 0.0 }
    }

    /// Whether a voxel has others than its label on both sides along two axes or three.
    fn is_narrow(&self, x: usize, y: usize, z: usize) -> bool {
        let label = self.at(x, y, z);
        // Below 0 nothing is inside.
        let along_x = [self.at(x.wrapping_sub(1), y, z), self.at(x + 1, y, z)];
        let along_y = [self.at(x, y.wrapping_sub(1), z), self.at(x, y + 1, z)];
        let along_z = [self.at(x, y, z.wrapping_sub(1)), self.at(x, y, z + 1)];
        [along_x, along_y, along_z].iter().filter(|sides| !sides.contains(&label)).count() >= 2
    }

    /// Whether a voxel is one alone or one of a line, and no more than a step upon others of its label.
    fn is_thin(&self, x: usize, y: usize, z: usize) -> bool {
        if !self.is_narrow(x, y, z) {
            return false;
        }
        let label = self.at(x, y, z);
        let is_of_line = |x: usize, y: usize, z: usize| self.at(x, y, z) != label || self.is_narrow(x, y, z);
        is_of_line(x.wrapping_sub(1), y, z)
            && is_of_line(x + 1, y, z)
            && is_of_line(x, y.wrapping_sub(1), z)
            && is_of_line(x, y + 1, z)
            && is_of_line(x, y, z.wrapping_sub(1))
            && is_of_line(x, y, z + 1)
    }

    /// Opacity of the surface of a label.
    fn opacity(&self, label: f32) -> f32 {
        self.opacities.as_ref().map_or(1.0, |opacities| opacities.at(label))
    }

    /// Whether the surface between two labels is that of the second; nothing has no surface.
    fn is_of_second(&self, first: f32, second: f32) -> bool {
        if self.opacities.is_none() || first == 0.0 || second == 0.0 {
            return second > first;
        }
        let by_opacity = self.opacity(first).total_cmp(&self.opacity(second));
        by_opacity.then(first.total_cmp(&second)).is_lt()
    }

    /// The vertices of a layer of cells, each at the mean of the places between voxels of different labels.
    fn make_vertices(&mut self, k: usize) {
        let [nx, ny, _] = self.grid.dims;
        for j in 0..=ny {
            for i in 0..=nx {
                let corner = |c: usize| self.at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                let corners: [f32; 8] = std::array::from_fn(corner);
                let place = |c: usize| DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
                let mut sum = DVec3::ZERO;
                let mut count = 0.0;
                for axis in 0..3 {
                    for low in (0..8usize).filter(|c| c & (1 << axis) == 0) {
                        let high = low | 1 << axis;
                        if corners[low] != corners[high] {
                            sum += 0.5 * (place(low) + place(high));
                            count += 1.0;
                        }
                    }
                }
                let rank = i + (nx + 1) * j;
                self.layers[1][rank] = if count > 0.0 {
                    let is_of_thin = (0..8).any(|c| self.is_thin(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
                    self.reaches.push(if is_of_thin { REACH_OF_THIN } else { REACH });
                    self.vertices.push(DVec3::new(i as f64, j as f64, k as f64) - 1.0 + sum / count);
                    (self.vertices.len() - 1) as u32
                } else {
                    NONE
                };
            }
        }
    }

    /// The faces that a layer of cells completes: across z in it, across x and y between it and the one before.
    fn make_quads(&mut self, k: usize) {
        let [nx, ny, _] = self.grid.dims;
        let cell = |layer: usize, i: usize, j: usize| (layer, i + (nx + 1) * j);
        for j in 0..=ny {
            for i in 0..=nx {
                let inside = self.at(i, j, k);
                if i > 0 && j > 0 {
                    let cells = [cell(1, i - 1, j - 1), cell(1, i, j - 1), cell(1, i, j), cell(1, i - 1, j)];
                    self.add(inside, self.at(i, j, k + 1), cells);
                }
                if k > 0 && j > 0 {
                    let cells = [cell(0, i, j - 1), cell(0, i, j), cell(1, i, j), cell(1, i, j - 1)];
                    self.add(inside, self.at(i + 1, j, k), cells);
                }
                if k > 0 && i > 0 {
                    let cells = [cell(0, i - 1, j), cell(1, i - 1, j), cell(1, i, j), cell(0, i, j)];
                    self.add(inside, self.at(i, j + 1, k), cells);
                }
            }
        }
    }

    /// A face between two voxels, if they differ; `cells` are those between them, by layer and rank, around the direction from the first to the second.
    fn add(&mut self, first: f32, second: f32, cells: [(usize, usize); 4]) {
        if first == second {
            return;
        }
        let mut around = cells.map(|(layer, rank)| self.layers[layer][rank]);
        let is_of_second = self.is_of_second(first, second);
        // Wound so that it is seen from outside of the region whose label it has.
        if is_of_second {
            around.reverse();
        }
        self.quads.push(around);
        self.labels.push(if is_of_second { second } else { first });
    }

    /// Moves vertices by the low pass.
    fn relax(&mut self) {
        let mut neighbours = vec![0u32; self.vertices.len()];
        self.quads.iter().flatten().for_each(|vertex| neighbours[*vertex as usize] += 2);
        let coefficients = low_pass();
        // Tₙ₋₁ and Tₙ of the vertices.
        let mut before = self.vertices.clone();
        let mut current = vec![DVec3::ZERO; before.len()];
        self.take_means(&before, &neighbours, &mut current);
        let mut sums: Vec<DVec3> = before
            .iter()
            .zip(&current)
            .map(|(first, second)| coefficients[0] * first + coefficients[1] * second)
            .collect();
        let mut means = vec![DVec3::ZERO; before.len()];
        for coefficient in &coefficients[2..] {
            self.take_means(&current, &neighbours, &mut means);
            before.par_iter_mut().zip(&means).for_each(|(vertex, mean)| *vertex = 2.0 * mean - *vertex);
            std::mem::swap(&mut before, &mut current);
            sums.par_iter_mut().zip(&current).for_each(|(sum, vertex)| *sum += coefficient * vertex);
        }
        self.vertices.par_iter_mut().zip(&sums).zip(&self.reaches).for_each(|((vertex, moved), reach)| {
            // Cells lie around the half voxels.
            let middle = vertex.floor() + 0.5;
            *vertex = moved.clamp(middle - *reach, middle + *reach);
        });
    }

    /// The mean of the neighbours of each vertex along the sides of faces, of which it has as many as `neighbours` says.
    fn take_means(&self, vertices: &[DVec3], neighbours: &[u32], means: &mut [DVec3]) {
        means.fill(DVec3::ZERO);
        for quad in &self.quads {
            let [a, b, c, d] = quad.map(|vertex| vertices[vertex as usize]);
            let beside_a = b + d;
            let beside_b = a + c;
            means[quad[0] as usize] += beside_a;
            means[quad[1] as usize] += beside_b;
            means[quad[2] as usize] += beside_a;
            means[quad[3] as usize] += beside_b;
        }
        let stays = |(mean, (vertex, count)): (&mut DVec3, (&DVec3, &u32))| {
            *mean = if *count > 0 { *mean / f64::from(*count) } else { *vertex };
        };
        means.par_iter_mut().zip(vertices.par_iter().zip(neighbours)).for_each(stays);
    }

    fn into_mesh(self) -> Mesh {
        let Self { grid, vertices, quads, labels, .. } = self;
        let [nx, ny, nz] = grid.dims.map(|n| n as f64);
        let origin = grid.origin + grid.axes * (0.5 * (DVec3::new(nx, ny, nz) - 1.0));
        let position = vertices.par_iter().map(|v| (grid.origin + grid.axes * *v - origin).as_vec3()).collect();
        let is_mirrored = grid.axes.determinant() < 0.0;
        let halves = |[a, b, c, d]: [u32; 4]| if is_mirrored { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
        let triangles = quads.into_iter().flat_map(halves).collect();
        let values = labels.into_iter().flat_map(|label| [f64::from(label); 2]).collect();
        let columns = vec![MeshColumn { name: LABEL.to_owned(), association: Association::Triangle, values }];
        Mesh { origin, position, triangles, columns, ..Mesh::default() }
    }
}

/// The coefficients of the low pass, whose sum is 1.
fn low_pass() -> [f64; ORDER + 1] {
    let edge = libm::acos(1.0 - PASS_BAND);
    let coefficient = |n: usize| {
        let n = n as f64;
        let window = 0.54 + 0.46 * libm::cos(n * PI / (ORDER + 1) as f64);
        if n == 0.0 { edge / PI } else { window * 2.0 * libm::sin(n * edge) / (n * PI) }
    };
    let coefficients: [f64; ORDER + 1] = std::array::from_fn(coefficient);
    let sum: f64 = coefficients.iter().sum();
    coefficients.map(|coefficient| coefficient / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Label;
    use splat_core::glam::DMat3;

    /// Two boxes side by side with the labels 2 and 7, in nothing.
    fn boxes(axes: DMat3) -> Grid {
        let value = |n: usize| {
            let [x, y, z] = [n % 12, n / 12 % 8, n / 96];
            let is_inside = (2..6).contains(&y) && (2..6).contains(&z);
            match x {
                2..6 if is_inside => 2.0,
                6..10 if is_inside => 7.0,
                _ if n == 0 => f32::NAN,
                _ => 0.0,
            }
        };
        Grid { origin: DVec3::new(5.0, 0.0, 1e6), axes, dims: [12, 8, 8], values: (0..12 * 64).map(value).collect() }
    }

    fn enclosed(mesh: &Mesh) -> f64 {
        let corner = |v: u32| mesh.position[v as usize].as_dvec3();
        mesh.triangles.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0).sum()
    }

    #[test]
    fn surfaces_have_the_labels_beside_them_and_close_around_the_regions() {
        for mirror in [1.0, -1.0] {
            let axes = DMat3::from_diagonal(DVec3::new(mirror, 2.0, 1.0));
            let grid = boxes(axes);
            let mesh = label_surfaces(&grid, None, "a").unwrap();
            mesh.validate().unwrap();
            let labels = &mesh.columns[0].values;
            assert_eq!((mesh.columns[0].name.as_str(), labels.len()), ("label", mesh.triangles.len()));
            assert!(labels.iter().all(|label| *label == 2.0 || *label == 7.0), "{labels:?}");
            // 4 x 4 voxels at each end and between both, 8 x 4 on each side.
            assert_eq!(mesh.triangles.len(), 2 * (3 * 16 + 4 * 32));
            // All but the face between both enclose 8 x 4 x 4 voxels of the volume 2, less what edges lose.
            let outer: Vec<[u32; 3]> = mesh
                .triangles
                .iter()
                .filter(|t| {
                    let middle = t.iter().map(|v| mesh.position[*v as usize].x).sum::<f32>() / 3.0;
                    middle.abs() > 0.05
                })
                .copied()
                .collect();
            assert_eq!(outer.len(), 2 * (2 * 16 + 4 * 32));
            let volume = enclosed(&Mesh { triangles: outer, ..mesh.clone() });
            assert!(volume > 0.7 * 256.0 && volume < 256.0, "{volume}");
            assert!(label_surface_bytes(&grid) >= mesh.bytes());
        }
    }

    #[test]
    fn hidden_labels_have_no_surface_and_the_more_opaque_one_has_that_between_two() {
        let grid = boxes(DMat3::IDENTITY);
        let of_each = |opacities: [f32; 2]| {
            let row = |(number, opacity)| (number, Label { opacity, ..Label::default() });
            let table = LabelTable::from_iter([2, 7].into_iter().zip(opacities).map(row));
            let mesh = label_surfaces(&grid, Some(&table), "a").unwrap();
            let faces = |label: f64| mesh.columns[0].values.iter().filter(|value| **value == label).count() / 2;
            ([faces(2.0), faces(7.0)], enclosed(&mesh))
        };
        // A box has an end of 16 faces at each side, 64 around it, and shares an end with the other.
        assert_eq!(of_each([1.0, 1.0]).0, [80, 96]);
        assert_eq!(of_each([1.0, 0.5]).0, [96, 80]);
        assert_eq!(of_each([0.5, 0.5]).0, [80, 96]);
        for (opacities, faces) in [([0.0, 1.0], [0, 96]), ([1.0, 0.0], [96, 0])] {
            let (found, volume) = of_each(opacities);
            assert_eq!(found, faces);
            // One box of 64 voxels, closed and seen from outside, less what edges lose.
            assert!(volume > 0.6 * 64.0 && volume < 64.0, "{volume}");
        }
        assert_eq!(of_each([0.0, 0.0]).0, [0, 0]);
        let hidden = LabelTable::from_iter([(2, Label { opacity: 0.0, ..Label::default() })]);
        let said =
            ["hidden by the table of labels: 2", "not in the table of labels, so in colours of their numbers: 7"];
        assert_eq!(said_of_labels(&grid, &hidden), said);
    }

    /// A grid of 40³ voxels whose labels follow from their places.
    fn labelled(label: impl Fn(DVec3) -> f32) -> Grid {
        let at = |n: usize| DVec3::new((n % 40) as f64, (n / 40 % 40) as f64, (n / 1600) as f64);
        let values = (0..40usize.pow(3)).map(|n| label(at(n))).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [40; 3], values }
    }

    #[test]
    fn steps_of_voxels_do_not_show_and_regions_keep_their_size() {
        let middle = DVec3::splat(19.3);
        let ball = labelled(|p| if p.distance(middle) < 15.0 { 1.0 } else { 0.0 });
        let mesh = label_surfaces(&ball, None, "a").unwrap();
        let true_volume = 4.0 / 3.0 * PI * 15.0f64.powi(3);
        assert!((enclosed(&mesh) / true_volume - 1.0).abs() < 0.02, "{} of {true_volume}", enclosed(&mesh));
        // Normals of faces lean by little from those of the ball: by 2 degrees in the mean, where those of voxels lean by 25.
        let corner = |v: u32| mesh.origin + mesh.position[v as usize].as_dvec3() - middle;
        let lean = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [*a, *b, *c].map(corner);
            let normal = (b - a).cross(c - a).normalize_or(DVec3::X);
            normal.angle_between((a + b + c).normalize()).to_degrees()
        };
        let mean = mesh.triangles.iter().map(lean).sum::<f64>() / mesh.triangles.len() as f64;
        assert!(mean < 3.0, "{mean}");
    }

    #[test]
    fn a_line_of_voxels_and_one_alone_stay_wide_enough_to_be_seen() {
        let line = labelled(|p| if p.y == 20.0 && p.z == 20.0 && (5.0..35.0).contains(&p.x) { 1.0 } else { 0.0 });
        let volume = enclosed(&label_surfaces(&line, None, "a").unwrap());
        assert!(volume > 0.15 * 30.0, "{volume}");
        let alone = labelled(|p| if p == DVec3::splat(20.0) { 1.0 } else { 0.0 });
        let volume = enclosed(&label_surfaces(&alone, None, "a").unwrap());
        assert!(volume > 0.06, "{volume}");
        // A voxel upon others is a step, which is no more than a mound.
        let stepped = labelled(|p| if p.z < 20.0 || p == DVec3::splat(20.0) { 1.0 } else { 0.0 });
        let mesh = label_surfaces(&stepped, None, "a").unwrap();
        let near = mesh.position.iter().filter(|p| (mesh.origin + p.as_dvec3() - DVec3::splat(20.0)).length() < 2.0);
        let top = near.map(|p| mesh.origin.z + f64::from(p.z)).fold(0.0, f64::max);
        assert!((19.5..20.1).contains(&top), "{top}");
    }

    #[test]
    fn a_voxel_alone_and_one_at_the_border_have_surfaces_and_amounts_are_refused() {
        let mut grid = Grid { values: vec![0.0; 12 * 64], ..boxes(DMat3::IDENTITY) };
        grid.values[0] = 3.0;
        let mesh = label_surfaces(&grid, None, "a").unwrap();
        assert_eq!((mesh.triangles.len(), mesh.position.len()), (12, 8));
        let around =
            Grid { values: grid.values.iter().map(|v| if *v == 0.0 { -1.0 } else { *v }).collect(), ..grid.clone() };
        assert_eq!(label_surfaces(&around, None, "a").unwrap(), mesh);
        assert!(enclosed(&mesh) > 0.0);
        grid.values[5] = 0.5;
        let error = label_surfaces(&grid, None, "a").unwrap_err().to_string();
        assert!(error.contains("is 0.5, expected a whole number from 0 to 16777216"), "{error}");
    }
}
