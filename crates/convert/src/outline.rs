//! Points around what is seen of some data, for cameras that are placed by it.

use crate::RawPoints;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, DAabb, Footprint, Mesh, Similarity};

/// Points around data, in its own coordinates.
#[derive(Debug)]
pub enum Outline<'a> {
    /// The corners of all triangles.
    Mesh(&'a Mesh),
    /// All points.
    Points(&'a RawPoints),
    /// These.
    Places(Vec<DVec3>),
}

impl<'a> Outline<'a> {
    /// Of points: of Gaussians the bulk.
    pub fn of_points(points: &'a RawPoints) -> Self {
        points.bulk().map_or(Self::Points(points), |bulk| Self::of_boxes([bulk]))
    }

    /// Of splats the corners of boxes around the cores of discs and of balls.
    pub fn of_splats(cloud: &Cloud) -> Self {
        let middle = |i: usize| cloud.origin + cloud.position[i].as_dvec3();
        Self::of_boxes((0..cloud.len()).map(|i| DAabb::around(middle(i), reach(cloud, i).as_dvec3())))
    }

    /// Of boxes their corners.
    pub fn of_boxes(boxes: impl IntoIterator<Item = DAabb>) -> Self {
        Self::Places(boxes.into_iter().flat_map(|bounds| bounds.corners()).collect())
    }

    /// Gives all of them, led to the world by a transform.
    pub fn each(&self, transform: &Similarity, add: &mut dyn FnMut(DVec3)) {
        let mut add = |p: DVec3| add(transform.apply(p));
        match self {
            Self::Mesh(mesh) => {
                let corners = mesh.triangles.iter().flatten();
                corners.for_each(|v| add(mesh.origin + mesh.position[*v as usize].as_dvec3()));
            }
            Self::Points(points) => points.position.iter().for_each(|p| add(points.origin + p.as_dvec3())),
            Self::Places(places) => places.iter().copied().for_each(add),
        }
    }
}

/// How far the core of a splat reaches along each axis.
fn reach(cloud: &Cloud, i: usize) -> Vec3 {
    let (radius, of) = (cloud.radius[i], |column: &[Vec3]| column.get(i).copied().unwrap_or_default());
    let (normal, tangent) = (of(&cloud.normal), of(&cloud.tangent));
    let squares = if normal == Vec3::ZERO {
        Vec3::splat(radius * radius)
    } else if tangent == Vec3::ZERO {
        radius * radius * (Vec3::ONE - normal * normal)
    } else {
        let across = radius * normal.cross(tangent.normalize());
        tangent * tangent + across * across
    };
    Footprint::CORE * squares.max(Vec3::ZERO).map(f32::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Splat;

    /// Half the size of the box around a splat, over its core.
    fn half_size(splat: Splat) -> Vec3 {
        let mut cloud = Cloud::new(DVec3::splat(1e6));
        cloud.push(&splat);
        let mut bounds = DAabb::EMPTY;
        Outline::of_splats(&cloud).each(&Similarity::default(), &mut |p| bounds = bounds.union(DAabb::new(p, p)));
        assert!((bounds.center() - DVec3::splat(1e6)).length() < 1e-6);
        (0.5 * bounds.size()).as_vec3() / Footprint::CORE
    }

    #[test]
    fn boxes_hold_discs_ellipses_and_balls() {
        let disc = Splat { radius: 2.0, normal: Vec3::new(0.6, 0.0, 0.8), ..Splat::default() };
        assert!((half_size(disc) - Vec3::new(1.6, 2.0, 1.2)).length() < 1e-5);
        let ellipse = Splat { radius: 1.0, normal: Vec3::Z, tangent: Vec3::new(3.0, 3.0, 0.0), ..Splat::default() };
        assert!((half_size(ellipse) - Vec3::new(9.5f32.sqrt(), 9.5f32.sqrt(), 0.0)).length() < 1e-5);
        let ball = Splat { radius: 2.0, normal: Vec3::ZERO, ..Splat::default() };
        assert!((half_size(ball) - Vec3::splat(2.0)).length() < 1e-5);
    }
}
