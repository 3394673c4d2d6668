//! Unions, intersections, differences, complements and clipped surfaces.

use convert::{Density, MeshParams, SplatParams, field_to_mesh, surface_to_points};
use field::{ClippedField, Combination, CombinedField, ExpressionField, GridField, Inside, SharedField, Solid};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Clip, DAabb, Grid, Interpolation, ScalarField, rng};
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
        let n = self.gradient(p);
        let r = p.distance(self.0);
        (DMat3::IDENTITY - DMat3::from_cols(n * n.x, n * n.y, n * n.z)) * (1.0 / r)
    }
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let d = p.distance(self.0);
        (d < 40.0).then_some(((d - radius).max(0.0) - self.1, d + radius - self.1))
    }
    fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> {
        self.bound(p, radius).map(|_| 1.0)
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
    let fields = [
        CombinedField::union(vec![a.clone(), b.clone()]).unwrap(),
        CombinedField::intersection(vec![a.clone(), b.clone()]).unwrap(),
        CombinedField::difference(a.clone(), b.clone()),
        CombinedField::complement(a.clone()),
    ];
    let mut seen = [[0; 2]; 4];
    for i in 0..2000 {
        let p = place(i);
        let x = a.value(p);
        let y = b.value(p);
        let inside = [x < 0.0 || y < 0.0, x < 0.0 && y < 0.0, x < 0.0 && y >= 0.0, x >= 0.0];
        for (n, f) in fields.iter().enumerate() {
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
            let center = place(i);
            let radius = rng::unit(32, 0, i, 0);
            let (low, high) = f.bound(center, radius).unwrap();
            for j in 0..50 {
                let d = DVec3::from_array([0, 1, 2].map(|k| 2.0 * rng::unit(33, i, j, k) - 1.0)).clamp_length_max(1.0);
                let v = f.value(center + d * radius);
                assert!(low - 1e-12 <= v && v <= high + 1e-12, "{f:?}: {v} outside {low}..{high}");
            }
            assert!(high - low <= 2.0 * radius + 1e-12);
        }
        assert_eq!(f.steepest(DVec3::Z, 0.1), Some(1.0));
        assert!(f.bound(DVec3::Z * 45.0, 0.1).is_none(), "unknown stays unknown");
        assert!(f.steepest(DVec3::Z * 45.0, 0.1).is_none());
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
        let triangle_area = |t: &[u32; 3]| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length();
        (mesh.triangles.iter().map(triangle_area).sum::<f64>(), highest, mesh)
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

/// Distances from a ball of radius `r` about the origin, negative inside, on a lattice of steps of 0.05 from −1.5 to `top` in z.
fn distances(r: f64, top: usize) -> GridField {
    let at = |i: usize| 0.05 * i as f64 - 1.5;
    let value = |i: usize| DVec3::new(at(i % 61), at(i / 61 % 61), at(i / 3721)).length() - r;
    let values = (0..3721 * top).map(|i| value(i) as f32).collect();
    let grid = Grid {
        origin: DVec3::splat(-1.5),
        axes: DMat3::from_diagonal(DVec3::splat(0.05)),
        dims: [61, 61, top],
        values,
    };
    GridField::new(Arc::new(grid), Interpolation::CatmullRom, 0.0, Inside::Below).unwrap()
}

fn of_grid(field: GridField) -> Solid {
    let walls = field.walls();
    let bounds = field.bounds();
    Solid { field: Arc::new(field), walls, bounds, step: 0.03 }
}

fn of_formula(text: &str, bounds: DAabb) -> Solid {
    Solid { field: Arc::new(ExpressionField::parse(text).unwrap()), walls: Vec::new(), bounds, step: 0.03 }.closed()
}

/// Area by splats, and the volume by the mesh.
fn area_and_volume(solid: &Solid) -> [f64; 2] {
    let params = MeshParams { opacity: 0.5, density: Density::Spacing(solid.step), ..MeshParams::default() };
    let (cloud, _) = surface_to_points(solid.field.as_ref(), solid.bounds, &params, None).unwrap();
    let area = cloud.cross_section.iter().map(|k| f64::from(*k)).sum::<f64>() / std::f64::consts::LN_2;
    let mesh = field_to_mesh(solid.field.as_ref(), solid.bounds, solid.step, &SplatParams::default(), None).unwrap();
    let tetrahedron = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
        a.dot(b.cross(c)) / 6.0
    };
    [area, mesh.triangles.iter().map(tetrahedron).sum()]
}

/// Area that is lost at most where an edge of so much length is cut off within a cell of the lattice, √2 steps wide.
fn cut_off(edge: f64) -> f64 {
    0.03 * std::f64::consts::SQRT_2 * edge
}

#[test]
fn solids_of_an_isosurface_and_a_formula_have_their_closed_forms() {
    let ball = || of_grid(distances(1.0, 61));
    let small = || {
        of_formula(
            "sqrt((x - 0.8)^2 + y^2 + z^2) - 0.7",
            DAabb::new(DVec3::new(0.0, -0.8, -0.8), DVec3::new(1.6, 0.8, 0.8)),
        )
    };
    // Caps of the two balls beyond the plane x = c in which they meet: volumes, then areas.
    let pi = std::f64::consts::PI;
    let c = (1.0 + 0.64 - 0.49) / 1.6;
    let of_ball = 1.0 - c;
    let of_small = 0.7 - (0.8 - c);
    let cap = |r: f64, h: f64| [2.0 * pi * r * h, pi * h * h * (3.0 * r - h) / 3.0];
    let whole = |r: f64| [4.0 * pi * r * r, 4.0 / 3.0 * pi * r * r * r];
    let [a, b, cap_a, cap_b] = [whole(1.0), whole(0.7), cap(1.0, of_ball), cap(0.7, of_small)];
    for (combination, exact) in [
        (Combination::Union, [0, 1].map(|k| a[k] - cap_a[k] + b[k] - cap_b[k])),
        (Combination::Intersection, [0, 1].map(|k| cap_a[k] + cap_b[k])),
        (Combination::Difference, [a[0] - cap_a[0] + cap_b[0], a[1] - cap_a[1] - cap_b[1]]),
    ] {
        let solid = Solid::combined(combination, vec![ball(), small()]).unwrap();
        let found = area_and_volume(&solid);
        let most = [cut_off(std::f64::consts::TAU * (1.0 - c * c).sqrt()), 6e-3 * exact[1]];
        for k in 0..2 {
            assert!((found[k] - exact[k]).abs() < most[k], "{combination:?}: {found:?}, {exact:?}");
        }
        // The edge is where both have their zeros, by the field itself.
        let edge = DVec3::new(c, (1.0 - c * c).sqrt(), 0.0);
        assert!(solid.field.value(edge).abs() < 1e-4);
        let before = solid.field.gradient(edge - DVec3::X * 0.01);
        let after = solid.field.gradient(edge + DVec3::X * 0.01);
        assert!(before.dot(after) < 0.8 * before.length() * after.length(), "{combination:?}: the edge is round");
    }
}

#[test]
fn a_part_that_reaches_its_walls_ends_flat_there() {
    let far = || {
        of_formula(
            "sqrt((x - 1)^2 + (y - 1)^2 + (z + 1)^2) - 0.05",
            DAabb::around(DVec3::new(1.0, 1.0, -1.0), DVec3::splat(0.1)),
        )
    };
    let pi = std::f64::consts::PI;
    let ball = [4.0 * pi * 0.05 * 0.05, 4.0 / 3.0 * pi * 0.05f64.powi(3)];
    // The lattice ends at z = 0, and so does the ball that it holds; the expression is all of a box with a corner that is cut off.
    let dome = [2.0 * pi + pi, 2.0 / 3.0 * pi];
    let cut = [6.0 - 3.0 * 0.5 * 0.09 + 3f64.sqrt() / 2.0 * 0.09, 1.0 - 0.027 / 6.0];
    let block = || of_formula("-x - y - z - 1.2", DAabb::around(DVec3::ZERO, DVec3::splat(0.5)));
    for (solid, exact, edge) in [(of_grid(distances(1.0, 31)), dome, 2.0 * pi), (block(), cut, 12.0)] {
        let union = Solid::combined(Combination::Union, vec![solid, far()]).unwrap();
        let found = area_and_volume(&union);
        let most = [cut_off(edge), 1.5e-2 * exact[1]];
        for k in 0..2 {
            assert!((found[k] - exact[k] - ball[k]).abs() < most[k], "{found:?}, {exact:?} + {ball:?}");
        }
    }
    // A root has no value beyond the box, where the walls alone count; without one inside that is told.
    let root = Solid::combined(
        Combination::Union,
        vec![of_formula("sqrt(x) - 0.5", DAabb::new(DVec3::ZERO, DVec3::ONE)), far()],
    );
    let root = root.unwrap();
    assert!(root.field.value(DVec3::new(-0.5, 0.5, 0.5)) > 0.0 && root.field.value(DVec3::splat(0.1)) < 0.0);
    let none = of_formula("sqrt(x - 0.9) - 0.5", DAabb::new(DVec3::ZERO, DVec3::ONE));
    assert!(Solid::combined(Combination::Union, vec![none, far()]).unwrap().field.value(DVec3::splat(0.5)).is_nan());
    for i in 0..200 {
        let center = place(i);
        let radius = 0.4 * rng::unit(34, 0, i, 0);
        let union = Solid::combined(Combination::Difference, vec![block(), of_grid(distances(0.4, 31))]).unwrap();
        let Some((low, high)) = union.field.bound(center, radius) else { continue };
        for j in 0..20 {
            let d = DVec3::from_array([0, 1, 2].map(|k| 2.0 * rng::unit(35, i, j, k) - 1.0)).clamp_length_max(1.0);
            let v = union.field.value(center + d * radius);
            assert!(low - 1e-9 <= v && v <= high + 1e-9, "{v} outside {low}..{high}");
        }
    }
}

/// The distance from a plane, times a slope.
struct Ramp(f64);

impl ScalarField for Ramp {
    fn value(&self, p: DVec3) -> f64 {
        self.0 * p.x
    }
    fn gradient(&self, _: DVec3) -> DVec3 {
        DVec3::X * self.0
    }
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        Some((self.value(p) - self.0 * radius, self.value(p) + self.0 * radius))
    }
    fn steepest(&self, _: DVec3, _: f64) -> Option<f64> {
        Some(self.0)
    }
}

#[test]
fn a_closed_field_is_as_steep_as_the_steeper_of_field_and_walls() {
    // Scaled by 1, by a half and by a quarter.
    for (slope, steepest) in [(1.3, 1.3), (2.6, 1.3), (3.0, 1.0)] {
        let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.0));
        let closed = Solid { field: Arc::new(Ramp(slope)), walls: Vec::new(), bounds, step: 0.03 }.closed();
        let far = Solid { field: Arc::new(Ball(DVec3::splat(9.0), 0.1)), ..closed.clone() };
        let field = Solid::combined(Combination::Union, vec![closed, far]).unwrap().field;
        let mut most = 0.0f64;
        let mut found = 0.0f64;
        for i in 0..500 {
            let center = place(i);
            most = most.max(field.steepest(center, 0.1).unwrap());
            let d = DVec3::from_array([0, 1, 2].map(|k| 2.0 * rng::unit(36, 0, i, k) - 1.0)).normalize() * 0.1;
            found = found.max((field.value(center + d) - field.value(center - d)).abs() / 0.2);
        }
        assert!(found <= most + 1e-12 && most == steepest && found > 0.9 * most, "{slope}: {found}, {most}");
    }
}

/// Values of a scan rise by hundreds within a step, where a wall is some steps away.
#[test]
fn parts_of_unlike_scales_keep_their_surfaces() {
    let steep = of_formula("1000*(sqrt(x^2 + y^2 + z^2) - 1)", DAabb::around(DVec3::ZERO, DVec3::splat(1.5)));
    let notch = of_formula("x - 2", DAabb::new(DVec3::ZERO, DVec3::ONE));
    let solid = Solid::combined(Combination::Difference, vec![steep, notch]).unwrap();
    let mesh = field_to_mesh(solid.field.as_ref(), solid.bounds, 0.05, &SplatParams::default(), None).unwrap();
    let mut round = 0;
    for (p, normal) in mesh.position.iter().zip(&mesh.normal) {
        let p = p.as_dvec3() + mesh.origin;
        // What is left of the ball, but for a cell beside the notch.
        if p.min_element() < -0.06 {
            assert!((p.length() - 1.0).abs() < 1e-6 && normal.as_dvec3().dot(p) > 0.9999, "{p} {normal}");
            round += 1;
        }
    }
    assert!(round > 3000, "{round}");
}

#[test]
fn solids_that_make_none_are_refused() {
    let small = |x: f64| of_formula("x^2 + y^2 + z^2 - 1", DAabb::around(DVec3::X * x, DVec3::ONE));
    let alone = Solid::combined(Combination::Difference, vec![small(0.0)]).unwrap_err().to_string();
    assert!(alone.contains("at least two"), "{alone}");
    let apart = Solid::combined(Combination::Intersection, vec![small(0.0), small(3.0)]).unwrap_err().to_string();
    assert!(apart.contains("a place in common"), "{apart}");
}
