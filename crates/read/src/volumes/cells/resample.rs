//! A field over bodies → a volume that tiles their bounds.
//!
//! A voxel is the mean of eight samples, in the middles of its eighths: those within a body have its field there, those within none
//! the value outside. So a field that is linear over a voxel's cells has its value at the voxel's middle, and the volume has the
//! integral of the field but for the samples that a border parts. Bodies are parted into tetrahedra around their middle and the middles of
//! their faces, which neighbours agree on; the field is linear in each. A sample belongs to the first body that it lies in. Voxels
//! with bodies that samples miss are parted exactly (`parting`).

use super::lists::FacesAround;
use super::parting::{Parting, Planes};
use super::solid::{Middle, Solid};
use super::{Field, HINT};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use crate::volumes::lattice;
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3, DVec4, USizeVec3};
use splat_core::text::counted;
use splat_core::{DAabb, Grid};
use std::sync::atomic::{AtomicU64, Ordering};

/// Voxels of the volume: no fewer in its bounds, and no more.
const FEWEST: f64 = 64.0 * 64.0 * 64.0;
const MOST: f64 = 256.0 * 256.0 * 256.0;
/// Voxels along an axis, at most: of cells in a row that is far longer they are so long that the volume is refused.
const MOST_ALONG: f64 = 65536.0;
/// Voxels of a body of mean size, between those.
const VOXELS_PER_BODY: f64 = 8.0;
/// The share of bodies that may be thinner than a sample before voxels become smaller, how much smaller at most, and the memory that a voxel then
/// takes until it is drawn.
const THINNEST: f64 = 0.25;
const SMALLER: f64 = 2.0;
const BYTES_OF_A_VOXEL: f64 = 64.0;
/// Voxels that bodies touch, all together, up to which voxels become smaller: beyond it their parting takes long.
const MOST_TOUCHED: f64 = (1u64 << 22) as f64;
/// Voxels that bodies which samples miss touch, all together, up to which they are parted, and the bytes that a voxel takes for it.
const MOST_PARTED: f64 = (1u64 << 26) as f64;
const BYTES_OF_A_PARTED_VOXEL: u64 = 28;
/// The share of the samples that its volume stands for below which a body is parted exactly.
const MISSED: f64 = 0.5;
/// Shares of the volume and of the bodies from which those that samples miss are worth a warning.
const MUCH: f64 = 0.01;
const MANY: f64 = 0.05;
/// Samples of a voxel along an axis.
const SAMPLES: usize = 2;
/// By what a sample is multiplied in the sum of its voxel, a power of two: differences of values may be twice as large as a value, and sums of so
/// many fit single precision nevertheless.
const SHARE: f64 = 0.5 / (SAMPLES * SAMPLES * SAMPLES) as f64;
/// Parts of the volume that are filled side by side, whatever the number of threads.
const PARTS: usize = 16;
/// Rows of samples that are looked at, and samples, for each sample that there is, at most; and how many in any case. Cells that lie side
/// by side stay far below; such as lie on each other a thousandfold would take minutes.
const MOST_WORK: f64 = 256.0;
const FREE_WORK: f64 = (1u64 << 28) as f64;
/// The volume of a body over that of a cube as long as it up to which it has none: what rounding leaves of a flat one.
const FLAT: f64 = 1e-14;
/// How far outside a tetrahedron a sample may lie, in barycentric coordinates: between two neighbours nothing is left out.
const SLACK: f64 = 1e-9;

/// A cell that encloses a volume.
pub(super) struct Body<'a> {
    /// Its rank among all cells.
    pub(super) cell: usize,
    pub(super) corners: &'a [u32],
    pub(super) faces: Faces<'a>,
}

/// The faces around a body.
pub(super) enum Faces<'a> {
    /// Those of a kind of VTK.
    Of(&'static Solid),
    /// Those of a polyhedron, which need not be wound alike, and the weights of its corners in the point that sees them all, where their mean does not.
    Around(FacesAround<'a>, Option<Vec<f64>>),
}

/// A place and the value there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knot {
    pub(super) place: DVec3,
    pub(super) value: f64,
}

/// The corners of a tetrahedron.
pub(super) type Tetrahedron = [Knot; 4];

impl Body<'_> {
    /// Gives the tetrahedra of the body to `take`.
    pub(super) fn part(&self, corner: &impl Fn(u32) -> Knot, mut take: impl FnMut(&Tetrahedron)) {
        let knot = |i: u8| corner(self.corners[usize::from(i)]);
        let solid = match &self.faces {
            Faces::Of(solid) => solid,
            Faces::Around(faces, seeing) => {
                let corners = self.corners.iter().map(|rank| corner(*rank));
                let middle = match seeing {
                    Some(weights) => weighted(weights, corners),
                    None => mean(corners),
                };
                for face in faces.iter() {
                    part_face(
                        middle,
                        mean(face.iter().map(|rank| corner(*rank))),
                        face,
                        |rank| corner(*rank),
                        &mut take,
                    );
                }
                return;
            }
        };
        if solid.faces.is_empty() {
            return take(&[knot(0), knot(1), knot(2), knot(3)]);
        }
        let middle = middle_of(solid.middle, (0..self.corners.len() as u8).map(knot), knot);
        for face in solid.faces {
            let center = middle_of(face.middle, face.around.iter().map(|i| knot(*i)), knot);
            part_face(middle, center, face.around, |i| knot(*i), &mut take);
        }
    }

    /// Whether its faces are wound alike, so that tetrahedra of both signs tell that it is folded.
    fn is_wound(&self) -> bool {
        matches!(self.faces, Faces::Of(_))
    }
}

/// Gives the tetrahedra between the middle of a body and a face, around the center of that, to `take`.
fn part_face<I>(
    middle: Knot,
    center: Knot,
    around: &[I],
    knot: impl Fn(&I) -> Knot,
    take: &mut impl FnMut(&Tetrahedron),
) {
    match around {
        [a, b, c] => take(&[middle, knot(a), knot(b), knot(c)]),
        _ => {
            for (i, a) in around.iter().enumerate() {
                take(&[middle, center, knot(a), knot(&around[(i + 1) % around.len()])]);
            }
        }
    }
}

/// The middle of points, of which `knot` gives one of the cell by its rank.
fn middle_of(middle: Middle, points: impl Iterator<Item = Knot> + Clone, knot: impl Fn(u8) -> Knot) -> Knot {
    let weighted = |weights: &mut dyn Iterator<Item = f64>| {
        let none = Knot { place: DVec3::ZERO, value: 0.0 };
        points.clone().zip(weights).fold(none, |sum, (knot, weight)| Knot {
            place: sum.place + weight * knot.place,
            value: sum.value + weight * knot.value,
        })
    };
    // Beside a point without a value its neighbours have theirs.
    let has_gap = points.clone().any(|knot| knot.value.is_nan());
    let middle_by_weights =
        |knot: Knot| if has_gap { Knot { value: mean(points.clone()).value, ..knot } } else { knot };
    match middle {
        Middle::Mean => mean(points),
        Middle::Point(rank) => {
            let point = knot(rank);
            if point.value.is_nan() { Knot { value: mean(points).value, ..point } } else { point }
        }
        Middle::Alternating(corner, edge) => middle_by_weights(weighted(&mut [corner, edge].into_iter().cycle())),
        Middle::Groups(groups) => {
            let weights = groups.iter().flat_map(|(n, weight)| std::iter::repeat_n(*weight, usize::from(*n)));
            middle_by_weights(weighted(&mut weights.into_iter()))
        }
    }
}

/// The mean of points; its value is that of those that have one.
pub(super) fn mean(corners: impl Iterator<Item = Knot> + Clone) -> Knot {
    let count = corners.clone().count() as f64;
    let place = corners.clone().map(|knot| knot.place).sum::<DVec3>() / count;
    let (sum, with_value) =
        corners.map(|knot| knot.value).filter(|value| !value.is_nan()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    Knot { place, value: sum / with_value }
}

/// The sum of points by weights; beside a point without a value its value is that of the others.
fn weighted(weights: &[f64], corners: impl Iterator<Item = Knot> + Clone) -> Knot {
    let place = weights.iter().zip(corners.clone()).map(|(weight, knot)| weight * knot.place).sum();
    let value = weights.iter().zip(corners.clone()).map(|(weight, knot)| weight * knot.value).sum::<f64>();
    Knot { place, value: if value.is_nan() { mean(corners).value } else { value } }
}

/// Six times the volume, negative for one that is inside out.
pub(super) fn volume(tetrahedron: &Tetrahedron) -> f64 {
    let [a, b, c, d] = tetrahedron;
    (b.place - a.place).cross(c.place - a.place).dot(d.place - a.place)
}

/// The volume of a field over bodies, whose cells are told of at a place.
pub(super) fn grid(
    points: &[DVec3],
    bodies: &[Body<'_>],
    place: Place,
    field: &Field,
    reading: &mut Reading<'_>,
) -> Result<Grid, ReadError> {
    let bounds = Bounds::around(points, bodies).ok_or_else(|| {
        let found = "cells that are flat, or too small or too large for their volume to be a number";
        ReadError::input(
            place,
            "cells that enclose a volume",
            found,
            "check the places of the points, or scale the data",
        )
    })?;
    let usual = bounds.usual_step(bodies.len() as f64);
    let fine = bounds.fine_step(usual, thinnest(points, bodies, reading)?, reading);
    let is_fine = fine < usual && touched(points, bodies, fine) <= MOST_TOUCHED;
    let dims = bounds.dims(if is_fine { fine } else { usual });
    let step = bounds.size / DVec3::from_array(dims.map(|n| n as f64));
    let origin = bounds.low + 0.5 * step;
    let axes = DMat3::from_diagonal(step);
    lattice::check(origin, &axes, place, HINT)?;
    let least = bodies.iter().flat_map(|body| body.corners.iter().map(|corner| field.at(body.cell, *corner)));
    let outside = least.fold(0.0, f64::min);
    let lattice = Lattice { low: bounds.low, sample: step / SAMPLES as f64, dims, outside };
    lattice.check_work(points, bodies, bounds.volume)?;
    let (values, missed) = lattice.filled(points, bodies, field, reading)?;
    let [x, y, z] = dims;
    let cells = counted(bodies.len() as u64, "cell");
    let remarks = &mut reading.notes.remarks;
    remarks.push(format!("{cells}, sampled as {x} x {y} x {z} voxels; outside them the value is {outside}"));
    reading.notes.value_outside = Some(outside);
    let remarks = &mut reading.notes.remarks;
    if bounds.flat > 0 {
        let flat = counted(bounds.flat, "cell");
        remarks.push(format!("{flat} of no volume, whose points lie in a plane: nothing is drawn of that"));
    }
    match bounds.folded {
        0 => {}
        folded => remarks.push(format!("{folded} of the cells are folded; what they cover twice counts once")),
    }
    if missed.bodies > 0 {
        let share = missed.volume / bounds.volume;
        let said = missed.said(bodies.len(), share);
        let is_much = share >= MUCH || missed.bodies as f64 >= MANY * bodies.len() as f64 || !missed.is_parted;
        if is_much { reading.notes.warnings.push(said) } else { reading.notes.remarks.push(said) }
    }
    Ok(Grid { origin, axes, dims, values })
}

/// The low and the high corner of the box around a body.
fn box_around(points: &[DVec3], body: &Body<'_>) -> DAabb {
    DAabb::of_points(body.corners.iter().map(|corner| points[*corner as usize]))
}

/// The thickness that all but the thinnest bodies have: the volume over the sides of a box around it, but for the shortest one.
fn thinnest(points: &[DVec3], bodies: &[Body<'_>], reading: &Reading<'_>) -> Result<f64, ReadError> {
    input::hold("the thickness of cells", size_of_val(bodies) as u64, reading.params)?;
    let mut thicknesses = Vec::new();
    input::reserve(&mut thicknesses, bodies.len())?;
    for body in bodies {
        let place = |corner: u32| Knot { place: points[corner as usize], value: 0.0 };
        let mut of_body = 0.0;
        body.part(&place, |t| of_body += volume(t).abs() / 6.0);
        let sides = box_around(points, body).size();
        let thickness = of_body * sides.min_element() / sides.element_product();
        thicknesses.extend((thickness > 0.0 && thickness.is_finite()).then_some(thickness));
    }
    let rank = (THINNEST * thicknesses.len() as f64) as usize;
    if rank >= thicknesses.len() {
        return Ok(f64::INFINITY);
    }
    Ok(*thicknesses.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Voxels with that side that boxes around bodies touch, all together.
fn touched(points: &[DVec3], bodies: &[Body<'_>], step: f64) -> f64 {
    bodies.iter().map(|body| (box_around(points, body).size() / step + 1.0).element_product()).sum()
}

/// Where the bodies lie.
struct Bounds {
    low: DVec3,
    size: DVec3,
    /// Of all bodies together.
    volume: f64,
    /// Bodies of which some tetrahedra are inside out and others not.
    folded: usize,
    /// Bodies without a volume.
    flat: u64,
}

impl Bounds {
    /// `None` without a volume, or for one that is no number.
    fn around(points: &[DVec3], bodies: &[Body<'_>]) -> Option<Self> {
        let place = |corner: u32| Knot { place: points[corner as usize], value: 0.0 };
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        let mut sum = 0.0;
        let mut folded = 0;
        let mut flat = 0;
        for body in bodies {
            let mut right = 0.0;
            let mut wrong = 0.0;
            body.part(&place, |t| match volume(t) {
                v if v < 0.0 => wrong -= v,
                v => right += v,
            });
            sum += (right + wrong) / 6.0;
            // Faces that are not quite flat may part off next to nothing.
            folded += usize::from(body.is_wound() && f64::min(right, wrong) > 1e-6 * f64::max(right, wrong));
            let around = box_around(points, body);
            flat += u64::from((right + wrong) / 6.0 <= FLAT * around.size().max_element().powi(3));
            low = low.min(around.min);
            high = high.max(around.max);
        }
        let size = high - low;
        let fits = |v: f64| (1e-280..1e280).contains(&v);
        (fits(sum) && fits(size.element_product())).then_some(Self { low, size, volume: sum, folded, flat })
    }

    /// The side of a voxel where so many bodies are of about one size.
    fn usual_step(&self, bodies: f64) -> f64 {
        let all = self.size.element_product();
        let of_a_body = libm::cbrt(self.volume / (bodies * VOXELS_PER_BODY));
        of_a_body.min(libm::cbrt(all / FEWEST)).max(libm::cbrt(all / MOST))
    }

    /// The side of a voxel with a sample in bodies of that thickness, as far as memory goes.
    fn fine_step(&self, usual: f64, thickness: f64, reading: &Reading<'_>) -> f64 {
        let all = self.size.element_product();
        let memory = reading.params.memory.left() as f64 / BYTES_OF_A_VOXEL;
        (SAMPLES as f64 * thickness).max(usual / SMALLER).max(libm::cbrt(all / MOST.min(memory)))
    }

    /// Voxels along each axis with about that side.
    fn dims(&self, step: f64) -> [usize; 3] {
        let mut step = step;
        loop {
            let dims = (self.size / step).round().max(DVec3::ONE);
            // Along a short side there is one voxel more than would be its share.
            if dims.element_product() <= 1.1 * MOST && dims.max_element() <= MOST_ALONG {
                return dims.to_array().map(|n| n as usize);
            }
            step *= 1.25;
        }
    }
}

/// Bodies with fewer samples than their volume stands for.
struct Missed {
    /// Which of the bodies, how many, and their volume.
    ranks: Vec<usize>,
    bodies: usize,
    volume: f64,
    /// Voxels of the volume.
    dims: [usize; 3],
    /// Whether they are parted exactly between voxels.
    is_parted: bool,
}

impl Missed {
    /// What there is to say of them, of so many bodies; `share` is that of the volume.
    fn said(&self, bodies: usize, share: f64) -> String {
        let [x, y, z] = self.dims;
        let what = format!(
            "{} of {} cells, with {:.2} % of their volume, are thinner than the samples of {x} x {y} x {z} voxels",
            self.bodies,
            bodies,
            100.0 * share
        );
        if self.is_parted {
            format!("{what}: a voxel has the mean of all cells in it, and single ones do not show")
        } else {
            format!(
                "{what}, and too many to be parted: some are drawn as thick as a sample, others not at all; draw a part of the dataset"
            )
        }
    }
}

/// The samples of a volume.
struct Lattice {
    /// The corner of the bounds.
    low: DVec3,
    /// From one sample to the next.
    sample: DVec3,
    /// Voxels.
    dims: [usize; 3],
    /// Value of the samples within no body.
    outside: f64,
}

/// Planes of voxels that are filled by one task.
struct Part<'a> {
    /// The first and the last sample along z.
    samples: [f64; 2],
    /// Sums of the samples of each voxel, above the value outside, times [`SHARE`].
    sums: &'a mut [f32],
    /// Samples of each voxel that lie within a body.
    taken: &'a mut [u8],
}

impl Lattice {
    /// The values of all voxels, and which bodies have too few samples.
    fn filled(
        &self,
        points: &[DVec3],
        bodies: &[Body<'_>],
        field: &Field,
        reading: &Reading<'_>,
    ) -> Result<(Vec<f32>, Missed), ReadError> {
        let [nx, ny, nz] = self.dims;
        let count = nx * ny * nz;
        let bytes = count * (size_of::<f32>() + size_of::<u8>()) + bodies.len() * size_of::<AtomicU64>();
        input::hold("the voxels", bytes as u64, reading.params)?;
        let mut sums = Vec::new();
        let mut taken = Vec::new();
        let mut met: Vec<AtomicU64> = Vec::new();
        input::reserve(&mut sums, count)?;
        input::reserve(&mut taken, count)?;
        input::reserve(&mut met, bodies.len())?;
        sums.resize(count, 0f32);
        taken.resize(count, 0u8);
        met.resize_with(bodies.len(), AtomicU64::default);
        let planes = nz.div_ceil(PARTS);
        let parts = sums.par_chunks_mut(nx * ny * planes).zip(taken.par_chunks_mut(nx * ny * planes)).enumerate();
        parts.try_for_each(|(i, (sums, taken))| {
            reading.go_on()?;
            let [first, end] = [i * planes, (i + 1) * planes].map(|plane| (plane.min(nz) * SAMPLES) as f64);
            let mut part = Part { samples: [first, end - 1.0], sums, taken };
            for (body, met) in bodies.iter().zip(&met) {
                let heights = body.corners.iter().map(|corner| points[*corner as usize].z - self.low.z);
                let (from, to) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
                if to >= first * self.sample.z && from <= end * self.sample.z {
                    let value = |corner: u32| field.at(body.cell, corner) - self.outside;
                    let corner = |c: u32| Knot { place: points[c as usize] - self.low, value: value(c) };
                    body.part(&corner, |t| {
                        met.fetch_add(self.fill(t, &mut part), Ordering::Relaxed);
                    });
                }
            }
            Ok::<(), ReadError>(())
        })?;
        drop(taken);
        let mut missed = self.missed(points, bodies, &met);
        if missed.bodies > 0 && self.can_part(points, bodies, &missed, reading) {
            let parts = self.parted(points, bodies, field, &missed, reading)?;
            missed.is_parted = parts.iter().all(Parting::is_whole);
            if missed.is_parted {
                for (part, sums) in parts.iter().zip(sums.chunks_mut(nx * ny * planes)) {
                    part.means().for_each(|(voxel, mean)| sums[voxel] = (0.5 * mean) as f32);
                }
            }
        }
        // A sum that was rounded may lie a little beyond the largest value.
        let low = f64::from(f32::MIN);
        let high = f64::from(f32::MAX);
        sums.par_iter_mut().for_each(|v| *v = (self.outside + 2.0 * f64::from(*v)).clamp(low, high) as f32);
        Ok((sums, missed))
    }

    /// The bodies that were met by fewer samples than their volume stands for.
    fn missed(&self, points: &[DVec3], bodies: &[Body<'_>], met: &[AtomicU64]) -> Missed {
        let place = |corner: u32| Knot { place: points[corner as usize] - self.low, value: 0.0 };
        let of_a_sample = self.sample.element_product();
        let mut missed = Missed { ranks: Vec::new(), bodies: 0, volume: 0.0, dims: self.dims, is_parted: false };
        for (rank, body) in bodies.iter().enumerate() {
            let mut size = 0.0;
            body.part(&place, |t| size += volume(t).abs() / 6.0);
            if (met[rank].load(Ordering::Relaxed) as f64) < MISSED * size / of_a_sample {
                missed.ranks.push(rank);
                missed.volume += size;
            }
        }
        missed.bodies = missed.ranks.len();
        missed
    }

    /// Whether there is time and memory to part missed bodies.
    fn can_part(&self, points: &[DVec3], bodies: &[Body<'_>], missed: &Missed, reading: &Reading<'_>) -> bool {
        let voxels = self.dims.iter().map(|n| *n as u64).product::<u64>();
        let step = SAMPLES as f64 * self.sample;
        let boxes = missed.ranks.iter().map(|rank| box_around(points, &bodies[*rank]).size() / step + 1.0);
        let touched: f64 = boxes.map(DVec3::element_product).sum();
        voxels * BYTES_OF_A_PARTED_VOXEL <= reading.params.memory.left() && touched <= MOST_PARTED
    }

    /// The voxels that missed bodies touch, with what all bodies put into them.
    fn parted(
        &self,
        points: &[DVec3],
        bodies: &[Body<'_>],
        field: &Field,
        missed: &Missed,
        reading: &Reading<'_>,
    ) -> Result<Vec<Parting>, ReadError> {
        let [nx, ny, nz] = self.dims;
        let planes = nz.div_ceil(PARTS);
        let step = SAMPLES as f64 * self.sample;
        let parting = |i: usize| -> Result<Parting, ReadError> {
            reading.go_on()?;
            let along_z = i * planes..((i + 1) * planes).min(nz);
            let mut parting = Parting::new(Planes { dims: USizeVec3::new(nx, ny, nz), along_z }, reading)?;
            let knot = |body: &Body<'_>, c: u32| Knot {
                place: (points[c as usize] - self.low) / step,
                value: field.at(body.cell, c) - self.outside,
            };
            for body in missed.ranks.iter().map(|rank| &bodies[*rank]) {
                parting.mark(body, &|c| knot(body, c));
            }
            input::hold("the shares of voxels", parting.bytes(), reading.params)?;
            if !parting.is_empty() {
                for body in bodies {
                    parting.fill(body, &|c| knot(body, c));
                }
            }
            Ok(parting)
        };
        (0..nz.div_ceil(planes)).into_par_iter().map(parting).collect()
    }

    /// Refuses bodies of that volume together which overlap so often that most of the work would be for nothing.
    fn check_work(&self, points: &[DVec3], bodies: &[Body<'_>], volume: f64) -> Result<(), ReadError> {
        let place = |corner: u32| Knot { place: points[corner as usize] - self.low, value: 0.0 };
        let mut rows = 0.0;
        for body in bodies {
            body.part(&place, |t| {
                let (low, high) =
                    t.iter().fold((t[0].place, t[0].place), |(l, h), knot| (l.min(knot.place), h.max(knot.place)));
                let across = ((high - low) / self.sample).ceil() + 1.0;
                rows += across.y * across.z;
            });
        }
        let samples = self.dims.iter().map(|n| (n * SAMPLES) as f64).product::<f64>();
        let work = rows + volume / self.sample.element_product();
        if work <= FREE_WORK.max(MOST_WORK * samples) {
            return Ok(());
        }
        let bounds = self.sample.element_product() * samples;
        let found = format!(
            "{} whose volumes are {:.0} times that of their bounds",
            counted(bodies.len() as u64, "cell"),
            volume / bounds
        );
        let hint = "remove the cells that lie on others, or draw pieces of the dataset one by one";
        Err(ReadError::limit("cells that lie side by side", found, hint))
    }

    /// Takes the samples that lie within a tetrahedron and in no body before it. Returns how many lie in it, those included.
    fn fill(&self, tetrahedron: &Tetrahedron, part: &mut Part<'_>) -> u64 {
        let [a, b, c, d] = tetrahedron.map(|knot| knot.place);
        let values = tetrahedron.map(|knot| knot.value);
        let edges = DMat3::from_cols(b - a, c - a, d - a);
        let determinant = edges.determinant();
        if !(determinant.is_finite() && determinant != 0.0) {
            return 0;
        }
        let mut met = 0;
        // Barycentric coordinates of the first sample of a row, and what each step adds.
        let inverse = edges.inverse();
        let weights = |w: DVec3| DVec4::new(-w.element_sum(), w.x, w.y, w.z);
        let along = weights(inverse.x_axis * self.sample.x);
        let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
        let [nx, ny, _] = self.dims;
        let first = (a.min(b).min(c).min(d) / self.sample - 0.5).ceil().max(DVec3::ZERO);
        let last = (a.max(b).max(c).max(d) / self.sample - 0.5).floor();
        let last = last.min(DVec3::new((nx * SAMPLES - 1) as f64, (ny * SAMPLES - 1) as f64, part.samples[1]));
        let rows = |from: f64, to: f64| if from <= to { from as usize..to as usize + 1 } else { 0..0 };
        for k in rows(first.z.max(part.samples[0]), last.z) {
            for j in rows(first.y, last.y) {
                let row = (DVec3::new(0.0, j as f64, k as f64) + 0.5) * self.sample;
                let before = DVec4::X + weights(inverse * (row - a));
                let (from, to) = inside(before, along, (first.x, last.x));
                let plane = k / SAMPLES - part.samples[0] as usize / SAMPLES;
                let within = rows(from.ceil(), to.floor());
                met += within.len() as u64;
                for i in within {
                    let voxel = i / SAMPLES + nx * (j / SAMPLES + ny * plane);
                    let bit = 1 << (i % SAMPLES + SAMPLES * (j % SAMPLES + SAMPLES * (k % SAMPLES)));
                    if part.taken[voxel] & bit == 0 {
                        part.taken[voxel] |= bit;
                        let value = (before + i as f64 * along).dot(DVec4::from_array(values));
                        // NaN is a gap; of four of them there is no range either.
                        let value = if value.is_nan() { value } else { value.clamp(least, most) };
                        part.sums[voxel] += (value * SHARE) as f32;
                    }
                }
            }
        }
        met
    }
}

/// From where to where a row lies within all four faces, of a range of it.
fn inside(before: DVec4, along: DVec4, range: (f64, f64)) -> (f64, f64) {
    before.to_array().into_iter().zip(along.to_array()).fold(range, |(from, to), (before, along)| {
        let crossing = (-SLACK - before) / along;
        match along {
            _ if along > 0.0 => (from.max(crossing), to),
            _ if along < 0.0 => (from, to.min(crossing)),
            _ if before < -SLACK => (1.0, 0.0),
            _ => (from, to),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadParams;
    use crate::volumes::cells::solid::{HEXAHEDRON, TETRAHEDRON};

    fn block(low: DVec3, high: DVec3) -> Vec<DVec3> {
        let ends = [low, high];
        let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        corners.iter().map(|[x, y, z]| DVec3::new(ends[*x].x, ends[*y].y, ends[*z].z)).collect()
    }

    fn sampled(points: &[DVec3], bodies: &[Body<'_>], field: &Field) -> Grid {
        grid(points, bodies, Place::File, field, &mut Reading::new(&ReadParams::default(), None)).unwrap()
    }

    fn mass(grid: &Grid) -> f64 {
        grid.values.iter().map(|v| f64::from(*v)).sum::<f64>() * grid.cell_volume()
    }

    #[test]
    fn a_linear_field_stays_linear_and_keeps_its_integral() {
        for shift in [0.0, 1e7] {
            let points = block(DVec3::splat(shift), DVec3::new(3.0, 1.0, 2.0) + shift);
            let linear = |p: DVec3| 1.0 + (p - shift).dot(DVec3::new(2.0, -0.5, 0.25));
            let field = Field::Points(points.iter().map(|p| linear(*p)).collect());
            let corners: Vec<u32> = (0..8).collect();
            let grid = sampled(&points, &[Body { cell: 0, corners: &corners, faces: Faces::Of(&HEXAHEDRON) }], &field);
            let [nx, ny, _] = grid.dims;
            for (n, v) in grid.values.iter().enumerate() {
                let lattice = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64);
                let expected = linear(grid.origin + grid.axes * lattice);
                assert!((f64::from(*v) - expected).abs() < 2e-6 * 7.0, "{v} for {expected}");
            }
            let expected = 6.0 * linear(DVec3::new(1.5, 0.5, 1.0) + shift);
            assert!((mass(&grid) / expected - 1.0).abs() < 1e-6, "{}", mass(&grid));
        }
    }

    #[test]
    fn values_as_large_as_single_precision_has_them_stay_numbers() {
        let points = block(DVec3::ZERO, DVec3::ONE);
        let corners = (0..8).collect::<Vec<u32>>();
        let sampled = |largest: f32| {
            let signs = [1.0, -1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0];
            let field = Field::Points(signs.map(|sign| sign * f64::from(largest)).to_vec());
            sampled(&points, &[Body { cell: 0, corners: &corners, faces: Faces::Of(&HEXAHEDRON) }], &field).values
        };
        let small = sampled(1.0);
        let large = sampled(f32::MAX);
        assert!(large.iter().zip(&small).all(|(l, s)| (l / f32::MAX - s).abs() < 1e-6), "{large:?}");
    }

    /// Its border runs through voxels: of the samples that it parts half belong to it.
    #[test]
    fn a_tetrahedron_keeps_its_volume_inside_out_too() {
        let points = [DVec3::ZERO, DVec3::new(1.0, 0.1, 0.0), DVec3::new(0.2, 0.9, 0.1), DVec3::new(0.3, 0.2, 1.1)];
        let expected = volume(&points.map(|place| Knot { place, value: 0.0 })) / 6.0;
        for corners in [[0, 1, 2, 3], [0, 2, 1, 3]] {
            let body = Body { cell: 0, corners: &corners, faces: Faces::Of(&TETRAHEDRON) };
            let grid = sampled(&points, &[body], &Field::One);
            assert!((mass(&grid) / expected - 1.0).abs() < 5e-3, "{} for {expected}", mass(&grid));
            assert!(grid.values.iter().all(|v| (0.0..=1.0).contains(v)));
        }
    }

    /// Flat blocks one on the other, between these heights.
    fn layers(heights: &[f64]) -> (Vec<DVec3>, Vec<Vec<u32>>) {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let points = heights.iter().flat_map(|z| square.map(|[x, y]| DVec3::new(x, y, *z))).collect();
        let cells = (0..heights.len() as u32 - 1).map(|k| (4 * k..4 * k + 8).collect()).collect();
        (points, cells)
    }

    fn hexahedra(cells: &[Vec<u32>]) -> Vec<Body<'_>> {
        let body = |(cell, corners)| Body { cell, corners: Vec::as_slice(corners), faces: Faces::Of(&HEXAHEDRON) };
        cells.iter().enumerate().map(body).collect()
    }

    fn sampled_with_notes(points: &[DVec3], bodies: &[Body<'_>], field: &Field) -> (Grid, crate::Notes) {
        let params = ReadParams::default();
        let mut reading = Reading::new(&params, None);
        let grid = grid(points, bodies, Place::File, field, &mut reading).unwrap();
        (grid, reading.notes)
    }

    /// Every voxel has the mean of the layers in it, as the integral of a step function has it.
    #[test]
    fn layers_thinner_than_a_voxel_keep_their_integral_and_are_told() {
        let n = 230;
        let heights: Vec<f64> = (0..=n).map(|k| f64::from(k) / f64::from(n)).collect();
        let (points, cells) = layers(&heights);
        let values: Vec<f64> = (0..n).map(|k| f64::from(k % 2 + k % 7)).collect();
        let field = Field::Cells(values.clone());
        let (found, notes) = sampled_with_notes(&points, &hexahedra(&cells), &field);
        let expected = values.iter().sum::<f64>() / f64::from(n);
        assert!((mass(&found) / expected - 1.0).abs() < 1e-6, "{} for {expected}", mass(&found));
        let [nx, ny, nz] = found.dims;
        for (k, plane) in found.values.chunks(nx * ny).enumerate() {
            let ends = [k, k + 1].map(|k| k as f64 / nz as f64);
            let shares =
                heights.windows(2).map(|pair| (pair[1].min(ends[1]) - pair[0].max(ends[0])).max(0.0) * nz as f64);
            let expected: f64 = shares.zip(&values).map(|(share, value)| share * value).sum();
            assert!(plane.iter().all(|v| (f64::from(*v) - expected).abs() < 1e-5), "{k}: {} for {expected}", plane[0]);
        }
        assert_eq!(notes.warnings.len(), 1, "{notes:?}");
        assert!(
            notes.warnings[0].contains(" of 230 cells, with ") && notes.warnings[0].contains("a voxel has the mean")
        );
    }

    /// A voxel's half is no thinner than they are.
    #[test]
    fn voxels_become_smaller_for_thin_layers() {
        let heights: Vec<f64> = (0..=180).map(|k| f64::from(k) / 180.0).collect();
        let (points, cells) = layers(&heights);
        let field = Field::Cells((0..180).map(|k| f64::from(k % 2)).collect());
        let (found, notes) = sampled_with_notes(&points, &hexahedra(&cells), &field);
        assert!(found.dims[2] > 64 && notes.warnings.is_empty(), "{:?} {notes:?}", found.dims);
        assert!((mass(&found) / 0.5 - 1.0).abs() < 1e-2, "{}", mass(&found));
    }

    #[test]
    fn a_sheet_far_thinner_than_a_sample_is_there_with_all_of_its_mass() {
        let (mut points, mut cells) = layers(&[0.0, 1.0]);
        points.extend(layers(&[2.0, 2.0001]).0);
        cells.push((8..16).collect());
        let (found, notes) = sampled_with_notes(&points, &hexahedra(&cells), &Field::Cells(vec![0.0, 1e4]));
        assert!((mass(&found) - 1.0).abs() < 1e-4, "{}", mass(&found));
        assert!(notes.warnings.is_empty() || notes.warnings[0].starts_with("1 of 2 cells"), "{notes:?}");
        assert!(notes.remarks.iter().chain(&notes.warnings).any(|said| said.contains("1 of 2 cells, with 0.01 %")));
    }

    #[test]
    fn a_point_without_a_value_takes_what_is_beside_it_and_not_the_cell() {
        let points = block(DVec3::ZERO, DVec3::ONE);
        let values = (0..8).map(|i| if i == 6 { f64::NAN } else { 3.0 }).collect();
        let corners: Vec<u32> = (0..8).collect();
        let body = Body { cell: 0, corners: &corners, faces: Faces::Of(&HEXAHEDRON) };
        let found = sampled(&points, &[body], &Field::Points(values)).values;
        let gaps = found.iter().filter(|v| v.is_nan()).count() as f64 / found.len() as f64;
        // Six of its 24 tetrahedra have the point, and voxels at their border count among them.
        assert!(gaps > 0.25 && gaps < 0.29, "{gaps}");
        assert!(found.iter().all(|v| v.is_nan() || (v - 3.0).abs() < 1e-6));
    }

    #[test]
    fn cells_side_by_side_leave_no_gap_and_count_nothing_twice() {
        let n = 5;
        let at = |i: usize| DVec3::new((i % 6) as f64, (i / 6 % 6) as f64, (i / 36) as f64);
        // Inner points are moved, so that faces are not flat.
        let moved = |p: DVec3| {
            let wave = DVec3::new(libm::sin(3.0 * p.y + p.z), libm::sin(5.0 * p.z + p.x), libm::sin(4.0 * p.x + p.y));
            let is_inner = p.min_element() > 0.0 && p.max_element() < 5.0;
            if is_inner { p + 0.2 * wave } else { p }
        };
        let points: Vec<DVec3> = (0..216).map(|i| moved(at(i))).collect();
        let lists: Vec<[u32; 8]> = (0..n * n * n)
            .map(|c| {
                let first = c % n + 6 * (c / n % n) + 36 * (c / n / n);
                [0, 1, 7, 6, 36, 37, 43, 42].map(|step| (first + step) as u32)
            })
            .collect();
        let bodies = |order: &[usize]| -> Vec<Body<'_>> {
            order.iter().map(|c| Body { cell: *c, corners: &lists[*c], faces: Faces::Of(&HEXAHEDRON) }).collect()
        };
        let forth: Vec<usize> = (0..lists.len()).collect();
        let grid = sampled(&points, &bodies(&forth), &Field::One);
        assert!(grid.values.iter().all(|v| *v == 1.0));
        let back: Vec<usize> = forth.iter().rev().copied().collect();
        assert_eq!(sampled(&points, &bodies(&back), &Field::One), grid);
    }
}
