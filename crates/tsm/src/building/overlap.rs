//! Overlap of a footprint with cells in closed form, row by row.
//!
//! To first order the map takes a footprint to an ellipse in table coordinates. Along v it is a triweight of the ellipse's
//! variance, whose share and centre in each row are exact ([`crate::building::shares`]); within a row it is a triweight about the
//! ellipse's slant line at that centre, of the variance that is left:
//!
//! u(v) = u₀ + (C_uv/C_vv)(v − v₀), C_uu|v = C_uu − C_uv²/C_vv + (C_uv/C_vv)²·h²/12 with a row of height h
//!
//! An edge between octants of a folded table bends the ellipse. There each side of the edge has an ellipse of its own,
//! by the derivatives of its own octant, and takes the cells on its side; the shares are then scaled to sum to 1. A
//! footprint that only touches an edge is the same with and without it.

use crate::building::caster::Caster;
use crate::building::shares::{Axis, BLOCK, HALF_WIDTH};
use crate::mapping::Crease;
use glam::{Vec2, Vec3};
use splat_core::{SplatKind, glam};

/// Least half width of a footprint, cells.
const LEAST_HALF: f32 = 1e-4;
/// Footprints that lean by fewer cells than this over their height count as upright, by twice as many as leaning.
const UPRIGHT: f32 = 0.02;
/// A uniform row of height 1 has a variance of 1/12; in squared half widths of a triweight that is 9/12.
const ROW_WIDTH: f32 = 9.0 / 12.0;

/// Squared extents of a footprint in table coordinates: along columns, rows, and their product.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spread {
    uu: f32,
    vv: f32,
    uv: f32,
}

impl Spread {
    /// From the centre to where the kernel ends.
    #[inline(always)]
    pub(crate) fn new(caster: &Caster, axes: [Vec3; 2]) -> Self {
        let [gu, gv] = axes;
        if caster.kind == SplatKind::Medium {
            return Self::of_ball(caster.radius, [gu, gv]);
        }
        Self::of_disc(caster.axes, [gu, gv])
    }

    #[inline(always)]
    pub(crate) fn of_disc(axes: [Vec3; 2], gradients: [Vec3; 2]) -> Self {
        let [gu, gv] = gradients;
        let u = axes.map(|a| gu.dot(a));
        let v = axes.map(|a| gv.dot(a));
        Self { uu: u[0] * u[0] + u[1] * u[1], vv: v[0] * v[0] + v[1] * v[1], uv: u[0] * v[0] + u[1] * v[1] }
    }

    #[inline(always)]
    pub(crate) fn of_ball(radius: f32, axes: [Vec3; 2]) -> Self {
        let [gu, gv] = axes;
        let square = radius * radius;
        Self { uu: gu.length_squared() * square, vv: gv.length_squared() * square, uv: gu.dot(gv) * square }
    }

    /// Half the width and half the height.
    #[inline(always)]
    pub(crate) fn half_extents(self) -> Vec2 {
        Vec2::new(self.uu.sqrt(), self.vv.sqrt())
    }

    /// Whether it is no wider and no higher than a table of this size.
    #[inline(always)]
    pub(crate) fn is_within(self, size: [u32; 2]) -> bool {
        let [u, v] = size.map(|n| n as f32);
        (self.uu <= u * u) & (self.vv <= v * v)
    }

    /// No wider and no higher than a table of this size.
    #[inline(always)]
    pub(crate) fn within(self, size: [u32; 2]) -> Self {
        let [u, v] = size.map(|n| n as f32);
        let [fu, fv] = [(u * u / self.uu).min(1.0), (v * v / self.vv).min(1.0)];
        Self { uu: self.uu * fu, vv: self.vv * fv, uv: self.uv * (fu * fv).sqrt() }
    }

    /// The ellipse under a linear map of the table, given by its rows.
    fn mapped(self, rows: [Vec2; 2]) -> Self {
        let [a, b] = rows;
        let product = |a: Vec2, b: Vec2| a.x * b.x * self.uu + (a.x * b.y + a.y * b.x) * self.uv + a.y * b.y * self.vv;
        Self { uu: product(a, a), vv: product(b, b), uv: product(a, b) }
    }
}

/// Two triweights, one along the rows' axis and one within a row, about a slant line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Widths {
    /// Half widths within a row and across rows, in cells.
    pub(crate) half: [f32; 2],
    /// Columns by which the middle moves from a row to the next.
    pub(crate) slant: f32,
}

/// An ellipse in table coordinates whose overlap with cells is wanted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ellipse {
    pub(crate) at: Vec2,
    /// From the centre to where the kernel ends.
    pub(crate) spread: Spread,
    /// Standard deviation of the kernel over its radius.
    pub(crate) deviation: f32,
}

impl Ellipse {
    /// The triweights whose product it becomes.
    #[inline(always)]
    pub(crate) fn widths(&self) -> Widths {
        let Spread { uu, vv, uv } = self.spread;
        let square = (HALF_WIDTH * self.deviation) * (HALF_WIDTH * self.deviation);
        let half_v = (vv * square).sqrt().max(LEAST_HALF);
        let mut slant = uv * square / (half_v * half_v);
        slant *= (slant.abs() * half_v * (1.0 / UPRIGHT) - 1.0).clamp(0.0, 1.0);
        // What is left of the width within a row: off the slant, and along it over the row's height.
        let height = (2.0 * half_v).min(1.0);
        let off = (uu * square - slant * (uv * square)).max(0.0);
        let half_u = (off + slant * slant * height * height * ROW_WIDTH).sqrt().max(LEAST_HALF);
        Widths { half: [half_u, half_v], slant }
    }

    /// Gives all rows to `sink`.
    #[inline(always)]
    pub(crate) fn overlap(&self, sink: &mut impl Sink) {
        let Widths { half: [half_u, half_v], slant } = self.widths();
        let rows = Axis::new(self.at.y, half_v);
        let mut columns = Axis::new(self.at.x, half_u);
        let mut block = columns.shares(columns.first);
        let mut begin = rows.first;
        while begin <= rows.last {
            let heights = rows.shares(begin);
            let centres = if slant == 0.0 { [0.0; BLOCK] } else { rows.centres(begin, &heights) };
            let count = (rows.last - begin + 1).min(BLOCK as i32) as usize;
            for ((j, height), centre) in (begin..).zip(&heights[..count]).zip(&centres) {
                if slant != 0.0 {
                    columns = columns.moved(self.at.x + slant * centre);
                    block = columns.shares(columns.first);
                }
                let used = columns.last - columns.first + 1;
                let axes = [&columns, &rows];
                sink.row(j, columns.first, (used as usize).min(BLOCK), &block.map(|s| s * height), axes);
                for first in (columns.first..=columns.last).skip(BLOCK).step_by(BLOCK) {
                    let used = (columns.last - first + 1) as usize;
                    sink.row(j, first, used.min(BLOCK), &columns.shares(first).map(|s| s * height), axes);
                }
            }
            begin += BLOCK as i32;
        }
    }

    /// Gives the cells on both sides of an edge between octants to `cell`, by column, row and share.
    pub(crate) fn overlap_creased(&self, crease: &Crease, mut cell: impl FnMut(i32, i32, f32)) {
        let cell: &mut dyn FnMut(i32, i32, f32) = &mut cell;
        self.overlap(&mut OneSide { crease, is_near: true, cell });
        let far = Self { at: crease.at, spread: self.spread.mapped(crease.jacobian), ..*self };
        far.overlap(&mut OneSide { crease, is_near: false, cell });
    }
}

/// Takes shares row by row.
pub(crate) trait Sink {
    /// Shares of `BLOCK` columns from `first` on, of which `used` ≤ `BLOCK` may differ from 0, and the footprint within
    /// the row and across rows.
    fn row(&mut self, row: i32, first: i32, used: usize, shares: &[f32; BLOCK], axes: [&Axis; 2]);
}

/// Keeps what lies on one side of an edge.
struct OneSide<'a> {
    crease: &'a Crease,
    is_near: bool,
    cell: &'a mut dyn FnMut(i32, i32, f32),
}

impl Sink for OneSide<'_> {
    fn row(&mut self, row: i32, first: i32, used: usize, shares: &[f32; BLOCK], axes: [&Axis; 2]) {
        for (column, &share) in (first..).zip(&shares[..used]) {
            let side = self.crease.side(column, row);
            let near = if side == 0.0 { near_half(self.crease, axes, column, row).min(share) } else { share };
            let near = if side < 0.0 { 0.0 } else { near };
            let part = if self.is_near { near } else { share - near };
            if part > 0.0 {
                (self.cell)(column, row, part);
            }
        }
    }
}

/// Share of a footprint in the near half of a cell that a diagonal halves: strips of rows up to the diagonal.
fn near_half(crease: &Crease, axes: [&Axis; 2], column: i32, row: i32) -> f32 {
    let [columns, rows] = axes;
    const STRIPS: i32 = 4;
    let [a, b, _] = crease.line;
    let low = column as f32 - columns.at;
    let [left, right] = [low, low + 1.0].map(|edge| columns.below(edge));
    let strip = |k: i32| {
        let [bottom, top] = [k, k + 1].map(|k| rows.below(row as f32 + k as f32 / STRIPS as f32 - rows.at));
        // a and b are of equal size.
        let cut = columns.below(low + 0.5 - b / a * ((k as f32 + 0.5) / STRIPS as f32 - 0.5));
        (top - bottom) * if a > 0.0 { right - cut } else { cut - left }
    };
    (0..STRIPS).map(strip).sum()
}
