//! Tiles of an image, each of which one task resolves.

/// Side of a tile, pixels: its depths fit the first cache.
pub(crate) const TILE: usize = 64;

/// Pixels of a tile.
pub(crate) const AREA: usize = TILE * TILE;

/// Tiles of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tiling {
    pub(crate) size: [usize; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Tiling {
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let size = size.map(|s| s as usize);
        Self { size, columns: size[0].div_ceil(TILE), rows: size[1].div_ceil(TILE) }
    }

    pub(crate) fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    /// Where pixel (x, y) stands in tile order.
    pub(crate) fn index(&self, x: usize, y: usize) -> usize {
        (y / TILE * self.columns + x / TILE) * AREA + y % TILE * TILE + x % TILE
    }
}

/// Tile of a pixel, and the place in the tile as a record has it; `within` are two of 8 bits.
#[inline(always)]
pub(crate) fn place(x: u32, y: u32, within: u32, columns: u32) -> (u32, u32) {
    const SIDE: u32 = TILE as u32;
    let tile = (y / SIDE).wrapping_mul(columns).wrapping_add(x / SIDE);
    (tile, (y % SIDE * SIDE + x % SIDE) | ((within & 0xffff) << 12))
}
