//! The colours, and the opacities, of a mesh by a column of its vertices or triangles.
//!
//! Numbers are interpolated between vertices, not colours: where the colours of a map between two vertices are not the mean of theirs, the edge is
//! halved in all triangles that share it, until they are within [`TOLERANCE`]. Triangles with numbers of their own get vertices of their own, with the
//! normals that these had. Nothing is interpolated between two classes or beside a vertex without a number: such a triangle is divided into
//! the regions nearest to each of its corners.

use crate::color::color_by::colored_numbers;
use crate::points::shown_points::said_of_colors;
use crate::{Classified, ColorBy, ColorScale, Colored, ConvertError, PointColors, SplatParams};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Association, Mesh, MeshColumn, halve_edges, smooth};
use std::sync::Arc;

/// Largest difference of the square root of a colour, which is about how the eye tells colours apart, or of an opacity, from what lies between
/// those of the ends of an edge.
const TOLERANCE: f32 = 1.0 / 64.0;
/// Most triangles that a mesh is divided into; one that has more already keeps them.
const MOST: usize = 2 << 20;
/// Parts of a triangle between whose corners nothing can be interpolated: two for each.
const PARTS: usize = 6;
/// Edges looked at by one task.
const CHUNK: usize = 1024;

/// A mesh in the colours of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct ColoredMesh {
    /// The mesh, without columns.
    pub mesh: Arc<Mesh>,
    /// Notes about the origin of its colours, one sentence without a full stop each.
    pub said: Vec<String>,
    /// The numbers that its colours stand for; `None` where no number is known.
    pub scale: Option<ColorScale>,
}

/// The mesh in the colours of a column, and with the opacities that a transfer function has; `up` is where `height` grows. Of `splat` the name and
/// the colour are used.
///
/// ```
/// use convert::{ColorBy, ColorMap, PointColors, SplatParams, colored_mesh};
/// use splat_core::{Mesh, glam::DVec3};
/// let mesh = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
/// let map = ColorMap::VIRIDIS;
/// let by = ColorBy { column: "x".into(), colors: PointColors::map_over(map, [-1.0, 1.0]) };
/// let colored = colored_mesh(mesh.into(), &by, DVec3::Y, &SplatParams::default()).unwrap();
/// assert_eq!(colored.mesh.color[..2], [map.at(0.0), map.at(1.0)]);
/// ```
///
/// # Errors
/// [`ConvertError::Parameter`] for a column that the mesh has not.
pub fn colored_mesh(
    mesh: Arc<Mesh>,
    by: &ColorBy,
    up: DVec3,
    splat: &SplatParams,
) -> Result<ColoredMesh, ConvertError> {
    let Some(column) = mesh.column(&by.column, up) else {
        return Err(splat.bad("color_by", &by.column, "a column of the mesh's vertices or faces"));
    };
    let association = column.association;
    let colored = colored_numbers(column.values.clone(), by, splat);
    let mut said =
        vec![said_of_colors(by, &colored, if association == Association::Vertex { "vertex" } else { "face" })];
    let scale = ColorScale::of_points(&splat.object_name, by, &colored, splat.color);
    let mut mesh = Arc::unwrap_or_clone(mesh);
    mesh.columns = vec![column];
    let looks = Looks { by, colored: &colored, plain: splat.color };
    match association {
        Association::Vertex => {
            said.extend(part_at_borders(&mut mesh, &looks));
            said.extend(divide(&mut mesh, &looks));
        }
        Association::Triangle => part(&mut mesh),
    }
    let MeshColumn { values, .. } = mesh.columns.remove(0);
    let shown: Vec<Look> = match association {
        Association::Vertex => values.par_iter().map(|number| looks.at(*number)).collect(),
        Association::Triangle => values.iter().flat_map(|number| [looks.at(*number); 3]).collect(),
    };
    mesh.color = shown.iter().map(|look| look.color).collect();
    if has_opacities(by) {
        let stated = mesh.opacity.iter().copied().chain(std::iter::repeat(1.0));
        let opacity: Vec<f32> = shown.iter().zip(stated).map(|(look, stated)| look.opacity * stated).collect();
        mesh.opacity = if opacity.iter().all(|share| *share == 1.0) { Vec::new() } else { opacity };
    }
    Ok(ColoredMesh { mesh: mesh.into(), said, scale })
}

/// Whether numbers have opacities beside their colours.
fn has_opacities(by: &ColorBy) -> bool {
    match &by.colors {
        PointColors::Transfer(_, Classified::Opacity) => true,
        PointColors::Labels(table) => table.has_opacities(),
        _ => false,
    }
}

/// The look of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Look {
    color: [f32; 3],
    opacity: f32,
}

/// The looks of the numbers of a column.
struct Looks<'a> {
    by: &'a ColorBy,
    colored: &'a Colored,
    /// The colour of what has no number.
    plain: [f32; 3],
}

impl Looks<'_> {
    fn at(&self, number: f64) -> Look {
        if !self.by.colors.shows(number) {
            return Look { color: self.plain, opacity: 1.0 };
        }
        let opacity = match &self.by.colors {
            PointColors::Transfer(transfer, Classified::Opacity) => transfer.at(number as f32).extinction,
            PointColors::Labels(table) => table.opacity(number),
            _ => 1.0,
        };
        Look {
            color: self.by.colors.at(number, self.colored.range.unwrap_or_default()),
            opacity: opacity.clamp(0.0, 1.0),
        }
    }

    /// Whether numbers between two have a meaning, or both have none.
    fn are_alike(&self, first: f64, last: f64) -> bool {
        let colors = &self.by.colors;
        let is_one_class = || !first.is_finite() || first.round() == last.round();
        colors.shows(first) == colors.shows(last) && (!colors.are_whole() || is_one_class())
    }

    /// Whether what lies between two numbers looks otherwise than what lies between their looks.
    fn deviates(&self, first: f64, last: f64) -> bool {
        let from = self.at(first);
        let to = self.at(last);
        [0.25, 0.5, 0.75].iter().any(|share| {
            let found = self.at(first + (last - first) * share);
            let between = |x: f32, y: f32| x + (y - x) * *share as f32;
            let is_other = |k: usize| {
                (found.color[k].sqrt() - between(from.color[k], to.color[k]).max(0.0).sqrt()).abs() > TOLERANCE
            };
            (0..3).any(is_other) || (found.opacity - between(from.opacity, to.opacity)).abs() > TOLERANCE
        })
    }
}

/// Halves edges between whose ends other colours lie than the means of theirs; says what was done. Whole numbers that stand for classes have nothing
/// between them.
fn divide(mesh: &mut Mesh, looks: &Looks<'_>) -> Option<String> {
    if looks.by.colors.are_whole() {
        return None;
    }
    let before = mesh.triangles.len();
    let mut is_new = vec![true; before];
    let is_cut_short = loop {
        let edges = deviating(mesh, looks, &is_new);
        if edges.is_empty() {
            break false;
        }
        let more: usize = mesh.triangles.iter().map(|t| halves(t, &edges)).sum();
        if mesh.triangles.len() + more > MOST {
            break true;
        }
        let parents = halve_edges(mesh, &edges);
        let mut parts = vec![0u32; is_new.len()];
        parents.iter().for_each(|parent| parts[*parent as usize] += 1);
        is_new = parents.iter().map(|parent| parts[*parent as usize] > 1).collect();
    };
    let after = mesh.triangles.len();
    let cut_short = if is_cut_short { ", and no further: colours between vertices lose detail" } else { "" };
    (after > before || is_cut_short)
        .then(|| format!("{before} faces were divided into {after} for the colours between their vertices{cut_short}"))
}

/// Parts triangles between whose corners nothing can be interpolated, in barycentric cells of the corners: two triangles for each, between the corner, the
/// middles of its edges and the middle of the triangle. Says where there would be too many, and colours blend instead.
fn part_at_borders(mesh: &mut Mesh, looks: &Looks<'_>) -> Option<String> {
    let values = &mesh.columns[0].values;
    let is_parted = |t: &[u32; 3]| {
        let numbers = t.map(|v| values[v as usize]);
        !(looks.are_alike(numbers[0], numbers[1]) && looks.are_alike(numbers[0], numbers[2]))
    };
    let count = mesh.triangles.par_iter().filter(|t| is_parted(t)).count();
    if count == 0 {
        return None;
    }
    if mesh.triangles.len() + (PARTS - 1) * count > MOST {
        return Some(format!(
            "colours blend in {count} faces between classes or beside gaps: parting them would make too many"
        ));
    }
    let (parted, whole): (Vec<[u32; 3]>, Vec<[u32; 3]>) = mesh.triangles.iter().copied().partition(is_parted);
    smooth(mesh);
    mesh.color.clear();
    mesh.triangles = whole;
    for t in parted {
        for k in 0..3 {
            let corner = t[k] as usize;
            let next = t[(k + 1) % 3] as usize;
            let last = t[(k + 2) % 3] as usize;
            let to_next = push_mean(mesh, looks, corner, &[next]);
            let middle = push_mean(mesh, looks, corner, &[next, last]);
            let to_last = push_mean(mesh, looks, corner, &[last]);
            mesh.triangles.extend([[t[k], to_next, middle], [t[k], middle, to_last]]);
        }
    }
    None
}

/// A vertex in the middle of a corner and others, with the mean number of those that are like the corner's.
fn push_mean(mesh: &mut Mesh, looks: &Looks<'_>, corner: usize, others: &[usize]) -> u32 {
    let new = mesh.position.len();
    let count = (1 + others.len()) as f32;
    let ids = || std::iter::once(corner).chain(others.iter().copied());
    let position = ids().map(|v| mesh.position[v]).sum::<Vec3>() / count;
    let normal = ids().map(|v| mesh.normal[v]).sum::<Vec3>().normalize_or(mesh.normal[corner]);
    let opacity = (!mesh.opacity.is_empty()).then(|| ids().map(|v| mesh.opacity[v]).sum::<f32>() / count);
    mesh.position.push(position);
    mesh.normal.push(normal);
    mesh.opacity.extend(opacity);
    let values = &mut mesh.columns[0].values;
    let alike: Vec<f64> = ids().map(|v| values[v]).filter(|number| looks.are_alike(values[corner], *number)).collect();
    let mean = alike.iter().sum::<f64>() / alike.len() as f64;
    // A class, or none.
    values.push(if alike.len() == 1 { alike[0] } else { mean });
    new as u32
}

/// How many of its edges are halved of a triangle.
fn halves(t: &[u32; 3], edges: &[[u32; 2]]) -> usize {
    (0..3).filter(|k| edges.binary_search(&edge(t, *k)).is_ok()).count()
}

/// Edge `k` of a triangle, from its corner `k` to the next.
fn edge(t: &[u32; 3], k: usize) -> [u32; 2] {
    let a = t[k];
    let b = t[(k + 1) % 3];
    [a.min(b), a.max(b)]
}

/// The edges of new triangles that are to be halved, in order, each once.
fn deviating(mesh: &Mesh, looks: &Looks<'_>, is_new: &[bool]) -> Vec<[u32; 2]> {
    let values = &mesh.columns[0].values;
    let new = mesh.triangles.iter().zip(is_new).filter(|(_, is_new)| **is_new);
    let mut edges: Vec<[u32; 2]> = new.flat_map(|(t, _)| [0, 1, 2].map(|k| edge(t, k))).collect();
    edges.par_sort_unstable();
    edges.dedup();
    let deviates = |edge: &[u32; 2]| {
        let first = values[edge[0] as usize];
        let last = values[edge[1] as usize];
        let is_short = mesh.position[edge[0] as usize] == mesh.position[edge[1] as usize];
        looks.by.colors.shows(first) && looks.by.colors.shows(last) && !is_short && looks.deviates(first, last)
    };
    edges.into_par_iter().with_min_len(CHUNK).filter(deviates).collect()
}

/// Gives each triangle vertices of its own.
fn part(mesh: &mut Mesh) {
    smooth(mesh);
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|v| *v as usize).collect();
    mesh.position = corners.iter().map(|v| mesh.position[*v]).collect();
    mesh.normal = corners.iter().map(|v| mesh.normal[*v]).collect();
    if !mesh.opacity.is_empty() {
        mesh.opacity = corners.iter().map(|v| mesh.opacity[*v]).collect();
    }
    mesh.color.clear();
    mesh.triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ColorMap;
    use splat_core::{TransferFunction, TransferPoint};

    fn square(association: Association, values: &[f64]) -> Arc<Mesh> {
        let mut mesh = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        mesh.columns = vec![MeshColumn { name: "heat".into(), association, values: values.to_vec() }];
        mesh.into()
    }

    fn colored_by_heat(mesh: Arc<Mesh>, colors: PointColors) -> ColoredMesh {
        let by = ColorBy { column: "heat".into(), colors };
        colored_mesh(mesh, &by, DVec3::Y, &SplatParams::default()).expect("a column that is there")
    }

    #[test]
    fn a_map_is_followed_between_far_vertices_and_faces_have_one_colour() {
        let map = ColorMap::VIRIDIS;
        let colors = || PointColors::map_over(map, [0.0, 1.0]);
        let ramp = colored_by_heat(square(Association::Vertex, &[0.0, 1.0, 1.0, 0.0]), colors());
        assert!(ramp.mesh.triangles.len() > 8 && ramp.mesh.columns.is_empty());
        for (p, color) in ramp.mesh.position.iter().zip(&ramp.mesh.color) {
            assert_eq!(*color, map.at(f64::from(0.5 * p.x + 0.5)));
        }
        assert!((ramp.mesh.area() - 4.0).abs() < 1e-9 && ramp.said.len() == 2, "{:?}", ramp.said);
        let faces = colored_by_heat(square(Association::Triangle, &[0.0, 1.0]), colors());
        assert_eq!(faces.mesh.color, [[map.at(0.0); 3], [map.at(1.0); 3]].concat());
        assert_eq!(faces.said, ["faces have the colours of `heat` by the map viridis from 0 to 1"]);
    }

    #[test]
    fn opacities_of_a_transfer_function_are_factors_and_gaps_stay() {
        let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
        let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(4.0, 1.0)]).expect("rising values");
        let mut mesh = Mesh::clone(&square(Association::Vertex, &[0.0, 4.0, f64::NAN, 2.0]));
        mesh.opacity = vec![1.0, 0.5, 0.5, 0.5];
        let shown = colored_by_heat(mesh.into(), PointColors::Transfer(transfer, Classified::Opacity));
        assert_eq!(shown.mesh.opacity[..4], [0.0, 0.5, 0.5, 0.25]);
        // Both triangles have the corner without a number.
        assert_eq!(shown.mesh.triangles.len(), 12);
        assert!((shown.mesh.area() - 4.0).abs() < 1e-6);
    }

    #[test]
    fn between_classes_lies_a_border_and_no_other_class() {
        let shown = colored_by_heat(square(Association::Vertex, &[3.0, 3.0, 7.0, 7.0]), PointColors::Distinct).mesh;
        let [three, seven] = [3.0, 7.0].map(|class| PointColors::Distinct.at(class, [0.0; 2]));
        assert!((shown.area() - 4.0).abs() < 1e-6);
        let mut areas = [0.0; 2];
        for t in &shown.triangles {
            let colors = t.map(|v| shown.color[v as usize]);
            assert!(colors == [three; 3] || colors == [seven; 3], "{colors:?}");
            let [a, b, c] = t.map(|v| shown.position[v as usize]);
            areas[usize::from(colors[0] == seven)] += 0.5 * (b - a).cross(c - a).length();
        }
        assert!((areas[0] - 2.0).abs() < 1e-6 && (areas[1] - 2.0).abs() < 1e-6, "{areas:?}");
    }

    #[test]
    fn too_many_faces_between_classes_blend_and_that_is_said() {
        // Strips of triangles between two rows of vertices, each of a class of its own.
        let steps = MOST as u32 / 8;
        let position =
            (0..=steps).flat_map(|i| [Vec3::new(i as f32, 0.0, 0.0), Vec3::new(i as f32, 1.0, 0.0)]).collect();
        let strip = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]];
        let triangles: Vec<[u32; 3]> = (0..steps).flat_map(strip).collect();
        let values = (0..2 * (steps + 1)).map(f64::from).collect();
        let columns = vec![MeshColumn { name: "heat".into(), association: Association::Vertex, values }];
        let mesh = Mesh { position, triangles: triangles.clone(), columns, ..Mesh::default() };
        let shown = colored_by_heat(mesh.into(), PointColors::Distinct);
        assert_eq!(shown.mesh.triangles, triangles);
        assert!(shown.said[1].starts_with("colours blend in 524288 faces"), "{:?}", shown.said);
    }

    #[test]
    fn what_has_no_number_ends_half_way_and_does_not_fade() {
        let map = ColorMap::VIRIDIS;
        let gap = square(Association::Vertex, &[1.0, 1.0, 1.0, f64::NAN]);
        let shown = colored_by_heat(gap, PointColors::map_over(map, [0.0, 1.0])).mesh;
        let plain = SplatParams::default().color;
        for t in &shown.triangles {
            let colors = t.map(|v| shown.color[v as usize]);
            assert!(colors == [map.at(1.0); 3] || colors == [plain; 3], "{colors:?}");
        }
    }
}
