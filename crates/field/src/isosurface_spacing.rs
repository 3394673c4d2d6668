//! The default distance between splats of an isosurface.
//!
//! A spacing of a lattice step suffices if the surface is smooth at that scale. A piece that is as small as a step or two keeps its area and
//! its opacity only if its splats are finer: discs of the distance h err by about (h/r)² on a radius of curvature r.

use crate::Inside;
use crate::marching_cubes::isosurface_to_mesh;
use splat_core::{Error, Grid, Mesh};

/// Distance of splats over the radius of curvature, at most.
const OVER_RADIUS: f64 = 0.25;
/// Share of the surface that may be more curved: noise and tips.
const MORE_CURVED: f64 = 0.1;
/// Splats up to which a surface is made finer.
const MOST_SPLATS: f64 = 2e5;
/// Voxels up to which a volume is called coarse, so that its surface is looked at.
const MOST_VOXELS: usize = 1 << 22;

/// The distance of the splats of an isosurface, in the unit of the grid's axes. The default is a step of the lattice. A coarse volume gets
/// a quarter of the radius of curvature that nine tenths of the surface exceed, unless that makes more than 200,000 splats.
///
/// # Errors
/// As [`isosurface_to_mesh`].
pub fn isosurface_spacing(grid: &Grid, isovalue: f64, inside: Inside) -> Result<f64, Error> {
    let step = grid.shortest_step();
    if grid.values.len() > MOST_VOXELS {
        return Ok(step);
    }
    let mesh = isosurface_to_mesh(grid, isovalue, inside)?;
    let affordable = (mesh.area() / MOST_SPLATS).sqrt();
    Ok(least_radius(&mesh).map_or(step, |radius| step.min((OVER_RADIUS * radius).max(affordable))))
}

/// The radius of curvature that all but [`MORE_CURVED`] of a surface exceed; `None` for a flat one.
fn least_radius(mesh: &Mesh) -> Option<f64> {
    let mut curvatures: Vec<(f64, f64)> = Vec::with_capacity(mesh.triangles.len());
    for triangle in &mesh.triangles {
        let corner = triangle.map(|v| mesh.position[v as usize].as_dvec3());
        let normal = triangle.map(|v| mesh.normal[v as usize].as_dvec3());
        let area = 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).length();
        let bend = |a: usize, b: usize| {
            let length = corner[a].distance(corner[b]);
            if length > 0.0 { normal[a].distance(normal[b]) / length } else { 0.0 }
        };
        curvatures.push((bend(0, 1).max(bend(1, 2)).max(bend(2, 0)), area));
    }
    curvatures.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = MORE_CURVED * curvatures.iter().map(|(_, area)| area).sum::<f64>();
    let mut passed = 0.0;
    let reached = curvatures.iter().find(|(_, area)| {
        passed += area;
        passed >= most
    });
    reached.filter(|(curvature, _)| *curvature > 0.0).map(|(curvature, _)| 1.0 / curvature)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    /// A ball of a radius in steps, in a lattice of so many points a side.
    fn ball(radius: f64, side: usize) -> Grid {
        let middle = 0.5 * (side - 1) as f64 + 0.2;
        let place = |i: usize| DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64);
        let values = (0..side.pow(3)).map(|i| (radius - place(i).distance(DVec3::splat(middle))) as f32).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::from_diagonal(DVec3::splat(3.0)), dims: [side; 3], values }
    }

    #[test]
    fn small_bodies_have_finer_splats_than_their_lattice_and_large_ones_its_step() {
        for (radius, expected) in [(1.5, 1.5 * OVER_RADIUS), (3.0, 3.0 * OVER_RADIUS), (8.0, 1.0)] {
            let spacing = isosurface_spacing(&ball(radius, 22), 0.0, Inside::Above).unwrap() / 3.0;
            assert!((spacing / expected - 1.0).abs() < 0.25, "radius {radius}: {spacing} steps for {expected}");
        }
        // Nothing there.
        assert_eq!(isosurface_spacing(&ball(1.5, 8), 9.0, Inside::Above).unwrap(), 3.0);
    }
}
