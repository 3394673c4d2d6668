//! Sampling of implicit surfaces by random lines (Cauchy and Crofton): hundreds of times faster than a walk on them.
//!
//! Each cube of the box that may hold a piece of the surface has lines of its own, a Poisson number of them, as many as
//! the wanted number of crossings on a unit of area, λ = τ/s, asks for.
//!
//! - Where the surface is the graph of a function over one face of the cube (`leaves.rs`), lines are parallel to an axis k
//!   and uniform on the face a²: w·λ·a² of them. They meet a piece of area A and normal n in w·λ·A·|n_k| places, of which
//!   the share 1/(w·|n_k|) is kept, with w the largest 1/|n_k| of the cube: λ·A, whatever its place and direction. Each
//!   line has one crossing, so crossings are independent.
//! - In other cubes lines are uniform in the ball of radius r around the cube: a uniform direction, and a uniform point of
//!   the disc across it. A flat piece of area A is met with probability A/(2πr²) (the mean of |cos| over directions is 1/2),
//!   so 2πr²·λ lines put λ·A crossings on it; all roots in the cube are isolated (`roots.rs`) and all count.
//!
//! Crossings of a flat piece are Poisson with mean λ·s/cos θ behind a pixel of area s, so
//!
//! α(θ) = 1 − e^(−τ/cos θ), τ = −ln(1 − α)
//!
//! which is Tanaka 2012, Eq. 1, for n → ∞ at fixed n·s/S. The number of crossings is random. A cut to a fixed n would thin
//! sets with many crossings, and α would depend on the rest of the surface.
//!
//! Pieces may be missed if the field has no bound, or has folds finer than the samples of a cube.
//! [`LineReport`] counts the lines of a sample that gain roots when they are searched 16 times as finely, and the surface
//! that a sample of lines meets in cubes that were taken for empty.

use crate::blocks::Blocks;
use crate::error::check;
use crate::particles::Steps;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{Stage, Stream, across, unit_or_zero};
use crate::surfaces::implicit::{CellCounts, Cells, ImplicitSurface};
use crate::surfaces::leaves::{Empty, Graph, Leaf};
use crate::surfaces::roots::{Found, Line};
use crate::{Density, Error, PackedNormal, Particles, SurfaceParams};
use glam::DVec3;
use rayon::prelude::*;
use splat_core::glam;
use splat_core::optics::SurfaceOpacity;
use std::f64::consts::TAU;

/// Lines of the survey, and of that of cubes taken for empty.
const SURVEY_LINES: u32 = 8192;
const STRAY_LINES: u32 = 4096;

/// Crossings that are evaluated at once.
const BATCH: usize = 128;

/// The survey of a surface's roots.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineReport {
    /// Cells of the box.
    pub cells: CellCounts,
    /// Cubes after the division of cells.
    pub leaves: u64,
    /// Of them, those in which the surface is a graph over a face.
    pub graphs: u64,
    /// Lines of the survey, and the roots on them.
    pub lines: u64,
    /// Roots on the lines of the survey.
    pub roots: u64,
    /// Roots on the same lines, 16 times as finely looked at.
    pub fine_roots: u64,
    /// Pieces of these lines that may hide a pair of roots.
    pub unproven: u64,
    /// Pieces of these lines on which the field was not finite.
    pub broken: u64,
    /// Area of the surface, world units², estimated from the roots.
    pub area: f64,
    /// Area of its pieces in cubes that were taken for empty, where a survey of those met some.
    pub stray_area: f64,
}

impl LineReport {
    /// Share of missed roots, estimated by the survey: the relative bias of the optical depth.
    pub fn missed(&self) -> f64 {
        let unseen = self.fine_roots.saturating_sub(self.roots) as f64 / self.fine_roots.max(1) as f64;
        unseen + self.stray_area / (self.area + self.stray_area).max(f64::MIN_POSITIVE)
    }

    /// Warnings about questions that the survey could not settle, in words.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let broken = (self.broken > 0)
            .then(|| format!("its field is not finite on {} pieces of {} lines", self.broken, self.lines));
        let percent = 100.0 * self.missed();
        let missed = (self.missed() > MISSED)
            .then(|| format!("lines miss {percent:.2} % of its surface, which has no bound or a fine fold"));
        broken.into_iter().chain(missed)
    }
}

/// Share of the roots of a surface that may be missed before it is said.
const MISSED: f64 = 1e-3;

/// Parameters of the search for an implicit surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineParams {
    /// Cells along the longest side of the surface's box, 1 to 1024; those in which it bends much are divided.
    pub resolution: u32,
}

impl Default for LineParams {
    fn default() -> Self {
        Self { resolution: 24 }
    }
}

impl LineParams {
    /// A cell for every two samples `spacing` apart that show a surface, whose box is `width` long: 16 to 96 of them.
    pub fn for_spacing(width: f64, spacing: f64) -> Self {
        Self { resolution: (0.5 * width / spacing).clamp(16.0, 96.0).ceil() as u32 }
    }
}

/// Particles on an implicit surface, by random lines.
pub struct LineSampler<'a> {
    surface: ImplicitSurface<'a>,
    params: SurfaceParams,
    density: Option<Density<'a>>,
    leaves: Vec<Leaf>,
    /// Sums of [`Leaf::reach`] up to each leaf.
    reaches: Vec<f64>,
    sets: PoissonSets,
    report: LineReport,
}

impl<'a> LineSampler<'a> {
    /// Finds the cells that hold the surface, divides those in which it bends much, and surveys its roots.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Field`] where the field is not finite, [`Error::Empty`] when
    /// no line of the survey meets the surface, [`Error::Limit`] for more than 4·10⁹ lines a set.
    pub fn new(
        surface: &ImplicitSurface<'a>,
        lines: &LineParams,
        params: &SurfaceParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        let resolution = lines.resolution;
        params.validate()?;
        surface.validate()?;
        density.as_ref().map_or(Ok(()), Density::validate)?;
        check((1..=1024).contains(&resolution), "resolution", resolution, "1 to 1024 cells")?;
        let cells = Cells::new(surface, resolution);
        let empty = |reason| Error::Empty { what: "an implicit surface", reason };
        let origin = cells.middle().ok_or(empty("the field's bound excludes the level in the whole box"))?;
        // A density factor multiplies optical depth.
        let per_area = params.particles_per_area() * density.as_ref().map_or(1.0, |d| d.max);
        let (leaves, empty_cubes) = Leaf::subdivide(surface, &cells, per_area);
        let blocks = Blocks::new(leaves.len(), |l| leaves[l].reach() * per_area)?;
        let mut sum = 0.0;
        let reaches: Vec<f64> = leaves.iter().map(|l| (sum += l.reach(), sum).1).collect();
        let sets = PoissonSets::new(origin, params.cross_section, blocks);
        let report = LineReport {
            cells: cells.counts,
            leaves: leaves.len() as u64,
            graphs: leaves.iter().filter(|l| l.graph.is_some()).count() as u64,
            ..LineReport::default()
        };
        let mut sampler = Self { surface: *surface, params: *params, density, leaves, reaches, sets, report };
        sampler.survey();
        sampler.report.stray_area = sampler.strays(&empty_cubes);
        if sampler.report.roots == 0 {
            let broken = sampler.report.broken > 0;
            let reason = if broken { "the field is not finite there" } else { "no line of the survey meets it" };
            return Err(empty(reason));
        }
        sampler.sets.share = sampler.report.area / sampler.reach();
        Ok(sampler)
    }

    /// The survey of the roots.
    pub fn report(&self) -> &LineReport {
        &self.report
    }

    /// Mean number of lines of a set, M.
    pub fn lines(&self) -> f64 {
        self.sets.blocks.total()
    }

    /// Bytes that the search for a rough surface, such as one through scattered points, and its tables take at most; smooth ones take a tenth and
    /// less.
    pub const MOST_BYTES: u64 = Leaf::MOST_BYTES as u64;

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        (self.leaves.len() * (size_of::<Leaf>() + 8)) as u64 + self.sets.blocks.bytes()
    }

    /// The sum of all leaves' reaches.
    fn reach(&self) -> f64 {
        self.reaches.last().copied().unwrap_or(0.0)
    }

    /// The leaf at a share of all lines in (0, 1).
    fn leaf_at(&self, share: f64) -> &Leaf {
        let at = self.reaches.partition_point(|r| *r < share * self.reach());
        &self.leaves[at.min(self.leaves.len() - 1)]
    }

    /// Fills the report: lines at even shares of all, so that each part of the surface has its own.
    fn survey(&mut self) {
        let line_counts = |i: u32| {
            let mut stream = Stream::new(self.params.seed, Stage::Survey, 0, u64::from(i));
            let leaf = self.leaf_at((f64::from(i) + stream.unit()) / f64::from(SURVEY_LINES));
            let mut fine = Found::default();
            let (line, roots, area) = match &leaf.graph {
                Some(graph) => {
                    let [u, v, _] = stream.triple();
                    let root = leaf.start(graph, [u, v]).and_then(|p| self.root(leaf, graph, p));
                    let root = root.filter(|(p, _)| self.surface.contains(*p));
                    let [a, b] = leaf.ends(graph, [u, v]);
                    let d = (b - a) / leaf.side;
                    let line = Line { surface: self.surface, o: a, d, steepest: f64::INFINITY };
                    let area = root.map_or(0.0, |(_, g)| g.length() / f64::from(graph.weight));
                    (line, u64::from(root.is_some()), area)
                }
                None => {
                    let line = self.line(leaf, &mut stream);
                    self.search(leaf, &line, 1, &mut fine);
                    let roots = self.inside(&line, &fine);
                    (line, roots, roots as f64)
                }
            };
            let unproven = fine.unproven;
            fine.roots.clear();
            self.search(leaf, &line, 16, &mut fine);
            ([roots, self.inside(&line, &fine), unproven, fine.broken], area)
        };
        let surveyed: Vec<([u64; 4], f64)> =
            (0..SURVEY_LINES).into_par_iter().with_min_len(64).map(line_counts).collect();
        let count = |k: usize| surveyed.iter().map(|(n, _)| n[k]).sum();
        self.report = LineReport {
            lines: u64::from(SURVEY_LINES),
            roots: count(0),
            fine_roots: count(1),
            unproven: count(2),
            broken: count(3),
            area: surveyed.iter().map(|(_, area)| area).sum::<f64>() / f64::from(SURVEY_LINES) * self.reach(),
            ..self.report
        };
        // What is missed has an area too.
        self.report.area *= self.report.fine_roots.max(self.report.roots) as f64 / self.report.roots.max(1) as f64;
    }

    /// Area in cubes that were taken for empty, as lines meet it that are spread evenly over them.
    fn strays(&self, empty: &[Empty]) -> f64 {
        let reach = |side| Leaf::open(DVec3::ZERO, side).reach();
        let sum: f64 = empty.iter().map(|level| level.corners.len() as f64 * reach(level.side)).sum();
        let line_roots = |i: u32| {
            let mut stream = Stream::new(self.params.seed, Stage::Survey, 1, u64::from(i));
            let mut share = sum * (f64::from(i) + stream.unit()) / f64::from(STRAY_LINES);
            for Empty { corners, side } in empty {
                if let Some(corner) = corners.get((share / reach(*side)) as usize) {
                    let leaf = Leaf::open(*corner, *side);
                    let line = self.line(&leaf, &mut stream);
                    let mut found = Found::default();
                    self.search(&leaf, &line, 16, &mut found);
                    return self.inside(&line, &found);
                }
                share -= corners.len() as f64 * reach(*side);
            }
            0
        };
        let lines = if sum > 0.0 { STRAY_LINES } else { 0 };
        let roots: u64 = (0..lines).into_par_iter().with_min_len(64).map(line_roots).sum();
        roots as f64 / f64::from(STRAY_LINES) * sum
    }

    /// Roots of a line that count.
    fn inside(&self, line: &Line<'_>, found: &Found) -> u64 {
        found.roots.iter().filter(|(t, _)| self.surface.contains(line.o + line.d * *t)).count() as u64
    }

    /// The root on the line of a graph that begins at `p`, and ∇f/|f_k| there.
    fn root(&self, leaf: &Leaf, graph: &Graph, p: DVec3) -> Option<(DVec3, DVec3)> {
        let (f, gradient) = self.surface.field.value_gradient(p);
        leaf.refine(&self.surface, graph, p, f - self.surface.level, gradient)
    }

    /// `n` uniform places of the surface, fewer only where lines hardly meet it: starts of walks.
    pub(crate) fn some_places(&self, stream: &mut Stream, n: usize) -> Vec<DVec3> {
        let mut places = Vec::with_capacity(n + 8);
        let mut found = Found::default();
        let most = (n as u64 + 64) * 64 * self.report.lines / self.report.roots.max(1);
        for _ in 0..most {
            if places.len() >= n {
                break;
            }
            let leaf = self.leaf_at(stream.unit());
            if let Some(graph) = &leaf.graph {
                let [u, v, lot] = stream.triple();
                let root = leaf.start(graph, [u, v]).and_then(|p| self.root(leaf, graph, p));
                let kept = root.filter(|(p, g)| keeps(graph, lot, *g) && self.surface.contains(*p));
                places.extend(kept.map(|(p, _)| p));
            } else {
                let line = self.line(leaf, stream);
                found.roots.clear();
                self.search(leaf, &line, 1, &mut found);
                let on = found.roots.iter().map(|(t, _)| line.o + line.d * *t);
                places.extend(on.filter(|p| self.surface.contains(*p)));
            }
        }
        places.truncate(n);
        places
    }

    /// A uniform line of the ball around a leaf.
    fn line(&self, leaf: &Leaf, stream: &mut Stream) -> Line<'a> {
        let d = stream.direction();
        let [a, b] = across(d);
        let r = 0.75f64.sqrt() * leaf.side * stream.unit().sqrt();
        let (sin, cos) = libm::sincos(TAU * stream.unit());
        let o = leaf.corner + 0.5 * leaf.side + (a * cos + b * sin) * r;
        Line { surface: self.surface, o, d, steepest: f64::from(leaf.steepest) }
    }

    /// All roots of a line in a leaf and in the box, searched in `parts` parts.
    fn search(&self, leaf: &Leaf, line: &Line<'_>, parts: u32, found: &mut Found) {
        let low = leaf.corner.max(self.surface.bounds.min);
        let high = (leaf.corner + leaf.side).min(self.surface.bounds.max);
        let Some((enter, leave)) = clip(line, low, high) else { return };
        let mut a = line.at(enter);
        for k in 1..=parts {
            let share = f64::from(k) / f64::from(parts);
            let b = line.at(if k == parts { leave } else { enter + (leave - enter) * share });
            line.roots(a, b, found);
            a = b;
        }
    }

    /// Particles from places with their gradients.
    #[inline(always)]
    fn push(&self, p: DVec3, normal: DVec3, color: Steps, particles: &mut Particles) {
        let normal = PackedNormal::new(normal.as_vec3());
        let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
        let normal = if per_crossing { normal.per_crossing() } else { normal };
        let place = (p - self.sets.origin).as_vec3();
        particles.push(place, normal, color.at(place));
    }

    /// The crossings of an open leaf's line.
    #[cold]
    fn open(&self, leaf: &Leaf, stream: &mut Stream, color: Steps, found: &mut Found, particles: &mut Particles) {
        let line = self.line(leaf, stream);
        found.roots.clear();
        self.search(leaf, &line, 1, found);
        for &(t, beside) in &found.roots {
            let p = line.o + line.d * t;
            let thinned = self.density.as_ref().is_some_and(|d| stream.unit() * d.max >= d.at(p));
            if !thinned && self.surface.contains(p) {
                let gradient = self.surface.field.gradient(line.o + line.d * beside);
                self.push(p, unit_or_zero(gradient), color, particles);
            }
        }
    }

    /// The crossings of a batch of graphs' lines.
    #[inline]
    fn flush(&self, batch: &mut Batch, color: Steps, particles: &mut Particles) {
        let n = std::mem::take(&mut batch.len);
        self.surface.field.value_gradients(&batch.at[..n], &mut batch.found[..n]);
        for i in 0..n {
            let leaf = &self.leaves[batch.leaf[i] as usize];
            let lot = batch.lot[i];
            let Some(graph) = &leaf.graph else { continue };
            let (f, gradient) = batch.found[i];
            let value = f - self.surface.level;
            let Some((p, gradient)) = leaf.refine(&self.surface, graph, batch.at[i], value, gradient) else { continue };
            let thinned = self.density.as_ref().is_some_and(|d| batch.thinning[i] * d.max >= d.at(p));
            if !keeps(graph, lot, gradient) || thinned || !self.surface.contains(p) {
                continue;
            }
            self.push(p, gradient, color, particles);
        }
    }
}

/// Whether the thinning of a graph keeps a place with ∇f/|f_k|.
#[inline(always)]
fn keeps(graph: &Graph, lot: f32, gradient: DVec3) -> bool {
    let bound = f64::from(lot * graph.weight);
    bound * bound < gradient.length_squared()
}

/// Places on the lines of graphs that wait to be evaluated.
struct Batch {
    at: [DVec3; BATCH],
    found: [(f64, DVec3); BATCH],
    leaf: [u32; BATCH],
    lot: [f32; BATCH],
    /// For the density.
    thinning: [f64; BATCH],
    len: usize,
}

impl Batch {
    const EMPTY: Self = Self {
        at: [DVec3::ZERO; BATCH],
        found: [(0.0, DVec3::ZERO); BATCH],
        leaf: [0; BATCH],
        lot: [0.0; BATCH],
        thinning: [0.0; BATCH],
        len: 0,
    };
}

/// The piece of a line in a box, or `None`.
fn clip(line: &Line<'_>, low: DVec3, high: DVec3) -> Option<(f64, f64)> {
    let mut enter = f64::NEG_INFINITY;
    let mut leave = f64::INFINITY;
    for a in 0..3 {
        let o = line.o[a];
        let d = line.d[a];
        if d == 0.0 {
            if !(low[a]..=high[a]).contains(&o) {
                return None;
            }
        } else {
            let p = (low[a] - o) / d;
            let q = (high[a] - o) / d;
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
    }
    (enter < leave).then_some((enter, leave))
}

impl Poisson for LineSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        let color = Steps::new(self.params.color);
        let mut found = Found::default();
        let mut batch = Batch::EMPTY;
        self.sets.blocks.arrivals(self.params.seed, Stage::Lines, set, chunk, |l, stream| {
            let leaf = &self.leaves[l];
            let Some(graph) = &leaf.graph else { return self.open(leaf, stream, color, &mut found, particles) };
            let [u, v, lot] = stream.triple();
            let Some(p) = leaf.start(graph, [u, v]) else { return };
            let k = batch.len;
            (batch.at[k], batch.leaf[k], batch.lot[k]) = (p, l as u32, lot);
            batch.thinning[k] = if self.density.is_some() { stream.unit() } else { 0.0 };
            batch.len = k + 1;
            if batch.len == BATCH {
                self.flush(&mut batch, color, particles);
            }
        });
        self.flush(&mut batch, color, particles);
    }
}
