//! A ball, a torus and a gyroid cut by the ball: as fields, as triangles, as occupancy of cells, and what a ray loses in them.

use super::{EXTINCTION, HEIGHT, OPACITY};

/// Radius of the ball.
pub(crate) const RADIUS: f64 = 0.9;
const MAJOR: f64 = 0.6;
const MINOR: f64 = 0.3;
/// Wave number of the gyroid.
const WAVE: f64 = 4.0;
/// Usual gradient of the gyroid's field at its surface.
const STEEPNESS: f64 = 1.2 * WAVE;

/// An object inside the box from −1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    Ball,
    Torus,
    Gyroid,
}

/// Which rays cross the shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rays {
    /// From pixels along −z.
    View,
    /// From pixels of the wall towards the light, along (0, 1, 1).
    Light,
}

type Point = [f64; 3];

impl Shape {
    /// Negative inside; about the distance to the surface.
    pub(crate) fn value(self, [x, y, z]: Point) -> f64 {
        match self {
            Self::Ball => (x * x + y * y + z * z).sqrt() - RADIUS,
            Self::Torus => (z * z + ((x * x + y * y).sqrt() - MAJOR).powi(2)).sqrt() - MINOR,
            Self::Gyroid => {
                let [u, v, w] = [x, y, z].map(|c| WAVE * c);
                let gyroid = u.sin() * v.cos() + v.sin() * w.cos() + w.sin() * u.cos();
                (gyroid / STEEPNESS).max(Self::Ball.value([x, y, z]))
            }
        }
    }

    /// [`Shape::value`] as a formula.
    pub(crate) fn formula(self) -> String {
        match self {
            Self::Ball => format!("sqrt(x^2 + y^2 + z^2) - {RADIUS}"),
            Self::Torus => format!("sqrt(z^2 + (sqrt(x^2 + y^2) - {MAJOR})^2) - {MINOR}"),
            Self::Gyroid => format!(
                "max((sin({WAVE}*x)*cos({WAVE}*y) + sin({WAVE}*y)*cos({WAVE}*z) + sin({WAVE}*z)*cos({WAVE}*x))\
                 /{STEEPNESS}, {})",
                Self::Ball.formula()
            ),
        }
    }

    /// Share of each cell of the box that lies inside, x fastest.
    pub(crate) fn occupancy(self, spacing: f64) -> Vec<f32> {
        const SUB: i32 = 4;
        let n = (2.0 / spacing).round() as i32;
        let mut cells = Vec::new();
        for k in 0..n * n * n {
            let index = [k % n, k / n % n, k / (n * n)];
            let mut inside = 0;
            for s in 0..SUB * SUB * SUB {
                let sub = [s % SUB, s / SUB % SUB, s / (SUB * SUB)];
                let at = |a: usize| -1.0 + spacing * (f64::from(index[a]) + (f64::from(sub[a]) + 0.5) / f64::from(SUB));
                inside += i32::from(self.value([at(0), at(1), at(2)]) < 0.0);
            }
            cells.push(inside as f32 / (SUB * SUB * SUB) as f32);
        }
        cells
    }

    /// Triangles of the surface inside the box: marching tetrahedra over cells of half the spacing, corners on the surface.
    pub(crate) fn triangles(self, spacing: f64) -> Vec<[Point; 3]> {
        let n = (2.0 / spacing).ceil() as i32;
        let at = |i: i32| -1.0 + 2.0 * f64::from(i) / f64::from(n);
        let mut triangles = Vec::new();
        for k in 0..n * n * n {
            let [x, y, z] = [k % n, k / n % n, k / (n * n)];
            let corner = |c: i32| [at(x + (c & 1)), at(y + (c >> 1 & 1)), at(z + (c >> 2))];
            // The six tetrahedra around the diagonal from corner 0 to corner 7.
            for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                self.tetrahedron([corner(0), corner(a), corner(b), corner(7)], &mut triangles);
            }
        }
        triangles
    }

    fn tetrahedron(self, corners: [Point; 4], triangles: &mut Vec<[Point; 3]>) {
        let (inside, outside): (Vec<Point>, Vec<Point>) = corners.into_iter().partition(|p| self.value(*p) < 0.0);
        let cut = |i: usize, o: usize| self.root(inside[i], outside[o]);
        match inside.len() {
            1 => triangles.push([cut(0, 0), cut(0, 1), cut(0, 2)]),
            2 => {
                triangles.push([cut(0, 0), cut(0, 1), cut(1, 0)]);
                triangles.push([cut(1, 0), cut(0, 1), cut(1, 1)]);
            }
            3 => triangles.push([cut(0, 0), cut(1, 0), cut(2, 0)]),
            _ => {}
        }
    }

    /// The point of the surface between one inside and one outside.
    fn root(self, mut inside: Point, mut outside: Point) -> Point {
        for _ in 0..40 {
            let middle = std::array::from_fn(|a| 0.5 * (inside[a] + outside[a]));
            *(if self.value(middle) < 0.0 { &mut inside } else { &mut outside }) = middle;
        }
        inside
    }

    /// Transmittance of every pixel, as the mean over 4 × 4 rays in it.
    pub(crate) fn transmittance(self, solid: bool, rays: Rays, size: u32) -> Vec<f64> {
        const SUB: u32 = 4;
        let at = |i: u32| ((f64::from(i) + 0.5) / f64::from(SUB * size) - 0.5) * HEIGHT;
        let mut image = vec![0.0; (size * size) as usize];
        for row in 0..SUB * size {
            for column in 0..SUB * size {
                let pixel = (row / SUB * size + column / SUB) as usize;
                image[pixel] += self.along(at(column), -at(row), solid, rays) / f64::from(SUB * SUB);
            }
        }
        image
    }

    /// Transmittance along the ray through (x, y) of the plane z = 0, or of the wall.
    fn along(self, x: f64, y: f64, solid: bool, rays: Rays) -> f64 {
        // Towards the light from the wall point (x, y): the shape's own frame has (y − s, −s) → a line through (x, y, 0).
        let (direction, length) = match rays {
            Rays::View => ([0.0, 0.0, 1.0], 1.0),
            Rays::Light => ([0.0, 1.0, 1.0], 2f64.sqrt()),
        };
        const STEPS: i32 = 200;
        let reach = if rays == Rays::View { 1.0 } else { 2.4 };
        let point = |t: f64| [x + t * direction[0], y + t * direction[1], t * direction[2]];
        let boxed = |p: Point| p.iter().all(|c| c.abs() <= 1.0);
        let mut inside = 0.0;
        let mut crossings = 0;
        let step = 2.0 * reach / f64::from(STEPS);
        let mut before: Option<f64> = None;
        for i in 0..=STEPS {
            let p = point(-reach + step * f64::from(i));
            let now = boxed(p).then(|| self.value(p));
            if let (Some(a), Some(b)) = (before, now) {
                let share = if (a < 0.0) == (b < 0.0) { f64::from(a < 0.0) } else { a.min(b) / (a.min(b) - a.max(b)) };
                inside += share * step * length;
                crossings += i32::from((a < 0.0) != (b < 0.0));
            }
            before = now;
        }
        if solid { (-EXTINCTION * inside).exp() } else { (1.0 - OPACITY).powi(crossings) }
    }
}
