//! Unions, intersections, differences, complements and clipped surfaces.

use convert::{
    Clip, ClippedField, CombinedField, Density, MeshParams, SharedField, SplatParams, field_to_mesh, surface_to_points,
};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{DAabb, ScalarField, rng};
use std::sync::Arc;

/// Distance from a ball's surface; its domain is where x < 2, its values end at |p| = 50.
struct Ball(DVec3, f64);

impl ScalarField for Ball {
    fn value(&self, p: DVec3) -> f64 {
        if p.length() > 50.0 { f64::NAN } else { p.distance(self.0) - self.1 }
    }
    fn gradient(&self, p: DVec3) -> DVec3 {
        (p - self.0).normalize()
    }
    fn hessian(&self, p: DVec3) -> DMat3 {
        let (n, r) = (self.gradient(p), p.distance(self.0));
        (DMat3::IDENTITY - DMat3::from_cols(n * n.x, n * n.y, n * n.z)) * (1.0 / r)
    }
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let d = p.distance(self.0);
        (d < 40.0).then_some(((d - radius).max(0.0) - self.1, d + radius - self.1))
    }
    fn in_domain(&self, p: DVec3) -> bool {
        p.x < 2.0
    }
}

fn balls() -> (SharedField, SharedField) {
    (Arc::new(Ball(DVec3::ZERO, 1.0)), Arc::new(Ball(DVec3::X * 0.8, 0.7)))
}

fn place(i: u64) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|a| 3.0 * rng::unit(31, 0, i, a) - 1.3))
}

#[test]
fn combinations_are_sets_and_their_derivatives_those_of_the_active_part() {
    let (a, b) = balls();
    let all = [
        CombinedField::union(vec![a.clone(), b.clone()]).unwrap(),
        CombinedField::intersection(vec![a.clone(), b.clone()]).unwrap(),
        CombinedField::difference(a.clone(), b.clone()),
        CombinedField::complement(a.clone()),
    ];
    let mut seen = [[0; 2]; 4];
    for i in 0..2000 {
        let p = place(i);
        let (x, y) = (a.value(p), b.value(p));
        let inside = [x < 0.0 || y < 0.0, x < 0.0 && y < 0.0, x < 0.0 && y >= 0.0, x >= 0.0];
        for (n, f) in all.iter().enumerate() {
            assert_eq!(f.value(p) < 0.0, inside[n], "{f:?}");
            seen[n][usize::from(inside[n])] += 1;
            assert_eq!(f.value_gradient(p), (f.value(p), f.gradient(p)));
            let h = 1e-6;
            for axis in 0..3 {
                let d = DVec3::AXES[axis] * h;
                let slope = (f.value(p + d) - f.value(p - d)) / (2.0 * h);
                let bend = (f.gradient(p + d) - f.gradient(p - d)) / (2.0 * h);
                // Not at an edge between parts, nor in the middle of a ball.
                if (x.abs() - y.abs()).abs() > 1e-3 && x > -0.9 && y > -0.6 {
                    assert!((slope - f.gradient(p)[axis]).abs() < 1e-6);
                    assert!((bend - f.hessian(p).col(axis)).length() < 1e-5);
                }
            }
        }
    }
    assert!(seen.iter().flatten().all(|n| *n > 20), "{seen:?}");
}

#[test]
fn bounds_contain_every_value() {
    let (a, b) = balls();
    let nested: SharedField = Arc::new(CombinedField::difference(a.clone(), b.clone()));
    for f in [
        CombinedField::union(vec![a.clone(), b.clone()]).unwrap(),
        CombinedField::intersection(vec![a.clone(), nested.clone()]).unwrap(),
        CombinedField::complement(nested),
    ] {
        for i in 0..200 {
            let (center, radius) = (place(i), rng::unit(32, 0, i, 0));
            let (low, high) = f.bound(center, radius).unwrap();
            for j in 0..50 {
                let d = DVec3::from_array([0, 1, 2].map(|k| 2.0 * rng::unit(33, i, j, k) - 1.0)).clamp_length_max(1.0);
                let v = f.value(center + d * radius);
                assert!(low - 1e-12 <= v && v <= high + 1e-12, "{f:?}: {v} outside {low}..{high}");
            }
            assert!(high - low <= 2.0 * radius + 1e-12);
        }
        assert!(f.bound(DVec3::Z * 45.0, 0.1).is_none(), "unknown stays unknown");
        assert!(f.value(DVec3::Z * 60.0).is_nan());
    }
}

#[test]
fn the_domain_is_that_of_the_active_part() {
    let (a, _) = balls();
    let clip = |clip| ClippedField::new(a.clone(), vec![clip]).unwrap();
    let half: SharedField = Arc::new(clip(Clip::HalfSpace { normal: DVec3::Z * 2.0, offset: 0.5 }));
    assert!(half.in_domain(DVec3::Z * 0.25) && !half.in_domain(DVec3::Z * 0.26));
    assert!(!half.in_domain(DVec3::new(3.0, 0.0, 0.0)), "the ball's own domain ends");
    let boxed = clip(Clip::Box(DAabb::around(DVec3::ZERO, DVec3::splat(0.5))));
    assert!(boxed.in_domain(DVec3::splat(0.5)) && !boxed.in_domain(DVec3::X * 0.51));
    let p = DVec3::new(0.3, 0.1, 0.9);
    assert_eq!((half.value_gradient(p), half.hessian(p)), (a.value_gradient(p), a.hessian(p)));
    assert_eq!((half.gradient(p), half.value(p), half.bound(p, 0.1)), (a.gradient(p), a.value(p), a.bound(p, 0.1)));
    let far: SharedField = Arc::new(Ball(DVec3::Z * 3.0, 1.0));
    let both = CombinedField::union(vec![half, far]).unwrap();
    // Near the clipped ball its border counts, near the whole one it does not.
    assert!(!both.in_domain(DVec3::Z) && both.in_domain(DVec3::Z * 2.1) && both.in_domain(-DVec3::Z));
}

#[test]
fn a_union_becomes_one_closed_mesh() {
    let (a, b) = balls();
    let f = CombinedField::union(vec![a, b]).unwrap();
    let mesh =
        field_to_mesh(&f, DAabb::new(DVec3::splat(-1.3), DVec3::splat(1.8)), 0.06, &SplatParams::default(), None)
            .unwrap();
    for p in mesh.position.iter().map(|p| p.as_dvec3() + mesh.origin) {
        assert!(f.value(p).abs() < 1e-6, "{p}: {}", f.value(p));
    }
    let volume: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    // Two balls less their lens, by the formula for spherical caps.
    let cap = |r: f64, h: f64| std::f64::consts::PI * h * h * (3.0 * r - h) / 3.0;
    let x = (1.0 + 0.64 - 0.49) / 1.6;
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (1.0 + 0.343) - cap(1.0, 1.0 - x) - cap(0.7, 0.7 - (0.8 - x));
    assert!((volume / exact - 1.0).abs() < 5e-3, "{volume} {exact}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (a, _) = balls();
    assert!(CombinedField::union(Vec::new()).is_err() && CombinedField::intersection(Vec::new()).is_err());
    for clip in [
        Clip::HalfSpace { normal: DVec3::ZERO, offset: 0.0 },
        Clip::HalfSpace { normal: DVec3::X, offset: f64::NAN },
        Clip::Box(DAabb::new(DVec3::ONE, DVec3::ZERO)),
        Clip::Box(DAabb::new(DVec3::ZERO, DVec3::INFINITY)),
    ] {
        assert!(ClippedField::new(a.clone(), vec![clip]).is_err(), "{clip:?}");
    }
}

#[test]
fn meshes_and_splats_end_at_the_border_of_the_domain() {
    let (a, _) = balls();
    let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
    let area = |field: &dyn ScalarField| {
        let mesh = field_to_mesh(field, bounds, 0.05, &SplatParams::default(), None).unwrap();
        mesh.validate().unwrap();
        let at = |i: u32| mesh.origin + mesh.position[i as usize].as_dvec3();
        let highest = (0..mesh.position.len() as u32).map(|i| at(i).z).fold(f64::MIN, f64::max);
        let of = |t: &[u32; 3]| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length();
        (mesh.triangles.iter().map(of).sum::<f64>(), highest, mesh)
    };
    let (whole, top, uncut) = area(&*a);
    assert!((top - 1.0).abs() < 1e-3);
    // The part of a sphere below z = 1/4 has 5/8 of its area.
    let half = ClippedField::new(a.clone(), vec![Clip::HalfSpace { normal: DVec3::Z, offset: 0.25 }]).unwrap();
    let (part, top, _) = area(&half);
    assert!((part / whole - 0.625).abs() < 1e-3, "{part} of {whole}");
    assert!((0.25 - 1e-6..=0.25 + 1e-6).contains(&top), "{top}");
    let params = MeshParams { density: Density::Spacing(0.05), ..MeshParams::default() };
    let (cloud, _) = surface_to_points(&half, bounds, &params, None).unwrap();
    let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    let (all, _) = surface_to_points(&*a, bounds, &params, None).unwrap();
    let total: f64 = all.cross_section.iter().map(|k| f64::from(*k)).sum();
    assert!((sum / total - 0.625).abs() < 2e-3, "{sum} of {total}");
    assert!(cloud.position.iter().all(|p| cloud.origin.z + f64::from(p.z) < 0.26));
    // A domain that holds all of the surface changes no bit; one that holds nothing leaves nothing.
    let (.., same) =
        area(&ClippedField::new(a.clone(), vec![Clip::Box(DAabb::around(DVec3::ZERO, DVec3::splat(2.0)))]).unwrap());
    assert_eq!((same.position, same.triangles), (uncut.position, uncut.triangles));
    let none = ClippedField::new(a, vec![Clip::Box(DAabb::around(DVec3::ZERO, DVec3::splat(0.1)))]).unwrap();
    assert!(field_to_mesh(&none, bounds, 0.05, &SplatParams::default(), None).unwrap().triangles.is_empty());
}
