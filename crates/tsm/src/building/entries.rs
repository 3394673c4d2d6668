//! Entries as splats leave them, before they are parted by cells.

use crate::building::lanes::{LANES, Lane};
use crate::building::shares::BLOCK;

/// Entries in the order in which splats made them; what lies behind `len` is left over.
#[derive(Debug, Default)]
pub(crate) struct Entries<const C: usize> {
    pub(crate) len: usize,
    pub(crate) cell: Vec<u32>,
    pub(crate) distance: Vec<f32>,
    pub(crate) absorbance: Vec<[f32; C]>,
}

impl<const C: usize> Entries<C> {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    fn grow(&mut self) {
        if self.len + LANES > self.cell.len() {
            let room = (2 * self.len).max(16_384);
            self.cell.resize(room, 0);
            self.distance.resize(room, 0.0);
            self.absorbance.resize(room, [0.0; C]);
        }
    }

    /// Adds one entry, whose absorbance is `absorbance`·`rgb` by channel.
    #[inline(always)]
    pub(crate) fn push(&mut self, cell: u32, distance: f32, absorbance: f32, rgb: &[f32; 3]) {
        self.grow();
        let i = self.len;
        self.cell[i] = cell;
        self.distance[i] = distance;
        self.absorbance[i] = std::array::from_fn(|c| absorbance * rgb[c]);
        self.len += 1;
    }

    /// Adds entries at one distance in the `used` ≤ `BLOCK` cells from `cell` on.
    #[inline(always)]
    pub(crate) fn extend(&mut self, cell: u32, distance: f32, used: usize, absorbance: &[f32; BLOCK], rgb: &[f32; 3]) {
        self.grow();
        // Whole blocks, without a loop: what is not used is written over.
        let range = self.len..self.len + BLOCK;
        self.cell[range.clone()].copy_from_slice(&std::array::from_fn::<_, BLOCK, _>(|k| cell + k as u32));
        self.distance[range.clone()].copy_from_slice(&[distance; BLOCK]);
        let absorbance: [[f32; C]; BLOCK] = absorbance.map(|a| std::array::from_fn(|c| a * rgb[c]));
        self.absorbance[range].copy_from_slice(&absorbance);
        self.len += used;
    }

    /// Adds the cells that are kept, at a distance and for a colour of each.
    #[inline(always)]
    pub(crate) fn extend_kept(&mut self, cells: &Cells, distance: &Lane, rgb: [&Lane; 3]) {
        self.grow();
        let range = self.len..self.len + LANES;
        let to_cell = &mut self.cell[range.clone()];
        let to_distance = &mut self.distance[range.clone()];
        let to_absorbance = &mut self.absorbance[range];
        if cells.is_kept.iter().fold(true, |kept, next| kept & next) {
            to_cell.copy_from_slice(&cells.cell);
            to_distance.copy_from_slice(distance);
            (0..LANES).for_each(|l| to_absorbance[l] = std::array::from_fn(|c| cells.absorbance[l] * rgb[c][l]));
            self.len += LANES;
            return;
        }
        // Without a branch: what is not kept is written over.
        let mut kept = 0;
        for l in 0..LANES {
            to_cell[kept] = cells.cell[l];
            to_distance[kept] = distance[l];
            to_absorbance[kept] = std::array::from_fn(|c| cells.absorbance[l] * rgb[c][l]);
            kept += usize::from(cells.is_kept[l]);
        }
        self.len += kept;
    }
}

/// One cell of each of many footprints.
#[derive(Debug)]
pub(crate) struct Cells {
    pub(crate) cell: Lane<u32>,
    /// Absorbance.
    pub(crate) absorbance: Lane,
    pub(crate) is_kept: Lane<bool>,
}
