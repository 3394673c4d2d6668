//! What the tests share: small scenes, pictures, and tests of hypotheses with a stated level.

use pbsr::{Appearance, Ensemble, EnsembleParams, FoldParams, Object, Renderer, Sampler, Scene};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Camera, Material, Mesh, Projection, ScalarField, Shading, Similarity};

/// Looks along −Z from `distance` away from the origin.
pub(crate) fn camera(projection: Projection, distance: f64, size: [u32; 2]) -> Camera {
    Camera::look_at(DVec3::Z * distance, DVec3::ZERO, DVec3::Y, projection, size).unwrap()
}

/// Orthographic view of the square [−1, 1]² by n² pixels.
pub(crate) fn front(n: u32) -> Camera {
    camera(Projection::Orthographic { height: 2.0 }, 4.0, [n, n])
}

/// A rectangle a·(±1) + b·(±1) around `middle`, of `n`² × 2 triangles.
pub(crate) fn rectangle(middle: Vec3, a: Vec3, b: Vec3, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let at = |k: u32| 2.0 * k as f32 / n as f32 - 1.0;
            mesh.position.push(middle + a * at(i) + b * at(j));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let k = j * (n + 1) + i;
            mesh.triangles.push([k, k + 1, k + n + 2]);
            mesh.triangles.push([k, k + n + 2, k + n + 1]);
        }
    }
    mesh
}

/// Shown as it is.
pub(crate) fn unlit() -> Appearance {
    Appearance { material: Material { shading: Shading::Unlit, ..Material::default() }, ..Appearance::default() }
}

pub(crate) fn object(sampler: &dyn Sampler) -> Object<'_> {
    Object { sampler, transform: Similarity::default(), look: unlit() }
}

pub(crate) fn objects<'a>(samplers: &[&'a dyn Sampler]) -> Vec<Object<'a>> {
    samplers.iter().map(|s| object(*s)).collect()
}

pub(crate) fn scene<'a>(camera: &'a Camera, objects: &'a [Object<'a>]) -> Scene<'a> {
    Scene { objects, lights: &[], shadow_origin: DVec3::ZERO, ambient: [0.0; 3], camera, occluder: None }
}

pub(crate) fn fold(scene: &Scene<'_>, levels: u32) -> Ensemble {
    let mut ensemble = Ensemble::new(scene.camera.size, &EnsembleParams::default()).unwrap();
    fold_into(scene, &mut ensemble, levels);
    ensemble
}

pub(crate) fn fold_into(scene: &Scene<'_>, ensemble: &mut Ensemble, levels: u32) {
    Renderer::new().fold(scene, ensemble, &FoldParams { levels, ..FoldParams::default() }, None).unwrap();
}

pub(crate) fn render(camera: &Camera, samplers: &[&dyn Sampler], levels: u32) -> Ensemble {
    fold(&scene(camera, &objects(samplers)), levels)
}

/// Hits of all pixels.
pub(crate) fn all_hits(ensemble: &Ensemble) -> Vec<u32> {
    let [w, h] = ensemble.size();
    (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| ensemble.hits(x, y)).collect()
}

/// |z| that n independent standard normal numbers exceed with probability `p` (Šidák), two-sided.
pub(crate) fn sidak(p: f64, n: usize) -> f64 {
    let each = -((-p).ln_1p() / n as f64).exp_m1();
    // Quantile of the normal tail each/2 by bisection on its asymptotic series' integral.
    let tail = |z: f64| 0.5 * erfc(z / std::f64::consts::SQRT_2);
    let mut low = 0.0;
    let mut high = 12.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if tail(middle) > 0.5 * each { low = middle } else { high = middle }
    }
    high
}

/// Complementary error function, relative error below 1.2e-7 (Numerical Recipes).
pub(crate) fn erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let c = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let sum = c.iter().rev().fold(0.0, |s, c| s * t + c);
    let v = t * (-x * x + sum).exp();
    if x >= 0.0 { v } else { 2.0 - v }
}

/// What a one-off check found: the largest |z| of a pixel with its limit, and |z| of the whole image with its own, both at
/// p = 0.001.
#[derive(Debug)]
pub(crate) struct Bias {
    pub(crate) pixel: f64,
    pub(crate) pixel_limit: f64,
    pub(crate) image: f64,
    pub(crate) image_limit: f64,
    pub(crate) spread: f64,
    pub(crate) spread_limit: f64,
}

impl Bias {
    pub(crate) fn none(&self) -> bool {
        self.pixel < self.pixel_limit && self.image < self.image_limit && self.spread.abs() < self.spread_limit
    }
}

/// Hits of `levels` sets against the opacity of each pixel; pixels of expected opacity 0 or 1 must agree exactly.
/// `spread` is the normalised sum of z² − 1: sets that are not independent widen it.
pub(crate) fn bias(ensemble: &Ensemble, alpha: &dyn Fn(u32, u32) -> Option<f64>) -> Bias {
    let levels = f64::from(ensemble.levels());
    let [w, h] = ensemble.size();
    let mut worst = 0.0f64;
    let mut n = 0usize;
    let mut sum = 0.0;
    let mut variance = 0.0;
    let mut squares = 0.0;
    for y in 0..h {
        for x in 0..w {
            let Some(alpha) = alpha(x, y) else { continue };
            let hits = f64::from(ensemble.hits(x, y));
            if alpha == 0.0 || alpha == 1.0 {
                assert_eq!(hits, alpha * levels, "pixel {x} {y}");
                continue;
            }
            let v = levels * alpha * (1.0 - alpha);
            let z = (hits - levels * alpha) / v.sqrt();
            worst = worst.max(z.abs());
            squares += z * z - 1.0;
            sum += hits - levels * alpha;
            variance += v;
            n += 1;
        }
    }
    assert!(n > 0, "nothing compared");
    Bias {
        pixel: worst,
        // Binomial tails are a little wider than the normal's.
        pixel_limit: sidak(1e-3, n) + 0.25,
        image: (sum / f64::sqrt(variance)).abs(),
        image_limit: sidak(1e-3, 1),
        spread: squares / (2.0 * n as f64).sqrt(),
        spread_limit: 4.0,
    }
}

/// The 99.9 % point of χ² (Wilson and Hilferty).
pub(crate) fn chi2_limit(dof: f64) -> f64 {
    let h = 2.0 / (9.0 * dof);
    dof * (1.0 - h + 3.0902 * h.sqrt()).powi(3)
}

/// χ² of counts against equal expectations.
pub(crate) fn chi2_equal(counts: &[u64]) -> f64 {
    let expected = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    assert!(expected >= 5.0, "too few: {expected} a bin");
    counts.iter().map(|c| (*c as f64 - expected).powi(2) / expected).sum()
}

/// All positions of one set.
pub(crate) fn positions(sampler: &dyn Sampler, set: u64) -> Vec<DVec3> {
    let mut scratch = pbsr::Particles::default();
    let mut places = Vec::new();
    for c in 0..sampler.chunks() {
        let particles = sampler.chunk(set, c, &mut scratch);
        places.extend(particles.position.iter().map(|p| sampler.origin() + p.as_dvec3()));
    }
    places
}

/// scale · (|p − middle| − radius) and friends, with exact derivatives and bounds.
#[derive(Clone, Copy)]
pub(crate) enum Field {
    /// scale·(|p − c|² − r²).
    Sphere { middle: DVec3, radius: f64, scale: f64 },
    /// n·p − d.
    Plane { normal: DVec3, distance: f64 },
    /// (√(x² + y²) − R)² + z² − r².
    Torus { large: f64, small: f64 },
    /// x² + y² − z².
    Cone,
    /// (|p|² − 1)², a double root everywhere.
    Double,
    /// Two spheres, radius 0.3 at ±0.5 X and 0.6: the lesser of the two.
    Two { radius: [f64; 2], apart: f64 },
    /// x²/a² + y²/b² + z²/c² − 1.
    Ellipsoid { axes: DVec3 },
    /// z² − g²: two parallel sheets 2g apart.
    Sheets { gap: f64 },
    /// Positive everywhere.
    Nothing,
    /// Not a number in one half.
    Broken,
    /// The sphere without a bound.
    Unbounded,
    /// x: a ramp.
    Ramp,
    /// max(|x|, |y|, |z|) − 1/2: faces that meet in edges.
    Cube,
}

impl Field {
    pub(crate) const UNIT: Self = Self::Sphere { middle: DVec3::ZERO, radius: 1.0, scale: 1.0 };

    /// The nearer of the two spheres; of any other field itself.
    fn sphere_at(p: DVec3, field: &Field) -> Field {
        let Field::Two { radius, apart } = field else { return *field };
        let sphere = |k: usize| (DVec3::X * apart * [-1.0, 1.0][k], radius[k]);
        let value = |k: usize| (p - sphere(k).0).length() - sphere(k).1;
        let k = usize::from(value(1) < value(0));
        Field::Sphere { middle: sphere(k).0, radius: sphere(k).1, scale: 1.0 }
    }
}

impl ScalarField for Field {
    fn value(&self, p: DVec3) -> f64 {
        match self {
            Field::Sphere { middle, radius, scale } => scale * ((p - middle).length_squared() - radius * radius),
            Field::Plane { normal, distance } => normal.dot(p) - distance,
            Field::Torus { large, small } => (p.x.hypot(p.y) - large).powi(2) + p.z * p.z - small * small,
            Field::Cone => p.x * p.x + p.y * p.y - p.z * p.z,
            Field::Double => (p.length_squared() - 1.0).powi(2),
            Field::Two { .. } => Field::sphere_at(p, self).value(p),
            Field::Ellipsoid { axes } => (p / axes).length_squared() - 1.0,
            Field::Sheets { gap } => p.z * p.z - gap * gap,
            Field::Nothing => 1.0 + p.length_squared(),
            Field::Broken => {
                if p.x > 0.0 {
                    f64::NAN
                } else {
                    p.length_squared() - 1.0
                }
            }
            Field::Unbounded => p.length_squared() - 1.0,
            Field::Ramp => p.x,
            Field::Cube => p.abs().max_element() - 0.5,
        }
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        match self {
            Field::Sphere { middle, scale, .. } => 2.0 * scale * (p - middle),
            Field::Plane { normal, .. } => *normal,
            Field::Torus { large, .. } => {
                let r = p.x.hypot(p.y);
                let k = 2.0 * (r - large) / r;
                DVec3::new(k * p.x, k * p.y, 2.0 * p.z)
            }
            Field::Cone => 2.0 * DVec3::new(p.x, p.y, -p.z),
            Field::Double => 4.0 * (p.length_squared() - 1.0) * p,
            Field::Two { .. } => Field::sphere_at(p, self).gradient(p),
            Field::Ellipsoid { axes } => 2.0 * p / (axes * axes),
            Field::Sheets { .. } => DVec3::Z * 2.0 * p.z,
            Field::Nothing | Field::Broken | Field::Unbounded => 2.0 * p,
            Field::Ramp => DVec3::X,
            Field::Cube => {
                let axis = (0..3).max_by(|a, b| p[*a].abs().total_cmp(&p[*b].abs())).unwrap();
                DVec3::AXES[axis] * p[axis].signum()
            }
        }
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        match self {
            Field::Sphere { scale, .. } => DMat3::from_diagonal(DVec3::splat(2.0 * scale)),
            Field::Plane { .. } | Field::Ramp | Field::Cube => DMat3::ZERO,
            Field::Torus { large, .. } => {
                let r = p.x.hypot(p.y);
                let c = p.x / r;
                let s = p.y / r;
                // In polar axes the diagonal is (2, 2(1 − R/r), 2).
                let turn = 2.0 * (1.0 - large / r);
                let xy = (2.0 - turn) * c * s;
                DMat3::from_cols(
                    DVec3::new(2.0 * c * c + turn * s * s, xy, 0.0),
                    DVec3::new(xy, 2.0 * s * s + turn * c * c, 0.0),
                    DVec3::new(0.0, 0.0, 2.0),
                )
            }
            Field::Cone => DMat3::from_diagonal(DVec3::new(2.0, 2.0, -2.0)),
            Field::Double => {
                let outer = DMat3::from_cols(p * p.x, p * p.y, p * p.z);
                outer * 8.0 + DMat3::from_diagonal(DVec3::splat(4.0 * (p.length_squared() - 1.0)))
            }
            Field::Two { .. } => Field::sphere_at(p, self).hessian(p),
            Field::Ellipsoid { axes } => DMat3::from_diagonal(2.0 / (axes * axes)),
            Field::Sheets { .. } => DMat3::from_diagonal(DVec3::new(0.0, 0.0, 2.0)),
            Field::Nothing | Field::Broken | Field::Unbounded => DMat3::from_diagonal(DVec3::splat(2.0)),
        }
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        // r² over a ball around p at distance d from the origin.
        let squares = |d: f64| ((d - radius).max(0.0).powi(2), (d + radius).powi(2));
        let pad = |(a, b): (f64, f64)| {
            let e = 1e-12 * (a.abs() + b.abs());
            Some((a - e, b + e))
        };
        match self {
            Field::Sphere { middle, radius: r, scale } => {
                let (a, b) = squares((p - middle).length());
                pad((scale * (a - r * r), scale * (b - r * r)))
            }
            Field::Plane { normal, .. } => {
                let v = self.value(p);
                let k = normal.length() * radius;
                pad((v - k, v + k))
            }
            Field::Torus { large, small } => {
                let to_circle = (p.x.hypot(p.y) - large).hypot(p.z);
                let (a, b) = squares(to_circle);
                pad((a - small * small, b - small * small))
            }
            Field::Cone => {
                let (a, b) = squares(p.x.hypot(p.y));
                let (c, d) = squares(p.z.abs());
                pad((a - d, b - c))
            }
            Field::Double => {
                let (a, b) = squares(p.length());
                let a = a - 1.0;
                let b = b - 1.0;
                let low = if a <= 0.0 && b >= 0.0 { 0.0 } else { (a * a).min(b * b) };
                pad((low, (a * a).max(b * b)))
            }
            Field::Two { .. } => {
                // |p − c|² − r² of the nearer sphere, as a bound of both.
                let Field::Two { radius: r, apart } = self else { return None };
                let range = |k: usize| {
                    let (a, b) = squares((p - DVec3::X * apart * [-1.0, 1.0][k]).length());
                    (a - r[k] * r[k], b - r[k] * r[k])
                };
                let a = range(0);
                let b = range(1);
                pad((a.0.min(b.0), a.1.max(b.1)))
            }
            Field::Ellipsoid { axes } => {
                let d = (p / axes).length();
                let k = radius / axes.min_element();
                pad(((d - k).max(0.0).powi(2) - 1.0, (d + k).powi(2) - 1.0))
            }
            Field::Sheets { gap } => {
                let (a, b) = squares(p.z.abs());
                pad((a - gap * gap, b - gap * gap))
            }
            Field::Nothing => Some((1.0, f64::INFINITY)),
            Field::Broken | Field::Unbounded => None,
            Field::Ramp => Some((p.x - radius, p.x + radius)),
            Field::Cube => pad((self.value(p) - radius, self.value(p) + radius)),
        }
    }
}
