//! The four cells about a place of a table, and how much each counts: so that their rays, weighted alike, meet the receiver.

use crate::mapping::{Mapping, floor};
use glam::{Vec2, Vec3};
use splat_core::glam;

/// The four cells about a place, and their bilinear weights.
pub(crate) struct Patch {
    pub(crate) cells: [Option<u32>; 4],
    pub(crate) part: Vec2,
    pub(crate) weights: [f32; 4],
}

impl Patch {
    #[inline(always)]
    pub(crate) fn at<M: Mapping>(mapping: &M, at: Vec2) -> Self {
        let column = floor(at.x - 0.5);
        let row = floor(at.y - 0.5);
        let part = at - 0.5 - Vec2::new(column as f32, row as f32);
        let rest = Vec2::ONE - part;
        let mut cells = [None; 4];
        for (k, cell) in (0..).zip(&mut cells) {
            *cell = mapping.wrap(column + (k & 1), row + (k >> 1));
        }
        Self { cells, part, weights: [rest.x * rest.y, part.x * rest.y, rest.x * part.y, part.x * part.y] }
    }
}

/// Newton steps of [`met_at`]; across an edge the first makes up for it and the second for the first's slope.
const STEPS: usize = 3;
/// Least solid angle of four rays, in cells, that says where to go: at the corners of octants two of them may be one.
const LEAST_SPREAD: f32 = 0.1;

/// Where the rays of the four nearest cells, weighted bilinearly, meet `p`: from its place `at` in the table by Newton
/// steps, each with the slopes of the rays that it finds there.
pub(crate) fn met_at<M: Mapping>(mapping: &M, p: Vec3, at: Vec2) -> Vec2 {
    let mut met = at;
    let towards = p.normalize();
    for _ in 0..STEPS {
        let Patch { cells: [Some(a), Some(b), Some(c), Some(d)], part, weights } = Patch::at(mapping, met) else {
            return at;
        };
        let [a, b, c, d] = [a, b, c, d].map(|cell| mapping.cell_ray(cell).direction);
        let ray = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3];
        let along_x = (b - a) * (1.0 - part.y) + (d - c) * part.y;
        let along_y = (c - a) * (1.0 - part.x) + (d - b) * part.x;
        // ray + x·along_x + y·along_y is to be along p.
        let area = along_x.cross(along_y).dot(towards);
        if area.abs() < LEAST_SPREAD * mapping.measure(0) as f32 {
            return at;
        }
        let step = Vec2::new(along_y.cross(ray).dot(towards), ray.cross(along_x).dot(towards)) / area;
        met += step.clamp(Vec2::NEG_ONE, Vec2::ONE);
    }
    met
}
