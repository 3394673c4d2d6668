//! Rectilinear grids (`vti`, `vtk`): a lattice whose steps differ becomes one of even steps.
//!
//! Values between the points of the file are interpolated linearly along each axis. The even step is the least step of the file, so that
//! little is lost; where that made too many voxels, a voxel has the mean of what lies within half a step of it. What is lost at the points of the
//! file is measured and said.

use super::lattice;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use rayon::prelude::*;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// How far a coordinate may lie from its place at even steps, in mean steps: what rounding to single precision does to times and angles.
const EVEN: f64 = 1e-3;

/// Voxels that are made of a grid of uneven steps: as many as this, or so many for each of its points, and no more than the most.
const ALWAYS: f64 = (1u64 << 24) as f64;
const PER_POINT: f64 = 8.0;
const MOST: f64 = (1u64 << 27) as f64;

/// By what the steps grow until the voxels fit.
const COARSER: f64 = 1.1;

/// The share of the range from which what is lost is worth a warning.
const MUCH: f64 = 0.05;

/// How much longer than the least step of the file an even one is that means are taken over.
const LONGER: f64 = 1.001;

/// Coordinates of the points along x, y and z, and where they are told of.
pub(crate) struct Rectilinear {
    pub(crate) coordinates: [Vec<f64>; 3],
    pub(crate) place: Place,
}

/// One axis of a grid.
struct Axis<'a> {
    coordinates: &'a [f64],
    /// The least and the largest step, which are positive; 0 of a single coordinate.
    least: f64,
    most: f64,
    /// −1 where the coordinates fall.
    sign: f64,
    is_even: bool,
}

/// Between which two neighbours a place along an axis lies.
#[derive(Clone, Copy)]
struct Between {
    low: usize,
    high: usize,
    /// Of the second one.
    weight: f64,
}

/// Values on a lattice.
#[derive(Clone, Copy)]
struct Values<'a> {
    dims: [usize; 3],
    values: &'a [f32],
}

/// Values whose means were taken along some axes.
struct Means {
    dims: [usize; 3],
    values: Vec<f32>,
}

/// A mean of points of the file along an axis.
struct Mean {
    /// The rank of the first of them.
    first: usize,
    /// The weights of it and of those behind it.
    weights: Vec<f64>,
}

impl Means {
    fn lattice(&self) -> Values<'_> {
        Values { dims: self.dims, values: &self.values }
    }
}

impl Rectilinear {
    /// Points along each axis.
    pub(crate) fn dims(&self) -> [u64; 3] {
        [0, 1, 2].map(|axis| self.coordinates[axis].len() as u64)
    }

    /// The grid of the middles of the cells; along an axis of one point there is one, at that point.
    pub(crate) fn of_cells(&self) -> Self {
        let middles = |coordinates: &Vec<f64>| match coordinates.as_slice() {
            [one] => vec![*one],
            several => several.windows(2).map(|pair| 0.5 * pair[0] + 0.5 * pair[1]).collect(),
        };
        let [x, y, z] = &self.coordinates;
        Self { coordinates: [middles(x), middles(y), middles(z)], place: self.place }
    }

    /// All points, x fastest.
    pub(crate) fn points(&self) -> impl Iterator<Item = DVec3> {
        let [x, y, z] = &self.coordinates;
        z.iter().flat_map(move |z| y.iter().flat_map(move |y| x.iter().map(move |x| DVec3::new(*x, *y, *z))))
    }

    /// Refuses coordinates that neither rise nor fall throughout.
    pub(crate) fn check(&self) -> Result<(), ReadError> {
        self.axes().map(|_| ())
    }

    fn axes(&self) -> Result<[Axis<'_>; 3], ReadError> {
        let axis = |rank: usize| Axis::of_coordinates(&self.coordinates[rank], ["x", "y", "z"][rank], self.place);
        Ok([axis(0)?, axis(1)?, axis(2)?])
    }

    /// The volume of the values of its points, as many as there are.
    pub(crate) fn grid(&self, values: Vec<f32>, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
        let axes = self.axes()?;
        let stored = [0, 1, 2].map(|axis| self.coordinates[axis].len());
        let (dims, is_coarse) = even_dims(&axes);
        let (origin, steps) = lattice_of(&axes, dims);
        let diagonal = DMat3::from_diagonal(steps);
        lattice::check(origin, &diagonal, self.place, "resample the grid onto even steps, such as with ParaView")?;
        if axes.iter().all(|axis| axis.is_even) {
            return Ok(Grid { origin, axes: diagonal, dims, values });
        }
        let count = dims.iter().product::<usize>();
        input::hold("the voxels of even steps", (count * size_of::<f32>()) as u64, reading.params)?;
        let uneven = Values { dims: stored, values: &values };
        let means = uneven.means(&axes, dims, reading)?;
        let source = means.as_ref().map_or(uneven, Means::lattice);
        let to = [0, 1, 2].map(|rank| {
            if source.dims[rank] == stored[rank] { axes[rank].places_of(dims[rank]) } else { as_they_are(dims[rank]) }
        });
        let mut even = Vec::new();
        input::reserve(&mut even, count)?;
        even.resize(count, 0f32);
        even.par_chunks_mut(dims[0] * dims[1]).enumerate().try_for_each(|(k, plane)| {
            reading.go_on()?;
            for (n, value) in plane.iter_mut().enumerate() {
                *value = source.between(to[0][n % dims[0]], to[1][n / dims[0]], to[2][k]) as f32;
            }
            Ok::<(), ReadError>(())
        })?;
        let lost = lost(uneven, Values { dims, values: &even }, &axes);
        let said = told(&axes, dims, is_coarse, lost);
        if lost > MUCH {
            reading.notes.warnings.push(said)
        } else {
            reading.notes.remarks.push(said)
        }
        Ok(Grid { origin, axes: diagonal, dims, values: even })
    }
}

/// Voxels along each axis for even steps, and whether these are longer than the least of the file.
fn even_dims(axes: &[Axis<'_>; 3]) -> ([usize; 3], bool) {
    let points: f64 = axes.iter().map(|axis| axis.count() as f64).product();
    let most = (PER_POINT * points).clamp(ALWAYS, MOST);
    // A step beside which another is out of all proportion would be refused.
    let longest = axes.iter().map(|axis| if axis.is_even { axis.most } else { axis.least }).fold(0.0, f64::max);
    let shortest = 1.001 * longest / lattice::MAX_ASPECT;
    let dims = |scale: f64| {
        let along = |axis: &Axis<'_>| if axis.is_even { axis.count() as f64 } else { axis.even_count(scale, shortest) };
        DVec3::new(along(&axes[0]), along(&axes[1]), along(&axes[2]))
    };
    let is_finest = |dims: DVec3| axes.iter().zip(dims.to_array()).all(|(axis, n)| axis.is_even || n <= 2.0);
    let mut scale = 1.0;
    // A step that is tiny beside its axis would make numbers of steps that no loop ends.
    while dims(scale).element_product() > most && !is_finest(dims(scale)) && scale.is_finite() {
        scale *= COARSER;
    }
    let is_coarse = scale > 1.0 || axes.iter().any(|axis| !axis.is_even && axis.least < shortest);
    (dims(scale).to_array().map(|n| n as usize), is_coarse)
}

/// The first point of a lattice of so many voxels, and its steps; an axis of one point has the shortest step of the others.
fn lattice_of(axes: &[Axis<'_>; 3], dims: [usize; 3]) -> (DVec3, DVec3) {
    let step = |rank: usize| match dims[rank] {
        1 => 0.0,
        n => axes[rank].length() / (n - 1) as f64,
    };
    let steps = [step(0), step(1), step(2)];
    let shortest = steps.iter().copied().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let shortest = if shortest.is_finite() { shortest } else { 1.0 };
    let signed = [0, 1, 2].map(|rank| if steps[rank] > 0.0 { axes[rank].sign * steps[rank] } else { shortest });
    (DVec3::from_array([0, 1, 2].map(|rank| axes[rank].coordinates[0])), DVec3::from_array(signed))
}

/// Places of points that stay where they are.
fn as_they_are(count: usize) -> Vec<Between> {
    (0..count).map(|i| Between { low: i, high: i, weight: 0.0 }).collect()
}

/// The most by which the even values differ from those of the file at its points, as a share of their range.
fn lost(uneven: Values<'_>, even: Values<'_>, axes: &[Axis<'_>; 3]) -> f64 {
    let [nx, ny, _] = uneven.dims;
    let places = [0, 1, 2].map(|rank| axes[rank].places_within(even.dims[rank]));
    let most = |a: f64, b: f64| a.max(b);
    let lost = uneven.values.par_chunks(nx * ny).enumerate().map(|(k, plane)| {
        let difference = |(n, value): (usize, &f32)| {
            let difference = even.between(places[0][n % nx], places[1][n / nx], places[2][k]) - f64::from(*value);
            if difference.is_nan() { 0.0 } else { difference.abs() }
        };
        plane.iter().enumerate().map(difference).fold(0.0, most)
    });
    let lost = lost.reduce(|| 0.0, most);
    let low = uneven.values.par_iter().copied().reduce(|| f32::INFINITY, f32::min);
    let high = uneven.values.par_iter().copied().reduce(|| f32::NEG_INFINITY, f32::max);
    let range = f64::from(high) - f64::from(low);
    if range > 0.0 { lost / range } else { 0.0 }
}

/// The remark that the steps are made even.
fn told(axes: &[Axis<'_>; 3], dims: [usize; 3], is_coarse: bool, lost: f64) -> String {
    let uneven = axes.iter().zip(["x", "y", "z"]).filter(|(axis, _)| !axis.is_even);
    let steps = uneven.map(|(axis, name)| format!("from {} to {} along {name}", axis.least, axis.most));
    let steps = steps.collect::<Vec<_>>().join(", ");
    let [x, y, z] = dims;
    let coarse =
        if is_coarse { ", coarser than the least step because of other steps or the number of voxels" } else { "" };
    let lost = 100.0 * lost;
    format!(
        "steps {steps}: interpolated linearly as {x} x {y} x {z} voxels of even steps{coarse}; at the points of the file the values differ \
         by at most {lost:.2} % of their range"
    )
}

impl<'a> Axis<'a> {
    fn of_coordinates(coordinates: &'a [f64], name: &str, place: Place) -> Result<Self, ReadError> {
        let sign = if coordinates.len() > 1 && coordinates[1] < coordinates[0] { -1.0 } else { 1.0 };
        let mut axis = Self { coordinates, least: f64::INFINITY, most: 0.0, sign, is_even: true };
        for (i, pair) in coordinates.windows(2).enumerate() {
            let step = sign * (pair[1] - pair[0]);
            if !(step > 0.0 && step.is_finite()) {
                let expected = format!("coordinates along {name} that rise or fall throughout");
                let found = format!("{} at point {i} and {} at the next", pair[0], pair[1]);
                return Err(ReadError::input(place, expected, found, HINT));
            }
            (axis.least, axis.most) = (axis.least.min(step), axis.most.max(step));
        }
        match coordinates {
            [] => Err(ReadError::input(place, format!("a coordinate along {name}"), "none", HINT)),
            [one] if one.is_finite() => Ok(Self { least: 0.0, ..axis }),
            several if axis.length().is_finite() && several[0].is_finite() => {
                let step = axis.length() / (several.len() - 1) as f64;
                let off = |(i, c): (usize, &f64)| (sign * (c - several[0]) - i as f64 * step).abs() > EVEN * step;
                axis.is_even = !several.iter().enumerate().any(off);
                Ok(axis)
            }
            _ => Err(ReadError::input(place, format!("finite coordinates along {name}"), "others", HINT)),
        }
    }

    fn count(&self) -> usize {
        self.coordinates.len()
    }

    /// From the first point to the last.
    fn length(&self) -> f64 {
        match self.coordinates {
            [first, .., last] => self.sign * (last - first),
            _ => 0.0,
        }
    }

    /// Points of even steps that are so many times as long as the least of the axis, or as `shortest`.
    fn even_count(&self, scale: f64, shortest: f64) -> f64 {
        // A step that is a part too many in 10⁶ is the rounding of a whole number of them.
        ((self.length() / (self.least.max(shortest) * scale) - 1e-6).ceil() + 1.0).max(2.0)
    }

    /// The coordinate of point `i`, counted from the first along the axis.
    fn along(&self, i: usize) -> f64 {
        self.sign * (self.coordinates[i] - self.coordinates[0])
    }

    /// Where so many points of even steps lie among those of the file.
    fn places_of(&self, count: usize) -> Vec<Between> {
        let last = self.count() - 1;
        if self.is_even || count == 1 {
            return as_they_are(count);
        }
        let step = self.length() / (count - 1) as f64;
        let mut low = 0;
        let place = |i: usize| {
            let along = i as f64 * step;
            while low + 1 < last && self.along(low + 1) <= along {
                low += 1;
            }
            let weight = (along - self.along(low)) / (self.along(low + 1) - self.along(low));
            Between { low, high: low + 1, weight: weight.clamp(0.0, 1.0) }
        };
        (0..count).map(place).collect()
    }

    /// The means around so many points of even steps. A mean is over half a step to both sides, at the ends over nothing, so that a linear field stays as it is.
    fn means_of(&self, count: usize) -> Vec<Mean> {
        let step = self.length() / (count - 1) as f64;
        let last = self.count() - 1;
        let mut low = 0;
        let mean = |i: usize| {
            if i == 0 || i + 1 == count {
                return Mean { first: if i == 0 { 0 } else { last }, weights: vec![1.0] };
            }
            let from = (i as f64 - 0.5) * step;
            let to = (i as f64 + 0.5) * step;
            while low + 1 < last && self.along(low + 1) <= from {
                low += 1;
            }
            let mut weights = vec![0.0];
            let mut rank = low;
            while rank < last && self.along(rank) < to {
                let ends = [self.along(rank), self.along(rank + 1)];
                let part = [ends[0].max(from), ends[1].min(to)];
                let share = (part[1] - part[0]).max(0.0) / step;
                let middle = (0.5 * (part[0] + part[1]) - ends[0]) / (ends[1] - ends[0]);
                weights[rank - low] += share * (1.0 - middle);
                weights.push(share * middle);
                rank += 1;
            }
            Mean { first: low, weights }
        };
        (0..count).map(mean).collect()
    }

    /// Where the points of the file lie among so many of even steps.
    fn places_within(&self, count: usize) -> Vec<Between> {
        if self.is_even || count == 1 {
            return (0..self.count()).map(|i| Between { low: i, high: i, weight: 0.0 }).collect();
        }
        let step = self.length() / (count - 1) as f64;
        let place = |i: usize| {
            let along = self.along(i) / step;
            let low = (along as usize).min(count - 2);
            Between { low, high: low + 1, weight: (along - low as f64).clamp(0.0, 1.0) }
        };
        (0..self.count()).map(place).collect()
    }
}

impl Values<'_> {
    /// The values with means along the axes whose steps in so many voxels are longer than the least of the file; `None` without such axes.
    fn means(&self, axes: &[Axis<'_>; 3], dims: [usize; 3], reading: &Reading<'_>) -> Result<Option<Means>, ReadError> {
        let mut found: Option<Means> = None;
        for (rank, axis) in axes.iter().enumerate() {
            let is_longer = dims[rank] > 1 && axis.length() / (dims[rank] - 1) as f64 > LONGER * axis.least;
            if axis.is_even || !is_longer || dims[rank] == axis.count() {
                continue;
            }
            let before = found.as_ref().map_or(*self, Means::lattice);
            let mut sizes = before.dims;
            sizes[rank] = dims[rank];
            let count = sizes.iter().product::<usize>();
            input::hold("the means along an axis", (count * size_of::<f32>()) as u64, reading.params)?;
            let mut means = Vec::new();
            input::reserve(&mut means, count)?;
            means.resize(count, 0f32);
            let weights = axis.means_of(dims[rank]);
            let stride: usize = before.dims[..rank].iter().product();
            means.par_chunks_mut(sizes[0] * sizes[1]).enumerate().try_for_each(|(k, plane)| {
                reading.go_on()?;
                for (n, mean) in plane.iter_mut().enumerate() {
                    let mut place = [n % sizes[0], n / sizes[0], k];
                    let Mean { first, weights } = &weights[place[rank]];
                    place[rank] = *first;
                    let first = place[0] + before.dims[0] * (place[1] + before.dims[1] * place[2]);
                    *mean = mean_of(weights, |i| f64::from(before.values[first + i * stride])) as f32;
                }
                Ok::<(), ReadError>(())
            })?;
            found = Some(Means { dims: sizes, values: means });
        }
        Ok(found)
    }

    /// The value between neighbours along all three axes.
    fn between(&self, x: Between, y: Between, z: Between) -> f64 {
        let [nx, ny, _] = self.dims;
        let row = |j: usize, k: usize| {
            let value = |i: usize| f64::from(self.values[i + nx * (j + ny * k)]);
            mixed(x, value)
        };
        mixed(z, |k| mixed(y, |j| row(j, k)))
    }
}

/// The weighted mean of the values that are numbers; NaN where they have less than half of the weight.
fn mean_of(weights: &[f64], value: impl Fn(usize) -> f64) -> f64 {
    let mut sum = 0.0;
    let mut whole = 0.0;
    for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        let value = value(i);
        if !value.is_nan() {
            sum += weight * value;
            whole += weight;
        }
    }
    if whole < 0.5 { f64::NAN } else { sum / whole }
}

/// The weighted mean of two neighbours; one of no weight may be NaN.
fn mixed(place: Between, value: impl Fn(usize) -> f64) -> f64 {
    match place.weight {
        0.0 => value(place.low),
        1.0 => value(place.high),
        weight => (1.0 - weight) * value(place.low) + weight * value(place.high),
    }
}
