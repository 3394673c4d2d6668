//! Blocks of pixels of a light's image: what they tell of all places in a box at once, whether these are lit or dark.

use super::light_layers::LightLayers;

/// Sides of blocks, pixels; the small ones are asked first.
const SIDES: [usize; 2] = [4, 16];

/// Most blocks of a side that are asked.
const MOST_BLOCKS: usize = 36;

/// Bytes of blocks for each pixel, at most: those of an image of 16 pixels a side take 0.6.
pub(super) const BYTES_OF_A_PIXEL: u64 = 1;

/// Blocks of one side.
struct Level {
    side: usize,
    columns: usize,
    blocks: Vec<Depths>,
}

/// What a block shows.
#[derive(Clone, Copy)]
struct Depths {
    /// Least depth of anything that casts shadows.
    nearest: f32,
    /// Greatest depth of what is opaque; infinite where some pixel shows nothing opaque.
    farthest: f32,
}

/// Where places lie in a light's image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Least pixel coordinates.
    pub(super) low: [f32; 2],
    /// Greatest pixel coordinates.
    pub(super) high: [f32; 2],
    /// Least depth.
    pub(super) near: f32,
    /// Greatest depth.
    pub(super) far: f32,
}

/// The blocks of an image.
pub(super) struct LightBlocks {
    size: [usize; 2],
    levels: [Level; SIDES.len()],
}

impl LightBlocks {
    /// Those of the depths of opaque polygons, row by row, and of the translucent ones before them.
    pub(super) fn new(depth: &[f32], size: [usize; 2], layers: Option<&LightLayers>) -> Self {
        let [width, height] = size;
        let level = |side: usize| {
            let columns = width.div_ceil(side);
            let none = Depths { nearest: f32::INFINITY, farthest: f32::NEG_INFINITY };
            let mut blocks = vec![none; columns * height.div_ceil(side)];
            for (k, opaque) in depth.iter().enumerate() {
                let first = layers.and_then(|layers| layers.first(k)).unwrap_or(f32::INFINITY);
                let block = &mut blocks[k / width / side * columns + k % width / side];
                block.nearest = block.nearest.min(*opaque).min(first);
                block.farthest = block.farthest.max(*opaque);
            }
            Level { side, columns, blocks }
        };
        Self { size, levels: SIDES.map(level) }
    }

    /// Bytes that they take.
    pub(super) fn bytes(&self) -> u64 {
        let blocks: usize = self.levels.iter().map(|level| level.blocks.len()).sum();
        (blocks * size_of::<Depths>()) as u64
    }

    /// Whether all places of an extent are lit, or none is; `None` where some may be and others not. Planes of pixels are followed by `reach` at most.
    pub(super) fn whole(&self, extent: &Extent, reach: f32) -> Option<bool> {
        self.levels.iter().find_map(|level| self.asked(level, extent, reach))
    }

    fn asked(&self, level: &Level, extent: &Extent, reach: f32) -> Option<bool> {
        let [columns, rows] = [0, 1].map(|axis| {
            // A look-up asks the pixels about a place.
            let block = |v: f32| (v.max(0.0) as usize).min(self.size[axis] - 1) / level.side;
            block(extent.low[axis] - 1.0)..block(extent.high[axis] + 1.0) + 1
        });
        if columns.len() * rows.len() > MOST_BLOCKS {
            return None;
        }
        let mut is_lit = true;
        let mut is_dark = true;
        for y in rows {
            for block in &level.blocks[y * level.columns..][columns.clone()] {
                is_lit &= block.nearest > extent.far + reach;
                is_dark &= block.farthest < extent.near - reach;
            }
            if !(is_lit || is_dark) {
                return None;
            }
        }
        Some(is_lit)
    }
}
