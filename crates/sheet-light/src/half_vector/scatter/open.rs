//! Light that the media scatter into the open: the irradiance of a surface outside of them.
//!
//! Every cell is an emitter of the radiant intensity
//!
//! I(v) = V·[q(1 + 3g·s·v) + σ_s(φ + 3g·J·v)]/4π · T(v),
//!
//! q the power that the beam scatters there per volume, s the direction of the beam, and T the mean transmittance of the media from the cell out along v.
//! A surface with the normal n at a distance d in the direction v receives E = I(v)·(−v·n)/d². σ_s, g and T leave out the share that stays with the
//! beam, as the two streams do, and all power together is what leaves these. Intensities are known in 26 directions, to the neighbours of a cell, and are interpolated between them.
//!
//! Cells are merged into blocks, blocks into a pyramid: a place takes a node of it for the farther, the larger it is, and fades from a node to its
//! parts, so that no step shows where it changes over.

use super::grid::{GridPlace, LightGrid};
use super::medium::Cell;
use super::streams::optics;
use super::{FLUENCE, FLUX, NUMBERS};
use splat_core::glam::DVec3;
use std::f64::consts::PI;

/// Most blocks of cells: 324 bytes each, and as many exponentials.
const MOST_BLOCKS: usize = 1 << 14;

/// Distances of a node, in its own size, at which it begins to count for its parts and alone does so: a sphere of uniform radiance is exact at any.
const FADE: [f64; 2] = [1.5, 2.5];

/// Softening of a block's distance, in its own size: the root mean square of its places along an axis.
const SOFTENING: f64 = 0.289;

/// Directions in which the power of all cells is summed, and the angle from one to the next about an axis: a spiral of even density.
const SPHERE: usize = 1024;
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Directions to the neighbours of a block, itself among them, which counts for nothing.
const DIRECTIONS: usize = 27;

/// By direction and channel.
type Intensity = [[f32; 3]; DIRECTIONS];

/// The media as emitters, per unit of the light's intensity.
pub(super) struct Emitters {
    axes: [DVec3; 3],
    /// Sides of a block, world units.
    sides: [f64; 3],
    /// Blocks first, the root last.
    levels: Vec<Level>,
}

struct Level {
    counts: [usize; 3],
    /// Longest side of a node, world units.
    size: f64,
    nodes: Vec<Node>,
}

#[derive(Clone)]
struct Node {
    /// Mean place of what it emits.
    center: DVec3,
    /// Sum of all intensities, 0 for what is dark.
    weight: f64,
    intensity: Intensity,
}

const DARK: Node = Node { center: DVec3::ZERO, weight: 0.0, intensity: [[0.0; 3]; DIRECTIONS] };

/// What the media are made of, and what arrives there.
pub(super) struct Emission<'a> {
    pub(super) grid: &'a LightGrid,
    pub(super) cells: &'a [Cell],
    /// By face, neither weighed nor softened.
    pub(super) faces: &'a [[f32; NUMBERS]],
    /// By cell, power that the beam scatters, per volume and channel.
    pub(super) sources: &'a [[f64; 3]],
    /// Power that leaves the cells, by channel.
    pub(super) leaving: [f64; 3],
}

/// Sums over the cells of a block, by channel.
#[derive(Clone, Copy, Default)]
struct Sums {
    cells: f64,
    /// Of extinction.
    extinction: [f64; 3],
    /// Power to all sides, and its first moment.
    power: [f64; 3],
    moment: [DVec3; 3],
    /// Places by their power.
    place: DVec3,
}

/// A place that receives.
struct Receiver {
    world: DVec3,
    normal: DVec3,
}

/// Steps to the neighbour of a direction.
fn steps(direction: usize) -> [isize; 3] {
    [direction % 3, direction / 3 % 3, direction / 9].map(|n| n as isize - 1)
}

impl Emitters {
    /// `None` where nothing is scattered to all sides.
    pub(super) fn new(emission: &Emission<'_>) -> Option<Self> {
        let grid = emission.grid;
        let cell_counts = [grid.columns[0], grid.columns[1], grid.layers];
        let cell_sides = grid.sides(0.5 * grid.layers as f64);
        let merged = merged(cell_counts, cell_sides);
        let counts = [0, 1, 2].map(|a| cell_counts[a].div_ceil(merged[a]));
        let sums = sums(emission, merged, counts);
        if sums.iter().all(|sum| sum.power == [0.0; 3]) {
            return None;
        }
        let sides = [0, 1, 2].map(|a| cell_sides[a] * merged[a] as f64);
        let size = (0..3).map(|a| sides[a]).fold(0.0, f64::max);
        let mut out = Self { axes: grid.axes, sides, levels: Vec::new() };
        let nodes = out.blocks(&sums, counts);
        out.levels.push(Level { counts, size, nodes });
        while let Some(level) = out.levels.last().filter(|level| level.nodes.len() > 1) {
            let shrink = out.levels.len() as i32;
            let merged = level.merged();
            let longest = |a: usize| sides[a] * (libm::exp2(f64::from(shrink))).min(counts[a] as f64);
            let size = (0..3).map(longest).fold(0.0, f64::max);
            out.levels.push(Level { size, ..merged });
        }
        out.scale(emission.leaving);
        Some(out)
    }

    /// Scales all intensities to the power that leaves the cells in the two streams' balance.
    fn scale(&mut self, leaving: [f64; 3]) {
        let root = &self.levels[self.levels.len() - 1].nodes[0].intensity;
        let mut power = [0.0; 3];
        for n in 0..SPHERE {
            let z = 1.0 - (2.0 * n as f64 + 1.0) / SPHERE as f64;
            let (sin, cos) = libm::sincos(GOLDEN_ANGLE * n as f64);
            let across = libm::sqrt(1.0 - z * z);
            let towards = DVec3::new(across * cos, across * sin, z);
            let intensity = self.towards(root, towards);
            (0..3).for_each(|c| power[c] += intensity[c] * 4.0 * PI / SPHERE as f64);
        }
        let factor = [0, 1, 2].map(|c| if power[c] > 0.0 { leaving[c].max(0.0) / power[c] } else { 0.0 });
        for node in self.levels.iter_mut().flat_map(|level| &mut level.nodes) {
            node.intensity.iter_mut().for_each(|intensity| (0..3).for_each(|c| intensity[c] *= factor[c] as f32));
        }
    }

    /// Bytes of the nodes.
    pub(super) fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| size_of_val(level.nodes.as_slice()) as u64).sum()
    }

    /// Blocks that emit what leaves the media.
    fn blocks(&self, sums: &[Sums], counts: [usize; 3]) -> Vec<Node> {
        let mut nodes = vec![DARK; sums.len()];
        for direction in (0..DIRECTIONS).filter(|d| steps(*d) != [0; 3]) {
            let step = steps(direction);
            let way = (0..3).map(|a| self.axes[a] * (self.sides[a] * step[a] as f64)).sum::<DVec3>();
            let length = way.length();
            let towards = way.normalize();
            let mut passing = vec![[1.0; 3]; sums.len()];
            for node_index in ordered(counts, step) {
                let k = (node_index[2] * counts[1] + node_index[1]) * counts[0] + node_index[0];
                let next = [0, 1, 2].map(|a| node_index[a].wrapping_add_signed(step[a]));
                if (0..3).all(|a| next[a] < counts[a]) {
                    let next = (next[2] * counts[1] + next[1]) * counts[0] + next[0];
                    passing[k] = [0, 1, 2].map(|c| passing[next][c] * libm::exp(-sums[next].mean(c) * length));
                }
                for c in 0..3 {
                    let tau = sums[k].mean(c) * length;
                    // Mean over the block, whose places emit alike.
                    let out = if tau > 1e-6 { -libm::expm1(-tau) / tau } else { 1.0 };
                    let power = (sums[k].power[c] + sums[k].moment[c].dot(towards)).max(0.0);
                    nodes[k].intensity[direction][c] = (power * out * passing[k][c] / (4.0 * PI)) as f32;
                }
            }
        }
        for (node, sum) in nodes.iter_mut().zip(sums) {
            node.weight = node.intensity.iter().flatten().map(|v| f64::from(*v)).sum();
            let power: f64 = sum.power.iter().sum();
            node.center = if power > 0.0 { sum.place / power } else { DVec3::ZERO };
        }
        nodes
    }

    /// Irradiance of the side of a surface with this unit normal, by channel.
    pub(super) fn irradiance(&self, world: DVec3, normal: DVec3) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.add(self.levels.len() - 1, 0, 1.0, &Receiver { world, normal }, &mut sum);
        sum
    }

    /// Adds a share of a node.
    fn add(&self, level: usize, node: usize, share: f64, to: &Receiver, sum: &mut [f64; 3]) {
        let Level { counts, size, .. } = &self.levels[level];
        let from = &self.levels[level].nodes[node];
        if from.weight == 0.0 {
            return;
        }
        let way = to.world - from.center;
        let distance = way.length();
        let whole = ((distance / size - FADE[0]) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
        let whole = if level == 0 { 1.0 } else { whole * whole * (3.0 - 2.0 * whole) };
        let cosine = -way.dot(to.normal);
        if whole > 0.0 && cosine > 0.0 {
            let soft = distance * distance + if level == 0 { (SOFTENING * size).powi(2) } else { 0.0 };
            let factor = share * whole * cosine / (soft * libm::sqrt(soft));
            let intensity = self.towards(&from.intensity, way);
            (0..3).for_each(|c| sum[c] += factor * intensity[c]);
        }
        if whole == 1.0 {
            return;
        }
        let node_index = [node % counts[0], node / counts[0] % counts[1], node / (counts[0] * counts[1])];
        let below = self.levels[level - 1].counts;
        for part in 0..8 {
            let node_index = [0, 1, 2].map(|a| 2 * node_index[a] + (part >> a & 1));
            if (0..3).all(|a| node_index[a] < below[a]) {
                let node = (node_index[2] * below[1] + node_index[1]) * below[0] + node_index[0];
                self.add(level - 1, node, share * (1.0 - whole), to, sum);
            }
        }
    }

    /// Intensity towards a direction of any length: linear over the faces of the cube of neighbours.
    fn towards(&self, intensity: &Intensity, way: DVec3) -> [f64; 3] {
        let steps = [0, 1, 2].map(|a| self.axes[a].dot(way) / self.sides[a]);
        let most = steps.iter().fold(f64::MIN_POSITIVE, |most, v| v.abs().max(most));
        let place = steps.map(|v| v / most + 1.0);
        let low = place.map(|v| (v as usize).min(1));
        let mut out = [0.0; 3];
        for corner in 0..8 {
            let next = [0, 1, 2].map(|a| corner >> a & 1);
            let part = |a: usize| {
                if next[a] == 1 { place[a] - low[a] as f64 } else { 1.0 + low[a] as f64 - place[a] }
            };
            let weight = part(0) * part(1) * part(2);
            let direction = (0..3).rev().fold(0, |sum, a| 3 * sum + low[a] + next[a]);
            (0..3).for_each(|c| out[c] += weight * f64::from(intensity[direction][c]));
        }
        out
    }
}

impl Sums {
    /// Mean extinction of a channel, 1/world unit.
    fn mean(&self, channel: usize) -> f64 {
        self.extinction[channel] / self.cells
    }
}

impl Level {
    /// Two by two by two nodes in one.
    fn merged(&self) -> Self {
        let counts = self.counts.map(|n| n.div_ceil(2));
        let mut nodes = vec![DARK; counts.iter().product()];
        for (k, part) in self.nodes.iter().enumerate().filter(|(_, part)| part.weight > 0.0) {
            let node_index =
                [k % self.counts[0], k / self.counts[0] % self.counts[1], k / (self.counts[0] * self.counts[1])];
            let node = &mut nodes[(node_index[2] / 2 * counts[1] + node_index[1] / 2) * counts[0] + node_index[0] / 2];
            node.weight += part.weight;
            node.center += (part.center - node.center) * (part.weight / node.weight);
            for (to, from) in node.intensity.iter_mut().zip(&part.intensity) {
                (0..3).for_each(|c| to[c] += from[c]);
            }
        }
        Self { counts, size: 0.0, nodes }
    }
}

/// Cells of a block along each axis: blocks are about as deep as wide, and not too many.
fn merged(counts: [usize; 3], sides: [f64; 3]) -> [usize; 3] {
    let mut edge = sides.iter().copied().fold(0.0, f64::max);
    loop {
        let merged = sides.map(|side| libm::round(edge / side).max(1.0) as usize);
        if (0..3).map(|a| counts[a].div_ceil(merged[a])).product::<usize>() <= MOST_BLOCKS {
            return merged;
        }
        edge *= 1.1;
    }
}

/// Sums of the cells of all blocks.
fn sums(emission: &Emission<'_>, merged: [usize; 3], counts: [usize; 3]) -> Vec<Sums> {
    let Emission { grid, cells, faces, sources, .. } = *emission;
    let [width, height] = grid.columns;
    let layers = grid.layers;
    let mut out = vec![Sums::default(); counts.iter().product()];
    for (y, layer, x) in
        (0..height).flat_map(|y| (0..layers).flat_map(move |layer| (0..width).map(move |x| (y, layer, x))))
    {
        let node_index = (y * layers + layer) * width + x;
        let face = (y * (layers + 1) + layer) * width + x;
        let cell = &cells[node_index];
        let ends = [&faces[face], &faces[face + width]];
        let mean = |n: usize| 0.5 * f64::from(ends[0][n] + ends[1][n]);
        let place = grid.world(GridPlace { x: x as f64, y: y as f64, face: layer as f64 + 0.5 });
        let travel = grid.travel(place);
        let volume = grid.area(layer as f64 + 0.5) * grid.depth;
        let block = [x / merged[0], y / merged[1], layer / merged[2]];
        let sum = &mut out[(block[2] * counts[1] + block[1]) * counts[0] + block[0]];
        sum.cells += 1.0;
        for c in 0..3 {
            // Per length.
            let optics = optics(cell, c, 1.0);
            let scattering = optics.tau * optics.omega;
            let power = volume * (sources[node_index][c] + scattering * mean(FLUENCE + c));
            let flux: DVec3 = (0..3).map(|a| grid.axes[a] * mean(FLUX + 3 * a + c)).sum();
            sum.extinction[c] += optics.tau;
            sum.power[c] += power;
            sum.moment[c] += 3.0 * optics.asymmetry * volume * (travel * sources[node_index][c] + flux * scattering);
            sum.place += place * power;
        }
    }
    out
}

/// Places of a lattice, the neighbour in the direction of a step before a place itself.
fn ordered(counts: [usize; 3], step: [isize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let along = move |a: usize, n: usize| if step[a] > 0 { counts[a] - 1 - n } else { n };
    (0..counts[2]).flat_map(move |z| {
        (0..counts[1]).flat_map(move |y| (0..counts[0]).map(move |x| [along(0, x), along(1, y), along(2, z)]))
    })
}
