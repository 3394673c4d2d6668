//! The paper's sampler: particles are places of a Brownian motion on the surface (Tanaka 2012, section 4).
//!
//! The number of particles comes from 100 counting spheres: balls of radius ρ around random places of the surface, in which
//! a pilot run leaves n of its N₀ particles in the mean. The surface in such a ball has the area πρ² (exactly so on a
//! sphere). So the whole surface has N₀·πρ²/n, and a set of N = N₀·πρ²/n·τ/s particles has the requested opacity.
//!
//! Deviations from the paper:
//! - Many short walks in place of one. Relaxation over a surface of width 1 takes 1/(2dt) steps, 10⁴ at √(2dt) = 0.01;
//!   pieces of one walk are not independent. Walkers start at uniform places of the surface, found by random lines, in
//!   parts of it that are not connected too, and every set has walkers of its own.
//! - By default a walker leaves one particle, `stride` steps from its start, so that no pixel is hit twice by one walker.
//!   With more, particles lie in clumps as in the paper, and a clump in one pixel counts as one.
//! - The termination counts once, before the first set: stopping each set by its own count would make the number of
//!   particles depend on where they are.

use crate::error::check;
use crate::params::countable;
use crate::particles::Steps;
use crate::stream::{Stage, Stream, unit_or_zero};
use crate::surfaces::walk::Walk;
use crate::{
    Error, ImplicitSurface, LineParams, LineSampler, PackedNormal, Particles, Sampler, SurfaceParams, opacity,
};
use glam::DVec3;
use rayon::prelude::*;
use splat_core::glam;
use splat_core::optics::SurfaceOpacity;
use std::f64::consts::PI;

/// Counting spheres (the paper's number).
const SPHERES: usize = 100;

/// Particles of a chunk.
const CHUNK: u64 = 4096;

/// Lines a root above which a walk's starts take longer than the walks.
const MOST_LINES: u64 = 64;

/// Sets of the pilot run have numbers from here on; no picture has so many.
const PILOT: u64 = 1 << 40;

/// Parameters of the walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrownianParams {
    /// √(2dt), the size of a step per axis, world units, > 0.
    pub step: f64,
    /// Steps from one particle to the next, ≥ 1.
    pub stride: u32,
    /// Particles that one walker leaves, 1 to 4096. With 1, the particles of a set are independent. More is faster, and
    /// costs opacity where a walker hits one pixel more than once: half of it where pixels are twice as wide as the way
    /// from one particle to the next.
    pub particles_per_walker: u32,
    /// Radius ρ of the counting spheres, world units, > 0; less than the surface's radii of curvature.
    pub counting_radius: f64,
    /// Particles of the pilot run, ≥ 1000.
    pub pilot_particles: u32,
    /// Cells along the longest side of the box for finding the starts.
    pub resolution: u32,
}

impl BrownianParams {
    /// The paper's step for a surface of this width, √(2dt) = 0.01 of it, and counting spheres of 0.1.
    pub fn for_width(width: f64) -> Self {
        Self {
            step: 0.01 * width,
            stride: 4,
            particles_per_walker: 1,
            counting_radius: 0.1 * width,
            pilot_particles: 1 << 16,
            resolution: 32,
        }
    }
}

/// Results of the pilot run and its counting spheres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BrownianReport {
    /// Mean number of particles in a counting sphere, n.
    pub counted: f64,
    /// Area of the surface by the counts, world units².
    pub area: f64,
    /// Area by the lines that found the starts, world units²: counts are far from it where borders or bends lie within a
    /// counting sphere.
    pub area_by_lines: f64,
    /// Standard error of the area, relative: the relative error of the optical depth of all sets.
    pub area_error: f64,
    /// Share of steps that were refused.
    pub refused: f64,
}

/// Relative error of a counted area up to which nothing is said; that of the area by lines is a few percent.
const MISCOUNTED: f64 = 0.1;

impl BrownianReport {
    /// Warns, in words, if the counting spheres miscount the area.
    pub fn warning(&self) -> Option<String> {
        let more = self.area / self.area_by_lines - 1.0;
        (more.abs() > MISCOUNTED).then(|| {
            format!(
                "its Brownian motion counts {:+.0} % of area, and is that much too dense, for borders or bends lie within a \
                 counting sphere",
                100.0 * more
            )
        })
    }
}

/// Particles on an implicit surface, by Brownian motion.
pub struct BrownianSampler<'a> {
    surface: ImplicitSurface<'a>,
    params: SurfaceParams,
    walk: BrownianParams,
    steps: Walk<'a>,
    starts: LineSampler<'a>,
    origin: DVec3,
    /// Particles of a set, a fraction included.
    number: f64,
    report: BrownianReport,
}

impl<'a> BrownianSampler<'a> {
    /// Finds the surface, makes the pilot run and counts.
    ///
    /// # Errors
    /// The errors of [`LineSampler::new`]; [`Error::Parameter`] for numbers out of range; [`Error::Empty`] when no walker can
    /// move, as on a surface that is singular everywhere, or when fewer than one of 64 lines meets the surface, as with a
    /// field that rounds to the level far around it.
    pub fn new(surface: &ImplicitSurface<'a>, walk: &BrownianParams, params: &SurfaceParams) -> Result<Self, Error> {
        check(walk.stride >= 1, "stride", walk.stride, "at least 1")?;
        let per_walker = walk.particles_per_walker;
        check((1..=CHUNK as u32).contains(&per_walker), "particles_per_walker", per_walker, "1 to 4096")?;
        crate::params::positive(walk.counting_radius, "counting_radius")?;
        check(walk.pilot_particles >= 1000, "pilot_particles", walk.pilot_particles, "at least 1000")?;
        let steps = Walk::new(surface, walk.step)?;
        let starts = LineSampler::new(surface, &LineParams { resolution: walk.resolution }, params, None)?;
        if starts.report().lines > MOST_LINES * starts.report().roots {
            let reason =
                "fewer than one of 64 lines that look for starts meets the surface: sample it by lines instead";
            return Err(Error::Empty { what: "a Brownian motion", reason });
        }
        let mut sampler = Self {
            surface: *surface,
            params: *params,
            walk: *walk,
            steps,
            starts,
            origin: surface.bounds.center(),
            number: f64::from(walk.pilot_particles),
            report: BrownianReport::default(),
        };
        sampler.report = sampler.count()?;
        // q = s/A and n by Eq. 1.
        let q = opacity::hit_probability(params.cross_section, sampler.report.area, 1.0);
        sampler.number = opacity::count(splat_core::optics::opacity(params.optical_depth()), q);
        countable(sampler.number)?;
        Ok(sampler)
    }

    /// Returns the results of the counting spheres.
    pub fn report(&self) -> &BrownianReport {
        &self.report
    }

    /// The pilot run.
    fn count(&self) -> Result<BrownianReport, Error> {
        let chunks = u64::from(self.walk.pilot_particles).div_ceil(CHUNK);
        let runs: Vec<(Vec<DVec3>, u64, u64)> =
            (0..chunks as u32).into_par_iter().map(|c| self.run(PILOT, u64::from(c), CHUNK)).collect();
        let pilot: Vec<DVec3> = runs.iter().flat_map(|r| r.0.iter().copied()).collect();
        let (steps, refused) = runs.iter().fold((0, 0), |s, r| (s.0 + r.1, s.1 + r.2));
        let mut centers = self.run(PILOT + 1, 0, SPHERES as u64).0;
        centers.truncate(SPHERES);
        let empty = |reason| Error::Empty { what: "a Brownian motion", reason };
        if pilot.is_empty() || centers.is_empty() || refused == steps {
            return Err(empty("no walker can move: the gradient vanishes on the surface"));
        }
        let square = self.walk.counting_radius.powi(2);
        let counts: Vec<f64> = centers
            .par_iter()
            .map(|c| pilot.iter().filter(|p| (**p - c).length_squared() < square).count() as f64)
            .collect();
        let n = counts.len() as f64;
        let mean = counts.iter().sum::<f64>() / n;
        if mean == 0.0 {
            return Err(empty("no particle lies in a counting sphere: take a larger radius or pilot run"));
        }
        let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        Ok(BrownianReport {
            counted: mean,
            area: pilot.len() as f64 * PI * square / mean,
            area_by_lines: self.starts.report().area,
            area_error: (variance / n).sqrt() / mean,
            refused: refused as f64 / steps.max(1) as f64,
        })
    }

    /// `n` places of the walkers of a chunk, the steps made, and how many of them were refused.
    fn run(&self, set: u64, chunk: u64, n: u64) -> (Vec<DVec3>, u64, u64) {
        let mut stream = Stream::new(self.params.seed, Stage::Brownian, set, chunk);
        let walkers = n.div_ceil(u64::from(self.walk.particles_per_walker)) as usize;
        let starts = self.starts.some_places(&mut stream, walkers);
        let mut places = Vec::with_capacity(n as usize);
        let mut steps = 0;
        let mut refused = 0;
        for start in starts {
            let mut x = start;
            for _ in 0..self.walk.particles_per_walker {
                for _ in 0..self.walk.stride {
                    steps += 1;
                    match self.steps.advance(x, &mut stream) {
                        Some(to) => x = to,
                        None => refused += 1,
                    }
                }
                if places.len() < n as usize {
                    places.push(x);
                }
            }
        }
        (places, steps, refused)
    }
}

impl Sampler for BrownianSampler<'_> {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn cross_section(&self) -> f64 {
        self.params.cross_section
    }

    fn chunks(&self) -> usize {
        (self.number.ceil() as u64).div_ceil(CHUNK) as usize
    }

    fn expected(&self, chunk: usize) -> f64 {
        (self.number - (chunk as u64 * CHUNK) as f64).clamp(0.0, CHUNK as f64)
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        scratch.clear();
        let q = opacity::hit_probability(self.params.cross_section, self.report.area, 1.0);
        let rounding = Stream::new(self.params.seed, Stage::Brownian, set, u64::MAX).unit();
        let count = opacity::whole_count(self.number, q, rounding);
        let first = chunk as u64 * CHUNK;
        let (places, ..) = self.run(set, chunk as u64, count.saturating_sub(first).min(CHUNK));
        let color = Steps::new(self.params.color);
        scratch.reserve(places.len());
        for p in places {
            let normal = PackedNormal::new(unit_or_zero(self.surface.field.gradient(p)).as_vec3());
            let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
            let normal = if per_crossing { normal.per_crossing() } else { normal };
            let place = (p - self.origin).as_vec3();
            scratch.push(place, normal, color.at(place));
        }
        scratch
    }
}
