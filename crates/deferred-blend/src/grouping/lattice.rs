//! Cells in which discs of one neighbourhood find one another. They are few and fixed, so no cell has to be searched for.

use super::surfels::{MORE, Surfel};
use splat_core::glam::{DVec3, Vec3};

/// Cells along an axis.
const CELLS: usize = 32;

/// Cells as wide as two discs may lie apart that overlap. Every thirty-second along an axis is the same one: discs of it that lie far from one
/// another are told apart by their distance.
#[derive(Default)]
pub(crate) struct Lattice {
    least: DVec3,
    width: f64,
    /// First disc of each cell, and the end of the last.
    starts: Vec<u32>,
    discs: Vec<Disc>,
}

/// Data of a disc for the first test of an overlap.
#[derive(Clone, Copy, Default)]
struct Disc {
    center: Vec3,
    reach: f32,
    number: u32,
}

impl Lattice {
    /// Takes the discs of a neighbourhood, those before having gone.
    pub(crate) fn fill(&mut self, surfels: &[Surfel]) {
        self.least = surfels.iter().fold(Vec3::MAX, |low, s| low.min(s.center)).as_dvec3();
        // Wider by what a quotient may be rounded.
        self.width = 2.0 * f64::from(surfels.iter().map(|s| s.reach).fold(0.0, f32::max)) * (1.0 + 1e-9);
        self.starts.clear();
        self.starts.resize(CELLS.pow(3) + 1, 0);
        let cells: Vec<usize> = surfels.iter().map(|s| cell(self.place(s.center), [1; 3])).collect();
        cells.iter().for_each(|&cell| self.starts[cell] += 1);
        let mut end = 0;
        self.starts.iter_mut().for_each(|start| {
            end += *start;
            *start = end;
        });
        self.discs.clear();
        self.discs.resize(surfels.len(), Disc::default());
        // From the end of each cell to its start, which is left in `starts`.
        for (number, (surfel, cell)) in surfels.iter().zip(cells).enumerate().rev() {
            self.starts[cell] -= 1;
            let disc = Disc { center: surfel.center, reach: surfel.reach, number: number as u32 };
            self.discs[self.starts[cell] as usize] = disc;
        }
    }

    fn place(&self, center: Vec3) -> [u64; 3] {
        // `as` saturates, which joins cells that are more than 10¹⁹ widths away.
        ((center.as_dvec3() - self.least) / self.width).to_array().map(|v| v as u64)
    }

    /// Lists the numbers of all discs that overlap one, and of some that do not.
    pub(crate) fn near(&self, surfel: &Surfel, near: &mut Vec<u32>) {
        near.clear();
        let mut add = |first: usize, last: usize| {
            let discs = &self.discs[self.starts[first] as usize..self.starts[last + 1] as usize];
            surfel.add_near(discs.iter().map(|disc| (disc.number, disc.center, disc.reach)), MORE, near);
        };
        let place = self.place(surfel.center);
        for row in 0..9 {
            let [left, middle, right] = [0, 1, 2].map(|x| cell(place, [x, row % 3, row / 3]));
            if left + 2 == right {
                add(left, right);
            } else {
                [left, middle, right].into_iter().for_each(|cell| add(cell, cell));
            }
        }
    }
}

/// The cell around a place, 1 being the middle; x runs fastest.
fn cell(place: [u64; 3], around: [u64; 3]) -> usize {
    let [x, y, z] = [0, 1, 2].map(|axis| (place[axis].wrapping_add(around[axis]).wrapping_sub(1)) as usize % CELLS);
    (z * CELLS + y) * CELLS + x
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    /// Discs of many sizes, spread over several times as many cells as there are.
    #[test]
    fn whoever_overlaps_is_found_once() {
        let u = |i: u64, n| rng::unit_f32(5, 0, i, n);
        let disc = |i| {
            let reach = u(i, 3) * u(i, 4);
            let center = Vec3::new(100.0 * u(i, 0), 100.0 * u(i, 1), 0.5 * u(i, 2));
            Surfel { center, reach, across: reach, normal: Vec3::Z, ..Surfel::default() }
        };
        let discs: Vec<Surfel> = (0..8000).map(disc).collect();
        let mut lattice = Lattice::default();
        let mut near = Vec::new();
        let mut count = 0;
        // What was there before has gone.
        lattice.fill(&discs[..10]);
        lattice.fill(&discs);
        for disc in &discs {
            lattice.near(disc, &mut near);
            let overlaps = |n: &u32| disc.overlaps(&discs[*n as usize], 1.0);
            let mut found: Vec<u32> = near.iter().copied().filter(overlaps).collect();
            found.sort_unstable();
            assert_eq!(found, (0..8000).filter(overlaps).collect::<Vec<_>>());
            count += found.len();
        }
        assert!(count > 10_000, "{count}");
    }
}
