//! Vertices that lie at one place, but for the rounding of the arithmetic that made them.

use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Share of the diagonal of all vertices within which two are at one place: what sines and cosines of a whole turn differ by is a tenth of it in single
/// precision, and detail that anybody sees is a thousand times as large.
const TOLERANCE: f64 = 1e-6;

/// Side of a cell of the search, tolerances: most vertices then lie far enough from its border to be looked for in it alone.
const CELL: f64 = 16.0;

/// Bytes that a vertex takes in the search: a cell of the table, and a link to the vertex that was put there before.
const BYTES_PER_VERTEX: u64 = 64;

/// No vertex.
const NONE: u32 = u32::MAX;

/// For each vertex the first one at its place.
pub(crate) fn first_at_place(positions: &[Vec3], reading: &Reading<'_>) -> Result<Vec<u32>, ReadError> {
    input::hold("the places of vertices", positions.len() as u64 * BYTES_PER_VERTEX, reading.params)?;
    let corner = |fold: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().reduce(fold).unwrap_or_default().as_dvec3();
    let low = corner(Vec3::min);
    let tolerance = TOLERANCE * (corner(Vec3::max) - low).length();
    // Vertices that are all at one place are so exactly.
    let side = (CELL * tolerance).max(f64::MIN_POSITIVE);
    let cell = |place: DVec3| ((place - low) / side).floor().to_array().map(|x| x as i64);
    let mut last_in: HashMap<[i64; 3], u32> = HashMap::new();
    let mut before = vec![NONE; positions.len()];
    let mut first = Vec::with_capacity(positions.len());
    for (v, position) in positions.iter().enumerate() {
        let place = position.as_dvec3();
        let lowest = cell(place - tolerance);
        let highest = cell(place + tolerance);
        let mut found = NONE;
        for x in lowest[0]..=highest[0] {
            for y in lowest[1]..=highest[1] {
                for z in lowest[2]..=highest[2] {
                    let mut other = last_in.get(&[x, y, z]).copied().unwrap_or(NONE);
                    while other != NONE {
                        let is_near = positions[other as usize].as_dvec3().distance(place) <= tolerance;
                        found = if is_near { found.min(other) } else { found };
                        other = before[other as usize];
                    }
                }
            }
        }
        if found == NONE {
            found = v as u32;
            before[v] = last_in.insert(cell(place), found).unwrap_or(NONE);
        }
        first.push(found);
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadParams;

    fn places(positions: &[Vec3]) -> Vec<u32> {
        first_at_place(positions, &Reading::new(&ReadParams::default(), None)).unwrap()
    }

    #[test]
    fn what_rounding_parts_is_one_place_and_detail_is_not() {
        let wide = Vec3::new(1000.0, 0.0, 0.0);
        // The diagonal is 1000, so that places within 0.001 are one.
        let near = Vec3::new(0.0, 0.0009, 0.0);
        let far = Vec3::new(0.0, 0.0, 0.0011);
        assert_eq!(places(&[Vec3::ZERO, wide, near, far, -Vec3::ZERO]), [0, 1, 0, 3, 0]);
        assert_eq!(places(&[Vec3::ONE; 3]), [0; 3]);
        assert!(places(&[]).is_empty());
    }

    #[test]
    fn places_at_borders_of_cells_are_found_from_both_sides() {
        let ends = [Vec3::ZERO, Vec3::splat(1.0)];
        let diagonal = libm::sqrtf(3.0);
        for step in 0..1000 {
            let one = Vec3::splat(0.3 + step as f32 * 1e-5);
            let pair = [ends[0], ends[1], one, one + Vec3::new(0.5e-6 * diagonal, 0.0, 0.0)];
            assert_eq!(places(&pair)[2..], [2, 2], "{step}");
        }
    }
}
