//! Sampling of implicit surfaces by random lines (Cauchy and Crofton): hundreds of times faster than a walk on them.
//!
//! Lines are uniform in a ball of radius R around the surface: a uniform direction, and a uniform point of the disc of
//! radius R across it. A flat piece of area A is met by such a line with probability A/(2πR²), whatever its place and
//! direction (the mean of |cos| over directions is 1/2, and the disc has the area πR²). So crossings are uniform on the
//! surface, M lines put M/(2πR²) of them on an area of 1, and no line meets the flat piece of surface behind one pixel
//! twice. With s the pixel's area, that piece has the area s/cos θ, and
//!
//! α(θ) = 1 − (1 − q)^M, q = s/(2πR²·cos θ)
//!
//! which is Tanaka 2012, Eq. 1, with S = 2πR² and n = M. M is fixed from α at θ = 0; the number of crossings is left as it
//! comes. To cut it to a wanted n would make sets with many crossings thinner: α would depend on the rest of the surface.
//!
//! Lines are followed through the cells of [`crate::ImplicitSurface`]'s box. Cells far from the surface are jumped over;
//! in the others all roots are isolated, see `roots.rs`. Where the field has no bound a pair of roots within one cell may be
//! missed; [`LineReport`] says how many of a sample of lines gain roots when they are looked at 16 times as finely.

use crate::error::check;
use crate::implicit::{CellCounts, Cells, ImplicitSurface};
use crate::opacity;
use crate::params::countable;
use crate::roots::{At, Found, Line};
use crate::stream::{Stage, Stream, across, unit_or_zero};
use crate::{Density, Error, PackedColor, PackedNormal, Particles, Sampler, SurfaceParams};
use glam::DVec3;
use rayon::prelude::*;
use splat_core::glam;
use splat_core::optics::SurfaceOpacity;
use std::f64::consts::TAU;

/// Lines of one chunk.
const CHUNK_LINES: u64 = 4096;

/// Lines of the survey.
const SURVEY_LINES: u32 = 8192;

/// Cells that are searched at once, along a line.
const RUN: u32 = 4;

/// What is known about the roots of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineReport {
    /// Cells of the box.
    pub cells: CellCounts,
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
}

impl LineReport {
    /// Share of roots that are missed, as far as the survey can tell: the relative bias of the optical depth.
    pub fn missed(&self) -> f64 {
        self.fine_roots.saturating_sub(self.roots) as f64 / self.fine_roots.max(1) as f64
    }
}

/// Particles on an implicit surface, by random lines.
pub struct LineSampler<'a> {
    surface: ImplicitSurface<'a>,
    params: SurfaceParams,
    density: Option<Density<'a>>,
    cells: Cells,
    center: DVec3,
    radius: f64,
    /// M, a fraction included, at the density's largest factor.
    lines: f64,
    report: LineReport,
}

impl<'a> LineSampler<'a> {
    /// Finds the cells that hold the surface, `resolution` (1 to 1024) along the longest side of the box, and surveys its
    /// roots.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Field`] where the field is not finite, [`Error::Empty`] when
    /// no line of the survey meets the surface, [`Error::TooMuch`] for more than 4·10⁹ lines a set.
    pub fn new(
        surface: &ImplicitSurface<'a>,
        resolution: u32,
        params: &SurfaceParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        params.validate()?;
        surface.validate()?;
        density.as_ref().map_or(Ok(()), Density::validate)?;
        check((1..=1024).contains(&resolution), "resolution", resolution, "1 to 1024 cells")?;
        let cells = Cells::new(surface, resolution);
        let empty = |reason| Error::Empty { what: "an implicit surface", reason };
        let (center, radius) = cells.ball().ok_or(empty("the field's bound excludes the level in the whole box"))?;
        let most = density.as_ref().map_or(1.0, |d| d.max);
        let share = opacity::hit_probability(params.cross_section, TAU * radius * radius, 1.0);
        // A density factor multiplies optical depth.
        let alpha = splat_core::optics::opacity(params.optical_depth() * most);
        let lines = opacity::count(alpha, share);
        countable(lines)?;
        let mut sampler = Self {
            surface: *surface,
            params: *params,
            density,
            cells,
            center,
            radius,
            lines,
            report: LineReport::default(),
        };
        sampler.report = sampler.survey();
        if sampler.report.roots == 0 {
            let broken = sampler.report.broken > 0;
            let reason = if broken { "the field is not finite there" } else { "no line of the survey meets it" };
            return Err(empty(reason));
        }
        Ok(sampler)
    }

    /// What is known about the roots.
    pub fn report(&self) -> &LineReport {
        &self.report
    }

    /// Mean number of lines of a set, M.
    pub fn lines(&self) -> f64 {
        self.lines
    }

    /// Bytes of the cells.
    pub fn bytes(&self) -> u64 {
        self.cells.bytes()
    }

    fn survey(&self) -> LineReport {
        let one = |i: u32| {
            let mut stream = Stream::new(self.params.seed, Stage::Survey, 0, u64::from(i));
            let line = self.line(&mut stream);
            let (mut found, mut fine) = (Found::default(), Found::default());
            self.follow(&line, 1, &mut found);
            self.follow(&line, 16, &mut fine);
            let inside = |f: &Found| f.roots.iter().filter(|(t, _)| self.counts(&line, *t)).count() as u64;
            [inside(&found), inside(&fine), found.unproven, found.broken + fine.broken]
        };
        let add = |a: [u64; 4], b: [u64; 4]| std::array::from_fn(|k| a[k] + b[k]);
        let [roots, fine_roots, unproven, broken] =
            (0..SURVEY_LINES).into_par_iter().with_min_len(64).map(one).reduce(|| [0; 4], add);
        let area = fine_roots.max(roots) as f64 / f64::from(SURVEY_LINES) * TAU * self.radius * self.radius;
        LineReport {
            cells: self.cells.counts,
            lines: u64::from(SURVEY_LINES),
            roots,
            fine_roots,
            unproven,
            broken,
            area,
        }
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
            let line = self.line(stream);
            found.roots.clear();
            self.follow(&line, 1, &mut found);
            let on = |t: &f64| self.counts(&line, *t);
            places.extend(found.roots.iter().map(|(t, _)| *t).filter(on).map(|t| line.o + line.d * t));
        }
        places.truncate(n);
        places
    }

    /// A uniform line of the ball.
    #[inline]
    fn line(&self, stream: &mut Stream) -> Line<'a> {
        let d = stream.direction();
        let [a, b] = across(d);
        let r = self.radius * stream.unit().sqrt();
        let (sin, cos) = (TAU * stream.unit()).sin_cos();
        Line { surface: self.surface, o: self.center + (a * cos + b * sin) * r, d }
    }

    fn counts(&self, line: &Line<'_>, t: f64) -> bool {
        self.surface.contains(line.o + line.d * t)
    }

    /// All roots of a line: runs of active cells are searched in `parts` parts each, the rest is jumped over.
    fn follow(&self, line: &Line<'_>, parts: u32, found: &mut Found) {
        let (o, d) = ((line.o - self.cells.min) / self.cells.side, line.d / self.cells.side);
        let Some((enter, leave)) = clip(o, d, self.cells.dims) else { return };
        let inverse = DVec3::select(d.cmpeq(DVec3::ZERO), DVec3::INFINITY, d.recip());
        let ahead: [i32; 3] = std::array::from_fn(|a| i32::from(d[a] >= 0.0));
        let least = (leave - enter) * 1e-12;
        let mut t = enter;
        let mut cell = cell_at(o, d, t, self.cells.dims);
        // Where the run of active cells began, and how many it has.
        let mut run: Option<(At, u32)> = None;
        // Each turn goes on by at least a cell's corner, so the number of turns is bounded by what a line can cross.
        for _ in 0..4 * (self.cells.dims.iter().sum::<i32>() + 3) {
            if t >= leave {
                break;
            }
            let distance = self.cells.distance(cell);
            let more = i32::from(distance.max(1)) - 1;
            let (mut exit, axis) = leave_cube(o, inverse, ahead, cell, more);
            if exit > leave {
                exit = leave;
            } else if exit <= t {
                // Rounding may put the exit at or before t: a step on by the last digits.
                exit = t + least;
            }
            if more > 0 {
                cell = cell_at(o, d, exit, self.cells.dims);
            } else {
                // The next cell; beyond the last one t has reached `leave`, up to rounding.
                let next = cell[axis] + 2 * ahead[axis] - 1;
                cell[axis] = next.clamp(0, self.cells.dims[axis] - 1);
            }
            if distance == 0 {
                let (from, cells) = run.unwrap_or_else(|| (line.at(t), 0));
                // A long run goes on from the place and value where its last part ended.
                run = Some(if cells + 1 == RUN {
                    (search(line, from, exit, parts, found), 0)
                } else {
                    (from, cells + 1)
                });
            } else if let Some((from, 1..)) = run.take() {
                search(line, from, t, parts, found);
            }
            t = exit;
        }
        if let Some((from, 1..)) = run {
            search(line, from, t, parts, found);
        }
    }
}

/// Searches from `from` to `to` in `parts` parts; returns the end.
fn search(line: &Line<'_>, from: At, to: f64, parts: u32, found: &mut Found) -> At {
    let mut a = from;
    for k in 1..=parts {
        let share = f64::from(k) / f64::from(parts);
        let b = line.at(if k == parts { to } else { from.t + (to - from.t) * share });
        line.roots(a, b, found);
        a = b;
    }
    a
}

/// The cell in which the line is just behind `t`.
#[inline(always)]
fn cell_at(o: DVec3, d: DVec3, t: f64, dims: [i32; 3]) -> [i32; 3] {
    let p = o + d * t;
    std::array::from_fn(|a| {
        // Conversions cut towards zero, and nothing lies below it: cheaper than floor() without its instruction.
        let v = p[a].max(0.0);
        let near = (v + 0.5) as i32;
        // On a border the direction decides.
        let on_border = (v - f64::from(near)).abs() < 1e-9;
        let cell = if on_border { near - i32::from(d[a] < 0.0) } else { v as i32 };
        cell.clamp(0, dims[a] - 1)
    })
}

/// Where, and along which axis, the line leaves the cube of 2·`more` + 1 cells around `cell`. `inverse` is 1/d, +∞ where
/// d is 0; `ahead` is 1 for axes along which the line does not fall.
#[inline(always)]
fn leave_cube(o: DVec3, inverse: DVec3, ahead: [i32; 3], cell: [i32; 3], more: i32) -> (f64, usize) {
    let t = |a: usize| (f64::from(cell[a] - more + ahead[a] * (2 * more + 1)) - o[a]) * inverse[a];
    let (x, y, z) = (t(0), t(1), t(2));
    // Selections, not branches: which face comes next cannot be foreseen.
    let (first, axis) = if y < x { (y, 1) } else { (x, 0) };
    if z < first { (z, 2) } else { (first, axis) }
}

/// The piece of the line in the box, or `None`.
fn clip(o: DVec3, d: DVec3, dims: [i32; 3]) -> Option<(f64, f64)> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for a in 0..3 {
        let high = f64::from(dims[a]);
        if d[a] == 0.0 {
            if !(0.0..=high).contains(&o[a]) {
                return None;
            }
        } else {
            let (p, q) = (-o[a] / d[a], (high - o[a]) / d[a]);
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
    }
    (enter < leave).then_some((enter, leave))
}

impl Sampler for LineSampler<'_> {
    fn origin(&self) -> DVec3 {
        self.center
    }

    fn cross_section(&self) -> f64 {
        self.params.cross_section
    }

    fn chunks(&self) -> usize {
        (self.lines.ceil() as u64).div_ceil(CHUNK_LINES) as usize
    }

    fn expected(&self, chunk: usize) -> f64 {
        let lines = (self.lines - (chunk as u64 * CHUNK_LINES) as f64).clamp(0.0, CHUNK_LINES as f64);
        lines * self.report.roots as f64 / self.report.lines as f64
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        scratch.clear();
        scratch.reserve((self.expected(chunk) * 1.2) as usize + 64);
        let share = opacity::hit_probability(self.params.cross_section, TAU * self.radius * self.radius, 1.0);
        let rounding = Stream::new(self.params.seed, Stage::Lines, set, u64::MAX).unit();
        let all = opacity::whole_count(self.lines, share, rounding);
        let first = chunk as u64 * CHUNK_LINES;
        let color = PackedColor::new(self.params.color);
        let mut stream = Stream::new(self.params.seed, Stage::Lines, set, chunk as u64);
        let mut found = Found::default();
        for _ in first..all.min(first + CHUNK_LINES) {
            let line = self.line(&mut stream);
            found.roots.clear();
            self.follow(&line, 1, &mut found);
            for &(t, beside) in &found.roots {
                let p = line.o + line.d * t;
                let thinned = self.density.as_ref().is_some_and(|d| stream.unit() * d.max >= d.at(p));
                if thinned || !self.surface.contains(p) {
                    continue;
                }
                let gradient = self.surface.field.gradient(line.o + line.d * beside);
                let normal = PackedNormal::new(unit_or_zero(gradient).as_vec3());
                let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
                let normal = if per_crossing { normal.per_crossing() } else { normal };
                scratch.push((p - self.center).as_vec3(), normal, color);
            }
        }
        scratch
    }
}
