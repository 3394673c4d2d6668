//! Squares of the image that are drawn one by one.

use splat_core::Camera;

/// Side of a tile, pixels.
pub(crate) const TILE: usize = 48;

/// Side with the rim of one pixel that gradients are taken from.
pub(crate) const SIDE: usize = TILE + 2;

/// Pixels with the rim.
pub(crate) const AREA: usize = SIDE * SIDE;

/// Tiles of an image, columns and rows.
pub(crate) fn tiles(camera: &Camera) -> [usize; 2] {
    camera.size.map(|s| (s as usize).div_ceil(TILE))
}
