//! Fields: formulas, derivatives, bounds, surfaces, densities, procedural clouds.
#![cfg(feature = "noise")]

use convert::{
    CloudShape, ConvertError, Density, DensityParams, MeshParams, SplatParams, VolumeParams, density_to_points,
    field_to_mesh, mesh_to_points, procedural_cloud, surface_to_points,
};
use field::{ExpressionField, GridField, Inside, isosurface_to_mesh};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{DAabb, Grid, Interpolation, ScalarField, rng};
use std::sync::Arc;

fn field(text: &str) -> ExpressionField {
    ExpressionField::parse(text).unwrap()
}

fn point(i: u64, half: f64) -> DVec3 {
    let u = |k| half * (2.0 * rng::unit(11, 0, i, k) - 1.0);
    DVec3::new(u(0), u(1), u(2))
}

const FORMULAS: [&str; 12] = [
    "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)",
    "x^3*y - 2*z^2/(1 + x^2) + 7",
    "exp(-(x^2 + y^2)) * tanh(3*z)",
    "sqrt(x^2 + y^2 + z^2 + 0.1) - 1",
    "atan2(y + 3, x) * ln(4 + z)",
    "(2 + x)^(y + 0.5) + log2(5 + z)",
    "max(x*y, min(z, sin(3*x))) + abs(y - 2)",
    "asin(x/2) + acos(y/2) - atan(z*x)",
    "sinh(x)*cosh(y) - tan(z/2)",
    "pow(x + 3, 1.5) / (y + 2) - log10(z + 4)",
    "(x - y)^-2 * 0.001 + 0.1*(x + 2)^2^1.5 + e^z",
    "-x^2 + 2^-z + pi*y",
];

#[test]
fn signs_and_powers_bind_as_in_mathematics() {
    let at = DVec3::new(3.0, 2.0, -1.0);
    for (text, value) in [
        ("-x^2", -9.0),
        ("2^3^2", 512.0),
        ("2*-x", -6.0),
        ("x - y - z", 2.0),
        ("x/y/2", 0.75),
        ("2^-y", 0.25),
        ("-(x + y)*2", -10.0),
        ("1.5e1 + .5 - e + e", 15.5),
        ("max(1, min(x, y))", 2.0),
        (" pi * 0 + 4 ", 4.0),
    ] {
        assert!((field(text).value(at) - value).abs() < 1e-12, "{text}");
    }
    let named = ExpressionField::parse_with("a*x + b_2", &[("a", 2.0), ("b_2", 1.0)]).unwrap();
    assert_eq!(named.value(at), 7.0);
}

#[test]
fn gradients_of_linear_fields_are_exact() {
    let f = field("0.25*x - 3*y + 7*z + 11");
    assert_eq!(f.gradient(point(0, 5.0)), DVec3::new(0.25, -3.0, 7.0));
    assert_eq!(f.hessian(point(1, 5.0)), splat_core::glam::DMat3::ZERO);
}

#[test]
fn derivatives_agree_with_finite_differences() {
    let h = 1e-4;
    for text in FORMULAS {
        let f = field(text);
        for i in 0..20 {
            let p = point(i, 0.9) + DVec3::new(0.01, -0.98, 0.0) * f64::from(u8::from(text.contains("^-2")));
            let g = f.gradient(p);
            let hessian = f.hessian(p);
            for a in 0..3 {
                let d = DVec3::AXES[a] * h;
                let slope = (f.value(p + d) - f.value(p - d)) / (2.0 * h);
                assert!((slope - g[a]).abs() < 1e-5 * (1.0 + slope.abs()), "{text} at {p}: {slope} {}", g[a]);
                let bend = (f.gradient(p + d) - f.gradient(p - d)) / (2.0 * h);
                let scale = 1.0 + bend.length();
                assert!((bend - hessian.col(a)).length() < 1e-4 * scale, "{text} at {p}: {bend} {}", hessian.col(a));
            }
        }
    }
}

#[test]
fn bounds_contain_every_value() {
    for text in FORMULAS {
        let f = field(text);
        let mut tight = 0;
        for i in 0..40 {
            let center = point(i, 0.8);
            let radius = 0.15 * rng::unit(12, 0, i, 0);
            let Some((low, high)) = f.bound(center, radius) else { continue };
            tight += 1;
            for j in 0..50 {
                let p = center + point(1000 * i + j, radius).clamp_length_max(radius);
                let v = f.value(p);
                assert!(low <= v && v <= high, "{text} at {p}: {v} outside {low}..{high}");
            }
        }
        assert!(tight > 20, "{text}: only {tight} bounds");
    }
    assert_eq!(field("tanh(1/x)").bound(DVec3::ZERO, 1.0), None);
    assert_eq!(field("1/x").bound(DVec3::ZERO, 1.0), None);
    assert_eq!(field("sqrt(x - 9)").bound(DVec3::ZERO, 1.0), None);
}

#[test]
fn bad_formulas_are_refused_with_column_and_hint() {
    for (text, column, needle) in [
        ("", 1, "the end"),
        ("x +", 4, "the end"),
        ("2x", 2, "2*x"),
        ("x ** 2", 4, "^"),
        ("sine(x)", 1, "'sin'"),
        ("(x + 1", 7, "not closed"),
        ("x)", 2, "no bracket"),
        ("min(x)", 6, "2 arguments"),
        ("max(x, y, z)", 9, "nest"),
        ("sin x", 5, "'(' after sin"),
        ("1..2", 1, "1..2"),
        ("x < 1", 3, "comparisons"),
        ("ä + 1", 1, "variables"),
        ("1e999", 1, "finite"),
    ] {
        let error = ExpressionField::parse(text).unwrap_err();
        assert_eq!(error.column, column, "{text}: {error}");
        assert!(error.to_string().contains(needle), "{text}: {error}");
    }
    assert!(ExpressionField::parse(&"(".repeat(100_000)).is_err());
    assert!(ExpressionField::parse(&"-".repeat(60_000)).is_err());
    assert!(ExpressionField::parse(&"x^".repeat(20_000)).is_err());
    let deep = format!("{}x{}", "x+(".repeat(60), ")".repeat(60));
    assert!(ExpressionField::parse(&deep).unwrap_err().to_string().contains("wait"));
    assert!(ExpressionField::parse_with("x", &[("sin", 1.0)]).is_err());
    assert!(ExpressionField::parse_with("x", &[("a", f64::NAN)]).is_err());
}

fn sphere_params(opacity: f64) -> MeshParams {
    MeshParams { density: Density::Spacing(0.04), opacity, ..MeshParams::default() }
}

#[test]
fn an_implicit_sphere_has_the_area_and_the_normals_of_a_sphere() {
    let bounds = DAabb::new(DVec3::splat(-1.3), DVec3::splat(1.4));
    for text in ["x^2 + y^2 + z^2 - 1", "1 - 1/sqrt(x^2 + y^2 + z^2 + 1e-30)"] {
        let (cloud, report) = surface_to_points(&field(text), bounds, &sphere_params(0.5), None).unwrap();
        assert!((report.area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{text}: {}", report.area);
        for i in 0..cloud.len() {
            let p = cloud.position[i].as_dvec3() + cloud.origin;
            assert!((p.length() - 1.0).abs() < 1e-3 && cloud.normal[i].as_dvec3().dot(p) > 0.995, "{p}");
        }
        // Near-uniform: the largest share is at most h², the mean not far below.
        let h_sq = report.spacing * report.spacing;
        assert!(report.area / report.splats as f64 > 0.3 * h_sq);
    }
}

#[test]
fn a_surface_is_closed_across_blocks_and_stays_inside_the_box() {
    let bounds = DAabb::new(DVec3::splat(-1.3), DVec3::splat(1.4));
    let mesh = convert::field_to_mesh(&field("x^2+y^2+z^2-1"), bounds, 0.05, &SplatParams::default(), None).unwrap();
    let mut edges = std::collections::HashMap::new();
    for t in &mesh.triangles {
        for e in 0..3 {
            *edges.entry((t[e], t[(e + 1) % 3])).or_insert(0) += 1;
        }
    }
    assert!(edges.iter().all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1)));
    // Euler: V − E + F = 2.
    assert_eq!(mesh.position.len() + mesh.triangles.len() - edges.len() / 2, 2);
    let gyroid = field("sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)");
    let (cloud, _) =
        surface_to_points(&gyroid, DAabb::new(DVec3::ZERO, DVec3::splat(6.0)), &MeshParams::default(), None).unwrap();
    assert!(cloud.len() > 10_000);
    for p in cloud.position.iter().map(|p| p.as_dvec3() + cloud.origin) {
        assert!(p.min_element() > -0.1 && p.max_element() < 6.1 && gyroid.value(p).abs() < 1e-2);
    }
}

#[test]
fn a_splat_budget_is_met_within_a_factor() {
    let params = MeshParams { density: Density::Splats(20_000), ..MeshParams::default() };
    let bounds = DAabb::new(DVec3::splat(-1.3), DVec3::splat(1.4));
    let (cloud, _) = surface_to_points(&field("x^2 + y^2 + z^2 - 1"), bounds, &params, None).unwrap();
    assert!(cloud.len() > 10_000 && cloud.len() < 45_000, "{}", cloud.len());
}

#[test]
fn fields_that_are_not_finite_are_refused_with_the_point() {
    let params = DensityParams {
        volume: VolumeParams {
            splat: SplatParams { object_name: "fog".into(), ..SplatParams::default() },
            ..VolumeParams::default()
        },
        density: Density::Spacing(0.5),
        extinction: 1.0,
    };
    let bounds = DAabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let error = density_to_points(&field("ln(x)"), bounds, &params, None).unwrap_err();
    assert!(error.to_string().contains("[-0.75, -0.75, -0.75]"), "{error}");
    assert!(error.to_string().contains("fog"));
    assert!(matches!(
        surface_to_points(&field("sqrt(x) - 1"), bounds, &MeshParams::default(), None),
        Err(ConvertError::NonFinite { .. })
    ));
    let corners = [[DVec3::ONE, DVec3::ZERO], [DVec3::ZERO, DVec3::new(1.0, 1.0, f64::NAN)], [DVec3::ZERO, DVec3::X]];
    for bad in corners.map(|[min, max]| DAabb::new(min, max)) {
        assert!(density_to_points(&field("1"), bad, &params, None).is_err());
        assert!(surface_to_points(&field("x"), bad, &MeshParams::default(), None).is_err());
    }
}

#[test]
fn densities_integrate_to_their_closed_form() {
    // ∫∫∫ x over the unit cube is 1/2; the midpoint rule is exact for it. Negative densities count as nothing.
    let params = DensityParams { density: Density::Spacing(0.1), extinction: 4.0, ..DensityParams::default() };
    let (cloud, report) = density_to_points(&field("x"), DAabb::new(DVec3::ZERO, DVec3::ONE), &params, None).unwrap();
    let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    assert!((sum - 2.0).abs() < 1e-5, "{sum}");
    assert_eq!(report.splats, 1000);
    assert_eq!(density_to_points(&field("-1"), DAabb::new(DVec3::ZERO, DVec3::ONE), &params, None).unwrap().0.len(), 0);
}

#[test]
fn a_procedural_cloud_is_bounded_smooth_and_repeatable() {
    let shape = CloudShape::default();
    let splat = SplatParams::default();
    let grid = procedural_cloud(&shape, 0.08, &splat, None).unwrap();
    assert_eq!(grid, procedural_cloud(&shape, 0.08, &splat, None).unwrap());
    assert!(grid != procedural_cloud(&CloudShape { seed: 2, ..shape.clone() }, 0.08, &splat, None).unwrap());
    let [nx, ny, nz] = grid.dims;
    let at = |n: usize| [n % nx, n / nx % ny, n / nx / ny];
    let mut core = 0;
    let mut rim = 0;
    for (n, &v) in grid.values.iter().enumerate() {
        let [i, j, k] = at(n);
        let face = [i, j, k].contains(&0) || i + 1 == nx || j + 1 == ny || k + 1 == nz;
        assert!(!face || v == 0.0, "density on the face of the box");
        core += usize::from(v > 11.9);
        rim += usize::from(v > 0.0 && v <= 11.9);
    }
    assert!(core > 1000 && rim > 1000, "core {core} rim {rim}");
    // Nothing condenses below the base: hardly any matter lies under it.
    let below: f32 =
        grid.values.iter().enumerate().filter(|(n, _)| grid.position(0, at(*n)[1], 0).y < -0.1).map(|(_, v)| v).sum();
    assert!(below < 0.01 * grid.values.iter().sum::<f32>(), "{below}");
}

#[test]
fn turbulence_makes_a_cauliflower_not_a_blob() {
    let shape = CloudShape { base: None, ..CloudShape::default() };
    let smooth = CloudShape { amplitude: 0.0, ..shape.clone() };
    // Surface area over what the same volume needs as a ball: octaves must wrinkle the boundary.
    let wrinkles = |shape: &CloudShape| {
        let grid = procedural_cloud(shape, 0.05, &SplatParams::default(), None).unwrap();
        let inside = |i: isize, j: isize, k: isize| grid.at_clamped(i, j, k) > 6.0;
        let [nx, ny, nz] = grid.dims.map(|n| n as isize);
        let mut faces = 0.0f64;
        let mut volume = 0.0f64;
        for n in 0..nx * ny * nz {
            let i = n % nx;
            let j = n / nx % ny;
            let k = n / nx / ny;
            if inside(i, j, k) {
                volume += 1.0;
                for (di, dj, dk) in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)] {
                    faces += f64::from(u8::from(!inside(i + di, j + dj, k + dk)));
                }
            }
        }
        faces / volume.powf(2.0 / 3.0)
    };
    let rough = wrinkles(&shape);
    let plain = wrinkles(&smooth);
    assert!(rough > 1.2 * plain, "{rough} {plain}");
}

#[test]
fn impossible_clouds_are_refused() {
    let splat = SplatParams::default();
    let base = CloudShape::default;
    for shape in [
        CloudShape { ellipsoids: Vec::new(), ..base() },
        CloudShape { octaves: 0, ..base() },
        CloudShape { lacunarity: 1.0, ..base() },
        CloudShape { gain: f64::NAN, ..base() },
        CloudShape { frequency: 0.0, ..base() },
        CloudShape { extinction: -1.0, ..base() },
    ] {
        assert!(matches!(procedural_cloud(&shape, 0.1, &splat, None), Err(ConvertError::Parameter { .. })));
    }
    assert!(matches!(procedural_cloud(&base(), 1e-6, &splat, None), Err(ConvertError::Limit(_))));
}

#[test]
fn values_and_gradients_of_many_places_are_those_of_each() {
    let formulas = [
        "(sqrt(x^2 + y^2) - 0.7)^2 + z^2 - 0.09",
        "sin(3*x)*cos(y) + tan(z/2) + sinh(x*y) - cosh(z) + tanh(x - y)",
        "asin(x/2) + acos(y/2) + atan(z) + atan2(x, 2 + y) + exp(-z^2) + abs(x)",
        "ln(2 + x) + log10(3 + y) + log2(3 + z) + (2 + x)^y + (2 + x)^1.5 + x^-3",
        "min(x, max(y, z)) - (x + y)/(3 - z) + x^3 - y^5 + 2",
        "x + sqrt(0*y) + sqrt(z)",
        "((((((x + 1)*(y + (x*(y + z*(x - (y - (z*(x + y*(z - x)))))))))))))",
    ];
    for text in formulas {
        let field = ExpressionField::parse(text).unwrap();
        let at: Vec<DVec3> = (0..203u64)
            .map(|i| DVec3::from_array([0, 1, 2].map(|a| 1.9 * rng::unit(8, 0, i, a) - 0.95)))
            .chain([DVec3::ZERO, DVec3::NAN, DVec3::splat(1e200)])
            .collect();
        for n in [0, 1, 7, 8, 9, at.len()] {
            let mut found = vec![(0.0, DVec3::ZERO); n];
            field.value_gradients(&at[at.len() - n..], &mut found);
            for (p, (value, gradient)) in at[at.len() - n..].iter().zip(found) {
                let v = field.value(*p);
                let g = field.gradient(*p);
                let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-13 * b.abs();
                assert!(same(value, v), "{text} at {p}: {value} for {v}");
                assert!((0..3).all(|a| same(gradient[a], g[a])), "{text} at {p}: {gradient} for {g}");
                let (one_value, one_gradient) = field.value_gradient(*p);
                assert!(same(one_value, v) && (0..3).all(|a| same(one_gradient[a], g[a])), "{text} at {p}");
            }
        }
    }
}

/// Distances from a place on a lattice of 21 points along each axis.
fn distances(center: DVec3) -> Grid {
    let at = |n: usize| DVec3::new((n % 21) as f64, (n / 21 % 21) as f64, (n / 441) as f64);
    let values = (0..21 * 21 * 21).map(|n| at(n).distance(center) as f32).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [21; 3], values }
}

#[test]
fn a_ball_in_a_volume_becomes_the_mesh_of_a_ball() {
    let center = DVec3::splat(10.0);
    let grid = distances(center);
    let f = GridField::new(Arc::new(grid), Interpolation::CatmullRom, 6.5, Inside::Below).unwrap();
    let mesh = field_to_mesh(&f, f.bounds(), 0.7, &SplatParams::default(), None).unwrap();
    assert!(mesh.position.len() > 1000);
    for (p, n) in mesh.position.iter().zip(&mesh.normal) {
        let out = p.as_dvec3() + mesh.origin - center;
        // The interpolation error of a distance of curvature 1/6.5, not of the mesh.
        assert!((out.length() - 6.5).abs() < 2e-3, "{}", out.length());
        assert!(n.as_dvec3().dot(out.normalize()) > 0.999);
    }
}

/// Whole values at the isovalue put vertices onto lattice points: triangles without area become no splats.
#[test]
fn a_marched_volume_with_triangles_without_area_becomes_splats() {
    let mut grid = distances(DVec3::splat(10.0));
    grid.values.iter_mut().for_each(|value| *value = value.floor());
    let mesh = isosurface_to_mesh(&grid, 6.0, Inside::Below).unwrap();
    let (cloud, report) = mesh_to_points(&mesh, &MeshParams::default(), None).unwrap();
    assert!(cloud.len() as u64 == report.splats && report.splats > 1000);
    assert!(report.degenerate > 0, "{report:?}");
}
