//! Normals of discs that stick out over a silhouette.
//!
//! Behind the silhouette of a closed surface discs face away. Turned to the viewer their normals point inwards, and the disc is lit on the
//! inside: a dark flap. A single disc does not reveal whether its normal n is of that kind, and a scan does not know its outside. So the surface
//! beside it decides between n and its mirror image at the line of sight v, 2(n·v)v − n: the one nearer to the normals around is taken.

use crate::disc::Discs;
use crate::shade::Light;
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::raster::OpaqueImage;

/// |cosine| to the line of sight below which a normal is looked at.
const EDGE_ON: f32 = 0.4;

/// Eight directions, in which pixels are asked that lie half a radius and a whole one away.
const AROUND: [[f32; 2]; 8] =
    [[1.0, 0.0], [0.7, 0.7], [0.0, 1.0], [-0.7, 0.7], [-1.0, 0.0], [-0.7, -0.7], [0.0, -1.0], [0.7, -0.7]];

/// Pixels whose normals, face and shading, are others, ascending. The first six channels of the image are these normals.
pub(super) fn turned(light: &Light<'_>, discs: &Discs, image: &OpaqueImage, disc: &[u32]) -> Vec<(usize, [f32; 6])> {
    let [width, height] = discs.size.map(|s| s as usize);
    let normal = |k: usize, first: usize| {
        let at = |c: usize| image.channels[first + c][k];
        Vec3::new(at(0), at(1), at(2)).normalize_or_zero()
    };
    let turned_normals = |k: usize| {
        let radius = light.input.cloud.radius[*disc.get(k).filter(|disc| **disc != u32::MAX)? as usize];
        let to_eye = light.toward_eye(discs.place(&discs.ray([k % width, k / width]), image.depth[k]));
        let here = normal(k, 0);
        if here.dot(to_eye).abs() > EDGE_ON {
            return None;
        }
        let reach = radius / discs.pixel_width(image.depth[k]);
        let asked = AROUND.iter().flat_map(|a| [0.5, 1.0].map(|share| a.map(|a| a * share * reach)));
        let neighbor = |[dx, dy]: [f32; 2]| {
            let x = (k % width) as f32 + dx;
            let y = (k / width) as f32 + dy;
            let is_inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
            let at = is_inside.then(|| y as usize * width + x as usize)?;
            // Of the same surface: not farther along the ray than a few radii.
            let is_near = (image.depth[at] - image.depth[k]).abs() < 4.0 * radius;
            let n = is_near.then(|| normal(at, 0))?;
            Some(n * n.dot(to_eye).max(0.0))
        };
        let around: Vec3 = asked.filter_map(neighbor).sum();
        let mirror = |n: Vec3| to_eye * (2.0 * n.dot(to_eye)) - n;
        (mirror(here).dot(around) > here.dot(around)).then(|| {
            let [a, b, c] = mirror(here).to_array();
            let [d, e, f] = mirror(normal(k, 3)).to_array();
            (k, [a, b, c, d, e, f])
        })
    };
    (0..width * height).into_par_iter().filter_map(turned_normals).collect()
}
