//! Media side by side: the closed form of [`crate::building::overlap`] for many footprints at once.
//!
//! Nearly all translucent splats are media whose kernel overlaps a few cells away from every edge of the table. A loop
//! maps their positions, and another makes footprints of them. Plain footprints (no edge between octants, no sampling,
//! at most [`MOST`] cells a side) queue by size. The others take the way of [`crate::building::deposit`]. A full queue
//! is overlapped with its cells step by step: first row and first column of all footprints, first row and second
//! column of all, and so on. The arithmetic is that of [`Axis`], so that a footprint leaves the same bits whichever
//! way it takes.

use crate::building::caster::Casters;
use crate::building::deposit::{Band, is_plain};
use crate::building::entries::{Cells, Entries};
use crate::building::lanes::{Columns, LANES, Lane, MOST, Queue, Queues, batches};
use crate::building::overlap::{Ellipse, Spread, Widths};
use crate::building::shares::Axis;
use crate::building::surfaces::plane_distances;
use crate::frame::Frame;
use crate::mapping::{Mapping, View};
use glam::{Vec2, Vec3};
use splat_core::glam;

/// Columns of a splat.
const POSITION: usize = 0;
const RADIUS: usize = 3;
const CROSS_SECTION: usize = 4;
const DEVIATION: usize = 5;
const SPLAT: usize = 6;

/// Columns of a footprint: column and row, half widths, columns from a row to the next, K/d², d, colour.
pub(crate) const AT: usize = 0;
const HALF: usize = 2;
const SLANT: usize = 4;
pub(crate) const TOTAL: usize = 5;
pub(crate) const DISTANCE: usize = 6;
pub(crate) const RGB: usize = 7;
pub(crate) const FOOTPRINT: usize = 10;

/// One axis of all footprints, as in [`Axis`].
#[derive(Debug)]
struct Axes {
    at: Lane,
    half: Lane,
    inverse: Lane,
    cut: Lane,
    tail: Lane,
    scale: Lane,
    first: Lane<i32>,
    last: Lane<i32>,
    /// Fraction below the lower edge of the next cell.
    below: Lane,
}

impl Axes {
    #[inline(always)]
    fn new(at: &Lane, half: &Lane) -> Self {
        let nought = [0.0; LANES];
        let inverse = nought;
        let cut = nought;
        let tail = nought;
        let scale = nought;
        let below = nought;
        let first = [0; LANES];
        let last = [0; LANES];
        let mut axes = Self { at: *at, half: *half, inverse, cut, tail, scale, first, last, below };
        for l in 0..LANES {
            let axis = Axis::new(at[l], half[l]);
            axes.inverse[l] = axis.inverse;
            axes.cut[l] = axis.cut;
            axes.tail[l] = axis.tail;
            axes.scale[l] = axis.scale;
            axes.first[l] = axis.first;
            axes.last[l] = axis.last;
            axes.below[l] = axis.below(axis.start());
        }
        axes
    }

    #[inline(always)]
    fn get(&self, l: usize) -> Axis {
        Axis {
            at: self.at[l],
            half: self.half[l],
            inverse: self.inverse[l],
            cut: self.cut[l],
            tail: self.tail[l],
            scale: self.scale[l],
            first: self.first[l],
            last: self.last[l],
        }
    }

    /// Moves all to other places.
    #[inline(always)]
    fn shift(&mut self, at: &Lane) {
        for l in 0..LANES {
            let axis = self.get(l).moved(at[l]);
            self.at[l] = axis.at;
            self.first[l] = axis.first;
            self.last[l] = axis.last;
            self.below[l] = axis.below(axis.start());
        }
    }

    /// The share of cell `k` of footprint `l`, after those of all cells before it.
    #[inline(always)]
    fn next_share(&mut self, l: usize, k: i32) -> f32 {
        let axis = self.get(l);
        let upper = axis.below(axis.start() + (k + 1) as f32);
        upper - std::mem::replace(&mut self.below[l], upper)
    }

    /// Greatest number of cells among the first `n`.
    #[inline(always)]
    fn most_cells(&self, n: usize) -> i32 {
        self.first[..n].iter().zip(&self.last).map(|(first, last)| last - first + 1).max().unwrap_or(0)
    }
}

/// Media of one worker on their way to entries.
#[derive(Debug, Default)]
pub(crate) struct MediaBatches {
    splats: Columns<SPLAT>,
    footprints: Columns<FOOTPRINT>,
    queues: Queues<FOOTPRINT>,
}

#[cfg(feature = "gpu")]
impl MediaBatches {
    /// Parts media that are plain from those that take another way; those that cover no cell are neither.
    #[inline(always)]
    pub(crate) fn part<M: Mapping>(
        &mut self,
        mapping: &M,
        wide: Band,
        casters: &Casters<'_>,
        frame: &Frame,
        ids: &[u32],
        plain: &mut Vec<u32>,
        others: &mut Vec<u32>,
    ) {
        for batch in batches(ids) {
            load(&mut self.splats, casters, batch, frame);
            fill(&mut self.footprints, mapping, wide, &self.splats);
            self.footprints.part(batch, plain, others);
        }
    }
}

/// Where entries come from and go to.
pub(crate) struct Target<'a, M: Mapping, const C: usize> {
    pub(crate) mapping: &'a M,
    /// Distance behind which each cell takes no entries; empty where there is no end.
    pub(crate) ends: &'a [f32],
    /// Where rays begin to sample footprints of media.
    pub(crate) wide: Band,
    pub(crate) entries: &'a mut Entries<C>,
}

impl<M: Mapping, const C: usize> Target<'_, M, C> {
    /// Adds media; those that are not plain go to `others`.
    #[inline(always)]
    pub(crate) fn add_media(
        &mut self,
        casters: &Casters<'_>,
        frame: &Frame,
        ids: &[u32],
        work: &mut MediaBatches,
        others: &mut Vec<u32>,
    ) {
        let MediaBatches { splats, footprints, queues } = work;
        for batch in batches(ids) {
            load(splats, casters, batch, frame);
            fill(footprints, self.mapping, self.wide, splats);
            self.leave_out_dark(footprints, batch.len());
            for (l, &id) in batch.iter().enumerate() {
                footprints.set(RGB, l, casters.extinction(id as usize).rgb);
            }
            queues.push(footprints, batch, others);
            for queue in queues.ready(batch.is_empty()) {
                self.overlap(queue);
                queue.advance();
            }
        }
    }

    /// Entries of the first footprints of a queue; those with the columns of a plane lie on it.
    #[inline(always)]
    pub(crate) fn overlap<const F: usize>(&mut self, queue: &Queue<F>) {
        let n = queue.lanes();
        let [at, slant, distance] = [AT, SLANT, DISTANCE].map(|f| queue.column(f));
        let mut rows = Axes::new(queue.column(AT + 1), queue.column(HALF + 1));
        let mut columns = Axes::new(at, queue.column(HALF));
        let has_slant = slant[..n].iter().any(|s| *s != 0.0);
        let start = columns.below;
        let mut height = [0.0; LANES];
        let mut middle = [0.0; LANES];
        for j in 0..rows.most_cells(n) {
            for l in 0..LANES {
                height[l] = rows.next_share(l, j);
                let axis = rows.get(l);
                middle[l] = at[l] + slant[l] * axis.centre(axis.start() + j as f32, height[l]);
            }
            if has_slant {
                columns.shift(&middle);
            } else {
                columns.below = start;
            }
            for k in 0..columns.most_cells(n) {
                let mut cells = self.cells(queue.column(TOTAL), &rows, &height, &mut columns, [j, k]);
                cells.is_kept[n..].fill(false);
                let on_plane;
                let distance = if F > FOOTPRINT {
                    on_plane = plane_distances(self.mapping, queue, &cells, distance);
                    &on_plane
                } else {
                    distance
                };
                self.hide(&mut cells, distance);
                self.entries.extend_kept(&cells, distance, [0, 1, 2].map(|c| queue.column(RGB + c)));
            }
        }
    }

    /// Returns the cell in row `place[0]` and column `place[1]` of each footprint.
    #[inline(always)]
    fn cells(&self, total: &Lane, rows: &Axes, height: &Lane, columns: &mut Axes, place: [i32; 2]) -> Cells {
        let [j, k] = place;
        let width = self.mapping.size()[0];
        let mut cells = Cells { cell: [0; LANES], absorbance: [0.0; LANES], is_kept: [false; LANES] };
        for l in 0..LANES {
            let share = columns.next_share(l, k);
            let [column, row] = [columns.first[l].wrapping_add(k), rows.first[l].wrapping_add(j)];
            let inverse_measure = self.mapping.inverse_measure(column as u32, row as u32);
            cells.absorbance[l] = total[l] * (share * height[l]) * inverse_measure;
            cells.cell[l] = (row as u32).wrapping_mul(width).wrapping_add(column as u32);
            cells.is_kept[l] = (column <= columns.last[l]) & (row <= rows.last[l]);
        }
        cells
    }

    /// Takes out footprints that lie behind the ends of all their cells.
    #[inline(always)]
    fn leave_out_dark(&self, footprints: &mut Columns<FOOTPRINT>, n: usize) {
        if self.ends.is_empty() {
            return;
        }
        for l in 0..n {
            if footprints.side[l] <= 0 {
                continue;
            }
            let [x, y, half_x, half_y, slant, _, distance] = std::array::from_fn(|f| footprints.column[AT + f][l]);
            let reach = Vec2::new(half_x + slant.abs() * half_y, half_y);
            if is_dark(self.ends, self.mapping.size(), Vec2::new(x, y), reach, distance) {
                footprints.side[l] = 0;
            }
        }
    }

    /// Drops what lies behind the ends of cells.
    #[inline(always)]
    fn hide(&self, cells: &mut Cells, distance: &Lane) {
        if self.ends.is_empty() {
            return;
        }
        for l in 0..LANES {
            let nearest = self.ends.get(cells.cell[l] as usize).copied().unwrap_or(f32::INFINITY);
            cells.is_kept[l] &= nearest >= distance[l];
        }
    }
}

/// Whether all cells within `reach` of a place end before a distance; never where that leaves the table, which may go on at another edge.
#[inline(always)]
pub(crate) fn is_dark(ends: &[f32], size: [u32; 2], at: Vec2, reach: Vec2, distance: f32) -> bool {
    let [columns, rows] = size;
    let low = at - reach;
    let high = at + reach;
    let is_inside = (low.x >= 0.0) & (low.y >= 0.0) & (high.x < columns as f32) & (high.y < rows as f32);
    if !is_inside {
        return false;
    }
    // Loops, not closures: these would be calls in code for vectors.
    for row in low.y as usize..=high.y as usize {
        let row = row * columns as usize;
        for end in &ends[row + low.x as usize..=row + high.x as usize] {
            if *end >= distance {
                return false;
            }
        }
    }
    true
}

/// Up to [`LANES`] splats in the light's frame; lanes without one keep what they had.
#[inline(always)]
fn load(splats: &mut Columns<SPLAT>, casters: &Casters<'_>, ids: &[u32], frame: &Frame) {
    let cloud = casters.cloud;
    for (l, &id) in ids.iter().enumerate().take(LANES) {
        let i = id as usize;
        let p = cloud.position[i];
        let deviation = casters.kernel(i).deviation;
        splats.set(POSITION, l, [p.x, p.y, p.z, cloud.radius[i], cloud.cross_section[i], deviation]);
    }
    let [x, y, z, radius, cross_section, _] = &mut splats.column;
    for l in 0..LANES {
        let p = frame.position(Vec3::new(x[l], y[l], z[l]));
        (x[l], y[l], z[l]) = (p.x, p.y, p.z);
        radius[l] = frame.length(radius[l]);
        cross_section[l] = frame.area(cross_section[l]);
    }
}

/// Footprints of media on the table.
#[inline(always)]
fn fill<M: Mapping>(footprints: &mut Columns<FOOTPRINT>, mapping: &M, wide: Band, splats: &Columns<SPLAT>) {
    let parallel = mapping.is_parallel();
    let [x, y, z] = [0, 1, 2].map(|k| &splats.column[POSITION + k]);
    let [radius, cross_section, deviation] = [RADIUS, CROSS_SECTION, DEVIATION].map(|f| &splats.column[f]);
    for l in 0..LANES {
        let view = mapping.view(Vec3::new(x[l], y[l], z[l]));
        let distance = view.place.distance;
        let spread = Spread::of_ball(radius[l], view.gradients);
        let angle = if parallel { 0.0 } else { radius[l] / distance };
        let (shape, side) = plain_footprint(mapping, wide, &view, spread, angle, deviation[l]);
        footprints.set(AT, l, shape);
        footprints.set(TOTAL, l, [cross_section[l] / if parallel { 1.0 } else { distance * distance }, distance]);
        footprints.side[l] = side;
    }
}

/// Columns from [`AT`] to [`SLANT`], and the greatest number of cells along a side, negative for what is not plain.
#[inline(always)]
pub(crate) fn plain_footprint<M: Mapping>(
    mapping: &M,
    wide: Band,
    view: &View,
    spread: Spread,
    angle: f32,
    deviation: f32,
) -> ([f32; 5], i32) {
    let at = view.place.at;
    let [columns, rows] = mapping.size().map(|n| n as f32);
    let Widths { half, slant } = Ellipse { at, spread, deviation }.widths();
    let reach = Vec2::new(half[0] + slant.abs() * half[1], half[1]);
    let low = at - reach;
    let high = at + reach;
    let is_inside = (low.x >= 1.0) & (low.y >= 1.0) & (high.x <= columns - 1.0) & (high.y <= rows - 1.0);
    let is_plain = view.is_seen & is_inside & is_plain(mapping, wide, at, spread, angle);
    // Numbers of any size, which the others may have, count no cells.
    let (at, half) = if is_plain { (at, half) } else { (Vec2::ZERO, [1.0; 2]) };
    let [across, along] = [Axis::new(at.x, half[0]), Axis::new(at.y, half[1])];
    let width = if slant == 0.0 { across.last - across.first + 1 } else { across.most_cells() };
    let side = width.max(along.last - along.first + 1);
    ([at.x, at.y, half[0], half[1], slant], if is_plain & (side <= MOST) { side } else { -1 })
}
