//! Small solids by tables: a mushroom, a dart, an aeroplane and a probe, as OFF text with colours. Nobody's models, so nobody's terms.
//!
//! Each part is drawn over ellipses that follow one another along a direction, as planks are laid over the ribs of a boat; bodies of revolution have circles.

use std::fmt::Write;

/// Corners of a rib.
const CORNERS: usize = 28;

type Vector = [f64; 3];

const X: Vector = [1.0, 0.0, 0.0];
const Y: Vector = [0.0, 1.0, 0.0];

/// Of a body of revolution: places on its axis with the radius there, and their colour.
type Piece<'a> = (&'a [(f64, f64)], [u8; 3]);

/// An ellipse across the direction of its part: its middle, one half-axis, and the length of the other.
struct Rib {
    at: Vector,
    half: Vector,
    other: f64,
    color: [u8; 3],
}

/// The parts of a solid so far: corners with colours of a display, and triangles.
#[derive(Default)]
struct Solid {
    corners: Vec<(Vector, [u8; 3])>,
    triangles: Vec<[usize; 3]>,
}

/// The files by name.
pub(super) fn files() -> [(&'static str, String); 4] {
    [
        ("mushroom.off", mushroom().off("A mushroom, 0.94 high, that stands on y = 0")),
        ("dart.off", dart().off("A dart, 1.63 long, that flies towards +x")),
        ("aeroplane.off", aeroplane().off("An aeroplane, 2 long, that flies towards +x with +y above")),
        ("probe.off", probe().off("A surgeon's probe, 1.4 long, whose tip at the origin points down")),
    ]
}

fn mushroom() -> Solid {
    let mut solid = Solid::default();
    let stem = [232, 222, 196];
    let gills = [214, 190, 150];
    let red = [172, 46, 30];
    let foot = [(0.0, 0.115), (0.02, 0.13), (0.1, 0.115), (0.3, 0.09), (0.5, 0.085), (0.66, 0.1)];
    let below = [(0.63, 0.08), (0.61, 0.2), (0.57, 0.35), (0.555, 0.41)];
    let above = [
        (0.557, 0.423),
        (0.59, 0.435),
        (0.66, 0.42),
        (0.75, 0.365),
        (0.83, 0.28),
        (0.89, 0.18),
        (0.93, 0.07),
        (0.937, 0.02),
    ];
    solid.turned(Y, [0.0; 3], &[(&foot, stem)]);
    solid.turned(Y, [0.0; 3], &[(&below, gills), (&above, red)]);
    solid
}

fn dart() -> Solid {
    let mut solid = Solid::default();
    let steel = [150, 155, 162];
    let brass = [196, 152, 62];
    let black = [38, 38, 44];
    let red = [188, 30, 36];
    solid.turned(X, [0.0; 3], &[(&[(0.6, 0.014), (0.95, 0.01), (1.0, 0.001)], steel)]);
    solid.turned(
        X,
        [0.0; 3],
        &[(&[(0.18, 0.018), (0.22, 0.036), (0.3, 0.042), (0.52, 0.042), (0.6, 0.032), (0.64, 0.014)], brass)],
    );
    solid.turned(X, [0.0; 3], &[(&[(-0.6, 0.006), (-0.56, 0.016), (0.0, 0.018), (0.2, 0.016)], black)]);
    for out in [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]] {
        solid.blade(
            out,
            [0.0; 3],
            &[
                (0.01, -0.43, 0.16, 0.006),
                (0.1, -0.47, 0.15, 0.005),
                (0.16, -0.53, 0.1, 0.004),
                (0.175, -0.55, 0.04, 0.002),
            ],
            red,
        );
    }
    solid
}

fn aeroplane() -> Solid {
    let mut solid = Solid::default();
    let white = [236, 238, 240];
    let grey = [196, 202, 210];
    let dark = [70, 74, 80];
    let red = [182, 36, 32];
    let hull = [
        (-1.0, 0.012),
        (-0.9, 0.035),
        (-0.65, 0.08),
        (-0.3, 0.112),
        (0.3, 0.12),
        (0.7, 0.115),
        (0.87, 0.09),
        (0.96, 0.05),
        (1.0, 0.012),
    ];
    solid.turned(X, [0.0; 3], &[(&hull, white)]);
    for side in [1.0, -1.0] {
        let out = [0.0, 0.09, side];
        solid.blade(
            out,
            [0.0, -0.05, 0.0],
            &[
                (0.0, 0.12, 0.26, 0.032),
                (0.4, -0.03, 0.17, 0.02),
                (1.0, -0.25, 0.08, 0.009),
                (1.04, -0.28, 0.03, 0.004),
            ],
            grey,
        );
        solid.blade(
            out,
            [0.0, 0.03, 0.0],
            &[(0.0, -0.84, 0.13, 0.016), (0.36, -0.97, 0.06, 0.007), (0.38, -0.98, 0.03, 0.003)],
            grey,
        );
        solid.turned(
            X,
            [0.1, -0.09, 0.4 * side],
            &[(&[(-0.2, 0.02), (-0.12, 0.045), (0.08, 0.055), (0.13, 0.05)], dark)],
        );
    }
    solid.blade(Y, [0.0; 3], &[(0.05, -0.8, 0.17, 0.014), (0.34, -0.98, 0.08, 0.008), (0.36, -0.99, 0.04, 0.003)], red);
    solid
}

fn probe() -> Solid {
    let mut solid = Solid::default();
    let steel = [176, 182, 188];
    let grip = [60, 110, 120];
    let dark = [46, 50, 56];
    let shaft = [(0.0, 0.002), (0.01, 0.009), (0.05, 0.013), (0.75, 0.013), (0.76, 0.02), (0.79, 0.02), (0.8, 0.028)];
    let rings = [0.84, 0.9, 0.96, 1.02, 1.08, 1.14];
    let ringed =
        rings.iter().flat_map(|y| [(y - 0.02, 0.046), (y + 0.02, 0.046), (y + 0.026, 0.04), (y + 0.034, 0.04)]);
    let handle: Vec<(f64, f64)> = ringed.collect();
    solid.turned(Y, [0.0; 3], &[(&shaft, steel), (&handle, grip), (&[(1.2, 0.04), (1.37, 0.03), (1.4, 0.012)], dark)]);
    solid
}

impl Solid {
    /// A body of revolution about an axis along `along`, in pieces of a colour each, so that what lies to the
    /// left of the way, radius to the right and axis up, is outside.
    fn turned(&mut self, along: Vector, from: Vector, pieces: &[Piece<'_>]) {
        let across = [along[2], along[0], along[1]];
        let rib = |&(place, radius): &(f64, f64), color| Rib {
            at: [0, 1, 2].map(|a| from[a] + along[a] * place),
            half: across.map(|v| v * radius),
            other: radius,
            color,
        };
        let ribs = pieces.iter().flat_map(|(profile, color)| profile.iter().map(|place| rib(place, *color)));
        self.drawn_over(along, &ribs.collect::<Vec<_>>());
    }

    /// A wing that reaches out from a place: (how far, its middle along x, half its length along x, half its thickness).
    fn blade(&mut self, out: Vector, from: Vector, ribs: &[(f64, f64, f64, f64)], color: [u8; 3]) {
        let rib = |&(far, x, half, other): &(f64, f64, f64, f64)| Rib {
            at: [0, 1, 2].map(|a| from[a] + out[a] * far + X[a] * x),
            half: [half, 0.0, 0.0],
            other,
            color,
        };
        self.drawn_over(out, &ribs.iter().map(rib).collect::<Vec<_>>());
    }

    /// A closed part over ribs that follow one another, as `along` leads at first.
    fn drawn_over(&mut self, along: Vector, ribs: &[Rib]) {
        let first = self.corners.len();
        for Rib { at, half, other, color } in ribs {
            let across = cross(along, *half);
            let length = across.iter().map(|v| v * v).sum::<f64>().sqrt();
            for corner in 0..CORNERS {
                let (sin, cos) = (std::f64::consts::TAU * corner as f64 / CORNERS as f64).sin_cos();
                let place = [0, 1, 2].map(|a| at[a] + half[a] * cos + across[a] / length * other * sin);
                self.corners.push((place, *color));
            }
        }
        let last = first + (ribs.len() - 1) * CORNERS;
        let start = self.corners.len();
        let end = self.corners.len() + 1;
        self.corners.extend([&ribs[0], &ribs[ribs.len() - 1]].map(|rib| (rib.at, rib.color)));
        for corner in 0..CORNERS {
            let next = (corner + 1) % CORNERS;
            for rib in (first..last).step_by(CORNERS) {
                let [a, b, c, d] = [rib + corner, rib + next, rib + CORNERS + next, rib + CORNERS + corner];
                self.triangles.extend([[a, b, c], [a, c, d]]);
            }
            self.triangles.extend([[start, first + next, first + corner], [end, last + corner, last + next]]);
        }
    }

    /// As OFF text.
    fn off(&self, what: &str) -> String {
        let mut out = format!(
            "COFF\n# {what}. Made for Organza; MIT OR Apache-2.0.\n{} {} 0\n",
            self.corners.len(),
            self.triangles.len()
        );
        for ([x, y, z], [r, g, b]) in &self.corners {
            let places = [x, y, z].map(|v| (v * 1e4).round() / 1e4 + 0.0);
            let _ = writeln!(out, "{} {} {} {r} {g} {b}", places[0], places[1], places[2]);
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(out, "3 {a} {b} {c}");
        }
        out
    }
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_are_what_the_tables_give() {
        for (name, text) in files() {
            let path = format!("{}/../assets/meshes/{name}", env!("CARGO_MANIFEST_DIR"));
            let found = std::fs::read_to_string(path).expect("an asset of the repository");
            assert!(found == text, "{name}: cargo xtask assets solids writes it");
        }
    }
}
