//! A tree in autumn, its meadow, a hedge and the first snow: points that carry all that a point can, and the small pictures that they show. By
//! formula, with sums, products and roots alone, so that every machine writes the same bytes.

use super::png;
use std::fmt::Write as _;

/// Pixels along the longer side of a picture.
const SIDE: usize = 64;
/// Places along a side of a pixel at which a shape is asked.
const PLACES: usize = 4;

/// Footprints of the scene: a formula, then the pictures in the order of their names.
const BLADE: u8 = 1;
const FLAKE: u8 = 2;
const LEAF: u8 = 3;
const MAPLE: u8 = 4;

const LEAVES: usize = 2600;
const FALLEN: usize = 260;
const BLADES: usize = 2600;
const FLAKES: usize = 420;
const HEDGE: [usize; 2] = [44, 100];

/// Share of a disc's radius that its file states.
const HIDES: f64 = 0.45;

type Vector = [f64; 3];

/// The files with their names.
pub(super) fn files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("footprints/blade.png", picture(SIDE / 4, is_blade)),
        ("footprints/flake.png", picture(SIDE, is_flake)),
        ("footprints/leaf.png", picture(SIDE / 2, is_leaf)),
        ("footprints/maple.png", picture(SIDE, is_maple)),
        ("points/meadow.csv", csv().into_bytes()),
        ("points/hedge.csv", hedge().into_bytes()),
    ]
}

/// A shape of `width` pixels by its places, −1 to 1 to the right and upwards.
fn picture(width: usize, is_in: fn(f64, f64) -> bool) -> Vec<u8> {
    let at = |k: usize, n: usize| 2.0 * (k as f64 + 0.5) / (n * PLACES) as f64 - 1.0;
    let covered = |x: usize, y: usize| {
        let places = (0..PLACES * PLACES).map(|k| [x * PLACES + k % PLACES, y * PLACES + k / PLACES]);
        let inside = places.filter(|[i, j]| is_in(at(*i, width), -at(*j, SIDE))).count();
        (inside * 255 / (PLACES * PLACES)) as u8
    };
    let pixels: Vec<u8> = (0..SIDE).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| covered(x, y)).collect();
    png::grey(width, &pixels)
}

/// Grass, bent to the right, pointed.
fn is_blade(x: f64, y: f64) -> bool {
    let up = 0.5 + 0.5 * y;
    let middle = -0.45 + 0.95 * up * up;
    (x - middle).abs() < 0.42 * (1.0 - up * up) + 0.02
}

/// A leaf with its stem below, broadest below the middle.
fn is_leaf(x: f64, y: f64) -> bool {
    let up = (y + 0.72) / 1.7;
    let blade = (0.0..=1.0).contains(&up) && x.abs() < 2.35 * up.sqrt() * (1.0 - up) * (1.0 - 0.25 * up);
    blade || x.abs() < 0.07 && y < -0.6
}

/// Five lobes about a place low in the middle, and a stem.
fn is_maple(x: f64, y: f64) -> bool {
    const LOBES: [([f64; 2], f64); 5] = [
        ([0.0, 1.0], 1.25),
        ([0.78, 0.63], 1.05),
        ([-0.78, 0.63], 1.05),
        ([0.99, -0.14], 0.72),
        ([-0.99, -0.14], 0.72),
    ];
    let y = y + 0.3;
    let lobe = |(d, length): &([f64; 2], f64)| {
        let along = (x * d[0] + y * d[1]) / length;
        let across = (x * d[1] - y * d[0]) / length;
        (0.0..1.0).contains(&along) && across.abs() < 0.30 * (1.0 - along) * (0.55 + 1.9 * along)
    };
    LOBES.iter().any(lobe) || x * x + y * y < 0.05 || x.abs() < 0.035 && (-0.7..0.0).contains(&y)
}

/// Six arms with two pairs of side arms each.
fn is_flake(x: f64, y: f64) -> bool {
    let half_root_3 = 0.75f64.sqrt();
    let arms = [[1.0, 0.0], [0.5, half_root_3], [-0.5, half_root_3]];
    let is_arm = |d: [f64; 2]| {
        let along = (x * d[0] + y * d[1]).abs();
        let across = (x * d[1] - y * d[0]).abs();
        let side = |at: f64, length: f64| {
            // Along a direction of 60° to the arm.
            let u = along - at;
            let v = across;
            let on = 0.5 * u + half_root_3 * v;
            let off = (half_root_3 * u - 0.5 * v).abs();
            (0.0..length).contains(&on) && off < 0.06
        };
        along < 0.97 && across < 0.075 || side(0.4, 0.42) || side(0.66, 0.26)
    };
    arms.into_iter().any(is_arm) || x * x + y * y < 0.05
}

/// Numbers from 0 to 1 that follow one another (Steele et al. 2014, SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A unit vector.
    fn direction(&mut self) -> Vector {
        loop {
            let v = [0; 3].map(|_| self.between(-1.0, 1.0));
            let square = dot(v, v);
            if square > 0.01 && square < 1.0 {
                return unit(v);
            }
        }
    }
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: Vector) -> Vector {
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

fn sum(a: Vector, b: Vector, by: f64) -> Vector {
    [a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2]]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// One point: its disc faces `normal`, and the top of its picture points as nearly to `top` as it can.
struct Point {
    at: Vector,
    normal: Vector,
    top: Vector,
    radius: f64,
    footprint: u8,
    opacity: f64,
    color: Vector,
}

/// The text of the points of a hedge, which say nothing of footprints and of how they lie: leaves on the front of rounded bushes.
fn hedge() -> String {
    let mut text = "x,y,z,nx,ny,nz,radius,red,green,blue\n".to_owned();
    let mut numbers = Numbers(5);
    for k in 0..HEDGE[0] {
        let middle = [0.24 * (k as f64 - 21.5), numbers.between(0.4, 0.75), numbers.between(-3.4, -3.1)];
        let size = numbers.between(0.36, 0.5);
        let light = numbers.between(0.8, 1.1);
        for _ in 0..HEDGE[1] {
            let out = unit(sum(numbers.direction(), [0.0, 0.3, 0.8], 1.0));
            let [x, y, z] = sum(middle, out, size * numbers.between(0.85, 1.08));
            let [nx, ny, nz] = unit(sum(sum(out, numbers.direction(), 0.7), [0.0, 1.0, 0.3], 0.4));
            let radius = HIDES * numbers.between(0.075, 0.11);
            let shade = light * numbers.between(0.75, 1.15);
            let young = numbers.next();
            let color = [0.2 + 0.16 * young * young, 0.38 + 0.12 * young, 0.16].map(|c| (c * shade * 255.0) as u8);
            let [r, g, b] = color;
            let y = y.max(0.02);
            let _ = writeln!(text, "{x:.3},{y:.3},{z:.3},{nx:.2},{ny:.2},{nz:.2},{radius:.3},{r},{g},{b}");
        }
    }
    text
}

/// The text of the points.
fn csv() -> String {
    let mut text = "x,y,z,nx,ny,nz,tx,ty,tz,radius,footprint,opacity,red,green,blue\n".to_owned();
    let mut numbers = Numbers(11);
    let mut write = |p: &Point| {
        let radius = p.radius * HIDES;
        let right = unit(cross(p.top, p.normal)).map(|c| c * radius);
        let mut words = |v: Vector, digits: usize| v.iter().for_each(|v| _ = write!(text, "{v:.digits$},"));
        words(p.at, 3);
        words(p.normal, 2);
        words(right, 4);
        let [r, g, b] = p.color.map(|c| (c * 255.0) as u8);
        let _ = writeln!(text, "{radius:.4},{},{},{r},{g},{b}", p.footprint, p.opacity);
    };
    (0..LEAVES).for_each(|_| write(&leaf(&mut numbers)));
    (0..FALLEN).for_each(|_| write(&fallen(&mut numbers)));
    (0..BLADES).for_each(|_| write(&blade(&mut numbers)));
    (0..FLAKES).for_each(|_| write(&flake(&mut numbers)));
    text
}

/// Middles and radii of the balls that the crown is made of.
const CROWN: [(Vector, f64); 7] = [
    ([0.0, 2.35, 0.0], 0.62),
    ([-0.55, 1.95, 0.1], 0.52),
    ([0.55, 2.0, 0.05], 0.54),
    ([-0.25, 1.75, 0.45], 0.45),
    ([0.3, 1.7, 0.4], 0.44),
    ([-0.3, 2.6, -0.25], 0.45),
    ([0.3, 2.7, -0.1], 0.42),
];

/// Of the colours of autumn one, from green by yellow to red.
fn autumn(numbers: &mut Numbers, share: f64) -> Vector {
    const COLORS: [Vector; 4] = [[0.42, 0.52, 0.14], [0.86, 0.68, 0.14], [0.88, 0.42, 0.1], [0.72, 0.17, 0.1]];
    let at = (share + numbers.between(-0.18, 0.18)).clamp(0.0, 0.999) * 3.0;
    let k = at as usize;
    let light = numbers.between(0.8, 1.08);
    let mix = |c: usize| COLORS[k][c] + (at - k as f64) * (COLORS[k + 1][c] - COLORS[k][c]);
    [0, 1, 2].map(|c| (mix(c) * light).min(1.0))
}

/// Near the surface of a ball of the crown, its tip outwards and down.
fn leaf(numbers: &mut Numbers) -> Point {
    let (middle, size) = CROWN[(numbers.next() * 7.0) as usize];
    let out = numbers.direction();
    let at = sum(middle, out, size * numbers.between(0.55, 1.05));
    let normal = unit(sum(sum(out, numbers.direction(), 0.75), [0.0, 1.0, 0.0], 0.5));
    let top = unit(sum(sum(out, numbers.direction(), 0.6), [0.0, -1.0, 0.0], 0.7));
    let share = 0.45 - 0.4 * (at[1] - 2.1) + 0.25 * at[0];
    let color = autumn(numbers, share);
    let footprint = if numbers.next() < 0.72 { LEAF } else { MAPLE };
    Point { at, normal, top, radius: numbers.between(0.055, 0.085), footprint, opacity: 1.0, color }
}

/// On the ground about the trunk.
fn fallen(numbers: &mut Numbers) -> Point {
    let x = numbers.between(-1.0, 1.0);
    let z = numbers.between(-1.0, 1.0);
    let away = 1.6 * (x * x + z * z).sqrt();
    let at = [x * away, 0.03, z * away * 0.8];
    let normal = unit(sum([0.0, 1.6, 0.35], numbers.direction(), 0.6));
    let share = numbers.between(0.3, 1.0);
    let color = autumn(numbers, share);
    let footprint = if numbers.next() < 0.5 { LEAF } else { MAPLE };
    Point { at, normal, top: numbers.direction(), radius: numbers.between(0.05, 0.075), footprint, opacity: 1.0, color }
}

/// Upright, facing about where it is looked at from, a little tilted.
fn blade(numbers: &mut Numbers) -> Point {
    let radius = numbers.between(0.05, 0.13);
    let x = numbers.between(-3.3, 3.3);
    let z = numbers.between(-2.6, 2.3);
    let side = if numbers.next() < 0.5 { 1.0 } else { -1.0 };
    let normal = unit([numbers.between(-0.8, 0.8), numbers.between(-0.25, 0.15), side]);
    let top = unit([numbers.between(-0.3, 0.3), 1.0, numbers.between(-0.2, 0.2)]);
    let dry = numbers.next();
    let color = [0.2 + 0.36 * dry * dry, 0.4 + 0.16 * dry * dry, 0.1 + 0.06 * dry];
    Point { at: [x, 0.95 * radius, z], normal, top, radius, footprint: BLADE, opacity: 1.0, color }
}

/// Anywhere in the air, turned anyhow; translucent.
fn flake(numbers: &mut Numbers) -> Point {
    let at = [numbers.between(-2.6, 2.6), numbers.between(0.05, 3.6), numbers.between(-1.5, 2.6)];
    let normal = unit(sum([0.0, 0.25, 1.3], numbers.direction(), 0.8));
    let top = numbers.direction();
    let radius = numbers.between(0.018, 0.042);
    Point { at, normal, top, radius, footprint: FLAKE, opacity: 0.9, color: [0.95, 0.97, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_in_the_assets_are_these() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
        for (name, bytes) in files() {
            assert!(std::fs::read(folder.join(name)).expect("an asset") == bytes, "{name}");
        }
    }
}
